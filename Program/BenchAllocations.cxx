// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// The program's own operator new: the one of the C++ library, and a counter that costs nothing but
// a look at a flag outside of `bench scale`.
#include "BenchAllocations.h"

#include <atomic>
#include <cstddef>
#include <cstdlib>
#include <new>

namespace
{

std::atomic<bool> counting{ false };
std::atomic<std::uint64_t> count{ 0 };

void* Allocate(std::size_t size, std::size_t alignment)
{
  if (counting.load(std::memory_order_relaxed))
  {
    count.fetch_add(1, std::memory_order_relaxed);
  }
  size = size == 0 ? 1 : size;
  while (true)
  {
    // aligned_alloc wants a multiple of the alignment.
    void* const memory = alignment <= alignof(std::max_align_t)
      ? std::malloc(size)
      : std::aligned_alloc(alignment, (size + alignment - 1) / alignment * alignment);
    if (memory)
    {
      return memory;
    }
    const std::new_handler handler = std::get_new_handler();
    if (!handler)
    {
      throw std::bad_alloc();
    }
    handler();
  }
}

} // namespace

// The other forms of new and delete call these.
void* operator new(std::size_t size)
{
  return Allocate(size, 1);
}
void* operator new(std::size_t size, std::align_val_t alignment)
{
  return Allocate(size, static_cast<std::size_t>(alignment));
}
void operator delete(void* memory) noexcept
{
  std::free(memory);
}
void operator delete(void* memory, std::size_t) noexcept
{
  std::free(memory);
}
void operator delete(void* memory, std::align_val_t) noexcept
{
  std::free(memory);
}
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept
{
  std::free(memory);
}

namespace teravox::program
{

AllocationCounter::AllocationCounter()
{
  count = 0;
  counting = true;
}

AllocationCounter::~AllocationCounter()
{
  counting = false;
}

std::uint64_t AllocationCounter::Count() const
{
  return count.load(std::memory_order_relaxed);
}

} // namespace teravox::program
