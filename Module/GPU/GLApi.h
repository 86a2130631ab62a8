// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The one place that names the OpenGL loader; it must be included before any other GL header.
#include "vtk_glew.h"

namespace teravox
{
/// The least OpenGL that has all we use: image load/store, shader storage buffers, frame buffers
/// without attachments.
inline constexpr int MinimumGLMajor = 4;
inline constexpr int MinimumGLMinor = 3;
} // namespace teravox
