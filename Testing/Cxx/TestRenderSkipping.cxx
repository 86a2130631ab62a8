// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// What a scene doesn't need is neither read nor drawn: counted, and compared with what the rays of
// the reference integrator meet, in double precision. Whatever is skipped changes no bit.
#include "BricksMet.h"
#include "RecordingSource.h"
#include "Scene.h"
#include "vtkOutOfCoreVolumeMapper.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <gtest/gtest.h>
#include <iterator>
#include <memory>
#include <random>
#include <set>
#include <string>
#include <vector>
#include <vtkActor.h>
#include <vtkCamera.h>
#include <vtkCubeSource.h>
#include <vtkImageData.h>
#include <vtkPiecewiseFunction.h>
#include <vtkPolyDataMapper.h>
#include <vtkRenderWindow.h>
#include <vtkRenderer.h>
#include <vtkVolume.h>
#include <vtkVolumeProperty.h>

using namespace teravox;
using namespace teravox::test;

namespace
{

std::shared_ptr<RecordingSource> Record(const std::shared_ptr<BrickSource>& source)
{
  return std::make_shared<RecordingSource>(source);
}

std::shared_ptr<BrickSource> FieldOf(
  const std::array<int, 3>& dimensions, int brickSize, const UnitField& field)
{
  ImageOptions options;
  options.Dimensions = dimensions;
  return SourceOfImage(MakeImage(options, field), brickSize, false);
}

// What has been read, uploaded and written so far.
struct Traffic
{
  explicit Traffic(Stage& stage)
    : Bricks(stage.Mapper->GetNumberOfBricksLoaded())
    , Bytes(stage.Mapper->GetBytesUploaded())
    , TableBytes(stage.Mapper->GetPageTableBytesUploaded())
  {
  }
  bool operator==(const Traffic& o) const
  {
    return this->Bricks == o.Bricks && this->Bytes == o.Bytes && this->TableBytes == o.TableBytes;
  }
  std::uint64_t Bricks;
  std::uint64_t Bytes;
  std::uint64_t TableBytes;
};

} // namespace

// Largest empty regions are left at once: as many visits as a walk over the ranges of the source
// makes, and several times as many, one for each brick, without skipping.
TEST(Skipping, EmptyRegionsAreLeftAtOnce)
{
  Stage stage(24, 24);
  // 80 x 40 x 40 bricks, two page levels; a ball in the larger one of the topmost regions.
  const auto source = FieldOf({ 160, 80, 80 }, 2,
    [](double x, double y, double z)
    { return std::max(0.0, 1 - std::hypot(x - 0.3, y - 0.3, z - 0.3) / 0.08); });
  stage.SetSource(source);
  TransferNodes nodes = MakeTransfer(OpacityShape::Ramp);
  nodes.UnitDistance = 300; // so thin that no ray ends before it has left the volume
  stage.SetTransfer(nodes);
  stage.Mapper->SetMaximumLevel(0);
  stage.Mapper->CountSamplesOn();
  stage.Mapper->PictureReuseOff();
  // Askew, so that regions of all sizes are met.
  stage.LookFrom({ 330, 10, -20 }, { 52, 28, 26 }, 1, 1000, 8);
  stage.Draw();
  ASSERT_TRUE(stage.Mapper->IsConverged());
  const std::vector<float> reference = stage.Draw(); // all is there: each ray in one go
  const auto visits = static_cast<double>(stage.Mapper->GetNumberOfVisits());
  const auto samples = stage.Mapper->GetNumberOfSamples();
  const std::size_t bricks = stage.Mapper->GetNumberOfBricksLoaded();
  const Met met = BrickWalk(stage, source, VoxelAccess::ByBrick).Walk(0);
  stage.Mapper->EmptySpaceSkippingOff();
  stage.Draw();
  const std::vector<float> whole = stage.Draw();
  const auto all = static_cast<double>(stage.Mapper->GetNumberOfVisits());
  std::printf("  %.0f visits (a walk of our own: %.0f), %.0f without skipping (%.0f); %llu of %llu "
              "samples, %llu of %llu bricks\n",
    visits, met.Visits, all, met.Bricks, static_cast<unsigned long long>(samples),
    static_cast<unsigned long long>(stage.Mapper->GetNumberOfSamples()),
    static_cast<unsigned long long>(bricks),
    static_cast<unsigned long long>(stage.Mapper->GetNumberOfBricksLoaded()));
  EXPECT_TRUE(AreImagesIdentical(reference, whole));
  EXPECT_NEAR(visits / met.Visits, 1, 0.03);
  EXPECT_NEAR(all / met.Bricks, 1, 0.03);
  EXPECT_LT(visits, 0.25 * all);
}

