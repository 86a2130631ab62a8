// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "PyramidCellScan.h"

#include "PyramidFormat.h"
#include "VoxelLoops.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <type_traits>
#include <vector>

namespace teravox
{

namespace
{
constexpr std::int64_t Edge = PyramidFormat::CellEdge;

/// Ranges and largest squared gradients of the columns of voxels in one row of cells: whole rows at
/// a time. Cells follow by reducing their eight columns.
template <typename T>
class CellRowScanner
{
public:
  using Real = typename VoxelLoops<T>::Real;

  CellRowScanner(int components, const T* voxels, const Int3& start, const Int3& size,
    const Int3& dimensions, const Double3& spacing)
    : Voxels(voxels)
    , Start(start)
    , Size(size)
    , Dimensions(dimensions)
    , Stride{ components, size[0] * components, size[0] * size[1] * components }
    , Low(static_cast<std::size_t>(size[0] * components), Highest())
    , High(this->Low.size(), Lowest())
    , Squared(this->Low.size())
    , HasNaN(std::is_floating_point_v<T> ? this->Low.size() : 0)
  {
    // Relative to the smallest spacing, so that units of any size don't leave a float's range.
    this->Unit = 1 / std::min({ spacing[0], spacing[1], spacing[2] });
    for (std::size_t a = 0; a < 3; ++a)
    {
      this->Half[a] = static_cast<Real>(0.5 / (spacing[a] * this->Unit));
    }
  }

  /// The voxels with y and z in [low, high); once.
  void Scan(const Int3& low, const Int3& high)
  {
    for (std::int64_t z = low[2]; z < high[2]; ++z)
    {
      for (std::int64_t y = low[1]; y < high[1]; ++y)
      {
        const T* row = this->Voxels + z * this->Stride[2] + y * this->Stride[1];
        this->Loops.AddRange(
          row, this->Low.size(), this->Low.data(), this->High.data(), this->HasNaN.data());
        this->AddGradient(row, y, z);
      }
    }
  }

  /// Of the cell with x in [from, to).
  void Reduce(
    std::int64_t from, std::int64_t to, int component, std::byte* range, float& gradient) const
  {
    T low = Highest();
    T high = Lowest();
    Real squared = 0;
    bool hasNaN = false;
    for (std::int64_t x = from; x < to; ++x)
    {
      const auto i = static_cast<std::size_t>(x * this->Stride[0] + component);
      low = std::min(low, this->Low[i]);
      high = std::max(high, this->High[i]);
      squared = std::max(squared, this->Squared[i]);
      if constexpr (std::is_floating_point_v<T>)
      {
        hasNaN = hasNaN || this->HasNaN[i] != this->HasNaN[i];
      }
    }
    const double magnitude = std::sqrt(static_cast<double>(squared)) * this->Unit;
    gradient = magnitude > 0 ? PyramidCells::UpperFloat(magnitude) : 0.0F;
    if constexpr (std::is_floating_point_v<T>)
    {
      // NaN beside one value: not a single one, see NotSingle().
      high = hasNaN && low == high ? std::nextafter(high, Highest()) : high;
      low = hasNaN && low == high ? std::nextafter(low, T{ 0 }) : low; // of infinity
      const bool known = std::isfinite(low) && std::isfinite(high);
      gradient = low <= high && !known ? std::numeric_limits<float>::infinity() : gradient;
    }
    std::memcpy(range, &low, sizeof(low));
    std::memcpy(range + sizeof(low), &high, sizeof(high));
  }

private:
  static constexpr T Highest()
  {
    return std::is_floating_point_v<T> ? std::numeric_limits<T>::infinity()
                                       : std::numeric_limits<T>::max();
  }
  static constexpr T Lowest()
  {
    return std::is_floating_point_v<T> ? -std::numeric_limits<T>::infinity()
                                       : std::numeric_limits<T>::lowest();
  }

