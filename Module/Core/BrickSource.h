// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "BrickKey.h"
#include "PyramidLayout.h"
#include "Status.h"
#include "Types.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace teravox
{

/// Decoded voxels of one brick with its border: StoredSize^3 voxels, x fastest, components
/// interleaved. Voxels outside the volume repeat the nearest voxel inside (clamp). NaN is kept.
/// Thread: immutable once it is shared.
struct Brick
{
  ScalarType Type = ScalarType::UInt8;
  int Components = 1;
  int StoredSize = 0;
  std::vector<std::byte> Voxels;
  /// Of volumes with a mask one value per voxel, of one byte or of MaskBytes in the machine's
  /// order: 0 where nothing is drawn, else 1; with a label mask 1 + the number of the label, see
  /// VolumeInfo::MaskLabels.
  std::vector<std::uint8_t> Mask;
  int MaskBytes = 1; ///< 1 or 2

  std::size_t SizeInBytes() const
  {
    return this->Voxels.size() + this->Mask.size() + sizeof(Brick);
  }
};
using BrickPointer = std::shared_ptr<const Brick>;

/// What is known of a volume without reading a brick.
struct VolumeInfo
{
  PyramidLayout Layout;
  ScalarType Type = ScalarType::UInt8;
  int Components = 1;
  int TimeSteps = 1;
  bool Labels = false; ///< nearest interpolation, levels by mode
  bool Masked = false; ///< bricks have a mask
  /// Of a label mask: how many labels bricks tell apart. Number 0 are all that have no name, the
  /// others those that have one, ascending. 0: the mask is a binary one, or there is none.
  int MaskLabels = 0;
  bool CellData =
    false; ///< the bounds cover whole voxels; else they end at the outer voxel centres
  /// Range of level 0; Unknown() where nobody knows.
  ValueRange Range;
  /// The same of each component; empty where only that of all together is known.
  std::vector<ValueRange> ComponentRanges;
  /// Counts of level-0 voxels in equal bins over Range; empty where unknown.
  std::vector<double> Histogram;
  /// World position of the centre of the voxel with index (0,0,0) *of the pyramid*, edge lengths of
  /// a level-0 voxel, and the direction matrix (rows, as vtkImageData). ExtentStart is the index
  /// that VTK's image gives to that voxel; Origin already includes it.
  Double3 Origin{ 0, 0, 0 };
  Double3 Spacing{ 1, 1, 1 };
  std::array<double, 9> Direction{ 1, 0, 0, 0, 1, 0, 0, 0, 1 };
  Int3 ExtentStart{ 0, 0, 0 };
  std::string ArrayName = "scalars";
  std::string Name; ///< file and dataset, or the formula; for messages
};

/// Brick::MaskBytes.
inline int MaskBytesOf(const VolumeInfo& info)
{
  constexpr int mostInOne = 255;
  return info.MaskLabels > mostInOne ? 2 : 1;
}

/// Of a voxel in an atlas: its components, and its mask where there is one.
inline int AtlasComponents(const VolumeInfo& info)
{
  return info.Components + (info.Masked ? 1 : 0);
}

/// Tells its layout and reads one brick, or the ranges of many. The only way from data to renderer.
/// Thread: all functions may be called from several threads at once.
class BrickSource
{
public:
  BrickSource() = default;
  BrickSource(const BrickSource&) = delete;
  BrickSource& operator=(const BrickSource&) = delete;
  BrickSource(BrickSource&&) = delete;
  BrickSource& operator=(BrickSource&&) = delete;
  virtual ~BrickSource() = default;

  virtual const VolumeInfo& Info() const = 0;

  /// Reads one brick (key.PageLevel == 0). Blocks. Never throws.
  virtual Result<BrickPointer> ReadBrick(const BrickKey& key) = 0;

  /// Ranges with filter support (BrickBorder voxels on each side) of a box of regions. Region r of
  /// page level k covers the bricks [r, r+1) * PageBlockEdge^k of pyramid level first.Level.
  /// Returns count[0]*count[1]*count[2] ranges, x fastest; conservative: may be wider than the
  /// truth, never narrower, Unknown() where nothing is known. Regions outside the volume are
  /// Void().
  virtual Result<std::vector<ValueRange>> ReadRanges(const BrickKey& first, const Int3& count) = 0;

  /// Bytes of storage (as stored, compressed) read so far for bricks and ranges; 0 for formulas.
  virtual std::uint64_t BytesRead() const { return 0; }
  /// Host memory that the source itself holds now (chunk cache, tables), without the user's own
  /// data.
  virtual std::uint64_t MemoryUsed() const { return 0; }
  /// A share of the host budget for the source's own caches, in bytes.
  virtual void SetMemoryBudget(std::uint64_t bytes) { static_cast<void>(bytes); }
  /// The least share with which everything can be read, in bytes.
  virtual std::uint64_t LeastMemory() const { return 0; }
};

} // namespace teravox
