// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "BrickSource.h"

#include <array>
#include <cstdint>
#include <memory>
#include <mutex>

namespace teravox::test
{

/// The first component of single voxels of a level of any size, out of bricks that are read when
/// they are asked for. What is kept has one place per brick, chosen by its index: a small share of
/// the level, in bounded memory. Thread: Voxel() may be called from several threads at once.
class BrickVoxels
{
public:
  BrickVoxels(BrickSource& source, int level);
  BrickVoxels(const BrickVoxels&) = delete;
  BrickVoxels& operator=(const BrickVoxels&) = delete;
  BrickVoxels(BrickVoxels&&) = delete;
  BrickVoxels& operator=(BrickVoxels&&) = delete;
  ~BrickVoxels() = default;

  /// Requires: an index inside the level. NaN where the brick can't be read: a hole that a picture
  /// doesn't have.
  double Voxel(std::int64_t i, std::int64_t j, std::int64_t k);

private:
  struct Place
  {
    std::mutex Mutex;
    Int3 Index{ -1, -1, -1 };
    BrickPointer Voxels;
  };

  BrickSource& Source;
  const int Level;
  const std::int64_t BrickSize;
  const std::int64_t StoredSize;
  std::array<Place, 512> Places;
};

} // namespace teravox::test
