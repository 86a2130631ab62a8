// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// The pass over the voxels of a block: statistics, histogram and the next level.
#include "Downsampling.h"
#include "PyramidBuilder.h"
#include "PyramidFormat.h"

#include <algorithm>
#include <utility>

namespace teravox
{

namespace
{
constexpr std::int64_t CellEdge = PyramidFormat::CellEdge;
}

Status PyramidBuilder::ReadAndScan(
  int level, Block& block, const PyramidCellScan& scan, Block* coarser)
{
  // At least as thick as a layer of cells, and as many bytes as make a read worth its call.
  constexpr std::size_t least = std::size_t{ 4 } << 20;
  const std::size_t sliceBytes = this->Bytes({ block.Size[0], block.Size[1], 1 });
  const auto layers =
    static_cast<std::int64_t>((least + sliceBytes * CellEdge - 1) / (sliceBytes * CellEdge));
  const std::int64_t thickness = CellEdge * layers;
  // The team works on Rows until it is asked to finish, whatever happens here.
  struct Shift
  {
    WorkerTeam& Team;
    WorkerTeam::Work Rows;
    bool Running = false;

    void Finish()
    {
      const bool running = std::exchange(this->Running, false);
      if (running)
      {
        this->Team.Finish();
      }
    }
    ~Shift()
    {
      try
      {
        this->Finish();
      }
      catch (...) // what is already on its way out comes first
      {
      }
    }
  };
  Shift shift{ *this->Team, nullptr };
  std::int64_t done = 0;
  for (std::int64_t z = 0; z < block.Size[2]; z += thickness)
  {
    const std::int64_t slices = std::min(thickness, block.Size[2] - z);
    const Status status = this->ReadBox({ block.Start[0], block.Start[1], block.Start[2] + z },
      { block.Size[0], block.Size[1], slices },
      block.Voxels.Data() + static_cast<std::size_t>(z) * sliceBytes);
    shift.Finish();
    if (!status.Ok())
    {
      return status;
    }
    const std::int64_t begin = std::exchange(done, scan.RowsOf(z + slices));
    shift.Rows = [this, level, &block, &scan, coarser, begin](std::int64_t row, int member)
    { this->ScanRow(level, block, scan, begin + row, coarser, member); };
    this->Team->Start(done - begin, shift.Rows);
    shift.Running = true;
  }
  shift.Finish();
  block.Unread = false;
  return {};
}

PyramidBuilder::Block PyramidBuilder::Coarser(int level, Block& fine, Block shape)
{
  Block coarse = std::move(shape);
  this->Allocate(coarse);
  const std::int64_t rows = CeilDiv(fine.Size[1], CellEdge);
  this->Team->Run(rows * CeilDiv(fine.Size[2], CellEdge),
    [&](std::int64_t i, int)
    {
      const Int3 first{ 0, i % rows * CellEdge, i / rows * CellEdge };
      this->Downsample(level, fine, first, { fine.Size[0], CellEdge, CellEdge }, coarse);
    });
  this->Free(fine);
  return coarse;
}

void PyramidBuilder::Downsample(
  int level, const Block& fine, const Int3& first, const Int3& size, Block& coarse) const
{
  const Downsampling method = this->Options.Downsampling == PyramidDownsampling::Mode
    ? Downsampling::Mode
    : Downsampling::Average;
  const int components = this->Volume.Components;
  DispatchScalarType(this->Volume.Type,
    [&](auto example)
    {
      using T = decltype(example);
      BoxView<const T> from =
        BoxView<const T>::Dense(reinterpret_cast<const T*>(fine.Data()), fine.Size, components);
      BoxView<T> to =
        BoxView<T>::Dense(reinterpret_cast<T*>(coarse.Voxels.Data()), coarse.Size, components);
      Int3 ratio{};
      Int3 start{};
      for (std::size_t a = 0; a < 3; ++a)
      {
        ratio[a] = this->Layout.Factor(level + 1)[a] / this->Layout.Factor(level)[a];
        start[a] = first[a] / ratio[a];
        from.Dimensions[a] = std::min(size[a], fine.Size[a] - first[a]);
        to.Dimensions[a] = CeilDiv(from.Dimensions[a], ratio[a]);
      }
      from.Data = from.Row(first[1], first[2]) + first[0] * components;
      to.Data = to.Row(start[1], start[2]) + start[0] * components;
      DownsampleBox<T>(from, ratio, method, to);
    });
}

void PyramidBuilder::ScanRow(int level, const Block& block, const PyramidCellScan& scan,
  std::int64_t row, Block* coarser, int member)
{
  scan.Scan(row);
  const std::int64_t rows = CeilDiv(block.Size[1], CellEdge);
  const Int3 first{ 0, row % rows * CellEdge, row / rows * CellEdge };
  if (level == 0 && !this->Histogram_.NeedsRange())
  {
    const std::size_t scalars =
      static_cast<std::size_t>(block.Size[0]) * static_cast<std::size_t>(this->Volume.Components);
    const std::size_t rowBytes = scalars * SizeOf(this->Volume.Type);
    const std::int64_t count = std::min(CellEdge, block.Size[1] - first[1]);
    for (std::int64_t z = first[2]; z < std::min(first[2] + CellEdge, block.Size[2]); ++z)
    {
      const auto before = static_cast<std::size_t>(z * block.Size[1] + first[1]);
      this->Histogram_.Count(block.Data() + before * rowBytes,
        scalars * static_cast<std::size_t>(count),
        this->Workers[static_cast<std::size_t>(member)].Histogram);
    }
  }
  if (coarser != nullptr)
  {
    this->Downsample(level, block, first, { block.Size[0], CellEdge, CellEdge }, *coarser);
  }
}

void PyramidBuilder::CountValues(const Block& block, const ValueRange& range)
{
  this->Range_.Include(range);
  if (this->Histogram_.NeedsRange())
  {
    const std::size_t size = SizeOf(this->Volume.Type);
    const std::size_t count = this->Bytes(block.Size) / size;
    if (!this->Histogram_.Prepare(block.Data(), count, range))
    {
      return;
    }
    constexpr std::size_t piece = std::size_t{ 1 } << 16;
    this->Team->Run(static_cast<std::int64_t>((count + piece - 1) / piece),
      [&](std::int64_t item, int member)
      {
        const std::size_t begin = static_cast<std::size_t>(item) * piece;
        this->Histogram_.Count(block.Data() + begin * size, std::min(piece, count - begin),
          this->Workers[static_cast<std::size_t>(member)].Histogram);
      });
  }
  for (Worker& worker : this->Workers)
  {
    this->Histogram_.Add(worker.Histogram);
  }
}

} // namespace teravox
