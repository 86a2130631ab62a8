// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "BrickCache.h"
#include "BrickSeries.h"
#include "PageTable.h"
#include "Residency.h"

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

namespace teravox
{

/// One step of a series, as far as it is known: who reads it, under which volume number the host
/// cache keeps its bricks, and the ranges of its page directory.
struct StepVolume
{
  std::uint32_t Volume = 0;
  int Step = 0;
  std::shared_ptr<BrickSource> Given;  ///< null: not opened yet
  std::shared_ptr<BrickSource> Source; ///< Given, or scaled by 2^-Exponent
  int Exponent = 0;
  std::vector<std::vector<ValueRange>> Directory; ///< per level; empty where not read
  /// Bytes of the cache's budget that are set aside for what the source itself keeps.
  std::uint64_t Reserved = 0;

  void Open(std::shared_ptr<BrickSource> source);
};

/// Which values can be seen, from samples of the opacity at all places where it turns.
class VisibleValues
{
public:
  /// All values.
  VisibleValues() = default;
  /// Requires: ascending values; between two neighbours the opacity is monotone.
  explicit VisibleValues(std::vector<std::pair<double, bool>> samples)
    : Samples(std::move(samples))
  {
  }
  /// Conservative: may say yes where nothing can be seen.
  bool Any(const ValueRange& range) const;

private:
  std::vector<std::pair<double, bool>> Samples; ///< value, has opacity
};

/// Reads bricks of neighbouring steps into the host cache while nothing else is to be done: those
/// of the levels and of the part of the volume that the present picture is made of, as far as
/// something can be seen in them, what lies near the eye first. Page blocks come before bricks, so
/// that the step can be drawn without a read.
///
/// Budget: each read is reserved in the cache beforehand. A step gets no more than the budget
/// without the bricks of the present step, so that those stay; what else the cache has goes first.
/// Thread: used by the render thread only; reads in a thread of its own. Steps that are being read
/// may be touched after EndWithin() only, if that returned true.
class ReadAhead
{
public:
  struct Plan
  {
    std::shared_ptr<BrickCache> Cache;
    std::shared_ptr<BrickSeries> Series;
    std::vector<std::shared_ptr<StepVolume>> Steps; ///< in the order in which they are read
    std::uint32_t Present = 0;                      ///< volume number of what is shown
    PyramidLayout Layout;                           ///< steps of another one,
    ScalarType Type = ScalarType::UInt8;            ///< or of another type, aren't read ahead
    int Components = 1;
    std::uint64_t BrickBytes = 0; ///< that the cache charges for a brick
    std::uint64_t BlockBytes = 0; ///< and for a page block
    ViewOrder Order;
    std::vector<bool> Levels; ///< of which bricks are drawn
    VisibleValues Visible;
    bool SkipEmpty = true;
    std::uint64_t Headroom = 0; ///< bytes of the budget that stay free for the loader
  };

  ReadAhead() = default;
  ReadAhead(const ReadAhead&) = delete;
  ReadAhead& operator=(const ReadAhead&) = delete;
  ReadAhead(ReadAhead&&) = delete;
  ReadAhead& operator=(ReadAhead&&) = delete;
  ~ReadAhead();

  /// Begins. Requires: EndWithin() has returned true, or nothing was begun.
  void Start(Plan plan);
  /// Begins no other read; doesn't wait.
  void Cancel();
  /// Cancel(), and waits for the read that is under way; false after `seconds`.
  bool EndWithin(double seconds);
  /// Waits until all is read, or all that the budget allows; false on time-out.
  bool Wait(double seconds);
  std::uint64_t BricksRead() const { return this->BricksRead_.load(); }

private:
  void Work();
  void Run(const Plan& plan);
  bool OpenStep(const Plan& plan, StepVolume& step) const;
  void Collect(const Plan& plan, const StepVolume& step, const BrickKey& region,
    const ValueRange& range, std::vector<BrickKey>& bricks, std::uint64_t& room);
  RangesPointer LoadBlock(
    const Plan& plan, const StepVolume& step, const BrickKey& key, std::uint64_t& room);

  std::mutex Mutex;
  std::condition_variable Changed;
  std::unique_ptr<Plan> Next;
  bool Busy = false;
  bool Quit = false;
  std::atomic<bool> Stopping{ false };
  std::atomic<std::uint64_t> BricksRead_{ 0 };
  std::thread Thread; // started with the first plan
};

} // namespace teravox
