// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "PyramidCells.h"

#include "PyramidFormat.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <type_traits>

namespace teravox
{

namespace
{
constexpr std::int64_t Edge = PyramidFormat::CellEdge;

template <typename T>
T Load(const std::byte* p)
{
  T v{};
  std::memcpy(&v, p, sizeof(T));
  return v;
}

template <typename T>
void Store(std::byte* p, T v)
{
  std::memcpy(p, &v, sizeof(T));
}

// Rounding in the sum of squares and the root is less than this.
constexpr double RoundUp = 1 + 1e-6;

float UpperFloat(double v)
{
  const double up = v * RoundUp;
  return up > static_cast<double>(std::numeric_limits<float>::max())
    ? std::numeric_limits<float>::infinity()
    : std::nextafter(static_cast<float>(up), std::numeric_limits<float>::infinity());
}

/// Ranges and largest squared gradients of the columns of voxels in one row of cells: whole rows at
/// a time, element by element, which compilers turn into vector instructions. Cells follow by
/// reducing their eight columns.
template <typename T>
class CellRowScanner
{
public:
  // 32-bit floats hold differences of 8- and 16-bit integers exactly.
  using Real = std::conditional_t<sizeof(T) <= 2, float, double>;

  CellRowScanner(int components, const T* voxels, const Int3& start, const Int3& size,
    const Int3& dimensions, const Double3& spacing)
    : Voxels(voxels)
    , Start(start)
    , Size(size)
    , Dimensions(dimensions)
    , Stride{ components, size[0] * components, size[0] * size[1] * components }
    , Low(static_cast<std::size_t>(size[0] * components))
    , High(this->Low.size())
    , Squared(this->Low.size())
  {
    // Relative to the smallest spacing, so that units of any size don't leave a float's range.
    this->Unit = 1 / std::min({ spacing[0], spacing[1], spacing[2] });
    for (std::size_t a = 0; a < 3; ++a)
    {
      this->Half[a] = static_cast<Real>(0.5 / (spacing[a] * this->Unit));
    }
  }

  /// The voxels with y and z in [low, high).
  void Scan(const Int3& low, const Int3& high)
  {
    std::fill(this->Low.begin(), this->Low.end(), Highest());
    std::fill(this->High.begin(), this->High.end(), Lowest());
    std::fill(this->Squared.begin(), this->Squared.end(), Real{ 0 });
    for (std::int64_t z = low[2]; z < high[2]; ++z)
    {
      for (std::int64_t y = low[1]; y < high[1]; ++y)
      {
        const T* row = this->Voxels + z * this->Stride[2] + y * this->Stride[1];
        AddRange(row, this->Low.size(), this->Low.data(), this->High.data());
        this->AddGradient(row, y, z);
      }
    }
  }

