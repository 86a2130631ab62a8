// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "Status.h"
#include "VoxelReader.h"

#include <cstdint>
#include <string>

namespace teravox
{

/// What has to be the same in all pictures of a stack of slices.
struct Picture
{
  std::uint32_t Width = 0;
  std::uint32_t Height = 0;
  ScalarType Type = ScalarType::UInt8;
  int Components = 1;

  bool operator==(const Picture& o) const
  {
    return this->Width == o.Width && this->Height == o.Height && this->Type == o.Type &&
      this->Components == o.Components;
  }
};

/// InvalidArgument with the file's name if its picture isn't like the first one.
Status CheckAlike(const std::string& fileName, const Picture& picture, const Picture& first);

/// A volume of such pictures, with spacing 1.
/// Errors: Corrupt if the bytes of a picture can't be counted in 63 bits.
Result<VoxelReader::Description> DescribeStack(
  const std::string& fileName, const Picture& picture, std::int64_t slices);

} // namespace teravox
