// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "BenchResults.h"

#include <string>

namespace teravox::program
{

/// Time against error of a scene's mappers, both logarithmic, as a PNG file.
/// Errors: the file can't be written.
Status WritePlot(const BenchSceneResult& result, const std::string& file);

} // namespace teravox::program
