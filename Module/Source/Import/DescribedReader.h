// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "VoxelReader.h"

#include <utility>

namespace teravox
{

/// The voxels of another reader, which must outlive it, with a description of its own: another
/// place, another fill value. Thread: as VoxelReader.
class DescribedReader : public VoxelReader
{
public:
  DescribedReader(VoxelReader& inner, Description volume)
    : Inner(inner)
    , Volume(std::move(volume))
  {
  }
  Description Describe() const override { return this->Volume; }
  Status ReadBox(const Int3& start, const Int3& size, void* out) override
  {
    return this->Inner.ReadBox(start, size, out);
  }
  bool ReadsSlabs() const override { return this->Inner.ReadsSlabs(); }

private:
  VoxelReader& Inner;
  Description Volume;
};

} // namespace teravox
