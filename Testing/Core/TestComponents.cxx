// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "AtlasPlan.h"
#include "BrickTexels.h"
#include "Components.h"
#include "JoinedBrickSource.h"
#include "ScalarBrickSource.h"

#include <cmath>
#include <cstring>
#include <gtest/gtest.h>

using namespace teravox;

namespace
{
// Bricks whose voxel i has the components i, 2 i and -3 i.
class ThreeComponents final : public BrickSource
{
public:
  explicit ThreeComponents(ScalarType type)
  {
    this->Info_.Layout = PyramidLayout::MakeDefault({ 20, 20, 20 }, { 1, 1, 1 }, 16).Value();
    this->Info_.Type = type;
    this->Info_.Components = 3;
    this->Info_.Range = { -12, 8 };
  }
  const VolumeInfo& Info() const override { return this->Info_; }
  Result<BrickPointer> ReadBrick(const BrickKey&) override
  {
    auto brick = std::make_shared<Brick>();
    brick->Type = this->Info_.Type;
    brick->Components = 3;
    brick->StoredSize = 20;
    brick->Voxels.resize(std::size_t{ 8000 } * 3 * SizeOf(brick->Type));
    DispatchScalarType(brick->Type,
      [&](auto zero)
      {
        using T = decltype(zero);
        auto* out = reinterpret_cast<T*>(brick->Voxels.data());
        for (int i = 0; i < 8000; ++i)
        {
          const int v = i % 5;
          out[3 * i] = static_cast<T>(v);
          out[3 * i + 1] = static_cast<T>(2 * v);
          out[3 * i + 2] = static_cast<T>(-3 * v);
        }
      });
    return BrickPointer(brick);
  }
  Result<std::vector<ValueRange>> ReadRanges(const BrickKey&, const Int3&) override
  {
    return std::vector<ValueRange>{ { -12, 8 }, { 2, 3 }, { -5, -1 }, ValueRange::Void(),
      ValueRange::Unknown(), { 7, 7 } };
  }

private:
  VolumeInfo Info_;
};
} // namespace

TEST(ScalarBrickSource, TakesAComponent)
{
  ScalarBrickSource source(std::make_shared<ThreeComponents>(ScalarType::Int16), 2);
  EXPECT_EQ(source.Info().Components, 1);
  EXPECT_EQ(source.Info().Type, ScalarType::Int16);
  const auto brick = source.ReadBrick({}).Value();
  ASSERT_EQ(brick->Voxels.size(), 8000 * sizeof(std::int16_t));
  const auto* voxels = reinterpret_cast<const std::int16_t*>(brick->Voxels.data());
  for (int i = 0; i < 8000; ++i)
  {
    ASSERT_EQ(voxels[i], -3 * (i % 5));
  }
  EXPECT_EQ(source.ReadRanges({}, { 6, 1, 1 }).Value()[1], (ValueRange{ 2, 3 }));
}

TEST(ScalarBrickSource, ComputesMagnitudesInsideTheirRanges)
{
  for (const ScalarType type :
    { ScalarType::Int16, ScalarType::Int32, ScalarType::Float32, ScalarType::Float64 })
  {
    ScalarBrickSource source(std::make_shared<ThreeComponents>(type), ScalarBrickSource::Magnitude);
    const bool wide = type == ScalarType::Int32 || type == ScalarType::Float64;
    EXPECT_EQ(source.Info().Type, wide ? ScalarType::Float64 : ScalarType::Float32);
    const auto brick = source.ReadBrick({}).Value();
    for (std::size_t i = 0; i < 8000; ++i)
    {
      const double exact = std::sqrt(14.0) * static_cast<double>(i % 5);
      const double value = wide
        ? reinterpret_cast<const double*>(brick->Voxels.data())[i]
        : static_cast<double>(reinterpret_cast<const float*>(brick->Voxels.data())[i]);
      ASSERT_NEAR(value, exact, wide ? 1e-14 : 1e-6);
      ASSERT_GE(value, source.Info().Range.Min);
      ASSERT_LE(value, source.Info().Range.Max);
    }
    const auto ranges = source.ReadRanges({}, { 6, 1, 1 }).Value();
    EXPECT_EQ(ranges[0].Min, 0);
    EXPECT_NEAR(ranges[0].Max, std::sqrt(3.0) * 12, 1e-5);
    EXPECT_NEAR(ranges[1].Min, std::sqrt(3.0) * 2, 1e-6);
    EXPECT_NEAR(ranges[2].Min, std::sqrt(3.0), 1e-6);
    EXPECT_NEAR(ranges[2].Max, std::sqrt(3.0) * 5, 1e-6);
    EXPECT_TRUE(ranges[3].IsVoid());
    EXPECT_FALSE(ranges[4].IsKnown());
    EXPECT_TRUE(ranges[5].IsSingle());
  }
}

