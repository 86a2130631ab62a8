// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "BrickSource.h"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <new>
#include <stdexcept>
#include <thread>
#include <utility>

namespace teravox::test
{

/// What goes wrong when a brick or a page block is read.
enum class Fault
{
  None,
  Status,   ///< an error status
  Throw,    ///< a std::runtime_error
  ThrowOdd, ///< an exception that isn't a std::exception
  OutOfMemory,
  ShortData, ///< half of the voxels, or of the ranges
  NullBrick
};

/// Passes reads to another source, or fails, stalls and slows them down as told.
/// Thread: as BrickSource.
class FaultyBrickSource : public BrickSource
{
public:
  explicit FaultyBrickSource(std::shared_ptr<BrickSource> inner)
    : Inner(std::move(inner))
  {
  }

  /// Decides for each read. Set it before the first one.
  void SetFaults(std::function<Fault(const BrickKey&)> faults) { this->Faults = std::move(faults); }
  /// Each read takes at least this long. Set it before the first one.
  void SetDelay(std::chrono::microseconds delay) { this->Delay = delay; }
  /// While the gate is closed no read ends.
  void CloseGate()
  {
    const std::lock_guard<std::mutex> lock(this->Mutex);
    this->Closed = true;
  }
  void OpenGate()
  {
    {
      const std::lock_guard<std::mutex> lock(this->Mutex);
      this->Closed = false;
    }
    this->Changed.notify_all();
  }
  /// Waits until this many reads have begun.
  void WaitForReads(int count)
  {
    std::unique_lock<std::mutex> lock(this->Mutex);
    this->Changed.wait(lock, [&] { return this->Reads_ >= count; });
  }
  int Reads() const
  {
    const std::lock_guard<std::mutex> lock(this->Mutex);
    return this->Reads_;
  }
  /// Most reads that ever ran at once.
  int MostAtOnce() const
  {
    const std::lock_guard<std::mutex> lock(this->Mutex);
    return this->MostAtOnce_;
  }

  const VolumeInfo& Info() const override { return this->Inner->Info(); }

  Result<BrickPointer> ReadBrick(const BrickKey& key) override
  {
    const Visit visit(*this);
    const Fault fault = this->Provoke(key);
    if (fault == Fault::Status)
    {
      return teravox::Status(StatusCode::InputOutput, "Injected fault at " + key.ToString() + ".");
    }
    if (fault == Fault::NullBrick)
    {
      return BrickPointer();
    }
    Result<BrickPointer> brick = this->Inner->ReadBrick(key);
    if (fault == Fault::ShortData && brick)
    {
      auto shorter = std::make_shared<Brick>(*brick.Value());
      shorter->Voxels.resize(shorter->Voxels.size() / 2);
      return BrickPointer(std::move(shorter));
    }
    return brick;
  }

  Result<std::vector<ValueRange>> ReadRanges(const BrickKey& first, const Int3& count) override
  {
    const Visit visit(*this);
    const Fault fault = this->Provoke(first);
    if (fault == Fault::Status)
    {
      return teravox::Status(
        StatusCode::InputOutput, "Injected fault at " + first.ToString() + ".");
    }
    Result<std::vector<ValueRange>> ranges = this->Inner->ReadRanges(first, count);
    if (fault == Fault::ShortData && ranges)
    {
      ranges.Value().resize(ranges.Value().size() / 2);
    }
    return ranges;
  }

private:
  struct Visit
  {
    explicit Visit(FaultyBrickSource& source)
      : Source(source)
    {
      std::unique_lock<std::mutex> lock(source.Mutex);
      ++source.Reads_;
      source.MostAtOnce_ = std::max(source.MostAtOnce_, ++source.Running);
      source.Changed.notify_all();
      source.Changed.wait(lock, [&] { return !source.Closed; });
    }
    Visit(const Visit&) = delete;
    Visit& operator=(const Visit&) = delete;
    Visit(Visit&&) = delete;
    Visit& operator=(Visit&&) = delete;
    ~Visit()
    {
      const std::lock_guard<std::mutex> lock(this->Source.Mutex);
      --this->Source.Running;
    }
    FaultyBrickSource& Source;
  };

  Fault Provoke(const BrickKey& key) const
  {
    if (this->Delay.count() > 0)
    {
      std::this_thread::sleep_for(this->Delay);
    }
    const Fault fault = this->Faults ? this->Faults(key) : Fault::None;
    switch (fault)
    {
      case Fault::Throw:
        throw std::runtime_error("injected exception");
      case Fault::ThrowOdd:
        throw 42; // NOLINT: what a careless source might do
      case Fault::OutOfMemory:
        throw std::bad_alloc();
      default:
        return fault;
    }
  }

  const std::shared_ptr<BrickSource> Inner;
  std::function<Fault(const BrickKey&)> Faults;
  std::chrono::microseconds Delay{ 0 };
  mutable std::mutex Mutex;
  std::condition_variable Changed;
  bool Closed = false;
  int Reads_ = 0;
  int Running = 0;
  int MostAtOnce_ = 0;
};

} // namespace teravox::test
