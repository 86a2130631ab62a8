// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "Arguments.h"
#include "Commands.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <exception>
#include <fmt/format.h>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace
{

using namespace teravox;
using namespace teravox::program;

/// The exit codes of the program.
enum ExitCode
{
  Succeeded = 0,
  Failed = 1,
  WrongUsage = 2
};

Run AddInfo(CLI::App& app)
{
  auto options = std::make_shared<InfoOptions>();
  CLI::App* command = app.add_subcommand(
    "info", "Tell what an HDF5 file has and how it is understood, without reading voxels");
  command->add_option("file", options->File, "HDF5 file")->required()->type_name("FILE");
  AddSelection(command, options->Dataset, options->Channel, options->TimePoint);
  command->add_flag("--json", options->Json, "Print JSON");
  return [options] { return RunInfo(*options); };
}

Run AddVerify(CLI::App& app)
{
  auto options = std::make_shared<VerifyOptions>();
  CLI::App* command = app.add_subcommand("verify",
    "Read all of an HDF5 file: does every chunk decode, do levels agree with each other, and "
    "voxels with the ranges");
  command->add_option("file", options->Volume.Name, "HDF5 file")->required()->type_name("FILE");
  AddSelection(
    command, options->Volume.Dataset, options->Volume.Channel, options->Volume.TimePoint);
  command->add_flag("--quiet", options->Quiet, "Print what is wrong only");
  return [options] { return RunVerify(*options); };
}

Run AddPlan(CLI::App& app)
{
  auto options = std::make_shared<PlanOptions>();
  CLI::App* command =
    app.add_subcommand("plan", "Tell levels, bricks and GPU memory of a volume of a given size");
  command->add_option("nx", options->Dimensions[0], "Voxels along x")->required();
  command->add_option("ny", options->Dimensions[1], "Voxels along y")->required();
  command->add_option("nz", options->Dimensions[2], "Voxels along z")->required();
  command->add_option_function<std::string>(
    "--type",
    [options](const std::string& text)
    {
      std::string name = text;
      options->Components = 1;
      for (const auto& [prefix, components] :
        std::map<std::string, int>{ { "rgb8", 3 }, { "rgba8", 4 } })
      {
        if (name == prefix)
        {
          name = "u8";
          options->Components = components;
        }
      }
      const auto found = std::find_if(AllScalarTypes.begin(), AllScalarTypes.end(),
        [&](ScalarType type) { return name == ToString(type); });
      if (found == AllScalarTypes.end())
      {
        throw CLI::ValidationError(
          "--type", "'" + text + "' is none of u8, i8, u16, i16, u32, i32, f32, f64, rgb8, rgba8");
      }
      options->Type = *found;
    },
    "u8 (default), i8, u16, i16, u32, i32, f32, f64, rgb8, rgba8");
  command->add_option("--components", options->Components, "Components of a voxel, 1 to 4")
    ->check(CLI::Range(1, 4));
  command->add_option("--spacing", options->Spacing, "Edge lengths of a voxel; default 1 1 1");
  command->add_option("--brick", options->BrickSize, "Inner edge of a brick in voxels; default 64");
  AddBytes(command, "--gpu", options->GPUMemory, "GPU memory; default 1G");
  command->add_option("--size", options->Size, "Picture that is drawn, pixels; default 800 600")
    ->check(CLI::Range(1, 16384));
  command->add_flag("--native", options->Native,
    "For the native marcher, whose atlas lies in the memory of the host (render --stats tells)");
  command
    ->add_option("--texture-size", options->TextureSize,
      "Largest edge of a 3-D texture in texels; default 2048")
    ->check(CLI::Range(64, 1 << 20));
  command->add_flag("--json", options->Json, "Print JSON");
  return [options] { return RunPlan(*options); };
}

void AddVolume(CLI::App* command, VolumeOptions& volume)
{
  command
    ->add_option("volume", volume.Name,
      "HDF5 file, or formula:NAME with constant, ramp, shells, marschner-lobb or sponge")
    ->required()
    ->type_name("FILE");
  AddSelection(command, volume.Dataset, volume.Channel, volume.TimePoint);
  command->add_option(
    "--dimensions", volume.Dimensions, "Voxels of a formula; default 256 256 256");
  command->add_option("--type", volume.Type, "Scalar type of a formula; default u8");
  command->add_option("--brick", volume.BrickSize, "Inner edge of a brick in voxels; default 64")
    ->check(CLI::Range(2, 1024));
  command->add_option("--repeat", volume.Repeat, "Copies along each axis; default 1 1 1");
  command->add_option(
    "--pitch", volume.Pitch, "Voxels from copy to copy; default the size of the volume");
}

void AddCamera(CLI::App* command, CameraOptions& camera)
{
  command
    ->add_option_function<std::vector<double>>(
      "--camera",
      [&camera](const std::vector<double>& numbers)
      {
        camera.Given = true;
        std::copy_n(numbers.begin(), 3, camera.Position.begin());
        std::copy_n(numbers.begin() + 3, 3, camera.FocalPoint.begin());
        std::copy_n(numbers.begin() + 6, 3, camera.ViewUp.begin());
      },
      "Position, focal point (both in fractions of the bounds, 0 to 1 per axis) and view-up")
    ->expected(9)
    ->type_name("PX PY PZ FX FY FZ UX UY UZ");
  command->add_option("--azimuth", camera.Azimuth, "Degrees around the volume; default 30");
  command->add_option("--elevation", camera.Elevation, "Degrees above the volume; default 20");
  command->add_option("--zoom", camera.Zoom, "Magnification; default 1")
    ->check(CLI::PositiveNumber);
  command
    ->add_option("--view-angle", camera.ViewAngle, "Degrees of the picture's height; default 30")
    ->check(CLI::Range(0.01, 170.0));
  command->add_flag("--parallel", camera.Parallel, "Parallel projection");
}

Run AddRender(CLI::App& app)
{
  auto options = std::make_shared<RenderOptions>();
  CLI::App* command = app.add_subcommand("render", "Draw a volume off-screen into a PNG file");
  AddVolume(command, options->Volume);
  command->add_option("output", options->Output, "PNG file to write")
    ->required()
    ->type_name("OUT.png");
  command->add_option("--size", options->Size, "Width and height in pixels; default 800 600")
    ->check(CLI::Range(1, 16384));
  AddCamera(command, options->Camera);
  command->add_option("--transfer-function", options->TransferFunction,
    "JSON file with opacity and colour; default from the histogram");
  command
    ->add_option("--background", options->Background, "Red, green, blue in 0...1; default 0 0 0")
    ->check(CLI::Range(0.0, 1.0));
  command
    ->add_option("--marcher", options->Marcher,
      "gpu (shaders), native (this machine's processors), or automatic (default: native where "
      "OpenGL itself is drawn by processors)")
    ->check(CLI::IsMember({ "automatic", "gpu", "native" }));
  AddBytes(command, "--gpu-memory", options->GPUMemory, "GPU memory to use");
  AddBytes(command, "--host-memory", options->HostMemory, "Main memory to use");
  command
    ->add_option("--tolerance", options->Tolerance,
      "Error allowed per pixel and channel, 0...1; default 1/255")
    ->check(CLI::Range(0.0, 1.0));
  command->add_option("--stats", options->Stats, "JSON file to write times, bytes and memory to");
  command->add_flag("--quiet", options->Quiet, "Print errors only");
  return [options] { return RunRender(*options); };
}

Run AddError(CLI::App* bench)
{
  auto options = std::make_shared<BenchErrorOptions>();
  CLI::App* command = bench->add_subcommand(
    "error", "Compare run time against error with VTK's GPU and fixed-point mappers");
  command->add_option("--scenes", options->Scenes, "Names, or their beginnings with *; default all")
    ->delimiter(',');
  command->add_flag("--list", options->List, "Name the scenes");
  command
    ->add_option("--mappers", options->Mappers,
      "teravox, teravox-levels (against the pyramid's truth), vtk-gpu, vtk-gpu-wide (8-bit voxels "
      "given as 16-bit ones), vtk-fixed-point; default teravox,vtk-gpu,vtk-fixed-point")
    ->delimiter(',');
  command
    ->add_option(
      "--tolerances", options->Tolerances, "Of our mapper, in 1/255; default 64,32,16,8,4,2,1,0.25")
    ->delimiter(',')
    ->check(CLI::PositiveNumber);
  command
    ->add_option("--distances", options->Distances,
      "Sample distances of VTK's GPU mapper in voxels; default 2,1,0.5,0.25,0.125")
    ->delimiter(',')
    ->check(CLI::PositiveNumber);
  command
    ->add_option("--fixed-point-distances", options->FixedPointDistances,
      "The same of its fixed-point mapper; default 1,0.5,0.25")
    ->delimiter(',')
    ->check(CLI::PositiveNumber);
  command->add_option("--size", options->Size, "Width and height in pixels; default 512 512")
    ->check(CLI::Range(16, 4096));
  command->add_option("--frames", options->Frames, "Frames per measurement; default 5")
    ->check(CLI::Range(1, 1000));
  command
    ->add_option("--every", options->Every,
      "Take the error on one pixel of each n x n; default 4, 1 for all pixels")
    ->check(CLI::Range(1, 16));
  command
    ->add_option("--longest", options->Longest,
      "Seconds of a frame beyond which finer sample distances are left out; default 6")
    ->check(CLI::PositiveNumber);
  command->add_flag("--cpu-time", options->CPUTime,
    "Print ratios of processor time, which hardly depends on what else the machine does");
  command->add_option("--cache", options->Cache, "Folder that keeps the reference pictures");
  command->add_option("--json", options->Json, "JSON file to write");
  command->add_option("--csv", options->Csv, "CSV file to write");
  command->add_option("--plots", options->Plots, "Folder for curves of time against error (PNG)");
  // What the program calls itself with.
  command->add_option("--only", options->Only)->group("");
  command->add_option("--work", options->Work)->group("");
  command->add_option("--settings", options->Settings)->delimiter(',')->group("");
  return [options] { return RunBenchError(*options); };
}

void AddFrameOptions(CLI::App* command, const std::shared_ptr<BenchOptions>& options)
{
  command
    ->add_option("--volumes", options->Sizes, "Voxels per axis of the volumes; default 256 512")
    ->check(CLI::Range(16, 2048));
  command->add_option("--size", options->Size, "Width and height in pixels; default 512 512")
    ->check(CLI::Range(16, 4096));
  command->add_option("--frames", options->Frames, "Frames per measurement; default 5")
    ->check(CLI::Range(1, 1000));
  command->add_flag("--json", options->Json, "Print JSON");
  command->add_option("--only", options->Only)->group(""); // what the program calls itself with
}

Run AddScale(CLI::App* bench)
{
  auto options = std::make_shared<ScaleOptions>();
  CLI::App* command = bench->add_subcommand("scale",
    "The cost of one picture of volumes of all sizes, as formulas and as sparse files of what is "
    "seen of those, from outside and from within; the last line of each group is the largest by "
    "the smallest");
  command
    ->add_option("--volumes", options->Volumes,
      "Voxels per axis of the formulas; default 512 4096 32768 1048576 1073741824")
    ->check(CLI::Range(std::int64_t{ 16 }, (std::int64_t{ 1 } << 31) - 1));
  command
    ->add_option("--files", options->Files,
      "Voxels per axis of the files, at most 2^20; default 512 4096 32768 1048576")
    ->check(CLI::Range(std::int64_t{ 128 }, std::int64_t{ 1 } << 20));
  command->add_option("--size", options->Size, "Width and height in pixels; default 512 512")
    ->check(CLI::Range(16, 4096));
  command->add_option("--frames", options->Frames, "Frames after the first one; default 5")
    ->check(CLI::Range(1, 1000));
  command
    ->add_option(
      "--repetitions", options->Repetitions, "Measurements, whose medians are shown; default 5")
    ->check(CLI::Range(1, 1000));
  AddBytes(command, "--gpu-memory", options->GPUMemory, "GPU memory to use; default 256M");
  AddBytes(command, "--host-memory", options->HostMemory, "Main memory to use; default 512M");
  command->add_flag("--json", options->Json, "Print JSON");
  command->add_option("--only", options->Only)->group("");
  command->add_flag("--inside", options->Inside)->group("");
  return [options] { return RunBenchScale(*options); };
}

/// Types of the cubes that `bench load` and `bench convert` make.
void AddTypes(CLI::App* command, std::vector<ScalarType>& types)
{
  static const std::map<std::string, ScalarType> names{ { "u8", ScalarType::UInt8 },
    { "u16", ScalarType::UInt16 }, { "f32", ScalarType::Float32 } };
  command->add_option("--types", types, "Types of voxels; default u8,u16,f32")
    ->delimiter(',')
    ->transform(CLI::CheckedTransformer(names));
}

Run AddLoad(CLI::App* bench)
{
  auto options = std::make_shared<LoadOptions>();
  CLI::App* command = bench->add_subcommand("load",
    "The speed of bricks from a file (warm, through source and loader) beside that of the codec "
    "alone on as many threads");
  command
    ->add_option("--filters", options->Filters,
      "Default none,deflate,shuffle+deflate,lz4; there are "
      "scale-offset,szip,lzf,blosc,bitshuffle+lz4,zstd, too")
    ->delimiter(',');
  AddTypes(command, options->Types);
  command->add_option("--edge", options->Edge, "Voxels per axis, a multiple of 64; default 384")
    ->check(CLI::Range(320, 2048));
  command->add_option("--threads", options->Threads, "Default one per processor")
    ->check(CLI::Range(1, 1024));
  command
    ->add_option("--repetitions", options->Repetitions, "Of which the median counts; default 7")
    ->check(CLI::Range(1, 1000));
  command->add_option("--folder", options->Folder, "For the files; default the system's temporary");
  command->add_flag("--json", options->Json, "Print JSON");
  return [options] { return RunBenchLoad(*options); };
}

Run AddConvertBench(CLI::App* bench)
{
  auto options = std::make_shared<ConvertBenchOptions>();
  CLI::App* command = bench->add_subcommand("convert",
    "The speed of a conversion beside that of a plain copy of the same file, both until the disk "
    "has it");
  command->add_option("--formats", options->Formats, "mha, nii, vti; default mha")
    ->delimiter(',')
    ->check(CLI::IsMember({ "mha", "nii", "vti" }));
  AddTypes(command, options->Types);
  command->add_option("--compressions", options->Compressions, "Default lz4,none")
    ->delimiter(',')
    ->check(CLI::IsMember({ "none", "deflate", "lz4" }));
  command->add_option("--edge", options->Edge, "Voxels per axis; default 512")
    ->check(CLI::Range(8, 2048));
  command
    ->add_option("--repetitions", options->Repetitions, "Of which the median counts; default 5")
    ->check(CLI::Range(1, 1000));
  command->add_option("--folder", options->Folder, "For the files; default the system's temporary");
  command->add_flag("--json", options->Json, "Print JSON");
  return [options] { return RunBenchConvert(*options); };
}

Run AddBench(CLI::App& app)
{
  auto options = std::make_shared<BenchOptions>();
  CLI::App* command = app.add_subcommand("bench",
    "Frame times beside VTK's mappers (frame, the default), costs by size (scale), time against "
    "error (error), loading beside decoding (load), conversion beside a copy (convert)");
  command->require_subcommand(0, 1);
  AddFrameOptions(command, options);
  CLI::App* frame =
    command->add_subcommand("frame", "Compare frame times with VTK's GPU and fixed-point mappers");
  AddFrameOptions(frame, options);
  const Run scale = AddScale(command);
  const Run error = AddError(command);
  const Run load = AddLoad(command);
  const Run convert = AddConvertBench(command);
  return [command, options, scale, error, load, convert]
  {
    return command->got_subcommand("scale") ? scale()
      : command->got_subcommand("load")     ? load()
      : command->got_subcommand("convert")  ? convert()
      : command->got_subcommand("error")    ? error()
                                            : RunBench(*options);
  };
}

/// The first line of a parser's message, as a sentence.
std::string UsageText(const CLI::ParseError& error)
{
  std::string text = error.what();
  text = text.substr(0, text.find('\n'));
  return text.empty() || text.back() == '.' ? text : text + ".";
}

} // namespace

