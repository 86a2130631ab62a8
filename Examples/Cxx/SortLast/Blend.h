// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

/// Blends the float pictures of all ranks, direct send: the picture is cut into as many strips as
/// there are ranks, each rank blends one, to which the others send what of theirs isn't empty.
/// Collective over all ranks.
/// `picture`: premultiplied RGBA of width x height pixels, rows from the bottom; empty: this rank
/// has seen nothing. `order`: ranks, front to back; the same on all.
/// Returns the blended picture on rank 0, an empty one on the others. `sent`: bytes that this rank
/// has sent to others.
std::vector<float> BlendOnRankZero(const std::vector<float>& picture, int width, int height,
  const std::vector<int>& order, std::uint64_t& sent);
