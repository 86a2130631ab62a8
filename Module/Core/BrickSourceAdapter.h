// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "BrickSource.h"

#include <algorithm>
#include <memory>
#include <utility>

namespace teravox
{

/// A source whose voxels are made of those of another when they are read, and which keeps none:
/// memory and bytes read are the other's. Thread: as BrickSource.
class BrickSourceAdapter : public BrickSource
{
public:
  const VolumeInfo& Info() const override { return this->Info_; }
  std::uint64_t BytesRead() const override { return this->Source->BytesRead(); }
  std::uint64_t MemoryUsed() const override { return this->Source->MemoryUsed(); }
  void SetMemoryBudget(std::uint64_t bytes) override { this->Source->SetMemoryBudget(bytes); }
  std::uint64_t LeastMemory() const override { return this->Source->LeastMemory(); }

protected:
  /// Info_ is the source's until the class changes it.
  explicit BrickSourceAdapter(std::shared_ptr<BrickSource> source)
    : Source(std::move(source))
    , Info_(this->Source->Info())
  {
  }

  const std::shared_ptr<BrickSource> Source;
  VolumeInfo Info_;
};

/// The same of two sources.
class BrickSourcePair : public BrickSourceAdapter
{
public:
  std::uint64_t BytesRead() const override
  {
    return this->Source->BytesRead() + this->Other->BytesRead();
  }
  std::uint64_t MemoryUsed() const override
  {
    return this->Source->MemoryUsed() + this->Other->MemoryUsed();
  }
  /// Each gets the least that it needs; half of the rest is the other's.
  void SetMemoryBudget(std::uint64_t bytes) override
  {
    const std::uint64_t ofSource = std::min(bytes, this->Source->LeastMemory());
    const std::uint64_t ofOther = std::min(bytes - ofSource, this->Other->LeastMemory());
    const std::uint64_t rest = bytes - ofSource - ofOther;
    this->Source->SetMemoryBudget(ofSource + (rest - rest / 2));
    this->Other->SetMemoryBudget(ofOther + rest / 2);
  }
  std::uint64_t LeastMemory() const override
  {
    return this->Source->LeastMemory() + this->Other->LeastMemory();
  }

protected:
  BrickSourcePair(std::shared_ptr<BrickSource> source, std::shared_ptr<BrickSource> other)
    : BrickSourceAdapter(std::move(source))
    , Other(std::move(other))
  {
  }

  const std::shared_ptr<BrickSource> Other;
};

} // namespace teravox
