// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "Status.h"
#include "Types.h"

#include <cstddef>
#include <memory>
#include <string>
#include <vector>
#include <vtkSmartPointer.h>

class vtkImageData;

namespace teravox
{
class BrickSource;
}

namespace teravox::program
{

/// The voxels of a scene, x fastest, and where they lie: the centre of the first one at the origin.
struct BenchVolume
{
  ScalarType Type = ScalarType::UInt8;
  Int3 Dimensions{ 0, 0, 0 };
  Double3 Spacing{ 1, 1, 1 };
  std::vector<std::byte> Voxels;

  double SmallestSpacing() const;
};

enum class BenchField
{
  Brain,  ///< MRI, mricron-data
  Head,   ///< CT, invesalius-examples
  Shells, ///< sparse: empty but for thin shells
  Sponge, ///< sparse, with much surface
  Dense,  ///< smooth, nothing of it empty
  Fog,    ///< Marschner and Lobb's signal
  Noise,  ///< smoothed a little, detail in each voxel
  Sheet   ///< one bent sheet, a voxel thick
};

/// Reads or computes a field. `size`: voxels per axis of those given by a formula.
/// Errors: NotFound names the package that isn't installed.
Result<BenchVolume> MakeBenchVolume(BenchField field, int size);

/// As a file that another process of this program reads again.
Status WriteBenchVolume(const BenchVolume& volume, const std::string& file);
Result<BenchVolume> ReadBenchVolume(const std::string& file);

/// A source of its bricks, as our mapper makes one of an image. Requires: the volume outlives it.
Result<std::shared_ptr<BrickSource>> MakeSource(const BenchVolume& volume);

/// One level of a source's first component and time step, as a dense array of the source's type.
Result<std::vector<std::byte>> ReadLevel(BrickSource& source, int level);

/// As VTK's mappers want it. `wide`: 8-bit voxels as 16-bit ones.
vtkSmartPointer<vtkImageData> ToImage(const BenchVolume& volume, bool wide);

} // namespace teravox::program
