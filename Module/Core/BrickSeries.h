// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "BrickSource.h"
#include "Status.h"

#include <memory>

namespace teravox
{

/// The steps of a volume that changes with time, each a brick source of its own, so that each step
/// is drawn as if it were alone. Steps are counted from 0, in the order of their times.
/// Thread: all functions may be called from several threads at once.
class BrickSeries
{
public:
  BrickSeries() = default;
  BrickSeries(const BrickSeries&) = delete;
  BrickSeries& operator=(const BrickSeries&) = delete;
  BrickSeries(BrickSeries&&) = delete;
  BrickSeries& operator=(BrickSeries&&) = delete;
  virtual ~BrickSeries() = default;

  virtual int NumberOfSteps() const = 0;

  /// The source of a step: the same object as long as somebody holds it. May open a file. Requires:
  /// 0 <= step < NumberOfSteps().
  virtual Result<std::shared_ptr<BrickSource>> Step(int step) = 0;
};

} // namespace teravox