namespace
{
std::shared_ptr<BrickSource> OneOf(ScalarType type, int component)
{
  return std::make_shared<ScalarBrickSource>(std::make_shared<ThreeComponents>(type), component);
}
} // namespace

TEST(JoinedBrickSource, HoldsTheValuesOfBoth)
{
  struct Case
  {
    ScalarType First;
    ScalarType Second;
    ScalarType Both;
  };
  for (const Case& c : { Case{ ScalarType::UInt8, ScalarType::UInt8, ScalarType::UInt8 },
         Case{ ScalarType::UInt8, ScalarType::Int16, ScalarType::Float32 },
         Case{ ScalarType::Float32, ScalarType::UInt16, ScalarType::Float32 },
         Case{ ScalarType::Int32, ScalarType::UInt8, ScalarType::Float64 },
         Case{ ScalarType::Int32, ScalarType::Int32, ScalarType::Int32 },
         Case{ ScalarType::Float32, ScalarType::Float64, ScalarType::Float64 } })
  {
    const auto made = JoinedBrickSource::Make(OneOf(c.First, 0), OneOf(c.Second, 1));
    ASSERT_TRUE(made) << made.GetStatus().Message();
    BrickSource& source = *made.Value();
    EXPECT_EQ(source.Info().Type, c.Both);
    EXPECT_EQ(source.Info().Components, 2);
    const BrickPointer brick = source.ReadBrick({}).Value();
    ASSERT_EQ(brick->Components, 2);
    ASSERT_EQ(brick->Voxels.size(), 2 * 8000 * SizeOf(c.Both));
    DispatchScalarType(c.Both,
      [&](auto zero)
      {
        const auto* voxels = reinterpret_cast<const decltype(zero)*>(brick->Voxels.data());
        for (int i = 0; i < 8000; ++i)
        {
          ASSERT_EQ(static_cast<double>(voxels[2 * i]), i % 5);
          ASSERT_EQ(static_cast<double>(voxels[2 * i + 1]), 2 * (i % 5));
        }
      });
  }
}

namespace
{
// Its ranges are others.
class OtherRanges final : public BrickSourceAdapter
{
public:
  explicit OtherRanges(std::shared_ptr<BrickSource> source)
    : BrickSourceAdapter(std::move(source))
  {
    this->Info_.Range = { 0, 100 };
  }
  Result<BrickPointer> ReadBrick(const BrickKey& key) override
  {
    return this->Source->ReadBrick(key);
  }
  Result<std::vector<ValueRange>> ReadRanges(const BrickKey&, const Int3&) override
  {
    return std::vector<ValueRange>{ { 0, 100 }, ValueRange::Void(), { 1, 2 }, { 1, 2 }, { 5, 5 },
      { 3, 8 } };
  }
};
} // namespace

