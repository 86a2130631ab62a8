// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "TruthIntegrator.h"

#include "TruthCubic.h"
#include "TruthQuadrature.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdint>

namespace teravox
{
namespace
{

/// Parallel planes q = index + Offset along one axis, met in order by q(t) = A + B t.
/// Places are computed from the index each time, never added up.
class PlaneFamily
{
public:
  PlaneFamily(double a, double b, double offset, double start)
    : A(a)
    , B(b)
    , Offset(offset)
  {
    if (b == 0)
    {
      return;
    }
    const double index = a + b * start - offset;
    this->Index = static_cast<std::int64_t>(b > 0 ? std::floor(index) : std::ceil(index));
    this->Update();
    this->Pass(start);
  }
  double Next() const { return this->Place; }
  /// Afterwards, Next() > t.
  void Pass(double t)
  {
    while (this->Place <= t)
    {
      this->Index += this->B > 0 ? 1 : -1;
      this->Update();
    }
  }

private:
  void Update()
  {
    this->Place = (static_cast<double>(this->Index) + this->Offset - this->A) / this->B;
  }

  double A;
  double B;
  double Offset;
  std::int64_t Index = 0;
  double Place = std::numeric_limits<double>::infinity();
};

/// Walks one ray. Lengths t are world units from the ray's origin.
class RayIntegrator
{
public:
  RayIntegrator(const TruthScene& scene, const TruthRay& ray)
    : Scene(scene)
    , Volume(scene.Volume)
    , Transfer(scene.Image ? &scene.Image->Envelope() : &scene.Transfer)
    , OpacityByGradient(scene.Image ? nullptr : scene.GradientOpacity)
    , PieceTolerance(1e-3 * scene.Tolerance)
  {
    this->Start = TransformPoint(this->Volume.VoxelFromWorld(), ray.Origin);
    this->Step = TransformVector(this->Volume.VoxelFromWorld(), ray.Direction);
    this->LengthScale = Length(TransformVector(scene.LengthFromWorld, ray.Direction));
    this->Shading.Ray = ray;
  }

  std::vector<TruthLevelSpan> Levels(double opaqueDepth) const
  {
    const TruthRay& ray = this->Shading.Ray;
    double begin = 0;
    double end = std::min(ray.Length, ray.LengthAtDepth(opaqueDepth));
    for (std::size_t axis = 0; axis < 3; ++axis)
    {
      this->Clip(axis, begin, end);
    }
    for (const TruthPlane& plane : this->Scene.Planes)
    {
      const double distance = Dot(plane.Normal, ray.Origin - plane.Origin);
      const double slope = Dot(plane.Normal, ray.Direction);
      begin = slope > 0 ? std::max(begin, -distance / slope) : begin;
      end = slope < 0 ? std::min(end, -distance / slope) : end;
      end = slope == 0 && distance < 0 ? begin : end;
    }
    std::vector<TruthLevelSpan> spans;
    double from = begin;
    for (const double to : this->CropCuts(begin, end))
    {
      if (from < to && this->IsKept(0.5 * (from + to)))
      {
        this->AddLevels(from, to, spans);
      }
      from = to;
    }
    return spans;
  }

  /// Where a ray begins in the box, clipped or not.
  double Entry() const
  {
    double begin = 0;
    double end = this->Shading.Ray.Length;
    for (std::size_t axis = 0; axis < 3; ++axis)
    {
      this->Clip(axis, begin, end);
    }
    return begin;
  }

  void AddLevels(double begin, double end, std::vector<TruthLevelSpan>& spans) const
  {
    const TruthRay& ray = this->Shading.Ray;
    std::vector<double> cuts{ ray.DepthAt(begin) };
    for (const double depth : this->Scene.LevelOfDetail.BoundaryDepths())
    {
      if (depth > cuts.back() && depth < ray.DepthAt(end))
      {
        cuts.push_back(depth);
      }
    }
    cuts.push_back(ray.DepthAt(end));
    for (std::size_t i = 0; i + 1 < cuts.size(); ++i)
    {
      const int level = this->Scene.LevelOfDetail.LevelAtDepth(0.5 * (cuts[i] + cuts[i + 1]));
      if (i > 0 && spans.back().Level == level)
      {
        spans.back().DepthEnd = cuts[i + 1];
      }
      else
      {
        spans.push_back({ level, cuts[i], cuts[i + 1] });
      }
    }
  }

