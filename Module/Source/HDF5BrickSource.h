// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "BrickSource.h"
#include "Formats/VolumeDescription.h"
#include "PreviewLevels.h"

#include <cstdint>
#include <memory>
#include <string>

namespace teravox
{

struct HDF5OpenOptions
{
  /// A dataset or group in the file. Empty: what the file itself says (docs/formats.md).
  std::string DatasetPath;
  /// Counted from 0; VolumeRequest::AllChannels: all, at most 4, as components.
  int Channel = 0;
  int TimePoint = 0;
  /// Inner edge of the bricks to deliver, 2 to 1024; independent of the storage chunks.
  int BrickSize = 64;
  /// First value of SetMemoryBudget(), in bytes.
  std::uint64_t MemoryBudget = std::uint64_t{ 256 } << 20;
  /// A volume with one level gets coarser ones, each of a few voxels of level 0 (PreviewLevels.h),
  /// from this many voxels on.
  std::uint64_t PreviewsFrom = std::uint64_t{ 1 } << 28;

  static constexpr std::uint64_t NoPreviews = previews::Never;
};

/// Reads bricks and ranges lazily from one channel (or all) at one time point of an HDF5 file of
/// any layout that VolumeDescription knows. Where a level lacks the outermost voxels that its
/// factor asks for, the last ones are repeated; a large volume without coarser levels has previews
/// in their place (HDF5OpenOptions::PreviewsFrom). Regions of which no chunk is stored have the
/// fill value's range. Decoded chunks are shared through a cache by bytes, so that many bricks may
/// come from one big chunk and one brick from many small ones. Thread: all functions from any
/// thread. Calls of the HDF5 library are serialised by HDF5Lock; decoding runs in the calling
/// thread outside of it.
class HDF5BrickSource : public BrickSource
{
public:
  /// Reads names, shapes and attributes only: its cost doesn't depend on the size of the volume.
  /// Errors: NotFound (file, dataset), Corrupt (not HDF5, truncated, contradictions), Unsupported
  /// (type, filter: by id and name), InvalidArgument (brick size).
  static Result<std::shared_ptr<HDF5BrickSource>> Open(
    const std::string& fileName, const HDF5OpenOptions& options);

  ~HDF5BrickSource() override;
  HDF5BrickSource(const HDF5BrickSource&) = delete;
  HDF5BrickSource& operator=(const HDF5BrickSource&) = delete;
  HDF5BrickSource(HDF5BrickSource&&) = delete;
  HDF5BrickSource& operator=(HDF5BrickSource&&) = delete;

  const VolumeInfo& Info() const override;
  /// What the file says, and why it was taken so.
  const VolumeDescription& Description() const;
  /// What the file says of the channel that was chosen; nullptr for all of them. It isn't proven:
  /// for default transfer functions, never for what is skipped.
  const ChannelDescription* Channel() const;
  /// Voxels of a level that are in the file; others of the layout's repeat them.
  const Int3& StoredSize(int level) const;
  /// A failure isn't remembered: when its cause is gone, the next call succeeds.
  Result<BrickPointer> ReadBrick(const BrickKey& key) override;
  Result<std::vector<ValueRange>> ReadRanges(const BrickKey& first, const Int3& count) override;
  std::uint64_t BytesRead() const override;
  /// Cached and in-flight chunks.
  std::uint64_t MemoryUsed() const override;
  /// Takes effect at once: what doesn't fit is dropped. A chunk that can't fit is an error of
  /// ReadBrick() that says how many bytes it needs.
  void SetMemoryBudget(std::uint64_t bytes) override;

private:
  class Internals;
  explicit HDF5BrickSource(std::unique_ptr<Internals> internals);
  std::unique_ptr<Internals> Self;
};

} // namespace teravox
