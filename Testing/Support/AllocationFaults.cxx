// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "AllocationFaults.h"

#include <atomic>
#include <cstdlib>
#include <limits>
#include <new>

namespace teravox::test
{

namespace
{
constexpr std::int64_t Never = std::numeric_limits<std::int64_t>::max();
thread_local std::int64_t Left = Never;
thread_local std::size_t Least = 0;
thread_local bool IsSpared = false;
std::atomic<std::uint64_t> Period{ 0 };
std::atomic<std::uint64_t> Allocations{ 0 };

bool FailsNow(std::size_t size)
{
  if (Left != Never && size >= Least && --Left < 0)
  {
    Left = Never;
    return true;
  }
  const std::uint64_t period = Period.load();
  return period != 0 && !IsSpared && Allocations.fetch_add(1) % period == period - 1;
}
} // namespace

void FailAllocationAfter(std::int64_t skip, std::size_t least)
{
  Least = least;
  Left = skip;
}

bool EndAllocationFault()
{
  const bool met = Left == Never;
  Left = Never;
  return met;
}

void FailAllocationsOfOthers(std::uint64_t period)
{
  IsSpared = period != 0;
  Period = period;
}

} // namespace teravox::test

void* operator new(std::size_t size)
{
  void* memory = teravox::test::FailsNow(size) ? nullptr : std::malloc(size == 0 ? 1 : size);
  if (memory == nullptr)
  {
    throw std::bad_alloc();
  }
  return memory;
}

void* operator new[](std::size_t size)
{
  return ::operator new(size);
}

// Sanitizers have their own of these, which wouldn't call those above.
void* operator new(std::size_t size, const std::nothrow_t&) noexcept
{
  return teravox::test::FailsNow(size) ? nullptr : std::malloc(size == 0 ? 1 : size);
}

void* operator new[](std::size_t size, const std::nothrow_t& tag) noexcept
{
  return ::operator new(size, tag);
}

void operator delete(void* memory) noexcept
{
  std::free(memory);
}

void operator delete[](void* memory) noexcept
{
  std::free(memory);
}

void operator delete(void* memory, std::size_t) noexcept
{
  std::free(memory);
}

void operator delete[](void* memory, std::size_t) noexcept
{
  std::free(memory);
}

void operator delete(void* memory, const std::nothrow_t&) noexcept
{
  std::free(memory);
}

void operator delete[](void* memory, const std::nothrow_t&) noexcept
{
  std::free(memory);
}