  /// Where the ray meets planes of cropping between two places, ascending; the last is `end`.
  std::vector<double> CropCuts(double begin, double end) const
  {
    std::vector<double> cuts{ end };
    if (this->Scene.Crop)
    {
      const TruthCrop& crop = *this->Scene.Crop;
      const Double3 start = TransformPoint(crop.FromWorld, this->Shading.Ray.Origin);
      const Double3 step = TransformVector(crop.FromWorld, this->Shading.Ray.Direction);
      for (std::size_t i = 0; i < 6; ++i)
      {
        const double cut = (crop.Planes[i] - start[i / 2]) / step[i / 2];
        if (cut > begin && cut < end)
        {
          cuts.push_back(cut);
        }
      }
      std::sort(cuts.begin(), cuts.end());
    }
    return cuts;
  }

  bool IsKept(double t) const
  {
    if (!this->Scene.Crop)
    {
      return true;
    }
    const TruthCrop& crop = *this->Scene.Crop;
    const Double3 p = TransformPoint(crop.FromWorld, this->Shading.Ray.At(t));
    unsigned region = 0;
    unsigned weight = 1;
    for (std::size_t a = 0; a < 3; ++a, weight *= 3)
    {
      region += weight * (p[a] < crop.Planes[2 * a] ? 0 : p[a] < crop.Planes[2 * a + 1] ? 1 : 2);
    }
    return (crop.Flags >> region & 1u) != 0;
  }

  TruthColor Run(double opaqueDepth)
  {
    const TruthRay& ray = this->Shading.Ray;
    const std::vector<TruthLevelSpan> spans = this->Levels(opaqueDepth);
    if (!spans.empty())
    {
      this->Shading.Entry = ray.At(this->Entry());
    }
    for (const TruthLevelSpan& span : spans)
    {
      this->Level = span.Level;
      this->MarchLevel(ray.LengthAtDepth(span.DepthBegin), ray.LengthAtDepth(span.DepthEnd));
    }
    const double alpha = this->Wall ? 1 : -std::expm1(-this->Light.Tau);
    return { this->Light.Color[0], this->Light.Color[1], this->Light.Color[2], alpha };
  }

private:
  bool Done() const { return this->Wall || this->Light.Tau > 27.631021115928547; } // -ln(1e-12)

  Double3 At(double t) const { return this->Start + t * this->Step; }

  void Clip(std::size_t axis, double& begin, double& end) const
  {
    const double lower = this->Volume.BoundsMin()[axis];
    const double upper = this->Volume.BoundsMax()[axis];
    if (this->Step[axis] == 0)
    {
      if (this->Start[axis] < lower || this->Start[axis] > upper)
      {
        end = begin;
      }
      return;
    }
    const double a = (lower - this->Start[axis]) / this->Step[axis];
    const double b = (upper - this->Start[axis]) / this->Step[axis];
    begin = std::max(begin, std::min(a, b));
    end = std::min(end, std::max(a, b));
  }

