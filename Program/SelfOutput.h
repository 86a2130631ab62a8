// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "Status.h"

#include <string>
#include <vector>

namespace teravox::program
{

/// Runs this very program in a process of its own and returns what it printed.
/// Errors: InputOutput, with what the other process said.
Result<std::string> OutputOfSelf(const std::vector<std::string>& arguments);

} // namespace teravox::program
