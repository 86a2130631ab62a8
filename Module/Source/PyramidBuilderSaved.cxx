// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "ChunkDecoder.h"
#include "ConversionLog.h"
#include "PyramidBuilder.h"
#include "VoxelBoxes.h"

#include <algorithm>
#include <atomic>
#include <exception>

namespace teravox
{

bool PyramidBuilder::FillFromSaved(Block& block)
{
  const SavedChunks& saved = *this->File->Saved();
  const Int3 size = PyramidFileWriter::ChunkSize(this->Layout, 0);
  const ChunkBox chunks(block.Start, block.Size, size);
  const std::int64_t n = chunks.Number();
  for (std::int64_t i = 0; i < n; ++i)
  {
    if (saved.Find(0, chunks.Index(i)) == nullptr)
    {
      return false;
    }
  }
  this->Allocate(block);
  FillWith(this->Fill, block.Voxels.Data(), block.Voxels.Size() / this->Fill.size());
  const ChunkDecoder decoder(PyramidFileWriter::Filters(this->Options, this->Volume.Type),
    this->Bytes(size), SizeOf(this->Volume.Type), false);
  std::atomic<bool> good{ true };
  this->Team->Run(n,
    [&](std::int64_t i, int member)
    {
      const LoggedChunk& chunk = *saved.Find(0, chunks.Index(i));
      if (chunk.Size == 0 || !good)
      {
        return;
      }
      try
      {
        Worker& worker = this->Workers[static_cast<std::size_t>(member)];
        std::vector<std::byte> voxels;
        if (!saved.Read(chunk, worker.Saved) ||
          !decoder.Decode(worker.Saved, chunk.FilterMask, voxels).Ok())
        {
          good = false;
          return;
        }
        Int3 start{};
        Int3 part{};
        for (std::size_t a = 0; a < 3; ++a)
        {
          start[a] = chunk.Index[a] * size[a] - block.Start[a];
          part[a] = std::min(size[a], block.Size[a] - start[a]);
        }
        CopyBox(voxels.data(), size, { 0, 0, 0 }, block.Voxels.Data(), block.Size, start, part,
          this->Fill.size());
      }
      catch (const std::exception&) // no memory: it is read from the input
      {
        good = false;
      }
    });
  if (!good)
  {
    this->Free(block);
  }
  return good;
}

} // namespace teravox
