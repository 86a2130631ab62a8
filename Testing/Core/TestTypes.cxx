// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "Types.h"

#include <gtest/gtest.h>
#include <set>
#include <string>
#include <type_traits>

namespace teravox
{

TEST(Types, SizesAndNamesOfAllTypes)
{
  const std::array<std::size_t, 8> sizes{ 1, 1, 2, 2, 4, 4, 4, 8 };
  const std::array<const char*, 8> names{ "u8", "i8", "u16", "i16", "u32", "i32", "f32", "f64" };
  for (std::size_t i = 0; i < AllScalarTypes.size(); ++i)
  {
    EXPECT_EQ(SizeOf(AllScalarTypes[i]), sizes[i]);
    EXPECT_STREQ(ToString(AllScalarTypes[i]), names[i]);
    EXPECT_EQ(IsFloat(AllScalarTypes[i]), i >= 6);
    const bool isSigned =
      DispatchScalarType(AllScalarTypes[i], [](auto v) { return std::is_signed_v<decltype(v)>; });
    EXPECT_EQ(isSigned, i % 2 == 1 || i >= 6);
  }
}

TEST(Types, RangesKnowVoidSingleAndUnknown)
{
  ValueRange range = ValueRange::Void();
  EXPECT_TRUE(range.IsVoid());
  EXPECT_FALSE(range.IsSingle());
  range.Include(3.0);
  EXPECT_TRUE(range.IsSingle());
  EXPECT_TRUE(range.IsKnown());
  range.Include(std::numeric_limits<double>::quiet_NaN());
  EXPECT_TRUE(range.IsSingle());
  range.Include(ValueRange::Void());
  EXPECT_TRUE(range.IsSingle());
  range.Include(-1.0);
  EXPECT_EQ(range, (ValueRange{ -1, 3 }));
  EXPECT_TRUE(range.Contains(ValueRange::Void()));
  EXPECT_TRUE(range.Contains({ 0, 3 }));
  EXPECT_FALSE(range.Contains({ 0, 3.5 }));
  EXPECT_TRUE(ValueRange::Unknown().Contains(range));
  EXPECT_FALSE(ValueRange::Unknown().IsKnown());
  range.Include(ValueRange::Unknown());
  EXPECT_EQ(range, ValueRange::Unknown());
}

namespace
{
#if defined(__GNUC__)
__attribute__((noinline))
#endif
ValueRange
RoundToFloat(const ValueRange& range)
{
  return { static_cast<double>(static_cast<float>(range.Min)),
    static_cast<double>(static_cast<float>(range.Max)) };
}
} // namespace

// GCC 12 leaves this rounding out at -O2 unless it is told not to vectorise straight-line code: see
// teravox_own_target().
TEST(Types, TheCompilerRoundsToFloat)
{
  const ValueRange rounded = RoundToFloat({ 0.1, 0.2 });
  EXPECT_EQ(rounded.Min, 0.100000001490116119384765625);
  EXPECT_EQ(rounded.Max, 0.20000000298023223876953125);
}

TEST(Types, CeilDivAtTheLimits)
{
  EXPECT_EQ(CeilDiv(0, 7), 0);
  EXPECT_EQ(CeilDiv(7, 7), 1);
  EXPECT_EQ(CeilDiv(8, 7), 2);
  EXPECT_EQ(CeilDiv(std::numeric_limits<std::int64_t>::max(), 2), std::int64_t{ 1 } << 62);
}

} // namespace teravox
