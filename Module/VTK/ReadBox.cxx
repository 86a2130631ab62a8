// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "ReadBox.h"

#include "WaitScope.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstring>
#include <exception>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

namespace teravox
{
namespace
{

/// The job of one ReadBox() call, shared by its threads. Thread: each brick writes its own part of
/// Out; the report is guarded by Mutex.
class BoxReader
{
public:
  BoxReader(BrickSource& source, int level, const Int3& first, const Int3& size, std::byte* out)
    : Source(source)
    , Info(source.Info())
    , Level(level)
    , First(first)
    , Size(size)
    , Out(out)
    , VoxelBytes(SizeOf(Info.Type) * static_cast<std::size_t>(Info.Components))
  {
    const std::int64_t edge = this->Info.Layout.BrickSize();
    this->Total = 1;
    for (std::size_t a = 0; a < 3; ++a)
    {
      this->FirstBrick[a] = first[a] / edge;
      this->Bricks[a] = (first[a] + size[a] - 1) / edge + 1 - this->FirstBrick[a];
      this->Total *= this->Bricks[a];
    }
  }

  std::int64_t NumberOfBricks() const { return this->Total; }
  std::int64_t Done() const { return this->Finished.load(); }
  void Cancel() { this->Stop.store(true); }

  void Work()
  {
    for (;;)
    {
      const std::int64_t n = this->Next.fetch_add(1);
      if (n >= this->Total || this->Stop.load())
      {
        break;
      }
      const Int3 brick{ this->FirstBrick[0] + n % this->Bricks[0],
        this->FirstBrick[1] + n / this->Bricks[0] % this->Bricks[1],
        this->FirstBrick[2] + n / this->Bricks[0] / this->Bricks[1] };
      this->ReadOne(brick);
      {
        const std::lock_guard<std::mutex> lock(this->Mutex);
        this->Finished.fetch_add(1);
      }
      this->Changed.notify_one();
    }
  }

  /// Waits a moment, or until all is done.
  bool WaitDone(std::chrono::milliseconds time)
  {
    const WaitScope waiting; // ends after the lock is released
    std::unique_lock<std::mutex> lock(this->Mutex);
    return this->Changed.wait_for(
      lock, time, [this] { return this->Finished.load() >= this->Total || this->Stop.load(); });
  }

  ReadBoxReport Report;

private:
  void ReadOne(const Int3& brick)
  {
    // The part of the box that this brick has to give, in voxels of Level.
    const std::int64_t edge = this->Info.Layout.BrickSize();
    Int3 begin{};
    Int3 end{};
    for (std::size_t a = 0; a < 3; ++a)
    {
      begin[a] = std::max(this->First[a], brick[a] * edge);
      end[a] = std::min(this->First[a] + this->Size[a], (brick[a] + 1) * edge);
    }
    const Int3& fine = this->Info.Layout.Factor(this->Level);
    for (int level = this->Level; level < this->Info.Layout.NumberOfLevels(); ++level)
    {
      const Int3& coarse = this->Info.Layout.Factor(level);
      Int3 ratio{};
      for (std::size_t a = 0; a < 3; ++a)
      {
        ratio[a] = coarse[a] / fine[a];
      }
      if (this->CopyFrom(level, ratio, begin, end))
      {
        return;
      }
    }
    this->FillZero(begin, end);
  }

  /// Copies the voxels [begin, end) of Level from the voxels of a coarser (or the same) level that
  /// contain them. False if a brick of that level can't be read.
  bool CopyFrom(int level, const Int3& ratio, const Int3& begin, const Int3& end)
  {
    const std::int64_t edge = this->Info.Layout.BrickSize();
    Int3 firstBrick{};
    Int3 lastBrick{};
    for (std::size_t a = 0; a < 3; ++a)
    {
      firstBrick[a] = begin[a] / ratio[a] / edge;
      lastBrick[a] = (end[a] - 1) / ratio[a] / edge;
    }
    for (std::int64_t k = firstBrick[2]; k <= lastBrick[2]; ++k)
    {
      for (std::int64_t j = firstBrick[1]; j <= lastBrick[1]; ++j)
      {
        for (std::int64_t i = firstBrick[0]; i <= lastBrick[0]; ++i)
        {
          Result<BrickPointer> read = this->Source.ReadBrick(BrickKey::Of(level, { i, j, k }));
          if (!read.Ok())
          {
            if (level == this->Level)
            {
              this->NoteFailure(read.GetStatus());
            }
            return false;
          }
          this->CopyBrick(*read.Value(), { i * edge, j * edge, k * edge }, ratio, begin, end);
        }
      }
    }
    return true;
  }

