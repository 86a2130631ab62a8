// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "ViewGeometry.h"

#include "BlockSplit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

namespace teravox
{

Matrix4 MultiplyMatrices(const Matrix4& a, const Matrix4& b)
{
  Matrix4 c{};
  for (std::size_t i = 0; i < 4; ++i)
  {
    for (std::size_t j = 0; j < 4; ++j)
    {
      for (std::size_t k = 0; k < 4; ++k)
      {
        c[4 * i + j] += a[4 * i + k] * b[4 * k + j];
      }
    }
  }
  return c;
}

Result<Matrix4> InvertMatrix(const Matrix4& m)
{
  // Gauss-Jordan with row pivoting; rows are scaled first, because world units may be metres or
  // nanometres.
  Matrix4 a = m;
  Matrix4 inverse{ 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1 };
  for (std::size_t column = 0; column < 4; ++column)
  {
    std::size_t pivot = column;
    for (std::size_t r = column; r < 4; ++r)
    {
      if (std::abs(a[4 * r + column]) > std::abs(a[4 * pivot + column]))
      {
        pivot = r;
      }
    }
    const double p = a[4 * pivot + column];
    if (p == 0 || !std::isfinite(p))
    {
      return Status(StatusCode::InvalidArgument,
        "The matrix from voxels to the world, or that of the camera, is singular.");
    }
    for (std::size_t j = 0; j < 4; ++j)
    {
      std::swap(a[4 * pivot + j], a[4 * column + j]);
      std::swap(inverse[4 * pivot + j], inverse[4 * column + j]);
    }
    for (std::size_t j = 0; j < 4; ++j)
    {
      a[4 * column + j] /= p;
      inverse[4 * column + j] /= p;
    }
    for (std::size_t r = 0; r < 4; ++r)
    {
      const double f = a[4 * r + column];
      if (r == column || f == 0)
      {
        continue;
      }
      for (std::size_t j = 0; j < 4; ++j)
      {
        a[4 * r + j] -= f * a[4 * column + j];
        inverse[4 * r + j] -= f * inverse[4 * column + j];
      }
    }
  }
  return inverse;
}

Double3 ApplyToPoint(const Matrix4& m, const Double3& p)
{
  std::array<double, 4> r{};
  for (std::size_t i = 0; i < 4; ++i)
  {
    r[i] = m[4 * i] * p[0] + m[4 * i + 1] * p[1] + m[4 * i + 2] * p[2] + m[4 * i + 3];
  }
  return { r[0] / r[3], r[1] / r[3], r[2] / r[3] };
}

Double3 ApplyToVector(const Matrix4& m, const Double3& v)
{
  Double3 r{};
  for (std::size_t i = 0; i < 3; ++i)
  {
    r[i] = m[4 * i] * v[0] + m[4 * i + 1] * v[1] + m[4 * i + 2] * v[2];
  }
  return r;
}

namespace
{
double Length(const Double3& v)
{
  return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

MarchParameters::Vec ToFloat(const Double3& v)
{
  return { static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2]), 0.0f };
}

// Rays in view space: origin at view depth 0 and direction per unit of depth.
struct ViewRay
{
  Double3 Origin;
  Double3 Direction;
};

ViewRay RayThrough(const Matrix4& viewFromClip, double x, double y)
{
  const Double3 a = ApplyToPoint(viewFromClip, { x, y, -1 });
  const Double3 b = ApplyToPoint(viewFromClip, { x, y, 1 });
  const double depth = a[2] - b[2];
  ViewRay ray;
  for (std::size_t i = 0; i < 3; ++i)
  {
    ray.Direction[i] = (b[i] - a[i]) / depth;
    ray.Origin[i] = a[i] + ray.Direction[i] * a[2]; // a lies at depth -a[2]
  }
  return ray;
}

LevelDepths ComputeLevels(const PyramidLayout& layout, const ViewInput& input, const Double3& edges,
  double widthAt0, double widthPerDepth)
{
  LevelDepths levels;
  const int last = layout.NumberOfLevels() - 1;
  levels.Minimum = std::clamp(input.MinimumLevel, 0, last);
  levels.Maximum = std::clamp(input.MaximumLevel, levels.Minimum, last);
  levels.Start.fill(std::numeric_limits<double>::infinity());
  const double bias = std::exp2(input.LevelBias);
  for (int l = 0; l <= levels.Maximum; ++l)
  {
    double edge = 0;
    for (std::size_t a = 0; a < 3; ++a)
    {
      if (layout.Factor(l)[a] > 1)
      {
        edge = std::max(edge, edges[a] * static_cast<double>(layout.Factor(l)[a]));
      }
    }
    double& start = levels.Start[static_cast<std::size_t>(l)];
    if (l <= levels.Minimum || edge <= widthAt0 * bias)
    {
      start = -std::numeric_limits<double>::infinity();
    }
    else if (widthPerDepth > 0)
    {
      start = (edge / bias - widthAt0) / widthPerDepth;
    }
  }
  if (widthPerDepth == 0)
  {
    while (levels.Start[static_cast<std::size_t>(levels.Maximum)] > 0)
    {
      --levels.Maximum;
    }
    levels.Minimum = levels.Maximum;
  }
  return levels;
}

// The pixels that can see a box of voxels: all of them where a corner lies beside or behind the
// eye.
std::array<int, 4> VisibleRectangle(
  const ViewInput& input, const Matrix4& worldFromVoxel, const VoxelBox& box)
{
  if (box.IsEmpty())
  {
    return {};
  }
  const Matrix4 clipFromVoxel =
    MultiplyMatrices(input.ClipFromView, MultiplyMatrices(input.ViewFromWorld, worldFromVoxel));
  const std::array<int, 2> size{ input.Width, input.Height };
  std::array<double, 2> low{ 1, 1 };
  std::array<double, 2> high{ -1, -1 };
  for (int i = 0; i < 8; ++i)
  {
    const std::array<double, 4> corner{ static_cast<double>(i & 1 ? box.High[0] : box.Low[0]),
      static_cast<double>(i & 2 ? box.High[1] : box.Low[1]),
      static_cast<double>(i & 4 ? box.High[2] : box.Low[2]), 1 };
    std::array<double, 4> clip{};
    for (std::size_t r = 0; r < 4; ++r)
    {
      for (std::size_t c = 0; c < 4; ++c)
      {
        clip[r] += clipFromVoxel[4 * r + c] * corner[c];
      }
    }
    const bool before = clip[3] > 1e-6 * (std::abs(clip[0]) + std::abs(clip[1]));
    for (std::size_t a = 0; a < 2; ++a)
    {
      low[a] = std::min(low[a], before ? clip[a] / clip[3] : -1.0);
      high[a] = std::max(high[a], before ? clip[a] / clip[3] : 1.0);
    }
  }
  std::array<int, 4> pixels{};
  for (std::size_t a = 0; a < 2; ++a)
  {
    // A pixel more on each side: rays are rounded to floats.
    const auto pixel = [&](double ndc) { return 0.5 * (std::clamp(ndc, -1.0, 1.0) + 1) * size[a]; };
    pixels[a] = std::max(static_cast<int>(std::floor(pixel(low[a]))) - 1, 0);
    pixels[a + 2] = std::min(static_cast<int>(std::ceil(pixel(high[a]))) + 1, size[a]);
  }
  return pixels;
}

BrickBox Intersect(const BrickBox& a, const BrickBox& b)
{
  BrickBox both = a;
  bool met = true;
  for (std::size_t i = 0; i < 3; ++i)
  {
    both.Low[i] = std::max(a.Low[i], b.Low[i]);
    both.High[i] = std::min(a.High[i], b.High[i]);
    met = met && both.Low[i] < both.High[i];
  }
  return met ? both : BrickBox{ { 0, 0, 0 }, { 0, 0, 0 } };
}

// The bricks that rays may meet in a block, per level: between the nearest and the farthest depth,
// each level up to where it ends. It may be an ancestor of all that lies before.
std::vector<BrickBox> BricksInView(const PyramidLayout& layout, const LevelDepths& levels,
  const std::array<ViewRay, 4>& corners, const Matrix4& voxelFromView, double nearest,
  double farthest, const VoxelBox& block)
{
  std::vector<BrickBox> boxes;
  double end = -std::numeric_limits<double>::infinity();
  for (int l = 0; l < layout.NumberOfLevels(); ++l)
  {
    end = l < levels.Maximum ? std::max(end, levels.Start[static_cast<std::size_t>(l) + 1])
                             : std::numeric_limits<double>::infinity();
    Double3 low{};
    Double3 high{};
    low.fill(std::numeric_limits<double>::infinity());
    high.fill(-std::numeric_limits<double>::infinity());
    for (const ViewRay& ray : corners)
    {
      for (const double depth : { nearest, std::min(farthest, end) })
      {
        Double3 p = ray.Origin;
        for (std::size_t a = 0; a < 3; ++a)
        {
          p[a] += ray.Direction[a] * depth;
        }
        p = ApplyToPoint(voxelFromView, p);
        for (std::size_t a = 0; a < 3; ++a)
        {
          low[a] = std::min(low[a], p[a]);
          high[a] = std::max(high[a], p[a]);
        }
      }
    }
    BrickBox box{ { 0, 0, 0 }, { 0, 0, 0 } };
    for (std::size_t a = 0; a < 3 && nearest <= std::min(farthest, end); ++a)
    {
      // A brick more on each side: the rays' positions are floats, and what lies beside the volume
      // counts as its outermost bricks.
      const double edge = static_cast<double>(layout.BrickSize() * layout.Factor(l)[a]);
      const auto last = static_cast<double>(layout.Bricks(l)[a] - 1);
      box.Low[a] = static_cast<std::int64_t>(std::clamp(std::floor(low[a] / edge) - 1, 0.0, last));
      box.High[a] =
        static_cast<std::int64_t>(std::clamp(std::floor(high[a] / edge) + 1, 0.0, last)) + 1;
    }
    boxes.push_back(Intersect(box, BricksOfBlock(layout, l, block)));
  }
  return boxes;
}
} // namespace

