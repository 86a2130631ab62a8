// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// Whole files of any format: metadata, levels, a brick and a range of each level.
#include "FuzzInput.h"
#include "HDF5BrickSource.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
  using namespace teravox;
  const std::string file = fuzz::FileOf(data, size, ".h5");
  HDF5OpenOptions options;
  options.BrickSize = 16;
  options.MemoryBudget = 64 << 20;
  const auto source = HDF5BrickSource::Open(file, options);
  fuzz::Require(source.Ok() || !source.GetStatus().Message().empty(), "an error has a message");
  if (!source.Ok())
  {
    return 0;
  }
  const VolumeInfo& info = source.Value()->Info();
  const auto edge = static_cast<std::size_t>(info.Layout.StoredSize());
  const std::size_t bytes =
    edge * edge * edge * SizeOf(info.Type) * static_cast<std::size_t>(info.Components);
  for (int level = 0; level < info.Layout.NumberOfLevels(); ++level)
  {
    const BrickKey key = BrickKey::Of(level, { 0, 0, 0 });
    const auto brick = source.Value()->ReadBrick(key);
    fuzz::Require(!brick.Ok() || brick.Value()->Voxels.size() == bytes, "a brick has its size");
    const auto ranges = source.Value()->ReadRanges(key, { 1, 1, 1 });
    fuzz::Require(!ranges.Ok() || ranges.Value().size() == 1, "one range is one");
    fuzz::Require(source.Value()->MemoryUsed() <= options.MemoryBudget, "the budget holds");
  }
  return 0;
}
