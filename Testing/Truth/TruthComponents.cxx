// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "TruthComponents.h"

#include "TruthCubic.h"
#include "TruthQuadrature.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

namespace teravox
{
namespace
{

constexpr double Opaque = 27.631021115928547; // -ln(1e-12)

/// One ray. Lengths t are world units from the ray's origin, s goes from 0 to 1 through a cell.
class ComponentRay
{
public:
  ComponentRay(const TruthComponents& scene, const TruthRay& ray)
    : Scene(scene)
    , First(*scene.Parts.front())
    , Count(scene.Parts.size())
    , Fields(Count)
    , There(Count)
    , Differences(Count)
    , Bends(Count)
  {
    this->Shading.Ray = ray;
    this->Start = TransformPoint(this->First.Volume.VoxelFromWorld(), ray.Origin);
    this->Step = TransformVector(this->First.Volume.VoxelFromWorld(), ray.Direction);
    this->LengthScale = Length(TransformVector(this->First.LengthFromWorld, ray.Direction));
    double entry = 0;
    for (std::size_t axis = 0; axis < 3; ++axis)
    {
      if (this->Step[axis] != 0)
      {
        const double low = this->First.Volume.BoundsMin()[axis];
        const double high = this->First.Volume.BoundsMax()[axis];
        entry = std::max(
          entry, ((this->Step[axis] > 0 ? low : high) - this->Start[axis]) / this->Step[axis]);
      }
    }
    this->Shading.Entry = ray.At(entry);
  }

  TruthColor Run(const std::vector<TruthLevelSpan>& spans)
  {
    for (const TruthLevelSpan& span : spans)
    {
      this->Level = span.Level;
      this->March(this->Shading.Ray.LengthAtDepth(span.DepthBegin),
        this->Shading.Ray.LengthAtDepth(span.DepthEnd));
    }
    const double alpha = this->Wall ? 1 : -std::expm1(-this->Light.Tau);
    return { this->Light.Color[0], this->Light.Color[1], this->Light.Color[2], alpha };
  }

private:
  bool Done() const { return this->Wall || this->Light.Tau > Opaque; }
  bool IsLinear() const { return this->First.Volume.Interpolation() == TruthInterpolation::Linear; }

  /// Whether a component has an opacity, and whether the knots of its function matter.
  bool Emits(std::size_t c) const
  {
    return this->Scene.Image  ? c == 0
      : this->Scene.Dependent ? c + 1 == this->Count
                              : this->Scene.Weights[c] > 0;
  }
  double WeightOf(std::size_t c) const
  {
    return this->Scene.Image || this->Scene.Dependent ? 1 : this->Scene.Weights[c];
  }
  bool NeedsAll() const { return this->Scene.Image || this->Scene.Dependent; }
  TruthImage::Node ImageAt(double s) const
  {
    return this->Scene.Image->At(this->Fields[0](s), this->Fields[1](s) - this->Scene.Rows.front());
  }
  double AlphaOf(std::size_t c, double s) const
  {
    return this->Scene.Image ? this->ImageAt(s)[3]
                             : this->FunctionOf(c).GetAlpha(this->Fields[c](s));
  }
  /// The function that gives a component's opacity: of dependent ones there is only the first.
  const TruthTransfer& FunctionOf(std::size_t c) const
  {
    return this->Scene.Parts[this->Scene.Dependent ? 0 : c]->Transfer;
  }

  void March(double from, double to)
  {
    const double offset = this->IsLinear() ? 0.5 : 0.0;
    std::vector<double> cuts{ from, to };
    for (std::size_t axis = 0; axis < 3; ++axis)
    {
      const auto factor = static_cast<double>(this->First.Volume.Level(this->Level).Factor[axis]);
      const double a = this->Start[axis] / factor - offset;
      const double b = this->Step[axis] / factor;
      if (b == 0)
      {
        continue;
      }
      const double low = std::min(a + b * from, a + b * to);
      const double high = std::max(a + b * from, a + b * to);
      for (double plane = std::ceil(low); plane <= high; plane += 1)
      {
        cuts.push_back(std::clamp((plane - a) / b, from, to));
      }
      if (this->IsLinear() && this->First.Mask)
      {
        // The mask changes half way between.
        for (double plane = std::ceil(low - 0.5) + 0.5; plane <= high; plane += 1)
        {
          cuts.push_back(std::clamp((plane - a) / b, from, to));
        }
      }
    }
    std::sort(cuts.begin(), cuts.end());
    for (std::size_t i = 1; i < cuts.size() && !this->Done(); ++i)
    {
      if (cuts[i - 1] < cuts[i] && this->IsInMask(0.5 * (cuts[i - 1] + cuts[i])))
      {
        this->Cell(cuts[i - 1], cuts[i]);
      }
    }
  }

