// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "BrickSource.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <set>
#include <utility>

namespace teravox::test
{

using BrickSet = std::set<BrickKey>;

/// Passes reads to another source and records them.
/// Thread: as BrickSource.
class RecordingSource : public BrickSource
{
public:
  explicit RecordingSource(std::shared_ptr<BrickSource> inner)
    : Inner(std::move(inner))
  {
  }

  const VolumeInfo& Info() const override { return this->Inner->Info(); }
  Result<BrickPointer> ReadBrick(const BrickKey& key) override
  {
    Result<BrickPointer> brick = this->Inner->ReadBrick(key);
    const std::lock_guard<std::mutex> lock(this->Mutex);
    this->Keys.insert(key);
    ++this->Reads_;
    this->Bytes += brick && brick.Value() ? brick.Value()->Voxels.size() : 0;
    return brick;
  }
  Result<std::vector<ValueRange>> ReadRanges(const BrickKey& first, const Int3& count) override
  {
    const std::lock_guard<std::mutex> lock(this->Mutex);
    ++this->RangeReads_;
    return this->Inner->ReadRanges(first, count);
  }
  std::uint64_t BytesRead() const override
  {
    const std::lock_guard<std::mutex> lock(this->Mutex);
    return this->Bytes;
  }

  /// Each brick that was read.
  BrickSet Read() const
  {
    const std::lock_guard<std::mutex> lock(this->Mutex);
    return this->Keys;
  }
  /// How often bricks, and the ranges of several, were read.
  std::size_t Reads() const
  {
    const std::lock_guard<std::mutex> lock(this->Mutex);
    return this->Reads_;
  }
  std::size_t RangeReads() const
  {
    const std::lock_guard<std::mutex> lock(this->Mutex);
    return this->RangeReads_;
  }

private:
  const std::shared_ptr<BrickSource> Inner;
  mutable std::mutex Mutex;
  BrickSet Keys;
  std::size_t Reads_ = 0;
  std::size_t RangeReads_ = 0;
  std::uint64_t Bytes = 0;
};

} // namespace teravox::test
