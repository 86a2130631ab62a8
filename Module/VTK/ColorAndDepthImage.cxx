// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "ColorAndDepthImage.h"

#include "vtkDataArray.h"
#include "vtkImageData.h"
#include "vtkPointData.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>

namespace teravox
{

namespace
{
// The depth at which a ray that sees the volume's box leaves it, or meets the far plane; nothing if
// it misses the box or opaque geometry lies before it.
std::optional<double> LeavesBox(const SeenVolume& volume, int column, int row)
{
  const FirstHits& hits = volume.Hits;
  const ViewInput& camera = volume.Camera;
  const ViewGeometry& geometry = *hits.Geometry;
  const double x = column + 0.5;
  const double y = row + 0.5;
  const MarchParameters& p = geometry.Parameters;
  double first = static_cast<double>(geometry.Intervals.Near);
  double last = static_cast<double>(geometry.Intervals.Far);
  for (std::size_t a = 0; a < 3; ++a)
  {
    const auto at = [&](const std::array<MarchParameters::Vec, 3>& v)
    {
      return static_cast<double>(v[0][a]) + static_cast<double>(v[1][a]) * x +
        static_cast<double>(v[2][a]) * y;
    };
    const double origin = at(p.RayOrigin);
    const double direction = at(p.RayDirection);
    const double low = (static_cast<double>(geometry.Intervals.BoxLow[a]) - origin) / direction;
    const double high = (static_cast<double>(geometry.Intervals.BoxHigh[a]) - origin) / direction;
    // NaN, of a ray in a face of the box, changes nothing.
    first = std::max(first, std::min(low, high));
    last = std::min(last, std::max(low, high));
  }
  const std::size_t pixel = static_cast<std::size_t>(row) * static_cast<std::size_t>(camera.Width) +
    static_cast<std::size_t>(column);
  const bool hidden = !hits.Opaque.empty() &&
    geometry.WindowOfDepth(camera, x, y, first) >= static_cast<double>(hits.Opaque[pixel]);
  return first < last && !hidden ? std::optional<double>(last) : std::nullopt;
}

template <typename T>
void FillDepths(T* out, const std::vector<double>& depths)
{
  constexpr double most =
    std::numeric_limits<T>::is_integer ? static_cast<double>(std::numeric_limits<T>::max()) : 1.0;
  for (std::size_t i = 0; i < depths.size(); ++i)
  {
    const double scaled = std::clamp(depths[i], 0.0, 1.0) * most;
    out[i] = static_cast<T>(std::numeric_limits<T>::is_integer ? std::floor(scaled + 0.5) : scaled);
  }
}

void Allocate(vtkImageData* image, const ViewInput& camera, int type, int components)
{
  image->SetExtent(0, camera.Width - 1, 0, camera.Height - 1, 0, 0);
  image->SetOrigin(0, 0, 0);
  image->SetSpacing(1, 1, 1);
  image->AllocateScalars(type, components);
}
} // namespace

void FillColorImage(vtkImageData* image, const std::vector<float>& colors,
  const std::vector<SeenVolume>& volumes, const Composition& how)
{
  const ViewInput& camera = volumes.front().Camera;
  Allocate(image, camera, VTK_UNSIGNED_CHAR, 4);
  auto* out = static_cast<std::uint8_t*>(image->GetScalarPointer());
  const auto byte = [](float c)
  { return static_cast<std::uint8_t>(std::lround(std::clamp(c, 0.0f, 1.0f) * 255.0f)); };
  std::size_t i = 0;
  for (int y = 0; y < camera.Height; ++y)
  {
    for (int x = 0; x < camera.Width; ++x, i += 4)
    {
      const float alpha = colors[i + 3];
      const bool seen = alpha > 0 ||
        std::any_of(volumes.begin(), volumes.end(),
          [&](const SeenVolume& volume) { return LeavesBox(volume, x, y).has_value(); });
      for (std::size_t c = 0; c < 3; ++c)
      {
        out[i + c] = seen ? byte(colors[i + c] * how.Scale + how.Bias * alpha) : 255;
      }
      out[i + 3] = byte(alpha);
    }
  }
}

void FillDepthImage(
  vtkImageData* image, const std::vector<SeenVolume>& volumes, int scalarType, bool backface)
{
  const ViewInput& camera = volumes.front().Camera;
  std::vector<double> depths;
  depths.reserve(volumes.front().Hits.DepthAndLevel.size() / 2);
  for (int y = 0; y < camera.Height; ++y)
  {
    for (int x = 0; x < camera.Width; ++x)
    {
      std::optional<double> first;
      std::optional<double> last;
      for (const SeenVolume& volume : volumes)
      {
        const auto inWindow = [&](double depth)
        { return volume.Hits.Geometry->WindowOfDepth(volume.Camera, x + 0.5, y + 0.5, depth); };
        const float hit = volume.Hits.DepthAndLevel[2 * depths.size()];
        if (hit < NativeView::NoHit)
        {
          first = std::min(first.value_or(1.0), inWindow(static_cast<double>(hit)));
        }
        if (const auto leaves = backface ? LeavesBox(volume, x, y) : std::nullopt)
        {
          last = std::max(last.value_or(0.0), inWindow(*leaves));
        }
      }
      depths.push_back(first.value_or(last.value_or(1.0)));
    }
  }
  const bool isInteger = scalarType == VTK_UNSIGNED_CHAR || scalarType == VTK_UNSIGNED_SHORT;
  Allocate(image, camera, isInteger ? scalarType : VTK_FLOAT, 1);
  void* out = image->GetScalarPointer();
  if (scalarType == VTK_UNSIGNED_CHAR)
  {
    FillDepths(static_cast<std::uint8_t*>(out), depths);
  }
  else if (scalarType == VTK_UNSIGNED_SHORT)
  {
    FillDepths(static_cast<std::uint16_t*>(out), depths);
  }
  else
  {
    FillDepths(static_cast<float*>(out), depths);
  }
}

} // namespace teravox
