// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "BudgetShares.h"

#include <algorithm>
#include <cstddef>
#include <numeric>

namespace teravox
{

std::vector<std::uint64_t> DivideBudget(
  std::uint64_t total, const std::vector<std::uint64_t>& needs)
{
  std::vector<std::size_t> order(needs.size());
  std::iota(order.begin(), order.end(), std::size_t{ 0 });
  std::sort(order.begin(), order.end(),
    [&needs](std::size_t a, std::size_t b) { return needs[a] < needs[b]; });
  std::vector<std::uint64_t> shares(needs.size(), 0);
  std::uint64_t left = total;
  std::uint64_t sharing = needs.size();
  // From the smallest need on: as soon as one is more than an equal share, all that follow are.
  for (std::size_t i = 0; i < order.size(); ++i, --sharing)
  {
    const std::uint64_t equal = left / sharing;
    if (needs[order[i]] > equal)
    {
      std::for_each(order.begin() + static_cast<std::ptrdiff_t>(i), order.end(),
        [&](std::size_t at) { shares[at] = equal; });
      return shares;
    }
    shares[order[i]] = needs[order[i]];
    left -= needs[order[i]];
  }
  for (std::uint64_t& share : shares)
  {
    share += left / needs.size();
  }
  return shares;
}

} // namespace teravox
