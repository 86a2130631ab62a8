// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "MarchParameters.h"

#include <cstdint>
#include <limits>

namespace teravox
{

struct NativeReport;

/// Everything that a pass of the native marcher reads and writes, as plain pointers: what the
/// bindings of Shaders/Library/Bindings.glsl are for the GLSL one. Thread: shared by all threads
/// of a pass; rays write their own pixels, stamps are single bytes written atomically.
struct NativeScene
{
  static constexpr int MacroEdge = 4;            ///< cells along each axis whose bits are one word
  static constexpr std::uint8_t RayDeferred = 1; ///< of Lattice: it isn't cast yet
  static constexpr std::uint8_t RayInside = 2;   ///< of Lattice: it meets the volume
  static constexpr std::uint8_t RayBetween = 4;  ///< of Lattice: it will be interpolated
  /// Reach of a ray that has met nothing.
  static constexpr float NothingReached = -std::numeric_limits<float>::max();
  /// Of Lattice: it isn't what interpolation would have given.
  static constexpr std::uint8_t RaySurprising = 8;
  static constexpr std::uint8_t RayJudged = 16; ///< of Lattice: whether it is, is known
  const MarchParameters* Parameters = nullptr;
  const IntervalParameters* Intervals = nullptr;
  const float* Planes = nullptr; ///< PlaneAlongRays, one after the other
  int NumberOfPlanes = 0;
  const MarchParameters::Vec* Lights = nullptr; ///< see LightSetup.h; null: one headlight

  const std::uint8_t* Voxels = nullptr; ///< slot after slot, x fastest; readable 8 bytes around
  const std::uint8_t* Cells = nullptr;  ///< least and largest texel per cell of CellEdge^3 voxels
  /// Per slot and MacroEdge^3 cells, x fastest, a word with one bit per cell that may be visible
  /// and one with a bit per cell of one value; valid where the slot's version is that of the table.
  /// Filled by the first ray that comes by.
  std::uint64_t* Occupancy = nullptr;
  std::uint32_t* OccupancyVersion = nullptr;
  std::uint32_t TableVersion = 1;           ///< of the transfer table; not 0
  const float* SlotTable = nullptr;         ///< offset (pair), scale, unused; for relative formats
  const std::uint32_t* PageTable = nullptr; ///< entries of three words: state and slot, low, high
  const float* Integrals = nullptr;         ///< TransferTable::Integrals
  const std::uint32_t* Colors = nullptr;    ///< TransferTable::Colors
  const std::uint16_t* Occupied = nullptr;  ///< TransferTable::Occupied

  const float* Extremes = nullptr;  ///< TransferTable::Extremes
  const float* Variation = nullptr; ///< TransferTable::Variation
  int Blocks = 0;                   ///< TransferTable::Blocks
  int ExtremesBlock = 0;            ///< TransferTable::ExtremesBlock
  /// GradientTable::Values; null: none. Not in another blend mode than composite; of kernels of
  /// their own, and of several components.
  const float* GradientOpacity = nullptr;
  /// TransferPlane: Nodes (null: none), Bounds, First, Columns. Under the same conditions, of one
  /// component or over two, not with a mask; the (first one's) table is an upper bound of it.
  const float* Plane = nullptr;
  const float* PlaneBounds = nullptr;
  const std::int32_t* PlaneFirst = nullptr;
  int PlaneColumns = 0;

  /// Of voxels with several components: one table each. The table above isn't read then.
  struct ComponentTable
  {
    const float* Integrals = nullptr;
    const std::uint32_t* Colors = nullptr;
    const std::uint16_t* Occupied = nullptr;
    const float* Extremes = nullptr;
    int Blocks = 0;
  };
  std::array<ComponentTable, MarchParameters::MaximumComponents> ComponentTables{};
  int Components = 1; ///< slots hold component after component
  /// Of a label mask: what BuildLabelTables() made, by the mask's value; the tables above are [0]
  /// of them, Blocks and nodes those of all. Null: a binary mask, or none.
  struct LabelTable
  {
    const float* Integrals = nullptr;
    const std::uint32_t* Colors = nullptr;
    const std::uint16_t* Occupied = nullptr;
    const float* Extremes = nullptr;
    const float* Variation = nullptr;
    const float* GradientOpacity = nullptr;
  };
  const LabelTable* LabelTables = nullptr;

