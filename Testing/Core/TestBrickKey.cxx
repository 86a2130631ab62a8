// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "BrickKey.h"

#include <gtest/gtest.h>
#include <random>
#include <set>
#include <unordered_set>
#include <vector>

namespace teravox
{

namespace
{
/// Keys that differ from `key` in one field each.
std::vector<BrickKey> Neighbours(const BrickKey& key)
{
  std::vector<BrickKey> keys(8, key);
  ++keys[0].Volume;
  ++keys[1].Time;
  ++keys[2].Component;
  ++keys[3].Level;
  ++keys[4].PageLevel;
  ++keys[5].X;
  ++keys[6].Y;
  ++keys[7].Z;
  return keys;
}
} // namespace

TEST(BrickKey, EachFieldCountsInEqualityOrderAndHash)
{
  const BrickKey key{ 1, 2, 3, 4, 5, 6, 7, 8 };
  for (const BrickKey& other : Neighbours(key))
  {
    EXPECT_NE(key, other);
    EXPECT_TRUE(key < other);
    EXPECT_FALSE(other < key);
    EXPECT_NE(BrickKeyHash()(key), BrickKeyHash()(other));
  }
  EXPECT_FALSE(key < key);
}

TEST(BrickKey, OrderIsTotalOnRandomKeys)
{
  std::mt19937_64 random(20240501);
  std::set<BrickKey> ordered;
  std::unordered_set<BrickKey, BrickKeyHash> hashed;
  for (int i = 0; i < 5000; ++i)
  {
    const auto small = [&] { return static_cast<std::uint32_t>(random() % 5); };
    const BrickKey key{ small(), small(), static_cast<std::uint16_t>(small()),
      static_cast<std::uint8_t>(small()), static_cast<std::uint8_t>(small()), small(), small(),
      small() };
    EXPECT_EQ(ordered.insert(key).second, hashed.insert(key).second);
  }
  EXPECT_EQ(ordered.size(), hashed.size());
}

TEST(BrickKey, HashSpreadsARegularGrid)
{
  std::unordered_set<std::size_t> low;
  for (std::uint32_t i = 0; i < 64 * 64; ++i)
  {
    BrickKey key;
    key.X = i % 64;
    key.Y = i / 64;
    low.insert(BrickKeyHash()(key) % 4096);
  }
  // A random function hits 1 - 1/e = 63 % of the cells.
  EXPECT_GT(low.size(), 2400u);
}

TEST(BrickKey, TextNamesWhatIsNotZero)
{
  BrickKey key;
  key.Level = 2;
  key.X = 3;
  key.Z = 7;
  EXPECT_EQ(key.ToString(), "level 2, brick (3, 0, 7)");
  key.PageLevel = 1;
  key.Time = 4;
  EXPECT_EQ(key.ToString(), "level 2, page level 1 (3, 0, 7), time step 4");
}

} // namespace teravox
