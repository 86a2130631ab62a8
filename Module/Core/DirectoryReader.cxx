// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "DirectoryReader.h"

#include "WaitScope.h"

#include <algorithm>
#include <chrono>
#include <utility>

namespace teravox
{

namespace
{
/// The ranges of one level, or none. Whatever a user's source throws means that nothing is known.
std::vector<ValueRange> ReadLevel(BrickSource& source, int level)
{
  try
  {
    const PyramidLayout& layout = source.Info().Layout;
    BrickKey first;
    first.Level = static_cast<std::uint8_t>(level);
    first.PageLevel = static_cast<std::uint8_t>(layout.PageDepth(level));
    const Int3 count = layout.Pages(level, layout.PageDepth(level));
    Result<std::vector<ValueRange>> ranges = source.ReadRanges(first, count);
    if (ranges && ranges.Value().size() == static_cast<std::size_t>(count[0] * count[1] * count[2]))
    {
      return std::move(ranges.Value());
    }
  }
  catch (...) // NOLINT: a number may be thrown, too
  {
  }
  return {};
}
} // namespace

DirectoryReader::DirectoryReader(std::shared_ptr<BrickSource> source, Levels known)
  : Source(std::move(source))
  , Read(std::move(known))
{
  this->Read.resize(static_cast<std::size_t>(this->Source->Info().Layout.NumberOfLevels()));
  this->Thread = std::thread([this] { this->Work(); });
}

DirectoryReader::~DirectoryReader()
{
  const WaitScope waiting; // for a read under way
  {
    const std::lock_guard<std::mutex> lock(this->Mutex);
    this->Stop = true;
  }
  this->Thread.join();
}

void DirectoryReader::Work()
{
  std::unique_lock<std::mutex> lock(this->Mutex);
  for (std::size_t l = 0; l < this->Read.size() && !this->Stop; ++l)
  {
    if (this->Read[l].empty())
    {
      lock.unlock();
      std::vector<ValueRange> ranges = ReadLevel(*this->Source, static_cast<int>(l));
      lock.lock();
      this->Read[l] = std::move(ranges);
    }
  }
  this->Done = true;
  this->Changed.notify_all();
}

bool DirectoryReader::Wait(double seconds)
{
  constexpr double longest = 1.0e7;
  const WaitScope waiting; // before the lock is taken: it ends after the lock is released
  std::unique_lock<std::mutex> lock(this->Mutex);
  return this->Changed.wait_for(lock,
    std::chrono::duration<double>(std::clamp(seconds, 0.0, longest)),
    [this] { return this->Done; });
}

bool DirectoryReader::EndWithin(double seconds)
{
  {
    const std::lock_guard<std::mutex> lock(this->Mutex);
    this->Stop = true;
  }
  return this->Wait(seconds);
}

DirectoryReader::Levels DirectoryReader::Take()
{
  const std::lock_guard<std::mutex> lock(this->Mutex);
  return std::move(this->Read);
}

} // namespace teravox
