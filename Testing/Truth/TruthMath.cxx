// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "TruthMath.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace teravox
{

Matrix4 IdentityMatrix()
{
  return { 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1 };
}

Matrix4 Multiply(const Matrix4& a, const Matrix4& b)
{
  Matrix4 result{};
  for (std::size_t row = 0; row < 4; ++row)
  {
    for (std::size_t column = 0; column < 4; ++column)
    {
      long double sum = 0;
      for (std::size_t k = 0; k < 4; ++k)
      {
        sum += static_cast<long double>(a[4 * row + k]) * b[4 * k + column];
      }
      result[4 * row + column] = static_cast<double>(sum);
    }
  }
  return result;
}

Matrix4 Invert(const Matrix4& m)
{
  // Gauss-Jordan with row pivots.
  std::array<std::array<long double, 8>, 4> work{};
  for (std::size_t row = 0; row < 4; ++row)
  {
    for (std::size_t column = 0; column < 4; ++column)
    {
      work[row][column] = m[4 * row + column];
    }
    work[row][4 + row] = 1;
  }
  for (std::size_t column = 0; column < 4; ++column)
  {
    std::size_t pivot = column;
    for (std::size_t row = column + 1; row < 4; ++row)
    {
      if (std::fabs(work[row][column]) > std::fabs(work[pivot][column]))
      {
        pivot = row;
      }
    }
    std::swap(work[pivot], work[column]);
    assert(work[column][column] != 0);
    const long double scale = 1 / work[column][column];
    for (long double& entry : work[column])
    {
      entry *= scale;
    }
    for (std::size_t row = 0; row < 4; ++row)
    {
      const long double factor = work[row][column];
      if (row != column && factor != 0)
      {
        for (std::size_t k = 0; k < 8; ++k)
        {
          work[row][k] -= factor * work[column][k];
        }
      }
    }
  }
  Matrix4 result{};
  for (std::size_t row = 0; row < 4; ++row)
  {
    for (std::size_t column = 0; column < 4; ++column)
    {
      result[4 * row + column] = static_cast<double>(work[row][4 + column]);
    }
  }
  return result;
}

Double3 TransformPoint(const Matrix4& m, const Double3& p)
{
  std::array<double, 4> result{};
  for (std::size_t row = 0; row < 4; ++row)
  {
    result[row] =
      m[4 * row] * p[0] + m[4 * row + 1] * p[1] + m[4 * row + 2] * p[2] + m[4 * row + 3];
  }
  return { result[0] / result[3], result[1] / result[3], result[2] / result[3] };
}

Double3 TransformVector(const Matrix4& m, const Double3& v)
{
  return { m[0] * v[0] + m[1] * v[1] + m[2] * v[2], m[4] * v[0] + m[5] * v[1] + m[6] * v[2],
    m[8] * v[0] + m[9] * v[1] + m[10] * v[2] };
}

Double3 TransformVector(const Matrix3& m, const Double3& v)
{
  return { m[0] * v[0] + m[1] * v[1] + m[2] * v[2], m[3] * v[0] + m[4] * v[1] + m[5] * v[2],
    m[6] * v[0] + m[7] * v[1] + m[8] * v[2] };
}

double Dot(const Double3& a, const Double3& b)
{
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

double Length(const Double3& a)
{
  return std::sqrt(Dot(a, a));
}

Double3 Normalize(const Double3& a)
{
  // Scaled first, so that tiny gradients (1e-200) don't underflow to zero.
  const double scale = std::max({ std::fabs(a[0]), std::fabs(a[1]), std::fabs(a[2]) });
  if (!(scale > 0) || !std::isfinite(scale))
  {
    return { 0, 0, 0 };
  }
  const Double3 scaled = (1 / scale) * a;
  const double length = Length(scaled);
  return length > 0 ? (1 / length) * scaled : Double3{ 0, 0, 0 };
}

} // namespace teravox
