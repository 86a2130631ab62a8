// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "ChunkEncoder.h"
#include "PyramidCellScan.h"
#include "PyramidCells.h"
#include "PyramidFileWriter.h"
#include "PyramidHistogram.h"
#include "PyramidLayout.h"
#include "PyramidWriter.h"
#include "Status.h"
#include "VoxelMemory.h"
#include "VoxelReader.h"
#include "WorkerTeam.h"

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
/// Thread: one, with a team of its own.
class PyramidBuilder
{
public:
  /// `cellMemory`: what is kept of statistics, of the memory limit. Requires: checked description
  /// and options.
  PyramidBuilder(const VoxelReader::Description& description, const PyramidWriterOptions& options,
    const PyramidLayout& layout, VoxelReader& reader, std::uint64_t cellMemory);

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
    VoxelMemory Voxels;
    const std::byte* Found = nullptr; // the voxels, where the reader has them itself
    bool Unread = false;              // Voxels are still to be asked of the reader

    const std::byte* Data() const { return this->Found ? this->Found : this->Voxels.Data(); }
  };
  /// What compresses chunks in one thread, kept from chunk to chunk.
  struct Worker
  {
    std::unique_ptr<ChunkEncoder> Encoder;
    std::vector<std::byte> Raw;
    std::vector<std::byte> Saved; // a chunk of an unfinished conversion
    PyramidHistogram::Part Histogram;
  };
  /// A chunk on its way to the file.
  struct ReadyChunk
  {
    Status Outcome;
    bool Store = false;  // false: it is all of the fill value
    bool Reused = false; // of an unfinished conversion
    ChunkEncoder::Encoded Bytes;
    std::uint32_t Checksum = 0;
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
  /// From chunks that an unfinished conversion left; false unless all of them are there.
  bool FillFromSaved(Block& block);
  /// The next level of `fine`, whose voxels are freed.
  Block Coarser(int level, Block& fine, Block shape);
  /// Room for the voxels of a block of the size that it has.
  void Allocate(Block& block);
  void Free(Block& block);
  /// Statistics and chunks of a block; where `coarser` is given, also its voxels, which are those
  /// of the next level.
  Status StoreLevel(int level, Block& block, Block* coarser, std::uint64_t progressBytes);
  /// The one pass over a block's voxels: all that is made of a row of cells while it is in the
  /// processor's caches.
  void ScanRow(int level, const Block& block, const PyramidCellScan& scan, std::int64_t row,
    Block* coarser, int member);
  /// The pass over a block that is still to be read, slab by slab while the next one is read.
  Status ReadAndScan(int level, Block& block, const PyramidCellScan& scan, Block* coarser);
  Status ReadBox(const Int3& start, const Int3& size, std::byte* out);
  void Downsample(
    int level, const Block& fine, const Int3& first, const Int3& size, Block& coarse) const;
  void CountValues(const Block& block, const ValueRange& range);
  Status StoreChunks(int level, const Block& block, std::uint64_t progressBytes);
  Status StoreCells(int level, const PyramidCells& cells);
  ReadyChunk MakeChunk(int level, const Block& block, const Int3& index, Worker& worker);
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
  const std::uint64_t CellMemory;
  ValueRange Range_ = ValueRange::Void();
  int BlockLevel = 0;
  int Threads = 1;
  std::unique_ptr<WorkerTeam> Team;
  std::vector<Worker> Workers; // one per member
  PyramidWriterReport Counts;
  std::uint64_t Total = 0;
  std::uint64_t Done = 0;
  std::uint64_t Memory = 0;
};

} // namespace teravox
