// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// Rays through several volumes, against closed forms: media of constant extinction and colour in
// pieces, for which both one volume alone and all together can be integrated exactly.
#include "MixedRays.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <gtest/gtest.h>
#include <random>
#include <vector>

using namespace teravox;

namespace
{

struct Piece
{
  double Begin = 0;
  double End = 0;
  double Extinction = 0;
  std::array<double, 3> Color{};
};
using Medium = std::vector<Piece>; // pieces that don't overlap, ascending

// What is met between two depths: extinction and light per length, of all media together.
MixedColor Integrate(const std::vector<const Medium*>& media, double begin, double end)
{
  std::vector<double> cuts{ begin, end };
  for (const Medium* medium : media)
  {
    for (const Piece& piece : *medium)
    {
      for (const double cut : { piece.Begin, piece.End })
      {
        if (cut > begin && cut < end)
        {
          cuts.push_back(cut);
        }
      }
    }
  }
  std::sort(cuts.begin(), cuts.end());
  std::array<double, 4> sum{};
  for (std::size_t i = 1; i < cuts.size(); ++i)
  {
    const double middle = 0.5 * (cuts[i - 1] + cuts[i]);
    double extinction = 0;
    std::array<double, 3> light{};
    for (const Medium* medium : media)
    {
      for (const Piece& piece : *medium)
      {
        if (piece.Begin <= middle && middle < piece.End)
        {
          extinction += piece.Extinction;
          for (std::size_t c = 0; c < 3; ++c)
          {
            light[c] += piece.Extinction * piece.Color[c];
          }
        }
      }
    }
    if (extinction > 0)
    {
      const double opacity = -std::expm1(-extinction * (cuts[i] - cuts[i - 1])) * (1 - sum[3]);
      for (std::size_t c = 0; c < 3; ++c)
      {
        sum[c] += light[c] / extinction * opacity;
      }
      sum[3] += opacity;
    }
  }
  return { static_cast<float>(sum[0]), static_cast<float>(sum[1]), static_cast<float>(sum[2]),
    static_cast<float>(sum[3]) };
}

double DifferenceOf(const MixedColor& a, const MixedColor& b)
{
  double largest = 0;
  for (std::size_t c = 0; c < 4; ++c)
  {
    largest = std::max(largest, static_cast<double>(std::fabs(a[c] - b[c])));
  }
  return largest;
}

constexpr double ZoneBegin = 10;
constexpr double ZoneEnd = 110;
constexpr double RayEnd = 200; // opaque geometry, or the far plane

std::vector<float> DrawnOf(const Medium& medium, const MixedRays::Stretch& stretch)
{
  const MixedColor color =
    Integrate({ &medium }, std::max(stretch.Begin, 0.0), std::min(stretch.End, RayEnd));
  return { color.begin(), color.end() };
}

struct Mixed
{
  MixedColor Color{};
  std::uint64_t Rounds = 0;
};

// One ray; its stretches have to follow each other without gaps.
Mixed Mix(const std::vector<Medium>& media, double tolerance, double leastLength = 0.01)
{
  MixedRays::Options options;
  options.Tolerance = tolerance;
  options.ZoneBegin = ZoneBegin;
  options.ZoneEnd = ZoneEnd;
  options.LeastLength = leastLength;
  std::vector<std::vector<float>> whole;
  for (const Medium& medium : media)
  {
    whole.push_back(DrawnOf(medium, { 0, RayEnd }));
  }
  MixedRays rays(options, whole);
  double at = MixedRays::FromNear;
  while (!rays.IsDone() && rays.Rounds() < 100000)
  {
    const std::vector<MixedRays::Stretch> stretches = rays.Next();
    EXPECT_EQ(stretches.size(), 1u);
    const MixedRays::Stretch& stretch = stretches[0];
    EXPECT_LT(stretch.Begin, stretch.End);
    EXPECT_LE(stretch.Begin, std::max(at, ZoneBegin)) << "no gap";
    at = stretch.End;
    std::vector<std::vector<float>> drawn;
    for (const Medium& medium : media)
    {
      drawn.push_back(DrawnOf(medium, stretch));
    }
    rays.Take(drawn);
  }
  EXPECT_TRUE(rays.IsDone());
  Mixed mixed;
  std::copy_n(rays.Colors().begin(), 4, mixed.Color.begin());
  mixed.Rounds = rays.Rounds();
  return mixed;
}

std::vector<const Medium*> PointersTo(const std::vector<Medium>& media)
{
  std::vector<const Medium*> all;
  for (const Medium& medium : media)
  {
    all.push_back(&medium);
  }
  return all;
}

MixedColor Truth(const std::vector<Medium>& media)
{
  return Integrate(PointersTo(media), 0, RayEnd);
}

Medium Slab(double begin, double end, double extinction, const std::array<double, 3>& color)
{
  return { { begin, end, extinction, color } };
}

constexpr std::array<double, 3> Red{ 1, 0, 0 };
constexpr std::array<double, 3> Green{ 0, 1, 0 };
constexpr std::array<double, 3> Blue{ 0, 0, 1 };
constexpr double Tolerance = 0.5 / 255;

} // namespace

