// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

namespace teravox::test
{

/// Functions of the kernel as one instruction set compiles them, eight lanes each. Plain pointers:
/// vector types and inline functions must not be shared between translation units.
struct KernelFunctions
{
  using Lane8 = float[8];

  void (*ExpOfMinus)(const Lane8& x, Lane8& result);
  float (*ExpOfMinusOne)(float x);
  void (*PowerOf)(const Lane8& x, float power, Lane8& result);
  void (*OpacityOf)(const Lane8& depth, Lane8& result);
  void (*CentroidOf)(const Lane8& front, const Lane8& back, const Lane8& depth, Lane8& result);
  /// Of one channel: values and slopes per node at the ends of pieces of `dx` nodes.
  void (*KinkOf)(
    const Lane8 (&values)[2], const Lane8 (&slopes)[2], const Lane8& dx, Lane8& mean, Lane8& error);
  void (*TurningPoints)(const Lane8 (&cubic)[4], Lane8& first, Lane8& second);
  /// Four vectors to eight rows, and these to vectors again.
  void (*Transpose)(const Lane8 (&columns)[4], float (&rows)[8][4], Lane8 (&again)[4]);
  /// Corners x + 2 y + 4 z; `w` and `d` are vectors of three.
  void (*CubicAlong)(
    const Lane8 (&corners)[8], const Lane8 (&w)[3], const Lane8 (&d)[3], Lane8 (&cubic)[4]);
  /// Corners of the cells of a brick of edge^3 texels that begin at these voxels, and the cubics of
  /// the central differences along x, y and z; of texels of 1, 2 (integers) or 4 bytes (floats).
  void (*LoadGradient)(int bytesPerTexel, const std::uint8_t* texels, int edge,
    const std::int32_t (&voxels)[8], const Lane8 (&w)[3], const Lane8 (&d)[3], Lane8 (&corners)[8],
    Lane8 (&cubics)[3][4]);
};

/// For any processor.
KernelFunctions BaselineKernelFunctions();
#if TERAVOX_HAS_AVX2_KERNEL
/// Requires: a processor that has AVX2.
KernelFunctions AVX2KernelFunctions();
#endif

} // namespace teravox::test