  bool IsInMask(double t) const
  {
    const TruthVolume* mask = this->First.Mask;
    return !mask || mask->Field(this->Level, this->Start + t * this->Step) > 0;
  }

  /// No plane of voxel centres (or no face, if the fields are constant in voxels) inside.
  void Cell(double from, double to)
  {
    bool all = true;
    bool seen = false;
    for (std::size_t c = 0; c < this->Count; ++c)
    {
      this->There[c] = this->FindField(c, from, to);
      all = all && this->There[c];
      seen = seen || (this->There[c] && this->Emits(c));
    }
    if (!seen || (this->NeedsAll() && !all))
    {
      return;
    }
    this->FindDifferences(from, to);
    std::vector<double> cuts{ 0, 1 };
    for (std::size_t c = 0; c < this->Count; ++c)
    {
      this->AddKnots(c, cuts);
      this->AddKinks(c, cuts);
    }
    std::sort(cuts.begin(), cuts.end());
    for (std::size_t i = 1; i < cuts.size() && !this->Done(); ++i)
    {
      if (cuts[i - 1] < cuts[i])
      {
        this->Smooth(from, to, cuts[i - 1], cuts[i]);
      }
    }
  }

  bool FindField(std::size_t c, double from, double to)
  {
    const TruthVolume& volume = this->Scene.Parts[c]->Volume;
    Int3 base{};
    Double3 start{};
    Double3 stop{};
    for (std::size_t axis = 0; axis < 3; ++axis)
    {
      const auto factor = static_cast<double>(volume.Level(this->Level).Factor[axis]);
      const double shift = this->IsLinear() ? 0.5 : 0.0;
      const double q0 = (this->Start[axis] + from * this->Step[axis]) / factor - shift;
      const double q1 = (this->Start[axis] + to * this->Step[axis]) / factor - shift;
      const double cell = std::floor(0.5 * (q0 + q1));
      base[axis] = static_cast<std::int64_t>(cell);
      start[axis] = std::clamp(q0 - cell, 0.0, 1.0);
      stop[axis] = std::clamp(q1 - cell, 0.0, 1.0);
    }
    std::array<double, 8> corners{};
    bool has = true;
    for (std::size_t corner = 0; corner < 8; ++corner)
    {
      const auto more = [&](std::size_t axis)
      { return static_cast<std::int64_t>(this->IsLinear() ? corner >> axis & 1 : 0); };
      corners[corner] =
        volume.ClampedVoxel(this->Level, base[0] + more(0), base[1] + more(1), base[2] + more(2));
      has = has && !std::isnan(corners[corner]);
    }
    this->Fields[c] = TruthCubic::FromCell(corners, start, stop);
    return has;
  }

  void FindDifferences(double from, double to)
  {
    for (std::size_t c = 0; c < this->Count; ++c)
    {
      const TruthScene& part = *this->Scene.Parts[c];
      if (!(part.Shading || part.GradientOpacity) || !this->Emits(c))
      {
        continue;
      }
      const Double3 step =
        part.Shading ? part.Shading->GradientStep(part.Volume, this->Level) : Double3{ 1, 1, 1 };
      std::array<Double3, 4> samples{};
      for (std::size_t i = 0; i < 4; ++i)
      {
        // Of a field that is constant in voxels, that of the middle.
        const double s = this->IsLinear() ? static_cast<double>(i) / 3 : 0.5;
        const double t = from + (to - from) * s;
        samples[i] = part.Volume.CentralDifference(this->Level, this->Start + t * this->Step, step);
      }
      for (std::size_t axis = 0; axis < 3; ++axis)
      {
        this->Differences[c][axis] = TruthCubic::FromSamples(
          { samples[0][axis], samples[1][axis], samples[2][axis], samples[3][axis] });
      }
      if (part.GradientOpacity)
      {
        this->Bends[c] = part.GradientOpacity->Bends(this->Differences[c], this->Factor());
      }
    }
  }

  /// Voxels of level 0 per voxel, as all components have them.
  Double3 Factor() const
  {
    const auto& factor = this->First.Volume.Level(this->Level).Factor;
    return { static_cast<double>(factor[0]), static_cast<double>(factor[1]),
      static_cast<double>(factor[2]) };
  }

