// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause

// Writes pyramids for check_pyramid.py, which computes the same formula: WritePyramidSamples
// FOLDER.
#include "TestPyramidSupport.h"

#include <cmath>
#include <cstdio>

namespace teravox::testing
{
namespace
{
struct Sample
{
  const char* Name;
  Int3 Dimensions;
  ScalarType Type;
  int Components;
  Double3 Spacing;
  PyramidWriterOptions Options;
  bool CellData;
};

bool WriteSample(const std::string& folder, const Sample& sample)
{
  VoxelReader::Description d = Describe(sample.Dimensions, sample.Type, sample.Components);
  d.Spacing = sample.Spacing;
  d.CellData = sample.CellData;
  d.Origin = { 10, 20, 30 };
  d.ExtentStart = { 4, 0, -2 };
  d.ArrayName = "density";
  ArrayVoxelReader reader(d);
  const Int3 n = sample.Dimensions;
  reader.Generate(
    [&](std::size_t i)
    {
      const auto voxel = static_cast<std::int64_t>(i) / sample.Components;
      const std::int64_t x = voxel % n[0];
      const std::int64_t y = voxel / n[0] % n[1];
      const std::int64_t z = voxel / (n[0] * n[1]);
      const std::int64_t c = static_cast<std::int64_t>(i) % sample.Components;
      if (x > n[0] / 2 && y > n[1] / 2)
      {
        return 0.0;
      }
      if (IsFloat(sample.Type) && (x / 3 + y / 5 + z / 4) % 5 == 0)
      {
        return std::nan("");
      }
      const auto value = static_cast<double>((x * x + 3 * y * z + 7 * z + 11 * c) % 97);
      return reader.IsSigned() || IsFloat(sample.Type) ? value - 40 : value;
    });
  const auto report =
    PyramidWriter::Write(folder + "/" + sample.Name + ".h5", reader, sample.Options);
  std::fprintf(stderr, "%s", report.GetStatus().Message().c_str());
  return report.Ok();
}

PyramidWriterOptions Options(PyramidCompression compression,
  PyramidDownsampling downsampling = PyramidDownsampling::Average,
  std::uint64_t memory = std::uint64_t{ 1 } << 30)
{
  PyramidWriterOptions options;
  options.BrickSize = 16;
  options.Compression = compression;
  options.Downsampling = downsampling;
  options.MemoryLimit = memory;
  return options;
}
} // namespace
} // namespace teravox::testing

int main(int argc, char** argv)
{
  using namespace teravox;
  using namespace teravox::testing;
  if (argc != 2)
  {
    return 2;
  }
  std::filesystem::create_directories(argv[1]);
  constexpr std::uint64_t little = 12 << 20;
  constexpr auto mode = PyramidDownsampling::Mode;
  constexpr auto average = PyramidDownsampling::Average;
  constexpr auto none = PyramidCompression::None;
  constexpr auto deflate = PyramidCompression::Deflate;
  constexpr auto lz4 = PyramidCompression::LZ4;
  const Double3 cubes{ 1, 1, 1 };
  const Sample samples[] = {
    { "u8_none", { 45, 37, 29 }, ScalarType::UInt8, 1, cubes, Options(none), false },
    { "i8_lz4", { 45, 37, 29 }, ScalarType::Int8, 1, cubes, Options(lz4), false },
    { "u16_deflate_seams", { 75, 37, 61 }, ScalarType::UInt16, 1, cubes,
      Options(deflate, average, little), false },
    { "i16_labels", { 33, 50, 17 }, ScalarType::Int16, 1, cubes, Options(deflate, mode), false },
    { "u32_thin", { 1, 70, 33 }, ScalarType::UInt32, 1, cubes, Options(deflate), false },
    { "i32_anisotropic", { 40, 40, 20 }, ScalarType::Int32, 1, { 1, 1, 5 }, Options(deflate),
      true },
    { "f32_nan", { 50, 34, 21 }, ScalarType::Float32, 1, { 0.5, 1, 0.75 }, Options(deflate),
      false },
    { "f64_nan_labels", { 30, 34, 21 }, ScalarType::Float64, 1, cubes, Options(lz4, mode), false },
    { "u8_rgb", { 37, 20, 18 }, ScalarType::UInt8, 3, cubes, Options(deflate), false },
    { "f64_single", { 1, 1, 1 }, ScalarType::Float64, 1, cubes, Options(none), false },
  };
  for (const Sample& sample : samples)
  {
    if (!WriteSample(argv[1], sample))
    {
      return 1;
    }
  }
  return 0;
}
