// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "TestFormatsSupport.h"
#include "VoxelReader.h"

#include <algorithm>
#include <random>

namespace teravox::testing
{

inline bool EndsWith(const std::string& text, const std::string& end)
{
  return text.size() >= end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

/// A line of names.txt, as image_files.py writes it.
struct Listed
{
  std::string Name;
  std::string Array;
  std::string Type;
  std::array<double, 19> Numbers{}; // components, size, spacing, origin, direction
};

inline std::vector<Listed> ListOf(const FormatFiles& files)
{
  std::vector<Listed> all;
  std::ifstream in(files.File("names.txt"));
  Listed one;
  while (in >> one.Name >> one.Array >> one.Type)
  {
    for (double& number : one.Numbers)
    {
      in >> number;
    }
    all.push_back(one);
  }
  return all;
}

/// The place and all voxels, those of boxes anywhere, too.
inline void ExpectIsListed(
  VoxelReader& reader, const Listed& one, const FormatFiles& files, std::mt19937& random)
{
  const VoxelReader::Description d = reader.Describe();
  const std::array<double, 19>& n = one.Numbers;
  EXPECT_EQ(d.Components, static_cast<int>(n[0]));
  EXPECT_EQ(ToString(d.Type), one.Type);
  for (std::size_t a = 0; a < 3; ++a)
  {
    ASSERT_EQ(d.Dimensions.at(a), static_cast<std::int64_t>(n.at(1 + a)));
    EXPECT_NEAR(d.Spacing.at(a), n.at(4 + a), 1e-6);
    EXPECT_NEAR(d.Origin.at(a), n.at(7 + a), 1e-5);
  }
  for (std::size_t i = 0; i < 9; ++i)
  {
    EXPECT_NEAR(d.Direction.at(i), n.at(10 + i), 1e-6) << i;
  }
  const std::vector<std::byte> truth = files.Array(one.Array);
  const std::size_t voxel = SizeOf(d.Type) * static_cast<std::size_t>(d.Components);
  // The whole, then boxes anywhere, also backwards.
  for (int trial = 0; trial < 12; ++trial)
  {
    Int3 start{ 0, 0, 0 };
    Int3 size = d.Dimensions;
    for (std::size_t a = 0; a < 3 && trial > 0; ++a)
    {
      start.at(a) = static_cast<std::int64_t>(random() % static_cast<unsigned>(size.at(a)));
      size.at(a) =
        1 + static_cast<std::int64_t>(random() % static_cast<unsigned>(size.at(a) - start.at(a)));
    }
    std::vector<std::byte> box(static_cast<std::size_t>(size[0] * size[1] * size[2]) * voxel);
    const Status status = reader.ReadBox(start, size, box.data());
    ASSERT_TRUE(status.Ok()) << status.Message();
    std::size_t at = 0;
    bool same = true;
    for (std::int64_t z = start[2]; z < start[2] + size[2]; ++z)
    {
      for (std::int64_t y = start[1]; y < start[1] + size[1]; ++y)
      {
        const auto row = static_cast<std::size_t>(size[0]) * voxel;
        const auto from =
          static_cast<std::size_t>((z * d.Dimensions[1] + y) * d.Dimensions[0] + start[0]) * voxel;
        same = same && std::memcmp(box.data() + at, truth.data() + from, row) == 0;
        at += row;
      }
    }
    ASSERT_TRUE(same) << "box " << trial;
  }
}

/// Reads the last slice, if it isn't large; a compressed file may claim anything.
inline Status LastSlice(VoxelReader& reader)
{
  const VoxelReader::Description d = reader.Describe();
  const double size = static_cast<double>(SizeOf(d.Type)) * d.Components *
    static_cast<double>(d.Dimensions[0]) * static_cast<double>(d.Dimensions[1]);
  if (size >= 1e7)
  {
    return {};
  }
  std::vector<std::byte> slice(static_cast<std::size_t>(size));
  return reader.ReadBox(
    { 0, 0, d.Dimensions[2] - 1 }, { d.Dimensions[0], d.Dimensions[1], 1 }, slice.data());
}

} // namespace teravox::testing