// Inside of a brick its own cells of 4^3 voxels are left at once.
TEST(Skipping, CellsInsideABrickAreLeftAtOnce)
{
  // Small balls in one brick, and a voxel lattice that no 4^3 cell is free of.
  for (const bool everywhere : { false, true })
  {
    const auto source = FieldOf({ 64, 64, 64 }, 64,
      [&](double x, double y, double z)
      {
        const auto i = [](double v) { return static_cast<int>(v * 64); };
        const bool lattice = i(x) % 4 == 1 && i(y) % 4 == 1 && i(z) % 4 == 1;
        const bool ball = std::hypot(x - 0.3, y - 0.7, z - 0.5) < 0.1;
        return (everywhere ? lattice : ball) ? 1.0 : 0.0;
      });
    Stage stage(48, 48);
    stage.SetSource(source);
    stage.SetTransfer(MakeTransfer(OpacityShape::Ramp));
    stage.Mapper->SetMaximumLevel(0);
    stage.Mapper->CountSamplesOn();
    stage.Look({ 0.4, 1, -0.3 }, 0.8);
    std::array<std::vector<float>, 2> pictures;
    std::array<double, 2> samples{};
    for (const int skip : { 0, 1 })
    {
      stage.Mapper->SetEmptySpaceSkipping(skip);
      stage.Draw();
      stage.Mapper->PictureReuseOff();
      pictures.at(static_cast<std::size_t>(skip)) = stage.Draw();
      samples.at(static_cast<std::size_t>(skip)) =
        static_cast<double>(stage.Mapper->GetNumberOfSamples());
      EXPECT_EQ(stage.Mapper->GetNumberOfBricksLoaded(), 1u);
    }
    std::printf("  %s: %.0f samples, %.0f without skipping\n", everywhere ? "lattice" : "ball",
      samples[1], samples[0]);
    EXPECT_TRUE(AreImagesIdentical(pictures[0], pictures[1]));
    // Cells of the ball are a twentieth of those that rays meet.
    EXPECT_LT(samples[1], (everywhere ? 1.01 : 0.1) * samples[0]);
    EXPECT_GT(samples[1], (everywhere ? 0.8 : 0.002) * samples[0]);
  }
}

