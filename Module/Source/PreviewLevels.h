// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "BrickKey.h"
#include "ChunkCache.h"
#include "Status.h"
#include "Types.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

namespace teravox
{

class HDF5Dataset;

/// Coarser levels of a dataset that has none, made while they are read of a few voxels of each
/// group: of the two in the middle along each axis, so that a level isn't moved against the finest
/// one; where a factor is 2 that is the level's average itself. Labels are taken from one voxel.
/// Only chunks, or rows of a dataset without chunks, in which such voxels lie are read.
namespace previews
{

/// More voxels than any volume has.
inline constexpr std::uint64_t Never = ~std::uint64_t{ 0 };

/// A level that is worth having.
struct Level
{
  Int3 Factor{ 1, 1, 1 };
  /// What is read at once: a chunk, or the boxes in which a dataset without chunks is best read.
  Int3 Box{ 0, 0, 0 };
};

/// Of the default levels those of which the whole reads hardly more than level 0, and a brick less
/// than 2 GiB: with chunks of one slice the coarsest ones only, with cubes the finer ones.
/// `chunk`: 0 where the dataset has no chunks. `voxelBytes`: of all components.
std::vector<Level> Plan(const Int3& dimensions, const Double3& spacing, int brickSize,
  const Int3& chunk, std::size_t voxelBytes);

/// What GatherBrick() makes a brick of.
struct Request
{
  const HDF5Dataset* Dataset = nullptr; ///< level 0
  Int3 Dimensions{ 0, 0, 0 };           ///< voxels of level 0 that count
  Int3 Factor{ 1, 1, 1 };
  Int3 Start{ 0, 0, 0 };   ///< of the brick with its border, in the level; may lie outside
  std::int64_t Stored = 0; ///< edge of the brick with its border
  bool Labels = false;
};

/// Voxels of a brick, `Stored`^3 of them, x fastest, components interleaved; the outermost ones of
/// the level are repeated outside. `read` reads one chunk. NaN is left out of averages.
/// Errors: those of `read`.
Status GatherBrick(const Request& request,
  const std::function<Result<ChunkPointer>(const Int3& chunk)>& read, std::byte* voxels);

} // namespace previews

} // namespace teravox
