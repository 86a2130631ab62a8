// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "HDF5Handle.h"
#include "PyramidCells.h"
#include "PyramidLayout.h"
#include "Status.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <list>
#include <map>
#include <set>
#include <tuple>
#include <vector>

namespace teravox
{

/// The statistics of a file that is being written. As many of their chunks are kept as fit into a
/// budget: a chunk is written by several boxes, and again where seams are closed, but compressed
/// about once, by libdeflate and not by HDF5.
/// Thread: one at a time; takes the HDF5Lock itself. The order of all calls decides what is written
/// where in the file.
class PyramidCellStore
{
public:
  struct Description
  {
    PyramidLayout Layout;
    ScalarType Type = ScalarType::UInt8;
    int Components = 1;
    std::vector<std::byte> Fill; ///< one component
    int CompressionLevel = 1;
  };

  /// Cells of `edge` voxels along each axis: of a level, and of a chunk.
  static Int3 CellsOf(const PyramidLayout& layout, int level, std::int64_t edge);
  static Int3 ChunkOf(const Int3& cells);

  /// `file` has the datasets of PyramidFormat, with their filters, and must outlive this.
  PyramidCellStore(hid_t file, Description description);

  /// Bytes of chunks that may be kept; at least one is.
  void SetMemoryBudget(std::uint64_t bytes) { this->Budget = bytes; }

  /// Cells of `edge` voxels of a box inside the level. Errors: InputOutput, in HDF5's words.
  Status Write(int level, std::int64_t edge, const PyramidCells& cells);
  /// Fills in cells.Ranges and Gradients.
  Status Read(int level, std::int64_t edge, PyramidCells& cells);
  /// Writes what isn't in the file yet, and closes the datasets.
  Status Flush();

private:
  using Key = std::tuple<int, std::int64_t, std::int64_t, std::int64_t, std::int64_t>; // z, y, x
  /// One chunk of both datasets, as HDF5 stores it.
  struct Chunk
  {
    std::array<std::vector<std::byte>, 2> Voxels; // of cells: ranges, gradients
    bool Changed = false;
    std::list<Key>::iterator Recent;
  };

  std::size_t BytesPerCell(std::size_t dataset) const;
  Status Open(int level, std::int64_t edge);
  Result<Chunk*> Find(const Key& key);
  Status Load(const Key& key, Chunk& chunk);
  Status Store(const Key& key, const Chunk& chunk);
  Status Transfer(int level, std::int64_t edge, PyramidCells& cells, bool write);

  const hid_t File;
  const Description Self;
  std::uint64_t Budget = 0;
  std::uint64_t Kept = 0;
  std::map<Key, Chunk> Chunks;
  std::list<Key> Recent; // front: used last
  std::set<Key> Stored;
  // The pair of datasets that was used last.
  int OpenLevel = -1;
  std::int64_t OpenEdge = 0;
  std::array<HDF5Handle, 2> Datasets;
};

} // namespace teravox
