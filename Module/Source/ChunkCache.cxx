// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "ChunkCache.h"

#include <algorithm>
#include <condition_variable>
#include <exception>
#include <list>
#include <mutex>
#include <new>
#include <string>
#include <unordered_map>
#include <utility>

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

  // Null if it isn't cached. Requires: Mutex held.
  ChunkPointer Find(const ChunkKey& key)
  {
    const auto found = this->Index.find(key);
    if (found == this->Index.end())
    {
      return nullptr;
    }
    this->Recent.splice(this->Recent.begin(), this->Recent, found->second);
    return found->second->Chunk;
  }

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

  // `room` receives the memory of a dropped chunk of `kept` bytes: it is within what is reserved.
  Status Reserve(std::uint64_t bytes, std::uint64_t kept, std::vector<std::byte>& room)
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
        // Copies are made under this lock only: a count of one can't grow.
        const ChunkPointer& chunk = dropped.back();
        if (room.empty() && chunk.use_count() == 1 && chunk->Voxels.size() == kept)
        {
          // The count itself orders nothing, but dropping a reference does: whatever others read
          // before they dropped theirs lies before what follows.
          ChunkPointer(chunk).reset();
          // Chunks are made as such; they are const only for those who share them.
          room.swap(const_cast<Chunk&>(*chunk).Voxels);
        }
        lock.unlock();
        dropped.clear();
        lock.lock();
      }
      else
      {
        // All is referenced or in flight in other threads, none of which waits while it holds.
        std::vector<std::byte>().swap(room);
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

/// What a loader has reserved so far.
struct ChunkCache::Reserve::Ticket
{
  explicit Ticket(State& owner)
    : Owner(owner)
  {
  }

  State& Owner;
  std::uint64_t Reserved = 0; // not yet handed to the chunk
  std::uint64_t Kept = EntryOverhead;
  std::vector<std::byte> Room;
};

Status ChunkCache::Reserve::operator()(std::uint64_t needed, std::uint64_t kept) const
{
  Ticket& ticket = *this->Self;
  Status status = ticket.Owner.Reserve(needed + EntryOverhead, kept, ticket.Room);
  if (status.Ok())
  {
    ticket.Reserved = needed + EntryOverhead;
    ticket.Kept = kept + EntryOverhead;
  }
  return status;
}

std::vector<std::byte> ChunkCache::Reserve::TakeRoom() const
{
  return std::move(this->Self->Room);
}

Result<ChunkPointer> ChunkCache::Get(const ChunkKey& key, const Loader& load)
{
  State& state = *this->Shared;
  {
    std::unique_lock<std::mutex> lock(state.Mutex);
    if (ChunkPointer chunk = state.Find(key))
    {
      return chunk;
    }
    const auto other = state.Loading.find(key);
    if (other != state.Loading.end())
    {
      const std::shared_ptr<State::InFlight> flight = other->second;
      state.Changed.wait(lock, [&] { return flight->Done; });
      return flight->Outcome;
    }
    state.Loading.emplace(key, std::make_shared<State::InFlight>());
  }
  return this->Load(key, load);
}

std::optional<Result<ChunkPointer>> ChunkCache::TryGet(const ChunkKey& key, const Loader& load)
{
  State& state = *this->Shared;
  {
    const std::lock_guard<std::mutex> lock(state.Mutex);
    if (ChunkPointer chunk = state.Find(key))
    {
      return chunk;
    }
    if (state.Loading.count(key) != 0)
    {
      return std::nullopt;
    }
    state.Loading.emplace(key, std::make_shared<State::InFlight>());
  }
  return this->Load(key, load);
}

// Requires: the key is in Loading.
Result<ChunkPointer> ChunkCache::Load(const ChunkKey& key, const Loader& load)
{
  State& state = *this->Shared;
  Reserve::Ticket ticket(state);
  bool reservedAny = false;
  Result<ChunkPointer> outcome = ChunkPointer();
  try
  {
    outcome = load(Reserve(ticket));
    if (outcome.Ok() && ticket.Reserved > 0)
    {
      // From here on the bytes belong to the chunk, as long as anybody refers to it.
      std::shared_ptr<State> shared = this->Shared;
      ChunkPointer inner = outcome.Value();
      const std::uint64_t bytes = ticket.Kept;
      const Chunk* const chunk = inner.get();
      ticket.Reserved -= bytes;
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
  std::vector<std::byte>().swap(ticket.Room); // before its bytes are given back

  const std::lock_guard<std::mutex> lock(state.Mutex);
  state.Used -= ticket.Reserved;
  // What nobody reserved memory for (an unwritten chunk) is cheaper to ask for again than to keep.
  if (outcome.Ok() && reservedAny && state.Used <= state.Budget)
  {
    try
    {
      State::List made;
      made.push_front({ key, outcome.Value() });
      state.Index[key] = made.begin();
      state.Recent.splice(state.Recent.begin(), made);
    }
    catch (const std::bad_alloc&)
    {
      // It isn't kept.
    }
  }
  // Whatever happens, those who wait for it must hear of it.
  const auto flight = state.Loading.find(key);
  try
  {
    flight->second->Outcome = outcome;
  }
  catch (const std::bad_alloc&)
  {
    flight->second->Outcome = Status(StatusCode::ResourceExhausted, std::string());
  }
  flight->second->Done = true;
  state.Loading.erase(flight);
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
