// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "VoxelReader.h"

#include <cstdint>
#include <vector>

namespace teravox::program
{

/// A cube that compresses as scans do: smooth matter of 12 bits with the noise of a detector in its
/// lowest bits, and air, which was cut off at one grey value, around it. As u8 the upper 8 bits, as
/// u16 all, as f32 the grey values times a power of two. No chunk of 64 voxels is all of one value.
/// The same on each machine.
class GreyReader : public VoxelReader
{
public:
  GreyReader(ScalarType type, std::int64_t edge);

  Description Describe() const override;
  /// Parallel with OpenMP.
  Status ReadBox(const Int3& start, const Int3& size, void* out) override;

private:
  int ValueAt(std::int64_t x, std::int64_t y, std::int64_t z) const;

  const ScalarType Type;
  const std::int64_t Edge;
  std::vector<float> Sines; // of the angle along an axis
  std::vector<float> Cosines;
};

} // namespace teravox::program
