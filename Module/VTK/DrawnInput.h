// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "BrickSeries.h"
#include "BrickSource.h"
#include "ViewGeometry.h"

#include <functional>
#include <memory>
#include <string>

class vtkBrickSource;
class vtkDataArray;
class vtkImageData;

namespace teravox
{

/// What a mapper draws: a source, and where its level 0 lies.
struct Drawn
{
  std::shared_ptr<BrickSource> Source;
  Matrix4 DatasetFromVoxel{}; ///< corner coordinates of level 0
  bool CellData = false;
  std::shared_ptr<BrickSeries> Series; ///< what the source is a step of
  int Step = 0;
  vtkImageData* Image = nullptr; ///< that it is of; of a source that was given there is none
};

/// Finds what is to be drawn: `explicitSource`, if there is one; what the array stands for; else
/// the array itself, of which `ofArray` makes a source. An empty source if there is nothing, and
/// why where that is known.
Drawn FindDrawn(vtkBrickSource* explicitSource, vtkImageData* image, vtkDataArray* scalars,
  int cellFlag, const std::function<std::shared_ptr<BrickSource>(std::string&)>& ofArray,
  std::string& error);

} // namespace teravox