  void MarchLevel(double from, double to)
  {
    const bool linear = this->Volume.Interpolation() == TruthInterpolation::Linear;
    this->GradientStep = this->Scene.Shading
      ? this->Scene.Shading->GradientStep(this->Volume, this->Level)
      : Double3{ 1, 1, 1 };
    for (std::size_t axis = 0; axis < 3; ++axis)
    {
      this->Factor[axis] = static_cast<double>(this->Volume.Level(this->Level).Factor[axis]);
    }
    std::vector<PlaneFamily> families;
    for (std::size_t axis = 0; axis < 3; ++axis)
    {
      const auto factor = static_cast<double>(this->Volume.Level(this->Level).Factor[axis]);
      const double a = this->Start[axis] / factor;
      const double b = this->Step[axis] / factor;
      const double offset = linear ? 0.5 : 0.0;
      families.emplace_back(a, b, offset, from);
      if (linear && this->Scene.Mask)
      {
        families.emplace_back(a, b, 0.0, from);
      }
      // The two fields of a central difference bend (or jump) at planes of their own, if the
      // difference isn't over whole voxels.
      const double step = this->GradientStep[axis];
      if (this->Scene.Shading && step != std::floor(step))
      {
        families.emplace_back(a, b, offset + step, from);
        families.emplace_back(a, b, offset - step, from);
      }
    }
    const std::vector<double> cuts = this->ClippedCuts(from, to);
    auto cut = cuts.begin();
    while (from < to && !this->Done())
    {
      double next = to;
      while (cut != cuts.end() && *cut <= from)
      {
        ++cut;
      }
      next = cut != cuts.end() ? std::min(next, *cut) : next;
      for (PlaneFamily& family : families)
      {
        family.Pass(from);
        next = std::min(next, family.Next());
      }
      if (this->IsMaskedOut(0.5 * (from + next)))
      {
        from = next;
        continue;
      }
      this->TakeLabel(0.5 * (from + next));
      this->FindClipped(0.5 * (from + next));
      if (linear)
      {
        this->LinearPiece(from, next);
      }
      else
      {
        this->NearestPiece(from, next);
      }
      from = next;
    }
  }

  /// How far a place of a central difference at t is before a plane: axis by axis the one before,
  /// then the one behind.
  double Before(const TruthPlane& plane, std::size_t place, double t) const
  {
    Double3 offset{};
    const std::size_t axis = place / 2;
    offset[axis] = this->GradientStep[axis] * this->Factor[axis] * (place % 2 == 0 ? -1 : 1);
    const Matrix4 worldFromVoxel = Invert(this->Volume.VoxelFromWorld());
    return Dot(plane.Normal,
      this->Shading.Ray.At(t) + TransformVector(worldFromVoxel, offset) - plane.Origin);
  }

  /// Where one of them passes a plane, ascending.
  std::vector<double> ClippedCuts(double from, double to) const
  {
    std::vector<double> cuts;
    for (const TruthPlane& plane : this->Scene.Planes)
    {
      for (std::size_t place = 0; place < 6 && this->Scene.ClippedIntensity; ++place)
      {
        const double cut =
          -this->Before(plane, place, 0) / Dot(plane.Normal, this->Shading.Ray.Direction);
        if (cut > from && cut < to)
        {
          cuts.push_back(cut);
        }
      }
    }
    std::sort(cuts.begin(), cuts.end());
    return cuts;
  }

  void FindClipped(double t)
  {
    for (std::size_t place = 0; place < 6 && this->Scene.ClippedIntensity; ++place)
    {
      this->Clipped[place] = std::any_of(this->Scene.Planes.begin(), this->Scene.Planes.end(),
        [&](const TruthPlane& plane) { return this->Before(plane, place, t) < 0; });
    }
  }

  bool IsMaskedOut(double t) const
  {
    return this->Scene.Mask && !this->Scene.Labels &&
      !(this->Scene.Mask->Field(this->Level, this->At(t)) > 0);
  }

  /// The functions of what lies at a place.
  void TakeLabel(double t)
  {
    if (!this->Scene.Mask || !this->Scene.Labels)
    {
      return;
    }
    const double value = this->Scene.Mask->Field(this->Level, this->At(t));
    const auto label = this->Scene.Labels->find(static_cast<std::int64_t>(std::floor(value)));
    const bool named = label != this->Scene.Labels->end();
    this->Transfer = named ? &label->second.Transfer : &this->Scene.Transfer;
    this->OpacityByGradient =
      !named ? this->Scene.GradientOpacity : label->second.GradientOpacity.get();
  }

  /// Of a value where the gradient is that of a central difference.
  double Alpha(double value, const Double3& difference) const
  {
    return this->Scene.Image ? this->Scene.Image->At(value, this->Magnitude(difference))[3]
                             : this->Transfer->GetAlpha(value);
  }

  double Magnitude(const Double3& difference) const
  {
    return this->Scene.Image->Rows().Magnitude(difference, this->Factor);
  }

