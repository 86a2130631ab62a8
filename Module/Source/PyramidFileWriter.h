// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "ChunkDecoder.h"
#include "ChunkEncoder.h"
#include "ConversionLog.h"
#include "HDF5Handle.h"
#include "HDF5OutputDriver.h"
#include "PyramidCellStore.h"
#include "PyramidCells.h"
#include "PyramidLayout.h"
#include "PyramidWriter.h"
#include "Status.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace teravox
{

/// The HDF5 file that a PyramidWriter fills: a temporary file that Finish() gives its name, and
/// that the destructor removes otherwise, or keeps, if the conversion is to be resumed. Thread: one
/// at a time; takes the HDF5Lock itself.
class PyramidFileWriter
{
public:
  /// Requires: a checked description and options. `saved` is what this conversion goes on from.
  static Result<std::unique_ptr<PyramidFileWriter>> Create(const std::string& fileName,
    const VoxelReader::Description& description, const PyramidWriterOptions& options,
    const PyramidLayout& layout, std::unique_ptr<SavedChunks> saved = nullptr);

  ~PyramidFileWriter();
  PyramidFileWriter(const PyramidFileWriter&) = delete;
  PyramidFileWriter& operator=(const PyramidFileWriter&) = delete;
  PyramidFileWriter(PyramidFileWriter&&) = delete;
  PyramidFileWriter& operator=(PyramidFileWriter&&) = delete;

  /// Voxels of a chunk of a level along each axis: the brick size, or the level where it is
  /// shorter.
  static Int3 ChunkSize(const PyramidLayout& layout, int level);

  /// Those of the chunks of all levels.
  static std::vector<ChunkFilter> Filters(const PyramidWriterOptions& options, ScalarType type);

  /// `checksum` is ChecksumOf() its bytes: found by whoever made the chunk, in parallel.
  Status WriteChunk(
    int level, const Int3& index, const ChunkEncoder::Encoded& chunk, std::uint32_t checksum);
  /// The chunk is complete without being written: it has no other value than the fill value.
  void SkipChunk(int level, const Int3& index);
  /// What there is already; null: nothing.
  const SavedChunks* Saved() const { return this->Saved_.get(); }
  /// Statistics of cells of `edge` voxels.
  Status WriteCells(int level, std::int64_t edge, const PyramidCells& cells);
  /// Bytes of statistics that are kept from one call to the next.
  void SetCellMemory(std::uint64_t bytes) { this->Cells->SetMemoryBudget(bytes); }
  /// Fills in cells.Ranges and Gradients of its box, which lies inside the level.
  Status ReadCells(int level, std::int64_t edge, PyramidCells& cells);

  /// Writes the attributes, brings all to the disk and renames the file. Returns its size in bytes.
  Result<std::uint64_t> Finish(
    const ValueRange& range, const std::vector<std::uint64_t>& histogram);

private:
  struct Description
  {
    VoxelReader::Description Volume;
    PyramidWriterOptions Options;
    PyramidLayout Layout;
    std::vector<std::byte> Fill; // one component
  };
  PyramidFileWriter(std::string fileName, Description description);

  Status Build();
  Status BuildLevels(hid_t data);
  Status BuildStatistics();
  Status MakeDataset(hid_t group, const std::string& name, const Int3& dimensions,
    const Int3& chunk, int components, ScalarType type, const std::byte* fill,
    PyramidCompression compression, HDF5Handle& dataset);
  Status Reserve();
  Status WriteAttributes(const ValueRange& range, const std::vector<std::uint64_t>& histogram);
  Status Close();
  void Abandon();
  Status Publish(std::uint64_t& size);
  std::string DataGroup() const;
  Status Failure(const std::string& what) const;
  /// The file so far: an error if the system has refused a write.
  Status Written() const;

  std::string Name;
  std::string Temporary;
  ConversionLog Log;
  std::unique_ptr<SavedChunks> Saved_;
  int Lock = -1; // descriptor of the temporary file, locked as long as this object lives
  Description Self;
  HDF5OutputState Output; // before File: outlives it
  HDF5Handle File;
  std::vector<HDF5Handle> Levels;
  std::unique_ptr<PyramidCellStore> Cells; // statistics
};

} // namespace teravox
