// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "BrickSource.h"
#include "HDF5BrickSource.h"
#include "PyramidWriter.h"
#include "VoxelReader.h"

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <functional>
#include <gtest/gtest.h>
#include <memory>
#include <random>
#include <string>
#include <unistd.h>
#include <vector>

namespace teravox::testing
{

/// A folder of its own for each object, removed with it.
class TemporaryFolder
{
public:
  TemporaryFolder()
  {
    std::string pattern = (std::filesystem::temp_directory_path() / "teravox-XXXXXX").string();
    this->Path_ = ::mkdtemp(pattern.data()) == nullptr ? std::string(".") : pattern;
  }
  ~TemporaryFolder()
  {
    std::error_code error;
    std::filesystem::remove_all(this->Path_, error);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  TemporaryFolder(TemporaryFolder&&) = delete;
  TemporaryFolder& operator=(TemporaryFolder&&) = delete;

  const std::string& Path() const { return this->Path_; }
  std::string File(const std::string& name) const { return this->Path_ + "/" + name; }
  std::size_t Count() const
  {
    std::size_t n = 0;
    for (const auto& entry : std::filesystem::directory_iterator(this->Path_))
    {
      static_cast<void>(entry);
      ++n;
    }
    return n;
  }

private:
  std::string Path_;
};

/// A volume in memory, any type; values as doubles through Value().
class ArrayVoxelReader : public VoxelReader
{
public:
  explicit ArrayVoxelReader(Description description)
    : Volume(std::move(description))
  {
    this->Voxels.resize(this->Count() * SizeOf(this->Volume.Type));
  }

  Description Describe() const override { return this->Volume; }

  Status ReadBox(const Int3& start, const Int3& size, void* out) override
  {
    if (this->BeforeRead)
    {
      const Status status = this->BeforeRead();
      if (!status.Ok())
      {
        return status;
      }
    }
    const std::size_t bytes =
      SizeOf(this->Volume.Type) * static_cast<std::size_t>(this->Volume.Components);
    auto* to = static_cast<std::byte*>(out);
    for (std::int64_t z = 0; z < size[2]; ++z)
    {
      for (std::int64_t y = 0; y < size[1]; ++y)
      {
        const std::size_t row = this->Voxel({ start[0], start[1] + y, start[2] + z });
        const std::size_t length = static_cast<std::size_t>(size[0]) * bytes;
        std::memcpy(to, this->Voxels.data() + row * bytes, length);
        to += length;
      }
    }
    return {};
  }

  bool ReadsSlabs() const override { return this->Slabs; }

  std::size_t Count() const
  {
    return static_cast<std::size_t>(this->Volume.Dimensions[0] * this->Volume.Dimensions[1] *
      this->Volume.Dimensions[2] * this->Volume.Components);
  }
  std::size_t Voxel(const Int3& p) const
  {
    const Int3& d = this->Volume.Dimensions;
    return static_cast<std::size_t>((p[2] * d[1] + p[1]) * d[0] + p[0]);
  }
  /// Sets all values to f(index of the value).
  void Generate(const std::function<double(std::size_t)>& f)
  {
    DispatchScalarType(this->Volume.Type,
      [&](auto example)
      {
        using T = decltype(example);
        for (std::size_t i = 0; i < this->Count(); ++i)
        {
          const T v = static_cast<T>(f(i));
          std::memcpy(this->Voxels.data() + i * sizeof(T), &v, sizeof(T));
        }
      });
  }
  /// Smooth structures, noise, and large empty parts; the same for each seed.
  void GenerateMixed(unsigned seed)
  {
    std::mt19937 random(seed);
    const double low = IsFloat(this->Volume.Type) ? -1000.0 : this->IsSigned() ? -100.0 : 0.0;
    const Int3 d = this->Volume.Dimensions;
    const auto c = static_cast<std::size_t>(this->Volume.Components);
    this->Generate(
      [&](std::size_t i)
      {
        const auto x = static_cast<std::int64_t>(i / c) % d[0];
        const auto z = static_cast<std::int64_t>(i / c) / (d[0] * d[1]);
        const double noise = static_cast<double>(random() % 16);
        return x > d[0] / 2 ? 0.0 : low + static_cast<double>((x * 3 + z * 2) % 90) + noise;
      });
  }
  bool IsSigned() const
  {
    return this->Volume.Type == ScalarType::Int8 || this->Volume.Type == ScalarType::Int16 ||
      this->Volume.Type == ScalarType::Int32;
  }