Double3 ViewGeometry::PointInView(double x, double y, double depth) const
{
  const auto& o = this->Rays.Origin;
  const auto& d = this->Rays.Direction;
  Double3 p{};
  for (std::size_t a = 0; a < 3; ++a)
  {
    p[a] = o[0][a] + o[1][a] * x + o[2][a] * y + depth * (d[0][a] + d[1][a] * x + d[2][a] * y);
  }
  return p;
}

namespace
{
// z and w in clip space.
std::array<double, 2> ClipDepth(const Matrix4& clipFromView, const Double3& p)
{
  const auto row = [&](std::size_t r)
  {
    return clipFromView[r] * p[0] + clipFromView[r + 1] * p[1] + clipFromView[r + 2] * p[2] +
      clipFromView[r + 3];
  };
  return { row(8), row(12) };
}
} // namespace

DepthRange ViewDepthsOf(const ViewInput& camera, const Int3& voxels)
{
  const Matrix4 viewFromVoxel = MultiplyMatrices(
    camera.ViewFromWorld, MultiplyMatrices(camera.WorldFromDataset, camera.DatasetFromVoxel));
  DepthRange range{ std::numeric_limits<double>::infinity(),
    -std::numeric_limits<double>::infinity() };
  for (int corner = 0; corner < 8; ++corner)
  {
    Double3 p{};
    for (std::size_t a = 0; a < 3; ++a)
    {
      p[a] = (corner >> a & 1) != 0 ? static_cast<double>(voxels[a]) : 0.0;
    }
    const double depth = -ApplyToPoint(viewFromVoxel, p)[2];
    range.Near = std::min(range.Near, depth);
    range.Far = std::max(range.Far, depth);
  }
  return range;
}