// Constant media that fill the same stretch are mixed exactly, however thin or opaque.
TEST(MixedRays, ConstantMediaAreMixedExactly)
{
  for (const double thickness : { 1e-6, 1e-3, 0.3, 2.0, 4.0 })
  {
    const std::vector<Medium> media{ Slab(20, 21, thickness, Red),
      Slab(20, 21, 0.3 * thickness, Green), Slab(20, 21, 2.5 * thickness, Blue) };
    std::vector<MixedColor> alone;
    for (const Medium& medium : media)
    {
      alone.push_back(Integrate({ &medium }, 20, 21));
    }
    float ambiguity = 0;
    const MixedColor mixed = MixStretch(alone.data(), alone.size(), ambiguity);
    // Near opacity 1 a float of it tells optical depth to 6e-8 e^tau.
    const double precision =
      4e-7 + std::min(6e-8 * std::exp(2.5 * thickness), 1.0) / std::max(thickness, 1.0);
    EXPECT_LE(DifferenceOf(mixed, Truth(media)), precision) << thickness;
    EXPECT_GE(ambiguity, 0);
  }
}

// The opacity doesn't depend on who lies in front; no order makes a larger error than is said.
TEST(MixedRays, AmbiguityBoundsEveryOrder)
{
  std::mt19937 random(7);
  std::uniform_real_distribution<double> in01(0, 1);
  for (int trial = 0; trial < 2000; ++trial)
  {
    std::vector<Medium> media(2 + random() % 2);
    for (Medium& medium : media)
    {
      double at = 20;
      while (at < 30)
      {
        const double length = 0.2 + 4 * in01(random);
        const double extinction = in01(random) < 0.5 ? 0 : 2 * std::pow(in01(random), 4);
        medium.push_back({ at, std::min(at + length, 30.0), extinction,
          { in01(random), in01(random), in01(random) } });
        at += length;
      }
    }
    std::vector<MixedColor> alone;
    for (const Medium& medium : media)
    {
      alone.push_back(Integrate({ &medium }, 20, 30));
    }
    float ambiguity = 0;
    const MixedColor mixed = MixStretch(alone.data(), alone.size(), ambiguity);
    const MixedColor truth = Truth(media);
    EXPECT_NEAR(mixed[3], truth[3], 2e-6) << trial;
    // Half of what is in between is the error if the guess lies in the middle; it does nearly.
    EXPECT_LE(DifferenceOf(mixed, truth), 2 * static_cast<double>(ambiguity) + 2e-6) << trial;
  }
}

// A ray that only one volume contributes to is that volume's, bit for bit, without any stretch.
TEST(MixedRays, OneVolumeAloneIsLeftAsItIs)
{
  const std::vector<Medium> media{ Slab(30, 60, 0.05, Red), {}, {} };
  const Mixed mixed = Mix(media, Tolerance);
  EXPECT_EQ(mixed.Rounds, 0u);
  EXPECT_EQ(mixed.Color, Integrate({ media.data() }, 0, RayEnd));
}

