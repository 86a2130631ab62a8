// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// Sort-last rendering: what ranks load, how they share it, what becomes of failures; blocks that
// are huge, empty, turned or moved.
#include "FaultyBrickSource.h"
#include "FormulaBrickSource.h"
#include "ImageMetrics.h"
#include "RankVolumes.h"
#include "Ranks.h"
#include "vtkBlockSplit.h"
#include "vtkOutOfCoreVolumeMapper.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <gtest/gtest.h>
#include <vtkCommand.h>
#include <vtkIdList.h>
#include <vtkVolume.h>

using namespace teravox;
using namespace teravox::test;

namespace
{

void LookAtFog(Stage& s)
{
  // Thin enough that no ray ends before the volume does.
  s.SetTransfer(MakeTransfer(OpacityShape::Fog, 0, 255, 40));
  s.Look({ 0.4, 1, -0.3 }, 0.9);
  s.Mapper->SetMaximumLevel(0);
  s.Mapper->AutoAdjustSampleDistancesOff();
}

std::size_t RanksWithoutReads(const Ranks& ranks)
{
  std::size_t count = 0;
  for (int r = 0; r < ranks.Count(); ++r)
  {
    count += ranks.ReadsOf(r).Reads() == 0 ? 1 : 0;
  }
  return count;
}

} // namespace

// Of level 0, each brick is read by one rank, and by that once.
TEST(SortLast, RanksShareTheBricksOfOne)
{
  const auto source = Noise();
  const auto record = std::make_shared<RecordingSource>(source);
  Stage one(Size, Size);
  one.SetSource(record);
  LookAtFog(one);
  one.Draw();
  for (const int count : { 2, 3, 4, 8 })
  {
    Ranks ranks(
      count, Size, Size, [&](int) { return source; }, LookAtFog);
    ranks.Draw();
    BrickSet all;
    std::size_t reads = 0;
    for (int r = 0; r < count; ++r)
    {
      const BrickSet mine = ranks.ReadsOf(r).Read();
      EXPECT_FALSE(mine.empty()) << "rank " << r;
      all.insert(mine.begin(), mine.end());
      reads += ranks.ReadsOf(r).Reads();
    }
    EXPECT_EQ(all, record->Read()) << count << " ranks";
    EXPECT_EQ(reads, record->Reads()) << count << " ranks";
  }
}

TEST(SortLast, RankThatSeesNothingLoadsNothing)
{
  const auto source = Noise();
  const auto set = [](Stage& s)
  {
    LookAtFog(s);
    // From the middle to a corner: of eight blocks most lie behind the eye or beside the picture.
    double b[6];
    s.Mapper->GetBounds(b);
    const std::array<double, 3> middle{ 0.5 * (b[0] + b[1]), 0.5 * (b[2] + b[3]),
      0.5 * (b[4] + b[5]) };
    s.LookFrom(
      { middle[0], middle[1], middle[2] + 15 }, { middle[0], middle[1], b[5] }, 0.05, 300, 30);
  };
  Stage one(Size, Size);
  one.SetSource(source);
  set(one);
  const std::vector<float> reference = one.Draw();
  for (const bool interactive : { false, true })
  {
    Ranks ranks(
      8, Size, Size, [&](int) { return source; },
      [&](Stage& s)
      {
        set(s);
        s.Mapper->SetFrameTimeBudget(interactive ? 0.05 : 0.0);
      });
    std::vector<float> picture;
    for (int frame = 0; frame < (interactive ? 200 : 1); ++frame)
    {
      picture = ranks.Draw();
      bool converged = true;
      for (int r = 0; r < 8; ++r)
      {
        converged = converged && ranks.At(r).Mapper->IsConverged();
      }
      if (converged)
      {
        break;
      }
    }
    EXPECT_LE(CompareImages(picture, reference).Max, 1e-3);
    const std::size_t idle = RanksWithoutReads(ranks);
    // Interactive, the coarsest brick is kept by all whose block meets it.
    EXPECT_GE(idle, interactive ? 0u : 4u);
    EXPECT_LT(idle, 8u);
  }
}

