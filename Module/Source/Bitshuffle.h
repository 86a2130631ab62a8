// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "Status.h"

#include <cstddef>
#include <vector>

namespace teravox
{

/// What HDF5's filter 32008 does: in blocks of elements, the first bits of all elements, their
/// second bits and so on; each block then perhaps coded by LZ4 or Zstandard.
class Bitshuffle
{
public:
  /// `parameters` are those of the filter, `elementSize` the bytes of an element where they don't
  /// tell.
  Bitshuffle(const std::vector<unsigned>& parameters, std::size_t elementSize);

  /// False: a coding or sizes that aren't known.
  bool IsKnown() const;
  /// Whether it leaves the size of a chunk as it is.
  bool KeepsSize() const { return this->Coding == None; }
  /// What it adds to a chunk of that many bytes at most.
  std::size_t LargestGrowth(std::size_t bytes) const;

  /// Requires: IsKnown(). The result has at most `limit` bytes. Thread: any.
  /// Errors: Corrupt, with a cause that fits behind "... doesn't decode: ". Throws std::bad_alloc.
  Status Decode(
    const std::vector<std::byte>& in, std::size_t limit, std::vector<std::byte>& out) const;

private:
  static constexpr unsigned None = 0;
  static constexpr unsigned LZ4 = 2;
  static constexpr unsigned Zstandard = 3;

  std::size_t ElementSize = 1;
  std::size_t BlockSize = 0; // elements
  unsigned Coding = None;
};

} // namespace teravox
