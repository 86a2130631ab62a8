// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "VoxelReader.h"

#include <algorithm>
#include <cstdint>
#include <functional>
#include <utility>

namespace teravox::test
{

/// A cube of u8 or u16 with data in two opposite corners only, and known to be 0 elsewhere: a file
/// of it is as large as they are, whatever the cube.
class CornersReader : public VoxelReader
{
public:
  /// The value of a voxel of a corner; `high` tells which.
  using Value = std::function<int(bool high, std::int64_t x, std::int64_t y, std::int64_t z)>;

  CornersReader(Description volume, std::int64_t corner, Value value)
    : Volume(std::move(volume))
    , Corner(corner)
    , ValueOf(std::move(value))
  {
  }

  Description Describe() const override { return this->Volume; }

  int ValueAt(std::int64_t x, std::int64_t y, std::int64_t z) const
  {
    const std::int64_t least = std::min({ x, y, z });
    const std::int64_t largest = std::max({ x, y, z });
    const bool high = least >= this->Volume.Dimensions[0] - this->Corner;
    return high || largest < this->Corner ? this->ValueOf(high, x, y, z) : 0;
  }

  Status ReadBox(const Int3& start, const Int3& size, void* out) override
  {
    if (this->Volume.Type == ScalarType::UInt8)
    {
      this->Fill(start, size, static_cast<std::uint8_t*>(out));
    }
    else
    {
      this->Fill(start, size, static_cast<std::uint16_t*>(out));
    }
    return {};
  }

  bool IsConstant(const Int3& start, const Int3& size, double* value) override
  {
    bool low = true;
    bool high = true;
    for (std::size_t a = 0; a < 3; ++a)
    {
      low = low && start[a] < this->Corner;
      high = high && start[a] + size[a] > this->Volume.Dimensions[a] - this->Corner;
    }
    *value = 0;
    return !low && !high;
  }

private:
  template <typename T>
  void Fill(const Int3& start, const Int3& size, T* to) const
  {
    for (std::int64_t z = start[2]; z < start[2] + size[2]; ++z)
    {
      for (std::int64_t y = start[1]; y < start[1] + size[1]; ++y)
      {
        for (std::int64_t x = start[0]; x < start[0] + size[0]; ++x)
        {
          *to++ = static_cast<T>(this->ValueAt(x, y, z));
        }
      }
    }
  }

  const Description Volume;
  const std::int64_t Corner;
  const Value ValueOf;
};

} // namespace teravox::test
