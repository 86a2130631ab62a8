// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

namespace teravox::shared
{
/// Constants and address arithmetic of the shaders, compiled as C++.
using uint = std::uint32_t;

namespace
{
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-function"
#include "Layout.glsl"
#pragma GCC diagnostic pop
} // namespace

} // namespace teravox::shared
