// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "Residency.h"

#include <cstdint>

namespace teravox
{

/// What one pass of the rays of a picture reports.
struct PassResult
{
  Feedback Report;
  bool Waiting = false;           ///< a ray waits for a brick
  bool Unfinished = false;        ///< a ray stopped because its pass was long enough
  bool Overflow = false;          ///< a request found no place
  bool Fallback = false;          ///< a coarser ancestor was drawn for a missing or failed brick
  std::uint64_t Samples = 0;      ///< cells or samples of the field that were looked at
  std::uint64_t Evaluated = 0;    ///< of them those for which colour and opacity were computed
  std::uint64_t Contributing = 0; ///< of them those that added something
  std::uint64_t Gradients = 0;    ///< places where gradients were computed
  std::uint64_t Visits = 0;       ///< bricks, and empty regions that were left at once
};

} // namespace teravox
