// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "Status.h"
#include "TexelFormat.h"
#include "Types.h"

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

/// The commands of the program `teravox`. Each returns Ok, or why it failed; main() prints the
/// reason as one sentence and turns it into the exit code 1.
namespace teravox::program
{

/// A volume on the command line: a file, or "formula:NAME"; perhaps repeated.
struct VolumeOptions
{
  std::string Name;
  std::string Dataset;
  int Channel = 0;                  ///< of a file; -1: all, as components
  int TimePoint = 0;                ///< of a file
  Int3 Dimensions{ 256, 256, 256 }; ///< of a formula
  std::string Type = "u8";          ///< of a formula
  int BrickSize = 64;               ///< of what is drawn, whatever the chunks of a file
  Int3 Repeat{ 1, 1, 1 };
  Int3 Pitch{ 0, 0, 0 }; ///< voxels from copy to copy; 0: the size of the volume
};

/// What a file that is converted doesn't say itself.
struct ImportOptions
{
  bool Raw = false; ///< voxels without a header, of the input's Dimensions and Type
  int Components = 1;
  std::optional<std::int64_t> Header; ///< bytes before the voxels; -1: these end the file
  bool BigEndian = false;
  std::optional<Double3> Spacing; ///< instead of the file's
  std::optional<Double3> Origin;  ///< of the first voxel's centre
};

struct ConvertOptions
{
  VolumeOptions Input; ///< any image file, folder or pattern, or a formula; not repeated
  ImportOptions Import;
  std::string Output;
  std::string Array; ///< of an input with several; empty: its active scalars
  std::string Compression = "lz4";
  std::string Downsampling = "average";
  int CompressionLevel = 0;
  int BrickSize = 64;
  std::uint64_t Memory = std::uint64_t{ 1 } << 30;
  double FillValue = 0.0;
  bool Resume = false; ///< go on from what an unfinished conversion left, and leave such things
  bool Quiet = false;
};
Status RunConvert(const ConvertOptions& options);

struct InfoOptions
{
  std::string File;
  std::string Dataset;
  int Channel = 0;
  int TimePoint = 0;
  bool Json = false;
};
Status RunInfo(const InfoOptions& options);

struct VerifyOptions
{
  VolumeOptions Volume; ///< a file
  bool Quiet = false;
};
Status RunVerify(const VerifyOptions& options);

struct PlanOptions
{
  Int3 Dimensions{ 0, 0, 0 };
  Double3 Spacing{ 1, 1, 1 };
  ScalarType Type = ScalarType::UInt8;
  int Components = 1;
  int BrickSize = 64;
  std::uint64_t GPUMemory = std::uint64_t{ 1 } << 30;
  /// What the plan assumes of the picture and of the driver: by default what `render` draws, and
  /// an atlas in a 3-D texture. `render --stats` tells what a driver does.
  std::array<int, 2> Size{ 800, 600 };
  bool Native = false;
  int TextureSize = 2048;
  bool Json = false;
};
Status RunPlan(const PlanOptions& options);

struct CameraOptions
{
  /// Where the camera is and where it looks, in fractions of the bounds: (0,0,0) and (1,1,1) are
  /// opposite corners. Used if Given.
  bool Given = false;
  Double3 Position{ 0, 0, 0 };
  Double3 FocalPoint{ 0.5, 0.5, 0.5 };
  Double3 ViewUp{ 0, 0, 1 };
  double ViewAngle = 30.0;
  bool Parallel = false;
  /// Else: turned around the middle of the volume, in degrees.
  double Azimuth = 30.0;
  double Elevation = 20.0;
  double Zoom = 1.0;
};

struct RenderOptions
{
  VolumeOptions Volume;
  std::string Output;
  std::array<int, 2> Size{ 800, 600 };
  CameraOptions Camera;
  std::string TransferFunction; ///< file; empty: from the histogram
  std::array<double, 3> Background{ 0.0, 0.0, 0.0 };
  std::uint64_t GPUMemory = 0;  ///< 0: the mapper's default
  std::uint64_t HostMemory = 0; ///< 0: the mapper's default
  double Tolerance = 1.0 / 255.0;
  std::string Marcher = "automatic"; ///< or gpu, native
  std::string Stats;                 ///< JSON file to write
  bool Quiet = false;
};
Status RunRender(const RenderOptions& options);

struct BenchOptions
{
  std::vector<int> Sizes{ 256, 512 };
  std::array<int, 2> Size{ 512, 512 };
  int Frames = 5;
  bool Json = false;
  std::string Only; ///< one measurement, in this process
};
Status RunBench(const BenchOptions& options);

struct ScaleOptions
{
  std::vector<std::int64_t> Volumes{ 512, 4096, 32768, std::int64_t{ 1 } << 20,
    std::int64_t{ 1 } << 30 }; ///< voxels per axis of formulas
  /// And of sparse files. HDF5 counts voxels in 64 bits: 2^30 per axis are too many for it.
  std::vector<std::int64_t> Files{ 512, 4096, 32768, std::int64_t{ 1 } << 20 };
  std::array<int, 2> Size{ 512, 512 };
  int Frames = 5;
  int Repetitions = 5; ///< of each measurement, whose medians are shown
  std::uint64_t GPUMemory = std::uint64_t{ 256 } << 20;
  std::uint64_t HostMemory = std::uint64_t{ 512 } << 20;
  bool Json = false;
  std::string Only;    ///< one measurement, in this process
  bool Inside = false; ///< of it: from within the volume
};
Status RunBenchScale(const ScaleOptions& options);

struct LoadOptions
{
  std::vector<std::string> Filters{ "none", "deflate", "shuffle+deflate", "lz4" };
  std::vector<ScalarType> Types{ ScalarType::UInt8, ScalarType::UInt16, ScalarType::Float32 };
  int Edge = 384;  ///< voxels per axis, a multiple of 64
  int Threads = 0; ///< 0: one per processor
  int Repetitions = 7;
  std::string Folder; ///< for the files; empty: the system's
  bool Json = false;
};
Status RunBenchLoad(const LoadOptions& options);

struct ConvertBenchOptions
{
  std::vector<std::string> Formats{ "mha" }; ///< nii, vti
  std::vector<ScalarType> Types{ ScalarType::UInt8, ScalarType::UInt16, ScalarType::Float32 };
  std::vector<std::string> Compressions{ "lz4", "none" };
  int Edge = 512; ///< voxels per axis
  int Repetitions = 5;
  std::string Folder; ///< for the files; empty: the system's
  bool Json = false;
};
Status RunBenchConvert(const ConvertBenchOptions& options);

struct BenchErrorOptions
{
  std::vector<std::string> Scenes; ///< empty: all
  std::vector<std::string> Mappers{ "teravox", "vtk-gpu", "vtk-fixed-point" };
  std::vector<double> Tolerances{ 64, 32, 16, 8, 4, 2, 1, 0.25 }; ///< of our mapper, in 1/255
  std::vector<double> Distances{ 2, 1, 0.5, 0.25, 0.125 }; ///< of VTK's GPU mapper, in voxels
  std::vector<double> FixedPointDistances{ 1, 0.5, 0.25 }; ///< of VTK's CPU mapper, in voxels
  std::array<int, 2> Size{ 512, 512 };
  int Frames = 5;
  int Every = 4;      ///< the error is taken on one pixel of each n x n
  double Longest = 6; ///< seconds of a frame of VTK's beyond which no finer one is measured
  std::string Cache;  ///< folder of the truth; empty: computed again
  std::string Json;
  std::string Csv;
  std::string Plots;    ///< folder
  bool CPUTime = false; ///< printed ratios are of processor time
  bool List = false;
  std::string Only;             ///< one scene, in this process
  std::string Work;             ///< folder that the processes share
  std::vector<double> Settings; ///< of the one mapper
};
Status RunBenchError(const BenchErrorOptions& options);

} // namespace teravox::program
