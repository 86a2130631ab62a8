// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "DisplayProbe.h"

#include <X11/Xlib.h>

namespace teravox::program
{

bool CanOpenDisplay(const char* name)
{
  Display* display = XOpenDisplay(name);
  if (!display)
  {
    return false;
  }
  XCloseDisplay(display);
  return true;
}

} // namespace teravox::program
