// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "TruthMath.h"

namespace teravox
{

/// The line of sight of a pixel, from the near plane to the far plane.
struct TruthRay
{
  Double3 Origin{};          ///< on the near plane, world
  Double3 Direction{};       ///< unit vector, world
  double Length = 0;         ///< up to the far plane, world
  double DepthAtOrigin = 0;  ///< view depth z of the origin
  double DepthPerLength = 1; ///< growth of the view depth along the ray, in (0, 1]
  Double3 Eye{};             ///< position of the camera, world (also in parallel projection)

  Double3 At(double t) const { return this->Origin + t * this->Direction; }
  double DepthAt(double t) const { return this->DepthAtOrigin + t * this->DepthPerLength; }
  double LengthAtDepth(double depth) const
  {
    return (depth - this->DepthAtOrigin) / this->DepthPerLength;
  }
};

/// Rays and pixel sizes from OpenGL's view and projection matrices: perspective, off-axis,
/// parallel. Thread: immutable.
class TruthCamera
{
public:
  /// The view matrix is rigid; the projection maps the near plane to -1 and the far plane to +1.
  TruthCamera(const Matrix4& viewFromWorld, const Matrix4& projection, int width, int height);

  /// As vtkCamera has them: position, focal point, view up.
  static Matrix4 LookAt(const Double3& position, const Double3& focalPoint, const Double3& viewUp);
  /// As glFrustum.
  static Matrix4 Frustum(
    double left, double right, double bottom, double top, double near, double far);
  /// As glOrtho.
  static Matrix4 Ortho(
    double left, double right, double bottom, double top, double near, double far);

  int Width() const { return this->Width_; }
  int Height() const { return this->Height_; }
  /// The ray through (x + 0.5 + offsetX, y + 0.5 + offsetY) pixels; origin lower left.
  TruthRay Ray(int x, int y, double offsetX = 0, double offsetY = 0) const;
  /// Width of a pixel in world units at a view depth: PixelWidth(z) = PixelWidthAt0 +
  /// PixelWidthPerDepth * z. Constant in parallel, proportional to z in perspective projection.
  double PixelWidth(double depth) const
  {
    return this->PixelWidthAt0 + this->PixelWidthPerDepth * depth;
  }
  bool IsParallel() const { return this->PixelWidthPerDepth == 0; }

private:
  Matrix4 ViewFromWorld{};
  Matrix4 WorldFromView{};
  Matrix4 ViewFromClip{};
  int Width_ = 1;
  int Height_ = 1;
  double PixelWidthAt0 = 0;
  double PixelWidthPerDepth = 0;
};

} // namespace teravox