// A brick of one value is one segment for each ray that crosses it, read by nobody and never in the
// atlas.
TEST(Skipping, BricksOfOneValueAreOneSegment)
{
  // Blocks of 16^3 with values of their own, wide enough that the support of the bricks inside has
  // one value: of each 3^3 bricks of 16 voxels the one in the middle.
  const auto source = FieldOf({ 144, 144, 144 }, 16,
    [](double x, double y, double z)
    {
      const auto block = [](double v) { return static_cast<int>(v * 3); };
      return (20.0 + 7 * (block(x) + 3 * block(y) + 9 * block(z))) / 255;
    });
  const auto recorded = Record(source);
  Stage stage(40, 40);
  stage.SetSource(recorded);
  stage.SetTransfer(MakeTransfer(OpacityShape::Fog));
  stage.Mapper->SetMaximumLevel(0);
  stage.Mapper->CountSamplesOn();
  stage.Look({ 0.4, 1, -0.3 }, 0.9);
  stage.Draw();
  EXPECT_TRUE(stage.Mapper->IsConverged());
  int single = 0;
  for (std::int64_t z = 0; z < 9; ++z)
  {
    for (std::int64_t y = 0; y < 9; ++y)
    {
      for (std::int64_t x = 0; x < 9; ++x)
      {
        const BrickKey key = BrickKey::Of(0, { x, y, z });
        const auto range = source->ReadRanges(key, { 1, 1, 1 });
        const bool one = range.Value()[0].IsSingle();
        single += one ? 1 : 0;
        EXPECT_TRUE(!one || recorded->Read().count(key) == 0) << key.ToString() << " was read";
      }
    }
  }
  EXPECT_EQ(single, 125); // 5 along each axis: the outermost ones touch one block only
  EXPECT_EQ(stage.Mapper->GetNumberOfSlotsInUse(), recorded->Read().size());
  EXPECT_LE(recorded->Read().size(), 729u - 125u);

  // The whole volume of one value: nothing but segments, as many as there are crossings.
  const auto inner = FieldOf({ 96, 96, 96 }, 16, [](double, double, double) { return 0.5; });
  const auto plain = Record(inner);
  Stage even(40, 40);
  even.SetSource(plain);
  even.SetTransfer(MakeTransfer(OpacityShape::Fog));
  even.Mapper->SetMaximumLevel(0);
  even.Mapper->CountSamplesOn();
  even.Look({ 0.4, 1, -0.3 }, 0.9);
  const std::vector<float> picture = even.Draw();
  const Met met = BrickWalk(even, inner).Walk(0);
  std::printf("  %llu samples, %.0f crossings of bricks\n",
    static_cast<unsigned long long>(even.Mapper->GetNumberOfSamples()), met.Bricks);
  EXPECT_TRUE(even.Mapper->IsConverged());
  EXPECT_GT(*std::max_element(picture.begin(), picture.end()), 0.1f);
  EXPECT_EQ(plain->Read().size(), 0u);
  EXPECT_EQ(even.Mapper->GetNumberOfBricksLoaded(), 0u);
  EXPECT_EQ(even.Mapper->GetBytesUploaded(), 0u);
  EXPECT_EQ(even.Mapper->GetNumberOfSlotsInUse(), 0u);
  EXPECT_NEAR(static_cast<double>(even.Mapper->GetNumberOfSamples()) / met.Bricks, 1, 0.01);
  EXPECT_EQ(even.Mapper->GetNumberOfSamples(), even.Mapper->GetNumberOfContributingSamples());
}

