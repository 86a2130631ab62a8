// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "PyramidWriter.h"
#include "Status.h"
#include "VoxelReader.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace teravox
{

/// Where the file of an unfinished conversion has a chunk. An HDF5 file that wasn't closed isn't
/// one: nothing in it is trusted but bytes at such a place that have the checksum.
struct LoggedChunk
{
  std::int32_t Level = 0;
  Int3 Index{ 0, 0, 0 };
  std::uint64_t Address = 0; ///< in the file
  std::uint64_t Size = 0;    ///< 0: all voxels are the fill value, the chunk isn't stored
  std::uint32_t FilterMask = 0;
  std::uint32_t Checksum = 0; ///< of its bytes
  std::uint32_t Source = 0;   ///< of SavedChunks: which file
};

std::uint32_t ChecksumOf(const std::byte* data, std::size_t size);

/// Names of what conversions to a file leave when they are killed: the file "NAME.<process>.part",
/// and beside it its log "NAME.<process>.log".
namespace unfinished
{
std::string PartName(const std::string& fileName);
std::string LogName(const std::string& partName);

/// An unfinished file that nobody writes any more, locked so that nobody else takes it.
class Part
{
public:
  explicit Part(std::string name, int descriptor)
    : Name_(std::move(name))
    , Descriptor_(descriptor)
  {
  }
  ~Part();
  Part(const Part&) = delete;
  Part& operator=(const Part&) = delete;
  Part(Part&&) = delete;
  Part& operator=(Part&&) = delete;

  const std::string& Name() const { return this->Name_; }
  int Descriptor() const { return this->Descriptor_; }
  /// From the disk, with the log.
  void Remove() const;

private:
  std::string Name_;
  int Descriptor_;
};

/// All of a file's whose process has ended, or was kept.
std::vector<std::unique_ptr<Part>> Find(const std::string& fileName);
/// Gives a part of this living process, which is no longer written, a name that Find() looks at.
void Keep(const std::string& partName);
} // namespace unfinished

/// Writes down which chunks are in the file. Failures aren't errors: without a log there is nothing
/// to go on from. Thread: one at a time.
class ConversionLog
{
public:
  ConversionLog() = default;
  ~ConversionLog();
  ConversionLog(const ConversionLog&) = delete;
  ConversionLog& operator=(const ConversionLog&) = delete;
  ConversionLog(ConversionLog&&) = delete;
  ConversionLog& operator=(ConversionLog&&) = delete;

  /// `task` is what the conversion does; another one doesn't go on from here.
  void Create(const std::string& name, const std::string& task);
  void Add(const LoggedChunk& chunk);
  bool HasChunks() const { return this->Chunks > 0; }

  /// What a conversion does, as text: the volume, the options that decide about the file, its
  /// input.
  static std::string Task(
    const VoxelReader::Description& volume, const PyramidWriterOptions& options);

private:
  int File = -1;
  std::uint64_t Chunks = 0;
};

/// Chunks that unfinished conversions left. Thread: any, for Read().
class SavedChunks
{
public:
  /// Of all unfinished conversions to this name; those that have nothing that others lack are
  /// removed. Null: there are none. Errors: InvalidArgument, if they do another task.
  static Result<std::unique_ptr<SavedChunks>> Load(
    const std::string& fileName, const std::string& task);

  std::size_t Count() const { return this->Chunks.size(); }
  std::uint64_t MemoryUsed() const { return this->Chunks.capacity() * sizeof(LoggedChunk); }
  /// Null: it isn't there.
  const LoggedChunk* Find(int level, const Int3& index) const;
  /// Its bytes; false if they aren't those that were written.
  bool Read(const LoggedChunk& chunk, std::vector<std::byte>& bytes) const;
  /// All files, once they aren't needed.
  void Remove() const;

private:
  std::vector<std::unique_ptr<unfinished::Part>> Parts;
  std::vector<LoggedChunk> Chunks; // sorted
};

} // namespace teravox
