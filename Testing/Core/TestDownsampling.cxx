// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "Downsampling.h"

#include <cstring>
#include <gtest/gtest.h>
#include <map>
#include <random>

namespace teravox
{

namespace
{
template <typename T>
ScalarType TypeOf()
{
  ScalarType found = ScalarType::Float64;
  for (const ScalarType type : AllScalarTypes)
  {
    found = DispatchScalarType(type, [](auto v) { return std::is_same_v<decltype(v), T>; }) ? type
                                                                                            : found;
  }
  return found;
}

template <typename T>
std::vector<T> Downsample(const std::vector<T>& in, const Int3& dims, const Int3& group,
  Downsampling method = Downsampling::Average, int components = 1)
{
  const Int3 out{ CeilDiv(dims[0], group[0]), CeilDiv(dims[1], group[1]),
    CeilDiv(dims[2], group[2]) };
  std::vector<T> result(static_cast<std::size_t>(out[0] * out[1] * out[2] * components));
  DownsampleDense(TypeOf<T>(), reinterpret_cast<const std::byte*>(in.data()), dims, components,
    group, method, reinterpret_cast<std::byte*>(result.data()));
  return result;
}
} // namespace

TEST(Downsampling, IntegersRoundToNearestHalvesUpwards)
{
  EXPECT_EQ(downsampling::DivideRounded(5, 2), 3);
  EXPECT_EQ(downsampling::DivideRounded(-5, 2), -2);
  EXPECT_EQ(downsampling::DivideRounded(-6, 4), -1);
  EXPECT_EQ(downsampling::DivideRounded(-7, 4), -2);
  for (std::int64_t count = 1; count < 20; ++count)
  {
    for (std::int64_t sum = -100; sum < 100; ++sum)
    {
      const double exact = std::floor(static_cast<double>(sum) / static_cast<double>(count) + 0.5);
      ASSERT_EQ(downsampling::DivideRounded(sum, count),
        static_cast<std::int64_t>(exact + (exact < 0 ? -0.25 : 0.25)))
        << sum << " / " << count;
    }
  }
}

TEST(Downsampling, AMaskIsWhereAnyOfAGroupIs)
{
  const std::vector<float> in{ 0, 0, -1, 0.25f, 0, //
    0, 0, std::numeric_limits<float>::quiet_NaN(), -5, 7 };
  EXPECT_EQ(
    Downsample(in, { 5, 2, 1 }, { 2, 2, 1 }, Downsampling::Any), (std::vector<float>{ 0, 1, 1 }));
  const std::vector<std::uint8_t> bytes{ 0, 0, 0, 1, 0, 0, 0, 255 };
  EXPECT_EQ(Downsample(bytes, { 4, 1, 2 }, { 2, 1, 2 }, Downsampling::Any),
    (std::vector<std::uint8_t>{ 0, 1 }));
  EXPECT_EQ(Downsample(bytes, { 4, 1, 2 }, { 1, 1, 2 }, Downsampling::Any, 1),
    (std::vector<std::uint8_t>{ 0, 0, 0, 1 }));
}

TEST(Downsampling, ExtremesOfAllIntegerTypesAreExact)
{
  for (const ScalarType type : AllScalarTypes)
  {
    DispatchScalarType(type,
      [](auto tag)
      {
        using T = decltype(tag);
        for (const T v :
          { std::numeric_limits<T>::lowest(), std::numeric_limits<T>::max(), T{ 1 } })
        {
          EXPECT_EQ(
            Downsample(std::vector<T>(27, v), { 3, 3, 3 }, { 2, 2, 2 }), std::vector<T>(8, v));
        }
      });
  }
}

TEST(Downsampling, PartialGroupsAverageWhatTheyHave)
{
  // 3 x 2 x 1 in groups of 2 x 2 x 2.
  const std::vector<std::uint8_t> in{ 1, 2, 10, 3, 4, 21 };
  EXPECT_EQ(Downsample(in, { 3, 2, 1 }, { 2, 2, 2 }), (std::vector<std::uint8_t>{ 3, 16 }));
  EXPECT_EQ(Downsample(in, { 3, 2, 1 }, { 2, 1, 1 }), (std::vector<std::uint8_t>{ 2, 10, 4, 21 }));
  EXPECT_EQ(Downsample(in, { 1, 2, 1 }, { 2, 2, 2 }, Downsampling::Average, 3),
    (std::vector<std::uint8_t>{ 2, 3, 16 }));
}

TEST(Downsampling, NaNIsLeftOut)
{
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<float> in{ 1, nan, nan, 3, nan, nan };
  for (const Downsampling method : { Downsampling::Average, Downsampling::Mode })
  {
    const std::vector<float> out = Downsample(in, { 6, 1, 1 }, { 2, 1, 1 }, method);
    EXPECT_EQ(out[0], 1);
    EXPECT_EQ(out[1], 3);
    EXPECT_TRUE(std::isnan(out[2]));
  }
}

TEST(Downsampling, SumsBeyondDoubleDoNotOverflow)
{
  const double most = std::numeric_limits<double>::max();
  EXPECT_EQ(Downsample(std::vector<double>{ most, most }, { 2, 1, 1 }, { 2, 1, 1 })[0], most);
}

// Whole groups of eight have a loop of their own; a box with a partial group beside them hasn't.
TEST(Downsampling, EightsAreTheSameBitsAsAnyOtherGroup)
{
  std::mt19937_64 random(17);
  for (const ScalarType type : AllScalarTypes)
  {
    DispatchScalarType(type,
      [&](auto tag)
      {
        using T = decltype(tag);
        const Int3 whole{ 38, 6, 4 };
        const Int3 partial{ 39, 6, 4 };
        for (int trial = 0; trial < 60; ++trial)
        {
          std::vector<T> in(38 * 6 * 4);
          for (T& v : in)
          {
            const auto bits = random();
            std::memcpy(
              &v, &bits, sizeof(T)); // of floats: NaN, infinities, huge and tiny ones, too
            if (std::is_floating_point_v<T> && trial % 3 != 0)
            {
              v = trial % 3 == 1 ? static_cast<T>(bits % 1000) / 7 : -T{ 0 };
              v = trial % 4 == 0 && bits % 50 == 0 ? std::numeric_limits<T>::quiet_NaN() : v;
              v = trial % 5 == 0 && bits % 40 == 0 ? std::numeric_limits<T>::max() : v;
            }
          }
          std::vector<T> wider;
          for (std::size_t row = 0; row < 6 * 4; ++row)
          {
            wider.insert(wider.end(), in.begin() + static_cast<std::ptrdiff_t>(row * 38),
              in.begin() + static_cast<std::ptrdiff_t>(row * 38 + 38));
            wider.push_back(T{ 1 });
          }
          const std::vector<T> a = Downsample(in, whole, { 2, 2, 2 });
          const std::vector<T> b = Downsample(wider, partial, { 2, 2, 2 });
          for (std::size_t i = 0; i < a.size(); ++i)
          {
            const T other = b[i / 19 * 20 + i % 19];
            ASSERT_TRUE(
              (a[i] != a[i] && other != other) || std::memcmp(&a[i], &other, sizeof(T)) == 0)
              << ToString(type) << " trial " << trial << ", " << i;
          }
        }
      });
  }
}

TEST(Downsampling, LabelsTakeTheMostFrequentTheSmallestOfEquals)
{
  const std::vector<std::int16_t> in{ 7, 3, 7, 3, -5, 9, -5, 2 };
  EXPECT_EQ(Downsample(in, { 4, 1, 1 }, { 4, 1, 1 }, Downsampling::Mode)[0], 3);
  EXPECT_EQ(Downsample(in, { 8, 1, 1 }, { 8, 1, 1 }, Downsampling::Mode)[0], -5);
  EXPECT_EQ(Downsample(in, { 2, 2, 2 }, { 2, 2, 2 }, Downsampling::Mode)[0], -5);
}

// Against a plain implementation; a volume cut into slabs gives the same.
TEST(Downsampling, RandomVolumesAgreeWithThePlainSum)
{
  std::mt19937_64 random(99);
  for (int trial = 0; trial < 50; ++trial)
  {
    const auto pick = [&](std::int64_t most)
    { return 1 + static_cast<std::int64_t>(random() % static_cast<std::uint64_t>(most)); };
    const Int3 dims{ pick(13), pick(11), pick(9) };
    const Int3 group{ pick(4), pick(4), pick(4) };
    const int components = static_cast<int>(pick(4));
    std::vector<std::int32_t> in(
      static_cast<std::size_t>(dims[0] * dims[1] * dims[2] * components));
    for (std::int32_t& v : in)
    {
      v = static_cast<std::int32_t>(random());
    }
    const std::vector<std::int32_t> out =
      Downsample(in, dims, group, Downsampling::Average, components);
    std::map<std::size_t, std::pair<std::int64_t, std::int64_t>> sums;
    const Int3 outDims{ CeilDiv(dims[0], group[0]), CeilDiv(dims[1], group[1]),
      CeilDiv(dims[2], group[2]) };
    for (std::size_t i = 0; i < in.size(); ++i)
    {
      const std::int64_t voxel = static_cast<std::int64_t>(i) / components;
      const Int3 p{ voxel % dims[0], voxel / dims[0] % dims[1], voxel / dims[0] / dims[1] };
      const std::int64_t target =
        p[0] / group[0] + outDims[0] * (p[1] / group[1] + outDims[1] * (p[2] / group[2]));
      auto& [sum, count] = sums[static_cast<std::size_t>(target * components) +
        i % static_cast<std::size_t>(components)];
      sum += in[i];
      ++count;
    }
    ASSERT_EQ(sums.size(), out.size());
    for (const auto& [i, pair] : sums)
    {
      const long double average =
        static_cast<long double>(pair.first) / static_cast<long double>(pair.second);
      ASSERT_EQ(out[i], static_cast<std::int64_t>(std::floor(average + 0.5L)));
    }
    // The upper part alone, from a plane between two groups on.
    const std::int64_t cut = outDims[2] / 2;
    const std::size_t slice = static_cast<std::size_t>(dims[0] * dims[1] * components);
    const std::vector<std::int32_t> upper(
      in.begin() + static_cast<std::ptrdiff_t>(slice * static_cast<std::size_t>(cut * group[2])),
      in.end());
    const std::vector<std::int32_t> part = Downsample(upper,
      { dims[0], dims[1], dims[2] - cut * group[2] }, group, Downsampling::Average, components);
    ASSERT_TRUE(std::equal(part.rbegin(), part.rend(), out.rbegin()));
  }
}

} // namespace teravox