// An edit of the transfer function touches its own tables only, and draws what a mapper draws that
// never had another one.
TEST(Skipping, AnEditOfTheFunctionTouchesItsTablesOnly)
{
  const auto source = FieldOf({ 96, 80, 112 }, 16, BlobField);
  const auto recorded = Record(source);
  Stage stage(48, 48);
  stage.SetSource(recorded);
  TransferNodes nodes = MakeTransfer(OpacityShape::Ramp);
  nodes.Opacity = { { 0, 0 }, { 140, 0 }, { 180, 0.08 }, { 255, 0.3 } };
  stage.SetTransfer(nodes);
  stage.Mapper->SetMaximumLevel(0);
  stage.Look({ 0.4, 1, -0.3 }, 0.9);
  stage.Draw();
  ASSERT_TRUE(stage.Mapper->IsConverged());
  const auto fresh = [&](const std::shared_ptr<BrickSource>& from)
  {
    Stage other(48, 48);
    other.SetSource(from);
    other.SetTransfer(nodes);
    other.Mapper->SetMaximumLevel(0);
    other.Look({ 0.4, 1, -0.3 }, 0.9);
    return other.Draw();
  };
  const auto edit = [&](const char* what)
  {
    const Traffic before(stage);
    const std::size_t reads = recorded->Reads();
    const std::size_t ranges = recorded->RangeReads();
    stage.SetTransfer(nodes);
    const std::vector<float> picture = stage.Draw();
    EXPECT_TRUE(stage.Mapper->IsConverged()) << what;
    EXPECT_TRUE(AreImagesIdentical(picture, fresh(source))) << what;
    EXPECT_EQ(recorded->Reads(), reads) << what << ": bricks read";
    EXPECT_EQ(recorded->RangeReads(), ranges) << what << ": ranges read";
    const Traffic after(stage);
    EXPECT_EQ(after.Bricks, before.Bricks) << what << ": bricks uploaded";
    EXPECT_EQ(after.Bytes, before.Bytes) << what << ": bytes uploaded";
    EXPECT_EQ(after.TableBytes, before.TableBytes) << what << ": page table";
    EXPECT_EQ(stage.Mapper->GetNumberOfOperations(), 0u) << what;
    EXPECT_EQ(stage.Mapper->GetNumberOfPasses(), 1u) << what;
    EXPECT_EQ(stage.Mapper->GetNumberOfEvictions(), 0u) << what;
  };
  nodes.Color[1] = { nodes.Color[1][0], 0.1, 0.9, 0.4 };
  edit("another colour");
  nodes.Opacity[2][1] *= 1.5;
  nodes.Opacity[3][1] *= 1.5;
  edit("thicker");
  nodes.Opacity[1][0] += 30;
  nodes.Opacity[2][1] = 0.3;
  nodes.Opacity[3][1] = 0.9;
  edit("less of it, but opaque"); // what has become empty stays where it is

  // More of it: what was invisible is read now, and nothing but that.
  const BrickSet had = recorded->Read();
  const std::size_t reads = recorded->Reads();
  nodes.Opacity = { { 0, 0 }, { 20, 0 }, { 60, 0.02 }, { 255, 0.05 } };
  stage.SetTransfer(nodes);
  const std::vector<float> picture = stage.Draw();
  EXPECT_TRUE(AreImagesIdentical(picture, fresh(source)));
  const Met met = BrickWalk(stage, source).Walk();
  BrickSet added;
  const BrickSet now = recorded->Read();
  std::set_difference(
    now.begin(), now.end(), had.begin(), had.end(), std::inserter(added, added.end()));
  std::printf("  %zu bricks were there, %zu came, of %zu that rays meet\n", had.size(),
    added.size(), met.Visible.size());
  EXPECT_GT(added.size(), 20u);
  EXPECT_EQ(recorded->Reads() - reads, added.size()) << "none twice, none that was there";
  ExpectWithin(added, met.Visible, "read but invisible");
  ExpectWithin(met.Touched, now, "touches the picture but wasn't read");
}

// Nothing behind opaque matter is read: a wall across the volume, noise behind it.
TEST(Skipping, NothingIsReadBehindOpaqueMatter)
{
  const auto source = FieldOf({ 128, 96, 96 }, 16,
    [random = std::make_shared<std::mt19937>(3)](double x, double, double)
    {
      const double noise = 0.3 + 0.4 * static_cast<double>((*random)()) / 4294967296.0;
      return x > 0.4 && x < 0.45 ? 1.0 : x >= 0.45 ? noise : 0.0;
    });
  const auto recorded = Record(source);
  Stage stage(48, 48);
  stage.SetSource(recorded);
  stage.SetTransfer(MakeTransfer(OpacityShape::Wall));
  stage.Mapper->SetMaximumLevel(0);
  stage.LookFrom({ -150, 50, 40 }, { 60, 48, 48 }, 1, 600, 20);
  stage.Draw();
  ASSERT_TRUE(stage.Mapper->IsConverged());
  const Met met = BrickWalk(stage, source).Walk();
  const BrickSet read = recorded->Read();
  std::printf("  %zu bricks read, %zu touch the picture, %zu are met\n", read.size(),
    met.Touched.size(), met.Visible.size());
  EXPECT_GT(met.Touched.size(), 20u);
  ExpectWithin(read, met.Visible, "read but met by no ray");
  ExpectWithin(met.Touched, read, "touches the picture but wasn't read");
  EXPECT_EQ(recorded->Reads(), read.size());
  for (const BrickKey& key : read)
  {
    EXPECT_LE(key.X, 3u) << key.ToString() << " lies behind the wall";
  }

  // The same when all is in the atlas already, from the other side: not one bit is different.
  const std::vector<float> reference = stage.Accumulator();
  stage.LookFrom({ 300, 50, 40 }, { 60, 48, 48 }, 1, 600, 20);
  stage.Draw();
  EXPECT_GT(recorded->Read().size(), 2 * read.size()) << "there is a lot behind it";
  stage.LookFrom({ -150, 50, 40 }, { 60, 48, 48 }, 1, 600, 20);
  EXPECT_TRUE(AreImagesIdentical(stage.Draw(), reference));
}