TEST(JoinedBrickSource, RangesAreThoseOfTheFirst)
{
  const auto first = OneOf(ScalarType::Int16, 0);
  const auto second = std::make_shared<OtherRanges>(first);
  const auto joined = JoinedBrickSource::Make(first, second);
  BrickSource& source = *joined.Value();
  EXPECT_EQ(source.Info().Range, (ValueRange{ -12, 100 }));
  EXPECT_EQ(source.Info().ComponentRanges, (std::vector<ValueRange>{ { -12, 8 }, { 0, 100 } }));
  const std::vector<ValueRange> ranges = source.ReadRanges({}, { 6, 1, 1 }).Value();
  EXPECT_EQ(ranges[0], (ValueRange{ -12, 8 }));
  EXPECT_TRUE(ranges[1].IsVoid()); // the second has no values there
  EXPECT_EQ(ranges[2], (ValueRange{ -5, -1 }));
  EXPECT_TRUE(ranges[3].IsVoid());
  EXPECT_FALSE(ranges[4].IsKnown());
  // One value of the first isn't one of both, unless that is the same.
  EXPECT_FALSE(ranges[5].IsSingle());
  EXPECT_EQ(ranges[5].Min, 7);
  const auto same = JoinedBrickSource::Make(first, first);
  EXPECT_EQ(same.Value()->ReadRanges({}, { 6, 1, 1 }).Value()[5], (ValueRange{ 7, 7 }));
}

TEST(JoinedBrickSource, RefusesWhatDoesntFit)
{
  const auto three = std::make_shared<ThreeComponents>(ScalarType::Int16);
  const auto components = JoinedBrickSource::Make(OneOf(ScalarType::Int16, 0), three);
  EXPECT_EQ(components.GetStatus().Code(), StatusCode::InvalidArgument);
}

TEST(BrickTexels, ConvertsEachComponentByItself)
{
  ThreeComponents source(ScalarType::Float32);
  const auto brick = source.ReadBrick({}).Value();
  const TexelFormat format = TexelFormat::Choose(ScalarType::Float32);
  const std::vector<ConvertedBrick> all = ConvertComponents(*brick, format);
  ASSERT_EQ(all.size(), 3u);
  for (int c = 0; c < 3; ++c)
  {
    ScalarBrickSource one(std::make_shared<ThreeComponents>(ScalarType::Float32), c);
    const ConvertedBrick alone = ConvertBrick(*one.ReadBrick({}).Value(), format);
    EXPECT_EQ(all[static_cast<std::size_t>(c)].Bytes, alone.Bytes);
    EXPECT_EQ(all[static_cast<std::size_t>(c)].Cells, alone.Cells);
    EXPECT_EQ(all[static_cast<std::size_t>(c)].OffsetHigh, alone.OffsetHigh);
  }
}

TEST(AtlasPlan, CountsEachComponentOfASlot)
{
  const PyramidLayout layout =
    PyramidLayout::MakeDefault({ 512, 512, 512 }, { 1, 1, 1 }, 32).Value();
  for (const bool native : { false, true })
  {
    for (const int components : { 1, 2, 3, 4 })
    {
      AtlasRequest request =
        AtlasRequest::For(TexelFormat::Choose(ScalarType::Float32), components, 64, 64);
      request.BudgetBytes = std::uint64_t{ 1 } << 28;
      request.Native = native;
      const AtlasPlan plan = PlanAtlas(layout, request).Value();
      const std::uint64_t n = static_cast<std::uint64_t>(components);
      EXPECT_EQ(plan.Components, n);
      const auto voxels =
        static_cast<std::uint64_t>(plan.AtlasSize[0] * plan.AtlasSize[1] * plan.AtlasSize[2]);
      EXPECT_EQ(plan.AtlasBytes, voxels * 4 * n);
      EXPECT_EQ(plan.SlotTableBytes, plan.Slots * 16 * n);
      EXPECT_LE(plan.TotalBytes() + request.ReservedBytes, request.BudgetBytes);
      if (!native)
      {
        EXPECT_LE(plan.AtlasSize[2] * components, request.MaximumTextureSize);
      }
    }
  }
}

TEST(Components, LightPerExtinctionIsBounded)
{
  ComponentFunctions functions;
  functions.Weight = { 1, 0.5, 1, 0 };
  EXPECT_DOUBLE_EQ(LargestLight(functions, 2), 1.25);
  EXPECT_DOUBLE_EQ(LargestLight(functions, 4), 2.25);
  functions.Mode = ComponentMode::Dependent;
  EXPECT_DOUBLE_EQ(LargestLight(functions, 4), 1);
}
