// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "PyramidBuilder.h"

#include "ConversionLog.h"
#include "PyramidFormat.h"
#include "VoxelBoxes.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <exception>
#include <omp.h>
#include <utility>

namespace teravox
{

namespace
{
constexpr std::int64_t CellEdge = PyramidFormat::CellEdge;
constexpr int ChunksPerMember = 8;
// HDF5's metadata cache and the writer's lists.
constexpr std::uint64_t FixedMemory = std::uint64_t{ 8 } << 20;

bool IsAll(const std::vector<std::byte>& data, const std::vector<std::byte>& voxel)
{
  // Equal to itself one voxel further on, and the first is that voxel.
  return std::memcmp(data.data(), voxel.data(), voxel.size()) == 0 &&
    std::memcmp(data.data(), data.data() + voxel.size(), data.size() - voxel.size()) == 0;
}

std::vector<std::byte> Voxel(ScalarType type, int components, double value)
{
  std::vector<std::byte> voxel(SizeOf(type) * static_cast<std::size_t>(components));
  DispatchScalarType(type,
    [&](auto example)
    {
      const auto v = static_cast<decltype(example)>(value);
      for (std::size_t c = 0; c < static_cast<std::size_t>(components); ++c)
      {
        std::memcpy(voxel.data() + c * sizeof(v), &v, sizeof(v));
      }
    });
  return voxel;
}
} // namespace

PyramidBuilder::PyramidBuilder(const VoxelReader::Description& description,
  const PyramidWriterOptions& options, const PyramidLayout& layout, VoxelReader& reader,
  std::uint64_t cellMemory)
  : Volume(description)
  , Options(options)
  , Layout(layout)
  , Reader(reader)
  , Fill(Voxel(description.Type, description.Components, description.FillValue))
  , Levels(static_cast<std::size_t>(layout.NumberOfLevels()))
  , Histogram_(description.Type)
  , CellMemory(cellMemory)
{
  this->Total = static_cast<std::uint64_t>(this->Volume.Dimensions[0]) *
    static_cast<std::uint64_t>(this->Volume.Dimensions[1]) *
    static_cast<std::uint64_t>(this->Volume.Dimensions[2]) * this->Fill.size();
}

PyramidWriterReport PyramidBuilder::Report() const
{
  PyramidWriterReport report = this->Counts;
  report.Levels = this->Layout.NumberOfLevels();
  report.VoxelBytes = this->Total;
  return report;
}

std::size_t PyramidBuilder::Bytes(const Int3& size) const
{
  return static_cast<std::size_t>(size[0]) * static_cast<std::size_t>(size[1]) *
    static_cast<std::size_t>(size[2]) * this->Fill.size();
}

Double3 PyramidBuilder::Spacing(int level) const
{
  Double3 spacing{};
  for (std::size_t a = 0; a < 3; ++a)
  {
    spacing[a] = this->Volume.Spacing[a] * static_cast<double>(this->Layout.Factor(level)[a]);
  }
  return spacing;
}

std::uint64_t PyramidBuilder::ScratchPerThread() const
{
  const std::size_t chunk = this->Bytes(PyramidFileWriter::ChunkSize(this->Layout, 0));
  const std::size_t saved = this->Options.Resume ? 3 * chunk : 0;
  return chunk + ChunkEncoder::ScratchSize(this->Options.Compression, chunk) +
    PyramidHistogram::PartBytes + saved;
}

std::uint64_t PyramidBuilder::PlannedMemory(int blockLevel, int threads) const
{
  const Int3 edge{ this->Layout.BrickSize(), this->Layout.BrickSize(), this->Layout.BrickSize() };
  double block = 1;
  double nodes = 0;
  double cells = 1;
  const auto voxelBytes = static_cast<double>(this->Fill.size());
  for (std::size_t a = 0; a < 3; ++a)
  {
    const auto extent = static_cast<double>(
      std::min(edge[a] * this->Layout.Factor(blockLevel)[a], this->Layout.Dimensions(0)[a]));
    block *= extent;
    cells *= std::ceil(extent / static_cast<double>(CellEdge));
  }
  for (int l = 1; l < this->Layout.NumberOfLevels(); ++l)
  {
    double children = voxelBytes;
    double own = voxelBytes;
    for (std::size_t a = 0; a < 3; ++a)
    {
      const std::int64_t ratio = this->Layout.Factor(l)[a] / this->Layout.Factor(l - 1)[a];
      children *= static_cast<double>(std::min(edge[a] * ratio, this->Layout.Dimensions(l - 1)[a]));
      own *= static_cast<double>(std::min(edge[a], this->Layout.Dimensions(l)[a]));
    }
    nodes += children + own;
  }
  // A block and the next level of it exist at once: at worst half as much again.
  const double factor = blockLevel > 0 ? 1.5 : 1.0;
  const double total = block * voxelBytes * factor + nodes +
    cells *
      static_cast<double>(PyramidCells::BytesPerCell(this->Volume.Type, this->Volume.Components)) +
    static_cast<double>(this->ScratchPerThread()) * threads +
    static_cast<double>(FixedMemory + this->CellMemory);
  return total < 9e18 ? static_cast<std::uint64_t>(total)
                      : std::numeric_limits<std::uint64_t>::max();
}

Status PyramidBuilder::Plan(const std::string& fileName)
{
  this->Threads = std::max(1, omp_get_max_threads());
  while (this->Threads > 1 && this->PlannedMemory(0, this->Threads) > this->Options.MemoryLimit)
  {
    --this->Threads;
  }
  const std::uint64_t least = this->PlannedMemory(0, this->Threads);
  if (least > this->Options.MemoryLimit)
  {
    return { StatusCode::ResourceExhausted,
      "Writing '" + fileName + "' takes at least " + std::to_string(least) +
        " bytes of memory with bricks of " + std::to_string(this->Layout.BrickSize()) +
        " voxels, but the limit is " + std::to_string(this->Options.MemoryLimit) + " bytes." };
  }
  this->BlockLevel = 0;
  while (this->BlockLevel + 1 < this->Layout.NumberOfLevels() &&
    this->PlannedMemory(this->BlockLevel + 1, this->Threads) <= this->Options.MemoryLimit)
  {
    ++this->BlockLevel;
  }
  return {};
}

void PyramidBuilder::Allocated(std::uint64_t bytes)
{
  this->Memory += bytes;
  this->Counts.PeakMemory = std::max(this->Counts.PeakMemory, this->Memory);
}

Status PyramidBuilder::Advance(std::uint64_t bytes)
{
  this->Done += bytes;
  if (this->Options.Progress && !this->Options.Progress(this->Done, this->Total))
  {
    return { StatusCode::Cancelled, "The conversion was cancelled." };
  }
  return {};
}

PyramidBuilder::Block PyramidBuilder::Region(int level, const Int3& index) const
{
  Block block;
  for (std::size_t a = 0; a < 3; ++a)
  {
    const std::int64_t edge = this->Layout.BrickSize();
    block.Start[a] = index[a] * edge;
    block.Size[a] = std::min(edge, this->Layout.Dimensions(level)[a] - block.Start[a]);
  }
  return block;
}

bool PyramidBuilder::IsFill(const Block& region)
{
  double value = 0;
  if (!this->Reader.IsConstant(region.Start, region.Size, &value))
  {
    return false;
  }
  return Voxel(this->Volume.Type, this->Volume.Components, value) == this->Fill;
}

Status PyramidBuilder::Run(PyramidFileWriter& file)
{
  this->File = &file;
  this->Team = std::make_unique<WorkerTeam>(this->Threads);
  this->Workers.resize(static_cast<std::size_t>(this->Threads));
  this->Allocated(FixedMemory + this->CellMemory +
    this->ScratchPerThread() * static_cast<std::uint64_t>(this->Threads));
  file.SetCellMemory(this->CellMemory);
  const int top = this->Layout.NumberOfLevels() - 1;
  const Int3& roots = this->Layout.Bricks(top);
  Int3 index{};
  for (index[2] = 0; index[2] < roots[2]; ++index[2])
  {
    for (index[1] = 0; index[1] < roots[1]; ++index[1])
    {
      for (index[0] = 0; index[0] < roots[0]; ++index[0])
      {
        Result<Block> root = this->BuildNode(top, index);
        if (!root.Ok())
        {
          return root.GetStatus();
        }
        this->Released(root.Value().Voxels.Size());
      }
    }
  }
  for (int l = 0; l <= top; ++l)
  {
    Status status = this->CloseSeams(l);
    if (status.Ok())
    {
      status = this->BuildCoarseCells(l);
    }
    if (!status.Ok())
    {
      return status;
    }
  }
  return {};
}

Result<PyramidBuilder::Block> PyramidBuilder::BuildNode(int level, const Int3& index)
{
  Block own = this->Region(level, index);
  Block below; // the same region in level 0
  for (std::size_t a = 0; a < 3; ++a)
  {
    const std::int64_t f = this->Layout.Factor(level)[a];
    below.Start[a] = own.Start[a] * f;
    below.Size[a] = std::min(own.Size[a] * f, this->Layout.Dimensions(0)[a] - below.Start[a]);
  }
  if (this->IsFill(below))
  {
    this->Histogram_.AddRepeated(
      this->Volume.FillValue, this->Bytes(below.Size) / SizeOf(this->Volume.Type));
    this->Range_.Include(this->Volume.FillValue);
    const Status status = this->Advance(this->Bytes(below.Size));
    return status.Ok() ? Result<Block>(std::move(own)) : Result<Block>(status);
  }
  if (level > this->BlockLevel || (level > 0 && this->AnyChildIsFill(level, index)))
  {
    return this->GatherNode(level, index);
  }
  return this->ReadBlock(level, index);
}

bool PyramidBuilder::AnyChildIsFill(int level, const Int3& index)
{
  Int3 ratio{};
  for (std::size_t a = 0; a < 3; ++a)
  {
    ratio[a] = this->Layout.Factor(level)[a] / this->Layout.Factor(level - 1)[a];
  }
  const Int3& bricks = this->Layout.Bricks(level - 1);
  Int3 child{};
  for (child[2] = index[2] * ratio[2]; child[2] < std::min((index[2] + 1) * ratio[2], bricks[2]);
       ++child[2])
  {
    for (child[1] = index[1] * ratio[1]; child[1] < std::min((index[1] + 1) * ratio[1], bricks[1]);
         ++child[1])
    {
      for (child[0] = index[0] * ratio[0];
           child[0] < std::min((index[0] + 1) * ratio[0], bricks[0]); ++child[0])
      {
        Block region = this->Region(level - 1, child);
        for (std::size_t a = 0; a < 3; ++a)
        {
          const std::int64_t f = this->Layout.Factor(level - 1)[a];
          region.Start[a] *= f;
          region.Size[a] =
            std::min(region.Size[a] * f, this->Layout.Dimensions(0)[a] - region.Start[a]);
        }
        if (this->IsFill(region))
        {
          return true;
        }
      }
    }
  }
  return false;
}

Result<PyramidBuilder::Block> PyramidBuilder::GatherNode(int level, const Int3& index)
{
  Block own = this->Region(level, index);
  Block fine;
  Int3 first{};
  Int3 last{};
  for (std::size_t a = 0; a < 3; ++a)
  {
    const std::int64_t ratio = this->Layout.Factor(level)[a] / this->Layout.Factor(level - 1)[a];
    fine.Start[a] = own.Start[a] * ratio;
    fine.Size[a] =
      std::min(own.Size[a] * ratio, this->Layout.Dimensions(level - 1)[a] - fine.Start[a]);
    first[a] = fine.Start[a] / this->Layout.BrickSize();
    last[a] = CeilDiv(fine.Start[a] + fine.Size[a], this->Layout.BrickSize());
  }
  Int3 child{};
  for (child[2] = first[2]; child[2] < last[2]; ++child[2])
  {
    for (child[1] = first[1]; child[1] < last[1]; ++child[1])
    {
      for (child[0] = first[0]; child[0] < last[0]; ++child[0])
      {
        Result<Block> built = this->BuildNode(level - 1, child);
        if (!built.Ok())
        {
          return built;
        }
        const Block& part = built.Value();
        if (part.Voxels.IsEmpty())
        {
          continue;
        }
        if (fine.Voxels.IsEmpty())
        {
          this->Allocate(fine);
          FillWith(this->Fill, fine.Voxels.Data(), fine.Voxels.Size() / this->Fill.size());
        }
        CopyBox(part.Voxels.Data(), part.Size, { 0, 0, 0 }, fine.Voxels.Data(), fine.Size,
          { part.Start[0] - fine.Start[0], part.Start[1] - fine.Start[1],
            part.Start[2] - fine.Start[2] },
          part.Size, this->Fill.size());
        this->Released(part.Voxels.Size());
      }
    }
  }
  if (fine.Voxels.IsEmpty())
  {
    return Result<Block>(std::move(own));
  }
  Block coarse = this->Coarser(level - 1, fine, std::move(own));
  const Status status = this->StoreLevel(level, coarse, nullptr, 0);
  return status.Ok() ? Result<Block>(std::move(coarse)) : Result<Block>(status);
}

Result<PyramidBuilder::Block> PyramidBuilder::ReadBlock(int level, const Int3& index)
{
  const Block own = this->Region(level, index);
  Block block;
  const auto shape = [&](int l)
  {
    Block box;
    for (std::size_t a = 0; a < 3; ++a)
    {
      const std::int64_t f = this->Layout.Factor(level)[a] / this->Layout.Factor(l)[a];
      box.Start[a] = own.Start[a] * f;
      box.Size[a] = std::min(own.Size[a] * f, this->Layout.Dimensions(l)[a] - box.Start[a]);
    }
    return box;
  };
  block = shape(0);
  // A block that is handed on must have its voxels itself.
  Status status = this->FillBlock(block, level > 0);
  for (int l = 0; l <= level && status.Ok(); ++l)
  {
    const std::uint64_t progress = l == 0 ? this->Bytes(block.Size) : 0;
    if (l == level)
    {
      status = this->StoreLevel(l, block, nullptr, progress);
      break;
    }
    Block coarser = shape(l + 1);
    this->Allocate(coarser);
    status = this->StoreLevel(l, block, &coarser, progress);
    this->Free(block);
    block = std::move(coarser);
  }
  return status.Ok() ? Result<Block>(std::move(block)) : Result<Block>(status);
}

void PyramidBuilder::Allocate(Block& block)
{
  block.Voxels = VoxelMemory(this->Bytes(block.Size));
  this->Allocated(block.Voxels.Size());
}

void PyramidBuilder::Free(Block& block)
{
  this->Released(block.Voxels.Size());
  block.Voxels = VoxelMemory();
  block.Found = nullptr;
}

Status PyramidBuilder::FillBlock(Block& block, bool mayFind)
{
  double value = 0;
  const bool constant = this->Reader.IsConstant(block.Start, block.Size, &value);
  if (!constant && this->File->Saved() != nullptr && this->FillFromSaved(block))
  {
    return {};
  }
  if (mayFind && !constant)
  {
    const void* found = nullptr;
    try
    {
      found = this->Reader.FindBox(block.Start, block.Size);
    }
    catch (const std::exception&) // ReadBox() below says what is wrong
    {
    }
    if (found)
    {
      block.Found = static_cast<const std::byte*>(found);
      this->Counts.VoxelsRead += this->Bytes(block.Size) / this->Fill.size();
      return {};
    }
  }
  this->Allocate(block);
  if (constant)
  {
    FillWith(Voxel(this->Volume.Type, this->Volume.Components, value), block.Voxels.Data(),
      block.Voxels.Size() / this->Fill.size());
    return {};
  }
  this->Counts.VoxelsRead += block.Voxels.Size() / this->Fill.size();
  block.Unread = this->Reader.ReadsSlabs();
  return block.Unread ? Status() : this->ReadBox(block.Start, block.Size, block.Voxels.Data());
}

Status PyramidBuilder::ReadBox(const Int3& start, const Int3& size, std::byte* out)
{
  try
  {
    return this->Reader.ReadBox(start, size, out);
  }
  catch (const std::exception& e)
  {
    return { StatusCode::InputOutput, std::string("Reading the volume failed: ") + e.what() + "." };
  }
}

Status PyramidBuilder::StoreLevel(
  int level, Block& block, Block* coarser, std::uint64_t progressBytes)
{
  PyramidCells cells =
    PyramidCells::Covering(this->Volume.Type, this->Volume.Components, block.Start, block.Size);
  this->Allocated(cells.SizeInBytes());
  const PyramidCellScan scan(cells, block.Data(), block.Start, block.Size,
    this->Layout.Dimensions(level), this->Spacing(level));
  Status status;
  if (block.Unread)
  {
    status = this->ReadAndScan(level, block, scan, coarser);
  }
  else
  {
    this->Team->Run(scan.Rows(),
      [&](std::int64_t row, int member)
      { this->ScanRow(level, block, scan, row, coarser, member); });
  }
  if (status.Ok() && level == 0)
  {
    this->CountValues(block, cells.TotalRange());
  }
  status = status.Ok() ? this->StoreCells(level, cells) : status;
  this->Released(cells.SizeInBytes());
  if (status.Ok())
  {
    status = this->StoreChunks(level, block, progressBytes);
  }
  return status;
}

void PyramidBuilder::CopyChunk(
  int level, const Block& block, const Int3& chunk, std::vector<std::byte>& out) const
{
  const Int3 size = PyramidFileWriter::ChunkSize(this->Layout, level);
  Int3 start{};
  Int3 count{};
  bool partial = false;
  for (std::size_t a = 0; a < 3; ++a)
  {
    start[a] = chunk[a] * size[a] - block.Start[a];
    count[a] = std::min(size[a], block.Size[a] - start[a]);
    partial = partial || count[a] < size[a];
  }
  if (partial)
  {
    FillWith(this->Fill, out.data(), out.size() / this->Fill.size());
  }
  CopyBox(block.Data(), block.Size, start, out.data(), size, { 0, 0, 0 }, count, this->Fill.size());
}

PyramidBuilder::ReadyChunk PyramidBuilder::MakeChunk(
  int level, const Block& block, const Int3& index, Worker& worker)
{
  ReadyChunk chunk;
  try
  {
    const std::size_t bytes = this->Bytes(PyramidFileWriter::ChunkSize(this->Layout, level));
    if (worker.Raw.size() != bytes) // coarse levels have smaller ones
    {
      worker.Encoder = std::make_unique<ChunkEncoder>(this->Options.Compression,
        this->Options.CompressionLevel, bytes, SizeOf(this->Volume.Type));
      worker.Raw.resize(bytes);
    }
    const SavedChunks* saved = this->File->Saved();
    const LoggedChunk* there = saved != nullptr ? saved->Find(level, index) : nullptr;
    if (there != nullptr && saved->Read(*there, worker.Saved))
    {
      chunk.Store = chunk.Reused = there->Size > 0;
      chunk.Bytes = { worker.Saved.data(), worker.Saved.size(), there->FilterMask };
      chunk.Checksum = there->Checksum;
      return chunk;
    }
    this->CopyChunk(level, block, index, worker.Raw);
    chunk.Store = !IsAll(worker.Raw, this->Fill);
    if (chunk.Store)
    {
      chunk.Bytes = worker.Encoder->Encode(worker.Raw);
      chunk.Checksum = ChecksumOf(chunk.Bytes.Data, chunk.Bytes.Size);
    }
  }
  catch (const std::exception& e)
  {
    chunk.Outcome = Status(
      StatusCode::ResourceExhausted, std::string("Compressing a chunk failed: ") + e.what() + ".");
  }
  return chunk;
}

Status PyramidBuilder::StoreChunks(int level, const Block& block, std::uint64_t progressBytes)
{
  const Int3 size = PyramidFileWriter::ChunkSize(this->Layout, level);
  const ChunkBox chunks(block.Start, block.Size, size);
  const std::int64_t n = chunks.Number();
  // Progress is reported, and cancelling noticed, between groups of chunks, at whose ends threads
  // wait for one another.
  const std::int64_t group = progressBytes > 0
    ? std::max<std::int64_t>(8, std::int64_t{ ChunksPerMember } * this->Threads)
    : n;
  std::uint64_t reported = 0;
  for (std::int64_t begin = 0; begin < n; begin += group)
  {
    const std::int64_t end = std::min(n, begin + group);
    Status failure;
    // Written in order, so that the same volume always gives the same file.
    Turns turns(0);
    this->Team->Run(end - begin,
      [&](std::int64_t i, int member)
      {
        const Int3 index = chunks.Index(begin + i);
        const ReadyChunk chunk =
          this->MakeChunk(level, block, index, this->Workers[static_cast<std::size_t>(member)]);
        turns.Take(i,
          [&]
          {
            if (failure.Ok())
            {
              failure = chunk.Outcome;
            }
            if (!failure.Ok())
            {
              return;
            }
            if (!chunk.Store)
            {
              this->File->SkipChunk(level, index);
              return;
            }
            failure = this->File->WriteChunk(level, index, chunk.Bytes, chunk.Checksum);
            ++this->Counts.ChunksWritten;
            this->Counts.ChunksSaved += chunk.Reused ? 1 : 0;
          });
      });
    if (failure.Ok() && progressBytes > 0)
    {
      const std::uint64_t done = end == n
        ? progressBytes
        : static_cast<std::uint64_t>(
            static_cast<double>(progressBytes) * static_cast<double>(end) / static_cast<double>(n));
      failure = this->Advance(done - reported);
      reported = done;
    }
    if (!failure.Ok())
    {
      return failure;
    }
  }
  return {};
}

Status PyramidBuilder::StoreCells(int level, const PyramidCells& cells)
{
  if (cells.IsFill(this->Fill.data()))
  {
    return {};
  }
  this->MarkCellChunks(level, cells.Start, cells.Size);
  this->Levels[static_cast<std::size_t>(level)].Boxes.push_back({ cells.Start, cells.Size });
  return this->File->WriteCells(level, CellEdge, cells);
}

void PyramidBuilder::MarkCellChunks(int level, const Int3& start, const Int3& size)
{
  constexpr std::int64_t edge = PyramidFormat::CellsPerChunk;
  std::set<Int3>& marked = this->Levels[static_cast<std::size_t>(level)].CellChunks;
  for (std::int64_t z = start[2] / edge; z < CeilDiv(start[2] + size[2], edge); ++z)
  {
    for (std::int64_t y = start[1] / edge; y < CeilDiv(start[1] + size[1], edge); ++y)
    {
      for (std::int64_t x = start[0] / edge; x < CeilDiv(start[0] + size[0], edge); ++x)
      {
        marked.insert({ x, y, z });
      }
    }
  }
}

Status PyramidBuilder::CloseSeams(int level)
{
  // A copy: closing seams doesn't add boxes, but keeps the loop independent of that.
  const std::vector<CellBox> boxes = this->Levels[static_cast<std::size_t>(level)].Boxes;
  for (const CellBox& box : boxes)
  {
    for (std::size_t axis = 0; axis < 3; ++axis)
    {
      for (const bool upper : { false, true })
      {
        Status status = this->Advance(0); // may be cancelled
        if (status.Ok())
        {
          status = this->CloseSeam(level, box, axis, upper);
        }
        if (!status.Ok())
        {
          return status;
        }
      }
    }
  }
  return {};
}

Status PyramidBuilder::CloseSeam(int level, const CellBox& box, std::size_t axis, bool upper)
{
  const Int3& dimensions = this->Layout.Dimensions(level);
  const std::int64_t face = upper ? box.Start[axis] + box.Size[axis] : box.Start[axis];
  if (face == 0 || face * CellEdge >= dimensions[axis])
  {
    return {};
  }
  // Two layers of cells, one on each side of the face; beside them one cell more all around. In
  // slabs, so that a long face doesn't take more memory than a block.
  Int3 low = box.Start;
  Int3 high{};
  for (std::size_t a = 0; a < 3; ++a)
  {
    high[a] = box.Start[a] + box.Size[a];
  }
  low[axis] = face - 1;
  high[axis] = face + 1;
  const std::size_t sliced = axis == 2 ? 1 : 2;
  constexpr std::int64_t slab = 16;
  for (std::int64_t s = low[sliced]; s < high[sliced]; s += slab)
  {
    Int3 from = low;
    Int3 to = high;
    from[sliced] = s;
    to[sliced] = std::min(s + slab, high[sliced]);
    Int3 start{};
    Int3 size{};
    Int3 innerLow{};
    Int3 innerHigh{};
    for (std::size_t a = 0; a < 3; ++a)
    {
      start[a] = std::max<std::int64_t>(0, from[a] - 1);
      size[a] = std::min(to[a] + 1, CeilDiv(dimensions[a], CellEdge)) - start[a];
      innerLow[a] = from[a] - start[a];
      innerHigh[a] = to[a] - start[a];
    }
    PyramidCells cells(this->Volume.Type, this->Volume.Components, start, size);
    Status status = this->File->ReadCells(level, CellEdge, cells);
    if (status.Ok())
    {
      cells.BoundGradients(innerLow, innerHigh, this->Spacing(level));
      status = this->File->WriteCells(level, CellEdge, cells);
      this->MarkCellChunks(level, start, size);
    }
    if (!status.Ok())
    {
      return status;
    }
  }
  return {};
}

Status PyramidBuilder::BuildCoarseCells(int level)
{
  constexpr std::int64_t chunk = PyramidFormat::CellsPerChunk;
  const Int3& dimensions = this->Layout.Dimensions(level);
  const std::int64_t longest = *std::max_element(dimensions.begin(), dimensions.end());
  std::set<Int3> chunks = this->Levels[static_cast<std::size_t>(level)].CellChunks;
  for (std::int64_t edge = CellEdge; edge < longest; edge *= CellEdge)
  {
    std::set<Int3> next;
    for (const Int3& index : chunks)
    {
      Int3 start{};
      Int3 size{};
      Int3 parent{};
      for (std::size_t a = 0; a < 3; ++a)
      {
        start[a] = index[a] * chunk;
        size[a] = std::min(chunk, CeilDiv(dimensions[a], edge) - start[a]);
        parent[a] = index[a] / CellEdge;
      }
      PyramidCells cells(this->Volume.Type, this->Volume.Components, start, size);
      Status status = this->Advance(0);
      if (status.Ok())
      {
        status = this->File->ReadCells(level, edge, cells);
      }
      if (status.Ok())
      {
        status = this->File->WriteCells(level, edge * CellEdge, cells.Coarser());
      }
      if (!status.Ok())
      {
        return status;
      }
      next.insert(parent);
    }
    chunks = std::move(next);
  }
  return {};
}

} // namespace teravox