// Nothing behind opaque geometry is read; nothing at all where it hides the whole volume.
TEST(Skipping, NothingIsReadBehindGeometry)
{
  const auto source = FieldOf({ 96, 96, 96 }, 16, BlobField);
  for (const bool hidesAll : { false, true })
  {
    const auto recorded = Record(source);
    Stage stage(48, 48);
    stage.SetSource(recorded);
    TransferNodes nodes = MakeTransfer(OpacityShape::Ramp);
    nodes.Opacity[0][1] = nodes.Opacity[1][1] = 0.002; // nowhere invisible
    stage.SetTransfer(nodes);
    stage.Mapper->SetMaximumLevel(0);
    vtkNew<vtkCubeSource> cube;
    const double back = hidesAll ? -10 : 40;
    cube->SetBounds(-300, 300, back, back + 1, -300, 300);
    vtkNew<vtkPolyDataMapper> mapper;
    mapper->SetInputConnection(cube->GetOutputPort());
    vtkNew<vtkActor> actor;
    actor->SetMapper(mapper);
    stage.Renderer->AddActor(actor);
    stage.LookFrom({ 48, -200, 48 }, { 48, 48, 48 }, 100, 400, 30);
    const std::vector<float> picture = stage.Draw();
    EXPECT_TRUE(stage.Mapper->IsConverged());
    // The front face: y = back, as a view depth.
    const Met met = BrickWalk(stage, source).Walk(4, [&](int, int) { return 200 + back; });
    const BrickSet read = recorded->Read();
    std::printf("  %zu bricks read, %zu touch the picture\n", read.size(), met.Touched.size());
    if (hidesAll)
    {
      EXPECT_EQ(read.size(), 0u);
      EXPECT_EQ(stage.Mapper->GetNumberOfBricksLoaded(), 0u);
      EXPECT_EQ(*std::max_element(picture.begin(), picture.end()), 0.0f);
      continue;
    }
    EXPECT_GT(read.size(), 50u);
    EXPECT_EQ(read, met.Touched);
    // All of the volume in the atlas: the same bits.
    stage.Renderer->RemoveActor(actor);
    stage.Draw();
    EXPECT_GT(recorded->Read().size(), read.size());
    stage.Renderer->AddActor(actor);
    EXPECT_TRUE(AreImagesIdentical(stage.Draw(), picture));
  }
}

// Nothing outside of the visible region is read: a narrow view from inside, levels by distance.
TEST(Skipping, NothingIsReadOutsideOfTheView)
{
  const auto source = FieldOf({ 144, 144, 144 }, 16, BlobField);
  const auto recorded = Record(source);
  Stage stage(64, 48);
  stage.SetSource(recorded);
  TransferNodes nodes = MakeTransfer(OpacityShape::Fog);
  stage.SetTransfer(nodes);
  stage.LookFrom({ 30, 40, 50 }, { 100, 80, 70 }, 5, 90, 25);
  const std::vector<float> picture = stage.Draw();
  ASSERT_TRUE(stage.Mapper->IsConverged());
  const Met met = BrickWalk(stage, source).Walk();
  const BrickSet read = recorded->Read();
  std::printf("  %zu bricks read of %lld, %zu touch the picture\n", read.size(),
    static_cast<long long>(source->Info().Layout.TotalBricks()), met.Touched.size());
  EXPECT_GT(read.size(), 15u);
  EXPECT_LT(read.size(), 150u);
  EXPECT_EQ(read, met.Touched);
  // From everywhere, and back: the same bits.
  stage.Look({ 0.4, 1, -0.3 }, 0.5);
  stage.Draw();
  stage.LookFrom({ 30, 40, 50 }, { 100, 80, 70 }, 5, 90, 25);
  EXPECT_TRUE(AreImagesIdentical(stage.Draw(), picture));
}

