// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace teravox::program
{

/// From now on Ctrl-C and SIGTERM set a flag instead of ending the program, so that it can clean
/// up; a second one ends it at once.
void CatchInterrupts();
bool WasInterrupted();

} // namespace teravox::program
