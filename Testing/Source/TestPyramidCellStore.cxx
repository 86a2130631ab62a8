// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// Statistics are in the file as they were written, whatever is kept of them meanwhile.
#include "HDF5Lock.h"
#include "PyramidFileWriter.h"
#include "PyramidFormat.h"
#include "TestPyramidSupport.h"

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <gtest/gtest.h>
#include <random>
#include <string>
#include <vector>

namespace teravox
{

namespace
{

/// All cells of a level, as they are to be.
struct Expected
{
  Int3 Size{ 0, 0, 0 };
  int Components = 1;
  std::vector<std::int16_t> Ranges;
  std::vector<float> Gradients;

  void Transfer(PyramidCells& cells, bool write)
  {
    for (std::int64_t z = 0; z < cells.Size[2]; ++z)
    {
      for (std::int64_t y = 0; y < cells.Size[1]; ++y)
      {
        for (std::int64_t x = 0; x < cells.Size[0]; ++x)
        {
          const std::int64_t at =
            ((z + cells.Start[2]) * this->Size[1] + y + cells.Start[1]) * this->Size[0] + x +
            cells.Start[0];
          for (int c = 0; c < this->Components; ++c)
          {
            const std::size_t from = cells.Index({ x, y, z }, c);
            const auto to = static_cast<std::size_t>(at * this->Components + c);
            auto* range = cells.Ranges.data() + 4 * from;
            auto* own = this->Ranges.data() + 2 * to;
            std::memcpy(write ? static_cast<void*>(own) : range,
              write ? static_cast<const void*>(range) : own, 4);
            write ? this->Gradients[to] = cells.Gradients[from]
                  : cells.Gradients[from] = this->Gradients[to];
          }
        }
      }
    }
  }
};

} // namespace

TEST(PyramidCellStore, KeepsWhatWasWrittenWhateverIsKept)
{
  const teravox::testing::TemporaryFolder folder;
  std::vector<std::uintmax_t> sizes;
  for (const std::uint64_t budget : { std::uint64_t{ 1 } << 30, std::uint64_t{ 0 } })
  {
    for (const int components : { 1, 3 })
    {
      VoxelReader::Description volume;
      volume.Dimensions = { 600, 270, 310 };
      volume.Type = ScalarType::Int16;
      volume.Components = components;
      volume.FillValue = -7;
      const PyramidLayout layout =
        PyramidLayout::MakeDefault(volume.Dimensions, volume.Spacing, 64).Value();
      const std::string file = folder.Path() + "/cells.h5";
      auto writer = PyramidFileWriter::Create(file, volume, {}, layout);
      ASSERT_TRUE(writer.Ok()) << writer.GetStatus().Message();
      writer.Value()->SetCellMemory(budget);
      std::vector<Expected> levels(2);
      for (std::size_t l = 0; l < levels.size(); ++l)
      {
        Expected& e = levels[l];
        e.Components = components;
        for (std::size_t a = 0; a < 3; ++a)
        {
          e.Size[a] = CeilDiv(layout.Dimensions(static_cast<int>(l))[a], PyramidFormat::CellEdge);
        }
        const auto n = static_cast<std::size_t>(e.Size[0] * e.Size[1] * e.Size[2] * components);
        e.Ranges.assign(2 * n, -7);
        e.Gradients.assign(n, 0);
      }
      std::mt19937_64 random(11);
      const auto below = [&](std::int64_t n)
      { return static_cast<std::int64_t>(random() % static_cast<std::uint64_t>(n)); };
      for (int i = 0; i < 200; ++i)
      {
        const auto level = static_cast<std::size_t>(below(2));
        Expected& e = levels[level];
        Int3 start{};
        Int3 size{};
        for (std::size_t a = 0; a < 3; ++a)
        {
          start[a] = below(e.Size[a]);
          size[a] = 1 + below(std::min<std::int64_t>(20, e.Size[a] - start[a]));
        }
        PyramidCells cells(volume.Type, components, start, size);
        if (i % 3 == 0)
        {
          PyramidCells wanted = cells;
          e.Transfer(wanted, false);
          ASSERT_TRUE(writer.Value()
                        ->ReadCells(static_cast<int>(level), PyramidFormat::CellEdge, cells)
                        .Ok());
          ASSERT_EQ(cells.Ranges, wanted.Ranges) << i;
          ASSERT_EQ(cells.Gradients, wanted.Gradients) << i;
          continue;
        }
        for (std::byte& b : cells.Ranges)
        {
          b = static_cast<std::byte>(below(256));
        }
        for (float& g : cells.Gradients)
        {
          g = static_cast<float>(below(1000));
        }
        e.Transfer(cells, true);
        ASSERT_TRUE(
          writer.Value()->WriteCells(static_cast<int>(level), PyramidFormat::CellEdge, cells).Ok());
      }
      ASSERT_TRUE(writer.Value()->Finish({ -7, 100 }, {}).Ok());
      writer.Value().reset(); // it holds a lock on the file
      // Read by HDF5 itself.
      const HDF5Lock lock;
      const HDF5Handle written(H5Fopen(file.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT));
      for (std::size_t l = 0; l < levels.size(); ++l)
      {
        const std::string group =
          std::string(PyramidFormat::StatisticsGroup) + "/" + std::to_string(l) + "/8";
        const HDF5Handle ranges(H5Dopen2(written.Get(), (group + "/Range").c_str(), H5P_DEFAULT));
        const HDF5Handle gradients(
          H5Dopen2(written.Get(), (group + "/Gradient").c_str(), H5P_DEFAULT));
        std::vector<std::int16_t> r(levels[l].Ranges.size());
        std::vector<float> g(levels[l].Gradients.size());
        ASSERT_GE(
          H5Dread(ranges.Get(), H5T_NATIVE_INT16, H5S_ALL, H5S_ALL, H5P_DEFAULT, r.data()), 0);
        ASSERT_GE(
          H5Dread(gradients.Get(), H5T_NATIVE_FLOAT, H5S_ALL, H5S_ALL, H5P_DEFAULT, g.data()), 0);
        EXPECT_EQ(r, levels[l].Ranges) << l;
        EXPECT_EQ(g, levels[l].Gradients) << l;
      }
      // Where a single chunk is kept, others are written more than once.
      sizes.push_back(std::filesystem::file_size(file));
    }
  }
  ASSERT_EQ(sizes.size(), 4u);
  EXPECT_GT(sizes[2], sizes[0]);
  EXPECT_GT(sizes[3], sizes[1]);
}

} // namespace teravox
