// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "Status.h"
#include "Types.h"
#include "VoxelReader.h"

#include <cstdint>
#include <functional>
#include <string>

namespace teravox
{

enum class PyramidCompression
{
  None,
  Deflate, ///< shuffle and deflate: smallest, readable everywhere
  LZ4      ///< registered filter 32004: fastest to read; stock HDF5 needs its plugin
};

enum class PyramidDownsampling
{
  Average, ///< integers rounded to nearest, halves upwards; NaN left out
  Mode     ///< labels: most frequent value, the smallest of equally frequent ones; NaN left out
};

struct PyramidWriterOptions
{
  /// Edge of a storage chunk in voxels, and the brick size that the number of levels follows from;
  /// a multiple of 8 from 8 to 512.
  int BrickSize = 64;
  PyramidCompression Compression = PyramidCompression::LZ4;
  /// Deflate: 1 (fast) to 12 (small). LZ4: 1 is the fast compressor, 2 to 12 the thorough one.
  /// 0 takes 1.
  int CompressionLevel = 0;
  PyramidDownsampling Downsampling = PyramidDownsampling::Average;
  /// Hard limit in bytes for everything the writer allocates, whatever the shape of the volume.
  std::uint64_t MemoryLimit = std::uint64_t{ 1 } << 30;
  /// Goes on from what an unfinished Write() to the same name with the same options, volume and
  /// Source left, and leaves such things itself if it fails or is cancelled.
  bool Resume = false;
  /// What the voxels are made of, for example name, size and time of a file: compared by Resume.
  std::string Source;
  /// Called on the calling thread with level-0 bytes done and in total (uncompressed); returning
  /// false cancels.
  std::function<bool(std::uint64_t done, std::uint64_t total)> Progress;
};

/// What a conversion did.
struct PyramidWriterReport
{
  int Levels = 0;
  std::uint64_t VoxelBytes = 0;    ///< level 0, uncompressed
  std::uint64_t FileBytes = 0;     ///< size of the file
  std::uint64_t ChunksWritten = 0; ///< of all levels; chunks of the fill value aren't written
  std::uint64_t ChunksSaved = 0;   ///< of these, taken from an unfinished conversion
  std::uint64_t VoxelsRead = 0;    ///< asked of the reader
  std::uint64_t PeakMemory = 0;    ///< most bytes that the writer had allocated at once
};

/// Streams any volume into an HDF5 pyramid in bounded memory. The layout is described in
/// PyramidFormat.h.
/// The file appears under its name only when it is complete and on disk; before that it has the
/// name with ".<process>.part" added and beside it a log of its chunks (".<process>.log"), which an
/// error, a cancel or an exception of the reader removes. A process that was killed leaves them;
/// the next Write() to the same name goes on from them, if it is to resume, and removes what
/// belongs to no process any more. Thread: any, one Write() at a time per reader; works with as
/// many threads of its own as OpenMP would have.
class PyramidWriter
{
public:
  /// The name that the file has in this process until it is complete.
  static std::string TemporaryName(const std::string& fileName);

  /// Its log.
  static std::string LogName(const std::string& fileName);

  /// Errors: InvalidArgument (description or options; to be resumed is another conversion),
  /// ResourceExhausted (MemoryLimit too small: says how much would do), InputOutput (can't create,
  /// disk full), Cancelled, or the reader's own.
  static Result<PyramidWriterReport> Write(
    const std::string& fileName, VoxelReader& reader, const PyramidWriterOptions& options);
};

} // namespace teravox
