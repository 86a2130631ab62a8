// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// What must not change a bit of the picture: instruction set, threads, atlas, length of a pass,
// skipping of what is empty.
#include "Effort.h"
#include "NativeVolumes.h"

#include <gtest/gtest.h>
#include <utility>

namespace teravox
{

namespace
{
using namespace test;

enum class Way
{
  Linear,
  Shaded,
  Nearest,
  NearestShaded,
  Fixed,
  FixedShaded,
  Gradient, // opacity by gradient
  GradientShaded,
  GradientNearest,
  Plane, // opacity and colour over value and gradient
  PlaneShaded,
  PlaneNearest,
  PlaneFixed
};
constexpr std::array<Way, 13> AllWays = { Way::Linear, Way::Shaded, Way::Nearest,
  Way::NearestShaded, Way::Fixed, Way::FixedShaded, Way::Gradient, Way::GradientShaded,
  Way::GradientNearest, Way::Plane, Way::PlaneShaded, Way::PlaneNearest, Way::PlaneFixed };

// One per path through the kernel: bytes, words, floats with holes, a slot table.
constexpr std::array<ScalarType, 4> Types = { ScalarType::UInt8, ScalarType::UInt16,
  ScalarType::Float32, ScalarType::Float64 };

PictureScene MakeScene(ScalarType type, Way way)
{
  const Int3 dimensions{ 45, 38, 41 };
  const Volume volume =
    MakeVolume(type, dimensions, 9, Landscape(dimensions, 3, type == ScalarType::Float32));
  PictureScene scene;
  scene.Source = volume.Source;
  scene.Function =
    volume.Function({ 0.0, 0.3, 0.42, 0.5, 0.65, 0.7, 1.0 }, { 0, 0, 0.15, 0, 0, 0.04, 0.3 });
  if (way == Way::Gradient || way == Way::GradientShaded || way == Way::GradientNearest)
  {
    const double range = volume.High - volume.Low;
    scene.Function = WithGradientOpacity(std::move(scene.Function), 0.01 * range, 0.12 * range);
  }
  if (way >= Way::Plane)
  {
    scene.Function = volume.Plane(23, 17, Islands);
  }
  scene.Camera = Outside(scene.Source->Info(), Effort(44, 34), Effort(36, 33));
  scene.Shade = way == Way::Shaded || way == Way::NearestShaded || way == Way::FixedShaded ||
    way == Way::GradientShaded || way == Way::PlaneShaded;
  scene.Nearest = way == Way::Nearest || way == Way::NearestShaded || way == Way::GradientNearest ||
    way == Way::PlaneNearest;
  const bool fixed = way == Way::Fixed || way == Way::FixedShaded || way == Way::PlaneFixed;
  scene.Tolerance = fixed ? 0 : 1.0 / 255;
  return scene;
}

std::string Name(ScalarType type, Way way)
{
  constexpr std::array<const char*, 13> names{ "linear", "shaded", "nearest", "nearest, shaded",
    "fixed step", "fixed step, shaded", "gradient opacity", "gradient opacity, shaded",
    "gradient opacity, nearest", "plane", "plane, shaded", "plane, nearest", "plane, fixed step" };
  return std::string(ToString(type)) + ", " + names[static_cast<std::size_t>(way)];
}

// Equality of nothing with nothing says little.
void ExpectSomething(const Picture& picture, const std::string& what)
{
  ExpectSound(picture, what);
  EXPECT_GT(picture.Strongest(), 0.2f) << what;
  EXPECT_GT(picture.Uploads, 20u) << what;
}

template <typename F>
void ForEachScene(const F& f)
{
  for (const ScalarType type : Types)
  {
    for (const Way way : AllWays)
    {
      const PictureScene scene = MakeScene(type, way);
      const Picture whole = Draw(scene);
      ExpectSomething(whole, Name(type, way));
      f(scene, whole, Name(type, way));
    }
  }
}
} // namespace

TEST(NativeSameBits, EachInstructionSet)
{
  if (!HasSeveralInstructionSets())
  {
    GTEST_SKIP() << "This processor, or this compiler, has no AVX2: there is nothing to compare.";
  }
  ForEachScene(
    [](const PictureScene& scene, const Picture& whole, const std::string& name)
    {
      PictureMeans means;
      means.Baseline = true;
      const Picture baseline = Draw(scene, means);
      ExpectSameBits(whole, baseline, name);
      EXPECT_EQ(whole.Samples, baseline.Samples) << name;
      EXPECT_EQ(whole.Passes, baseline.Passes) << name;
    });
}

TEST(NativeSameBits, AnyNumberOfOpenMPThreads)
{
#ifdef __SANITIZE_THREAD__
  GTEST_SKIP() << "OpenMP's runtime isn't instrumented: each of its barriers would be a race. "
                  "NativeSameBits.ThreadsOfTheStandardLibrary runs instead.";
#else
  for (const Way way : { Way::Linear, Way::Shaded, Way::Gradient })
  {
    const PictureScene scene = MakeScene(ScalarType::UInt16, way);
    PictureMeans means;
    means.Slots = 12;
    means.Threads = 1;
    const Picture one = Draw(scene, means);
    ExpectSomething(one, "one thread");
    for (const int threads : { 2, 5 })
    {
      means.Threads = threads;
      const Picture several = Draw(scene, means);
      const std::string name = std::to_string(threads) + " threads";
      ExpectSameBits(one, several, name);
      // Requests are sorted: what is loaded, and when, is the same, too.
      EXPECT_EQ(one.Passes, several.Passes) << name;
      EXPECT_EQ(one.Uploads, several.Uploads) << name;
      EXPECT_EQ(one.Evictions, several.Evictions) << name;
    }
  }
#endif
}

// The bits of the cells of a slot are made by whoever comes first, by several threads at once where
// they meet; so are the stamps.
TEST(NativeSameBits, ThreadsOfTheStandardLibrary)
{
  for (const Way way : { Way::Linear, Way::Shaded, Way::Nearest, Way::Gradient })
  {
    PictureScene scene = MakeScene(ScalarType::UInt8, way);
    scene.Camera = Outside(scene.Source->Info(), 100, 90); // twelve tiles
    PictureMaker maker(scene, {});
    const Picture one = maker.Draw();
    ExpectSomething(one, "one thread");
    for (int round = 0; round < 4; ++round)
    {
      const Picture four = maker.DrawWithThreads(4);
      ExpectSound(four, "four threads");
      ExpectSameBits(one, four, "four threads");
    }
  }
}

TEST(NativeSameBits, FourSlots)
{
  ForEachScene(
    [](const PictureScene& scene, const Picture& whole, const std::string& name)
    {
      EXPECT_EQ(whole.Evictions, 0u) << name;
      PictureMeans means;
      means.Slots = 4;
      means.PageBlocks = 1;
      const Picture four = Draw(scene, means);
      ExpectSound(four, name);
      EXPECT_GT(four.Evictions, 20u) << name;
      EXPECT_GT(four.Passes, whole.Passes) << name;
      ExpectSameBits(whole, four, name);
    });
}

TEST(NativeSameBits, ShortPasses)
{
  ForEachScene(
    [](const PictureScene& scene, const Picture& whole, const std::string& name)
    {
      PictureMeans means;
      means.StepsPerPass = 40;
      const Picture pieces = Draw(scene, means);
      ExpectSound(pieces, name);
      EXPECT_GT(pieces.Passes, 10u) << name;
      ExpectSameBits(whole, pieces, name);
    });
}

TEST(NativeSameBits, SkippingOffAndOn)
{
  ForEachScene(
    [](const PictureScene& scene, const Picture& whole, const std::string& name)
    {
      PictureMeans means;
      means.Skip = false;
      const Picture everything = Draw(scene, means);
      ExpectSound(everything, name);
      EXPECT_GT(everything.Samples, whole.Samples) << name;
      ExpectSameBits(whole, everything, name);
    });
}

// All of it at once, and what the picture before has left in the atlas.
TEST(NativeSameBits, WhateverIsInTheAtlas)
{
  ForEachScene(
    [](const PictureScene& scene, const Picture& whole, const std::string& name)
    {
      PictureMeans means;
      means.Slots = 7;
      means.StepsPerPass = 200;
      PictureMaker maker(scene, means);
      ExpectSameBits(whole, maker.Draw(), name);
      ExpectSameBits(whole, maker.Draw(), name + ", again");
    });
}

} // namespace teravox
