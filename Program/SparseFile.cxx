// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "SparseFile.h"

#include "Interrupt.h"
#include "PyramidWriter.h"
#include "VoxelReader.h"

#include <algorithm>

namespace teravox::program
{
namespace
{

constexpr std::int64_t CornerShare = 16;
constexpr std::int64_t PartsPerCorner = 8;

class SparseReader : public VoxelReader
{
public:
  explicit SparseReader(std::int64_t edge)
    : Edge(edge)
    , Corner(edge / CornerShare)
  {
  }

  Description Describe() const override
  {
    Description volume;
    volume.Dimensions = { this->Edge, this->Edge, this->Edge };
    volume.Type = ScalarType::UInt16;
    volume.CellData = true; // its bounds are those of the cube, whatever the voxels
    return volume;
  }

  Status ReadBox(const Int3& start, const Int3& size, void* out) override
  {
    auto* to = static_cast<std::uint16_t*>(out);
    for (std::int64_t z = start[2]; z < start[2] + size[2]; ++z)
    {
      for (std::int64_t y = start[1]; y < start[1] + size[1]; ++y)
      {
        for (std::int64_t x = start[0]; x < start[0] + size[0]; ++x)
        {
          *to++ = this->ValueAt(x, y, z);
        }
      }
    }
    return {};
  }

  bool IsConstant(const Int3& start, const Int3& size, double* value) override
  {
    bool low = true;
    bool high = true;
    for (std::size_t a = 0; a < 3; ++a)
    {
      low = low && start[a] < this->Corner;
      high = high && start[a] + size[a] > this->Edge - this->Corner;
    }
    *value = 0;
    return !low && !high;
  }

private:
  std::uint16_t ValueAt(std::int64_t x, std::int64_t y, std::int64_t z) const
  {
    const bool low = std::max({ x, y, z }) < this->Corner;
    const bool high = std::min({ x, y, z }) >= this->Edge - this->Corner;
    const std::int64_t part = (x + 2 * y + 3 * z) * PartsPerCorner / this->Corner;
    return static_cast<std::uint16_t>(low || high ? (low ? 120 : 200) + 10 * (part % 5) : 0);
  }

  const std::int64_t Edge;
  const std::int64_t Corner;
};

} // namespace

Status WriteSparseFile(const std::string& fileName, std::int64_t edge)
{
  if (edge <= 0 || edge % (CornerShare * PartsPerCorner) != 0)
  {
    return { StatusCode::InvalidArgument,
      "A sparse file has a multiple of " + std::to_string(CornerShare * PartsPerCorner) +
        " voxels per axis." };
  }
  SparseReader reader(edge);
  PyramidWriterOptions options;
  options.MemoryLimit = std::uint64_t{ 256 } << 20;
  options.Progress = [](std::uint64_t, std::uint64_t) { return !WasInterrupted(); };
  return PyramidWriter::Write(fileName, reader, options).GetStatus();
}

} // namespace teravox::program