int main(int argc, char** argv)
{
  try
  {
    CLI::App app("Out-of-core volume rendering", "teravox");
    app.set_version_flag("--version", "teravox " TERAVOX_VERSION);
    app.require_subcommand(1);
    std::map<std::string, Run> commands;
    commands["convert"] = AddConvert(app);
    commands["info"] = AddInfo(app);
    commands["plan"] = AddPlan(app);
    commands["render"] = AddRender(app);
    commands["verify"] = AddVerify(app);
    commands["bench"] = AddBench(app);
    if (argc > 1 && argv[1][0] != '-' && commands.count(argv[1]) == 0)
    {
      fmt::print(stderr,
        "teravox: '{}' is no command; there are bench, convert, info, plan, render and verify.\n",
        argv[1]);
      return WrongUsage;
    }
    try
    {
      app.parse(argc, argv);
    }
    catch (const CLI::ParseError& error)
    {
      if (error.get_exit_code() == static_cast<int>(CLI::ExitCodes::Success))
      {
        return app.exit(error); // help and version go to standard output
      }
      fmt::print(stderr, "teravox: {} (teravox --help tells more)\n", UsageText(error));
      return WrongUsage;
    }
    const std::string name = app.get_subcommands().front()->get_name();
    const Status status = commands.at(name)();
    if (!status.Ok())
    {
      fmt::print(stderr, "teravox {}: {}\n", name, status.Message());
      return Failed;
    }
    return Succeeded;
  }
  catch (const std::exception& error)
  {
    fmt::print(stderr, "teravox: {}.\n", error.what());
    return Failed;
  }
}
