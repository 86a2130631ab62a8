// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "FormulaBrickSource.h"
#include "SourceChecks.h"

#include <cmath>
#include <gtest/gtest.h>
#include <random>

namespace teravox
{

namespace
{
constexpr std::int64_t Largest = (std::int64_t{ 1 } << 31) - 1;
constexpr std::array<Int3, 5> Volumes{ { { 64, 64, 64 }, { 100, 37, 81 }, { 729, 729, 729 },
  { 1 << 30, 1 << 30, 1 << 30 }, { Largest, 1 << 20, Largest - 1 } } };

std::int64_t Pick(std::mt19937_64& random, std::int64_t low, std::int64_t high)
{
  return low + static_cast<std::int64_t>(random() % static_cast<std::uint64_t>(high - low + 1));
}

std::shared_ptr<FormulaBrickSource> SourceOf(
  FormulaKind kind, const Int3& dims, ScalarType type = ScalarType::UInt8, int brick = 64)
{
  FormulaDescription formula;
  formula.Field = MakeFormula(kind, dims);
  formula.Dimensions = dims;
  formula.Type = type;
  formula.BrickSize = brick;
  formula.Name = ToString(kind);
  return FormulaBrickSource::Make(formula).Value();
}

/// Menger's sponge by its definition, on the centres of 3^depth voxels.
bool IsSolid(Int3 voxel, int depth)
{
  for (int k = 0; k < depth; ++k)
  {
    int middle = 0;
    for (std::int64_t& v : voxel)
    {
      middle += v % 3 == 1 ? 1 : 0;
      v /= 3;
    }
    if (middle >= 2)
    {
      return false;
    }
  }
  return true;
}
} // namespace

// The property that skipping rests on: whatever the box, the bound contains the values.
TEST(Formula, BoundsContainTheValuesOfRandomBoxes)
{
  std::mt19937_64 random(2024);
  for (const FormulaKind kind : AllFormulaKinds)
  {
    for (const Int3& dims : Volumes)
    {
      const auto formula = MakeFormula(kind, dims);
      for (int trial = 0; trial < 400; ++trial)
      {
        const std::int64_t f = std::int64_t{ 1 } << random() % 20;
        const Int3 factor{ f, f, random() % 3 == 0 ? 1 : f };
        Int3 low{};
        Int3 high{};
        for (std::size_t a = 0; a < 3; ++a)
        {
          // Boxes of all sizes, some beyond the end as partial last groups are.
          const std::int64_t end = 2 * dims[a] + std::min(factor[a], dims[a]);
          const std::int64_t length = std::int64_t{ 1 } << random() % 33;
          low[a] = Pick(random, 0, end);
          high[a] = std::min(end, low[a] + Pick(random, 0, length));
        }
        const ValueRange bound = formula->Bound(low, high, factor);
        for (int sample = 0; sample < 40; ++sample)
        {
          Int3 place{};
          for (std::size_t a = 0; a < 3; ++a)
          {
            // The corners too.
            place[a] =
              sample < 8 ? (sample >> a & 1 ? high[a] : low[a]) : Pick(random, low[a], high[a]);
          }
          const double value = formula->Value(place, factor);
          ASSERT_TRUE(bound.Min <= value && value <= bound.Max)
            << ToString(kind) << " at " << place[0] << " " << place[1] << " " << place[2] << ": "
            << value << " not in [" << bound.Min << ", " << bound.Max << "]";
          ASSERT_TRUE(kind == FormulaKind::Ramp || (value >= 0 && value <= 1));
        }
      }
    }
  }
}

TEST(Formula, FillIsValue)
{
  std::mt19937_64 random(77);
  for (const FormulaKind kind : AllFormulaKinds)
  {
    for (const Int3& dims : Volumes)
    {
      const auto formula = MakeFormula(kind, dims);
      const Int3 factor{ 1, 2, 4 };
      Formula::Grid grid;
      for (std::size_t a = 0; a < 3; ++a)
      {
        for (std::size_t i = 0; i < 7 + a; ++i)
        {
          grid[a].push_back(Pick(random, 0, 2 * dims[a]));
        }
      }
      std::vector<double> values(7 * 8 * 9);
      formula->Fill(grid, factor, values.data());
      for (std::size_t i = 0; i < values.size(); ++i)
      {
        const Int3 place{ grid[0][i % 7], grid[1][i / 7 % 8], grid[2][i / 56] };
        ASSERT_EQ(values[i], formula->Value(place, factor));
      }
    }
  }
}

TEST(Formula, MarschnerLobbAtKnownPlaces)
{
  const Int3 dims{ 1001, 1001, 1001 };
  const auto formula = MakeFormula(FormulaKind::MarschnerLobb, dims);
  // In the middle sin = 0 and cos(2 pi f) = 1: (1 + 2/4) / (5/2) = 0.6.
  EXPECT_NEAR(formula->Value({ 1000, 1000, 1000 }, { 1, 1, 1 }), 0.6, 1e-12);
  // At the lower and upper face sin is -1 and 1.
  EXPECT_NEAR(formula->Value({ 1000, 1000, -1 }, { 1, 1, 1 }), 1.0, 1e-12);
  EXPECT_NEAR(formula->Value({ 1000, 1000, 2001 }, { 1, 1, 1 }), 0.2, 1e-12);
  // r = 1: cos(pi/2) = 0, so the ripple is at its top again.
  EXPECT_NEAR(formula->Value({ 2001, 1000, 1000 }, { 1, 1, 1 }), 0.6, 1e-12);
}

TEST(Formula, RampIsLinearToTheLastVoxelOfTheLargestVolume)
{
  const auto ramp = MakeRamp({ Largest, 1, 1 }, 0);
  EXPECT_DOUBLE_EQ(ramp->Value({ 0, 0, 0 }, { 1, 1, 1 }), 0.5 / static_cast<double>(Largest));
  const std::int64_t last = 2 * (Largest - 1);
  EXPECT_LT(ramp->Value({ last - 2, 0, 0 }, { 1, 1, 1 }), ramp->Value({ last, 0, 0 }, { 1, 1, 1 }));
  EXPECT_LT(ramp->Value({ last, 0, 0 }, { 1, 1, 1 }), 1.0);
}

TEST(Formula, ShellsAtKnownPlaces)
{
  const Int3 dims{ 4000, 4000, 4000 };
  const auto shells = MakeShells(dims, 4);
  const auto along = [&](double radius)
  {
    const auto x = static_cast<std::int64_t>(std::llround(4000 * (1 + radius))) - 1;
    return shells->Value({ x, 3999, 3999 }, { 1, 1, 1 });
  };
  for (int i = 0; i < 4; ++i)
  {
    EXPECT_EQ(along((i + 0.85) / 4), 1.0);
    EXPECT_EQ(along((i + 0.40) / 4), 0.0);
    EXPECT_NEAR(along((i + 0.70) / 4), 0.5, 0.02);
    EXPECT_NEAR(along((i + 1.00) / 4), 0.5, 0.02);
  }
  EXPECT_EQ(along(1.3), 0.0);
}

// Where a voxel lies deep enough in the solid or in a hole, the soft sponge is the sponge.
TEST(Formula, SpongeIsMengersSponge)
{
  const auto sponge = MakeFormula(FormulaKind::Sponge, { 729, 729, 729 });
  // Holes of at least 6 voxels: 243, 81, 27, 9.
  std::mt19937_64 random(5);
  int solid = 0;
  int hollow = 0;
  for (int i = 0; i < 20000; ++i)
  {
    const Int3 voxel{ Pick(random, 0, 728), Pick(random, 0, 728), Pick(random, 0, 728) };
    const double value = sponge->Value({ 2 * voxel[0], 2 * voxel[1], 2 * voxel[2] }, { 1, 1, 1 });
    const bool expected = IsSolid({ voxel[0] / 9, voxel[1] / 9, voxel[2] / 9 }, 4);
    ASSERT_EQ(value > 0.5, expected) << voxel[0] << " " << voxel[1] << " " << voxel[2];
    solid += value == 1 ? 1 : 0;
    hollow += value == 0 ? 1 : 0;
  }
  // (20/27)^4 of the volume is solid; most voxels are far from faces.
  EXPECT_GT(solid, 1500);
  EXPECT_GT(hollow, 8000);
}

// 3^18 voxels: the digits of the last voxels are exact, and the far corner is the near one.
TEST(Formula, SpongeIsExactAndSymmetricAtTheFarEnd)
{
  const std::int64_t n = 387420489; // 3^18
  const auto sponge = MakeFormula(FormulaKind::Sponge, { n, n, n });
  std::mt19937_64 random(6);
  int solid = 0;
  for (int i = 0; i < 20000; ++i)
  {
    const Int3 near{ Pick(random, 0, 2000), Pick(random, 0, 2000), Pick(random, 0, 2000) };
    const double value = sponge->Value({ 2 * near[0], 2 * near[1], 2 * near[2] }, { 1, 1, 1 });
    const Int3 far{ 2 * (n - 1 - near[0]), 2 * (n - 1 - near[1]), 2 * (n - 1 - near[2]) };
    ASSERT_EQ(value, sponge->Value(far, { 1, 1, 1 }));
    const auto cell = [&](std::int64_t v) { return v / 9; };
    ASSERT_EQ(value > 0.5, IsSolid({ cell(near[0]), cell(near[1]), cell(near[2]) }, 16));
    solid += value > 0.5 ? 1 : 0;
  }
  EXPECT_GT(solid, 1000);
  EXPECT_LT(solid, 19000);
}

TEST(FormulaBrickSource, AllTypesAllLevelsAllVoxels)
{
  const Int3 dims{ 45, 30, 37 };
  for (const FormulaKind kind : AllFormulaKinds)
  {
    for (const ScalarType type : AllScalarTypes)
    {
      DispatchScalarType(type,
        [&](auto tag)
        {
          using T = decltype(tag);
          const auto source = SourceOf(kind, dims, type, 8);
          const auto formula = MakeFormula(kind, dims);
          const double low =
            IsFloat(type) ? 0 : static_cast<double>(std::numeric_limits<T>::lowest());
          const double high =
            IsFloat(type) ? 1 : static_cast<double>(std::numeric_limits<T>::max());
          const PyramidLayout& layout = source->Info().Layout;
          for (int l = 0; l < layout.NumberOfLevels(); ++l)
          {
            const Int3 n = layout.Dimensions(l);
            const Int3 f = layout.Factor(l);
            test::Dense<T> truth{ n, 1, {} };
            for (std::int64_t i = 0; i < n[0] * n[1] * n[2]; ++i)
            {
              const Int3 p{ i % n[0], i / n[0] % n[1], i / n[0] / n[1] };
              // 2 x0 with x0 = f x + (f - 1) / 2.
              const Int3 place{ 2 * f[0] * p[0] + f[0] - 1, 2 * f[1] * p[1] + f[1] - 1,
                2 * f[2] * p[2] + f[2] - 1 };
              const double v = low + formula->Value(place, f) * (high - low);
              truth.Voxels.push_back(IsFloat(type)
                  ? static_cast<T>(v)
                  : static_cast<T>(std::min(std::floor(v + 0.5), high)));
            }
            test::ExpectBricks(*source, l, truth);
            const test::RangeCounts counts = test::ExpectRanges(*source, l, truth);
            if (kind == FormulaKind::Constant || kind == FormulaKind::Ramp)
            {
              EXPECT_EQ(counts.Exact, counts.Regions);
            }
          }
          EXPECT_TRUE(source->Info().Range.IsKnown());
        });
    }
  }
}

TEST(FormulaBrickSource, OutputRangeScalesTheValues)
{
  FormulaDescription formula;
  formula.Field = MakeRamp({ 100, 8, 8 }, 0);
  formula.Dimensions = { 100, 8, 8 };
  formula.Type = ScalarType::Int16;
  formula.Output = { -1000, 3000 };
  formula.BrickSize = 128;
  const auto source = FormulaBrickSource::Make(formula).Value();
  const BrickPointer brick = source->ReadBrick({}).Value();
  const auto* row =
    reinterpret_cast<const std::int16_t*>(brick->Voxels.data()) + (2 * 132 + 2) * 132 + 2;
  EXPECT_EQ(row[0], -980);
  EXPECT_EQ(row[50], 1020);
  EXPECT_EQ(row[99], 2980);
  EXPECT_EQ(source->Info().Range, (ValueRange{ -980, 2980 }));
}

// Ranges prove that most of a huge volume is empty, without a voxel.
TEST(FormulaBrickSource, SpongeAndShellsHaveEmptyAndSingleRegions)
{
  for (const FormulaKind kind : { FormulaKind::Sponge, FormulaKind::Shells })
  {
    const auto source = SourceOf(kind, { 1 << 30, 1 << 30, 1 << 30 });
    const PyramidLayout& layout = source->Info().Layout;
    std::mt19937_64 random(9);
    int empty = 0;
    int full = 0;
    int mixed = 0;
    for (int i = 0; i < 4000; ++i)
    {
      BrickKey key;
      key.Level = static_cast<std::uint8_t>(random() % 12);
      const Int3 bricks = layout.Bricks(key.Level);
      key.X = static_cast<std::uint32_t>(Pick(random, 0, bricks[0] - 1));
      key.Y = static_cast<std::uint32_t>(Pick(random, 0, bricks[1] - 1));
      key.Z = static_cast<std::uint32_t>(Pick(random, 0, bricks[2] - 1));
      const ValueRange range = source->ReadRanges(key, { 1, 1, 1 }).Value()[0];
      empty += range == ValueRange{ 0, 0 } ? 1 : 0;
      full += range == ValueRange{ 255, 255 } ? 1 : 0;
      mixed += range.IsSingle() ? 0 : 1;
    }
    EXPECT_LE(empty + full + mixed, 4000); // soft faces are single values in between
    EXPECT_GT(empty, 1000) << ToString(kind);
    EXPECT_GT(mixed, 10) << ToString(kind);
    if (kind == FormulaKind::Shells)
    {
      EXPECT_GT(full, 500);
    }
    // Large regions as well, in the blocks below the directory: else the renderer would ask for all
    // of them.
    const int pageLevel = layout.PageDepth(0) - 1;
    BrickKey region;
    region.PageLevel = static_cast<std::uint8_t>(pageLevel);
    const auto regions = source->ReadRanges(region, layout.Pages(0, pageLevel)).Value();
    const auto isEmpty = [](const ValueRange& range) { return range == ValueRange{ 0, 0 }; };
    EXPECT_GT(std::count_if(regions.begin(), regions.end(), isEmpty), 0) << ToString(kind);
  }
}

// Near a face of the sponge the range of a brick is what its voxels have, or nearly.
TEST(FormulaBrickSource, SpongeBoundsAreTight)
{
  const auto source = SourceOf(FormulaKind::Sponge, { 729, 729, 729 }, ScalarType::UInt8, 16);
  const PyramidLayout& layout = source->Info().Layout;
  int exact = 0;
  int all = 0;
  for (std::uint32_t i = 0; i < 46 * 46; i += 3)
  {
    BrickKey key;
    key.X = i % 46;
    key.Y = i / 46;
    key.Z = 7;
    const BrickPointer brick = source->ReadBrick(key).Value();
    ValueRange truth = ValueRange::Void();
    for (const std::byte v : brick->Voxels)
    {
      truth.Include(static_cast<double>(v));
    }
    const ValueRange range = source->ReadRanges(key, { 1, 1, 1 }).Value()[0];
    ASSERT_TRUE(range.Contains(truth));
    exact += range == truth ? 1 : 0;
    ++all;
  }
  EXPECT_GT(exact, all * 3 / 4) << "of " << all << ", " << layout.NumberOfLevels() << " levels";
}

// Opposite corners of the largest volume are computed, not cut off or wrapped around.
TEST(FormulaBrickSource, TheLargestVolumeToItsLastBrick)
{
  const Int3 dims{ Largest, Largest, Largest };
  const auto source = SourceOf(FormulaKind::Ramp, dims, ScalarType::Float64);
  const PyramidLayout& layout = source->Info().Layout;
  for (int l = 0; l < layout.NumberOfLevels(); ++l)
  {
    BrickKey key;
    key.Level = static_cast<std::uint8_t>(l);
    key.X = static_cast<std::uint32_t>(layout.Bricks(l)[0] - 1);
    key.Y = static_cast<std::uint32_t>(layout.Bricks(l)[1] - 1);
    key.Z = static_cast<std::uint32_t>(layout.Bricks(l)[2] - 1);
    const BrickPointer brick = source->ReadBrick(key).Value();
    const std::int64_t voxel = layout.Dimensions(l)[0] - 1;
    const double expected = (static_cast<double>(voxel) + 0.5) *
      static_cast<double>(layout.Factor(l)[0]) / static_cast<double>(Largest);
    const auto* voxels = reinterpret_cast<const double*>(brick->Voxels.data());
    EXPECT_NEAR(voxels[68 * 68 * 68 - 1], expected, 1e-15 * static_cast<double>(1 + l))
      << "level " << l;
    const ValueRange range = source->ReadRanges(key, { 1, 1, 1 }).Value()[0];
    EXPECT_EQ(range.Max, voxels[68 * 68 * 68 - 1]);
  }
  EXPECT_EQ(source->BytesRead(), 0u);
  EXPECT_EQ(source->MemoryUsed(), 0u);
}

TEST(FormulaBrickSource, ErrorsSayWhatIsWrong)
{
  const auto fails = [](auto change, const char* words)
  {
    FormulaDescription formula;
    formula.Field = MakeConstant(1);
    formula.Dimensions = { 8, 8, 8 };
    change(formula);
    const auto source = FormulaBrickSource::Make(formula);
    ASSERT_FALSE(source.Ok());
    EXPECT_EQ(source.GetStatus().Code(), StatusCode::InvalidArgument);
    EXPECT_NE(source.GetStatus().Message().find(words), std::string::npos)
      << source.GetStatus().Message();
  };
  fails([](FormulaDescription& f) { f.Field.reset(); }, "no formula");
  fails([](FormulaDescription& f) { f.Dimensions[0] = Largest + 1; }, "2^31");
  fails([](FormulaDescription& f) { f.Output = { 0, 256 }; }, "u8");
  fails([](FormulaDescription& f) { f.Output = { 9, 3 }; }, "u8");
  fails([](FormulaDescription& f) { f.Spacing[1] = -1; }, "spacing");
  EXPECT_TRUE(FormulaKindFromName("sponge").Ok());
  const Status status = FormulaKindFromName("spunge").GetStatus();
  EXPECT_NE(
    status.Message().find("constant, ramp, shells, marschner-lobb, sponge"), std::string::npos);
}

// A user's formula that fails gives a status, not an exception.
TEST(FormulaBrickSource, AFormulaThatThrowsBecomesAStatus)
{
  class Broken : public Formula
  {
  public:
    double Value(const Int3&, const Int3&) const override { throw std::runtime_error("no luck"); }
    ValueRange Bound(const Int3&, const Int3&, const Int3&) const override
    {
      return ValueRange::Unknown();
    }
  };
  FormulaDescription formula;
  formula.Field = std::make_shared<Broken>();
  formula.Dimensions = { 8, 8, 8 };
  const auto source = FormulaBrickSource::Make(formula).Value();
  const auto brick = source->ReadBrick({});
  ASSERT_FALSE(brick.Ok());
  EXPECT_NE(brick.GetStatus().Message().find("no luck"), std::string::npos);
  EXPECT_FALSE(source->ReadRanges({}, { 1, 1, 1 }).Value()[0].IsKnown());
}

} // namespace teravox
