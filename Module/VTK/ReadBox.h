// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "BrickSource.h"

#include <cstddef>
#include <cstdint>
#include <functional>

namespace teravox
{

/// How ReadBox() went: bricks that couldn't be read, and why the first of them couldn't.
struct ReadBoxReport
{
  std::int64_t FailedBricks = 0;
  Status FirstFailure;
  bool Cancelled = false;
};

/// Reads the voxels [first, first + size) of one level, brick by brick with a few threads, into
/// `out`: dense, x fastest, components interleaved. `progress` is called on the calling thread
/// only, with the fraction done; when it returns false the rest is left out and the report says so.
///
/// The part of a brick that can't be read is taken from its finest ancestor that can, else set to
/// zero.
/// Requires: 0 <= first, first + size <= Dimensions(level); `out` has room for the box.
ReadBoxReport ReadBox(BrickSource& source, int level, const Int3& first, const Int3& size,
  std::byte* out, const std::function<bool(double)>& progress = {});

} // namespace teravox
