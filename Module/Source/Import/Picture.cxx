// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "Picture.h"

#include "HeaderText.h"

namespace teravox
{

Status CheckAlike(const std::string& fileName, const Picture& picture, const Picture& first)
{
  return picture == first
    ? Status()
    : Status(StatusCode::InvalidArgument,
        "'" + fileName + "' has a picture of another size or type than the first one.");
}

Result<VoxelReader::Description> DescribeStack(
  const std::string& fileName, const Picture& picture, std::int64_t slices)
{
  std::int64_t bytes = static_cast<std::int64_t>(SizeOf(picture.Type)) * picture.Components;
  if (__builtin_mul_overflow(bytes, picture.Width, &bytes) ||
    __builtin_mul_overflow(bytes, picture.Height, &bytes))
  {
    return headers::Corrupt(fileName, "has a picture of a size that can't be");
  }
  VoxelReader::Description volume;
  volume.Dimensions = { picture.Width, picture.Height, slices };
  volume.Type = picture.Type;
  volume.Components = picture.Components;
  return volume;
}

} // namespace teravox
