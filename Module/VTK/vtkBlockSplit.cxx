// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "vtkBlockSplit.h"

#include "BlockPictures.h"
#include "BlockSplit.h"
#include "VolumePlace.h"
#include "vtkBrickSource.h"

#include <algorithm>
#include <array>
#include <optional>
#include <vtkCamera.h>
#include <vtkDoubleArray.h>
#include <vtkFloatArray.h>
#include <vtkIdList.h>
#include <vtkMath.h>
#include <vtkObjectFactory.h>
#include <vtkProp3D.h>
#include <vtkRenderer.h>
#include <vtkSmartPointer.h>

using teravox::BlockSplit;
using teravox::Double3;
using teravox::Int3;
using teravox::Matrix4;
using teravox::VoxelBox;

class vtkBlockSplit::vtkInternals
{
public:
  vtkSmartPointer<vtkBrickSource> Holder;
  std::vector<double> Weights;

  const teravox::BrickSource* Source() const
  {
    return this->Holder ? this->Holder->GetBrickSource().get() : nullptr;
  }

  int Level(vtkBlockSplit* self) const
  {
    return BlockSplit::ChooseLevel(
      this->Source()->Info().Layout, self->GetNumberOfBlocks(), self->GetBricksPerBlock());
  }

  // The blocks of the present settings; null, after an error, if there are none.
  const BlockSplit* Update(vtkBlockSplit* self)
  {
    const teravox::BrickSource* source = this->Source();
    if (!source)
    {
      vtkErrorWithObjectMacro(self, "There is no brick source to be divided into blocks.");
      this->Split.reset();
      return nullptr;
    }
    const teravox::PyramidLayout& layout = source->Info().Layout;
    const int level = this->Level(self);
    if (!this->Split || !(this->Layout == layout) || this->Split->Level() != level ||
      this->Split->NumberOfBlocks() != self->GetNumberOfBlocks() || this->Changed)
    {
      const bool fit =
        static_cast<vtkIdType>(this->Weights.size()) == self->GetNumberOfGridBricks();
      auto split = BlockSplit::Make(
        layout, self->GetNumberOfBlocks(), level, fit ? this->Weights : std::vector<double>());
      if (!split)
      {
        vtkErrorWithObjectMacro(self, << split.GetStatus().Message());
        this->Split.reset();
        return nullptr;
      }
      this->Split = std::move(split.Value());
      this->Layout = layout;
      this->Changed = false;
    }
    return &*this->Split;
  }

  const VoxelBox* Block(vtkBlockSplit* self, int block)
  {
    const BlockSplit* split = this->Update(self);
    const bool known = split && block >= 0 && block < split->NumberOfBlocks();
    return known && !split->Block(block).IsEmpty() ? &split->Block(block) : nullptr;
  }

  bool Changed = true;

private:
  std::optional<BlockSplit> Split;
  teravox::PyramidLayout Layout;
};

vtkStandardNewMacro(vtkBlockSplit);

vtkBlockSplit::vtkBlockSplit()
  : Internals(std::make_unique<vtkInternals>())
{
}

vtkBlockSplit::~vtkBlockSplit() = default;

void vtkBlockSplit::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "BrickSource: " << this->Internals->Holder.Get() << "\n"
     << indent << "NumberOfBlocks: " << this->NumberOfBlocks << "\n"
     << indent << "BricksPerBlock: " << this->BricksPerBlock << "\n"
     << indent << "Weights: " << this->Internals->Weights.size() << "\n";
}

void vtkBlockSplit::SetBrickSource(vtkBrickSource* source)
{
  if (this->Internals->Holder != source)
  {
    this->Internals->Holder = source;
    this->Internals->Weights.clear();
    this->Internals->Changed = true;
    this->Modified();
  }
}

vtkBrickSource* vtkBlockSplit::GetBrickSource() const
{
  return this->Internals->Holder;
}

int vtkBlockSplit::GetGridLevel()
{
  return this->Internals->Source() ? this->Internals->Level(this) : -1;
}

