// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "Ranks.h"

#include "vtkBlockSplit.h"
#include "vtkBrickSource.h"
#include "vtkOutOfCoreVolumeMapper.h"

#include <algorithm>
#include <gtest/gtest.h>
#include <vtkDoubleArray.h>
#include <vtkIdList.h>
#include <vtkRenderer.h>
#include <vtkVolume.h>

namespace teravox::test
{

std::vector<float> BlendFrontToBack(const std::vector<const std::vector<float>*>& pictures)
{
  std::vector<float> blended(pictures.empty() ? 0 : pictures.front()->size(), 0.0f);
  for (const std::vector<float>* picture : pictures)
  {
    for (std::size_t i = 0; i < blended.size(); i += 4)
    {
      const float left = 1 - blended[i + 3];
      for (std::size_t c = 0; c < 4; ++c)
      {
        blended[i + c] += left * (*picture)[i + c];
      }
    }
  }
  return blended;
}

Ranks::Ranks(int count, int width, int height, const SourceOfRank& source,
  const std::function<void(Stage&)>& set)
{
  for (int r = 0; r < count; ++r)
  {
    this->Sources.push_back(std::make_shared<RecordingSource>(source(r)));
    this->Stages.push_back(std::make_unique<Stage>(width, height));
    this->Stages.back()->SetSource(this->Sources.back());
    set(*this->Stages.back());
    this->Stages.back()->Mapper->BlockOn();
  }
  this->Split->SetBrickSource(this->Stages.front()->Mapper->GetBrickSource());
  this->Split->SetNumberOfBlocks(count);
}

Ranks::~Ranks() = default;

VoxelBox Ranks::BlockOf(int rank)
{
  int extent[6];
  this->Split->GetBlockExtent(rank, extent);
  return { { extent[0], extent[2], extent[4] },
    { extent[1] + 1LL, extent[3] + 1LL, extent[5] + 1LL } };
}

std::vector<float> Ranks::Draw()
{
  std::vector<std::vector<float>> pictures;
  for (int r = 0; r < this->Count(); ++r)
  {
    Stage& stage = this->At(r);
    int extent[6];
    this->Split->GetBlockExtent(r, extent);
    stage.Mapper->SetBlockExtent(extent);
    pictures.push_back(stage.Draw());
    EXPECT_EQ(stage.Mapper->CheckInvariants(), "") << "rank " << r;
  }
  vtkNew<vtkIdList> order;
  EXPECT_TRUE(this->Split->GetFrontToBack(this->At(0).Renderer, this->At(0).Volume, order));
  std::vector<const std::vector<float>*> sorted;
  for (const vtkIdType block : *order)
  {
    sorted.push_back(&pictures[static_cast<std::size_t>(block)]);
  }
  return BlendFrontToBack(sorted);
}

std::vector<float> Ranks::DrawKnowingOthers(std::vector<float>* seen)
{
  const bool suspects = this->LastTiles->GetNumberOfValues() > 0;
  vtkNew<vtkFloatArray> inFront;
  for (int r = 0; r < this->Count(); ++r)
  {
    if (suspects)
    {
      this->InFrontOf(r, this->LastTiles, inFront);
    }
    this->At(r).Mapper->SuspectHidden(suspects ? inFront.Get() : nullptr);
  }
  std::vector<float> picture = this->Draw();
  this->SeenBytes = this->BytesRead();
  if (seen)
  {
    *seen = picture;
  }
  this->GatherTiles(this->LastTiles);
  if (suspects)
  {
    for (int r = 0; r < this->Count(); ++r)
    {
      this->InFrontOf(r, this->LastTiles, inFront);
      EXPECT_TRUE(this->At(r).Mapper->ConfirmHidden(inFront)) << "rank " << r;
    }
    picture = this->Draw();
    this->GatherTiles(this->LastTiles);
  }
  return picture;
}

bool Ranks::AreConverged()
{
  return std::all_of(this->Stages.begin(), this->Stages.end(),
    [](const auto& stage) { return stage->Mapper->IsConverged(); });
}

void Ranks::GatherTiles(vtkFloatArray* ofAll)
{
  ofAll->Reset();
  for (int r = 0; r < this->Count(); ++r)
  {
    vtkNew<vtkFloatArray> tiles;
    EXPECT_TRUE(this->At(r).Mapper->GetOpacityTiles(tiles)) << "rank " << r;
    for (vtkIdType i = 0; i < tiles->GetNumberOfValues(); ++i)
    {
      ofAll->InsertNextValue(tiles->GetValue(i));
    }
  }
}

void Ranks::InFrontOf(int rank, vtkFloatArray* ofAll, vtkFloatArray* inFront)
{
  vtkNew<vtkIdList> order;
  EXPECT_TRUE(this->Split->GetFrontToBack(this->At(0).Renderer, this->At(0).Volume, order));
  EXPECT_TRUE(this->Split->GetOpacityInFront(ofAll, order, rank, inFront));
}

void Ranks::AddWeights(vtkDoubleArray* weights)
{
  for (int r = 0; r < this->Count(); ++r)
  {
    this->At(r).Mapper->AddBrickWeights(this->Split, weights);
  }
}

void Ranks::Rebalance()
{
  vtkNew<vtkDoubleArray> weights;
  this->AddWeights(weights);
  EXPECT_TRUE(this->Split->SetWeights(weights));
}

bool Ranks::RebalanceIfWorthIt()
{
  vtkNew<vtkDoubleArray> weights;
  this->AddWeights(weights);
  return this->Split->Rebalance(weights);
}

std::uint64_t Ranks::BytesRead() const
{
  std::uint64_t bytes = 0;
  for (const auto& source : this->Sources)
  {
    bytes += source->BytesRead();
  }
  return bytes;
}

double Ranks::MostOverMean()
{
  double most = 0;
  double sum = 0;
  for (int r = 0; r < this->Count(); ++r)
  {
    vtkNew<vtkDoubleArray> weights;
    this->At(r).Mapper->AddBrickWeights(this->Split, weights);
    double mine = 0;
    for (vtkIdType i = 0; i < weights->GetNumberOfValues(); ++i)
    {
      mine += weights->GetValue(i);
    }
    most = std::max(most, mine);
    sum += mine;
  }
  return sum > 0 ? most * this->Count() / sum : 1.0;
}

} // namespace teravox::test