  /// What the gradient leaves of a component's extinction.
  double GradientShare(std::size_t c, double s) const
  {
    const TruthGradientOpacity* opacity = this->Scene.Parts[c]->GradientOpacity;
    return opacity ? (*opacity)(opacity->Magnitude(this->DifferenceAt(c, s), this->Factor())) : 1;
  }

  Double3 DifferenceAt(std::size_t c, double s) const
  {
    const std::array<TruthCubic, 3>& d = this->Differences[c];
    return { d[0](s), d[1](s), d[2](s) };
  }

  /// Where a component turns, and where it meets a knot.
  void AddKnots(std::size_t c, std::vector<double>& cuts) const
  {
    const bool colors = this->Scene.Dependent && c + 1 < this->Count;
    const TruthCubic& field = this->Fields[c];
    if (!this->There[c] || field.IsConstant() || !(this->Scene.Image || colors || this->Emits(c)))
    {
      return;
    }
    // Red, green and blue are clamped at the ends of their range.
    const std::vector<double> ends{ 0, this->Scene.FullColor };
    const std::vector<double>& knots = this->Scene.Image
      ? (c == 0 ? this->Scene.Image->Envelope().Knots() : this->Scene.Rows)
      : colors && this->Count == 4 ? ends
                                   : this->FunctionOf(c).Knots();
    std::array<double, 4> turns{};
    const int pieces = field.MonotonePieces(turns);
    for (std::size_t i = 0; i < static_cast<std::size_t>(pieces); ++i)
    {
      cuts.push_back(turns[i]);
      const double low = std::min(field(turns[i]), field(turns[i + 1]));
      const double high = std::max(field(turns[i]), field(turns[i + 1]));
      for (auto knot = std::upper_bound(knots.begin(), knots.end(), low);
           knot != knots.end() && *knot < high; ++knot)
      {
        cuts.push_back(std::clamp(field.Solve(*knot, turns[i], turns[i + 1]), 0.0, 1.0));
      }
    }
  }

  /// Where the shading has a kink, or the opacity by gradient.
  void AddKinks(std::size_t c, std::vector<double>& cuts) const
  {
    const TruthScene& part = *this->Scene.Parts[c];
    if (part.GradientOpacity && this->Emits(c) && this->There[c])
    {
      cuts.insert(cuts.end(), this->Bends[c].begin(), this->Bends[c].end());
    }
    if (!part.Shading || !this->Emits(c) || !this->There[c])
    {
      return;
    }
    std::array<double, 4> samples{};
    for (std::size_t i = 0; i < 4; ++i)
    {
      samples[i] = part.Shading->Facing(
        this->Shading, part.Volume, this->Level, this->DifferenceAt(c, static_cast<double>(i) / 3));
    }
    const TruthCubic facing = TruthCubic::FromSamples(samples);
    std::array<double, 4> turns{};
    const auto pieces = static_cast<std::size_t>(facing.MonotonePieces(turns));
    for (std::size_t i = 0; i < pieces; ++i)
    {
      if (facing(turns[i]) * facing(turns[i + 1]) < 0)
      {
        cuts.push_back(std::clamp(facing.Solve(0, turns[i], turns[i + 1]), 0.0, 1.0));
      }
    }
  }

  Double3 ColorAt(std::size_t c, double t, double s) const
  {
    Double3 color{};
    if (this->Scene.Image)
    {
      const TruthImage::Node node = this->ImageAt(s);
      color = { node[0], node[1], node[2] };
    }
    else if (!this->Scene.Dependent)
    {
      color = this->FunctionOf(c).GetColor(this->Fields[c](s));
    }
    else if (this->Count == 2)
    {
      color = this->FunctionOf(0).GetColor(this->Fields[0](s));
    }
    else
    {
      for (std::size_t channel = 0; channel < 3; ++channel)
      {
        color[channel] = std::clamp(this->Fields[channel](s) / this->Scene.FullColor, 0.0, 1.0);
      }
    }
    const TruthScene& part = *this->Scene.Parts[c];
    if (!part.Shading)
    {
      return color;
    }
    TruthShadingRay place = this->Shading;
    place.At = this->Shading.Ray.At(t);
    return part.Shading->Shade(place, part.Volume, this->Level, this->DifferenceAt(c, s), color);
  }

