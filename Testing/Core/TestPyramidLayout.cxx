// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "PyramidLayout.h"

#include <gtest/gtest.h>
#include <random>
#include <utility>

namespace teravox
{

namespace
{
constexpr Double3 Isotropic{ 1, 1, 1 };

PyramidLayout Example(const PageShape& pages)
{
  return PyramidLayout::Make(
    { 8, 4, 1 }, 2, { Int3{ 1, 1, 1 }, Int3{ 2, 2, 1 }, Int3{ 4, 4, 1 } }, pages)
    .Value();
}
} // namespace

// Sarton 2018, tables 3.1 to 3.3 and figures 3.11 and 3.12.
TEST(PyramidLayout, SartonsExampleWithOneLevelOfVirtualisation)
{
  const PyramidLayout layout = Example({ { 1, 2, 1 }, 0 });
  EXPECT_EQ(layout.Dimensions(0), (Int3{ 8, 4, 1 }));
  EXPECT_EQ(layout.Dimensions(1), (Int3{ 4, 2, 1 }));
  EXPECT_EQ(layout.Dimensions(2), (Int3{ 2, 1, 1 }));
  // The thesis lays the levels side by side along x; here they follow each other in memory.
  std::int64_t x = 0;
  const std::array<std::int64_t, 3> sideBySide{ 0, 4, 6 };
  const std::array<std::int64_t, 3> inMemory{ 0, 8, 10 };
  for (int l = 0; l < 3; ++l)
  {
    EXPECT_EQ(x, sideBySide[static_cast<std::size_t>(l)]);
    EXPECT_EQ(layout.DirectoryBase(l), inMemory[static_cast<std::size_t>(l)]);
    x += layout.Pages(l, layout.PageDepth(l))[0];
  }
  EXPECT_EQ(layout.DirectoryEntries(), 11);
  // Level 0, p = [1/8, 1/4, 0], the brick at [2, 0, 0] of the cache: the voxel lies at [3, 1, 0].
  const Int3 voxel{ 8 / 8, 4 / 4, 0 };
  const Int3 entry = layout.PageOf(voxel, layout.PageDepth(0));
  EXPECT_EQ(entry, (Int3{ 0, 0, 0 }));
  const Int3 slot{ 2, 0, 0 };
  EXPECT_EQ(slot[0] + voxel[0] - entry[0] * layout.BrickSize(), 3);
  EXPECT_EQ(slot[1] + voxel[1] - entry[1] * layout.BrickSize(), 1);
}

TEST(PyramidLayout, SartonsExampleWithTwoLevelsOfVirtualisation)
{
  const PyramidLayout layout = Example({ { 1, 2, 1 }, 1 });
  EXPECT_EQ(layout.Pages(0, 1), (Int3{ 4, 1, 1 }));
  EXPECT_EQ(layout.Pages(1, 1), (Int3{ 2, 1, 1 }));
  EXPECT_EQ(layout.Pages(2, 1), (Int3{ 1, 1, 1 }));
  const auto xy = [&](int level)
  {
    const Int3 dims = layout.VirtualDimensions(level);
    return std::make_pair(dims[0], dims[1]);
  };
  EXPECT_EQ(xy(0), std::make_pair(std::int64_t{ 8 }, std::int64_t{ 4 }));
  EXPECT_EQ(xy(1), std::make_pair(std::int64_t{ 4 }, std::int64_t{ 4 }));
  EXPECT_EQ(xy(2), std::make_pair(std::int64_t{ 2 }, std::int64_t{ 4 }));
  EXPECT_EQ(layout.PageOf({ 7, 3, 0 }, 0), (Int3{ 3, 1, 0 }));
  EXPECT_EQ(layout.PageOf({ 7, 3, 0 }, 1), (Int3{ 3, 0, 0 }));
}

// Sarton 2018, the three data sets of the measurements.
TEST(PyramidLayout, SartonsBrickCounts)
{
  const std::array<Int3, 3> volumes{ Int3{ 2160, 2560, 1072 }, Int3{ 4352, 4352, 4352 },
    Int3{ 64000, 50000, 114 } };
  const std::array<std::int64_t, 3> counts64{ 26728, 359539, 1824922 };
  const std::array<std::int64_t, 3> counts32{ 211688, 2874995, 14328922 };
  for (std::size_t i = 0; i < volumes.size(); ++i)
  {
    EXPECT_EQ(
      PyramidLayout::MakeDefault(volumes[i], Isotropic, 64).Value().TotalBricks(), counts64[i]);
    EXPECT_EQ(
      PyramidLayout::MakeDefault(volumes[i], Isotropic, 32).Value().TotalBricks(), counts32[i]);
  }
}

TEST(PyramidLayout, AnisotropicDataBecomeIsotropicFirst)
{
  const std::vector<Int3> factors =
    PyramidLayout::DefaultFactors({ 4096, 4096, 512 }, { 1, 1, 5 }, 64);
  // Edges 1:1:5, 2:2:5, 4:4:5, then all three.
  EXPECT_EQ(factors[1], (Int3{ 2, 2, 1 }));
  EXPECT_EQ(factors[2], (Int3{ 4, 4, 1 }));
  EXPECT_EQ(factors[3], (Int3{ 8, 8, 2 }));
}

TEST(PyramidLayout, ErrorsNameWhatIsWrong)
{
  const std::int64_t most = (std::int64_t{ 1 } << 31) - 1;
  EXPECT_TRUE(PyramidLayout::MakeDefault({ most, most, most }, Isotropic, 64).Ok());
  const auto fails = [](const Result<PyramidLayout>& result, const char* words)
  {
    EXPECT_FALSE(result.Ok());
    EXPECT_EQ(result.GetStatus().Code(), StatusCode::InvalidArgument);
    EXPECT_NE(result.GetStatus().Message().find(words), std::string::npos)
      << result.GetStatus().Message();
  };
  fails(PyramidLayout::MakeDefault({ most + 1, 1, 1 }, Isotropic, 64), "2147483648 x 1 x 1");
  fails(PyramidLayout::MakeDefault({ 1, 0, 1 }, Isotropic, 64), "1 x 0 x 1");
  fails(PyramidLayout::MakeDefault({ 1, 1, 1 }, Isotropic, 1), "brick size is 1");
  fails(PyramidLayout::Make({ 8, 8, 8 }, 2, {}), "levels");
  fails(PyramidLayout::Make({ 8, 8, 8 }, 2, { Int3{ 2, 1, 1 } }), "factor 1");
  fails(PyramidLayout::Make({ 8, 8, 8 }, 2, { Int3{ 1, 1, 1 }, Int3{ 2, 2, 2 }, Int3{ 3, 4, 4 } }),
    "Level 2");
  fails(PyramidLayout::Make({ 8, 8, 8 }, 2, { Int3{ 1, 1, 1 } }, { { 1, 2, 2 }, -1 }), "1 x 2 x 2");
  fails(PyramidLayout::Make({ 8, 8, 8 }, 2, { Int3{ 1, 1, 1 } }, { { 0, 2, 2 }, 1 }), "0 x 2 x 2");
}

// What everybody relies on, for random volumes up to the largest.
TEST(PyramidLayout, InvariantsOfRandomVolumes)
{
  std::mt19937_64 random(7);
  for (int trial = 0; trial < 300; ++trial)
  {
    Int3 dims{};
    Double3 spacing{};
    for (std::size_t a = 0; a < 3; ++a)
    {
      dims[a] =
        1 + static_cast<std::int64_t>(random() % ((std::uint64_t{ 1 } << (1 + random() % 31)) - 1));
      spacing[a] = 1.0 + static_cast<double>(random() % 50) / 5.0;
    }
    const int brick = 8 << random() % 4;
    const Result<PyramidLayout> made = PyramidLayout::MakeDefault(dims, spacing, brick);
    ASSERT_TRUE(made.Ok()) << made.GetStatus().Message();
    const PyramidLayout& layout = made.Value();
    EXPECT_EQ(layout.Bricks(layout.NumberOfLevels() - 1), (Int3{ 1, 1, 1 }));
    EXPECT_LE(layout.DirectoryEntries(), 4096);
    std::int64_t entries = 0;
    for (int l = 0; l < layout.NumberOfLevels(); ++l)
    {
      EXPECT_EQ(layout.DirectoryBase(l), entries);
      const int depth = layout.PageDepth(l);
      EXPECT_GE(depth, 1);
      EXPECT_LE(depth, layout.PageDepth());
      const Int3 pages = layout.Pages(l, depth);
      EXPECT_LE(pages[0] * pages[1] * pages[2], 128);
      entries += pages[0] * pages[1] * pages[2];
      for (std::size_t a = 0; a < 3; ++a)
      {
        const std::int64_t n = layout.Dimensions(l)[a];
        EXPECT_EQ(n, CeilDiv(dims[a], layout.Factor(l)[a]));
        EXPECT_LT((n - 1) * layout.Factor(l)[a], dims[a]); // no voxel without data
        EXPECT_LE(n, layout.VirtualDimensions(l)[a]);
        Int3 last{ 0, 0, 0 };
        last[a] = n - 1;
        EXPECT_EQ(layout.PageOf(last, 0)[a], layout.Bricks(l)[a] - 1);
        EXPECT_EQ(layout.PageOf(last, depth)[a], pages[a] - 1);
        EXPECT_EQ(layout.PageOf(last, 1)[a], layout.PageOf(last, 0)[a] / PageBlockEdge);
      }
    }
    EXPECT_EQ(layout.DirectoryEntries(), entries);
  }
}

// Contract 4: a level of a huge volume is addressed like the same level of a small one.
TEST(PyramidLayout, DepthFollowsFromTheLevelAlone)
{
  const PyramidLayout small = PyramidLayout::MakeDefault({ 512, 512, 512 }, Isotropic, 32).Value();
  const std::int64_t edge = std::int64_t{ 1 } << 30;
  const PyramidLayout large =
    PyramidLayout::MakeDefault({ edge, edge, edge }, Isotropic, 32).Value();
  const int coarser = large.NumberOfLevels() - small.NumberOfLevels();
  for (int l = 0; l < small.NumberOfLevels(); ++l)
  {
    EXPECT_EQ(small.Bricks(l), large.Bricks(l + coarser));
    EXPECT_EQ(small.PageDepth(l), 1);
    EXPECT_EQ(large.PageDepth(l + coarser), 1);
  }
  EXPECT_GE(large.PageDepth(0), 4);
  EXPECT_EQ(large.PageDepth(), large.PageDepth(0));
}

} // namespace teravox
