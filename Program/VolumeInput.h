// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "Commands.h"
#include "Status.h"
#include "vtkBrickSourceAlgorithm.h"

#include <optional>
#include <string>
#include <vtkSmartPointer.h>

namespace teravox::program
{

/// The pipeline of a volume on the command line, not yet updated.
struct VolumePipeline
{
  vtkSmartPointer<vtkBrickSourceAlgorithm> Base; ///< the file or the formula
  vtkSmartPointer<vtkBrickSourceAlgorithm> Last; ///< with its repetitions
};

/// Errors: no such file or formula, a type or numbers that can't be. What is wrong inside of a file
/// shows when the pipeline is updated.
Result<VolumePipeline> OpenVolume(const VolumeOptions& options);

/// Does the name of a volume mean a formula, not a file?
bool IsFormula(const std::string& name);

/// The type of a name such as "u16".
std::optional<ScalarType> ScalarTypeFromName(const std::string& name);

} // namespace teravox::program
