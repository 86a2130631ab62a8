// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace teravox::test
{

/// Is this a build with sanitizers? They make a test about ten times slower.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool IsInstrumented = true;
#else
inline constexpr bool IsInstrumented = false;
#endif

/// How much a test does (steps, seeds, voxels along an axis): `whole`, or `less` in a build with
/// sanitizers, which look for another kind of error. The one place where tests differ by build.
template <typename T>
constexpr T Effort(T whole, T less)
{
  return IsInstrumented ? less : whole;
}

} // namespace teravox::test
