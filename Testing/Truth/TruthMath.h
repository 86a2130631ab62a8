// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "Types.h"

#include <array>

namespace teravox
{

/// 4x4 matrix, rows first, applied to column vectors (as vtkMatrix4x4).
using Matrix4 = std::array<double, 16>;
/// 3x3 matrix, rows first.
using Matrix3 = std::array<double, 9>;

/// The identity.
Matrix4 IdentityMatrix();
Matrix4 Multiply(const Matrix4& a, const Matrix4& b);
/// Requires: m is regular (asserted); worked in extended precision.
Matrix4 Invert(const Matrix4& m);
/// With the division by w.
Double3 TransformPoint(const Matrix4& m, const Double3& p);
/// The linear part only.
Double3 TransformVector(const Matrix4& m, const Double3& v);
Double3 TransformVector(const Matrix3& m, const Double3& v);

inline Double3 operator+(const Double3& a, const Double3& b)
{
  return { a[0] + b[0], a[1] + b[1], a[2] + b[2] };
}
inline Double3 operator-(const Double3& a, const Double3& b)
{
  return { a[0] - b[0], a[1] - b[1], a[2] - b[2] };
}
inline Double3 operator*(double s, const Double3& a)
{
  return { s * a[0], s * a[1], s * a[2] };
}
double Dot(const Double3& a, const Double3& b);
double Length(const Double3& a);
/// The null vector (and one with a NaN) becomes the null vector.
Double3 Normalize(const Double3& a);

} // namespace teravox
