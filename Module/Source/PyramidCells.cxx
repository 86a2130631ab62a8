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

} // namespace

float PyramidCells::UpperFloat(double magnitude)
{
  // Rounding in the sum of squares and the root is less than this.
  constexpr double roundUp = 1 + 1e-6;
  const double up = magnitude * roundUp;
  if (up > static_cast<double>(std::numeric_limits<float>::max()))
  {
    return std::numeric_limits<float>::infinity();
  }
  // The next float, of a number that isn't negative; nextafter() costs as much as a row of voxels.
  const auto near = static_cast<float>(up);
  std::uint32_t bits = 0;
  std::memcpy(&bits, &near, sizeof(bits));
  ++bits;
  float next = 0;
  std::memcpy(&next, &bits, sizeof(next));
  return next;
}

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

PyramidCells PyramidCells::Covering(
  ScalarType type, int components, const Int3& start, const Int3& size)
{
  return { type, components, { start[0] / Edge, start[1] / Edge, start[2] / Edge },
    { CeilDiv(size[0], Edge), CeilDiv(size[1], Edge), CeilDiv(size[2], Edge) } };
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
