// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Where a ray is cut by clipping planes and by the planes of cropping, and where it meets a slice
// (Shaders/Intervals.frag, Shaders/Library/Cut.glsl).

// Shortens an interval by the clipping planes, at pixel (x, y).
inline void ClipInterval(const NativeScene& scene, float x, float y, float& first, float& last)
{
  for (int i = 0; i < scene.NumberOfPlanes; ++i)
  {
    const float* w = scene.Planes + 8 * i;
    const float from = (w[0] + w[1] * x) + w[2] * y;
    const float slope = (w[4] + w[5] * x) + w[6] * y;
    if (slope > 0.0f)
    {
      first = Max(first, -from / slope);
    }
    else if (slope < 0.0f)
    {
      last = Min(last, -from / slope);
    }
    else if (from < 0.0f)
    {
      last = first;
    }
  }
}

inline int IntervalCount(const MarchParameters& p)
{
  return p.Switches[3] == 0 ? 1 : static_cast<int>(shared::CROP_INTERVALS);
}

// The stretch of a ray's interval with this number in regions that are kept; none where it ends
// before it begins. Regions one behind the other are one stretch.
inline void KeepInterval(
  const MarchParameters& p, const Ray& ray, int number, float& first, float& last)
{
  const std::uint32_t regions = p.Switches[3];
  if (regions == 0)
  {
    return;
  }
  float near[3];
  float far[3];
  bool up[3];
  float direction[3];
  float largest = 0;
  for (std::size_t a = 0; a < 3; ++a)
  {
    direction[a] = Dot(p.Crop[a], ray.Direction);
    largest = Max(largest, direction[a] < 0.0f ? -direction[a] : direction[a]);
  }
  for (std::size_t a = 0; a < 3; ++a)
  {
    const float o = Dot(p.Crop[a], ray.Origin);
    float d = direction[a];
    // As in MakeRay: what runs along a plane meets it very far away.
    const float tiny = 1.0e-12f * largest;
    d = (d < 0.0f ? -d : d) < tiny ? tiny : d;
    up[a] = d > 0.0f;
    const float lower = (p.Crop[3][a] - o) / d;
    const float upper = (p.Crop[4][a] - o) / d;
    near[a] = up[a] ? lower : upper;
    far[a] = up[a] ? upper : lower;
  }
  float begin = 0;
  float end = -FarAway;
  int count = 0;
  bool inside = false;
  for (float t = first; t < last;)
  {
    int region = 0;
    float next = last;
    int weight = 1;
    for (int a = 0; a < 3; ++a)
    {
      const int passed = (near[a] <= t ? 1 : 0) + (far[a] <= t ? 1 : 0);
      region += weight * (up[a] ? passed : 2 - passed);
      weight *= 3;
      next = near[a] > t ? Min(next, near[a]) : next;
      next = far[a] > t ? Min(next, far[a]) : next;
    }
    const bool now = (regions >> region & 1u) != 0;
    count += now && !inside ? 1 : 0;
    if (now && count == number + 1)
    {
      begin = inside ? begin : t;
      end = next;
    }
    inside = now;
    t = next;
  }
  first = begin;
  last = end;
}

constexpr float SliceReach = 1.0e-3f;  // voxels
constexpr float SliceLength = 2.4e-7f; // share of its depth

// The place where a ray meets the slice, as an interval that is as short as floats allow. Faces of
// the volume count, whatever side of them rounding puts the slice on.
inline bool NarrowToSlice(
  const NativeScene& scene, const Ray& ray, std::size_t pixel, float& first, float& last)
{
  const float at = scene.Depth[pixel];
  const Quad d = ray.Direction;
  const float near = SliceReach / SquareRoot((d[0] * d[0] + d[1] * d[1]) + d[2] * d[2]);
  if (!(at >= first - near && at <= last + near && first < last))
  {
    return false;
  }
  const float begin = Max(Min(at, last - Abs(last) * SliceLength), first);
  last = Min(last, begin + Max(Abs(begin) * SliceLength, 1.0e-30f));
  first = begin;
  return first < last;
}
