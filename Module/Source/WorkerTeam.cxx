// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "WorkerTeam.h"

#include <new>
#include <system_error>
#include <utility>

namespace teravox
{

WorkerTeam::WorkerTeam(int threads)
{
  try
  {
    this->Threads.reserve(static_cast<std::size_t>(threads));
    for (int i = 1; i < threads; ++i)
    {
      this->Threads.emplace_back([this, i] { this->Serve(i); });
    }
  }
  catch (const std::system_error&) // no more threads: those that are there do the work
  {
  }
  catch (const std::bad_alloc&)
  {
  }
}

WorkerTeam::~WorkerTeam()
{
  {
    const std::lock_guard<std::mutex> lock(this->Mutex);
    this->Stop = true;
  }
  this->Begun.notify_all();
  for (std::thread& thread : this->Threads)
  {
    thread.join();
  }
}

void WorkerTeam::Run(std::int64_t count, const Work& work)
{
  this->Start(count, work);
  this->Finish();
}

void WorkerTeam::Start(std::int64_t count, const Work& work)
{
  {
    const std::lock_guard<std::mutex> lock(this->Mutex);
    this->Count = count;
    this->Next = 0;
    this->Current = &work;
    ++this->Round;
  }
  this->Begun.notify_all();
}

void WorkerTeam::Finish()
{
  {
    const std::lock_guard<std::mutex> lock(this->Mutex);
    ++this->Busy;
  }
  this->TakePart(0);
  std::unique_lock<std::mutex> lock(this->Mutex);
  this->Ended.wait(lock, [this] { return this->Busy == 0; });
  this->Current = nullptr; // who comes late finds nothing
  if (this->Failure)
  {
    const std::exception_ptr failure = std::move(this->Failure);
    this->Failure = nullptr;
    std::rethrow_exception(failure);
  }
}

void WorkerTeam::Serve(int worker)
{
  std::uint64_t done = 0;
  for (;;)
  {
    {
      std::unique_lock<std::mutex> lock(this->Mutex);
      this->Begun.wait(lock, [&] { return this->Stop || this->Round != done; });
      if (this->Stop)
      {
        return;
      }
      done = this->Round;
      if (this->Current == nullptr)
      {
        continue;
      }
      ++this->Busy;
    }
    this->TakePart(worker);
  }
}

void WorkerTeam::TakePart(int worker)
{
  std::exception_ptr failure;
  for (std::int64_t i = this->Next++; i < this->Count; i = this->Next++)
  {
    try
    {
      (*this->Current)(i, worker);
    }
    catch (...)
    {
      failure = std::current_exception();
      this->Next = this->Count;
    }
  }
  const std::lock_guard<std::mutex> lock(this->Mutex);
  if (failure && !this->Failure)
  {
    this->Failure = std::move(failure);
  }
  if (--this->Busy == 0)
  {
    this->Ended.notify_all();
  }
}

} // namespace teravox
