// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "BricksMet.h"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <limits>

namespace teravox::test
{

namespace
{
// What is behind can't be seen: the share of the tolerance that the end of a ray has.
constexpr double Ended = 0.25 / 255;

// A step behind a face that is crossed.
double Behind(double t)
{
  return t + 1e-9 * (1 + t);
}
} // namespace

void ExpectWithin(const BrickSet& a, const BrickSet& b, const std::string& what)
{
  const auto stray =
    std::find_if(a.begin(), a.end(), [&](const BrickKey& key) { return b.count(key) == 0; });
  EXPECT_TRUE(stray == a.end()) << what << ": " << (stray == a.end() ? "" : stray->ToString());
}

BrickWalk::BrickWalk(Stage& stage, const std::shared_ptr<BrickSource>& source, VoxelAccess access)
  : Source(*source)
  , Truth(stage, *source, 1, access)
  , Layout(source->Info().Layout)
{
  for (int l = 0; l < this->Layout.NumberOfLevels(); ++l)
  {
    this->Ranges.emplace_back();
    for (int k = 0; k <= this->Layout.PageDepth(l); ++k)
    {
      BrickKey first = BrickKey::Of(l, { 0, 0, 0 });
      first.PageLevel = static_cast<std::uint8_t>(k);
      auto ranges = this->Source.ReadRanges(first, this->Layout.Pages(l, k));
      EXPECT_TRUE(ranges.Ok());
      this->Ranges.back().push_back(ranges.Value());
    }
  }
}

const ValueRange& BrickWalk::RangeOf(int level, int pageLevel, const Int3& region) const
{
  const Int3 n = this->Layout.Pages(level, pageLevel);
  return this->Ranges[static_cast<std::size_t>(level)][static_cast<std::size_t>(pageLevel)]
                     [static_cast<std::size_t>(region[0] + n[0] * (region[1] + n[1] * region[2]))];
}

bool BrickWalk::IsEmpty(int level, int pageLevel, const Int3& region) const
{
  const ValueRange& range = this->RangeOf(level, pageLevel, region);
  return range.IsVoid() ||
    (range.IsKnown() && this->Scene().Transfer.IsRangeEmpty(range.Min, range.Max));
}

Met BrickWalk::Walk(double samples, const OpaqueDepth& opaqueDepth) const
{
  Met met;
  const TruthCamera& camera = this->Scene().Camera;
  for (int y = 0; y < camera.Height(); ++y)
  {
    for (int x = 0; x < camera.Width(); ++x)
    {
      this->WalkRay(met, x, y, samples,
        opaqueDepth ? opaqueDepth(x, y) : std::numeric_limits<double>::infinity());
    }
  }
  return met;
}

// Where a ray leaves the region around a point.
double BrickWalk::ExitOf(
  int level, int pageLevel, const Line& line, const Double3& p, double end) const
{
  const Int3& factor = this->Layout.Factor(level);
  double exit = end;
  for (std::size_t a = 0; a < 3; ++a)
  {
    const double edge = static_cast<double>(factor[a]) * this->Layout.BrickSize() *
      std::pow(static_cast<double>(PageBlockEdge), pageLevel);
    const double d = line.Direction[a];
    const double face = (std::floor(p[a] / edge) + (d > 0 ? 1 : 0)) * edge;
    exit = d != 0 ? std::min(exit, (face - line.Origin[a]) / d) : exit;
  }
  return exit;
}

void BrickWalk::WalkRay(Met& met, int x, int y, double samples, double opaqueDepth) const
{
  const TruthScene& scene = this->Scene();
  const TruthRay ray = scene.Camera.Ray(x, y);
  const auto voxelAt = [&](double t)
  { return TransformPoint(scene.Volume.VoxelFromWorld(), ray.At(t)); };
  const Line line{ voxelAt(0), voxelAt(1) - voxelAt(0) };
  double transmittance = 1;
  for (const TruthLevelSpan& span : LevelSpans(scene, x, y, 0, 0, opaqueDepth))
  {
    const Int3& factor = this->Layout.Factor(span.Level);
    const double end = ray.LengthAtDepth(span.DepthEnd);
    double left = -1; // up to here an empty region reaches
    for (double t = ray.LengthAtDepth(span.DepthBegin); t < end;)
    {
      const Double3 p = line.Origin + Behind(t) * line.Direction;
      Int3 brick{};
      for (std::size_t a = 0; a < 3; ++a)
      {
        const double edge = static_cast<double>(factor[a]) * this->Layout.BrickSize();
        brick[a] = std::clamp<std::int64_t>(static_cast<std::int64_t>(std::floor(p[a] / edge)), 0,
          this->Layout.Bricks(span.Level)[a] - 1);
      }
      const BrickKey key = BrickKey::Of(span.Level, brick);
      const double exit = std::max(this->ExitOf(span.Level, 0, line, p, end), Behind(t));
      met.Passed.insert(key);
      met.Bricks += 1;
      if (t >= left)
      {
        met.Visits += 1;
        for (int k = this->Layout.PageDepth(span.Level); k >= 0; --k)
        {
          if (this->IsEmpty(
                span.Level, k, { brick[0] >> 3 * k, brick[1] >> 3 * k, brick[2] >> 3 * k }))
          {
            left = this->ExitOf(span.Level, k, line, p, end);
            break;
          }
        }
      }
      if (!this->IsEmpty(span.Level, 0, brick))
      {
        met.Visible.insert(key);
        if (samples > 0 &&
          this->Gather(span.Level, line, t, std::min(exit, end), samples, transmittance) &&
          !this->IsSingle(span.Level, brick))
        {
          met.Touched.insert(key);
        }
        if (transmittance <= Ended)
        {
          return;
        }
      }
      t = exit;
    }
  }
}

// Midpoints of equal pieces; returns whether anything is added.
bool BrickWalk::Gather(int level, const Line& line, double begin, double end, double samples,
  double& transmittance) const
{
  const TruthScene& scene = this->Scene();
  double voxels = 0;
  for (std::size_t a = 0; a < 3; ++a)
  {
    voxels = std::max(
      voxels, std::abs(line.Direction[a]) / static_cast<double>(this->Layout.Factor(level)[a]));
  }
  const int n = std::max(1, static_cast<int>(std::ceil((end - begin) * voxels * samples)));
  const double step = (end - begin) / n;
  bool touched = false;
  for (int i = 0; i < n && transmittance > Ended; ++i)
  {
    const double value =
      scene.Volume.Field(level, line.Origin + (begin + (i + 0.5) * step) * line.Direction);
    const double alpha = std::isnan(value) ? 0 : scene.Transfer.GetAlpha(value);
    touched = touched || alpha > 0;
    transmittance *= std::exp(-scene.Transfer.Extinction(alpha) * step);
  }
  return touched;
}

} // namespace teravox::test
