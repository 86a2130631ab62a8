// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "Status.h"
#include "Types.h"

#include <array>
#include <string>

namespace teravox
{

/// Gives a PyramidWriter the voxels of a whole volume, box by box.
/// Thread: the writer calls all functions from the one thread that called Write().
class VoxelReader
{
public:
  /// Geometry and type. Origin is the world position of the centre of voxel (0,0,0), as in
  /// VolumeInfo; ExtentStart is the index that VTK's image gives to that voxel.
  struct Description
  {
    Int3 Dimensions{ 0, 0, 0 }; ///< voxels (cells, if CellData), 1 to 2^31 - 1 per axis
    ScalarType Type = ScalarType::UInt8;
    int Components = 1; ///< 1 to 4
    bool CellData = false;
    Double3 Spacing{ 1, 1, 1 };
    Double3 Origin{ 0, 0, 0 };
    std::array<double, 9> Direction{ 1, 0, 0, 0, 1, 0, 0, 0, 1 };
    Int3 ExtentStart{ 0, 0, 0 };
    std::string ArrayName = "scalars";
    /// The value of voxels that needn't be stored; regions of it cost neither disk nor time.
    double FillValue = 0;
  };

  VoxelReader() = default;
  VoxelReader(const VoxelReader&) = delete;
  VoxelReader& operator=(const VoxelReader&) = delete;
  VoxelReader(VoxelReader&&) = delete;
  VoxelReader& operator=(VoxelReader&&) = delete;
  virtual ~VoxelReader() = default;

  /// Constant while a writer uses the reader.
  virtual Description Describe() const = 0;

  /// Writes the voxels of a box that lies inside the volume to `out`: x fastest, components
  /// interleaved, size[0]*size[1]*size[2]*Components values. Boxes come in an order that visits
  /// each voxel once.
  virtual Status ReadBox(const Int3& start, const Int3& size, void* out) = 0;

  /// True if a box costs no more in pieces, one slab of slices after another, than at once. A
  /// writer then works on one while the next is read.
  virtual bool ReadsSlabs() const { return false; }

  /// Where the box lies in memory, in the order in which ReadBox() writes it, until the next call
  /// of the reader: spares a copy of voxels that are there anyway. Null: only ReadBox() has them.
  virtual const void* FindBox(const Int3& start, const Int3& size)
  {
    static_cast<void>(start);
    static_cast<void>(size);
    return nullptr;
  }

  /// True if all voxels (and components) of the box are known to be one value without reading them;
  /// `value` then receives it. Must be cheap; lets a sparse giant be converted in seconds.
  virtual bool IsConstant(const Int3& start, const Int3& size, double* value)
  {
    static_cast<void>(start);
    static_cast<void>(size);
    static_cast<void>(value);
    return false;
  }
};

} // namespace teravox
