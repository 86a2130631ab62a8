// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "BrickTexels.h"
#include "ScaledBrickSource.h"

#include <cmath>
#include <cstring>
#include <gtest/gtest.h>
#include <limits>
#include <random>

namespace teravox
{

namespace
{
constexpr int Stored = 12;

// One brick of given values, over and over.
template <typename T>
class ValueSource final : public BrickSource
{
public:
  ValueSource(ScalarType type, std::vector<T> values)
    : Values(std::move(values))
  {
    this->Info_.Type = type;
    this->Info_.Range = ValueRange::Void();
    for (const T v : this->Values)
    {
      if (std::isfinite(static_cast<double>(v)))
      {
        this->Info_.Range.Include(static_cast<double>(v));
      }
    }
  }

  const VolumeInfo& Info() const override { return this->Info_; }
  Result<BrickPointer> ReadBrick(const BrickKey&) override
  {
    auto brick = std::make_shared<Brick>();
    brick->Type = this->Info_.Type;
    brick->StoredSize = Stored;
    brick->Voxels.resize(Stored * Stored * Stored * sizeof(T));
    auto* voxels = reinterpret_cast<T*>(brick->Voxels.data());
    for (std::size_t i = 0; i < Stored * Stored * Stored; ++i)
    {
      voxels[i] = this->Values[i % this->Values.size()];
    }
    return BrickPointer(brick);
  }
  Result<std::vector<ValueRange>> ReadRanges(const BrickKey&, const Int3&) override
  {
    return std::vector<ValueRange>{ this->Info_.Range, ValueRange::Unknown(), ValueRange::Void() };
  }

private:
  VolumeInfo Info_;
  std::vector<T> Values;
};

template <typename T>
T VoxelOf(const Brick& brick, std::size_t i)
{
  T v{};
  std::memcpy(&v, brick.Voxels.data() + i * sizeof(T), sizeof(T));
  return v;
}

// The value of a texel as the marcher computes it, but in double precision.
double ValueOf(const ConvertedBrick& brick, std::size_t i)
{
  float texel = 0;
  std::memcpy(&texel, brick.Bytes.data() + i * sizeof(texel), sizeof(texel));
  return static_cast<double>(texel) * static_cast<double>(brick.Scale) +
    static_cast<double>(brick.OffsetHigh) + static_cast<double>(brick.OffsetLow);
}

template <typename T>
ConvertedBrick Convert(ScalarType type, std::vector<T> values)
{
  ValueSource<T> source(type, std::move(values));
  return ConvertBrick(*source.ReadBrick({}).Value(), TexelFormat::Choose(type));
}
} // namespace

TEST(ScaledBrickSource, OnlyWhatFloatsCannotSquare)
{
  const auto exponent = [](ScalarType type, double low, double high)
  {
    VolumeInfo info;
    info.Type = type;
    info.Range = { low, high };
    return ScaleExponent(info);
  };
  EXPECT_EQ(exponent(ScalarType::Float32, 0, 255), 0);
  EXPECT_EQ(exponent(ScalarType::Float32, -1e6, 1e-3), 0);
  EXPECT_EQ(exponent(ScalarType::Float32, 0, 0), 0);
  EXPECT_EQ(exponent(ScalarType::UInt32, 0, 1e30), 0);
  EXPECT_EQ(exponent(ScalarType::Float32, 0, 1e-27), std::ilogb(1e-27));
  EXPECT_EQ(exponent(ScalarType::Float32, -3e38, 1), std::ilogb(3e38));
  EXPECT_EQ(exponent(ScalarType::Float64, -1, 1e200), std::ilogb(1e200));
  const double infinity = std::numeric_limits<double>::infinity();
  EXPECT_EQ(exponent(ScalarType::Float64, -1e200, infinity), std::ilogb(1e200));
  EXPECT_EQ(exponent(ScalarType::Float64, -infinity, infinity), 0);
  VolumeInfo nothing;
  nothing.Type = ScalarType::Float32;
  nothing.Range = ValueRange::Void();
  EXPECT_EQ(ScaleExponent(nothing), 0);
}

TEST(ScaledBrickSource, ValuesRangesAndFunctionsAreScaledExactly)
{
  const std::vector<double> values = { 0, 1e200, -3e199, std::nan(""), 7.25e198,
    std::numeric_limits<double>::infinity() };
  auto inner = std::make_shared<ValueSource<double>>(ScalarType::Float64, values);
  const int exponent = ScaleExponent(inner->Info());
  ScaledBrickSource source(inner, exponent);
  EXPECT_EQ(source.Info().Range.Max, std::ldexp(1e200, -exponent));
  const auto brick = source.ReadBrick({});
  ASSERT_TRUE(brick);
  for (std::size_t i = 0; i < Stored * Stored * Stored; ++i)
  {
    const double value = values[i % values.size()];
    const double scaled = VoxelOf<double>(*brick.Value(), i);
    ASSERT_TRUE(std::isnan(value) ? std::isnan(scaled) : std::ldexp(scaled, exponent) == value);
  }
  const auto ranges = source.ReadRanges({}, { 3, 1, 1 });
  ASSERT_TRUE(ranges);
  EXPECT_EQ(ranges.Value()[0], source.Info().Range);
  EXPECT_EQ(ranges.Value()[1], ValueRange::Unknown());
  EXPECT_TRUE(ranges.Value()[2].IsVoid());

  TransferFunction function;
  function.Opacity = [](double v) { return v / 1e200; };
  function.Color = [](double v, double* rgb) { rgb[0] = rgb[1] = rgb[2] = v / 2e200; };
  function.Knots = { 0, 1e200 };
  const TransferFunction scaled = ScaleTransferFunction(function, exponent);
  const double at = std::ldexp(7.25e198, -exponent);
  EXPECT_EQ(scaled.Opacity(at), function.Opacity(7.25e198));
  double rgb[3];
  scaled.Color(at, rgb);
  EXPECT_EQ(rgb[1], 7.25e198 / 2e200);
  EXPECT_EQ(scaled.Knots[1], std::ldexp(1e200, -exponent));
}

// Values far from 0 keep the differences between them; one voxel far from all others costs the
// others nothing.
TEST(BrickTexels, FloatsKeepWhatMatters)
{
  std::vector<double> doubles;
  std::vector<float> floats;
  std::vector<std::uint32_t> integers;
  for (int i = 0; i < 250; ++i)
  {
    doubles.push_back(1e12 + 1e-3 * i);
    floats.push_back(1000.0f + static_cast<float>(i) / 16384.0f);
    integers.push_back(4000000000u + static_cast<std::uint32_t>(i));
  }
  const ConvertedBrick ofDoubles = Convert(ScalarType::Float64, doubles);
  const ConvertedBrick ofFloats = Convert(ScalarType::Float32, floats);
  const ConvertedBrick ofIntegers = Convert(ScalarType::UInt32, integers);
  for (std::size_t i = 0; i < doubles.size(); ++i)
  {
    ASSERT_NEAR(ValueOf(ofDoubles, i), doubles[i], 1.3e-4); // spacing of doubles there
    ASSERT_EQ(ValueOf(ofFloats, i), static_cast<double>(floats[i]));
    ASSERT_EQ(ValueOf(ofIntegers, i), static_cast<double>(integers[i]));
  }
  for (const double outlier : { 1e30, -1e30, -9999.0 })
  {
    const ConvertedBrick brick = Convert<double>(ScalarType::Float64, { 0.25, outlier, 0.5, 0.75 });
    EXPECT_EQ(ValueOf(brick, 0), 0.25) << outlier;
    EXPECT_EQ(ValueOf(brick, 3), 0.75) << outlier;
    EXPECT_NEAR(ValueOf(brick, 1) / outlier, 1, 1e-7);
  }
}

} // namespace teravox