  Double3 PlainColor(double value, const Double3& difference) const
  {
    if (!this->Scene.Image)
    {
      return this->Transfer->GetColor(value);
    }
    const std::array<double, 4> rgba = this->Scene.Image->At(value, this->Magnitude(difference));
    return { rgba[0], rgba[1], rgba[2] };
  }

  /// `difference` isn't used where there is no shading, nor an image. `t`: where it is.
  Double3 Color(double value, const Double3& difference, double t) const
  {
    const Double3 color = this->PlainColor(value, difference);
    if (!this->Scene.Shading)
    {
      return color;
    }
    TruthShadingRay place = this->Shading;
    place.At = this->Shading.Ray.At(t);
    return this->Scene.Shading->Shade(place, this->Volume, this->Level, difference, color);
  }

  bool NeedsDifferences() const
  {
    return this->Scene.Shading || this->OpacityByGradient || this->Scene.Image;
  }

  /// Factor of the extinction.
  double GradientOpacity(const Double3& difference) const
  {
    const TruthGradientOpacity* opacity = this->OpacityByGradient;
    return opacity ? (*opacity)(opacity->Magnitude(difference, this->Factor)) : 1;
  }

  Double3 DifferenceAt(double t) const
  {
    if (!this->NeedsDifferences())
    {
      return { 0, 0, 0 };
    }
    Double3 difference =
      this->Volume.CentralDifference(this->Level, this->At(t), this->GradientStep);
    for (std::size_t axis = 0; axis < 3; ++axis)
    {
      if (this->Clipped[2 * axis] || this->Clipped[2 * axis + 1])
      {
        const auto found = [&](std::size_t place, double side)
        {
          Double3 there = this->At(t);
          there[axis] += side * this->GradientStep[axis] * this->Factor[axis];
          return this->Clipped[place] ? *this->Scene.ClippedIntensity
                                      : this->Volume.Field(this->Level, there);
        };
        difference[axis] = found(2 * axis + 1, 1) - found(2 * axis, -1);
      }
    }
    return difference;
  }

  void HitWall(const Double3& color)
  {
    this->Light.Color = this->Light.Color + std::exp(-this->Light.Tau) * color;
    this->Wall = true;
  }

  /// Constant colour and opacity on [from, to].
  void UniformPiece(double from, double to, double value)
  {
    const double middle = 0.5 * (from + to);
    const Double3 difference = this->DifferenceAt(middle);
    const double alpha = this->Alpha(value, difference);
    if (!(alpha > 0))
    {
      return;
    }
    const double share = this->GradientOpacity(difference);
    if (!(share > 0))
    {
      return;
    }
    const Double3 color = this->Color(value, difference, middle);
    if (alpha >= 1)
    {
      this->HitWall(color);
      return;
    }
    const double tau = this->Transfer->Extinction(alpha) * share * this->LengthScale * (to - from);
    this->Light.Color = this->Light.Color + std::exp(-this->Light.Tau) * -std::expm1(-tau) * color;
    this->Light.Tau += tau;
  }

  void NearestPiece(double from, double to)
  {
    const double value = this->Volume.Field(this->Level, this->At(0.5 * (from + to)));
    if (!std::isnan(value))
    {
      this->UniformPiece(from, to, value);
    }
  }

  void LinearPiece(double from, double to)
  {
    const Double3 begin = this->At(from);
    const Double3 end = this->At(to);
    Int3 base{};
    Double3 start{};
    Double3 stop{};
    for (std::size_t axis = 0; axis < 3; ++axis)
    {
      const auto factor = static_cast<double>(this->Volume.Level(this->Level).Factor[axis]);
      const double q0 = begin[axis] / factor - 0.5;
      const double q1 = end[axis] / factor - 0.5;
      const double cell = std::floor(0.5 * (q0 + q1));
      base[axis] = static_cast<std::int64_t>(cell);
      start[axis] = std::clamp(q0 - cell, 0.0, 1.0);
      stop[axis] = std::clamp(q1 - cell, 0.0, 1.0);
    }
    std::array<double, 8> corners{};
    if (!this->LoadCell(base, start, stop, corners))
    {
      return;
    }
    const auto range = std::minmax_element(corners.begin(), corners.end());
    if (this->Transfer->IsRangeEmpty(*range.first, *range.second))
    {
      return;
    }
    const TruthCubic cubic = TruthCubic::FromCell(corners, start, stop);
    if (cubic.IsConstant() && !this->NeedsDifferences())
    {
      this->UniformPiece(from, to, cubic(0));
      return;
    }
    this->FitDifferences(from, to);
    std::array<double, 4> cuts{};
    const int pieces = cubic.MonotonePieces(cuts);
    for (std::size_t i = 0; i < static_cast<std::size_t>(pieces) && !this->Done(); ++i)
    {
      this->MonotonePiece(from, to, cubic, cuts[i], cuts[i + 1]);
    }
  }