// One behind the other: whatever lies in front covers what is behind, at every distance down to the
// shortest stretch.
TEST(MixedRays, OpaqueWallsKeepTheirOrder)
{
  for (const double distance : { 30.0, 3.0, 0.3, 0.05 })
  {
    for (const bool redFirst : { true, false })
    {
      const double red = redFirst ? 41.7 : 41.7 + distance;
      const double green = redFirst ? 41.7 + distance : 41.7;
      const std::vector<Medium> media{ Slab(red, red + 0.01, 5000, Red),
        Slab(green, green + 0.01, 5000, Green) };
      const Mixed mixed = Mix(media, Tolerance);
      EXPECT_LE(DifferenceOf(mixed.Color, Truth(media)), Tolerance) << distance << redFirst;
      EXPECT_LT(mixed.Rounds, 80u) << distance;
    }
  }
}

// What lies in front of the places that volumes share, and behind them, is drawn, too.
TEST(MixedRays, NothingIsLostOutsideOfTheZone)
{
  const std::vector<Medium> media{ Slab(2, 60, 0.01, Red), Slab(40, 190, 0.008, Green) };
  EXPECT_LE(DifferenceOf(Mix(media, Tolerance).Color, Truth(media)), Tolerance);
}

// Fogs, slabs and sheets at random. The estimate may be wrong where something hides between the
// halves of a stretch, but never by more than Certain allows.
TEST(MixedRays, RandomMediaWithinTheTolerance)
{
  std::mt19937 random(11);
  std::uniform_real_distribution<double> in01(0, 1);
  std::vector<double> errors;
  std::uint64_t rounds = 0;
  constexpr int trials = 2000;
  for (int trial = 0; trial < trials; ++trial)
  {
    std::vector<Medium> media(2 + random() % 2);
    for (Medium& medium : media)
    {
      const int kind = static_cast<int>(random() % 3);
      double at = ZoneBegin + 40 * in01(random);
      const double scale = kind == 0 ? 20 : kind == 1 ? 5 : 0.5;
      while (at < ZoneEnd)
      {
        const double length = scale * (0.1 + in01(random));
        const bool isThere = in01(random) < (kind == 2 ? 0.05 : 0.6);
        medium.push_back(
          { at, std::min(at + length, ZoneEnd), isThere ? std::pow(in01(random), 3) * 2 / scale : 0,
            { in01(random), in01(random), in01(random) } });
        at += length;
      }
    }
    const Mixed mixed = Mix(media, Tolerance);
    errors.push_back(DifferenceOf(mixed.Color, Truth(media)) / Tolerance);
    rounds += mixed.Rounds;
    EXPECT_LE(errors.back(), MixedRays::Certain) << trial;
  }
  std::sort(errors.begin(), errors.end());
  std::printf("  errors in tolerances: median %.3f, p99 %.2f, max %.2f; %.1f stretches per ray\n",
    errors[trials / 2], errors[trials * 99 / 100], errors.back(),
    static_cast<double>(rounds) / trials);
  EXPECT_LE(errors[trials * 99 / 100], 1.0);
}

// Smooth media: the error follows the tolerance, and stretches grow no faster than its cube root.
TEST(MixedRays, ToleranceRulesErrorAndStretches)
{
  std::vector<Medium> media(2);
  for (int v = 0; v < 2; ++v)
  {
    for (int i = 0; i < 2000; ++i)
    {
      const double at = ZoneBegin + 0.05 * i;
      const double away = (at - (v == 0 ? 50 : 65)) / 18;
      media[static_cast<std::size_t>(v)].push_back(
        { at, at + 0.05, 0.05 * std::exp(-away * away), v == 0 ? Red : Green });
    }
  }
  const MixedColor truth = Truth(media);
  std::uint64_t before = 0;
  for (const double tolerance : { 16.0 / 255, 4.0 / 255, 1.0 / 255, 0.25 / 255 })
  {
    const Mixed mixed = Mix(media, tolerance);
    std::printf("  tolerance %.2f/255: error %.4f of it, %d stretches\n", 255 * tolerance,
      DifferenceOf(mixed.Color, truth) / tolerance, static_cast<int>(mixed.Rounds));
    EXPECT_LE(DifferenceOf(mixed.Color, truth), tolerance);
    if (before != 0)
    {
      EXPECT_LE(mixed.Rounds, 3 * before) << "four times as exact";
    }
    before = mixed.Rounds;
  }
}