  /// `origin`: first inner voxel of the brick, in voxels of its own level.
  void CopyBrick(
    const Brick& brick, const Int3& origin, const Int3& ratio, const Int3& begin, const Int3& end)
  {
    const std::int64_t edge = this->Info.Layout.BrickSize();
    const std::int64_t stored = brick.StoredSize;
    const std::size_t bytes = this->VoxelBytes;
    Int3 low{};
    Int3 high{};
    for (std::size_t a = 0; a < 3; ++a)
    {
      low[a] = std::max(begin[a], origin[a] * ratio[a]);
      high[a] = std::min(end[a], (origin[a] + edge) * ratio[a]);
    }
    for (std::int64_t z = low[2]; z < high[2]; ++z)
    {
      const std::int64_t sz = z / ratio[2] - origin[2] + BrickBorder;
      for (std::int64_t y = low[1]; y < high[1]; ++y)
      {
        const std::int64_t sy = y / ratio[1] - origin[1] + BrickBorder;
        const std::int64_t row = (sz * stored + sy) * stored + BrickBorder - origin[0];
        std::byte* to = this->Out + this->OffsetOf(low[0], y, z) * bytes;
        const std::byte* from = brick.Voxels.data();
        if (ratio[0] == 1)
        {
          std::memcpy(to, from + static_cast<std::size_t>(row + low[0]) * bytes,
            static_cast<std::size_t>(high[0] - low[0]) * bytes);
          continue;
        }
        for (std::int64_t x = low[0]; x < high[0]; ++x, to += bytes)
        {
          std::memcpy(to, from + static_cast<std::size_t>(row + x / ratio[0]) * bytes, bytes);
        }
      }
    }
  }

  void FillZero(const Int3& begin, const Int3& end)
  {
    for (std::int64_t z = begin[2]; z < end[2]; ++z)
    {
      for (std::int64_t y = begin[1]; y < end[1]; ++y)
      {
        std::memset(this->Out + this->OffsetOf(begin[0], y, z) * this->VoxelBytes, 0,
          static_cast<std::size_t>(end[0] - begin[0]) * this->VoxelBytes);
      }
    }
  }

  /// Voxels before (x, y, z) in the output.
  std::size_t OffsetOf(std::int64_t x, std::int64_t y, std::int64_t z) const
  {
    return static_cast<std::size_t>(
      ((z - this->First[2]) * this->Size[1] + (y - this->First[1])) * this->Size[0] +
      (x - this->First[0]));
  }

  void NoteFailure(const Status& status)
  {
    const std::lock_guard<std::mutex> lock(this->Mutex);
    if (this->Report.FailedBricks++ == 0)
    {
      this->Report.FirstFailure = status;
    }
  }

  BrickSource& Source;
  const VolumeInfo& Info;
  const int Level;
  const Int3 First;
  const Int3 Size;
  std::byte* const Out;
  const std::size_t VoxelBytes;
  Int3 FirstBrick{};
  Int3 Bricks{};
  std::int64_t Total = 0;
  std::atomic<std::int64_t> Next{ 0 };
  std::atomic<std::int64_t> Finished{ 0 };
  std::atomic<bool> Stop{ false };
  std::mutex Mutex;
  std::condition_variable Changed;
};

} // namespace

ReadBoxReport ReadBox(BrickSource& source, int level, const Int3& first, const Int3& size,
  std::byte* out, const std::function<bool(double)>& progress)
{
  if (size[0] <= 0 || size[1] <= 0 || size[2] <= 0)
  {
    return {};
  }
  BoxReader reader(source, level, first, size, out);
  const std::int64_t total = reader.NumberOfBricks();
  const std::int64_t wanted = std::clamp<std::int64_t>(std::thread::hardware_concurrency(), 1, 8);
  std::vector<std::thread> threads;
  for (std::int64_t i = 0; i < std::min(wanted, total); ++i)
  {
    try
    {
      threads.emplace_back([&reader] { reader.Work(); });
    }
    catch (const std::exception&)
    {
      break; // fewer threads do as well
    }
  }
  if (threads.empty())
  {
    reader.Work();
  }
  bool cancelled = false;
  while (!reader.WaitDone(std::chrono::milliseconds(50)))
  {
    if (progress && !progress(static_cast<double>(reader.Done()) / static_cast<double>(total)))
    {
      cancelled = true;
      reader.Cancel();
    }
  }
  {
    const WaitScope waiting;
    for (std::thread& thread : threads)
    {
      thread.join();
    }
  }
  reader.Report.Cancelled = cancelled;
  return std::move(reader.Report);
}

} // namespace teravox