  int Width = 0; ///< pixels
  int Height = 0;
  float* Color = nullptr;           ///< premultiplied colour, transmittance
  std::int32_t* Position = nullptr; ///< brick; level | interval << 8 | status << 16
  const float* Depth = nullptr;     ///< opaque depth, 0..1
  float* Error = nullptr;           ///< estimate of the colour's error so far, or nothing
  /// Of averages of several components: lengths where values count, four per pixel.
  float* Lengths = nullptr;
  float* FirstHit = nullptr; ///< depth and level at which the transmittance is Value[3], or nothing

  /// Of a picture of which some pixels are interpolated (ImageLattice.h), else null: per pixel
  /// what is known of its ray (RayDeferred, RayInside), and what it may have missed
  /// (KernelWatch.h).
  std::uint8_t* Lattice = nullptr;
  float* Missed = nullptr;
  float* Reach = nullptr;     ///< depth behind which a ray met nothing that may be visible
  float LatticeTolerance = 0; ///< LatticeLimits
  float LatticeMissed = 0;
  float LatticeDistance = 0;

  std::uint8_t* UsedSlots = nullptr;  ///< set to 1
  std::uint8_t* UsedBlocks = nullptr; ///< set to 1

  std::uint32_t BytesPerTexel = 1;
  bool FloatTexels = false;
  bool Masked = false; ///< slots hold a mask behind the voxels; no FixedStep
  bool Nearest = false;
  bool FixedStep = false;
  bool Shade = false;
  bool Interactive = false;
  bool ShowLevel = false;
  /// Of Slice, Depth isn't that of opaque geometry, but that along the rays at which the slice is
  /// met; NaN where it isn't.
  BlendKind Blend = BlendKind::Composite;
};

/// What the rays of one tile report.
struct NativeReport
{
  /// Called for each ray that misses a brick.
  void (*Request)(void* context, int level, const std::uint32_t* brick, float weight) = nullptr;
  void* Context = nullptr;
  std::uint64_t Samples = 0; ///< cells or samples of the field looked at
  /// Of them those for which colour and opacity were computed, but for lanes behind a ray's end;
  /// those that added something; and those whose gradient was computed.
  std::uint64_t Evaluated = 0;
  std::uint64_t Contributing = 0;
  std::uint64_t Gradients = 0;
  std::uint64_t Visits = 0; ///< bricks, and empty regions that were left at once
  bool Waiting = false;
  bool Unfinished = false;
  bool Fallback = false;
};

/// One pass over the pixels left <= x < right, bottom <= y < top.
using NativeKernel = void (*)(
  const NativeScene& scene, int left, int bottom, int right, int top, NativeReport& report);

/// How the pixels that a stage of a picture's lattice adds are decided on. Each step is done with
/// all tiles before the next.
enum class LatticeStep
{
  Choose, ///< which of them are interpolated; the others have to be cast
  Judge,  ///< which of the others, now cast, aren't what interpolation would have given
  Spread, ///< those next to such ones have to be cast, too: then to be judged again
  Fill,   ///< interpolates what is left
};

/// Of a tile: pixels that became ones to cast, of them those that aren't yet, and those that turned
/// out surprising.
struct LatticeCount
{
  std::uint32_t Chosen = 0;
  std::uint32_t ToCast = 0;
  std::uint32_t Surprising = 0;
};

/// One step with the pixels of a tile that stage `stage` of a picture's lattice adds.
using NativeRefiner = LatticeCount (*)(
  const NativeScene& scene, int stage, LatticeStep step, int left, int bottom, int right, int top);

/// Turns what a projection mode gathered into premultiplied colour and transmittance, for all
/// pixels of a picture.
using NativeResolver = void (*)(const NativeScene& scene);

/// The kernel for this processor: for AVX2 where it has that, else for any. Both draw the same to
/// the bit. TERAVOX_NATIVE_ISA=baseline in the environment chooses the latter, for tests.
NativeKernel ChooseNativeKernel();
NativeRefiner ChooseNativeRefiner();
/// The same for voxels with several components.
NativeKernel ChooseComponentKernel();
/// The same for scenes with GradientOpacity or a Plane.
NativeKernel ChooseGradientKernel();
/// The same for volumes with a mask, without and with GradientOpacity.
NativeKernel ChooseMaskKernel(bool gradientOpacity);
NativeResolver ChooseNativeResolver();
NativeResolver ChooseComponentResolver();

} // namespace teravox
