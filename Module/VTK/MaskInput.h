// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "BrickSource.h"

#include <cstdint>
#include <memory>
#include <string>
#include <vector>
#include <vtkSmartPointer.h>
#include <vtkType.h>

class vtkDataArray;
class vtkImageData;

namespace teravox
{

/// The source of what a mapper draws of a volume under a mask, kept as long as neither the volume
/// nor the mask changes, nor which labels have functions. Thread: used by the render thread only.
class MaskInput
{
public:
  /// The mask is an image with active scalars of one component and as many voxels as level 0 of the
  /// volume; or a lazy image of a pyramid that is made like that of the volume. Coarser levels of
  /// an ordinary image are in the mask wherever one of their voxels is, or have the label that most
  /// of these have. Null and an error in one sentence where it is none. `labels`: ascending, those
  /// to tell apart by a label mask; empty: a binary mask.
  std::shared_ptr<BrickSource> Find(const std::shared_ptr<BrickSource>& source, vtkImageData* mask,
    std::vector<std::int64_t> labels, std::string& error);

private:
  struct Key
  {
    std::shared_ptr<BrickSource> Source;
    vtkSmartPointer<vtkImageData> Image;
    vtkMTimeType ImageTime = 0;
    vtkSmartPointer<vtkDataArray> Array;
    vtkMTimeType ArrayTime = 0;
    std::shared_ptr<BrickSource> Pyramid;
    std::vector<std::int64_t> Labels;

    bool operator==(const Key& o) const;
  };

  Key Made;
  std::shared_ptr<BrickSource> Masked;
};

} // namespace teravox