  // Neighbours along one axis as offsets from the voxel, and the weight of their difference. At the
  // ends of the level the one-sided difference bounds VTK's clamped one. False at a seam.
  bool Neighbours(
    std::size_t axis, std::int64_t i, std::int64_t& below, std::int64_t& above, Real& weight) const
  {
    const bool first = this->Start[axis] + i == 0;
    const bool last = this->Start[axis] + i == this->Dimensions[axis] - 1;
    if ((i == 0 && !first) || (i == this->Size[axis] - 1 && !last))
    {
      return false;
    }
    below = first ? 0 : -this->Stride[axis];
    above = last ? 0 : this->Stride[axis];
    weight = first || last ? 2 * this->Half[axis] : this->Half[axis];
    return true;
  }

  void AddGradient(const T* row, std::int64_t y, std::int64_t z)
  {
    std::array<std::int64_t, 3> below{};
    std::array<std::int64_t, 3> above{};
    std::array<Real, 3> weight{};
    if (!this->Neighbours(1, y, below[1], above[1], weight[1]) ||
      !this->Neighbours(2, z, below[2], above[2], weight[2]))
    {
      return;
    }
    const std::int64_t n = this->Size[0] * this->Stride[0];
    const std::int64_t stride = this->Stride[0];
    const auto add = [&](std::int64_t from, std::int64_t to)
    {
      this->Loops.AddSquares(row + from, static_cast<std::size_t>(to - from), below.data(),
        above.data(), weight.data(), this->Squared.data() + from);
    };
    for (const std::int64_t x : { std::int64_t{ 0 }, this->Size[0] - 1 })
    {
      if (this->Neighbours(0, x, below[0], above[0], weight[0]))
      {
        add(x * stride, (x + 1) * stride);
      }
    }
    // Between the two there are neighbours on both sides.
    below[0] = -stride;
    above[0] = stride;
    weight[0] = this->Half[0];
    if (n > 2 * stride)
    {
      add(stride, n - stride);
    }
  }

  const VoxelLoops<T>& Loops = VoxelLoops<T>::Get();
  const T* Voxels;
  Int3 Start;
  Int3 Size;
  Int3 Dimensions;
  Int3 Stride;
  std::array<Real, 3> Half{};
  double Unit = 1;
  std::vector<T> Low;
  std::vector<T> High;
  std::vector<Real> Squared;
  std::vector<T> HasNaN; // NaN where a value of the column is; of floats only
};
} // namespace

PyramidCellScan::PyramidCellScan(PyramidCells& cells, const std::byte* voxels, const Int3& start,
  const Int3& size, const Int3& dimensions, const Double3& spacing)
  : Cells(cells)
  , Voxels(voxels)
  , Start(start)
  , Size(size)
  , Dimensions(dimensions)
  , Spacing(spacing)
{
}

std::int64_t PyramidCellScan::RowsOf(std::int64_t slices) const
{
  // A layer of cells needs the slice beyond it.
  return slices >= this->Size[2]
    ? this->Rows()
    : std::max<std::int64_t>(0, slices - 1) / Edge * this->Cells.Size[1];
}

template <typename T>
void PyramidCellScan::ScanTyped(std::int64_t row) const
{
  const int components = this->Cells.Components;
  CellRowScanner<T> scanner(components, reinterpret_cast<const T*>(this->Voxels), this->Start,
    this->Size, this->Dimensions, this->Spacing);
  const std::int64_t y = row % this->Cells.Size[1];
  const std::int64_t z = row / this->Cells.Size[1];
  scanner.Scan({ 0, y * Edge, z * Edge },
    { this->Size[0], std::min((y + 1) * Edge, this->Size[1]),
      std::min((z + 1) * Edge, this->Size[2]) });
  for (std::int64_t x = 0; x < this->Cells.Size[0]; ++x)
  {
    for (int c = 0; c < components; ++c)
    {
      const std::size_t i = this->Cells.Index({ x, y, z }, c);
      scanner.Reduce(x * Edge, std::min((x + 1) * Edge, this->Size[0]), c,
        this->Cells.Ranges.data() + 2 * i * sizeof(T), this->Cells.Gradients[i]);
    }
  }
}

void PyramidCellScan::Scan(std::int64_t row) const
{
  DispatchScalarType(
    this->Cells.Type, [&](auto example) { this->ScanTyped<decltype(example)>(row); });
}

} // namespace teravox
