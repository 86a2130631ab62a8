// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "BrickGeometry.h"
#include "Formula.h"

#include <memory>
#include <string>

namespace teravox
{

/// A formula, the volume it fills, and how its values become voxels.
struct FormulaDescription
{
  std::shared_ptr<const Formula> Field;
  Int3 Dimensions{ 0, 0, 0 };
  ScalarType Type = ScalarType::UInt8;
  /// Voxel values of the field's 0 and 1; Unknown() takes the whole range of an integer type, and
  /// 0 to 1 for floats.
  ValueRange Output = ValueRange::Unknown();
  int BrickSize = 64;
  bool CellData = false;
  Double3 Origin{ 0, 0, 0 };
  Double3 Spacing{ 1, 1, 1 };
  std::array<double, 9> Direction{ 1, 0, 0, 0, 1, 0, 0, 0, 1 };
  std::string ArrayName = "scalars";
  std::string Name = "formula";
};

/// Evaluates a formula at the voxel centres of each level: a volume of any size without storage.
/// Ranges come from the formula's own bounds.
/// Thread: as BrickSource; nothing is shared between reads.
class FormulaBrickSource : public BrickSource
{
public:
  /// Errors: no field, dimensions out of range, an output outside of the type.
  static Result<std::shared_ptr<FormulaBrickSource>> Make(const FormulaDescription& formula);

  const VolumeInfo& Info() const override { return this->Info_; }
  Result<BrickPointer> ReadBrick(const BrickKey& key) override;
  Result<std::vector<ValueRange>> ReadRanges(const BrickKey& first, const Int3& count) override;

private:
  FormulaBrickSource(const FormulaDescription& formula, PyramidLayout layout);

  ValueRange RangeOfBox(int level, const VoxelBox& box) const;
  template <typename T>
  void Evaluate(int level, const VoxelBox& stored, const VoxelBox& inside, T* voxels) const;

  VolumeInfo Info_;
  const std::shared_ptr<const Formula> Field;
  ValueRange Output;
};

} // namespace teravox
