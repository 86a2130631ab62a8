// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>

namespace teravox::test
{

/// No memory on demand: AllocationFaults.cxx replaces the global operator new of the program.

/// Of the calling thread, the allocation of at least `least` bytes after `skip` others of that kind
/// throws std::bad_alloc, once.
void FailAllocationAfter(std::int64_t skip, std::size_t least = 0);
/// Whether that allocation has been met; none fails any more.
bool EndAllocationFault();

/// Of all threads but the calling one, each `period`-th allocation fails; 0: none does.
void FailAllocationsOfOthers(std::uint64_t period);

} // namespace teravox::test