vtkIdType vtkBlockSplit::GetNumberOfGridBricks()
{
  const teravox::BrickSource* source = this->Internals->Source();
  if (!source)
  {
    return 0;
  }
  const teravox::Int3& n = source->Info().Layout.Bricks(this->GetGridLevel());
  return n[0] * n[1] * n[2];
}

bool vtkBlockSplit::SetWeights(vtkDoubleArray* weights)
{
  std::vector<double> values;
  if (weights)
  {
    values.assign(weights->GetPointer(0), weights->GetPointer(0) + weights->GetNumberOfValues());
    if (static_cast<vtkIdType>(values.size()) != this->GetNumberOfGridBricks() ||
      !std::all_of(
        values.begin(), values.end(), [](double w) { return w >= 0 && vtkMath::IsFinite(w); }))
    {
      vtkErrorMacro("There must be one weight for each of the "
        << this->GetNumberOfGridBricks() << " bricks of the grid, finite and not negative; "
        << values.size() << " were given.");
      return false;
    }
  }
  if (values != this->Internals->Weights)
  {
    this->Internals->Weights = std::move(values);
    this->Internals->Changed = true;
    this->Modified();
  }
  return true;
}

bool vtkBlockSplit::Rebalance(vtkDoubleArray* weights, double worth)
{
  const BlockSplit* now = this->Internals->Update(this);
  if (!now)
  {
    return false;
  }
  // What the blocks of now weigh by the new weights.
  const teravox::PyramidLayout& layout = this->Internals->Source()->Info().Layout;
  const std::vector<double> before = this->Internals->Weights;
  std::vector<VoxelBox> boxes;
  for (int block = 0; block < now->NumberOfBlocks(); ++block)
  {
    boxes.push_back(now->Block(block));
  }
  const Int3& bricks = layout.Bricks(now->Level());
  double most = 0;
  const bool fit = weights && weights->GetNumberOfValues() == this->GetNumberOfGridBricks();
  for (const VoxelBox& box : boxes)
  {
    const teravox::BrickBox covered = teravox::BricksOfBlock(layout, now->Level(), box);
    double sum = 0;
    for (std::int64_t z = covered.Low[2]; fit && z < covered.High[2]; ++z)
    {
      for (std::int64_t y = covered.Low[1]; y < covered.High[1]; ++y)
      {
        for (std::int64_t x = covered.Low[0]; x < covered.High[0]; ++x)
        {
          sum += weights->GetValue((z * bricks[1] + y) * bricks[0] + x);
        }
      }
    }
    most = std::max(most, sum);
  }
  if (!this->SetWeights(weights))
  {
    return false;
  }
  double mostThen = 0;
  for (int block = 0; block < this->NumberOfBlocks; ++block)
  {
    mostThen = std::max(mostThen, this->GetBlockWeight(block));
  }
  if (mostThen * worth < most)
  {
    return true;
  }
  this->Internals->Weights = before;
  this->Internals->Changed = true;
  return false;
}

bool vtkBlockSplit::GetOpacityInFront(
  vtkFloatArray* ofAll, vtkIdList* order, int block, vtkFloatArray* inFront)
{
  const vtkIdType values = ofAll->GetNumberOfValues();
  const vtkIdType tiles = values / this->NumberOfBlocks;
  if (tiles * this->NumberOfBlocks != values)
  {
    vtkErrorMacro("There must be as many tiles for each of the "
      << this->NumberOfBlocks << " blocks; " << values << " were given.");
    return false;
  }
  std::vector<int> sorted;
  for (const vtkIdType id : *order)
  {
    if (id >= 0 && id < this->NumberOfBlocks)
    {
      sorted.push_back(static_cast<int>(id));
    }
  }
  const std::vector<float> opacities =
    teravox::OpacityInFront({ ofAll->GetPointer(0), ofAll->GetPointer(0) + values },
      static_cast<std::size_t>(tiles), sorted, block);
  inFront->SetNumberOfComponents(1);
  inFront->SetNumberOfTuples(tiles);
  std::copy(opacities.begin(), opacities.end(), inFront->GetPointer(0));
  return true;
}

