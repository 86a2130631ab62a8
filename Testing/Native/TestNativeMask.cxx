// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Volumes of which a mask leaves a part away.
#include "Effort.h"
#include "MaskedBrickSource.h"
#include "NativeVolumes.h"

#include <cmath>
#include <gtest/gtest.h>

namespace teravox
{

namespace
{
using namespace test;

using MaskField = std::function<bool(const Int3&)>;

std::shared_ptr<BrickSource> MakeMask(const VolumeInfo& info, const MaskField& isIn)
{
  const Int3 n = info.Layout.Dimensions(0);
  const auto voxels = std::make_shared<std::vector<std::uint8_t>>();
  Int3 at{};
  for (at[2] = 0; at[2] < n[2]; ++at[2])
  {
    for (at[1] = 0; at[1] < n[1]; ++at[1])
    {
      for (at[0] = 0; at[0] < n[0]; ++at[0])
      {
        voxels->push_back(isIn(at) ? 255 : 0);
      }
    }
  }
  ArrayDescription array;
  array.Data = voxels->data();
  array.Owner = voxels;
  array.Dimensions = n;
  array.Layout = info.Layout;
  array.Mask = true;
  return ArrayBrickSource::Make(array).Value();
}

std::shared_ptr<BrickSource> Masked(
  const std::shared_ptr<BrickSource>& source, const MaskField& isIn)
{
  return MaskedBrickSource::Make(source, MakeMask(source->Info(), isIn)).Value();
}

// A ball with holes, so that some cells are in, some out and many in part.
bool IsInSponge(const Int3& at, const Int3& n)
{
  double square = 0;
  for (std::size_t a = 0; a < 3; ++a)
  {
    const double p = (static_cast<double>(at[a]) + 0.5) / static_cast<double>(n[a]) - 0.5;
    square += p * p;
  }
  const std::int64_t hash = (at[0] * 31 + at[1] * 57 + at[2] * 91) % 23;
  return square < 0.2 && (square < 0.06 || hash > 2);
}

enum class Way
{
  Linear,
  Shaded,
  Nearest,
  NearestShaded
};

PictureScene MakeScene(ScalarType type, Way way)
{
  const Int3 dimensions{ 45, 38, 41 };
  const Volume volume =
    MakeVolume(type, dimensions, 9, Landscape(dimensions, 3, type == ScalarType::Float32));
  PictureScene scene;
  scene.Source = volume.Source;
  scene.Function =
    volume.Function({ 0.0, 0.3, 0.42, 0.5, 0.65, 0.7, 1.0 }, { 0, 0, 0.15, 0, 0, 0.04, 0.3 });
  scene.Camera = Outside(scene.Source->Info(), Effort(44, 34), Effort(36, 33));
  scene.Shade = way == Way::Shaded || way == Way::NearestShaded;
  scene.Nearest = way == Way::Nearest || way == Way::NearestShaded;
  return scene;
}

template <typename F>
void ForEachScene(const F& f)
{
  // Bytes, words, floats with holes, a slot table.
  for (const ScalarType type :
    { ScalarType::UInt8, ScalarType::UInt16, ScalarType::Float32, ScalarType::Float64 })
  {
    for (const Way way : { Way::Linear, Way::Shaded, Way::Nearest, Way::NearestShaded })
    {
      f(MakeScene(type, way),
        std::string(ToString(type)) + ", way " + std::to_string(static_cast<int>(way)));
    }
  }
}

/// A volume of one value, seen along z by parallel rays at quarters of voxels.
PictureScene ConstantScene(const Int3& dimensions, double opacity)
{
  PictureScene scene;
  scene.Source =
    MakeVolume(ScalarType::UInt8, dimensions, 9, [](const Int3&) { return 0.5; }).Source;
  scene.Function = MakeFunction({ 0, 255 }, { opacity, opacity });
  const double w = static_cast<double>(dimensions[0]);
  const double h = static_cast<double>(dimensions[1]);
  scene.Camera = MakeCamera(scene.Source->Info(), static_cast<int>(2 * dimensions[0]),
    static_cast<int>(2 * dimensions[1]),
    LookAt({ w / 2, h / 2, -10 }, { w / 2, h / 2, 0 }, { 0, 1, 0 }), Parallel(h, w / h, 1, 1000));
  return scene;
}
} // namespace

// Each ray crosses whole voxels of its column, and half of the first and the last one: exact.
TEST(NativeMask, ConstantMediumBehindARandomMask)
{
  const Int3 n{ 23, 19, 33 };
  const MaskField isIn = [](const Int3& at)
  { return (at[0] * 7919 + at[1] * 104729 + at[2] * 1299709) % 13 < 6; };
  for (const bool nearest : { false, true })
  {
    PictureScene scene = ConstantScene(n, 0.05);
    scene.Source = Masked(scene.Source, isIn);
    scene.Nearest = nearest;
    const Picture picture = Draw(scene);
    ExpectSound(picture, "random mask");
    int compared = 0;
    for (int y = 2; y < picture.Height - 2; ++y)
    {
      for (int x = 2; x < picture.Width - 2; ++x)
      {
        // The camera looks along z with y up: x runs to the left.
        Int3 at{ n[0] - 1 - x / 2, y / 2, 0 };
        double length = 0;
        for (; at[2] < n[2]; ++at[2])
        {
          const bool end = at[2] == 0 || at[2] == n[2] - 1;
          length += isIn(at) ? (end ? 0.5 : 1.0) : 0.0;
        }
        const auto pixel = static_cast<std::size_t>(y * picture.Width + x);
        ASSERT_NEAR(picture.Colors[4 * pixel + 3], std::pow(0.95, length), 2e-6)
          << x << ", " << y << (nearest ? ", nearest" : "");
        ++compared;
      }
    }
    EXPECT_GT(compared, 1000);
  }
}

// Between oblique rays of all directions: a volume of one value in a mask of one voxel.
TEST(NativeMask, OneVoxelIsACube)
{
  const Int3 n{ 20, 20, 20 };
  PictureScene scene = ConstantScene(n, 0.4);
  scene.Source = Masked(scene.Source, [](const Int3& at) { return at == Int3{ 10, 10, 10 }; });
  for (const Double3& towards :
    { Double3{ 1, 1, 1 }, Double3{ -1, 1, 1 }, Double3{ 1, -1, 1 }, Double3{ -1, -1, -1 } })
  {
    Double3 eye{};
    for (std::size_t a = 0; a < 3; ++a)
    {
      eye[a] = 10.5 - 20 * towards[a];
    }
    // One pixel: its ray runs through the middle of the voxel, from corner to corner.
    scene.Camera = MakeCamera(scene.Source->Info(), 1, 1,
      LookAt(eye, { 10.5, 10.5, 10.5 }, { 0, 1, 0.3 }), Parallel(0.01, 1, 1, 100));
    const Picture picture = Draw(scene);
    ExpectSound(picture, "one voxel");
    EXPECT_NEAR(picture.Colors[3], std::pow(0.6, std::sqrt(3.0)), 1e-5);
  }
}

TEST(NativeMask, AMaskOfOnesChangesNoBit)
{
  ForEachScene(
    [](PictureScene scene, const std::string& name)
    {
      const Picture plain = Draw(scene);
      scene.Source = Masked(scene.Source, [](const Int3&) { return true; });
      const Picture masked = Draw(scene);
      ExpectSound(masked, name);
      EXPECT_GT(masked.Strongest(), 0.2f) << name;
      ExpectSameBits(plain, masked, name);
      EXPECT_EQ(plain.Uploads, masked.Uploads) << name;
      EXPECT_EQ(plain.Samples, masked.Samples) << name;
    });
}

TEST(NativeMask, SameBitsByAnyMeans)
{
  ForEachScene(
    [](PictureScene scene, const std::string& name)
    {
      const Int3 n = scene.Source->Info().Layout.Dimensions(0);
      const Picture plain = Draw(scene);
      scene.Source = Masked(scene.Source, [n](const Int3& at) { return IsInSponge(at, n); });
      const Picture whole = Draw(scene);
      ExpectSound(whole, name);
      EXPECT_GT(whole.Strongest(), 0.2f) << name;
      EXPECT_NE(whole.Colors, plain.Colors) << name;
      PictureMeans means;
      means.Slots = 4;
      const Picture few = Draw(scene, means);
      ExpectSameBits(whole, few, name + ", four slots");
      EXPECT_GT(few.Evictions, 0u) << name;
      means = {};
      means.StepsPerPass = 37;
      ExpectSameBits(whole, Draw(scene, means), name + ", short passes");
      means = {};
      means.Skip = false;
      const Picture all = Draw(scene, means);
      ExpectSameBits(whole, all, name + ", nothing skipped");
      EXPECT_GT(all.Uploads, whole.Uploads) << name;
      means = {};
      means.Baseline = true;
      ExpectSameBits(whole, Draw(scene, means), name + ", any processor");
    });
}

TEST(NativeMask, WhatLiesOutsideIsNotLoaded)
{
  PictureScene scene = MakeScene(ScalarType::UInt8, Way::Linear);
  const std::shared_ptr<BrickSource> volume = scene.Source;
  scene.Source = Masked(volume, [](const Int3&) { return false; });
  const Picture none = Draw(scene);
  ExpectSound(none, "nothing in the mask");
  EXPECT_EQ(none.Uploads, 0u);
  EXPECT_EQ(none.Strongest(), 0);
  // A voxel in the middle of a brick of 9 voxels.
  scene.Camera.MaximumLevel = 0;
  scene.Source = Masked(volume, [](const Int3& at) { return at == Int3{ 22, 22, 22 }; });
  EXPECT_EQ(Draw(scene).Uploads, 1u);
}

} // namespace teravox
