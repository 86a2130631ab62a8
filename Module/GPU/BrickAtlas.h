// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "AtlasPlan.h"
#include "BrickTexels.h"
#include "GLObjects.h"
#include "NativeAtlas.h"
#include "PageTable.h"
#include "VoxelFormat.h"

#include <memory>
#include <vector>

namespace teravox
{

/// The copy of what is resident that a marcher reads: the atlas of slots, the page table (directory
/// and pool of blocks in one buffer) and the table of slots; on the GPU, or in the memory of the
/// host where the plan is for the native marcher. State of one context. Thread: used by the render
/// thread only, with the context current.
class BrickAtlas
{
public:
  /// All storage is allocated here and never grows. Errors: ResourceExhausted.
  static Result<std::unique_ptr<BrickAtlas>> Make(
    GPUMemory& memory, const AtlasPlan& plan, const VoxelFormat& format, int storedSize);

  void Upload(std::uint32_t slot, const Brick& brick);
  /// Carries out the changes of a page table.
  void Apply(const PageTable& table, const std::vector<PageTable::Change>& changes);

  void Bind() const;
  /// Null where the plan is for the GPU.
  const NativeAtlas* Native() const { return this->Native_.get(); }
  const AtlasPlan& Plan() const { return this->Plan_; }
  const VoxelFormat& Format() const { return this->Format_; }
  std::uint64_t BytesUploaded() const { return this->BytesUploaded_; }
  std::uint64_t PageTableBytesUploaded() const { return this->TableBytesUploaded; }

private:
  BrickAtlas() = default;
  void UploadToTexture(std::uint32_t slot, std::uint32_t component, const ConvertedBrick& texels);
  AtlasPlan Plan_;
  VoxelFormat Format_;
  int StoredSize = 0;
  std::unique_ptr<NativeAtlas> Native_;
  MemoryShare NativeBytes; ///< what it and the page table take
  GLTexture Texture;
  GLTexture Cells;
  int CellsPerBrick = 0;
  GLBuffer Table;
  GLTexture TableTexture;
  GLBuffer Slots;
  std::uint64_t BytesUploaded_ = 0;
  std::uint64_t TableBytesUploaded = 0;
};

} // namespace teravox
