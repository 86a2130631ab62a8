// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "BrickGeometry.h"
#include "CutSetup.h"
#include "MarchParameters.h"
#include "PyramidLayout.h"
#include "Residency.h"

#include <array>
#include <optional>
#include <vector>

namespace teravox
{

using Matrix4 = std::array<double, 16>; ///< row-major, acts on column vectors

Matrix4 MultiplyMatrices(const Matrix4& a, const Matrix4& b);
/// A point, divided by its fourth coordinate.
Double3 ApplyToPoint(const Matrix4& m, const Double3& p);
/// A direction: what the matrix moves doesn't matter.
Double3 ApplyToVector(const Matrix4& m, const Double3& v);
/// Errors: InvalidArgument if the matrix is singular.
Result<Matrix4> InvertMatrix(const Matrix4& m);

/// Camera and placement of one volume in one view.
struct ViewInput
{
  Matrix4 ViewFromWorld{};
  Matrix4 ClipFromView{};     ///< OpenGL: depth -1..1
  Matrix4 DatasetFromVoxel{}; ///< from corner coordinates of level 0 to the image's space
  Matrix4 WorldFromDataset{}; ///< the prop's matrix
  int Width = 0;              ///< pixels of the whole, untiled picture
  int Height = 0;
  double LevelBias = 0; ///< pixel widths are multiplied by 2^bias
  int MinimumLevel = 0;
  int MaximumLevel = 31;
  bool CellData = false; ///< the box covers whole voxels, else it ends at outer centres
  std::vector<ClipPlane> ClipPlanes;
  CropRegions Crop;
  /// Only what lies in these voxels of level 0 is drawn: the cubes around their centres. Light,
  /// levels and pieces of rays are those of the whole volume, so that the pictures of blocks whose
  /// faces lie on faces of bricks, one behind the other, are the picture of the volume.
  std::optional<VoxelBox> Block;
};

/// View depths between which something may be; negative ones are behind the eye.
struct DepthRange
{
  double Near = 0;
  double Far = 0;
};
/// Of a volume of so many voxels.
DepthRange ViewDepthsOf(const ViewInput& camera, const Int3& voxels);

/// The depths at which lambda changes: Start[l] is the least view depth at which level l is coarse
/// enough to be allowed (-infinity for the minimum level, +infinity for levels that never are).
/// DESIGN: the coarsest level whose voxel edge is at most a pixel's width on every axis that this
/// level has averaged. In parallel projection Minimum == Maximum == the one level of the picture.
struct LevelDepths
{
  int Minimum = 0;
  int Maximum = 0;
  std::array<double, 32> Start{};
};

/// What a view needs, computed in double precision relative to an integer anchor near the rays'
/// origin so that accuracy depends neither on size nor on place of the volume.
struct ViewGeometry
{
  MarchParameters Parameters; ///< rays, anchor, levels; the rest is left as it is
  IntervalParameters Intervals;
  std::vector<PlaneAlongRays> Planes;            ///< that cut the intervals
  std::vector<MarchParameters::Vec> VoxelPlanes; ///< the same, see PlanesOfVoxels()
  LevelDepths Levels;
  ViewOrder Order;
  /// Depths along the rays are view depths minus this: where the volume begins, or the near plane.
  double DepthOrigin = 0;
  /// MarchParameters::Normal for lights in view space.
  std::array<MarchParameters::Vec, 3> ViewNormal{};
  /// The rays in view space.
  ViewRays Rays;
  /// Shortest edge of a level-0 voxel, world units.
  double SmallestEdge = 1;

  /// The place at a depth of the marchers on the ray through (x, y), in pixels; view space.
  Double3 PointInView(double x, double y, double depth) const;
  /// The depth of the depth buffer, 0...1, of a depth of the marchers on that ray, and the inverse.
  double WindowOfDepth(const ViewInput& camera, double x, double y, double depth) const;
  double DepthOfWindow(const ViewInput& camera, double x, double y, double window) const;

  /// Errors: InvalidArgument (singular matrices).
  static Result<ViewGeometry> Make(const PyramidLayout& layout, const ViewInput& input);
};

} // namespace teravox
