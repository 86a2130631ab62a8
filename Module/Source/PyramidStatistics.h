// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "ChunkCache.h"
#include "HDF5Dataset.h"
#include "HDF5File.h"
#include "Status.h"
#include "Types.h"

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

namespace teravox
{

/// Reads value ranges from the statistics of a pyramid file, at most about 10^3 cells per region
/// whatever its size.
/// Thread: any.
class PyramidStatistics
{
public:
  /// `firstDataset` and all numbers above it are this object's datasets in the cache.
  PyramidStatistics(std::shared_ptr<HDF5File> file, std::string path, ChunkCache& cache,
    std::uint32_t firstDataset);

  /// Ranges of a box of regions of `regionSize` voxels along each axis, widened by `border` voxels
  /// and cut at `dimensions` of this level; x fastest; Void() outside.
  Result<std::vector<ValueRange>> Read(int level, const Int3& dimensions, const Int3& firstRegion,
    const Int3& count, std::int64_t regionSize, std::int64_t border);

private:
  struct Table
  {
    std::shared_ptr<HDF5Dataset> Dataset;
    std::uint32_t Number = 0;
  };
  Result<Table> Open(int level, std::int64_t edge, const Int3& dimensions);

  std::shared_ptr<HDF5File> File;
  std::string Path;
  ChunkCache& Cache;
  std::uint32_t Next;
  std::mutex Mutex; // guards Tables, Next
  std::map<std::pair<int, std::int64_t>, Table> Tables;
};

} // namespace teravox
