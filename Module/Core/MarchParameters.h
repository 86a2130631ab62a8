// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace teravox
{

/// What a ray makes of the field that it meets. The numbers are those of TERAVOX_BLEND in
/// Shaders/Variant.glsl.
enum class BlendKind : int
{
  Composite = 0,
  Maximum = 1,
  Minimum = 2,
  Average = 3,
  Additive = 4,
  Isosurface = 5,
  Slice = 6
};

/// What both marchers need to know of a picture: the uniform block of
/// Shaders/Library/Bindings.glsl, std140: vectors of four only. Each member is described there.
struct MarchParameters
{
  using Vec = std::array<float, 4>;
  using UVec = std::array<std::uint32_t, 4>;
  std::array<Vec, 3> RayOrigin{};
  std::array<Vec, 3> RayDirection{};
  std::array<Vec, 3> RayWorld{};
  UVec Anchor{};
  UVec Dimensions{};
  UVec Levels{};
  std::array<UVec, 32> LevelFactor{};
  std::array<UVec, 32> LevelBricks{};
  std::array<Vec, 32> LevelStart{};
  UVec Atlas{};
  Vec Value{};
  Vec Transfer{};
  Vec Step{};
  UVec Limits{};
  UVec Switches{};
  Vec Material{};
  Vec LightDiffuse{};
  Vec LightSpecular{};
  std::array<Vec, 3> Normal{};
  std::array<Vec, 3> Dataset{};
  Vec Eye{};
  static constexpr std::size_t MaximumIsoValues = 256;
  Vec Projection{};
  std::array<Vec, MaximumIsoValues / 4> IsoValues{};
  std::array<Vec, MaximumIsoValues> IsoColors{};
  std::array<Vec, 5> Crop{};
  static constexpr std::size_t MaximumComponents = 4;
  UVec Components{};
  std::array<Vec, MaximumComponents> ComponentTransfer{};
  std::array<Vec, MaximumComponents> ComponentTable{};
  std::array<Vec, MaximumComponents> ComponentMaterial{};
  Vec Gradient{};
  std::array<Vec, MaximumComponents> ComponentProjection{};
  /// What rays of several components hold in blend modes other than composite, in the place of each
  /// colour and of the transmittance, before they meet anything.
  static constexpr float NothingMet = -3.0e38f;
  std::array<Vec, 2> Plane{};
  std::array<Vec, MaximumComponents> ComponentGradient{};
  static constexpr std::size_t MaximumClippedPlanes = 16;
  Vec Clipped{};
  std::array<Vec, MaximumClippedPlanes> ClippedPlanes{};
};

/// How far a clipping plane lies behind the ray of a pixel (x, y) at depth t, kept where it is not
/// negative: (w0 + w1 x + w2 y) + t (w4 + w5 x + w6 y).
using PlaneAlongRays = std::array<float, 8>;

/// Where the rays of a picture may run.
struct IntervalParameters
{
  std::array<float, 3> BoxLow{};
  std::array<float, 3> BoxHigh{};
  /// The block of the volume that is drawn; the box, or more, where that is all of it.
  std::array<float, 3> BlockLow{};
  std::array<float, 3> BlockHigh{};
  bool HasBlock = false;
  float Near = 0; ///< view depths
  float Far = 0;
  bool HasDepth = false;              ///< the view state holds the opaque depth
  std::array<float, 4> DepthToView{}; ///< view depth = (x + y d) / (z + w d)
  /// Pixels outside see nothing of the box: left, bottom, right, top, the last two exclusive.
  std::array<int, 4> Rectangle{};
};

} // namespace teravox
