// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "PyramidLayout.h"

#include <algorithm>
#include <string>

namespace teravox
{

namespace
{
// The directory is always resident and small: 4096 entries of 12 bytes are 48 KiB.
constexpr std::int64_t MaximumDirectoryEntries = 4096;

std::int64_t MultiplySaturated(std::int64_t a, std::int64_t b)
{
  std::int64_t r = 0;
  return __builtin_mul_overflow(a, b, &r) ? std::numeric_limits<std::int64_t>::max() : r;
}

std::int64_t AddSaturated(std::int64_t a, std::int64_t b)
{
  std::int64_t r = 0;
  return __builtin_add_overflow(a, b, &r) ? std::numeric_limits<std::int64_t>::max() : r;
}

std::int64_t Product(const Int3& v)
{
  return MultiplySaturated(MultiplySaturated(v[0], v[1]), v[2]);
}

std::string Text(const Int3& v)
{
  return std::to_string(v[0]) + " x " + std::to_string(v[1]) + " x " + std::to_string(v[2]);
}
} // namespace

Result<PyramidLayout> PyramidLayout::Make(
  const Int3& dimensions, int brickSize, std::vector<Int3> factors)
{
  for (const std::int64_t n : dimensions)
  {
    if (n < 1 || n > std::numeric_limits<std::int32_t>::max())
    {
      return Status(StatusCode::InvalidArgument,
        "The volume has " + Text(dimensions) + " voxels; each axis must have 1 to 2^31 - 1.");
    }
  }
  if (brickSize < 2 || brickSize > 1024)
  {
    return Status(StatusCode::InvalidArgument,
      "The brick size is " + std::to_string(brickSize) + " voxels; it must be 2 to 1024.");
  }
  if (factors.empty() || factors.size() > 32 || factors[0] != Int3{ 1, 1, 1 })
  {
    return Status(
      StatusCode::InvalidArgument, "A pyramid has 1 to 32 levels, the first with factor 1.");
  }
  PyramidLayout layout;
  layout.BrickSize_ = brickSize;
  for (std::size_t l = 0; l < factors.size(); ++l)
  {
    Int3 dims{};
    Int3 bricks{};
    for (std::size_t a = 0; a < 3; ++a)
    {
      const std::int64_t f = factors[l][a];
      if (f < 1 || f > (std::int64_t{ 1 } << 31) || (l > 0 && f % factors[l - 1][a] != 0))
      {
        return Status(StatusCode::InvalidArgument,
          "Level " + std::to_string(l) + " has the downsampling factors " + Text(factors[l]) +
            "; each must be a positive multiple of the level before.");
      }
      dims[a] = CeilDiv(dimensions[a], f);
      bricks[a] = CeilDiv(dims[a], brickSize);
    }
    layout.LevelDims.push_back(dims);
    layout.LevelBricks.push_back(bricks);
  }
  layout.Factors = std::move(factors);
  for (layout.Depth = 1;; ++layout.Depth)
  {
    layout.DirectoryBases.assign(1, 0);
    for (int l = 0; l < layout.NumberOfLevels(); ++l)
    {
      layout.DirectoryBases.push_back(
        AddSaturated(layout.DirectoryBases.back(), Product(layout.Pages(l, layout.Depth))));
    }
    if (layout.DirectoryEntries() <= MaximumDirectoryEntries)
    {
      break;
    }
  }
  return layout;
}

std::vector<Int3> PyramidLayout::DefaultFactors(
  const Int3& dimensions, const Double3& spacing, int brickSize)
{
  std::vector<Int3> factors{ Int3{ 1, 1, 1 } };
  Int3 dims = dimensions;
  Double3 edge{ std::abs(spacing[0]), std::abs(spacing[1]), std::abs(spacing[2]) };
  while (std::max({ dims[0], dims[1], dims[2] }) > brickSize && factors.size() < 32)
  {
    double smallest = std::numeric_limits<double>::infinity();
    for (std::size_t a = 0; a < 3; ++a)
    {
      if (dims[a] > 1)
      {
        smallest = std::min(smallest, edge[a]);
      }
    }
    Int3 f = factors.back();
    for (std::size_t a = 0; a < 3; ++a)
    {
      if (dims[a] > 1 && edge[a] <= smallest * std::sqrt(2.0))
      {
        f[a] *= 2;
        edge[a] *= 2;
        dims[a] = CeilDiv(dimensions[a], f[a]);
      }
    }
    factors.push_back(f);
  }
  return factors;
}

Result<PyramidLayout> PyramidLayout::MakeDefault(
  const Int3& dimensions, const Double3& spacing, int brickSize)
{
  return Make(dimensions, brickSize, DefaultFactors(dimensions, spacing, brickSize));
}

std::int64_t PyramidLayout::TotalBricks() const
{
  std::int64_t total = 0;
  for (const Int3& bricks : this->LevelBricks)
  {
    total = AddSaturated(total, Product(bricks));
  }
  return total;
}

Int3 PyramidLayout::Pages(int level, int pageLevel) const
{
  Int3 pages = this->Bricks(level);
  for (int k = 0; k < pageLevel; ++k)
  {
    for (std::int64_t& n : pages)
    {
      n = CeilDiv(n, PageBlockEdge);
    }
  }
  return pages;
}

} // namespace teravox
