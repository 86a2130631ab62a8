// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Volumes of which a mask leaves a part away, or whose voxels have labels.
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
using LabelField = std::function<std::int32_t(const Int3&)>;

template <typename T, typename Field>
std::shared_ptr<BrickSource> MakeMask(
  const VolumeInfo& info, ScalarType type, const Field& valueOf, bool labels)
{
  const Int3 n = info.Layout.Dimensions(0);
  const auto voxels = std::make_shared<std::vector<T>>();
  Int3 at{};
  for (at[2] = 0; at[2] < n[2]; ++at[2])
  {
    for (at[1] = 0; at[1] < n[1]; ++at[1])
    {
      for (at[0] = 0; at[0] < n[0]; ++at[0])
      {
        voxels->push_back(valueOf(at));
      }
    }
  }
  ArrayDescription array;
  array.Data = voxels->data();
  array.Owner = voxels;
  array.Dimensions = n;
  array.Layout = info.Layout;
  array.Type = type;
  array.Mask = !labels;
  array.Labels = labels;
  return ArrayBrickSource::Make(array).Value();
}

std::shared_ptr<BrickSource> Masked(
  const std::shared_ptr<BrickSource>& source, const MaskField& isIn)
{
  const auto valueOf = [&](const Int3& at)
  { return static_cast<std::uint8_t>(isIn(at) ? 255 : 0); };
  return MaskedBrickSource::Make(
    source, MakeMask<std::uint8_t>(source->Info(), ScalarType::UInt8, valueOf, false))
    .Value();
}

std::shared_ptr<BrickSource> Labelled(const std::shared_ptr<BrickSource>& source,
  const LabelField& labelOf, std::vector<std::int64_t> names)
{
  return MaskedBrickSource::MakeLabels(source,
    MakeMask<std::int32_t>(source->Info(), ScalarType::Int32, labelOf, true), std::move(names))
    .Value();
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
// The picture, and the one of which nothing was skipped.
struct TwoPictures
{
  Picture Whole;
  Picture Everything;
};

// In a few slots, in short passes, without skipping, by the other instruction set.
TwoPictures ExpectSameBitsByAnyMeans(const PictureScene& scene, const std::string& name)
{
  TwoPictures pictures;
  pictures.Whole = Draw(scene);
  ExpectSound(pictures.Whole, name);
  EXPECT_GT(pictures.Whole.Strongest(), 0.2f) << name;
  PictureMeans means;
  means.Slots = 4;
  const Picture few = Draw(scene, means);
  ExpectSameBits(pictures.Whole, few, name + ", four slots");
  EXPECT_GT(few.Evictions, 0u) << name;
  means = {};
  means.StepsPerPass = 37;
  ExpectSameBits(pictures.Whole, Draw(scene, means), name + ", short passes");
  means = {};
  means.Skip = false;
  pictures.Everything = Draw(scene, means);
  ExpectSameBits(pictures.Whole, pictures.Everything, name + ", nothing skipped");
  means = {};
  means.Baseline = true;
  ExpectSameBits(pictures.Whole, Draw(scene, means), name + ", any processor");
  return pictures;
}

} // namespace

// Each ray of a ConstantScene crosses whole voxels of its column, and half of the first and the
// last one: exact. `opacityOf`: per voxel length.
template <typename OpacityOf>
void ExpectColumns(const PictureScene& scene, const OpacityOf& opacityOf, const std::string& name)
{
  const Int3 n = scene.Source->Info().Layout.Dimensions(0);
  const Picture picture = Draw(scene);
  ExpectSound(picture, name);
  int compared = 0;
  for (int y = 2; y < picture.Height - 2; ++y)
  {
    for (int x = 2; x < picture.Width - 2; ++x)
    {
      // The camera looks along z with y up: x runs to the left.
      Int3 at{ n[0] - 1 - x / 2, y / 2, 0 };
      double tau = 0;
      for (; at[2] < n[2]; ++at[2])
      {
        const bool end = at[2] == 0 || at[2] == n[2] - 1;
        tau -= std::log1p(-opacityOf(at)) * (end ? 0.5 : 1.0);
      }
      const auto pixel = static_cast<std::size_t>(y * picture.Width + x);
      ASSERT_NEAR(picture.Colors[4 * pixel + 3], std::exp(-tau), 2e-6)
        << name << ", " << x << ", " << y;
      ++compared;
    }
  }
  EXPECT_GT(compared, 900);
}

