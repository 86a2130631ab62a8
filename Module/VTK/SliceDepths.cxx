// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "SliceDepths.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vtkImplicitFunction.h>
#include <vtkPlane.h>

namespace teravox
{

namespace
{
constexpr int PlacesAlong = 256;
constexpr int Halvings = 50;

// A ray between the near plane (0) and the far plane (1).
struct Segment
{
  Double3 From;
  Double3 To;
  Double3 At(double u) const
  {
    Double3 p{};
    for (std::size_t a = 0; a < 3; ++a)
    {
      p[a] = this->From[a] + u * (this->To[a] - this->From[a]);
    }
    return p;
  }
};

// The part of it in a box, a little widened.
bool CutToBox(const Segment& s, const std::array<double, 6>& box, double& first, double& last)
{
  first = 0;
  last = 1;
  for (std::size_t a = 0; a < 3; ++a)
  {
    const double wider = 1e-3 * (box[2 * a + 1] - box[2 * a]);
    const double low = box[2 * a] - wider;
    const double high = box[2 * a + 1] + wider;
    const double d = s.To[a] - s.From[a];
    if (d == 0)
    {
      first = s.From[a] < low || s.From[a] > high ? 2 : first;
      continue;
    }
    const double u = (low - s.From[a]) / d;
    const double v = (high - s.From[a]) / d;
    first = std::max(first, std::min(u, v));
    last = std::min(last, std::max(u, v));
  }
  return first < last;
}

double ValueAt(vtkImplicitFunction* function, const Segment& s, double u)
{
  Double3 p = s.At(u);
  return function->FunctionValue(p.data());
}

// Where on it the function is 0 first; NaN for nowhere.
double FindZero(vtkImplicitFunction* function, const Segment& s, double first, double last)
{
  double u = first;
  double before = ValueAt(function, s, u);
  for (int i = 1; i <= PlacesAlong && before != 0; ++i)
  {
    double v = first + (last - first) * i / PlacesAlong;
    double value = ValueAt(function, s, v);
    if ((before > 0) == (value > 0) && value != 0)
    {
      u = v;
      before = value;
      continue;
    }
    for (int h = 0; h < Halvings && value != 0; ++h)
    {
      const double middle = 0.5 * (u + v);
      const double there = ValueAt(function, s, middle);
      const bool same = (before > 0) == (there > 0) && there != 0;
      (same ? u : v) = middle;
    }
    return v;
  }
  return before == 0 ? u : std::numeric_limits<double>::quiet_NaN();
}
} // namespace

Result<std::shared_ptr<const std::vector<double>>> SliceDepths::Find(
  const ViewInput& camera, vtkImplicitFunction* function, const std::array<double, 6>& bounds)
{
  if (this->Depths && this->Function == function && this->FunctionTime == function->GetMTime() &&
    this->Bounds == bounds && this->ViewFromWorld == camera.ViewFromWorld &&
    this->ClipFromView == camera.ClipFromView && this->Width == camera.Width &&
    this->Height == camera.Height)
  {
    return this->Depths;
  }
  const auto worldFromClip =
    InvertMatrix(MultiplyMatrices(camera.ClipFromView, camera.ViewFromWorld));
  if (!worldFromClip)
  {
    return worldFromClip.GetStatus();
  }
  const bool plane = vtkPlane::SafeDownCast(function) != nullptr && !function->GetTransform();
  auto depths = std::make_shared<std::vector<double>>();
  depths->reserve(static_cast<std::size_t>(camera.Width) * static_cast<std::size_t>(camera.Height));
  for (int y = 0; y < camera.Height; ++y)
  {
    for (int x = 0; x < camera.Width; ++x)
    {
      const double ndcX = 2 * (x + 0.5) / camera.Width - 1;
      const double ndcY = 2 * (y + 0.5) / camera.Height - 1;
      const Segment s{ ApplyToPoint(worldFromClip.Value(), { ndcX, ndcY, -1 }),
        ApplyToPoint(worldFromClip.Value(), { ndcX, ndcY, 1 }) };
      double u = std::numeric_limits<double>::quiet_NaN();
      double first = 0;
      double last = 1;
      if (plane)
      {
        const double from = ValueAt(function, s, 0);
        const double to = ValueAt(function, s, 1);
        u = from / (from - to); // NaN or infinite where the ray runs along the plane
      }
      else if (CutToBox(s, bounds, first, last))
      {
        u = FindZero(function, s, first, last);
      }
      const double depth = -ApplyToPoint(camera.ViewFromWorld, s.At(u))[2];
      depths->push_back(u >= 0 && u <= 1 ? depth : std::numeric_limits<double>::quiet_NaN());
    }
  }
  this->Depths = std::move(depths);
  this->Function = function;
  this->FunctionTime = function->GetMTime();
  this->Bounds = bounds;
  this->ViewFromWorld = camera.ViewFromWorld;
  this->ClipFromView = camera.ClipFromView;
  this->Width = camera.Width;
  this->Height = camera.Height;
  return this->Depths;
}

} // namespace teravox
