// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "AtlasPlan.h"
#include "TexelFormat.h"

#include <algorithm>
#include <gtest/gtest.h>

namespace teravox
{

namespace
{
// As many bits as there are formats.
FilterProbe ProbeOf(int bits)
{
  return { (bits & 1) != 0, (bits & 2) != 0, (bits & 4) != 0 };
}
} // namespace

TEST(TexelFormat, NoTypeLosesPrecision)
{
  for (int bits = 0; bits < 8; ++bits)
  {
    const FilterProbe probe = ProbeOf(bits);
    for (const ScalarType type : AllScalarTypes)
    {
      const TexelFormat format = TexelFormat::Choose(type, probe);
      // Doubles and 32-bit integers lie in floats, relative to their brick.
      EXPECT_GE(format.BytesPerTexel, std::min<std::size_t>(SizeOf(type), 4)) << ToString(type);
      EXPECT_EQ(format.Relative,
        type == ScalarType::Float64 || type == ScalarType::UInt32 || type == ScalarType::Int32)
        << ToString(type);
      // The driver filters only what it filters exactly.
      const bool exact = format.BytesPerTexel == 1 ? probe.R8
        : format.BytesPerTexel == 2                ? probe.R16
                                                   : probe.R32F;
      EXPECT_EQ(format.DriverFilter, exact) << ToString(type) << " " << probe.ToString();
    }
  }
}

TEST(TexelFormat, EightBitsBecomeSixteenOnlyWhereThatPays)
{
  const auto bytes = [](const FilterProbe& probe)
  { return TexelFormat::Choose(ScalarType::UInt8, probe).BytesPerTexel; };
  EXPECT_EQ(bytes({ false, false, false }), 1u);
  EXPECT_EQ(bytes({ true, true, true }), 1u);
  EXPECT_EQ(bytes({ false, true, false }), 2u);
}

TEST(TexelFormat, ProbesAsText)
{
  EXPECT_EQ((FilterProbe{ true, true, true }).ToString(), "r8,r16,r32f");
  EXPECT_EQ(FilterProbe().ToString(), "none");
  for (int bits = 0; bits < 8; ++bits)
  {
    const FilterProbe probe = ProbeOf(bits);
    const auto read = FilterProbe::FromString(probe.ToString());
    ASSERT_TRUE(read) << probe.ToString();
    EXPECT_EQ(read->R8, probe.R8);
    EXPECT_EQ(read->R16, probe.R16);
    EXPECT_EQ(read->R32F, probe.R32F);
  }
  for (const char* wrong : { "", ",", "r8,none", "R16", "r16 r32f", "r12" })
  {
    EXPECT_FALSE(FilterProbe::FromString(wrong)) << wrong;
  }
}

// What is planned without a driver is what is asked for with one.
TEST(TexelFormat, RequestsSayAllThatFollowsFromTheFormat)
{
  const FilterProbe probe{ false, true, true };
  const AtlasRequest bytes =
    AtlasRequest::For(TexelFormat::Choose(ScalarType::UInt8, probe), 4, 100, 50);
  EXPECT_EQ(bytes.BytesPerTexel, 8u);
  EXPECT_TRUE(bytes.PowerOfTwo);
  EXPECT_FALSE(bytes.SlotTable);
  EXPECT_EQ(bytes.ReservedBytes, 100u * 50 * 52 + 8 * 12 + TableBytesReserved);
  const AtlasRequest doubles =
    AtlasRequest::For(TexelFormat::Choose(ScalarType::Float64, {}), 1, 1, 1);
  EXPECT_EQ(doubles.BytesPerTexel, 4u);
  EXPECT_FALSE(doubles.PowerOfTwo);
  EXPECT_TRUE(doubles.SlotTable);
  EXPECT_EQ(doubles.ReservedBytes, 52 + 12 + TableBytesReserved);
}

} // namespace teravox
