// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "BlankedArray.h"

#include "Types.h"

#include <algorithm>
#include <limits>
#include <new>
#include <set>
#include <string>
#include <vector>
#include <vtkArrayDispatch.h>
#include <vtkCellData.h>
#include <vtkDataArray.h>
#include <vtkDataArrayAccessor.h>
#include <vtkDataSetAttributes.h>
#include <vtkImageData.h>
#include <vtkPointData.h>

namespace teravox
{

namespace
{

vtkUnsignedCharArray* FindGhosts(vtkDataSetAttributes* attributes)
{
  auto* ghosts = vtkUnsignedCharArray::SafeDownCast(
    attributes->GetAbstractArray(vtkDataSetAttributes::GhostArrayName()));
  if (!ghosts)
  {
    return nullptr;
  }
  const unsigned char* first = ghosts->GetPointer(0);
  const unsigned char* last = first + ghosts->GetNumberOfValues();
  return std::any_of(first, last, [](unsigned char g) { return g != 0; }) ? ghosts : nullptr;
}

/// Points and cells of an image by their index, counted from 0.
struct Grid
{
  Int3 Points{};
  Int3 Cells{};

  explicit Grid(vtkImageData* image)
  {
    int dims[3];
    image->GetDimensions(dims);
    for (std::size_t a = 0; a < 3; ++a)
    {
      this->Points[a] = dims[a];
      this->Cells[a] = std::max(dims[a] - 1, 1);
    }
  }
  static std::int64_t Id(const Int3& of, const Int3& at)
  {
    return (at[2] * of[1] + at[1]) * of[0] + at[0];
  }
  template <typename F>
  static void ForEach(const Int3& of, F f)
  {
    Int3 at{};
    for (at[2] = 0; at[2] < of[2]; ++at[2])
    {
      for (at[1] = 0; at[1] < of[1]; ++at[1])
      {
        for (at[0] = 0; at[0] < of[0]; ++at[0])
        {
          f(at);
        }
      }
    }
  }
  /// The cells around a point that the image has.
  template <typename F>
  void ForCellsAround(const Int3& point, F f) const
  {
    for (int n = 0; n < 8; ++n)
    {
      Int3 cell{};
      bool inside = true;
      for (std::size_t a = 0; a < 3; ++a)
      {
        cell[a] = point[a] - (n >> a & 1);
        inside = inside && cell[a] >= 0 && cell[a] < this->Cells[a];
      }
      if (inside)
      {
        f(Id(this->Cells, cell));
      }
    }
  }
  /// The points of a cell; of a flat image fewer than eight.
  template <typename F>
  void ForCorners(const Int3& cell, F f) const
  {
    for (int n = 0; n < 8; ++n)
    {
      Int3 point{};
      bool inside = true;
      for (std::size_t a = 0; a < 3; ++a)
      {
        point[a] = cell[a] + (n >> a & 1);
        inside = inside && point[a] < this->Points[a];
      }
      if (inside)
      {
        f(point);
      }
    }
  }
};

using Flags = std::vector<unsigned char>;

// Cell data: a cell is hidden by itself or by one of its points.
Flags HiddenCells(const Grid& grid, const Blanking& blanking)
{
  Flags hidden(static_cast<std::size_t>(grid.Cells[0] * grid.Cells[1] * grid.Cells[2]), 0);
  Grid::ForEach(grid.Cells,
    [&](const Int3& cell)
    {
      const auto id = Grid::Id(grid.Cells, cell);
      bool is = blanking.Cells && blanking.Cells->GetValue(id) != 0;
      if (blanking.Points && !is)
      {
        grid.ForCorners(cell,
          [&](const Int3& point)
          { is = is || blanking.Points->GetValue(Grid::Id(grid.Points, point)) != 0; });
      }
      hidden[static_cast<std::size_t>(id)] = is ? 1 : 0;
    });
  return hidden;
}

// Point data: the points that are to have no value.
Flags HiddenPoints(const Grid& grid, const Blanking& blanking, std::int64_t& lost)
{
  Flags points(static_cast<std::size_t>(grid.Points[0] * grid.Points[1] * grid.Points[2]), 0);
  const auto at = [&](const Int3& point) -> unsigned char&
  { return points[static_cast<std::size_t>(Grid::Id(grid.Points, point))]; };
  const auto isHidden = [&](std::int64_t cell) { return blanking.Cells->GetValue(cell) != 0; };
  Grid::ForEach(grid.Points,
    [&](const Int3& point)
    {
      bool all = blanking.Cells != nullptr;
      if (all)
      {
        grid.ForCellsAround(point, [&](std::int64_t cell) { all = all && isHidden(cell); });
      }
      at(point) =
        all || (blanking.Points && blanking.Points->GetValue(Grid::Id(grid.Points, point)) != 0);
    });
  if (!blanking.Cells)
  {
    return points;
  }
  const auto isBlank = [&](const Int3& cell)
  {
    bool blank = false;
    grid.ForCorners(cell, [&](const Int3& point) { blank = blank || at(point) != 0; });
    return blank;
  };
  // Thin parts, in the order of the cells.
  std::set<std::int64_t> gone;
  Grid::ForEach(grid.Cells,
    [&](const Int3& cell)
    {
      if (!isHidden(Grid::Id(grid.Cells, cell)) || isBlank(cell))
      {
        return;
      }
      Int3 best{};
      int fewest = 9;
      grid.ForCorners(cell,
        [&](const Int3& point)
        {
          int visible = 0;
          grid.ForCellsAround(point, [&](std::int64_t c) { visible += isHidden(c) ? 0 : 1; });
          if (visible < fewest)
          {
            fewest = visible;
            best = point;
          }
        });
      at(best) = 1;
      grid.ForCellsAround(best,
        [&](std::int64_t c)
        {
          if (!isHidden(c))
          {
            gone.insert(c);
          }
        });
    });
  lost = static_cast<std::int64_t>(gone.size());
  return points;
}

// Any numeric array into one of another type, NaN where it is hidden.
template <typename To>
vtkSmartPointer<vtkDataArray> Copy(vtkDataArray* array, const Flags& hidden, int type)
{
  vtkSmartPointer<vtkDataArray> copy;
  copy.TakeReference(vtkDataArray::CreateDataArray(type));
  copy->SetName(array->GetName());
  copy->SetNumberOfComponents(array->GetNumberOfComponents());
  copy->SetNumberOfTuples(array->GetNumberOfTuples());
  To* out = static_cast<To*>(copy->GetVoidPointer(0));
  const int components = array->GetNumberOfComponents();
  const auto read = [&](auto* from)
  {
    const vtkDataArrayAccessor<std::remove_pointer_t<decltype(from)>> values(from);
    for (vtkIdType i = 0; i < from->GetNumberOfTuples(); ++i)
    {
      for (int c = 0; c < components; ++c)
      {
        *out++ = hidden[static_cast<std::size_t>(i)] != 0 ? std::numeric_limits<To>::quiet_NaN()
                                                          : static_cast<To>(values.Get(i, c));
      }
    }
  };
  if (!vtkArrayDispatch::Dispatch::Execute(array, read))
  {
    read(array);
  }
  return copy;
}

} // namespace

Blanking FindBlanking(vtkImageData* image)
{
  Blanking found;
  found.Points = FindGhosts(image->GetPointData());
  found.Cells = FindGhosts(image->GetCellData());
  return found;
}

Result<BlankedArray> MakeBlankedArray(
  vtkImageData* image, vtkDataArray* array, bool cellData, const Blanking& blanking)
{
  if ((blanking.Points && blanking.Points->GetNumberOfValues() != image->GetNumberOfPoints()) ||
    (blanking.Cells && blanking.Cells->GetNumberOfValues() != image->GetNumberOfCells()))
  {
    return Status(StatusCode::InvalidArgument,
      "The image's ghost array has not one value for each of its points or cells.");
  }
  try
  {
    const Grid grid(image);
    BlankedArray result;
    const Flags hidden =
      cellData ? HiddenCells(grid, blanking) : HiddenPoints(grid, blanking, result.LostCells);
    const bool wide = array->GetDataTypeSize() > 2 && array->GetDataType() != VTK_FLOAT;
    result.Array =
      wide ? Copy<double>(array, hidden, VTK_DOUBLE) : Copy<float>(array, hidden, VTK_FLOAT);
    return result;
  }
  catch (const std::bad_alloc&)
  {
    return Status(StatusCode::ResourceExhausted,
      "The memory for a copy of the array, without what is hidden, can't be had.");
  }
}

} // namespace teravox
