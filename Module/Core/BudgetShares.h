// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

namespace teravox
{

/// Divides a budget among those who can use so much of it, in bytes: none gets less than an equal
/// share or than it can use, and what some leave is the others' (max-min fairness; D. Bertsekas, R.
/// Gallager, "Data Networks", section 6.5.2). What all leave is divided equally. The sum is at most
/// `total`; equal needs get equal shares. Returns nothing for no needs.
std::vector<std::uint64_t> DivideBudget(
  std::uint64_t total, const std::vector<std::uint64_t>& needs);

} // namespace teravox
