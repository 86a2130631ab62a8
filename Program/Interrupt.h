// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace teravox::program
{

/// From now on Ctrl-C, SIGTERM and the end of the terminal set a flag instead of ending the
/// program, so that it can clean up. A second one removes these unfinished files, if not empty, and
/// ends it at once.
void CatchInterrupts(const std::string& unfinished, const std::string& log = std::string());
bool WasInterrupted();

} // namespace teravox::program