  /// False where a NaN takes part. Corners of weight zero all along the piece repeat their
  /// neighbours.
  bool LoadCell(const Int3& base, const Double3& start, const Double3& stop,
    std::array<double, 8>& corners) const
  {
    for (std::size_t corner = 0; corner < 8; ++corner)
    {
      Int3 index = base;
      for (std::size_t axis = 0; axis < 3; ++axis)
      {
        const bool onlyLower = start[axis] == 0 && stop[axis] == 0;
        const bool onlyUpper = start[axis] == 1 && stop[axis] == 1;
        const bool upper = onlyUpper || (!onlyLower && (corner >> axis & 1) != 0);
        index[axis] += upper ? 1 : 0;
      }
      corners[corner] = this->Volume.ClampedVoxel(this->Level, index[0], index[1], index[2]);
      if (std::isnan(corners[corner]))
      {
        return false;
      }
    }
    return true;
  }

  /// [lower, upper] within [0, 1], the parameter of the cubic on the stretch [from, to] of the ray.
  void MonotonePiece(double from, double to, const TruthCubic& cubic, double lower, double upper)
  {
    const std::vector<double>& knots = this->Transfer->Knots();
    const double first = cubic(lower);
    const double last = cubic(upper);
    const bool rising = last >= first;
    // Knots strictly between the two values, in the order in which the ray meets them.
    auto low = std::upper_bound(knots.begin(), knots.end(), std::min(first, last));
    auto high = std::lower_bound(low, knots.end(), std::max(first, last));
    double s = lower;
    while (low != high)
    {
      const double knot = rising ? *low++ : *--high;
      const double next = std::clamp(cubic.Solve(knot, s, upper), s, upper);
      this->SmoothPiece(from, to, cubic, s, next);
      s = next;
    }
    this->SmoothPiece(from, to, cubic, s, upper);
  }

  /// No knot inside [lower, upper].
  void SmoothPiece(double from, double to, const TruthCubic& cubic, double lower, double upper)
  {
    if (!(lower < upper) || this->Done())
    {
      return;
    }
    const std::vector<double>& knots = this->Transfer->Knots();
    const double inside = cubic(0.5 * (lower + upper));
    double smallest = inside;
    double largest = inside;
    if (!cubic.IsConstant())
    {
      // Rounding must not carry a value over a knot, where the functions may jump.
      const double infinity = std::numeric_limits<double>::infinity();
      const std::size_t interval = this->Transfer->IntervalOf(inside);
      if (this->Transfer->IsIntervalEmpty(interval))
      {
        return;
      }
      smallest = interval == 0 ? -infinity : std::nextafter(knots[interval - 1], infinity);
      largest = interval == knots.size() ? infinity : std::nextafter(knots[interval], -infinity);
    }
    const double length = this->LengthScale * (to - from);
    const auto value = [&](double s) { return std::clamp(cubic(s), smallest, largest); };
    const auto alpha = [&](double s) { return this->Alpha(value(s), this->Difference(s)); };
    const auto medium = [&](double s)
    {
      TruthMedium result;
      const double v = value(s);
      result.Sigma = length * this->Transfer->Extinction(alpha(s));
      if (this->OpacityByGradient && result.Sigma > 0)
      {
        result.Sigma *= this->GradientOpacity(this->Difference(s));
      }
      if (result.Sigma > 0)
      {
        result.Color = this->Color(v, this->Difference(s), from + s * (to - from));
      }
      return result;
    };
    for (const double cut : this->Kinks(lower, upper))
    {
      const double middle = 0.5 * (lower + cut);
      if (alpha(middle) >= 1 && this->GradientOpacity(this->Difference(middle)) > 0)
      {
        // Just behind the beginning: at it, a jump of the colour belongs to either side.
        const double s = lower + 1e-12 * (cut - lower);
        this->HitWall(this->Color(value(s), this->Difference(s), from + s * (to - from)));
        return;
      }
      IntegrateMedium(medium, lower, cut, this->PieceTolerance, this->Light);
      lower = cut;
    }
  }

