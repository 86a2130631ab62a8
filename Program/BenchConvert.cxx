// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// What a conversion costs beside a plain copy of the same file, in turns. Both read a warm file,
// and both end when the new file is on the disk under its name: written beside it, fsync, rename,
// fsync of the folder.
#include "BenchClock.h"
#include "BenchGrey.h"
#include "ByteCount.h"
#include "Commands.h"
#include "Interrupt.h"
#include "TemporaryFolder.h"

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <fmt/format.h>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <system_error>
#include <unistd.h>
#include <vector>

namespace teravox::program
{
namespace
{

using Json = nlohmann::ordered_json;

constexpr std::size_t CopyBlock = std::size_t{ 1 } << 20;
constexpr std::int64_t SlabOfSlices = 16;

Status CantWrite(const std::string& file)
{
  return { StatusCode::InputOutput, fmt::format("{} can't be written.", file) };
}

std::string MetaImageHeader(ScalarType type, int edge)
{
  const char* name = type == ScalarType::UInt8 ? "MET_UCHAR"
    : type == ScalarType::UInt16               ? "MET_USHORT"
                                               : "MET_FLOAT";
  return fmt::format("ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = "
                     "False\nCompressedData = False\nDimSize = {0} {0} {0}\nElementSpacing = 1 1 "
                     "1\nElementType = {1}\nElementDataFile = LOCAL\n",
    edge, name);
}

/// NIfTI-1, one file.
std::string NIfTIHeader(ScalarType type, int edge)
{
  std::string header(352, '\0');
  const auto put = [&header](std::size_t at, auto value)
  { std::memcpy(header.data() + at, &value, sizeof(value)); };
  put(0, std::int32_t{ 348 });
  put(40, std::int16_t{ 3 });
  for (std::size_t a = 1; a < 8; ++a)
  {
    put(40 + 2 * a, static_cast<std::int16_t>(a <= 3 ? edge : 1));
    put(76 + 4 * a, 1.0F);
  }
  const int code = type == ScalarType::UInt8 ? 2 : type == ScalarType::UInt16 ? 512 : 16;
  put(70, static_cast<std::int16_t>(code));
  put(72, static_cast<std::int16_t>(8 * SizeOf(type)));
  put(108, 352.0F);
  std::memcpy(header.data() + 344, "n+1", 4);
  return header;
}

std::string XMLHeader(ScalarType type, int edge)
{
  const char* name = type == ScalarType::UInt8 ? "UInt8"
    : type == ScalarType::UInt16               ? "UInt16"
                                               : "Float32";
  const std::string extent = fmt::format("0 {0} 0 {0} 0 {0}", edge - 1);
  std::string header = fmt::format(
    "<?xml version=\"1.0\"?>\n<VTKFile type=\"ImageData\" version=\"1.0\" "
    "byte_order=\"LittleEndian\" header_type=\"UInt64\">\n<ImageData WholeExtent=\"{0}\" "
    "Origin=\"0 0 0\" Spacing=\"1 1 1\">\n<Piece Extent=\"{0}\"><PointData Scalars=\"scalars\">"
    "<DataArray type=\"{1}\" Name=\"scalars\" format=\"appended\" offset=\"0\"/></PointData>"
    "</Piece></ImageData>\n<AppendedData encoding=\"raw\">_",
    extent, name);
  const auto count = static_cast<std::uint64_t>(edge);
  const std::uint64_t bytes = count * count * count * SizeOf(type);
  header.append(reinterpret_cast<const char*>(&bytes), sizeof(bytes));
  return header;
}

/// A GreyReader's cube as an image file without compression.
Status WriteImage(const std::string& file, const std::string& format, ScalarType type, int edge)
{
  std::ofstream stream(file, std::ios::binary);
  stream << (format == "mha" ? MetaImageHeader(type, edge)
      : format == "nii"      ? NIfTIHeader(type, edge)
                             : XMLHeader(type, edge));
  GreyReader reader(type, edge);
  std::vector<std::byte> slab;
  for (std::int64_t z = 0; z < edge; z += SlabOfSlices)
  {
    const Int3 size{ edge, edge, std::min<std::int64_t>(SlabOfSlices, edge - z) };
    slab.resize(static_cast<std::size_t>(size[0] * size[1] * size[2]) * SizeOf(type));
    reader.ReadBox({ 0, 0, z }, size, slab.data());
    stream.write(
      reinterpret_cast<const char*>(slab.data()), static_cast<std::streamsize>(slab.size()));
  }
  stream << (format == "vti" ? "\n</AppendedData></VTKFile>\n" : "");
  stream.close();
  return stream ? Status() : CantWrite(file);
}

/// What is called a copy here has the same promise as a conversion: after a crash there is the
/// whole file or none. Without the new name a copy would be spared two waits for the disk.
bool Publish(const std::string& temporary, const std::string& name)
{
  const std::string folder = std::filesystem::path(name).parent_path().string();
  const int descriptor = std::rename(temporary.c_str(), name.c_str()) == 0
    ? ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)
    : -1;
  const bool good = descriptor >= 0 && ::fsync(descriptor) == 0;
  if (descriptor >= 0)
  {
    ::close(descriptor);
  }
  return good;
}

/// Read and write by blocks, until the copy is on the disk.
Status CopyPlainly(const std::string& from, const std::string& to)
{
  const std::string temporary = to + ".part";
  const int in = ::open(from.c_str(), O_RDONLY | O_CLOEXEC);
  const int out = ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  std::vector<char> block(CopyBlock);
  bool good = in >= 0 && out >= 0;
  while (good)
  {
    const ssize_t n = ::read(in, block.data(), block.size());
    if (n == 0)
    {
      break;
    }
    good = n > 0 && ::write(out, block.data(), static_cast<std::size_t>(n)) == n;
  }
  good = good && ::fsync(out) == 0;
  if (in >= 0)
  {
    ::close(in);
  }
  good = out >= 0 && ::close(out) == 0 && good;
  return good && Publish(temporary, to) ? Status() : CantWrite(to);
}

struct Duration
{
  double Seconds = 0;
  double CPUSeconds = 0;
};

/// Runs it; the file that it makes is removed afterwards.
template <typename F>
Result<Duration> Time(const std::string& output, const F& f)
{
  const BenchClock clock;
  Status status = f();
  const Duration duration{ clock.Seconds(), clock.CPUSeconds() };
  std::error_code error;
  std::filesystem::remove(output, error);
  if (WasInterrupted())
  {
    return Status(StatusCode::Cancelled, "It was interrupted; its files are removed.");
  }
  return status.Ok() ? Result<Duration>(duration) : Result<Duration>(status);
}

Result<Json> MeasureOne(const ConvertBenchOptions& options, const std::string& folder,
  const std::string& input, const std::string& compression)
{
  const std::string copy = folder + "/copy";
  ConvertOptions convert;
  convert.Input.Name = input;
  convert.Output = folder + "/out.h5";
  convert.Compression = compression;
  convert.Quiet = true;
  std::vector<double> copying;
  std::vector<double> converting;
  std::vector<double> copyingCPU;
  std::vector<double> convertingCPU;
  std::vector<double> ratios;
  for (int i = -1; i < options.Repetitions; ++i)
  {
    const auto copied = Time(copy, [&] { return CopyPlainly(input, copy); });
    if (!copied.Ok())
    {
      return copied.GetStatus();
    }
    const auto converted = Time(convert.Output, [&] { return RunConvert(convert); });
    if (!converted.Ok())
    {
      return converted.GetStatus();
    }
    if (i < 0)
    {
      continue; // warms caches and memory
    }
    copying.push_back(copied.Value().Seconds);
    copyingCPU.push_back(copied.Value().CPUSeconds);
    converting.push_back(converted.Value().Seconds);
    convertingCPU.push_back(converted.Value().CPUSeconds);
    ratios.push_back(copying.back() / converting.back());
  }
  std::error_code error;
  const auto bytes = static_cast<double>(std::filesystem::file_size(input, error));
  Json row;
  row["compression"] = compression;
  row["input_bytes"] = bytes;
  row["copy_seconds"] = MedianOf(copying);
  row["copy_cpu_seconds"] = MedianOf(copyingCPU);
  row["convert_seconds"] = MedianOf(converting);
  row["convert_cpu_seconds"] = MedianOf(convertingCPU);
  row["copy_bytes_per_second"] = bytes / MedianOf(copying);
  row["convert_bytes_per_second"] = bytes / MedianOf(converting);
  row["ratio"] = MedianOf(ratios);
  return row;
}

void PrintHead()
{
  fmt::print("Bytes of the input per second, until the output is on the disk.\n");
  fmt::print("{:<8} {:<6} {:<12} {:>12} {:>12} {:>7} {:>12} {:>12}\n", "format", "type",
    "compression", "copy", "conversion", "share", "copy CPU", "conv. CPU");
}

void PrintRow(const Json& row)
{
  const auto number = [&row](const char* name) { return row.at(name).get<double>(); };
  const auto speed = [&number](const char* name)
  { return fmt::format("{}/s", FormatByteCount(number(name))); };
  fmt::print("{:<8} {:<6} {:<12} {:>12} {:>12} {:>6.0f}% {:>10.2f} s {:>10.2f} s\n",
    row.at("format").get<std::string>(), row.at("type").get<std::string>(),
    row.at("compression").get<std::string>(), speed("copy_bytes_per_second"),
    speed("convert_bytes_per_second"), 100 * number("ratio"), number("copy_cpu_seconds"),
    number("convert_cpu_seconds"));
  std::fflush(stdout);
}

Status MeasureInput(const ConvertBenchOptions& options, const std::string& folder,
  const std::string& format, ScalarType type, Json& rows)
{
  const std::string input = fmt::format("{}/in.{}", folder, format);
  Status status = WriteImage(input, format, type, options.Edge);
  for (std::size_t i = 0; i < options.Compressions.size() && status.Ok(); ++i)
  {
    auto row = MeasureOne(options, folder, input, options.Compressions[i]);
    status = row.GetStatus();
    if (row.Ok())
    {
      Json named;
      named["format"] = format;
      named["type"] = ToString(type);
      named.update(row.Value());
      rows.push_back(named);
      if (!options.Json)
      {
        PrintRow(named);
      }
    }
  }
  std::remove(input.c_str());
  return status;
}

} // namespace

Status RunBenchConvert(const ConvertBenchOptions& options)
{
  CatchInterrupts("");
  const TemporaryFolder folder(options.Folder);
  if (folder.Path().empty())
  {
    return { StatusCode::InputOutput, "There is no folder for temporary files." };
  }
  Json all;
  all["voxels_per_axis"] = options.Edge;
  all["repetitions"] = options.Repetitions;
  all["rows"] = Json::array();
  if (!options.Json)
  {
    PrintHead();
  }
  for (const std::string& format : options.Formats)
  {
    for (const ScalarType type : options.Types)
    {
      Status status = MeasureInput(options, folder.Path(), format, type, all["rows"]);
      if (!status.Ok())
      {
        return status;
      }
    }
  }
  if (options.Json)
  {
    fmt::print("{}\n", all.dump(2));
  }
  return {};
}

} // namespace teravox::program