  /// No knot, turn or kink of any component inside [lower, upper].
  void Smooth(double from, double to, double lower, double upper)
  {
    const double middle = 0.5 * (lower + upper);
    double walls = 0;
    double weights = 0;
    Double3 light{};
    for (std::size_t c = 0; c < this->Count; ++c)
    {
      if (this->There[c] && this->Emits(c) && this->AlphaOf(c, middle) >= 1 &&
        this->GradientShare(c, middle) > 0)
      {
        // Just behind the beginning: at it, a jump of the colour belongs to either side.
        const double s = lower + 1e-12 * (upper - lower);
        walls += 1;
        weights += this->WeightOf(c);
        light = light + this->WeightOf(c) * this->ColorAt(c, from + s * (to - from), s);
      }
    }
    if (walls > 0)
    {
      this->Light.Color =
        this->Light.Color + std::exp(-this->Light.Tau) * (weights / walls) * light;
      this->Wall = true;
      return;
    }
    const double length = this->LengthScale * (to - from);
    const auto medium = [&](double s)
    {
      TruthMedium result;
      double total = 0;
      double squares = 0;
      Double3 emission{};
      for (std::size_t c = 0; c < this->Count; ++c)
      {
        if (!this->There[c] || !this->Emits(c))
        {
          continue;
        }
        const TruthTransfer& function = this->FunctionOf(c);
        const double sigma = function.Extinction(this->AlphaOf(c, s)) * this->GradientShare(c, s);
        if (sigma > 0)
        {
          total += this->WeightOf(c) * sigma;
          squares += sigma * sigma;
          emission =
            emission + this->WeightOf(c) * sigma * this->ColorAt(c, from + s * (to - from), s);
        }
      }
      if (total > 0)
      {
        result.Sigma = length * squares / total;
        result.Color = (total / squares) * emission;
      }
      return result;
    };
    IntegrateMedium(medium, lower, upper, 1e-3 * this->First.Tolerance, this->Light);
  }

  const TruthComponents& Scene;
  const TruthScene& First;
  std::size_t Count;
  std::vector<TruthCubic> Fields; // of the cell under way
  std::vector<bool> There;        // no NaN
  std::vector<std::array<TruthCubic, 3>> Differences;
  std::vector<std::vector<double>> Bends; // of opacities by gradient
  TruthShadingRay Shading;
  Double3 Start{}; // corner coordinates of level 0 at t = 0, and their growth per world length
  Double3 Step{};
  double LengthScale = 1;
  int Level = 0;
  TruthLight Light;
  bool Wall = false;
};
} // namespace

TruthColor IntegrateComponents(
  const TruthComponents& scene, int x, int y, double offsetX, double offsetY)
{
  const TruthScene& first = *scene.Parts.front();
  return ComponentRay(scene, first.Camera.Ray(x, y, offsetX, offsetY))
    .Run(LevelSpans(first, x, y, offsetX, offsetY));
}

std::vector<TruthColor> RenderComponents(
  const TruthComponents& scene, const std::vector<TruthPixel>& pixels)
{
  std::vector<TruthColor> result(pixels.size());
  const auto count = static_cast<std::int64_t>(pixels.size());
#pragma omp parallel for schedule(dynamic, 4)
  for (std::int64_t i = 0; i < count; ++i)
  {
    const auto at = static_cast<std::size_t>(i);
    result[at] = IntegrateComponents(scene, pixels[at].X, pixels[at].Y);
  }
  return result;
}

TruthEnvelope RenderComponentEnvelope(
  const TruthComponents& scene, const std::vector<TruthPixel>& pixels)
{
  TruthEnvelope result;
  result.Center = RenderComponents(scene, pixels);
  result.Min = result.Max = result.Center;
  const auto count = static_cast<std::int64_t>(pixels.size());
#pragma omp parallel for schedule(dynamic, 4)
  for (std::int64_t i = 0; i < count; ++i)
  {
    const auto at = static_cast<std::size_t>(i);
    for (int ray = 0; ray < 9; ++ray)
    {
      if (ray == 4)
      {
        continue;
      }
      const TruthColor color = IntegrateComponents(
        scene, pixels[at].X, pixels[at].Y, (ray % 3 - 1) / 32.0, (ray / 3 - 1) / 32.0);
      for (std::size_t c = 0; c < 4; ++c)
      {
        result.Min[at][c] = std::min(result.Min[at][c], color[c]);
        result.Max[at][c] = std::max(result.Max[at][c], color[c]);
      }
    }
  }
  return result;
}

} // namespace teravox
