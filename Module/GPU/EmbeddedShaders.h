// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <string>

namespace teravox
{

/// The files of the folder Shaders by their path below it. Thread: immutable.
const std::map<std::string, std::string>& EmbeddedShaders();

} // namespace teravox
