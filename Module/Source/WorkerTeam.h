// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace teravox
{

/// Threads that work through numbered items together and sleep in between. OpenMP's threads spin
/// while they wait for one another, which takes the processor from whoever else has work: from the
/// thread that reads, from the system that writes, and from other programs.
/// Thread: one, which is a member of the team itself.
class WorkerTeam
{
public:
  /// Of the item, and of who does it: 0 to Size() - 1.
  using Work = std::function<void(std::int64_t item, int worker)>;

  /// `threads` with the calling one; fewer, if the system has no more.
  explicit WorkerTeam(int threads);
  ~WorkerTeam();
  WorkerTeam(const WorkerTeam&) = delete;
  WorkerTeam& operator=(const WorkerTeam&) = delete;
  WorkerTeam(WorkerTeam&&) = delete;
  WorkerTeam& operator=(WorkerTeam&&) = delete;

  /// Members, the calling thread included.
  int Size() const { return static_cast<int>(this->Threads.size()) + 1; }

  /// Does the items 0 to count - 1, which are begun in this order. The first exception is thrown
  /// again once nothing runs any more; items that hadn't begun by then are left out.
  void Run(std::int64_t count, const Work& work);

  /// The same in two steps: the others begin, and the calling thread can do something else before
  /// it helps in Finish(). Requires: `work` lives until then, and each Start() has its Finish().
  void Start(std::int64_t count, const Work& work);
  void Finish();

private:
  void Serve(int worker);
  void TakePart(int worker);

  std::mutex Mutex; // guards what follows
  std::condition_variable Begun;
  std::condition_variable Ended;
  const Work* Current = nullptr;
  std::uint64_t Round = 0;
  int Busy = 0; // threads that are in TakePart()
  bool Stop = false;
  std::exception_ptr Failure;

  std::int64_t Count = 0; // written while nobody takes part
  std::atomic<std::int64_t> Next{ 0 };
  std::vector<std::thread> Threads;
};

/// Lets items of a team do something in their order. Each item takes its turn once, whatever
/// happens to it. Thread: any.
class Turns
{
public:
  explicit Turns(std::int64_t first)
    : Next(first)
  {
  }

  /// f() must not throw.
  template <typename F>
  void Take(std::int64_t item, const F& f)
  {
    std::unique_lock<std::mutex> lock(this->Mutex);
    this->Changed.wait(lock, [&] { return this->Next == item; });
    f();
    ++this->Next;
    this->Changed.notify_all();
  }

private:
  std::mutex Mutex;
  std::condition_variable Changed;
  std::int64_t Next;
};

} // namespace teravox
