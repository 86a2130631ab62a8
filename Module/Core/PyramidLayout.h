// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "Status.h"
#include "Types.h"

#include <vector>

namespace teravox
{

/// Voxels of neighbours kept around each brick, on each side: one for trilinear interpolation, one
/// more for central differences, so that shading on or off reloads nothing.
inline constexpr int BrickBorder = 2;

/// Entries of a page block along each axis.
inline constexpr int PageBlockEdge = 8;

/// How the entries of a page table are grouped. The renderer uses the default throughout; other
/// shapes reproduce page tables of the literature.
struct PageShape
{
  Int3 BlockEdge{ PageBlockEdge, PageBlockEdge, PageBlockEdge };
  /// Page levels below the directory, of all levels; negative: of each level the least, at least
  /// 1, with a small directory.
  int Depth = -1;
};

/// The immutable numbers of a pyramid and all arithmetic between voxel, brick, page and level.
/// Thread: immutable.
///
/// Spaces: *corner coordinates* of level l count voxels of that level, voxel i covers [i, i+1] and
/// has its centre at i + 0.5. A point p of level 0 lies at p / Factor(l) in level l, so that
/// x0 = f x_l + (f-1)/2 for voxel centres, also for a partial last group.
/// Brick b of level l covers [b, b+1) * BrickSize in corner coordinates of level l.
///
/// Pages (Sarton 2018, section 3.3; Hadwiger et al. 2012): page level 0 has one entry per brick,
/// page level k one entry per BlockEdge^k bricks; the page directory holds of each pyramid level
/// its page level PageDepth(level), one level after the other. The depth follows from the level's
/// own bricks: a level of a few bricks is found as fast in a huge volume as in a small one.
class PyramidLayout
{
public:
  PyramidLayout() = default;

  /// Factors per level are cumulative against level 0; factors[0] must be {1,1,1}, and each must be
  /// a multiple of the one before. `brickSize` is the inner size in voxels, without border.
  /// Errors: dimensions < 1 or >= 2^31 per axis, brick size not in 2..1024, bad factors, block
  /// edges < 1 (all 1 with an automatic depth never end), a depth above 31.
  static Result<PyramidLayout> Make(
    const Int3& dimensions, int brickSize, std::vector<Int3> factors, const PageShape& pages = {});

  /// Levels until one brick holds everything. An axis is halved while it has more than one voxel,
  /// and only if its voxel edge (spacing) is at most sqrt(2) times the smallest edge among the axes
  /// that can still be halved: anisotropic data towards isotropic first.
  static std::vector<Int3> DefaultFactors(
    const Int3& dimensions, const Double3& spacing, int brickSize);

  /// Make() with DefaultFactors().
  static Result<PyramidLayout> MakeDefault(
    const Int3& dimensions, const Double3& spacing, int brickSize);

  int NumberOfLevels() const { return static_cast<int>(this->Factors.size()); }
  int BrickSize() const { return this->BrickSize_; }
  /// Edge of a brick with its border, in voxels.
  int StoredSize() const { return this->BrickSize_ + 2 * BrickBorder; }
  const Int3& Factor(int level) const { return this->Factors[static_cast<std::size_t>(level)]; }
  /// Voxels of a level: ceil(dimensions / factor).
  const Int3& Dimensions(int level) const
  {
    return this->LevelDims[static_cast<std::size_t>(level)];
  }
  /// Bricks of a level along each axis.
  const Int3& Bricks(int level) const { return this->LevelBricks[static_cast<std::size_t>(level)]; }
  /// Bricks of all levels, the unit of S3's table 3.1; saturates at 2^63-1.
  std::int64_t TotalBricks() const;

  /// Page levels of a pyramid level below the directory; at least 1, if it wasn't given.
  int PageDepth(int level) const { return this->Depths[static_cast<std::size_t>(level)]; }
  /// The most of any level: page blocks on the way to a brick.
  int PageDepth() const;
  /// Entries of a page block along each axis.
  const Int3& PageEdge() const { return this->PageEdge_; }
  /// Entries of a page level along each axis: ceil(Bricks(level) / PageEdge()^pageLevel).
  Int3 Pages(int level, int pageLevel) const;
  /// The entry of a page level that covers a voxel of any pyramid level.
  Int3 PageOf(const Int3& voxel, int pageLevel) const;
  /// Voxels that the entries of a pyramid level can address: the real dimensions, rounded up to
  /// whole bricks and whole page blocks below the directory (the virtual size in Sarton 2018).
  Int3 VirtualDimensions(int level) const;
  /// Where the entries of a pyramid level begin in the page directory (x fastest inside a level).
  std::int64_t DirectoryBase(int level) const
  {
    return this->DirectoryBases[static_cast<std::size_t>(level)];
  }
  std::int64_t DirectoryEntries() const { return this->DirectoryBases.back(); }

  bool operator==(const PyramidLayout& o) const
  {
    return this->BrickSize_ == o.BrickSize_ && this->Factors == o.Factors &&
      this->LevelDims == o.LevelDims && this->PageEdge_ == o.PageEdge_ && this->Depths == o.Depths;
  }

private:
  int BrickSize_ = 0;
  Int3 PageEdge_{ PageBlockEdge, PageBlockEdge, PageBlockEdge };
  std::vector<Int3> Factors;
  std::vector<Int3> LevelDims;
  std::vector<Int3> LevelBricks;
  std::vector<int> Depths;
  std::vector<std::int64_t> DirectoryBases; // one per level, and the total
};

} // namespace teravox
