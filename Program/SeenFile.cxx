// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "SeenFile.h"

#include "HDF5Handle.h"
#include "HDF5Lock.h"
#include "HDF5Types.h"
#include "Interrupt.h"
#include "VoxelBoxes.h"

#include <algorithm>
#include <array>
#include <fmt/format.h>
#include <vector>

namespace teravox::program
{
namespace
{

constexpr unsigned CompressionLevel = 1;

using Extent = std::array<hsize_t, 3>; // z, y, x

/// Sizes of one level, and of its chunks.
struct LevelShape
{
  Extent Size{};
  Extent Chunk{};
};

LevelShape ShapeOf(const PyramidLayout& layout, int level)
{
  LevelShape shape;
  for (std::size_t a = 0; a < 3; ++a)
  {
    const std::int64_t size = layout.Dimensions(level)[a];
    shape.Size.at(2 - a) = static_cast<hsize_t>(size);
    shape.Chunk.at(2 - a) = static_cast<hsize_t>(std::min<std::int64_t>(size, layout.BrickSize()));
  }
  return shape;
}

HDF5Handle MakeLevel(hid_t file, const VolumeInfo& info, int level)
{
  const LevelShape shape = ShapeOf(info.Layout, level);
  const HDF5Handle creation(H5Pcreate(H5P_DATASET_CREATE));
  H5Pset_chunk(creation.Get(), 3, shape.Chunk.data());
  H5Pset_deflate(creation.Get(), CompressionLevel);
  const HDF5Handle space(H5Screate_simple(3, shape.Size.data(), nullptr));
  HDF5Handle dataset(H5Dcreate2(file, fmt::format("s{}", level).c_str(),
    HDF5FileType(info.Type, false), space.Get(), H5P_DEFAULT, creation.Get(), H5P_DEFAULT));
  const hsize_t three = 3;
  const HDF5Handle list(H5Screate_simple(1, &three, nullptr));
  const HDF5Handle factors(H5Acreate2(
    dataset.Get(), "downsamplingFactors", H5T_STD_I64LE, list.Get(), H5P_DEFAULT, H5P_DEFAULT));
  return factors.Valid() &&
      H5Awrite(factors.Get(), H5T_NATIVE_INT64, info.Layout.Factor(level).data()) >= 0
    ? std::move(dataset)
    : HDF5Handle();
}

/// A brick without its border, or the part of it that lies in the level, as a chunk.
bool WriteChunk(hid_t dataset, const VolumeInfo& info, const BrickKey& key, const Brick& brick)
{
  const LevelShape shape = ShapeOf(info.Layout, key.Level);
  const std::size_t bytes = SizeOf(info.Type);
  const auto edge = static_cast<hsize_t>(info.Layout.BrickSize());
  const Extent start{ key.Z * edge, key.Y * edge, key.X * edge };
  Extent count{};
  for (std::size_t a = 0; a < 3; ++a)
  {
    count.at(a) = std::min(edge, shape.Size.at(a) - start.at(a));
  }
  std::vector<std::byte> voxels(count[0] * count[1] * count[2] * bytes);
  const auto size = [&](std::size_t a) { return static_cast<std::int64_t>(count.at(2 - a)); };
  const Int3 inside{ size(0), size(1), size(2) };
  const Int3 stored{ brick.StoredSize, brick.StoredSize, brick.StoredSize };
  CopyBox(brick.Voxels.data(), stored, { BrickBorder, BrickBorder, BrickBorder }, voxels.data(),
    inside, { 0, 0, 0 }, inside, bytes);
  const HDF5Handle memory(H5Screate_simple(3, count.data(), nullptr));
  const HDF5Handle file(H5Dget_space(dataset));
  return H5Sselect_hyperslab(
           file.Get(), H5S_SELECT_SET, start.data(), nullptr, count.data(), nullptr) >= 0 &&
    H5Dwrite(dataset, HDF5MemoryType(info.Type), memory.Get(), file.Get(), H5P_DEFAULT,
      voxels.data()) >= 0;
}

/// With those around them.
std::set<BrickKey> WithNeighbours(const PyramidLayout& layout, const std::set<BrickKey>& bricks)
{
  std::set<BrickKey> all;
  for (const BrickKey& key : bricks)
  {
    const Int3& size = layout.Bricks(key.Level);
    for (std::int64_t i = 0; i < 27; ++i)
    {
      const Int3 at{ std::int64_t{ key.X } + i % 3 - 1, std::int64_t{ key.Y } + i / 3 % 3 - 1,
        std::int64_t{ key.Z } + i / 9 - 1 };
      if (std::min({ at[0], at[1], at[2] }) >= 0 && at[0] < size[0] && at[1] < size[1] &&
        at[2] < size[2])
      {
        BrickKey other = key;
        other.X = static_cast<std::uint32_t>(at[0]);
        other.Y = static_cast<std::uint32_t>(at[1]);
        other.Z = static_cast<std::uint32_t>(at[2]);
        all.insert(other);
      }
    }
  }
  return all;
}

} // namespace

Result<BrickPointer> SeenBricks::ReadBrick(const BrickKey& key)
{
  {
    const std::lock_guard<std::mutex> lock(this->Mutex);
    this->Seen.insert(key);
  }
  return this->Source->ReadBrick(key);
}

std::set<BrickKey> SeenBricks::Keys() const
{
  const std::lock_guard<std::mutex> lock(this->Mutex);
  return this->Seen;
}

Status WriteSeenFile(
  const std::string& fileName, BrickSource& source, const std::set<BrickKey>& bricks)
{
  const VolumeInfo& info = source.Info();
  Status failure{ StatusCode::InputOutput, fmt::format("{} can't be written.", fileName) };
  const HDF5Lock lock;
  HDF5Handle file(H5Fcreate(fileName.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT));
  if (!file.Valid())
  {
    return failure;
  }
  std::vector<HDF5Handle> levels;
  for (int l = 0; l < info.Layout.NumberOfLevels(); ++l)
  {
    levels.push_back(MakeLevel(file.Get(), info, l));
    if (!levels.back().Valid())
    {
      return failure;
    }
  }
  for (const BrickKey& key : WithNeighbours(info.Layout, bricks))
  {
    const auto brick = source.ReadBrick(key);
    if (!brick.Ok())
    {
      return brick.GetStatus();
    }
    if (WasInterrupted())
    {
      return { StatusCode::Cancelled, "It was interrupted." };
    }
    if (!WriteChunk(levels[key.Level].Get(), info, key, *brick.Value()))
    {
      return failure;
    }
  }
  levels.clear();
  return file.Reset() ? Status() : failure;
}

} // namespace teravox::program