  /// Each of the six samples of the central differences stays in one cell while the ray is on
  /// [from, to]: the differences are cubics, too.
  void FitDifferences(double from, double to)
  {
    if (!this->NeedsDifferences())
    {
      return;
    }
    std::array<Double3, 4> samples{};
    for (std::size_t i = 0; i < 4; ++i)
    {
      samples[i] = this->DifferenceAt(from + (to - from) * static_cast<double>(i) / 3);
    }
    for (std::size_t axis = 0; axis < 3; ++axis)
    {
      this->Differences[axis] = TruthCubic::FromSamples(
        { samples[0][axis], samples[1][axis], samples[2][axis], samples[3][axis] });
    }
    if (this->OpacityByGradient)
    {
      this->OpacityBends = this->OpacityByGradient->Bends(this->Differences, this->Factor);
    }
    else if (this->Scene.Image)
    {
      this->OpacityBends = this->Scene.Image->Rows().Bends(this->Differences, this->Factor);
    }
  }

  Double3 Difference(double s) const
  {
    return { this->Differences[0](s), this->Differences[1](s), this->Differences[2](s) };
  }

  /// Cuts (lower, upper] where the shading or the gradient's opacity may have kinks; the last cut
  /// is `upper`.
  std::vector<double> Kinks(double lower, double upper) const
  {
    std::vector<double> result;
    for (const double bend : this->OpacityBends)
    {
      if (bend > lower && bend < upper)
      {
        result.push_back(bend);
      }
    }
    if (this->Scene.Shading)
    {
      std::array<double, 4> samples{};
      for (std::size_t i = 0; i < 4; ++i)
      {
        const double s = lower + (upper - lower) * static_cast<double>(i) / 3;
        samples[i] = this->Scene.Shading->Facing(
          this->Shading, this->Volume, this->Level, this->Difference(s));
      }
      const TruthCubic facing = TruthCubic::FromSamples(samples);
      std::array<double, 4> cuts{};
      const auto pieces = static_cast<std::size_t>(facing.MonotonePieces(cuts));
      for (std::size_t i = 0; i < pieces; ++i)
      {
        if (facing(cuts[i]) * facing(cuts[i + 1]) < 0)
        {
          const double cut = lower + (upper - lower) * facing.Solve(0, cuts[i], cuts[i + 1]);
          if (cut > lower && cut < upper)
          {
            result.push_back(cut);
          }
        }
      }
    }
    std::sort(result.begin(), result.end());
    result.push_back(upper);
    return result;
  }