void vtkBlockSplit::GetBlockExtent(int block, int extent[6])
{
  const VoxelBox* box = this->Internals->Block(this, block);
  for (std::size_t a = 0; a < 3; ++a)
  {
    extent[2 * a] = box ? static_cast<int>(box->Low[a]) : 0;
    extent[2 * a + 1] = box ? static_cast<int>(box->High[a] - 1) : -1;
  }
}

void vtkBlockSplit::GetBlockBounds(int block, double bounds[6])
{
  vtkMath::UninitializeBounds(bounds);
  const VoxelBox* box = this->Internals->Block(this, block);
  if (!box)
  {
    return;
  }
  // Of point data the volume ends at the centres of its outermost voxels.
  const teravox::VolumeInfo& info = this->Internals->Source()->Info();
  const double inset = info.CellData ? 0.0 : 0.5;
  Double3 low{};
  Double3 high{};
  for (std::size_t a = 0; a < 3; ++a)
  {
    const auto end = static_cast<double>(info.Layout.Dimensions(0)[a]);
    low[a] = std::clamp(static_cast<double>(box->Low[a]), inset, end - inset);
    high[a] = std::clamp(static_cast<double>(box->High[a]), inset, end - inset);
  }
  teravox::BoundsOf(teravox::DatasetFromVoxel(info), low, high, bounds);
}

double vtkBlockSplit::GetBlockWeight(int block)
{
  const BlockSplit* split = this->Internals->Update(this);
  return split && block >= 0 && block < split->NumberOfBlocks() ? split->Weight(block) : 0.0;
}

bool vtkBlockSplit::GetFrontToBack(vtkRenderer* renderer, vtkProp3D* volume, vtkIdList* order)
{
  order->Reset();
  const BlockSplit* split = this->Internals->Update(this);
  if (!split)
  {
    return false;
  }
  vtkCamera* camera = renderer->GetActiveCamera();
  teravox::ViewInput view;
  view.ViewFromWorld = teravox::ToMatrix(camera->GetModelViewTransformMatrix());
  view.ClipFromView =
    teravox::ToMatrix(camera->GetProjectionTransformMatrix(renderer->GetTiledAspectRatio(), -1, 1));
  view.DatasetFromVoxel = teravox::DatasetFromVoxel(this->Internals->Source()->Info());
  view.WorldFromDataset = Matrix4{ 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1 };
  if (volume)
  {
    view.WorldFromDataset = teravox::ToMatrix(volume->GetMatrix());
  }
  const auto from = teravox::BlockView::Of(view);
  if (!from)
  {
    vtkErrorMacro(<< from.GetStatus().Message());
    return false;
  }
  for (const int block : split->FrontToBack(from.Value()))
  {
    order->InsertNextId(block);
  }
  return true;
}

void vtkBlockSplit::AddWeights(
  const std::vector<teravox::BrickKey>& bricks, vtkDoubleArray* weights)
{
  const teravox::BrickSource* source = this->Internals->Source();
  const vtkIdType count = this->GetNumberOfGridBricks();
  if (weights->GetNumberOfComponents() != 1 || weights->GetNumberOfTuples() != count)
  {
    weights->SetNumberOfComponents(1);
    weights->SetNumberOfTuples(count);
    weights->FillValue(0);
  }
  if (!source)
  {
    return;
  }
  const teravox::VolumeInfo& info = source->Info();
  std::vector<double> sums(static_cast<std::size_t>(count), 0.0);
  // In an order that depends on no hash: shares of coarser bricks are rounded.
  std::vector<teravox::BrickKey> sorted = bricks;
  std::sort(sorted.begin(), sorted.end());
  for (const teravox::BrickKey& brick : sorted)
  {
    if (teravox::CheckKey(brick, info))
    {
      teravox::SpreadWeight(info.Layout, this->GetGridLevel(), brick,
        static_cast<double>(teravox::BrickVoxelBytes(info)), sums);
    }
  }
  for (vtkIdType i = 0; i < count; ++i)
  {
    weights->SetValue(i, weights->GetValue(i) + sums[static_cast<std::size_t>(i)]);
  }
}
