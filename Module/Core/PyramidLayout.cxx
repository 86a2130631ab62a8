// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "PyramidLayout.h"

#include <algorithm>
#include <string>

namespace teravox
{

namespace
{
constexpr std::size_t MaximumLevels = 32;
// The directory is always resident and small: 4096 entries of 12 bytes are 48 KiB. Each level has
// its share, whatever the others take, so that its depth doesn't depend on the volume around it.
constexpr std::int64_t MaximumDirectoryEntries = 4096;
constexpr std::int64_t MaximumEntriesOfLevel = MaximumDirectoryEntries / MaximumLevels;

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

Status CheckPages(const PageShape& pages)
{
  const Int3& edge = pages.BlockEdge;
  const std::int64_t smallest = std::min({ edge[0], edge[1], edge[2] });
  const std::int64_t largest = std::max({ edge[0], edge[1], edge[2] });
  // An automatic depth needs blocks that get fewer along each axis.
  if (smallest < (pages.Depth < 0 ? 2 : 1) || largest > 1024 || pages.Depth > 31)
  {
    return Status(StatusCode::InvalidArgument,
      "Page blocks of " + Text(edge) + " entries at depth " + std::to_string(pages.Depth) +
        " can't be; edges are 2 to 1024, or 1 with a given depth of at most 31.");
  }
  return {};
}
} // namespace

Result<PyramidLayout> PyramidLayout::Make(
  const Int3& dimensions, int brickSize, std::vector<Int3> factors, const PageShape& pages)
{
  const Status pageStatus = CheckPages(pages);
  if (!pageStatus)
  {
    return pageStatus;
  }
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
  if (factors.empty() || factors.size() > MaximumLevels || factors[0] != Int3{ 1, 1, 1 })
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
  layout.PageEdge_ = pages.BlockEdge;
  layout.DirectoryBases.assign(1, 0);
  for (int l = 0; l < layout.NumberOfLevels(); ++l)
  {
    int depth = pages.Depth < 0 ? 1 : pages.Depth;
    while (pages.Depth < 0 && Product(layout.Pages(l, depth)) > MaximumEntriesOfLevel)
    {
      ++depth;
    }
    layout.Depths.push_back(depth);
    layout.DirectoryBases.push_back(
      AddSaturated(layout.DirectoryBases.back(), Product(layout.Pages(l, depth))));
  }
  return layout;
}

std::vector<Int3> PyramidLayout::DefaultFactors(
  const Int3& dimensions, const Double3& spacing, int brickSize)
{
  std::vector<Int3> factors{ Int3{ 1, 1, 1 } };
  Int3 dims = dimensions;
  Double3 edge{ std::abs(spacing[0]), std::abs(spacing[1]), std::abs(spacing[2]) };
  while (std::max({ dims[0], dims[1], dims[2] }) > brickSize && factors.size() < MaximumLevels)
  {
    // An axis that has waited for the others so long that it would not fit one brick at the last
    // level allowed can't wait any more.
    const std::int64_t longest =
      MultiplySaturated(brickSize, std::int64_t{ 1 } << (MaximumLevels - 1 - factors.size()));
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
      if (dims[a] > 1 && (edge[a] <= smallest * std::sqrt(2.0) || dims[a] > longest))
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

int PyramidLayout::PageDepth() const
{
  return this->Depths.empty() ? 1 : *std::max_element(this->Depths.begin(), this->Depths.end());
}

Int3 PyramidLayout::Pages(int level, int pageLevel) const
{
  Int3 pages = this->Bricks(level);
  for (int k = 0; k < pageLevel; ++k)
  {
    for (std::size_t a = 0; a < 3; ++a)
    {
      pages[a] = CeilDiv(pages[a], this->PageEdge_[a]);
    }
  }
  return pages;
}

Int3 PyramidLayout::PageOf(const Int3& voxel, int pageLevel) const
{
  Int3 page{};
  for (std::size_t a = 0; a < 3; ++a)
  {
    page[a] = voxel[a] / this->BrickSize_;
    for (int k = 0; k < pageLevel; ++k)
    {
      page[a] /= this->PageEdge_[a];
    }
  }
  return page;
}

Int3 PyramidLayout::VirtualDimensions(int level) const
{
  Int3 dims = this->Pages(level, this->PageDepth(level));
  for (std::size_t a = 0; a < 3; ++a)
  {
    for (int k = 0; k < this->PageDepth(level); ++k)
    {
      dims[a] = MultiplySaturated(dims[a], this->PageEdge_[a]);
    }
    dims[a] = MultiplySaturated(dims[a], this->BrickSize_);
  }
  return dims;
}

} // namespace teravox