  /// Of the cell with x in [from, to). False: it has no value.
  bool Reduce(
    std::int64_t from, std::int64_t to, int component, ValueRange& range, double& magnitude) const
  {
    T low = Highest();
    T high = Lowest();
    Real squared = 0;
    for (std::int64_t x = from; x < to; ++x)
    {
      const auto i = static_cast<std::size_t>(x * this->Stride[0] + component);
      low = std::min(low, this->Low[i]);
      high = std::max(high, this->High[i]);
      squared = std::max(squared, this->Squared[i]);
    }
    range = low <= high ? ValueRange{ static_cast<double>(low), static_cast<double>(high) }
                        : ValueRange::Void();
    magnitude = std::sqrt(static_cast<double>(squared)) * this->Unit;
    return low <= high;
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

  // Comparisons with NaN are false: it is left out.
  static void AddRange(const T* row, std::size_t n, T* __restrict low, T* __restrict high)
  {
    for (std::size_t i = 0; i < n; ++i)
    {
      const T v = row[i];
      low[i] = v < low[i] ? v : low[i];
      high[i] = v > high[i] ? v : high[i];
    }
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
    for (const std::int64_t x : { std::int64_t{ 0 }, this->Size[0] - 1 })
    {
      if (this->Neighbours(0, x, below[0], above[0], weight[0]))
      {
        AddSquares(row, x * stride, (x + 1) * stride, below, above, weight, this->Squared.data());
      }
    }
    // Between the two there are neighbours on both sides.
    below[0] = -stride;
    above[0] = stride;
    weight[0] = this->Half[0];
    AddSquares(row, stride, n - stride, below, above, weight, this->Squared.data());
  }

  static Real Square(const T* v, std::int64_t below, std::int64_t above, Real weight)
  {
    const Real d = (static_cast<Real>(v[above]) - static_cast<Real>(v[below])) * weight;
    // NaN beside a value: the gradient isn't defined along this axis.
    return std::is_floating_point_v<T> && !(d == d) ? Real{ 0 } : d * d;
  }

  static void AddSquares(const T* row, std::int64_t from, std::int64_t to,
    const std::array<std::int64_t, 3> below, const std::array<std::int64_t, 3> above,
    const std::array<Real, 3> weight, Real* __restrict out)
  {
    for (std::int64_t i = from; i < to; ++i)
    {
      const T* v = row + i;
      Real sum = Square(v, below[0], above[0], weight[0]);
      sum += Square(v, below[1], above[1], weight[1]);
      sum += Square(v, below[2], above[2], weight[2]);
      out[i] = sum > out[i] ? sum : out[i];
    }
  }

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
};
} // namespace

PyramidCells::PyramidCells(ScalarType type, int components, const Int3& start, const Int3& size)
  : Type(type)
  , Components(components)
  , Start(start)
  , Size(size)
{
  const std::size_t n = this->Count() * static_cast<std::size_t>(components);
  this->Ranges.resize(2 * n * SizeOf(type));
  this->Gradients.resize(n);
}

ValueRange PyramidCells::Range(std::size_t index) const
{
  return DispatchScalarType(this->Type,
    [&](auto example)
    {
      using T = decltype(example);
      const T low = Load<T>(this->Ranges.data() + 2 * index * sizeof(T));
      const T high = Load<T>(this->Ranges.data() + (2 * index + 1) * sizeof(T));
      return low <= high ? ValueRange{ static_cast<double>(low), static_cast<double>(high) }
                         : ValueRange::Void();
    });
}

void PyramidCells::SetRange(std::size_t index, const ValueRange& range)
{
  DispatchScalarType(this->Type,
    [&](auto example)
    {
      using T = decltype(example);
      T low = static_cast<T>(0);
      T high = static_cast<T>(0);
      if (std::is_floating_point_v<T> || !range.IsVoid())
      {
        low = static_cast<T>(range.Min);
        high = static_cast<T>(range.Max);
      }
      Store(this->Ranges.data() + 2 * index * sizeof(T), low);
      Store(this->Ranges.data() + (2 * index + 1) * sizeof(T), high);
    });
}

ValueRange PyramidCells::TotalRange() const
{
  ValueRange r = ValueRange::Void();
  for (std::size_t i = 0; i < this->Gradients.size(); ++i)
  {
    r.Include(this->Range(i));
  }
  return r;
}

bool PyramidCells::IsFill(const std::byte* fillValue) const
{
  const std::size_t size = SizeOf(this->Type);
  for (std::size_t i = 0; i < this->Ranges.size(); i += size)
  {
    if (std::memcmp(this->Ranges.data() + i, fillValue, size) != 0)
    {
      return false;
    }
  }
  return std::all_of(
    this->Gradients.begin(), this->Gradients.end(), [](float g) { return g == 0; });
}

PyramidCells PyramidCells::FromVoxels(ScalarType type, int components, const void* voxels,
  const Int3& start, const Int3& size, const Int3& dimensions, const Double3& spacing)
{
  PyramidCells cells(type, components, { start[0] / Edge, start[1] / Edge, start[2] / Edge },
    { CeilDiv(size[0], Edge), CeilDiv(size[1], Edge), CeilDiv(size[2], Edge) });
  DispatchScalarType(type,
    [&](auto example)
    {
      using T = decltype(example);
      const std::int64_t rows = cells.Size[1] * cells.Size[2];
#pragma omp parallel for schedule(dynamic, 4)
      for (std::int64_t row = 0; row < rows; ++row)
      {
        CellRowScanner<T> scanner(
          components, static_cast<const T*>(voxels), start, size, dimensions, spacing);
        const std::int64_t y = row % cells.Size[1];
        const std::int64_t z = row / cells.Size[1];
        scanner.Scan({ 0, y * Edge, z * Edge },
          { size[0], std::min((y + 1) * Edge, size[1]), std::min((z + 1) * Edge, size[2]) });
        for (std::int64_t x = 0; x < cells.Size[0]; ++x)
        {
          for (int c = 0; c < components; ++c)
          {
            const std::size_t i = cells.Index({ x, y, z }, c);
            ValueRange range = ValueRange::Void();
            double magnitude = 0;
            const bool any =
              scanner.Reduce(x * Edge, std::min((x + 1) * Edge, size[0]), c, range, magnitude);
            cells.SetRange(i, range);
            cells.Gradients[i] = any && !range.IsKnown() ? std::numeric_limits<float>::infinity()
              : magnitude > 0                            ? UpperFloat(magnitude)
                                                         : 0.0F;
          }
        }
      }
    });
  return cells;
}

PyramidCells PyramidCells::Coarser() const
{
  PyramidCells coarse(this->Type, this->Components,
    { this->Start[0] / Edge, this->Start[1] / Edge, this->Start[2] / Edge },
    { CeilDiv(this->Size[0], Edge), CeilDiv(this->Size[1], Edge), CeilDiv(this->Size[2], Edge) });
  std::vector<ValueRange> ranges(coarse.Gradients.size(), ValueRange::Void());
  Int3 cell{};
  for (cell[2] = 0; cell[2] < this->Size[2]; ++cell[2])
  {
    for (cell[1] = 0; cell[1] < this->Size[1]; ++cell[1])
    {
      for (cell[0] = 0; cell[0] < this->Size[0]; ++cell[0])
      {
        for (int c = 0; c < this->Components; ++c)
        {
          const std::size_t from = this->Index(cell, c);
          const std::size_t to =
            coarse.Index({ cell[0] / Edge, cell[1] / Edge, cell[2] / Edge }, c);
          ranges[to].Include(this->Range(from));
          coarse.Gradients[to] = std::max(coarse.Gradients[to], this->Gradients[from]);
        }
      }
    }
  }
  for (std::size_t i = 0; i < ranges.size(); ++i)
  {
    coarse.SetRange(i, ranges[i]);
  }
  return coarse;
}

void PyramidCells::BoundGradients(const Int3& low, const Int3& high, const Double3& spacing)
{
  Int3 cell{};
  for (cell[2] = low[2]; cell[2] < high[2]; ++cell[2])
  {
    for (cell[1] = low[1]; cell[1] < high[1]; ++cell[1])
    {
      for (cell[0] = low[0]; cell[0] < high[0]; ++cell[0])
      {
        for (int c = 0; c < this->Components; ++c)
        {
          double squared = 0;
          for (std::size_t a = 0; a < 3; ++a)
          {
            ValueRange around = this->Range(this->Index(cell, c));
            double weight = 0.5 / spacing[a];
            for (const std::int64_t step : { -1, 1 })
            {
              Int3 other = cell;
              other[a] += step;
              if (other[a] >= 0 && other[a] < this->Size[a])
              {
                around.Include(this->Range(this->Index(other, c)));
              }
              else
              {
                weight = 1 / spacing[a]; // one-sided at the end of the level
              }
            }
            const double d = around.IsVoid() ? 0 : (around.Max - around.Min) * weight;
            squared += d * d;
          }
          float& gradient = this->Gradients[this->Index(cell, c)];
          gradient = std::max(gradient, squared > 0 ? UpperFloat(std::sqrt(squared)) : 0.0F);
        }
      }
    }
  }
}

} // namespace teravox
