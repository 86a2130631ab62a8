// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "RawVolume.h"
#include "Status.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <utility>

/// Headers of numbers, which NIfTI and MRC have.
namespace teravox::headers
{

/// Numbers of a header, of either byte order. REQUIRES: what is asked for lies inside the bytes.
class Fields
{
public:
  Fields(std::string bytes, bool swapped)
    : Bytes(std::move(bytes))
    , Swapped(swapped)
  {
  }
  template <typename T>
  T At(std::size_t offset) const
  {
    std::array<char, sizeof(T)> raw{};
    std::copy_n(this->Bytes.begin() + static_cast<std::ptrdiff_t>(offset), sizeof(T), raw.begin());
    if (this->Swapped)
    {
      std::reverse(raw.begin(), raw.end());
    }
    T value{};
    std::memcpy(&value, raw.data(), sizeof(T));
    return value;
  }
  /// Numbers beside each other.
  template <typename T, std::size_t N>
  std::array<T, N> Several(std::size_t offset) const
  {
    std::array<T, N> values{};
    for (std::size_t i = 0; i < N; ++i)
    {
      values.at(i) = this->At<T>(offset + i * sizeof(T));
    }
    return values;
  }

private:
  std::string Bytes;
  bool Swapped;
};

/// The first bytes of a header, decoded if the file is compressed by gzip: at most `most`. Errors:
/// as Begin(), and Corrupt if a compressed file has fewer than `least`.
Result<std::string> DecodedBegin(const std::string& fileName, std::size_t least, std::size_t most);

/// The volume with its voxels in this file, which may be compressed by gzip, behind so many bytes
/// of what it holds. Errors: as Begin().
Result<RawVolume> VoxelsIn(const std::string& fileName, std::int64_t before, RawVolume raw);

/// InvalidArgument: there are `times` time points, none of them the chosen one.
Status NoTimePoint(const std::string& fileName, std::int64_t times, int timePoint);

} // namespace teravox::headers
