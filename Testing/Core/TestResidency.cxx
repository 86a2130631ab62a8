// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "Effort.h"
#include "SimulatedRenderer.h"

#include <array>
#include <cmath>
#include <gtest/gtest.h>
#include <iostream>
#include <iterator>
#include <optional>

namespace teravox
{

namespace
{
using test::BricksAlong;
using test::SimulatedCamera;
using test::SimulatedRenderer;
using test::SimulatedVolume;
using test::SimulationResult;
using test::SimulationSettings;

constexpr std::uint32_t Unlimited = 20000;

double Uniform(std::mt19937_64& random, double low, double high)
{
  return low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53;
}

SimulatedVolume Volume(const Int3& dimensions, const Double3& spacing = { 1, 1, 1 })
{
  SimulatedVolume volume;
  volume.Layout = PyramidLayout::MakeDefault(dimensions, spacing, 16).Value();
  return volume;
}

// Rays through a window around a random line through the volume; from outside, from inside, or
// parallel.
SimulatedCamera Camera(const PyramidLayout& layout, std::uint64_t seed, int raysPerAxis = 12)
{
  std::mt19937_64 random(seed);
  Double3 size{};
  Double3 eye{};
  Double3 target{};
  const bool inside = seed % 3 == 1;
  for (std::size_t a = 0; a < 3; ++a)
  {
    size[a] = static_cast<double>(layout.Dimensions(0)[a]);
    eye[a] = inside ? Uniform(random, 0.1, 0.9) * size[a] : Uniform(random, -1, 2) * size[a];
    target[a] = Uniform(random, 0.2, 0.8) * size[a];
  }
  eye[0] = inside ? eye[0] : -0.7 * size[0];
  SimulatedCamera camera;
  camera.Order.Parallel = seed % 3 == 2;
  camera.Order.Eye = eye;
  for (std::size_t a = 0; a < 3; ++a)
  {
    camera.Order.Direction[a] = target[a] - eye[a];
  }
  // Depth in units of the distance between eye and target; a few levels within it.
  camera.FirstLevelDepth = Uniform(random, 0.2, 1.2);
  const Double3& forward = camera.Order.Direction;
  for (int i = 0; i < raysPerAxis * raysPerAxis; ++i)
  {
    Double3 origin = eye;
    Double3 direction = forward;
    for (std::size_t a = 0; a < 3; ++a)
    {
      const double shift = Uniform(random, -0.4, 0.4) * size[a];
      (camera.Order.Parallel ? origin : direction)[a] += shift;
      direction[a] = direction[a] == 0 ? 1e-9 : direction[a];
    }
    camera.Origins.push_back(origin);
    camera.Directions.push_back(direction);
  }
  return camera;
}

SimulationResult Simulate(
  const SimulatedVolume& volume, const SimulatedCamera& camera, const SimulationSettings& settings)
{
  return SimulatedRenderer(volume, camera, settings).Run();
}

// What each ray must have seen: its bricks without the empty ones.
std::vector<std::vector<BrickKey>> Expected(
  const SimulatedVolume& volume, const SimulatedCamera& camera)
{
  std::vector<std::vector<BrickKey>> all;
  for (std::size_t r = 0; r < camera.Origins.size(); ++r)
  {
    std::vector<BrickKey> seen;
    for (const BrickKey& key :
      BricksAlong(volume.Layout, camera, camera.Origins[r], camera.Directions[r]))
    {
      if (volume.BrickRange(key).Max >= SimulatedVolume::VisibleFrom)
      {
        seen.push_back(key);
      }
    }
    all.push_back(std::move(seen));
  }
  return all;
}

std::uint64_t BricksToLoad(const SimulatedVolume& volume, const SimulationResult& result)
{
  const std::set<BrickKey> set = result.WorkingSet();
  return static_cast<std::uint64_t>(std::count_if(set.begin(), set.end(),
    [&](const BrickKey& key) { return !volume.BrickRange(key).IsSingle(); }));
}
} // namespace

// Contract 2: an atlas of any size gives the same picture.
TEST(Residency, EveryRayReachesItsEndWithAnyAtlas)
{
  for (std::uint64_t seed = 1; seed <= 9; ++seed)
  {
    SimulatedVolume volume =
      seed % 2 == 0 ? Volume({ 200, 150, 180 }) : Volume({ 130, 260, 40 }, { 1, 1, 3 });
    volume.EmptyShare = 4;
    volume.SingleShare = 2;
    const SimulatedCamera camera = Camera(volume.Layout, seed);
    const auto expected = Expected(volume, camera);
    SimulationSettings settings;
    settings.Seed = seed;
    settings.ViewError = seed;
    settings.Slots = Unlimited;
    settings.PageBlocks = 64;
    const SimulationResult whole = Simulate(volume, camera, settings);
    ASSERT_EQ(whole.Error, "") << "seed " << seed;
    ASSERT_EQ(whole.Visited, expected);
    EXPECT_EQ(whole.Evictions, 0u);
    const std::uint64_t workingSet = BricksToLoad(volume, whole);
    EXPECT_EQ(whole.BrickReads(), workingSet) << "each once";
    const auto quarter = static_cast<std::uint32_t>(std::max<std::uint64_t>(2, workingSet / 4));
    for (const std::uint32_t slots : { 2u, 3u, 16u, quarter })
    {
      for (const std::uint32_t blocks : { 0u, 64u })
      {
        settings.Slots = slots;
        settings.PageBlocks = blocks;
        const SimulationResult result = Simulate(volume, camera, settings);
        ASSERT_EQ(result.Error, "")
          << "seed " << seed << ", " << slots << " slots, " << blocks << " page blocks";
        ASSERT_EQ(result.Visited, expected);
        EXPECT_TRUE(slots >= workingSet || result.Evictions > 0);
      }
    }
  }
}

TEST(Residency, SixteenSlotsLoadEachBrickAboutOnce)
{
  double worst = 0;
  for (std::uint64_t seed = 1; seed <= 12; ++seed)
  {
    const SimulatedVolume volume = Volume({ 220, 200, 210 });
    const SimulatedCamera camera = Camera(volume.Layout, seed, 16);
    SimulationSettings settings;
    settings.Seed = seed;
    settings.ViewError = seed;
    settings.Slots = 16;
    settings.PageBlocks = 64;
    const SimulationResult result = Simulate(volume, camera, settings);
    ASSERT_EQ(result.Error, "") << "seed " << seed;
    const double ratio = static_cast<double>(result.BrickReads()) /
      static_cast<double>(std::max<std::uint64_t>(1, BricksToLoad(volume, result)));
    EXPECT_LE(ratio, 1.5) << "seed " << seed << ", working set " << BricksToLoad(volume, result);
    worst = std::max(worst, ratio);
  }
  std::cout << "bricks read per brick of the working set, worst of all views: " << worst << "\n";
}

// Contract 1: arrival orders and delays change what is done when, never what a ray sees.
TEST(Residency, ArrivalOrdersChangeNoRay)
{
  SimulatedVolume volume = Volume({ 200, 150, 180 });
  volume.EmptyShare = 3;
  for (std::uint64_t view = 1; view <= 3; ++view)
  {
    const SimulatedCamera camera = Camera(volume.Layout, view);
    const auto expected = Expected(volume, camera);
    for (std::uint64_t seed = 1; seed <= 6; ++seed)
    {
      SimulationSettings settings;
      settings.Seed = seed;
      settings.ViewError = seed;
      settings.Slots = 16;
      settings.PageBlocks = seed % 2 == 0 ? 64 : 0;
      settings.LoaderThreads = static_cast<int>(1 + seed);
      settings.FinishChance = seed % 3 == 0 ? 1.0 : 0.15;
      settings.StepsPerPass = seed % 2 == 0 ? 3 : 64;
      settings.MostRequests = seed % 3 == 1 ? 5 : 4096;
      settings.LimitUploads = seed % 4 == 1 ? 1 : 1000;
      const SimulationResult result = Simulate(volume, camera, settings);
      ASSERT_EQ(result.Error, "") << "view " << view << ", seed " << seed;
      ASSERT_EQ(result.Visited, expected);
    }
  }
}

TEST(Residency, EqualInputsGiveEqualPlans)
{
  SimulatedVolume volume = Volume({ 200, 150, 180 });
  volume.EmptyShare = 3;
  volume.SingleShare = 1;
  for (const std::uint32_t slots : { 2u, 16u, 200u })
  {
    SimulationSettings settings;
    settings.Slots = slots;
    const SimulatedCamera camera = Camera(volume.Layout, 5);
    const SimulationResult first = Simulate(volume, camera, settings);
    const SimulationResult second = Simulate(volume, camera, settings);
    ASSERT_EQ(first.Error, "");
    EXPECT_EQ(first.Plans, second.Plans);
    EXPECT_GT(first.Plans.size(), 10u);
  }
}

// Contract 5: what has arrived and has no place yet is bounded, page blocks included.
TEST(Residency, TheSmallestHostBudgetDoesNotBlock)
{
  SimulatedVolume flat = Volume({ 200, 150, 180 });
  SimulatedVolume deep;
  deep.Layout = PyramidLayout::MakeDefault({ 260, 260, 240 }, { 1, 1, 1 }, 2).Value();
  ASSERT_GE(deep.Layout.PageDepth(), 2);
  std::size_t mostHeld = 0;
  for (const bool isDeep : { false, true })
  {
    const SimulatedVolume& volume = isDeep ? deep : flat;
    for (std::uint64_t seed = 1; seed <= (isDeep ? 1u : test::Effort(6u, 3u)); ++seed)
    {
      const SimulatedCamera camera = Camera(volume.Layout, seed, isDeep ? 2 : 12);
      for (const std::size_t most : { std::size_t{ 1 }, std::size_t{ 2 }, std::size_t{ 5 } })
      {
        for (const std::uint32_t slots : { 2u, 16u, Unlimited })
        {
          SimulationSettings settings;
          settings.Seed = seed;
          settings.ViewError = seed;
          settings.Slots = slots;
          settings.LoaderThreads = 4;
          settings.MostOnHost = most;
          const SimulationResult result = Simulate(volume, camera, settings);
          ASSERT_EQ(result.Error, "")
            << "seed " << seed << ", " << most << " on the host, " << slots << " slots";
          ASSERT_EQ(result.Visited, Expected(volume, camera));
          mostHeld = std::max(mostHeld, result.MostHeld);
        }
      }
    }
  }
  EXPECT_GT(mostHeld, 0u) << "nothing ever had to wait for a place";
}

// Contract 6: a failed brick is reported once and replaced by its finest readable ancestor.
TEST(Residency, FailuresAreReportedOnceAndFallBack)
{
  SimulatedVolume volume = Volume({ 200, 150, 180 });
  const SimulatedCamera camera = Camera(volume.Layout, 3, 10);
  const auto healthy = Expected(volume, camera);
  std::set<BrickKey> all;
  for (const auto& ray : healthy)
  {
    all.insert(ray.begin(), ray.end());
  }
  for (const BrickKey& key : all)
  {
    if (BrickKeyHash()(key) % 5 == 0)
    {
      volume.Failing.insert(key);
    }
  }
  ASSERT_GT(volume.Failing.size(), 3u);
  for (const std::uint32_t slots : { 2u, 16u, Unlimited })
  {
    // A failed brick and its ancestors are looked up in one pass: a chain for each level.
    const auto chains =
      static_cast<std::uint32_t>(volume.Layout.NumberOfLevels() * volume.Layout.PageDepth());
    for (const std::uint32_t blocks : { chains, 64u })
    {
      SimulationSettings settings;
      settings.Slots = slots;
      settings.PageBlocks = blocks;
      const SimulationResult result = Simulate(volume, camera, settings);
      ASSERT_EQ(result.Error, "") << slots << " slots, " << blocks << " page blocks";
      std::set<BrickKey> reported;
      for (const LoadResult& failure : result.Failures)
      {
        EXPECT_TRUE(reported.insert(failure.Key).second) << failure.Key.ToString() << " twice";
        EXPECT_FALSE(failure.Outcome.Ok());
        EXPECT_EQ(result.Reads.at(failure.Key), 1);
      }
      for (const BrickKey& key : volume.Failing)
      {
        EXPECT_EQ(reported.count(key), 1u) << key.ToString();
      }
      for (std::size_t r = 0; r < healthy.size(); ++r)
      {
        ASSERT_EQ(result.Visited[r].size(), healthy[r].size());
        for (std::size_t i = 0; i < healthy[r].size(); ++i)
        {
          const bool failed = volume.Failing.count(healthy[r][i]) != 0;
          ASSERT_EQ(result.Visited[r][i] != healthy[r][i], failed);
          ASSERT_TRUE(!failed || result.Visited[r][i].Level > healthy[r][i].Level);
          ASSERT_EQ(volume.Failing.count(result.Visited[r][i]), 0u);
        }
      }
    }
  }
}

TEST(Residency, BlocksThatCannotBeReadHideNoBrick)
{
  SimulatedVolume volume = Volume({ 200, 150, 180 });
  volume.EmptyShare = 4;
  const SimulatedCamera camera = Camera(volume.Layout, 3, 8);
  BrickKey block;
  block.PageLevel = 1;
  volume.FailingBlocks.insert(block);
  block.Level = 1;
  volume.FailingBlocks.insert(block);
  for (const std::uint32_t slots : { 2u, Unlimited })
  {
    SimulationSettings settings;
    settings.Slots = slots;
    settings.PageBlocks = 16;
    const SimulationResult result = Simulate(volume, camera, settings);
    ASSERT_EQ(result.Error, "");
    ASSERT_EQ(result.Failures.size(), volume.FailingBlocks.size());
    // Without ranges bricks of empty regions are drawn, which adds 0; nothing else is missing.
    const auto expected = Expected(volume, camera);
    for (std::size_t r = 0; r < expected.size(); ++r)
    {
      std::vector<BrickKey> seen;
      std::copy_if(result.Visited[r].begin(), result.Visited[r].end(), std::back_inserter(seen),
        [&](const BrickKey& key)
        { return volume.BrickRange(key).Max >= SimulatedVolume::VisibleFrom; });
      ASSERT_EQ(seen, expected[r]);
    }
  }
}

TEST(Residency, EmptyAndSingleVolumesLoadNoBrick)
{
  for (const bool empty : { false, true })
  {
    SimulatedVolume volume = Volume({ 200, 150, 180 });
    (empty ? volume.EmptyShare : volume.SingleShare) = 16;
    const SimulationResult result = Simulate(volume, Camera(volume.Layout, 3), {});
    ASSERT_EQ(result.Error, "");
    EXPECT_EQ(result.BrickReads(), 0u);
    EXPECT_EQ(result.WorkingSet().empty(), empty);
    EXPECT_TRUE(!empty || result.Reads.empty()) << "the directory knows";
  }
}

TEST(Residency, PinnedBricksComeFirstAndStay)
{
  const SimulatedVolume volume = Volume({ 200, 150, 180 });
  const SimulatedCamera camera = Camera(volume.Layout, 1);
  BrickKey coarsest;
  coarsest.Level = static_cast<std::uint8_t>(volume.Layout.NumberOfLevels() - 1);
  for (const std::uint32_t slots : { 2u, 16u })
  {
    SimulationSettings settings;
    settings.Slots = slots;
    SimulatedRenderer renderer(volume, camera, settings);
    renderer.GetResidency().SetPinned({ coarsest });
    const SimulationResult result = renderer.Run();
    ASSERT_EQ(result.Error, "");
    EXPECT_EQ(result.Visited, Expected(volume, camera));
    EXPECT_GT(result.Evictions, 0u);
    EXPECT_TRUE(renderer.GetResidency().IsResident(coarsest));
    EXPECT_EQ(result.Reads.at(coarsest), 1);
    // Free to go again.
    renderer.GetResidency().SetPinned({});
    EXPECT_EQ(renderer.GetResidency().CheckInvariants(), "");
  }
}

TEST(Residency, ManyPageBlocksThroughTheSmallestPool)
{
  // Bricks of 2 voxels: dozens of page blocks are on the way of each ray, and one chain fits.
  SimulatedVolume volume;
  volume.Layout = PyramidLayout::MakeDefault({ 100, 90, 110 }, { 1, 1, 1 }, 2).Value();
  volume.EmptyShare = 2;
  for (std::uint64_t seed = 1; seed <= 3; ++seed)
  {
    const SimulatedCamera camera = Camera(volume.Layout, seed, 4);
    for (const std::uint32_t slots : { 2u, 16u, Unlimited })
    {
      SimulationSettings settings;
      settings.Slots = slots;
      settings.Seed = seed;
      settings.ViewError = seed;
      settings.FinishChance = 0.9;
      const SimulationResult result = Simulate(volume, camera, settings);
      ASSERT_EQ(result.Error, "") << "seed " << seed << ", " << slots << " slots";
      ASSERT_EQ(result.Visited, Expected(volume, camera));
      EXPECT_GT(result.BlockEvictions, 0u);
    }
  }
}

// Contract 4: the same flight in a cube of 512 voxels and in one of 2^30 per axis. Near: through
// 512 voxels of level 0 anywhere in it. Far: towards the whole of it.
TEST(Residency, OperationsPerFrameDoNotGrowWithTheVolume)
{
  struct Operations
  {
    double First = 0; ///< picture, from nothing
    double FirstBytes = 0;
    double FirstPasses = 0;
    double Flight = 0;
    std::uint64_t Uploads = 0;
  };
  const auto measure = [](std::int64_t edge, bool near)
  {
    SimulatedVolume volume;
    volume.Layout = PyramidLayout::MakeDefault({ edge, edge, edge }, { 1, 1, 1 }, 16).Value();
    volume.KnowsRegions = false;
    SimulationSettings settings;
    settings.Slots = 512;
    settings.PageBlocks = 256;
    settings.FinishChance = 1;
    settings.LoaderThreads = 8;
    std::optional<SimulatedRenderer> renderer;
    Operations operations;
    const double scale = near ? 1.0 : static_cast<double>(edge) / 512;
    const double offset = near && edge > 512 ? 8192.0 * 54321 : 0.0;
    for (int frame = 0; frame < (near ? 16 : 4); ++frame)
    {
      std::mt19937_64 random(9);
      SimulatedCamera camera;
      camera.Order.Eye = { offset + scale * 259.3, offset + scale * 257.2,
        offset + scale * ((near ? 5.3 : -600.3) + 8 * frame) };
      for (int i = 0; i < (near ? 200 : 50); ++i)
      {
        camera.Origins.push_back(camera.Order.Eye);
        camera.Directions.push_back(
          { Uniform(random, -0.4, 0.4), Uniform(random, -0.4, 0.4), 1.0 });
      }
      camera.FirstLevelDepth = near ? 100 : 800;
      camera.End = near ? 350 : camera.End;
      if (renderer)
      {
        renderer->SetCamera(camera);
      }
      else
      {
        renderer.emplace(volume, camera, settings);
      }
      const SimulationResult result = renderer->Run();
      EXPECT_EQ(result.Error, "") << "frame " << frame;
      (frame == 0 ? operations.First : operations.Flight) +=
        static_cast<double>(result.EntriesUploaded + result.Requests + result.Uploads);
      operations.Uploads += result.Uploads;
      if (frame == 0)
      {
        const int stored = volume.Layout.StoredSize();
        operations.FirstBytes = static_cast<double>(result.EntriesUploaded * sizeof(PageEntry)) +
          static_cast<double>(result.Uploads) * stored * stored * stored;
        operations.FirstPasses = static_cast<double>(result.Passes);
      }
    }
    return operations;
  };
  for (const bool near : { true, false })
  {
    const Operations small = measure(512, near);
    const Operations large = measure(1 << 30, near);
    std::cout << (near ? "near" : "far")
              << ": entries, requests and uploads, 2^9 and 2^30: first picture " << small.First
              << ", " << large.First << "; flight " << small.Flight << ", " << large.Flight
              << "; bytes of the first picture " << small.FirstBytes << ", " << large.FirstBytes
              << "; passes " << small.FirstPasses << ", " << large.FirstPasses << "\n";
    EXPECT_EQ(small.Uploads, large.Uploads);
    EXPECT_LE(large.First, 1.2 * small.First);
    EXPECT_LE(large.Flight, 1.2 * small.Flight);
    EXPECT_LE(large.FirstBytes, 1.2 * small.FirstBytes);
    EXPECT_LE(large.FirstPasses, 1.2 * small.FirstPasses);
  }
}

// What lies outside of the boxes of bricks in view is found all the same, through eight page levels
// and in the smallest pool.
TEST(Residency, RegionsThatAreTakenForOutOfViewAreFound)
{
  SimulatedVolume volume;
  const std::int64_t edge = std::int64_t{ 1 } << 30;
  volume.Layout = PyramidLayout::MakeDefault({ edge, edge, edge }, { 1, 1, 1 }, 16).Value();
  volume.KnowsRegions = false;
  volume.EmptyShare = 5;
  ASSERT_GE(volume.Layout.PageDepth(), 8);
  SimulatedCamera camera;
  std::mt19937_64 random(11);
  // Around a corner of page blocks of all levels.
  camera.Order.Eye = { 536870890.3, 536870930.2, 536870805.7 };
  for (int i = 0; i < 20; ++i)
  {
    camera.Origins.push_back(camera.Order.Eye);
    camera.Directions.push_back({ Uniform(random, -0.4, 0.4), Uniform(random, -0.4, 0.4), 1.0 });
  }
  camera.FirstLevelDepth = 100;
  camera.End = 350;
  std::array<std::uint64_t, 3> entries{};
  for (const std::uint32_t blocks : { 0u, 64u })
  {
    for (std::uint64_t error = 0; error < 3; ++error)
    {
      SimulationSettings settings;
      settings.Slots = 64;
      settings.PageBlocks = blocks;
      settings.ViewError = error;
      const SimulationResult result = Simulate(volume, camera, settings);
      ASSERT_EQ(result.Error, "") << blocks << " page blocks, error " << error;
      ASSERT_EQ(result.Visited, Expected(volume, camera));
      entries[error] = result.EntriesUploaded;
    }
  }
  EXPECT_LT(entries[0], entries[1]) << "entries out of view are written";
}

// Each ray meets its bricks by increasing rank, on which order and eviction rest.
TEST(Residency, RanksGrowAlongRays)
{
  for (std::uint64_t seed = 1; seed <= 12; ++seed)
  {
    const SimulatedVolume volume =
      seed % 2 == 0 ? Volume({ 200, 150, 180 }) : Volume({ 130, 260, 40 }, { 1, 1, 3 });
    const SimulatedCamera camera = Camera(volume.Layout, seed);
    const auto rank = [&](const BrickKey& key)
    {
      const std::array<std::int64_t, 3> index{ key.X, key.Y, key.Z };
      std::int64_t distance = 0;
      for (std::size_t a = 0; a < 3; ++a)
      {
        const auto edge = static_cast<double>(16 * volume.Layout.Factor(key.Level)[a]);
        const auto eye = static_cast<std::int64_t>(std::floor(camera.Order.Eye[a] / edge));
        distance += camera.Order.Parallel ? (camera.Order.Direction[a] < 0 ? -index[a] : index[a])
                                          : std::abs(index[a] - eye);
      }
      return std::make_pair(key.Level, distance);
    };
    for (std::size_t r = 0; r < camera.Origins.size(); ++r)
    {
      const auto bricks =
        BricksAlong(volume.Layout, camera, camera.Origins[r], camera.Directions[r]);
      for (std::size_t i = 1; i < bricks.size(); ++i)
      {
        ASSERT_LT(rank(bricks[i - 1]), rank(bricks[i])) << "seed " << seed;
      }
    }
  }
}

} // namespace teravox
