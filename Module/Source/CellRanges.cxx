// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "CellRanges.h"

#include "ParallelFor.h"

#include <algorithm>

namespace teravox
{

namespace
{
template <typename F>
void ForEachCell(const VoxelBox& cells, const F& f)
{
  for (std::int64_t z = cells.Low[2]; z < cells.High[2]; ++z)
  {
    for (std::int64_t y = cells.Low[1]; y < cells.High[1]; ++y)
    {
      for (std::int64_t x = cells.Low[0]; x < cells.High[0]; ++x)
      {
        f(Int3{ x, y, z });
      }
    }
  }
}

std::size_t Index(const Int3& cell, const Int3& dims)
{
  return static_cast<std::size_t>((cell[2] * dims[1] + cell[1]) * dims[0] + cell[0]);
}

VoxelBox CellBox(const Int3& cell, std::int64_t edge, const Int3& dims)
{
  VoxelBox box;
  for (std::size_t a = 0; a < 3; ++a)
  {
    box.Low[a] = cell[a] * edge;
    box.High[a] = std::min(box.Low[a] + edge, dims[a]);
  }
  return box;
}

bool Covers(const VoxelBox& outer, const VoxelBox& inner)
{
  for (std::size_t a = 0; a < 3; ++a)
  {
    if (inner.Low[a] < outer.Low[a] || inner.High[a] > outer.High[a])
    {
      return false;
    }
  }
  return true;
}

VoxelBox Intersect(const VoxelBox& a, const VoxelBox& b)
{
  VoxelBox box;
  for (std::size_t i = 0; i < 3; ++i)
  {
    box.Low[i] = std::max(a.Low[i], b.Low[i]);
    box.High[i] = std::min(a.High[i], b.High[i]);
  }
  return box;
}
} // namespace

CellRanges::CellRanges(const Int3& dimensions, const ScanFunction& scan)
  : Dimensions(dimensions)
{
  Int3 below = dimensions;
  for (std::int64_t edge = CellEdge;; edge *= CellEdge)
  {
    Grid grid;
    grid.Edge = edge;
    for (std::size_t a = 0; a < 3; ++a)
    {
      grid.Dimensions[a] = CeilDiv(below[a], CellEdge);
    }
    const Int3& dims = grid.Dimensions;
    grid.Cells.assign(static_cast<std::size_t>(dims[0] * dims[1] * dims[2]), ValueRange::Void());
    const Grid* const finer = this->Grids.empty() ? nullptr : &this->Grids.back();
    ParallelFor(dims[2] * dims[1],
      [&](std::int64_t row)
      {
        const std::int64_t y = row % dims[1];
        const std::int64_t z = row / dims[1];
        for (std::int64_t x = 0; x < dims[0]; ++x)
        {
          const Int3 cell{ x, y, z };
          ValueRange& range = grid.Cells[Index(cell, dims)];
          if (finer == nullptr)
          {
            range = scan(CellBox(cell, edge, dimensions));
            continue;
          }
          RangeUnion all;
          ForEachCell(CellBox(cell, CellEdge, finer->Dimensions),
            [&](const Int3& child) { all.Include(finer->Cells[Index(child, finer->Dimensions)]); });
          range = all.Get();
        }
      });
    below = dims;
    this->Grids.push_back(std::move(grid));
    if (below == Int3{ 1, 1, 1 })
    {
      break;
    }
  }
}

ValueRange CellRanges::Query(const VoxelBox& box, const ScanFunction& scan) const
{
  RangeUnion range;
  if (!box.IsEmpty() && !this->Grids.empty())
  {
    this->Descend(static_cast<int>(this->Grids.size()) - 1, box,
      VoxelBox{ { 0, 0, 0 }, this->Grids.back().Dimensions }, scan, range);
  }
  return range.Get();
}

void CellRanges::Descend(int grid, const VoxelBox& box, const VoxelBox& cells,
  const ScanFunction& scan, RangeUnion& range) const
{
  const Grid& g = this->Grids[static_cast<std::size_t>(grid)];
  VoxelBox touched;
  for (std::size_t a = 0; a < 3; ++a)
  {
    touched.Low[a] = box.Low[a] / g.Edge;
    touched.High[a] = CeilDiv(box.High[a], g.Edge);
  }
  ForEachCell(Intersect(touched, cells),
    [&](const Int3& cell)
    {
      const ValueRange& known = g.Cells[Index(cell, g.Dimensions)];
      if (known.IsVoid())
      {
        range.SomeAreVoid = true;
        return;
      }
      if (range.Range.Contains(known))
      {
        return;
      }
      const VoxelBox voxels = CellBox(cell, g.Edge, this->Dimensions);
      if (Covers(box, voxels))
      {
        range.Include(known);
      }
      else if (grid == 0)
      {
        range.Include(scan(Intersect(box, voxels)));
      }
      else
      {
        const Grid& finer = this->Grids[static_cast<std::size_t>(grid) - 1];
        this->Descend(grid - 1, box, CellBox(cell, CellEdge, finer.Dimensions), scan, range);
      }
    });
}

std::uint64_t CellRanges::MemoryUsed() const
{
  std::uint64_t bytes = 0;
  for (const Grid& grid : this->Grids)
  {
    bytes += grid.Cells.size() * sizeof(ValueRange);
  }
  return bytes;
}

std::uint64_t CellRanges::BytesFor(const Int3& dimensions)
{
  double bytes = 0;
  for (Int3 cells = dimensions;;)
  {
    double count = 1;
    for (std::int64_t& n : cells)
    {
      n = CeilDiv(n, CellEdge);
      count *= static_cast<double>(n);
    }
    bytes += count * sizeof(ValueRange);
    if (cells == Int3{ 1, 1, 1 })
    {
      return bytes < 0x1p62 ? static_cast<std::uint64_t>(bytes) : std::uint64_t{ 1 } << 62;
    }
  }
}

} // namespace teravox