TEST(SortLast, EmptyExtentDrawsAndLoadsNothing)
{
  const auto record = std::make_shared<RecordingSource>(Noise());
  Stage stage(Size, Size);
  stage.SetSource(record);
  LookAtFog(stage);
  for (const double budget : { 0.0, 0.1 })
  {
    stage.Mapper->BlockOn();
    stage.Mapper->SetBlockExtent(0, -1, 0, -1, 0, -1);
    stage.Mapper->SetFrameTimeBudget(budget);
    const std::vector<float> picture = stage.Draw();
    EXPECT_TRUE(stage.Mapper->IsConverged());
    EXPECT_EQ(*std::max_element(picture.begin(), picture.end()), 0.0f);
    EXPECT_EQ(record->Reads(), 0u);
    // Beside the volume.
    stage.Mapper->SetBlockExtent(200, 300, 0, 10, 0, 10);
    EXPECT_EQ(stage.Draw(), picture);
    EXPECT_EQ(record->Reads(), 0u);
  }
}

// Contract 1 with blocks: the whole volume as one block is the same to the bit, and what was drawn
// before leaves no trace.
TEST(SortLast, WholeVolumeAsABlockIsTheSameToTheBit)
{
  const auto source = Noise();
  Stage stage(Size, Size);
  stage.SetSource(source);
  stage.SetTransfer(MakeTransfer(OpacityShape::Peak, 0, 255, 8));
  stage.SetShade(true);
  LookInside(stage);
  stage.Mapper->AutoAdjustSampleDistancesOff();
  const std::vector<float> reference = stage.Draw();
  stage.Mapper->BlockOn();
  stage.Mapper->SetBlockExtent(0, 95, 0, 79, 0, 111);
  EXPECT_TRUE(AreImagesIdentical(stage.Draw(), reference));
  stage.Mapper->SetBlockExtent(32, 63, 0, 79, 16, 111);
  const std::vector<float> part = stage.Draw();
  EXPECT_GT(CompareImages(part, reference).Max, 0.05);
  // With few slots, in another order.
  Stage other(Size, Size);
  other.SetSource(source);
  other.SetTransfer(MakeTransfer(OpacityShape::Peak, 0, 255, 8));
  other.SetShade(true);
  LookInside(other);
  other.Mapper->AutoAdjustSampleDistancesOff();
  other.Mapper->SetMaximumNumberOfSlots(4);
  other.Mapper->SetArrivalShuffleSeed(9);
  other.Mapper->BlockOn();
  other.Mapper->SetBlockExtent(32, 63, 0, 79, 16, 111);
  EXPECT_TRUE(AreImagesIdentical(other.Draw(), part));
  stage.Mapper->BlockOff();
  EXPECT_TRUE(AreImagesIdentical(stage.Draw(), reference));
}

// Faces of bricks beyond 2^24 voxels, where floats don't hold whole numbers any more.
TEST(SortLast, HugeVolume)
{
  FormulaDescription formula;
  const std::int64_t edge = std::int64_t{ 1 } << 30;
  formula.Dimensions = { edge, edge, edge };
  formula.Field = MakeFormula(FormulaKind::Sponge, formula.Dimensions);
  formula.Type = ScalarType::UInt8;
  formula.BrickSize = BrickEdge;
  const std::shared_ptr<BrickSource> source = FormulaBrickSource::Make(formula).Value();
  const double far = static_cast<double>(edge);
  for (const bool inside : { false, true })
  {
    const auto set = [inside, far](Stage& s)
    {
      s.SetTransfer(MakeTransfer(OpacityShape::Ramp, 0, 255, inside ? 1e6 : 1e8));
      if (inside)
      {
        // From a tunnel of the sponge to where planes of the split meet.
        s.LookFrom({ 0.5 * far, 0.48 * far, 0.49 * far }, { 0.36 * far, 0.7 * far, 0.3 * far }, 1e5,
          2e9, 60);
      }
      else
      {
        s.Look({ 0.3, 1, 0.4 }, 0.8);
      }
    };
    Stage one(Size, Size);
    one.SetSource(source);
    set(one);
    const std::vector<float> reference = one.Draw();
    EXPECT_GT(*std::max_element(reference.begin(), reference.end()), 0.1f);
    for (const int count : { 3, 8 })
    {
      Ranks ranks(
        count, Size, Size, [&](int) { return source; }, set);
      const ImageDifference off = CompareImages(ranks.Draw(), reference);
      std::printf("  2^30 voxels per axis, %s, %d ranks: %.5f from one rank\n",
        inside ? "inside" : "outside", count, off.Max);
      EXPECT_LE(off.Max, Tolerance);
    }
  }
}

