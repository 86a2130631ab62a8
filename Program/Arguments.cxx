// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "Arguments.h"

#include "ByteCount.h"
#include "Commands.h"
#include "ImageInput.h"

#include <memory>
#include <optional>
#include <vector>

namespace teravox::program
{

/// An option that takes a number of bytes with a unit.
CLI::Option* AddBytes(
  CLI::App* app, const std::string& name, std::uint64_t& bytes, const std::string& description)
{
  return app
    ->add_option_function<std::string>(
      name,
      [&bytes, name](const std::string& text)
      {
        const auto parsed = ParseByteCount(text);
        if (!parsed)
        {
          throw CLI::ValidationError(
            name, "'" + text + "' isn't a number of bytes such as 512M or 4G");
        }
        bytes = *parsed;
      },
      description)
    ->type_name("BYTES");
}

/// Which volume of an HDF5 file.
void AddSelection(CLI::App* command, std::string& dataset, int& channel, int& timePoint)
{
  command->add_option("--dataset", dataset,
    "Dataset or group in an HDF5 file, UID of a DICOM series; default what the file says");
  command
    ->add_option_function<std::string>(
      "--channel",
      [&channel](const std::string& text)
      {
        int number = -1;
        if (text != "all" && (!CLI::detail::lexical_cast(text, number) || number < 0))
        {
          throw CLI::ValidationError("--channel", "'" + text + "' is neither a number nor all");
        }
        channel = number;
      },
      "Channel, counted from 0, or all (at most 4, as components); default 0")
    ->type_name("N");
  command->add_option("--time", timePoint, "Time point, counted from 0; default 0")
    ->check(CLI::NonNegativeNumber)
    ->type_name("N");
}

namespace
{
/// What a file doesn't say itself.
void AddImport(CLI::App* command, ConvertOptions& options)
{
  ImportOptions& import = options.Import;
  command->add_flag(
    "--raw", import.Raw, "The input is voxels without a header, x fastest; implied by .raw");
  command->add_option("--dimensions", options.Input.Dimensions,
    "Voxels of raw data or a formula along x, y, z; default of a formula 256 256 256");
  command->add_option("--type", options.Input.Type,
    "Scalar type of raw data or a formula: u8, i8, ... f64; default u8");
  command->add_option("--components", import.Components, "Values per voxel of raw data; default 1")
    ->check(CLI::Range(1, 4));
  command
    ->add_option("--header", import.Header,
      "Bytes before raw data, -1: they end the file; default 0, the file has no more than the "
      "voxels")
    ->check(CLI::Range(std::int64_t{ -1 }, std::int64_t{ 1 } << 60));
  command->add_flag("--big-endian", import.BigEndian, "Raw data have the highest byte first");
  const auto place = [command](const char* name, std::optional<Double3>& to, const char* text)
  {
    command->add_option_function<Double3>(
      name, [&to](const Double3& v) { to = v; }, text);
  };
  place("--spacing", import.Spacing, "Distance of voxels along x, y, z instead of the file's");
  place("--origin", import.Origin, "Place of the first voxel instead of the file's");
}

} // namespace

Run AddConvert(CLI::App& app)
{
  auto options = std::make_shared<ConvertOptions>();
  CLI::App* command =
    app.add_subcommand("convert", "Write a volume as an HDF5 pyramid, in bounded memory");
  command
    ->add_option("input", options->Input.Name,
      "NIfTI, MetaImage, NRRD, MRC, TIFF, PNG, JPEG, DICOM, VTK, HDF5 or raw file; a folder of "
      "DICOM, TIFF, PNG, JPEG, PNM, BMP or TGA files, or a pattern (slice*.tif, slice%03d.png); or "
      "formula:NAME")
    ->required()
    ->type_name("IN");
  command
    ->add_option("output", options->Output,
      "HDF5 file to write; default for an HDF5 input: IN.teravox.h5, which is then read instead of "
      "its one level")
    ->type_name("OUT.h5");
  command->parse_complete_callback(
    [options, command]
    {
      if (options->Output.empty() && !IsHDF5Name(options->Input.Name))
      {
        throw CLI::RequiredError("output");
      }
      if (IsRaw(options->Input, options->Import) && command->count("--dimensions") == 0)
      {
        throw CLI::RequiredError("--dimensions");
      }
    });
  AddBytes(command, "--memory", options->Memory, "Memory to use; default 1G");
  command->add_option(
    "--brick", options->BrickSize, "Edge of a stored chunk in voxels; default 64");
  command->add_option("--compression", options->Compression, "none, deflate or lz4; default lz4")
    ->check(CLI::IsMember({ "none", "deflate", "lz4" }));
  command
    ->add_option(
      "--level", options->CompressionLevel, "Effort of the compression, 1 (fast) to 12 (small)")
    ->check(CLI::Range(0, 12));
  command
    ->add_option("--downsampling", options->Downsampling,
      "How coarser levels are made: average, or mode for labels; default average")
    ->check(CLI::IsMember({ "average", "mode" }));
  command->add_option("--fill", options->FillValue, "Value that needn't be stored; default 0");
  command->add_option("--array", options->Array, "Array of the input; default its active scalars");
  AddSelection(command, options->Input.Dataset, options->Input.Channel, options->Input.TimePoint);
  AddImport(command, *options);
  command->add_flag("--resume", options->Resume,
    "Go on where the same command was killed, and when it is interrupted leave what it has");
  command->add_flag("--quiet", options->Quiet, "Print errors only");
  return [options] { return RunConvert(*options); };
}

} // namespace teravox::program
