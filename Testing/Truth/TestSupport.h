// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "TruthIntegrator.h"

#include <cmath>
#include <utility>
#include <vector>

namespace teravox
{

/// A parallel camera that looks along +z with one pixel of the given width around (x, y); the near
/// plane lies at world z = zNear, the far plane at zFar.
inline TruthCamera CameraAlongZ(double x, double y, double zNear, double zFar, double width = 1e-3)
{
  return TruthCamera(TruthCamera::LookAt({ x, y, zNear - 1 }, { x, y, zNear }, { 0, 1, 0 }),
    TruthCamera::Ortho(-width / 2, width / 2, -width / 2, width / 2, 1, 1 + zFar - zNear), 1, 1);
}

/// A parallel camera whose one ray runs from a point to another one (near plane to far plane).
inline TruthCamera CameraBetween(const Double3& from, const Double3& to)
{
  const Double3 along = Normalize(to - from);
  const Double3 up = std::fabs(along[1]) < 0.9 ? Double3{ 0, 1, 0 } : Double3{ 1, 0, 0 };
  return TruthCamera(TruthCamera::LookAt(from - along, from, up),
    TruthCamera::Ortho(-1e-3, 1e-3, -1e-3, 1e-3, 1, 1 + Length(to - from)), 1, 1);
}

template <typename F>
TruthVolume OneLevel(const F& function, const Int3& dimensions,
  TruthInterpolation interpolation = TruthInterpolation::Linear, bool cellData = false,
  const Matrix4& worldFromVoxel = IdentityMatrix())
{
  return TruthVolume(
    { TruthLevel::FromFunction(function, dimensions) }, worldFromVoxel, interpolation, cellData);
}

/// Opacity and colour that don't depend on the value; no knots.
inline TruthTransfer Uniform(double alpha, const Double3& color, double unitDistance = 1)
{
  return TruthTransfer(
    [=](double) { return alpha; }, [=](double) { return color; }, {}, unitDistance);
}

/// sigma(v) given directly (unit distance 1), with one colour.
template <typename F>
TruthTransfer FromExtinction(const F& sigma, const Double3& color, std::vector<double> knots = {})
{
  return TruthTransfer([=](double v) { return -std::expm1(-sigma(v)); },
    [=](double) { return color; }, std::move(knots), 1);
}

/// Bits of a 64-bit counter, well mixed: reproducible random numbers in [0, 1) by index.
inline double Hash01(std::int64_t i, std::int64_t j, std::int64_t k, std::uint64_t seed = 1)
{
  std::uint64_t h = seed * 0x9E3779B97F4A7C15ull;
  for (const std::int64_t part : { i, j, k })
  {
    h = (h ^ static_cast<std::uint64_t>(part)) * 0xBF58476D1CE4E5B9ull;
    h ^= h >> 29;
    h *= 0x94D049BB133111EBull;
    h ^= h >> 32;
  }
  return std::ldexp(static_cast<double>(h >> 11), -53);
}

} // namespace teravox
