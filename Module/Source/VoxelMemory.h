// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <new>
#include <utility>

namespace teravox
{

/// Memory for voxels that are about to be written: not cleared first, as a std::vector's would be.
/// (Asking the system for large pages was measured as well: clearing them took longer than getting
/// the small ones, which are warm from the block before.) Thread: value.
class VoxelMemory
{
public:
  VoxelMemory() = default;
  /// Throws std::bad_alloc.
  explicit VoxelMemory(std::size_t bytes)
    : Data_(bytes == 0 ? nullptr : static_cast<std::byte*>(::operator new(bytes)))
    , Size_(bytes)
  {
  }
  ~VoxelMemory() { ::operator delete(this->Data_); }
  VoxelMemory(const VoxelMemory&) = delete;
  VoxelMemory& operator=(const VoxelMemory&) = delete;
  VoxelMemory(VoxelMemory&& other) noexcept
    : Data_(std::exchange(other.Data_, nullptr))
    , Size_(std::exchange(other.Size_, 0))
  {
  }
  VoxelMemory& operator=(VoxelMemory&& other) noexcept
  {
    std::swap(this->Data_, other.Data_);
    std::swap(this->Size_, other.Size_);
    return *this;
  }

  std::byte* Data() { return this->Data_; }
  const std::byte* Data() const { return this->Data_; }
  std::size_t Size() const { return this->Size_; }
  bool IsEmpty() const { return this->Size_ == 0; }

private:
  std::byte* Data_ = nullptr;
  std::size_t Size_ = 0;
};

} // namespace teravox
