// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "AtlasPlan.h"
#include "TexelFormat.h"

#include <algorithm>
#include <gtest/gtest.h>

namespace teravox
{

TEST(TexelFormat, NoTypeLosesPrecision)
{
  for (const ScalarType type : AllScalarTypes)
  {
    const TexelFormat format = TexelFormat::Choose(type);
    // What has 32 bits and more lies in floats, relative to its brick.
    EXPECT_EQ(format.BytesPerTexel, std::min<std::size_t>(SizeOf(type), 4)) << ToString(type);
    EXPECT_EQ(format.Relative, SizeOf(type) >= 4) << ToString(type);
  }
}

// What is planned without a driver is what is asked for with one.
TEST(TexelFormat, RequestsSayAllThatFollowsFromTheFormat)
{
  const AtlasRequest bytes = AtlasRequest::For(TexelFormat::Choose(ScalarType::UInt8), 4, 100, 50);
  EXPECT_EQ(bytes.BytesPerTexel, 4u);
  EXPECT_FALSE(bytes.SlotTable);
  EXPECT_EQ(bytes.ReservedBytes, 100u * 50 * RayStateBytesPerPixel + 8 * 12 + TableBytesReserved);
  const AtlasRequest doubles = AtlasRequest::For(TexelFormat::Choose(ScalarType::Float64), 1, 1, 1);
  EXPECT_EQ(doubles.BytesPerTexel, 4u);
  EXPECT_TRUE(doubles.SlotTable);
  EXPECT_EQ(doubles.ReservedBytes, RayStateBytesPerPixel + 12 + TableBytesReserved);
}

} // namespace teravox