// What is unchanged isn't computed again, and what has changed is.
class SkippingUnchanged : public testing::TestWithParam<bool>
{
};

TEST_P(SkippingUnchanged, ScenesAreShownAgain)
{
  const bool geometry = GetParam();
  const auto recorded = Record(FieldOf({ 64, 64, 64 }, 16, BlobField));
  Stage stage(64, 48);
  stage.SetSource(recorded);
  TransferNodes nodes = MakeTransfer(OpacityShape::Ramp);
  stage.SetTransfer(nodes);
  stage.Mapper->CountSamplesOn();
  stage.Look({ 0.4, 1, -0.3 }, 0.8);
  vtkNew<vtkCubeSource> cube;
  cube->SetBounds(20, 40, 20, 40, 20, 40);
  vtkNew<vtkPolyDataMapper> mapper;
  mapper->SetInputConnection(cube->GetOutputPort());
  vtkNew<vtkActor> actor;
  actor->SetMapper(mapper);
  if (geometry)
  {
    stage.Renderer->AddActor(actor);
  }
  const std::vector<float> picture = stage.Draw();
  const std::vector<float> window = stage.DrawPicture();
  ASSERT_TRUE(stage.Mapper->IsConverged());
  const auto expectNothing = [&](const char* what)
  {
    const Traffic before(stage);
    const std::size_t reads = recorded->Reads() + recorded->RangeReads();
    EXPECT_TRUE(AreImagesIdentical(stage.DrawPicture(), window)) << what;
    EXPECT_TRUE(AreImagesIdentical(stage.Accumulator(), picture)) << what;
    EXPECT_TRUE(stage.Mapper->IsConverged()) << what;
    EXPECT_EQ(stage.Mapper->GetNumberOfPasses(), 0u) << what;
    EXPECT_EQ(stage.Mapper->GetNumberOfSamples(), 0u) << what;
    EXPECT_EQ(stage.Mapper->GetNumberOfVisits(), 0u) << what;
    EXPECT_EQ(stage.Mapper->GetNumberOfOperations(), 0u) << what;
    EXPECT_TRUE(Traffic(stage) == before) << what;
    EXPECT_EQ(recorded->Reads() + recorded->RangeReads(), reads) << what;
  };
  expectNothing("again");
  // Without: the same bits, computed anew.
  stage.Mapper->PictureReuseOff();
  EXPECT_TRUE(AreImagesIdentical(stage.Draw(), picture));
  EXPECT_EQ(stage.Mapper->GetNumberOfPasses(), 1u);
  EXPECT_GT(stage.Mapper->GetNumberOfSamples(), 1000u);
  stage.Mapper->PictureReuseOn();
  expectNothing("after it was off");

  // Each change is drawn, as a mapper draws it that never saw another scene.
  struct Change
  {
    const char* Name;
    std::function<void()> Do;
    bool SamePicture = false;
  };
  std::vector<Change> changes = {
    { "camera", [&] { stage.Renderer->GetActiveCamera()->Azimuth(1); } },
    { "colour",
      [&]
      {
        nodes.Color[1][1] = 0.2;
        stage.SetTransfer(nodes);
      } },
    { "opacity", [&] { stage.Opacity->AddPoint(200, 0.9); } },
    { "shading", [&] { stage.SetShade(true); } },
    { "material", [&] { stage.Property->SetDiffuse(0.9); } },
    { "tolerance", [&] { stage.Mapper->SetImageErrorTolerance(1.0 / 64); } },
    { "interpolation", [&] { stage.Property->SetInterpolationTypeToNearest(); } },
    { "level", [&] { stage.Mapper->SetMinimumLevel(1); } },
    { "place", [&] { stage.Volume->SetPosition(3, 0, 0); } },
    { "levels shown", [&] { stage.Mapper->SetDebugViewToLevels(); } },
    { "skipping", [&] { stage.Mapper->EmptySpaceSkippingOff(); }, true },
    { "no levels shown", [&] { stage.Mapper->SetDebugViewToNone(); } },
    { "source",
      [&] {
        stage.SetSource(FieldOf({ 64, 64, 64 }, 16, [](double x, double, double) { return x; }));
      } },
  };
  if (geometry)
  {
    changes.push_back({ "geometry", [&] { actor->SetPosition(5, -15, 3); } });
    changes.push_back({ "no geometry", [&] { actor->SetVisibility(0); } });
  }
  std::vector<float> last = picture;
  for (const Change& change : changes)
  {
    change.Do();
    const std::vector<float> now = stage.Draw();
    EXPECT_GT(stage.Mapper->GetNumberOfPasses(), 0u) << change.Name;
    EXPECT_EQ(AreImagesIdentical(now, last), change.SamePicture) << change.Name;
    stage.Mapper->PictureReuseOff();
    EXPECT_TRUE(AreImagesIdentical(stage.Draw(), now)) << change.Name;
    stage.Mapper->PictureReuseOn();
    stage.Draw();
    EXPECT_EQ(stage.Mapper->GetNumberOfPasses(), 0u) << change.Name;
    EXPECT_TRUE(AreImagesIdentical(stage.Accumulator(), now)) << change.Name;
    last = now;
  }
}

