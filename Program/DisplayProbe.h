// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace teravox::program
{

/// Does an X server answer under that name? Apart from the rest, because X11's header defines names
/// such as Status as macros.
bool CanOpenDisplay(const char* name);

} // namespace teravox::program