double ViewGeometry::WindowOfDepth(const ViewInput& camera, double x, double y, double depth) const
{
  const auto [z, w] = ClipDepth(camera.ClipFromView, this->PointInView(x, y, depth));
  return 0.5 * (z / w + 1);
}

double ViewGeometry::DepthOfWindow(const ViewInput& camera, double x, double y, double window) const
{
  // Both are linear in the depth.
  const auto [z0, w0] = ClipDepth(camera.ClipFromView, this->PointInView(x, y, 0));
  const auto [z1, w1] = ClipDepth(camera.ClipFromView, this->PointInView(x, y, 1));
  const double ndc = 2 * window - 1;
  return (z0 - ndc * w0) / (ndc * (w1 - w0) - (z1 - z0));
}

Result<ViewGeometry> ViewGeometry::Make(const PyramidLayout& layout, const ViewInput& input)
{
  const auto viewFromClip = InvertMatrix(input.ClipFromView);
  const auto worldFromView = InvertMatrix(input.ViewFromWorld);
  const Matrix4 worldFromVoxel = MultiplyMatrices(input.WorldFromDataset, input.DatasetFromVoxel);
  const auto voxelFromWorld = InvertMatrix(worldFromVoxel);
  const auto voxelFromDataset = InvertMatrix(input.DatasetFromVoxel);
  const auto datasetFromWorld = InvertMatrix(input.WorldFromDataset);
  for (const auto* m :
    { &viewFromClip, &worldFromView, &voxelFromWorld, &voxelFromDataset, &datasetFromWorld })
  {
    if (!*m)
    {
      return m->GetStatus();
    }
  }
  ViewGeometry g;
  const Matrix4 voxelFromView = MultiplyMatrices(voxelFromWorld.Value(), worldFromView.Value());
  const Int3& dims = layout.Dimensions(0);

  // Everything about a ray is affine in the pixel.
  const auto ndc = [&](double px, double py)
  { return RayThrough(viewFromClip.Value(), 2 * px / input.Width - 1, 2 * py / input.Height - 1); };
  const ViewRay corner = ndc(0, 0);
  const ViewRay alongX = ndc(input.Width, 0);
  const ViewRay alongY = ndc(0, input.Height);
  const ViewRay center = ndc(0.5 * input.Width, 0.5 * input.Height);
  const Matrix4& p = input.ClipFromView;
  const bool parallel = p[12] == 0 && p[13] == 0 && p[14] == 0;

  double boxNear = std::numeric_limits<double>::infinity();
  double boxFar = -std::numeric_limits<double>::infinity();
  for (int i = 0; i < 8; ++i)
  {
    const Double3 voxel{ i & 1 ? static_cast<double>(dims[0]) : 0.0,
      i & 2 ? static_cast<double>(dims[1]) : 0.0, i & 4 ? static_cast<double>(dims[2]) : 0.0 };
    const Double3 view = ApplyToPoint(MultiplyMatrices(input.ViewFromWorld, worldFromVoxel), voxel);
    boxNear = std::min(boxNear, -view[2]);
    boxFar = std::max(boxFar, -view[2]);
  }
  const double nearDepth = -ApplyToPoint(viewFromClip.Value(), { 0, 0, -1 })[2];
  const double farDepth = -ApplyToPoint(viewFromClip.Value(), { 0, 0, 1 })[2];
  // Rays may start far from what they show, in parallel projection and with a small view angle:
  // depth is counted from the volume, so that floats hold places in it.
  g.DepthOrigin = std::clamp(boxNear, nearDepth, farDepth);

  const auto originAt = [&](const ViewRay& ray)
  {
    Double3 o = ray.Origin;
    for (std::size_t a = 0; a < 3; ++a)
    {
      o[a] += ray.Direction[a] * g.DepthOrigin;
    }
    return ApplyToPoint(voxelFromView, o);
  };
  const Double3 middle = originAt(center);
  Double3 anchor{};
  for (std::size_t a = 0; a < 3; ++a)
  {
    anchor[a] = std::clamp(std::floor(middle[a]), 0.0, static_cast<double>(dims[a] - 1));
    g.Parameters.Anchor[a] = static_cast<std::uint32_t>(anchor[a]);
    g.Parameters.Dimensions[a] = static_cast<std::uint32_t>(dims[a]);
  }
  const auto difference = [](const Double3& a, const Double3& b, double by) {
    return Double3{ (a[0] - b[0]) / by, (a[1] - b[1]) / by, (a[2] - b[2]) / by };
  };
  const double w = input.Width;
  const double h = input.Height;
  const Double3 o = originAt(corner);
  g.Parameters.RayOrigin = { ToFloat(difference(o, anchor, 1)),
    ToFloat(difference(originAt(alongX), o, w)), ToFloat(difference(originAt(alongY), o, h)) };
  const Double3 d = ApplyToVector(voxelFromView, corner.Direction);
  g.Parameters.RayDirection = { ToFloat(d),
    ToFloat(difference(ApplyToVector(voxelFromView, alongX.Direction), d, w)),
    ToFloat(difference(ApplyToVector(voxelFromView, alongY.Direction), d, h)) };
  // Optical depth counts lengths in dataset space, as VTK does: a prop that is scaled keeps its
  // look.
  const Matrix4 datasetFromView = MultiplyMatrices(datasetFromWorld.Value(), worldFromView.Value());
  const Double3 v = ApplyToVector(datasetFromView, corner.Direction);
  g.Parameters.RayWorld = { ToFloat(v),
    ToFloat(difference(ApplyToVector(datasetFromView, alongX.Direction), v, w)),
    ToFloat(difference(ApplyToVector(datasetFromView, alongY.Direction), v, h)) };

  const std::array<const ViewRay*, 3> steps{ &corner, &alongX, &alongY };
  for (std::size_t k = 0; k < 3; ++k)
  {
    const double by = k == 0 ? 0 : k == 1 ? w : h;
    for (std::size_t a = 0; a < 3; ++a)
    {
      const auto at = [&](const ViewRay& r)
      { return r.Origin[a] + r.Direction[a] * g.DepthOrigin; };
      g.Rays.Origin[k][a] = k == 0 ? at(corner) : (at(*steps[k]) - at(corner)) / by;
      g.Rays.Direction[k][a] =
        k == 0 ? corner.Direction[a] : (steps[k]->Direction[a] - corner.Direction[a]) / by;
    }
  }
  g.Planes = MakePlanes(input.ClipPlanes, g.Rays, worldFromView.Value());
  g.VoxelPlanes = PlanesOfVoxels(input.ClipPlanes, worldFromVoxel, anchor);
  SetCrop(g.Parameters, input.Crop, input.DatasetFromVoxel, anchor);

  // Width of a pixel in view space; view space has the world's unit.
  const double widthAt0 = parallel ? Length(difference(alongX.Origin, corner.Origin, w)) : 0.0;
  const double widthPerDepth =
    parallel ? 0.0 : Length(difference(alongX.Direction, corner.Direction, w));
  Double3 edges{};
  for (std::size_t a = 0; a < 3; ++a)
  {
    Double3 axis{};
    axis[a] = 1;
    edges[a] = Length(ApplyToVector(worldFromVoxel, axis));
  }
  g.SmallestEdge = std::min({ edges[0], edges[1], edges[2] });
  g.Levels = ComputeLevels(layout, input, edges, widthAt0, widthPerDepth);
  g.Parameters.Levels = { static_cast<std::uint32_t>(layout.NumberOfLevels()),
    static_cast<std::uint32_t>(g.Levels.Minimum), static_cast<std::uint32_t>(g.Levels.Maximum),
    static_cast<std::uint32_t>(layout.DirectoryEntries()) };
  g.Parameters.Dimensions[3] = static_cast<std::uint32_t>(layout.BrickSize());
  for (int l = 0; l < layout.NumberOfLevels(); ++l)
  {
    const auto at = static_cast<std::size_t>(l);
    for (std::size_t a = 0; a < 3; ++a)
    {
      g.Parameters.LevelFactor[at][a] = static_cast<std::uint32_t>(layout.Factor(l)[a]);
      g.Parameters.LevelBricks[at][a] = static_cast<std::uint32_t>(layout.Bricks(l)[a]);
    }
    g.Parameters.LevelFactor[at][3] = static_cast<std::uint32_t>(layout.DirectoryBase(l));
    g.Parameters.LevelBricks[at][3] = static_cast<std::uint32_t>(layout.PageDepth(l));
    g.Parameters.LevelStart[at][0] =
      static_cast<float>(std::clamp(g.Levels.Start[at] - g.DepthOrigin, -3.0e38, 3.0e38));
  }

  const double inset = input.CellData ? 0.0 : 0.5;
  for (std::size_t a = 0; a < 3; ++a)
  {
    g.Intervals.BoxLow[a] = static_cast<float>(inset - anchor[a]);
    g.Intervals.BoxHigh[a] = static_cast<float>(static_cast<double>(dims[a]) - inset - anchor[a]);
  }
  VoxelBox block = Clamp(input.Block.value_or(VoxelBox{ { 0, 0, 0 }, dims }), dims);
  block = block.IsEmpty() ? VoxelBox{} : block;
  g.Intervals.HasBlock = input.Block.has_value();
  for (std::size_t a = 0; a < 3; ++a)
  {
    // As the faces of bricks, which are rounded the same way where floats don't hold them.
    g.Intervals.BlockLow[a] = static_cast<float>(static_cast<double>(block.Low[a]) - anchor[a]);
    g.Intervals.BlockHigh[a] = static_cast<float>(static_cast<double>(block.High[a]) - anchor[a]);
  }
  g.Intervals.Rectangle = VisibleRectangle(input, worldFromVoxel, block);
  g.Intervals.Near = static_cast<float>(nearDepth - g.DepthOrigin);
  g.Intervals.Far = static_cast<float>(farDepth - g.DepthOrigin);
  // ndc = (p10 z + p11) / (p14 z + p15) for view z = -depth; ndc = 2 d - 1.
  const double numerator0 = -p[15] - p[11];
  const double numerator1 = 2 * p[15];
  const double denominator0 = -p[14] - p[10];
  const double denominator1 = 2 * p[14];
  g.Intervals.DepthToView = { static_cast<float>(numerator0 - g.DepthOrigin * denominator0),
    static_cast<float>(numerator1 - g.DepthOrigin * denominator1), static_cast<float>(denominator0),
    static_cast<float>(denominator1) };

  // Normals transform with the inverse transpose. Of both only directions matter: scaled by a power
  // of two, so that squares neither overflow nor vanish in float whatever the world's unit is.
  const double unit =
    std::exp2(std::floor(std::log2(std::sqrt(input.DatasetFromVoxel[0] * input.DatasetFromVoxel[0] +
      input.DatasetFromVoxel[4] * input.DatasetFromVoxel[4] +
      input.DatasetFromVoxel[8] * input.DatasetFromVoxel[8]))));
  for (std::size_t i = 0; i < 3; ++i)
  {
    for (std::size_t j = 0; j < 3; ++j)
    {
      g.Parameters.Normal[i][j] = static_cast<float>(voxelFromDataset.Value()[4 * j + i] * unit);
      g.ViewNormal[i][j] = static_cast<float>(voxelFromView[4 * j + i] * unit);
      g.Parameters.Dataset[i][j] = static_cast<float>(input.DatasetFromVoxel[4 * i + j] / unit);
    }
  }
  g.Parameters.Eye = ToFloat(difference(ApplyToPoint(voxelFromView, { 0, 0, 0 }), anchor, 1));

  g.Order.Parallel = parallel;
  g.Order.Eye = middle;
  g.Order.Direction = ApplyToVector(voxelFromView, center.Direction);
  g.Order.InView =
    BricksInView(layout, g.Levels, { corner, alongX, alongY, ndc(input.Width, input.Height) },
      voxelFromView, std::max(nearDepth, boxNear), std::min(farDepth, boxFar), block);
  return g;
}

} // namespace teravox
