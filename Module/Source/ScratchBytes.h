// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

namespace teravox
{

/// Working memory that a thread keeps from one chunk to the next, because fresh memory costs as
/// much as decoding: the system clears it page by page.
/// Thread: one; meant to be thread_local.
class ScratchBytes
{
public:
  /// What one thread may keep at most.
  static constexpr std::size_t Limit = std::size_t{ 4 } << 20;

  std::vector<std::byte>& Bytes() { return this->Data; }
  /// Gives back what is more than one usual chunk needs.
  void Trim()
  {
    if (this->Data.capacity() > Limit)
    {
      std::vector<std::byte>().swap(this->Data);
    }
  }

private:
  std::vector<std::byte> Data;
};

} // namespace teravox