INSTANTIATE_TEST_SUITE_P(Skipping, SkippingUnchanged, testing::Bool(),
  [](const auto& test) { return std::string(test.param ? "WithGeometry" : "Alone"); });

// An interactive frame that is complete is shown again, too; one that isn't goes on. And what was
// coarse for the sake of time doesn't stay so in a picture that may take its time.
TEST(Skipping, InteractiveFramesThatAreCompleteAreShownAgain)
{
  const auto source = FieldOf({ 64, 64, 64 }, 16, BlobField);
  const auto set = [&](Stage& stage)
  {
    stage.SetSource(source);
    stage.SetTransfer(MakeTransfer(OpacityShape::Ramp));
    stage.Look({ 0.4, 1, -0.3 }, 0.8);
  };
  Stage reference(64, 64);
  set(reference);
  const std::vector<float> expected = reference.Draw();
  Stage stage(64, 64);
  set(stage);
  stage.Mapper->SetFrameTimeBudget(1e3);
  for (int frame = 0; frame < 1000 && !stage.Mapper->IsConverged(); ++frame)
  {
    stage.Draw();
    EXPECT_GT(stage.Mapper->GetNumberOfPasses(), 0u);
  }
  ASSERT_TRUE(stage.Mapper->IsConverged());
  EXPECT_TRUE(AreImagesIdentical(stage.Draw(), expected));
  EXPECT_EQ(stage.Mapper->GetNumberOfPasses(), 0u);
  EXPECT_TRUE(stage.Mapper->IsConverged());

  stage.Mapper->SetFrameTimeBudget(1e-9); // never enough
  for (int frame = 0; frame < 8; ++frame)
  {
    stage.Renderer->GetActiveCamera()->Azimuth(1);
    stage.Draw();
  }
  EXPECT_FALSE(stage.Mapper->IsConverged());
  stage.Look({ 0.4, 1, -0.3 }, 0.8);
  stage.Mapper->SetFrameTimeBudget(0);
  EXPECT_TRUE(AreImagesIdentical(stage.Draw(), expected));
}