// By what rays need instead of voxels; the picture doesn't change.
TEST(SortLast, MovedSplitBalancesWhatRaysNeed)
{
  // Something to be seen in one corner only.
  const auto source = SourceOf([](double x, double y, double z)
    { return x < 0.45 && y < 0.5 && z < 0.4 ? BlobField(2 * x, 2 * y, 2 * z) * 0.5 + 0.4 : 0.0; });
  const auto set = [](Stage& s)
  {
    s.SetTransfer(MakeTransfer(OpacityShape::Ramp, 0, 255, 30));
    s.Look({ 0.4, 1, -0.3 }, 0.9);
    s.Mapper->SetMaximumLevel(0);
    s.Mapper->RecordBricksOn();
  };
  Stage one(Size, Size);
  one.SetSource(source);
  set(one);
  const std::vector<float> reference = one.Draw();
  for (const int count : { 2, 3, 4, 8 })
  {
    Ranks ranks(
      count, Size, Size, [&](int) { return source; }, set);
    ranks.Split->SetBricksPerBlock(64);
    EXPECT_LE(CompareImages(ranks.Draw(), reference).Max, Tolerance);
    const double before = ranks.MostOverMean();
    const std::uint64_t first = ranks.BytesRead();
    ranks.Rebalance();
    EXPECT_LE(CompareImages(ranks.Draw(), reference).Max, Tolerance);
    const double after = ranks.MostOverMean();
    const std::uint64_t moved = ranks.BytesRead() - first;
    std::printf("  %d ranks: bytes of the one that needs most over the mean: %.2f by voxels, %.2f "
                "by need; %.2f x the bytes read again\n",
      count, before, after, static_cast<double>(moved) / static_cast<double>(first));
    EXPECT_LT(after, before) << count << " ranks";
    EXPECT_LE(after, 1.5) << count << " ranks";
    // Nothing moves where nothing has changed.
    const VoxelBox block = ranks.BlockOf(count - 1);
    ranks.Rebalance();
    EXPECT_EQ(ranks.BlockOf(count - 1), block);
    const std::uint64_t second = ranks.BytesRead();
    ranks.Draw();
    EXPECT_EQ(ranks.BytesRead(), second);
  }
}

namespace
{

// Counts instead of printing.
class EventCounter : public vtkCommand
{
public:
  static EventCounter* New() { return new EventCounter; }
  void Execute(vtkObject*, unsigned long, void*) override { ++this->Count; }
  int Count = 0;
};

} // namespace

TEST(SortLast, RankWhoseDiskFails)
{
  const auto source = SourceOf(BlobField);
  const auto set = [](Stage& s)
  {
    s.SetTransfer(MakeTransfer(OpacityShape::Ramp, 0, 255, 4));
    s.Look({ 0.4, 1, -0.3 }, 0.9);
    s.Mapper->SetMaximumLevel(0);
  };
  Stage one(Size, Size);
  one.SetSource(source);
  set(one);
  const std::vector<float> reference = one.Draw();
  constexpr int broken = 2;
  for (const bool all : { false, true })
  {
    Ranks ranks(
      4, Size, Size,
      [&](int rank) -> std::shared_ptr<BrickSource>
      {
        if (rank != broken)
        {
          return source;
        }
        auto faulty = std::make_shared<FaultyBrickSource>(source);
        faulty->SetFaults([all](const BrickKey& key)
          { return all || (key.PageLevel == 0 && key.Level == 0) ? Fault::Status : Fault::None; });
        return faulty;
      },
      set);
    vtkNew<EventCounter> errors;
    vtkNew<EventCounter> failed;
    ranks.At(broken).Mapper->AddObserver(vtkCommand::ErrorEvent, errors);
    ranks.At(broken).Mapper->AddObserver(vtkOutOfCoreVolumeMapper::BrickFailedEvent, failed);
    const std::vector<float> picture = ranks.Draw();
    for (int r = 0; r < 4; ++r)
    {
      EXPECT_EQ(ranks.At(r).Mapper->IsConverged(), r != broken) << "rank " << r;
      EXPECT_EQ(ranks.At(r).Mapper->GetNumberOfFailedBricks() > 0, r == broken) << "rank " << r;
    }
    EXPECT_EQ(errors->Count, 1); // the first in words, each as an event
    EXPECT_GT(failed->Count, 1);
    const ImageDifference off = CompareImages(picture, reference);
    std::printf("  %s: %.3f from one rank at most, %.4f on average\n",
      all ? "nothing can be read" : "from coarser levels", off.Max, off.Mean);
    EXPECT_GT(off.Max, Tolerance); // it is another picture, and says so
    if (all)
    {
      // As if the block were empty: what the others have drawn is untouched.
      int extent[6];
      Ranks three(
        4, Size, Size, [&](int) { return source; }, set);
      std::vector<std::vector<float>> pictures;
      std::vector<const std::vector<float>*> sorted;
      vtkNew<vtkIdList> order;
      three.Split->GetFrontToBack(three.At(0).Renderer, three.At(0).Volume, order);
      for (const vtkIdType block : *order)
      {
        three.Split->GetBlockExtent(static_cast<int>(block), extent);
        three.At(0).Mapper->SetBlockExtent(extent);
        pictures.push_back(
          block != broken ? three.At(0).Draw() : std::vector<float>(reference.size(), 0.0f));
      }
      for (const std::vector<float>& p : pictures)
      {
        sorted.push_back(&p);
      }
      EXPECT_TRUE(AreImagesIdentical(picture, BlendFrontToBack(sorted)));
    }
    else
    {
      EXPECT_LT(off.Mean, 0.02);
    }
  }
}

