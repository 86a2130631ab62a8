// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "TruthCamera.h"

#include <cassert>
#include <cmath>

namespace teravox
{
namespace
{

Double3 Cross(const Double3& a, const Double3& b)
{
  return { a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0] };
}

} // namespace

TruthCamera::TruthCamera(
  const Matrix4& viewFromWorld, const Matrix4& projection, int width, int height)
  : ViewFromWorld(viewFromWorld)
  , WorldFromView(Invert(viewFromWorld))
  , ViewFromClip(Invert(projection))
  , Width_(width)
  , Height_(height)
{
  assert(width > 0 && height > 0);
  // x_ndc = (P00 x + P02 z_view + ...) / (P32 z_view + P33), z_view = -depth: a pixel is 2 / width
  // wide in x_ndc.
  const double scale = 2 / (projection[0] * width);
  this->PixelWidthAt0 = projection[15] * scale;
  this->PixelWidthPerDepth = -projection[14] * scale;
}

Matrix4 TruthCamera::LookAt(
  const Double3& position, const Double3& focalPoint, const Double3& viewUp)
{
  const Double3 back = Normalize(position - focalPoint);
  const Double3 right = Normalize(Cross(viewUp, back));
  const Double3 up = Cross(back, right);
  return { right[0], right[1], right[2], -Dot(right, position), up[0], up[1], up[2],
    -Dot(up, position), back[0], back[1], back[2], -Dot(back, position), 0, 0, 0, 1 };
}

Matrix4 TruthCamera::Frustum(
  double left, double right, double bottom, double top, double near, double far)
{
  return { 2 * near / (right - left), 0, (right + left) / (right - left), 0, 0,
    2 * near / (top - bottom), (top + bottom) / (top - bottom), 0, 0, 0,
    -(far + near) / (far - near), -2 * far * near / (far - near), 0, 0, -1, 0 };
}

Matrix4 TruthCamera::Ortho(
  double left, double right, double bottom, double top, double near, double far)
{
  return { 2 / (right - left), 0, 0, -(right + left) / (right - left), 0, 2 / (top - bottom), 0,
    -(top + bottom) / (top - bottom), 0, 0, -2 / (far - near), -(far + near) / (far - near), 0, 0,
    0, 1 };
}

TruthRay TruthCamera::Ray(int x, int y, double offsetX, double offsetY) const
{
  const double xClip = 2 * (x + 0.5 + offsetX) / this->Width_ - 1;
  const double yClip = 2 * (y + 0.5 + offsetY) / this->Height_ - 1;
  const Double3 nearPoint = TransformPoint(this->ViewFromClip, { xClip, yClip, -1 });
  const Double3 farPoint = TransformPoint(this->ViewFromClip, { xClip, yClip, 1 });
  const Double3 along = farPoint - nearPoint;
  const Double3 direction = Normalize(along);

  TruthRay ray;
  ray.Origin = TransformPoint(this->WorldFromView, nearPoint);
  ray.Direction = Normalize(TransformVector(this->WorldFromView, direction));
  ray.Length = Length(along);
  ray.DepthAtOrigin = -nearPoint[2];
  ray.DepthPerLength = -direction[2];
  ray.Eye = TransformPoint(this->WorldFromView, { 0, 0, 0 });
  return ray;
}

} // namespace teravox