  Description Volume;
  std::vector<std::byte> Voxels;
  std::function<Status()> BeforeRead;
  bool Slabs = false;
};

inline VoxelReader::Description Describe(
  const Int3& dimensions, ScalarType type, int components = 1)
{
  VoxelReader::Description d;
  d.Dimensions = dimensions;
  d.Type = type;
  d.Components = components;
  return d;
}

inline double ValueAt(const std::byte* data, ScalarType type, std::size_t index)
{
  return DispatchScalarType(type,
    [&](auto example)
    {
      auto v = example;
      std::memcpy(&v, data + index * sizeof(v), sizeof(v));
      return static_cast<double>(v);
    });
}

/// Opens a file or fails the test.
inline std::shared_ptr<HDF5BrickSource> OpenSource(
  const std::string& file, int brickSize = 64, std::uint64_t budget = 256u << 20)
{
  HDF5OpenOptions options;
  options.BrickSize = brickSize;
  options.MemoryBudget = budget;
  Result<std::shared_ptr<HDF5BrickSource>> source = HDF5BrickSource::Open(file, options);
  EXPECT_TRUE(source.Ok()) << source.GetStatus().Message();
  return source.Ok() ? source.Value() : nullptr;
}

/// A whole level put together from its bricks (without their borders).
inline std::vector<std::byte> ReadLevel(HDF5BrickSource& source, int level)
{
  const VolumeInfo& info = source.Info();
  const Int3 d = info.Layout.Dimensions(level);
  const Int3 bricks = info.Layout.Bricks(level);
  const std::size_t bytes = SizeOf(info.Type) * static_cast<std::size_t>(info.Components);
  const std::int64_t edge = info.Layout.BrickSize();
  const std::int64_t stored = info.Layout.StoredSize();
  std::vector<std::byte> voxels(static_cast<std::size_t>(d[0] * d[1] * d[2]) * bytes);
  BrickKey key;
  key.Level = static_cast<std::uint8_t>(level);
  for (std::int64_t i = 0; i < bricks[0] * bricks[1] * bricks[2]; ++i)
  {
    const Int3 b{ i % bricks[0], i / bricks[0] % bricks[1], i / (bricks[0] * bricks[1]) };
    key.X = static_cast<std::uint32_t>(b[0]);
    key.Y = static_cast<std::uint32_t>(b[1]);
    key.Z = static_cast<std::uint32_t>(b[2]);
    const Result<BrickPointer> brick = source.ReadBrick(key);
    EXPECT_TRUE(brick.Ok()) << brick.GetStatus().Message();
    if (!brick.Ok())
    {
      break;
    }
    for (std::int64_t z = 0; z < std::min(edge, d[2] - b[2] * edge); ++z)
    {
      for (std::int64_t y = 0; y < std::min(edge, d[1] - b[1] * edge); ++y)
      {
        const auto from = static_cast<std::size_t>(
          ((z + BrickBorder) * stored + y + BrickBorder) * stored + BrickBorder);
        const auto to = static_cast<std::size_t>(
          ((b[2] * edge + z) * d[1] + b[1] * edge + y) * d[0] + b[0] * edge);
        std::memcpy(voxels.data() + to * bytes, brick.Value()->Voxels.data() + from * bytes,
          static_cast<std::size_t>(std::min(edge, d[0] - b[0] * edge)) * bytes);
      }
    }
  }
  return voxels;
}

/// Checks every voxel of a brick, border included, against a level in memory with clamping.
inline void ExpectBrickEquals(const VolumeInfo& info, const BrickKey& key, const Brick& brick,
  const std::vector<std::byte>& level)
{
  const Int3 d = info.Layout.Dimensions(key.Level);
  const std::int64_t stored = info.Layout.StoredSize();
  const std::int64_t edge = info.Layout.BrickSize();
  const std::size_t bytes = SizeOf(info.Type) * static_cast<std::size_t>(info.Components);
  ASSERT_EQ(brick.StoredSize, stored);
  ASSERT_EQ(brick.Voxels.size(), static_cast<std::size_t>(stored * stored * stored) * bytes);
  std::size_t wrong = 0;
  for (std::int64_t i = 0; i < stored * stored * stored; ++i)
  {
    const auto clamped = [&](std::int64_t local, std::uint32_t b, std::size_t axis)
    {
      return std::clamp<std::int64_t>(
        local - BrickBorder + static_cast<std::int64_t>(b) * edge, 0, d[axis] - 1);
    };
    const std::int64_t x = clamped(i % stored, key.X, 0);
    const std::int64_t y = clamped(i / stored % stored, key.Y, 1);
    const std::int64_t z = clamped(i / (stored * stored), key.Z, 2);
    const auto from = static_cast<std::size_t>((z * d[1] + y) * d[0] + x);
    wrong += std::memcmp(brick.Voxels.data() + static_cast<std::size_t>(i) * bytes,
               level.data() + from * bytes, bytes) != 0
      ? 1
      : 0;
  }
  EXPECT_EQ(wrong, 0u) << key.ToString();
}

} // namespace teravox::testing
