// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "Types.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>

namespace teravox
{

/// Names one brick, or one region of PageBlockEdge^PageLevel bricks: volume, time step, component
/// group, pyramid level and integer position. PageLevel 0 is the brick itself.
struct BrickKey
{
  std::uint32_t Volume = 0;
  std::uint32_t Time = 0;
  std::uint16_t Component = 0;
  std::uint8_t Level = 0;
  std::uint8_t PageLevel = 0;
  std::uint32_t X = 0;
  std::uint32_t Y = 0;
  std::uint32_t Z = 0;

  /// The brick of a level with this index, of volume, time and component 0.
  static BrickKey Of(int level, const Int3& index)
  {
    BrickKey key;
    key.Level = static_cast<std::uint8_t>(level);
    key.X = static_cast<std::uint32_t>(index[0]);
    key.Y = static_cast<std::uint32_t>(index[1]);
    key.Z = static_cast<std::uint32_t>(index[2]);
    return key;
  }

  bool operator==(const BrickKey& o) const
  {
    return this->X == o.X && this->Y == o.Y && this->Z == o.Z && this->Level == o.Level &&
      this->PageLevel == o.PageLevel && this->Volume == o.Volume && this->Time == o.Time &&
      this->Component == o.Component;
  }
  bool operator!=(const BrickKey& o) const { return !(*this == o); }
  /// The first of the bricks or regions of a region or page block, one page level down. Requires: a
  /// page level of at least 1.
  BrickKey FirstChild() const;
  /// A total order without meaning, for deterministic ties.
  bool operator<(const BrickKey& o) const;
  /// "level 2, brick (3, 0, 7)", with volume, time, component where they aren't zero.
  std::string ToString() const;
};

struct BrickKeyHash
{
  std::size_t operator()(const BrickKey& k) const
  {
    std::uint64_t h = (std::uint64_t{ k.X } << 32 | k.Y) * 0x9E3779B97F4A7C15ull;
    h ^= h >> 29;
    h = (h +
          (std::uint64_t{ k.Z } << 32 | std::uint64_t{ k.Volume } << 16 |
            std::uint64_t{ k.Level } << 8 | k.PageLevel)) *
      0xBF58476D1CE4E5B9ull;
    h ^= h >> 32;
    h = (h + (std::uint64_t{ k.Time } << 16 | k.Component)) * 0x94D049BB133111EBull;
    return static_cast<std::size_t>(h ^ (h >> 31));
  }
};

} // namespace teravox