// Turned volumes have bounds that overlap, though the blocks don't: what sorts by bounds can't know
// the order of blocks, GetFrontToBack() does.
TEST(SortLast, BoundsOfTurnedBlocksOverlap)
{
  const auto source = SourceOf(BlobField);
  Ranks ranks(
    4, Size, Size, [&](int) { return source; }, LookAtFog);
  int overlaps = 0;
  for (int a = 0; a < 4; ++a)
  {
    for (int b = 0; b < a; ++b)
    {
      double m[6];
      double n[6];
      ranks.Split->GetBlockBounds(a, m);
      ranks.Split->GetBlockBounds(b, n);
      bool met = true;
      for (int i = 0; i < 6; i += 2)
      {
        met = met && std::max(m[i], n[i]) + 1 < std::min(m[i + 1], n[i + 1]);
      }
      overlaps += met ? 1 : 0;
    }
  }
  EXPECT_GT(overlaps, 0);
  double whole[6];
  ranks.At(0).Mapper->GetBounds(whole);
  ranks.Split->SetNumberOfBlocks(1);
  double one[6];
  ranks.Split->GetBlockBounds(0, one);
  for (int i = 0; i < 6; ++i)
  {
    EXPECT_NEAR(one[i], whole[i], 1e-9);
  }
  // The order does matter: blended the other way round the picture is another one.
  ranks.Split->SetNumberOfBlocks(4);
  Stage reference(Size, Size);
  reference.SetSource(source);
  const auto dense = [](Stage& s)
  {
    s.SetTransfer(MakeTransfer(OpacityShape::Ramp, 0, 255, 2));
    s.Look({ 0.4, 1, -0.3 }, 0.9);
  };
  dense(reference);
  const std::vector<float> truth = reference.Draw();
  std::vector<std::vector<float>> pictures;
  vtkNew<vtkIdList> order;
  ASSERT_TRUE(ranks.Split->GetFrontToBack(reference.Renderer, reference.Volume, order));
  reference.Mapper->BlockOn();
  for (const vtkIdType block : *order)
  {
    int extent[6];
    ranks.Split->GetBlockExtent(static_cast<int>(block), extent);
    reference.Mapper->SetBlockExtent(extent);
    pictures.push_back(reference.Draw());
  }
  std::vector<const std::vector<float>*> sorted;
  for (const std::vector<float>& picture : pictures)
  {
    sorted.push_back(&picture);
  }
  EXPECT_LE(CompareImages(BlendFrontToBack(sorted), truth).Max, Tolerance);
  std::reverse(sorted.begin(), sorted.end());
  EXPECT_GT(CompareImages(BlendFrontToBack(sorted), truth).Max, 10 * Tolerance);
}

// A prop's matrix turns and moves the blocks with it.
TEST(SortLast, MovedVolume)
{
  const auto source = Noise();
  const auto set = [](Stage& s)
  {
    s.SetTransfer(MakeTransfer(OpacityShape::Peak, 0, 255, 8));
    s.Volume->RotateX(130);
    s.Volume->RotateZ(75);
    s.Volume->SetScale(1, 2, 0.7);
    s.Look({ 0.4, 1, -0.3 }, 0.9);
  };
  Stage one(Size, Size);
  one.SetSource(source);
  set(one);
  const std::vector<float> reference = one.Draw();
  for (const int count : { 3, 8 })
  {
    Ranks ranks(
      count, Size, Size, [&](int) { return source; }, set);
    EXPECT_LE(CompareImages(ranks.Draw(), reference).Max, Tolerance) << count << " ranks";
  }
}
