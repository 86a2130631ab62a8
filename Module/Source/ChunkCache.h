// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "Status.h"
#include "Types.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

namespace teravox
{

/// A decoded chunk, full size: x fastest, components interleaved. Empty Voxels: nothing is stored,
/// every voxel is the dataset's fill value.
struct Chunk
{
  std::vector<std::byte> Voxels;
};
using ChunkPointer = std::shared_ptr<const Chunk>;

/// Which chunk of which dataset of a source.
struct ChunkKey
{
  std::uint32_t Dataset = 0;
  Int3 Index{ 0, 0, 0 };

  bool operator==(const ChunkKey& o) const
  {
    return this->Dataset == o.Dataset && this->Index == o.Index;
  }
};

struct ChunkKeyHash
{
  std::size_t operator()(const ChunkKey& key) const;
};

/// Decoded chunks by least recent use, within a budget in bytes that counts cached, referenced and
/// in-flight chunks. Simultaneous wishes for one chunk are read once.
/// Thread: any. A thread must not hold a chunk while it asks for another: room is made by waiting.
class ChunkCache
{
public:
  /// Asked by a loader before it allocates.
  class Reserve
  {
  public:
    /// Bytes for the whole of reading and decoding, of which `kept` stay with the chunk. Waits for
    /// room. Errors: ResourceExhausted, never fits.
    Status operator()(std::uint64_t needed, std::uint64_t kept) const;
    /// Memory of `kept` bytes that a dropped chunk has left, to be filled anew: the system's memory
    /// costs more than decoding into it. Empty if there is none.
    std::vector<std::byte> TakeRoom() const;

  private:
    friend class ChunkCache;
    struct Ticket;
    explicit Reserve(Ticket& ticket)
      : Self(&ticket)
    {
    }
    Ticket* Self;
  };
  using Loader = std::function<Result<ChunkPointer>(const Reserve&)>;

  explicit ChunkCache(std::uint64_t budget);
  ~ChunkCache();
  ChunkCache(const ChunkCache&) = delete;
  ChunkCache& operator=(const ChunkCache&) = delete;
  ChunkCache(ChunkCache&&) = delete;
  ChunkCache& operator=(ChunkCache&&) = delete;

  /// The chunk, from the cache or by calling `load` outside the cache's lock. Failures and
  /// exceptions of `load` go to all who wait for the chunk, and aren't remembered.
  Result<ChunkPointer> Get(const ChunkKey& key, const Loader& load);
  /// As Get(), but nothing if another thread is loading the chunk at this moment.
  std::optional<Result<ChunkPointer>> TryGet(const ChunkKey& key, const Loader& load);

  std::uint64_t MemoryUsed() const;
  std::uint64_t Budget() const;
  /// Drops at once what doesn't fit.
  void SetBudget(std::uint64_t bytes);

private:
  struct State;
  Result<ChunkPointer> Load(const ChunkKey& key, const Loader& load);
  std::shared_ptr<State> Shared; // outlives the cache as long as a chunk is referenced
};

} // namespace teravox
