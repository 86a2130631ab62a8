// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "AtlasPlan.h"

#include <cstdint>
#include <cstdlib>
#include <memory>

namespace teravox
{

/// Zeroed memory that costs nothing before it is touched. Thread: none; move-only value.
class LazyMemory
{
public:
  LazyMemory() = default;
  /// Null where the system has none.
  static LazyMemory Make(std::uint64_t bytes);
  std::uint8_t* Data() const { return this->Block.get(); }

private:
  struct Free
  {
    void operator()(std::uint8_t* p) const { std::free(p); }
  };
  std::unique_ptr<std::uint8_t, Free> Block;
};

/// The slots of an atlas in the memory of the host, for the native marcher: texels and the ranges
/// of their cells, brick after brick, component after component, x fastest. Thread: written by the
/// render thread between passes, read by all threads of a pass.
class NativeAtlas
{
public:
  /// All storage is reserved here and never grows; pages are touched when bricks come. Errors:
  /// ResourceExhausted.
  static Result<std::unique_ptr<NativeAtlas>> Make(const AtlasPlan& plan);

  /// Requires: as many bytes as the plan has for one component of a slot.
  void Write(std::uint32_t slot, const std::uint8_t* texels, std::size_t texelBytes,
    const std::uint8_t* cells, std::size_t cellBytes, std::uint32_t component = 0);
  void WriteEntry(std::uint32_t slot, float offsetHigh, float offsetLow, float scale,
    std::uint32_t component = 0);

  const std::uint8_t* Voxels() const { return this->Voxels_.Data() + Margin; }
  const std::uint8_t* Cells() const { return this->Cells_.Data(); }
  std::uint64_t* Occupancy() const
  {
    return reinterpret_cast<std::uint64_t*>(this->Occupancy_.Data());
  }
  std::uint32_t* OccupancyVersion() const
  {
    return reinterpret_cast<std::uint32_t*>(this->Occupancy_.Data() + this->VersionOffset);
  }
  /// Null where the format isn't relative to its brick.
  const float* SlotTable() const { return reinterpret_cast<const float*>(this->Slots.Data()); }

private:
  NativeAtlas() = default;
  /// Loads of several texels at once may reach beyond both ends.
  static constexpr std::uint64_t Margin = 64;
  LazyMemory Voxels_;
  LazyMemory Cells_;
  LazyMemory Occupancy_; ///< words of bits, then a version per slot
  LazyMemory Slots;
  std::uint64_t VersionOffset = 0;
  std::uint32_t Components = 1;
};

} // namespace teravox
