// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "BrickSource.h"

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

} // namespace teravox
