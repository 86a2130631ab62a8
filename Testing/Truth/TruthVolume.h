// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "TruthMath.h"
#include "Types.h"

#include <cstdint>
#include <functional>
#include <vector>

namespace teravox
{

enum class TruthInterpolation
{
  Linear,
  Nearest
};

/// One level of a pyramid. The voxels come from a dense array (fast) or from a function of the
/// voxel's index in that level (any size).
struct TruthLevel
{
  Int3 Dimensions{ 1, 1, 1 };
  Int3 Factor{ 1, 1, 1 }; ///< cumulative, against level 0
  /// Used where `Data` is null. Thread: is called from several threads at once.
  std::function<double(std::int64_t, std::int64_t, std::int64_t)> Function;
  const void* Data = nullptr; ///< not owned; x fastest
  ScalarType Type = ScalarType::Float64;

  static TruthLevel FromArray(
    ScalarType type, const void* data, const Int3& dimensions, const Int3& factor = { 1, 1, 1 });
  static TruthLevel FromFunction(
    std::function<double(std::int64_t, std::int64_t, std::int64_t)> function,
    const Int3& dimensions, const Int3& factor = { 1, 1, 1 });

  /// Requires: an index inside the level.
  double Voxel(std::int64_t i, std::int64_t j, std::int64_t k) const;
};

/// A volume as the reference integrator sees it: the fields F_l of all its levels, and where it
/// lies. Thread: immutable.
///
/// Corner coordinates of level 0 are the parameter of everything: voxel i covers [i, i+1], has its
/// centre at i + 0.5; point p lies at p / Factor in level l. F_l interpolates between the voxel
/// centres of level l and is clamped (the outer voxels go on for ever); nearest takes the voxel
/// that contains the point. A sample with a NaN among the voxels of non-zero weight is NaN.
class TruthVolume
{
public:
  /// Requires: at least one level; level 0 has factor 1; worldFromVoxel is affine and regular.
  TruthVolume(std::vector<TruthLevel> levels, const Matrix4& worldFromVoxel,
    TruthInterpolation interpolation, bool cellData);

  /// For an image: world position of the centre of voxel (0,0,0), spacing, direction (rows, as
  /// vtkImageData), and the matrix of the prop. For VTK's cell data that centre lies half a voxel
  /// off the image's origin.
  static Matrix4 WorldFromVoxel(const Double3& centerOfFirstVoxel, const Double3& spacing,
    const Matrix3& direction = { 1, 0, 0, 0, 1, 0, 0, 0, 1 },
    const Matrix4& worldFromDataset = IdentityMatrix());

  int NumberOfLevels() const { return static_cast<int>(this->Levels.size()); }
  const TruthLevel& Level(int level) const { return this->Levels[static_cast<std::size_t>(level)]; }
  TruthInterpolation Interpolation() const { return this->Interpolation_; }
  const Matrix4& WorldFromVoxel() const { return this->WorldFromVoxel_; }
  const Matrix4& VoxelFromWorld() const { return this->VoxelFromWorld_; }
  /// Bounds in corner coordinates of level 0: the outer voxel centres for point data, all voxels
  /// for cell data.
  const Double3& BoundsMin() const { return this->BoundsMin_; }
  const Double3& BoundsMax() const { return this->BoundsMax_; }
  /// Edge of a voxel of a level along an axis, in world units.
  double VoxelEdge(int level, std::size_t axis) const;

  /// F_level at a point in corner coordinates of level 0.
  double Field(int level, const Double3& pVoxel) const
  {
    return this->FieldAbove(level, pVoxel, 0);
  }
  /// F(p + h) - F(p - h) along each axis, where h is `step` voxels of the level; not divided by h.
  Double3 CentralDifference(int level, const Double3& pVoxel, const Double3& step) const;
  /// The same voxel value as Level(level).Voxel() with each index clamped.
  double ClampedVoxel(int level, std::int64_t i, std::int64_t j, std::int64_t k) const;

private:
  /// F_level less a reference: where all is like the reference, exactly 0.
  double FieldAbove(int level, const Double3& pVoxel, double reference) const;

  std::vector<TruthLevel> Levels;
  Matrix4 WorldFromVoxel_{};
  Matrix4 VoxelFromWorld_{};
  TruthInterpolation Interpolation_ = TruthInterpolation::Linear;
  Double3 BoundsMin_{};
  Double3 BoundsMax_{};
};

} // namespace teravox
