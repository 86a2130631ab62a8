// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "InputArray.h"

#include <memory>
#include <string>

class vtkImageData;

namespace teravox
{

/// The source of what a mapper draws by a function over two arrays of an image, kept as long as
/// neither changes. Thread: used by the render thread only.
class SecondArray
{
public:
  /// `name`: of an array of the points, or of the cells, as `source` is of one or the other
  /// (`cellData`): an ordinary one, of which component 0 counts; or one that stands for a pyramid
  /// that is made like that of the volume. Null and an error in one sentence where there is none
  /// that can be joined with the source, or the range of its values isn't known.
  std::shared_ptr<BrickSource> Join(const std::shared_ptr<BrickSource>& source, vtkImageData* image,
    const char* name, bool cellData, int brickSize, std::string& error);

private:
  std::shared_ptr<BrickSource> Find(
    vtkImageData* image, const char* name, bool cellData, int brickSize, std::string& error);

  InputArray Array;
  std::shared_ptr<BrickSource> First; ///< what was joined
  std::shared_ptr<BrickSource> Beside;
  std::shared_ptr<BrickSource> Both;
};

} // namespace teravox
