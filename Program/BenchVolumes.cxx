// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "BenchVolumes.h"

#include "ArrayBrickSource.h"
#include "ErrorCapture.h"
#include "Formula.h"
#include "VTKScalarType.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fmt/format.h>
#include <fstream>
#include <memory>
#include <utility>
#include <vtkDataArray.h>
#include <vtkImageData.h>
#include <vtkNIFTIImageReader.h>
#include <vtkNew.h>
#include <vtkPointData.h>

namespace teravox::program
{
namespace
{

constexpr const char* BrainFile = "/usr/share/mricron/templates/ch2better.nii.gz";
constexpr const char* HeadFile =
  "/usr/share/doc/invesalius-examples/examples/Cranium.inv3"; // a tar.gz

Status NotInstalled(const char* file, const char* package)
{
  return { StatusCode::NotFound,
    fmt::format("{} isn't there; the package {} has it.", file, package) };
}

Result<BenchVolume> ReadBrain()
{
  if (!std::filesystem::exists(BrainFile))
  {
    return NotInstalled(BrainFile, "mricron-data");
  }
  const ErrorCapture errors;
  vtkNew<vtkNIFTIImageReader> reader;
  reader->SetFileName(BrainFile);
  reader->Update();
  vtkImageData* image = reader->GetOutput();
  const auto type = FromVTK(image->GetScalarType());
  if (errors.HasError() || !type || image->GetNumberOfScalarComponents() != 1)
  {
    return Status(
      StatusCode::Corrupt, fmt::format("{} can't be read: {}", BrainFile, errors.First()));
  }
  BenchVolume volume;
  volume.Type = *type;
  std::copy_n(image->GetDimensions(), 3, volume.Dimensions.begin());
  std::copy_n(image->GetSpacing(), 3, volume.Spacing.begin());
  const auto* voxels = static_cast<const std::byte*>(image->GetScalarPointer());
  volume.Voxels.assign(
    voxels, voxels + static_cast<std::size_t>(image->GetNumberOfPoints()) * SizeOf(volume.Type));
  return volume;
}

Result<BenchVolume> ReadHead()
{
  if (!std::filesystem::exists(HeadFile))
  {
    return NotInstalled(HeadFile, "invesalius-examples");
  }
  BenchVolume volume;
  volume.Type = ScalarType::Int16;
  volume.Dimensions = { 256, 256, 108 };
  volume.Spacing = { 0.957, 0.957, 1.5 };
  volume.Voxels.resize(std::size_t{ 256 } * 256 * 108 * SizeOf(volume.Type));
  const std::string command =
    fmt::format("tar -xzOf {} --wildcards '*/matrix.dat'", HeadFile); // little endian, z slowest
  const std::unique_ptr<FILE, int (*)(FILE*)> pipe(popen(command.c_str(), "r"), pclose);
  if (!pipe ||
    std::fread(volume.Voxels.data(), 1, volume.Voxels.size(), pipe.get()) != volume.Voxels.size())
  {
    return Status(StatusCode::Corrupt, fmt::format("{} has no whole matrix.dat.", HeadFile));
  }
  return volume;
}

/// The field's 0...1 as the whole range of an unsigned type.
template <typename T>
void Store(BenchVolume& volume, std::int64_t first, const double* values, std::int64_t count)
{
  constexpr double high = std::numeric_limits<T>::max();
  for (std::int64_t i = 0; i < count; ++i)
  {
    const T voxel = static_cast<T>(std::lround(std::clamp(values[i], 0.0, 1.0) * high));
    std::memcpy(
      volume.Voxels.data() + static_cast<std::size_t>(first + i) * sizeof(T), &voxel, sizeof(T));
  }
}

/// Calls slice(z, values), which fills n x n values, for each z.
template <typename F>
BenchVolume FillSlices(ScalarType type, int n, const F& slice)
{
  BenchVolume volume;
  volume.Type = type;
  volume.Dimensions = { n, n, n };
  const std::int64_t area = std::int64_t{ n } * n;
  volume.Voxels.resize(static_cast<std::size_t>(area * n) * SizeOf(type));
#pragma omp parallel for schedule(dynamic, 4)
  for (int z = 0; z < n; ++z)
  {
    std::vector<double> values(static_cast<std::size_t>(area));
    slice(z, values);
    if (type == ScalarType::UInt8)
    {
      Store<std::uint8_t>(volume, z * area, values.data(), area);
    }
    else
    {
      Store<std::uint16_t>(volume, z * area, values.data(), area);
    }
  }
  return volume;
}

/// Calls value(x, y, z) at voxel centres in 0...1.
template <typename F>
BenchVolume FillVoxels(ScalarType type, int n, const F& value)
{
  return FillSlices(type, n,
    [&](int z, std::vector<double>& values)
    {
      std::size_t i = 0;
      for (int y = 0; y < n; ++y)
      {
        for (int x = 0; x < n; ++x)
        {
          values[i++] = value((x + 0.5) / n, (y + 0.5) / n, (z + 0.5) / n);
        }
      }
    });
}

BenchVolume FillFormula(ScalarType type, int n, FormulaKind kind)
{
  const auto formula = MakeFormula(kind, { n, n, n });
  std::vector<std::int64_t> places; // doubled coordinates
  places.reserve(static_cast<std::size_t>(n));
  for (int i = 0; i < n; ++i)
  {
    places.push_back(2 * std::int64_t{ i });
  }
  return FillSlices(type, n,
    [&](int z, std::vector<double>& values)
    {
      const Formula::Grid grid{ places, places, { 2 * std::int64_t{ z } } };
      formula->Fill(grid, { 1, 1, 1 }, values.data());
    });
}

/// A number in [0, 1) for each voxel, the same on each machine.
double Hash01(std::int64_t x, std::int64_t y, std::int64_t z)
{
  std::uint64_t h = 0x9E3779B97F4A7C15ULL;
  for (const std::int64_t part : { x, y, z })
  {
    h = (h ^ static_cast<std::uint64_t>(part)) * 0xBF58476D1CE4E5B9ULL;
    h ^= h >> 29;
    h *= 0x94D049BB133111EBULL;
    h ^= h >> 32;
  }
  return std::ldexp(static_cast<double>(h >> 11), -53);
}

/// White noise under the filter (1 2 1)/4 along each axis, stretched to a standard deviation of
/// about 0.2.
BenchVolume FillNoise(int n)
{
  return FillSlices(ScalarType::UInt16, n,
    [n](int z, std::vector<double>& values)
    {
      const int wide = n + 2;
      std::vector<double> sums(static_cast<std::size_t>(wide) * wide);
      for (int y = 0; y < wide; ++y)
      {
        for (int x = 0; x < wide; ++x)
        {
          sums[static_cast<std::size_t>(y) * wide + x] =
            0.25 * (Hash01(x, y, z) + 2 * Hash01(x, y, z + 1) + Hash01(x, y, z + 2));
        }
      }
      for (int y = 0; y < n; ++y)
      {
        for (int x = 0; x < n; ++x)
        {
          double sum = 0;
          for (int j = 0; j < 3; ++j)
          {
            const double* row = sums.data() + static_cast<std::size_t>(y + j) * wide + x;
            sum += (j == 1 ? 0.5 : 0.25) * (0.25 * row[0] + 0.5 * row[1] + 0.25 * row[2]);
          }
          values[static_cast<std::size_t>(y) * n + x] = 0.5 + 3 * (sum - 0.5);
        }
      }
    });
}

BenchVolume FillSheet(int n)
{
  return FillVoxels(ScalarType::UInt8, n,
    [n](double x, double y, double z)
    {
      const double height =
        0.5 + 0.15 * std::sin(5.1 * x + 0.4) * std::cos(4.3 * y) + 0.2 * (x - y);
      const double dx = 0.15 * 5.1 * std::cos(5.1 * x + 0.4) * std::cos(4.3 * y) + 0.2;
      const double dy = -0.15 * 4.3 * std::sin(5.1 * x + 0.4) * std::sin(4.3 * y) - 0.2;
      const double voxels = n * std::abs(z - height) / std::sqrt(1 + dx * dx + dy * dy);
      return std::max(0.0, 1 - voxels);
    });
}

BenchVolume FillDense(int n)
{
  return FillVoxels(ScalarType::UInt16, n,
    [](double x, double y, double z)
    {
      const double f = 2 * M_PI * 7;
      return 0.5 +
        0.3 *
        (std::sin(f * x) * std::cos(f * y) + std::sin(f * y) * std::cos(f * z) +
          std::sin(f * z) * std::cos(f * x)) /
        1.5 +
        0.2 * std::sin(3.1 * x + 2.3 * y + 4.1 * z);
    });
}

} // namespace

double BenchVolume::SmallestSpacing() const
{
  return *std::min_element(this->Spacing.begin(), this->Spacing.end());
}

Result<BenchVolume> MakeBenchVolume(BenchField field, int size)
{
  switch (field)
  {
    case BenchField::Brain:
      return ReadBrain();
    case BenchField::Head:
      return ReadHead();
    case BenchField::Shells:
      return FillFormula(ScalarType::UInt8, size, FormulaKind::Shells);
    case BenchField::Sponge:
      return FillFormula(ScalarType::UInt8, size, FormulaKind::Sponge);
    case BenchField::Fog:
      return FillFormula(ScalarType::UInt16, size, FormulaKind::MarschnerLobb);
    case BenchField::Noise:
      return FillNoise(size);
    case BenchField::Sheet:
      return FillSheet(size);
    case BenchField::Dense:
    default:
      return FillDense(size);
  }
}

namespace
{
struct VolumeHeader
{
  Int3 Dimensions;
  Double3 Spacing;
  std::uint64_t Bytes;
  ScalarType Type;
};
} // namespace

Status WriteBenchVolume(const BenchVolume& volume, const std::string& file)
{
  VolumeHeader header{};
  header.Dimensions = volume.Dimensions;
  header.Spacing = volume.Spacing;
  header.Bytes = volume.Voxels.size();
  header.Type = volume.Type;
  std::ofstream stream(file, std::ios::binary);
  stream.write(reinterpret_cast<const char*>(&header), sizeof(header));
  stream.write(reinterpret_cast<const char*>(volume.Voxels.data()),
    static_cast<std::streamsize>(volume.Voxels.size()));
  stream.close();
  return stream ? Status() : Status(StatusCode::InputOutput, file + " can't be written.");
}

Result<BenchVolume> ReadBenchVolume(const std::string& file)
{
  VolumeHeader header{};
  std::ifstream stream(file, std::ios::binary);
  stream.read(reinterpret_cast<char*>(&header), sizeof(header));
  BenchVolume volume;
  volume.Dimensions = header.Dimensions;
  volume.Spacing = header.Spacing;
  volume.Type = header.Type;
  if (stream)
  {
    volume.Voxels.resize(header.Bytes);
    stream.read(reinterpret_cast<char*>(volume.Voxels.data()),
      static_cast<std::streamsize>(volume.Voxels.size()));
  }
  return stream ? Result<BenchVolume>(std::move(volume))
                : Status(StatusCode::InputOutput, file + " can't be read.");
}

Result<std::shared_ptr<BrickSource>> MakeSource(const BenchVolume& volume)
{
  ArrayDescription array;
  array.Data = volume.Voxels.data();
  array.Type = volume.Type;
  array.Dimensions = volume.Dimensions;
  array.Spacing = volume.Spacing;
  auto source = ArrayBrickSource::Make(array);
  return source.Ok() ? Result<std::shared_ptr<BrickSource>>(source.Value()) : source.GetStatus();
}

Result<std::vector<std::byte>> ReadLevel(BrickSource& source, int level)
{
  const VolumeInfo& info = source.Info();
  const Int3& dims = info.Layout.Dimensions(level);
  const Int3& bricks = info.Layout.Bricks(level);
  const std::int64_t inner = info.Layout.BrickSize();
  const std::int64_t stored = info.Layout.StoredSize();
  const auto bytes = static_cast<std::int64_t>(SizeOf(info.Type));
  std::vector<std::byte> voxels(static_cast<std::size_t>(dims[0] * dims[1] * dims[2] * bytes));
  for (std::int64_t b = 0; b < bricks[0] * bricks[1] * bricks[2]; ++b)
  {
    const Int3 at{ b % bricks[0], b / bricks[0] % bricks[1], b / bricks[0] / bricks[1] };
    BrickKey key;
    key.Level = static_cast<std::uint8_t>(level);
    key.X = static_cast<std::uint32_t>(at[0]);
    key.Y = static_cast<std::uint32_t>(at[1]);
    key.Z = static_cast<std::uint32_t>(at[2]);
    const Result<BrickPointer> brick = source.ReadBrick(key);
    if (!brick.Ok())
    {
      return brick.GetStatus();
    }
    const std::int64_t x = at[0] * inner;
    const std::int64_t row = std::min(x + inner, dims[0]) - x;
    for (std::int64_t z = at[2] * inner; z < std::min((at[2] + 1) * inner, dims[2]); ++z)
    {
      for (std::int64_t y = at[1] * inner; y < std::min((at[1] + 1) * inner, dims[1]); ++y)
      {
        const std::int64_t from =
          ((z - at[2] * inner + BrickBorder) * stored + y - at[1] * inner + BrickBorder) * stored +
          BrickBorder;
        std::copy_n(brick.Value()->Voxels.begin() + from * bytes, row * bytes,
          voxels.begin() + ((z * dims[1] + y) * dims[0] + x) * bytes);
      }
    }
  }
  return voxels;
}

vtkSmartPointer<vtkImageData> ToImage(const BenchVolume& volume, bool wide)
{
  auto scalars =
    vtkSmartPointer<vtkDataArray>::Take(vtkDataArray::CreateDataArray(ToVTK(volume.Type)));
  scalars->SetNumberOfTuples(volume.Dimensions[0] * volume.Dimensions[1] * volume.Dimensions[2]);
  std::memcpy(scalars->GetVoidPointer(0), volume.Voxels.data(), volume.Voxels.size());
  if (wide && SizeOf(volume.Type) == 1)
  {
    auto other = vtkSmartPointer<vtkDataArray>::Take(vtkDataArray::CreateDataArray(
      volume.Type == ScalarType::UInt8 ? VTK_UNSIGNED_SHORT : VTK_SHORT));
    other->DeepCopy(scalars);
    scalars = other;
  }
  scalars->SetName("scalars");
  auto image = vtkSmartPointer<vtkImageData>::New();
  image->SetDimensions(static_cast<int>(volume.Dimensions[0]),
    static_cast<int>(volume.Dimensions[1]), static_cast<int>(volume.Dimensions[2]));
  image->SetSpacing(volume.Spacing.data());
  image->GetPointData()->SetScalars(scalars);
  return image;
}

} // namespace teravox::program
