// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "ChunkEncoder.h"
#include "PyramidCells.h"
#include "PyramidFileWriter.h"
#include "PyramidHistogram.h"
#include "PyramidLayout.h"
#include "PyramidWriter.h"
#include "Status.h"
#include "VoxelReader.h"

#include <cstdint>
#include <memory>
#include <set>
#include <vector>

namespace teravox
{

/// Walks the pyramid depth first, so that each voxel is read once and no level is read back:
///
///     level l > BlockLevel:   node = one chunk, made of its children's results
///     level BlockLevel:       block = all voxels below one chunk, read at once; its levels in
///     memory
///
/// BlockLevel is the largest that the memory limit allows. Regions of the fill value are left out
/// as high up in the tree as the reader knows of them.
/// Thread: one; works in parallel with OpenMP inside.
class PyramidBuilder
{
public:
  /// Requires: checked description and options.
  PyramidBuilder(const VoxelReader::Description& description, const PyramidWriterOptions& options,
    const PyramidLayout& layout, VoxelReader& reader);

  /// Chooses threads and BlockLevel. Errors: ResourceExhausted.
  Status Plan(const std::string& fileName);
  Status Run(PyramidFileWriter& file);

  const PyramidHistogram& Histogram() const { return this->Histogram_; }
  /// Of level 0, all components; infinities included.
  const ValueRange& Range() const { return this->Range_; }
  PyramidWriterReport Report() const;

private:
  /// Voxels of a box of one level; without Voxels all are the fill value.
  struct Block
  {
    Int3 Start{ 0, 0, 0 };
    Int3 Size{ 0, 0, 0 };
    std::vector<std::byte> Voxels;
    const std::byte* Found = nullptr; // the voxels, where the reader has them itself

    const std::byte* Data() const { return this->Found ? this->Found : this->Voxels.data(); }
  };
  /// What compresses chunks in one thread, kept from chunk to chunk.
  struct Worker
  {
    std::unique_ptr<ChunkEncoder> Encoder;
    std::vector<std::byte> Raw;
  };
  struct CellBox
  {
    Int3 Start{ 0, 0, 0 };
    Int3 Size{ 0, 0, 0 };
  };
  struct LevelRecord
  {
    std::vector<CellBox> Boxes; // boxes of cells at whose faces differences are still missing
    std::set<Int3> CellChunks;  // chunks of the finest statistics that were written
  };

  std::uint64_t PlannedMemory(int blockLevel, int threads) const;
  std::uint64_t ScratchPerThread() const;
  Block Region(int level, const Int3& index) const;
  std::size_t Bytes(const Int3& size) const;
  bool IsFill(const Block& level0Region);
  bool AnyChildIsFill(int level, const Int3& index);
  Result<Block> BuildNode(int level, const Int3& index);
  Result<Block> GatherNode(int level, const Int3& index);
  Result<Block> ReadBlock(int level, const Int3& index);
  Status FillBlock(Block& block, bool mayFind);
  /// The next level of `fine`, whose voxels are freed.
  Block Coarser(int level, Block& fine, const Block& shape);
  Status StoreLevel(int level, const Block& block, std::uint64_t progressBytes);
  Status StoreChunks(int level, const Block& block, std::uint64_t progressBytes);
  Status StoreCells(int level, const Block& block);
  void CopyChunk(
    int level, const Block& block, const Int3& chunk, std::vector<std::byte>& out) const;
  Status CloseSeams(int level);
  Status CloseSeam(int level, const CellBox& box, std::size_t axis, bool upper);
  Status BuildCoarseCells(int level);
  void MarkCellChunks(int level, const Int3& start, const Int3& size);
  Status Advance(std::uint64_t bytes);
  void Allocated(std::uint64_t bytes);
  void Released(std::uint64_t bytes) { this->Memory -= bytes; }
  Double3 Spacing(int level) const;

  VoxelReader::Description Volume;
  PyramidWriterOptions Options;
  PyramidLayout Layout;
  VoxelReader& Reader;
  PyramidFileWriter* File = nullptr;
  std::vector<std::byte> Fill; // one voxel, all components
  std::vector<LevelRecord> Levels;
  PyramidHistogram Histogram_;
  ValueRange Range_ = ValueRange::Void();
  int BlockLevel = 0;
  int Threads = 1;
  std::vector<Worker> Workers; // one per thread
  PyramidWriterReport Counts;
  std::uint64_t Total = 0;
  std::uint64_t Done = 0;
  std::uint64_t Memory = 0;
};

} // namespace teravox