  const TruthScene& Scene;
  const TruthVolume& Volume;
  const TruthTransfer* Transfer;                 // of the voxel's label
  const TruthGradientOpacity* OpacityByGradient; // likewise
  double PieceTolerance;
  Double3 Start{}; // corner coordinates of level 0 at t = 0, and their growth per world length
  Double3 Step{};
  double LengthScale = 1;
  TruthShadingRay Shading;
  Double3 GradientStep{ 1, 1, 1 };
  int Level = 0;
  Double3 Factor{ 1, 1, 1 };     // of the level
  std::array<bool, 6> Clipped{}; // places of central differences that planes cut away
  std::array<TruthCubic, 3> Differences;
  std::vector<double> OpacityBends; // of the gradient, in the piece of the differences
  TruthLight Light;
  bool Wall = false;
};

double DepthOf(const std::vector<double>* opaqueDepth, const TruthCamera& camera, TruthPixel pixel)
{
  if (!opaqueDepth)
  {
    return std::numeric_limits<double>::infinity();
  }
  const auto index = static_cast<std::size_t>(pixel.Y) * static_cast<std::size_t>(camera.Width()) +
    static_cast<std::size_t>(pixel.X);
  assert(index < opaqueDepth->size());
  return (*opaqueDepth)[index];
}

} // namespace

TruthColor IntegratePixel(
  const TruthScene& scene, int x, int y, double offsetX, double offsetY, double opaqueDepth)
{
  return RayIntegrator(scene, scene.Camera.Ray(x, y, offsetX, offsetY)).Run(opaqueDepth);
}

std::vector<TruthLevelSpan> LevelSpans(
  const TruthScene& scene, int x, int y, double offsetX, double offsetY, double opaqueDepth)
{
  return RayIntegrator(scene, scene.Camera.Ray(x, y, offsetX, offsetY)).Levels(opaqueDepth);
}

std::vector<TruthPixel> PixelBox(const TruthCamera& camera, int x, int y, int width, int height)
{
  std::vector<TruthPixel> pixels;
  for (int j = std::max(y, 0); j < std::min(y + height, camera.Height()); ++j)
  {
    for (int i = std::max(x, 0); i < std::min(x + width, camera.Width()); ++i)
    {
      pixels.push_back({ i, j });
    }
  }
  return pixels;
}

std::vector<TruthPixel> AllPixels(const TruthCamera& camera)
{
  return PixelBox(camera, 0, 0, camera.Width(), camera.Height());
}

std::vector<TruthColor> RenderTruth(const TruthScene& scene, const std::vector<TruthPixel>& pixels,
  const std::vector<double>* opaqueDepth)
{
  std::vector<TruthColor> result(pixels.size());
  const auto count = static_cast<std::int64_t>(pixels.size());
#pragma omp parallel for schedule(dynamic, 4)
  for (std::int64_t i = 0; i < count; ++i)
  {
    const TruthPixel pixel = pixels[static_cast<std::size_t>(i)];
    result[static_cast<std::size_t>(i)] =
      IntegratePixel(scene, pixel.X, pixel.Y, 0, 0, DepthOf(opaqueDepth, scene.Camera, pixel));
  }
  return result;
}

TruthEnvelope RenderEnvelope(const TruthScene& scene, const std::vector<TruthPixel>& pixels,
  const std::vector<double>* opaqueDepth)
{
  TruthEnvelope result;
  result.Center.resize(pixels.size());
  result.Min.resize(pixels.size());
  result.Max.resize(pixels.size());
  const auto count = static_cast<std::int64_t>(pixels.size());
#pragma omp parallel for schedule(dynamic, 4)
  for (std::int64_t i = 0; i < count; ++i)
  {
    const auto at = static_cast<std::size_t>(i);
    const TruthPixel pixel = pixels[at];
    const double depth = DepthOf(opaqueDepth, scene.Camera, pixel);
    for (int ray = 0; ray < 9; ++ray)
    {
      // The centre first.
      const int place = (ray + 4) % 9;
      const double offsetX = (place % 3 - 1) / 32.0;
      const int row = place / 3;
      const double offsetY = (row - 1) / 32.0;
      const TruthColor color = IntegratePixel(scene, pixel.X, pixel.Y, offsetX, offsetY, depth);
      if (ray == 0)
      {
        result.Center[at] = result.Min[at] = result.Max[at] = color;
      }
      for (std::size_t c = 0; c < 4; ++c)
      {
        result.Min[at][c] = std::min(result.Min[at][c], color[c]);
        result.Max[at][c] = std::max(result.Max[at][c], color[c]);
      }
    }
  }
  return result;
}

std::vector<float> ToFloat(const std::vector<TruthColor>& colors)
{
  std::vector<float> result;
  result.reserve(4 * colors.size());
  for (const TruthColor& color : colors)
  {
    for (const double channel : color)
    {
      result.push_back(static_cast<float>(channel));
    }
  }
  return result;
}

} // namespace teravox