TEST(NativeMask, ConstantMediumBehindARandomMask)
{
  const MaskField isIn = [](const Int3& at)
  { return (at[0] * 7919 + at[1] * 104729 + at[2] * 1299709) % 13 < 6; };
  for (const bool nearest : { false, true })
  {
    PictureScene scene = ConstantScene({ 23, 19, 33 }, 0.05);
    scene.Source = Masked(scene.Source, isIn);
    scene.Nearest = nearest;
    ExpectColumns(
      scene, [&](const Int3& at) { return isIn(at) ? 0.05 : 0.0; },
      nearest ? "random mask, nearest" : "random mask");
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
      const auto [whole, all] = ExpectSameBitsByAnyMeans(scene, name);
      EXPECT_NE(whole.Colors, plain.Colors) << name;
      EXPECT_GT(all.Uploads, whole.Uploads) << name;
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

namespace
{
std::int64_t HashOf(const Int3& at)
{
  return (at[0] * 7919 + at[1] * 104729 + at[2] * 1299709) % 101;
}

// Blocks, a layer and single voxels: labels that have names, 0 and one without a name.
std::int32_t LabelAt(const Int3& at)
{
  if (HashOf(at) < 4)
  {
    return static_cast<std::int32_t>(HashOf(at)) * 1000;
  }
  return at[2] > 25 ? -7 : at[0] < 20 ? (at[1] < 15 ? 1000 : 0) : at[1] / 7 == 3 ? 2000 : 9;
}
const std::vector<std::int64_t> Names{ -7, 1000, 2000 };

TransferFunction Plain(double opacity)
{
  return MakeFunction({ 0, 255 }, { opacity, opacity });
}

// The volume's own function, one that sees other values, one that sees nothing, and a copy.
void GiveLabels(PictureScene& scene, double low, double high)
{
  const auto function = [&](std::vector<double> shares, std::vector<double> opacities)
  {
    for (double& share : shares)
    {
      share = low + share * (high - low);
    }
    return MakeFunction(std::move(shares), std::move(opacities));
  };
  scene.Source = Labelled(scene.Source, LabelAt, Names);
  const TransferFunction own = scene.Function;
  scene.Function.Labels = { function({ 0.2, 0.3, 0.33, 0.5 }, { 0, 0.2, 0, 0 }),
    function({ 0, 1 }, { 0, 0 }), own };
}

PictureScene LabelScene(ScalarType type, Way way)
{
  PictureScene scene = MakeScene(type, way);
  const ValueRange range = scene.Source->Info().Range;
  GiveLabels(scene, range.Min, range.Max);
  return scene;
}
} // namespace

TEST(NativeLabels, ConstantMediumOfRandomLabels)
{
  const LabelField labelOf = [](const Int3& at)
  {
    const std::int32_t labels[5] = { 0, 5, -70000, 2000000000, 6 };
    return labels[HashOf(at) % 5];
  };
  const double opacities[5] = { 0.05, 0.1, 0.02, 0, 0.05 };
  for (const bool nearest : { false, true })
  {
    PictureScene scene = ConstantScene({ 23, 19, 33 }, 0.05);
    scene.Source = Labelled(scene.Source, labelOf, { -70000, 5, 2000000000 });
    scene.Function.Labels = { Plain(0.02), Plain(0.1), Plain(0) };
    scene.Nearest = nearest;
    ExpectColumns(
      scene, [&](const Int3& at) { return opacities[HashOf(at) % 5]; },
      nearest ? "random labels, nearest" : "random labels");
  }
}

// More than a byte holds: bricks of bytes become such of words.
TEST(NativeLabels, AThousandLabels)
{
  const auto numberOf = [](const Int3& at)
  { return (at[0] * 131 + at[1] * 37 + at[2] * 11) % 1200; };
  const auto opacityOf = [](std::int64_t number)
  { return number < 1000 ? 1e-4 * static_cast<double>(number) : 0.03; };
  for (const ScalarType type : { ScalarType::UInt8, ScalarType::Int8 })
  {
    PictureScene scene = ConstantScene({ 19, 16, 21 }, 0.03);
    if (type == ScalarType::Int8)
    {
      scene.Source = MakeVolume(type, { 19, 16, 21 }, 9, [](const Int3&) { return 0.2; }).Source;
      scene.Function = MakeFunction({ -128, 127 }, { 0.03, 0.03 });
    }
    std::vector<std::int64_t> names;
    for (std::int64_t i = 0; i < 1000; ++i)
    {
      names.push_back(3 * i + 1);
      scene.Function.Labels.push_back(Plain(opacityOf(i)));
    }
    scene.Source = Labelled(
      scene.Source, [&](const Int3& at) { return static_cast<std::int32_t>(3 * numberOf(at) + 1); },
      names);
    EXPECT_EQ(SizeOf(scene.Source->Info().Type), 2u);
    EXPECT_EQ(scene.Source->Info().MaskLabels, 1001);
    ExpectColumns(
      scene, [&](const Int3& at) { return opacityOf(numberOf(at)); }, ToString(type));
  }
}

// Regions of one value are one piece without a mask, and cells with one: the last bits differ.
TEST(NativeLabels, OneLabelWithTheVolumesFunctionChangesNothing)
{
  ForEachScene(
    [](PictureScene scene, const std::string& name)
    {
      const std::shared_ptr<BrickSource> volume = scene.Source;
      const Picture plain = Draw(scene);
      const TransferFunction own = scene.Function;
      // What isn't met has another one.
      scene.Function.Labels = { Plain(0.1), own };
      scene.Function.Labels[0].Knots = own.Knots;
      scene.Source = Labelled(volume, [](const Int3&) { return 12; }, { 3, 12 });
      const Picture named = Draw(scene);
      ExpectSound(named, name);
      EXPECT_LT(LargestDifference(plain, named), 1e-6f) << name;
      scene.Source = Labelled(volume, [](const Int3&) { return 5; }, { 3, 12 });
      ExpectSameBits(named, Draw(scene), name);
    });
}

TEST(NativeLabels, SameBitsByAnyMeans)
{
  for (const bool gradient : { false, true })
  {
    for (const ScalarType type : { ScalarType::UInt8, ScalarType::UInt16, ScalarType::Float32 })
    {
      for (const Way way : { Way::Linear, Way::Shaded, Way::Nearest, Way::NearestShaded })
      {
        if (gradient && type == ScalarType::UInt8)
        {
          continue; // as words
        }
        PictureScene scene = LabelScene(type, way);
        const std::string name = std::string(ToString(type)) + ", way " +
          std::to_string(static_cast<int>(way)) + (gradient ? ", gradients" : "");
        if (gradient)
        {
          const ValueRange range = scene.Source->Info().Range;
          TransferFunction& label = scene.Function.Labels[0];
          label = WithGradientOpacity(
            label, 0.005 * (range.Max - range.Min), 0.05 * (range.Max - range.Min));
        }
        const auto [whole, all] = ExpectSameBitsByAnyMeans(scene, name);
        EXPECT_GT(all.Samples, whole.Samples) << name;
      }
    }
  }
}

// Cells of labels that see nothing are left at once, though other labels see such values.
TEST(NativeLabels, WhatALabelDoesNotSeeIsSkipped)
{
  PictureScene scene = ConstantScene({ 40, 40, 40 }, 0.2);
  const std::shared_ptr<BrickSource> volume = scene.Source;
  scene.Function.Labels = { Plain(0) };
  scene.Source = Labelled(volume, [](const Int3&) { return 1; }, { 1 });
  const Picture none = Draw(scene);
  ExpectSound(none, "nothing");
  EXPECT_EQ(none.Strongest(), 0);
  EXPECT_EQ(none.Samples, 0u);
  scene.Source = Labelled(volume, [](const Int3& at) { return at[2] < 20 ? 1 : 0; }, { 1 });
  PictureMeans means;
  means.Skip = false;
  const Picture half = Draw(scene);
  const Picture all = Draw(scene, means);
  ExpectSameBits(half, all, "half");
  EXPECT_GT(half.Strongest(), 0.9f);
  EXPECT_LT(half.Samples, all.Samples * 3 / 4);
}

// The gradient of a ramp is the same all over: a label's opacity of it is a factor of the
// extinction.
TEST(NativeLabels, GradientOpacityIsTheLabels)
{
  const Int3 n{ 20, 19, 41 };
  PictureScene scene = ConstantScene(n, 0.1);
  const Volume ramp = MakeVolume(
    ScalarType::UInt16, n, 9, [](const Int3& at) { return static_cast<double>(at[2]) / 100; });
  scene.Function = MakeFunction({ 0, 65535 }, { 0.1, 0.1 });
  const auto constant = [&](double factor)
  {
    TransferFunction function = scene.Function;
    function.GradientOpacity = [factor](double) { return factor; };
    return function;
  };
  const TransferFunction quarter = constant(0.25);
  const TransferFunction none = scene.Function;
  scene.Function = constant(0.5);
  scene.Function.Labels = { quarter, none };
  const LabelField labelOf = [](const Int3& at)
  { return static_cast<std::int32_t>(HashOf(at) % 3); };
  scene.Source = Labelled(ramp.Source, labelOf, { 1, 2 });
  const double shares[3] = { 0.5, 0.25, 1 };
  for (const bool nearest : { false, true })
  {
    scene.Nearest = nearest;
    ExpectColumns(
      scene, [&](const Int3& at) { return 1 - std::pow(0.9, shares[labelOf(at)]); },
      nearest ? "gradients, nearest" : "gradients");
  }
}

TEST(NativeMask, AMaskOfOnesChangesNoBitOfGradientOpacity)
{
  for (const Way way : { Way::Linear, Way::Shaded, Way::Nearest, Way::NearestShaded })
  {
    PictureScene scene = MakeScene(ScalarType::UInt16, way);
    scene.Function = WithGradientOpacity(std::move(scene.Function), 300, 3000);
    const Picture plain = Draw(scene);
    scene.Source = Masked(scene.Source, [](const Int3&) { return true; });
    ExpectSameBits(plain, Draw(scene), "way " + std::to_string(static_cast<int>(way)));
    EXPECT_GT(plain.Strongest(), 0.1f);
  }
}

} // namespace teravox
