// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <mutex>
#include <utility>
#include <vector>

namespace teravox
{

/// Memory of what was let go, for the next of the same size: a full cache drops one brick for each
/// that it takes, and memory fresh from the system costs as much as decoding into it.
/// Thread: any.
class SpareBuffers
{
public:
  using Buffer = std::vector<std::byte>;
  /// More than this never waits; some bricks per thread of a loader.
  static constexpr std::uint64_t Largest = std::uint64_t{ 16 } << 20;

  /// Of `bytes` bytes, whatever they hold; empty if there is none.
  Buffer Take(std::size_t bytes)
  {
    const std::lock_guard<std::mutex> lock(this->Mutex);
    for (Buffer& buffer : this->Buffers)
    {
      if (buffer.size() == bytes)
      {
        Buffer taken = std::move(buffer);
        buffer = std::move(this->Buffers.back());
        this->Buffers.pop_back();
        this->Used -= bytes;
        return taken;
      }
    }
    return {};
  }

  /// Keeps it within the limit. Never throws: what can't be kept is freed.
  void Give(Buffer buffer) noexcept
  {
    try
    {
      std::vector<Buffer> dropped; // freed without the lock
      const std::lock_guard<std::mutex> lock(this->Mutex);
      if (buffer.empty() || buffer.capacity() > this->Limit)
      {
        return;
      }
      this->DropDownTo(this->Limit - buffer.capacity(), dropped);
      this->Used += buffer.size();
      this->Buffers.push_back(std::move(buffer));
    }
    catch (...) // the list of buffers can't grow
    {
    }
  }

  void SetLimit(std::uint64_t bytes)
  {
    std::vector<Buffer> dropped;
    const std::lock_guard<std::mutex> lock(this->Mutex);
    this->Limit = bytes;
    this->DropDownTo(bytes, dropped);
  }

  std::uint64_t MemoryUsed() const
  {
    const std::lock_guard<std::mutex> lock(this->Mutex);
    return this->Used;
  }

private:
  // The oldest go first: those of a size that is no longer asked for.
  void DropDownTo(std::uint64_t bytes, std::vector<Buffer>& dropped)
  {
    while (this->Used > bytes)
    {
      this->Used -= this->Buffers.front().size();
      dropped.push_back(std::move(this->Buffers.front()));
      this->Buffers.erase(this->Buffers.begin());
    }
  }

  mutable std::mutex Mutex;
  std::vector<Buffer> Buffers;
  std::uint64_t Used = 0;
  std::uint64_t Limit = 0;
};

} // namespace teravox
