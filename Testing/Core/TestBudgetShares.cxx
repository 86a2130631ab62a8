// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "BudgetShares.h"

#include <algorithm>
#include <cstdint>
#include <gtest/gtest.h>
#include <limits>
#include <numeric>
#include <random>
#include <vector>

using namespace teravox;

using Bytes = std::vector<std::uint64_t>;

TEST(BudgetShares, ByHand)
{
  EXPECT_EQ(DivideBudget(100, {}), Bytes());
  EXPECT_EQ(DivideBudget(100, { 7 }), Bytes({ 100 }));
  EXPECT_EQ(DivideBudget(100, { 900, 10 }), Bytes({ 90, 10 }));
  EXPECT_EQ(DivideBudget(100, { 900, 10, 900 }), Bytes({ 45, 10, 45 }));
  EXPECT_EQ(DivideBudget(100, { 900, 900 }), Bytes({ 50, 50 }));
  EXPECT_EQ(DivideBudget(100, { 20, 40 }), Bytes({ 40, 60 })); // 40 are left
  EXPECT_EQ(DivideBudget(0, { 5, 0 }), Bytes({ 0, 0 }));
  const std::uint64_t most = std::numeric_limits<std::uint64_t>::max();
  EXPECT_EQ(DivideBudget(most, { most, most }), Bytes({ most / 2, most / 2 }));
}

TEST(BudgetShares, FairAndWithinTheBudget)
{
  std::mt19937_64 random(20261128);
  for (int round = 0; round < 2000; ++round)
  {
    Bytes needs(1 + random() % 6);
    for (std::uint64_t& need : needs)
    {
      need = random() >> (random() % 64);
    }
    const std::uint64_t total = random() >> (random() % 64);
    const Bytes shares = DivideBudget(total, needs);
    std::uint64_t sum = 0;
    for (std::size_t i = 0; i < needs.size(); ++i)
    {
      ASSERT_LE(shares[i], total - sum); // the sum doesn't overflow
      sum += shares[i];
      ASSERT_GE(shares[i], std::min(needs[i], total / needs.size()));
      for (std::size_t j = 0; j < needs.size(); ++j)
      {
        // Who gets less than it can use gets no less than anybody else.
        ASSERT_TRUE(shares[i] >= needs[i] || shares[i] >= shares[j]);
      }
    }
    ASSERT_LT(total - sum, needs.size());
  }
}
