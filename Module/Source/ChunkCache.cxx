// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "ChunkCache.h"

#include <algorithm>
#include <condition_variable>
#include <exception>
#include <list>
#include <mutex>
#include <string>
#include <unordered_map>

namespace teravox
{

namespace
{
// Nodes of list and maps, control blocks, and the chunk itself.
constexpr std::uint64_t EntryOverhead = 256;
} // namespace

std::size_t ChunkKeyHash::operator()(const ChunkKey& key) const
{
  std::uint64_t h = key.Dataset;
  for (const std::int64_t i : key.Index)
  {
    h = (h ^ static_cast<std::uint64_t>(i)) * 0x9E3779B97F4A7C15ull;
    h ^= h >> 29;
  }
  return static_cast<std::size_t>(h);
}

struct ChunkCache::State
{
  struct InFlight
  {
    bool Done = false;
    Result<ChunkPointer> Outcome = ChunkPointer();
  };
  struct Entry
  {
    ChunkKey Key;
    ChunkPointer Chunk;
  };
  using List = std::list<Entry>;

  mutable std::mutex Mutex;
  std::condition_variable Changed;
  std::uint64_t Budget = 0;
  std::uint64_t Used = 0;
  List Recent; // front: used last
  std::unordered_map<ChunkKey, List::iterator, ChunkKeyHash> Index;
  std::unordered_map<ChunkKey, std::shared_ptr<InFlight>, ChunkKeyHash> Loading;

  void Release(std::uint64_t bytes)
  {
    const std::lock_guard<std::mutex> lock(this->Mutex);
    this->Used -= bytes;
    this->Changed.notify_all();
  }

  // Moves the least recently used entry to `dropped`, whose destructor must run without the lock:
  // it releases the bytes.
  bool DropOne(std::vector<ChunkPointer>& dropped)
  {
    if (this->Recent.empty())
    {
      return false;
    }
    dropped.push_back(std::move(this->Recent.back().Chunk));
    this->Index.erase(this->Recent.back().Key);
    this->Recent.pop_back();
    return true;
  }

  Status Reserve(std::uint64_t bytes)
  {
    std::unique_lock<std::mutex> lock(this->Mutex);
    while (this->Used + bytes > this->Budget)
    {
      if (bytes > this->Budget)
      {
        return { StatusCode::ResourceExhausted,
          "reading it takes " + std::to_string(bytes) + " bytes of memory, but the budget is " +
            std::to_string(this->Budget) + " bytes" };
      }
      std::vector<ChunkPointer> dropped;
      if (this->DropOne(dropped))
      {
        lock.unlock();
        dropped.clear();
        lock.lock();
      }
      else
      {
        // All is referenced or in flight in other threads, none of which waits while it holds.
        this->Changed.wait(lock);
      }
    }
    this->Used += bytes;
    return {};
  }
};

ChunkCache::ChunkCache(std::uint64_t budget)
  : Shared(std::make_shared<State>())
{
  this->Shared->Budget = budget;
}

ChunkCache::~ChunkCache()
{
  this->SetBudget(0);
}

Result<ChunkPointer> ChunkCache::Get(const ChunkKey& key, const Loader& load)
{
  State& state = *this->Shared;
  std::shared_ptr<State::InFlight> flight;
  {
    std::unique_lock<std::mutex> lock(state.Mutex);
    const auto found = state.Index.find(key);
    if (found != state.Index.end())
    {
      state.Recent.splice(state.Recent.begin(), state.Recent, found->second);
      return found->second->Chunk;
    }
    const auto other = state.Loading.find(key);
    if (other != state.Loading.end())
    {
      flight = other->second;
      state.Changed.wait(lock, [&] { return flight->Done; });
      return flight->Outcome;
    }
    flight = std::make_shared<State::InFlight>();
    state.Loading.emplace(key, flight);
  }

  std::uint64_t reserved = 0; // not yet handed to the chunk
  std::uint64_t keep = EntryOverhead;
  bool reservedAny = false;
  const auto reserve = [&](std::uint64_t needed, std::uint64_t kept)
  {
    Status status = state.Reserve(needed + EntryOverhead);
    if (status.Ok())
    {
      reserved = needed + EntryOverhead;
      keep = kept + EntryOverhead;
    }
    return status;
  };
  Result<ChunkPointer> outcome = ChunkPointer();
  try
  {
    outcome = load(reserve);
    if (outcome.Ok() && reserved > 0)
    {
      // From here on the bytes belong to the chunk, as long as anybody refers to it.
      std::shared_ptr<State> shared = this->Shared;
      ChunkPointer inner = outcome.Value();
      const std::uint64_t bytes = keep;
      const Chunk* const chunk = inner.get();
      reserved -= keep;
      reservedAny = true;
      outcome = ChunkPointer(chunk,
        [shared, inner, bytes](const Chunk*) mutable
        {
          inner.reset();
          shared->Release(bytes);
        });
    }
  }
  catch (const std::exception& e)
  {
    outcome = Status(StatusCode::ResourceExhausted, std::string("reading it failed: ") + e.what());
  }

  const std::lock_guard<std::mutex> lock(state.Mutex);
  state.Used -= reserved;
  // What nobody reserved memory for (an unwritten chunk) is cheaper to ask for again than to keep.
  if (outcome.Ok() && reservedAny && state.Used <= state.Budget)
  {
    state.Recent.push_front({ key, outcome.Value() });
    state.Index[key] = state.Recent.begin();
  }
  flight->Outcome = outcome;
  flight->Done = true;
  state.Loading.erase(key);
  state.Changed.notify_all();
  return outcome;
}

std::uint64_t ChunkCache::MemoryUsed() const
{
  const std::lock_guard<std::mutex> lock(this->Shared->Mutex);
  return this->Shared->Used;
}

std::uint64_t ChunkCache::Budget() const
{
  const std::lock_guard<std::mutex> lock(this->Shared->Mutex);
  return this->Shared->Budget;
}

void ChunkCache::SetBudget(std::uint64_t bytes)
{
  std::vector<ChunkPointer> dropped;
  std::unique_lock<std::mutex> lock(this->Shared->Mutex);
  this->Shared->Budget = bytes;
  std::uint64_t used = this->Shared->Used;
  while (used > bytes && this->Shared->DropOne(dropped))
  {
    used -= std::min<std::uint64_t>(used, dropped.back()->Voxels.size() + EntryOverhead);
  }
  this->Shared->Changed.notify_all();
  lock.unlock();
  dropped.clear();
}

} // namespace teravox
