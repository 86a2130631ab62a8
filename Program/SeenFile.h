// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "BrickSourceAdapter.h"
#include "Status.h"

#include <memory>
#include <mutex>
#include <set>
#include <string>

namespace teravox::program
{

/// Passes reads to another source and notes which bricks they are. Thread: as BrickSource.
class SeenBricks : public BrickSourceAdapter
{
public:
  explicit SeenBricks(std::shared_ptr<BrickSource> inner)
    : BrickSourceAdapter(std::move(inner))
  {
  }

  Result<BrickPointer> ReadBrick(const BrickKey& key) override;
  Result<std::vector<ValueRange>> ReadRanges(const BrickKey& first, const Int3& count) override
  {
    return this->Source->ReadRanges(first, count);
  }

  std::set<BrickKey> Keys() const;

private:
  mutable std::mutex Mutex;
  std::set<BrickKey> Seen;
};

/// Writes all levels of a volume of one component as a sparse file (N5 in HDF5, a chunk per brick,
/// deflate): the bricks given and those around them, whose voxels are their borders; all else stays
/// unwritten, which means 0. Errors: InputOutput; what the source says.
Status WriteSeenFile(
  const std::string& fileName, BrickSource& source, const std::set<BrickKey>& bricks);

} // namespace teravox::program
