// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "Status.h"

#include <string>
#include <vector>

namespace teravox::program
{

/// Runs this very program with other arguments and waits for its end. It shares output and
/// environment.
/// Errors: it can't be started, or doesn't end with 0.
Status RunSelf(const std::vector<std::string>& arguments);

} // namespace teravox::program
