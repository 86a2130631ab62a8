// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// Volumes that change with time: the pipeline chooses the step, each is drawn as if it were alone,
// bit for bit, and bricks of the steps beside it are read ahead within the same budget.
#include "BrickSeries.h"
#include "MessageRecorder.h"
#include "RecordingSource.h"
#include "Scene.h"
#include "VTKTestSupport.h"
#include "vtkBrickSource.h"
#include "vtkBrickSourceAlgorithm.h"
#include "vtkHDF5PyramidReader.h"
#include "vtkHDF5PyramidWriter.h"
#include "vtkOutOfCoreVolumeMapper.h"

#include <gtest/gtest.h>
#include <string>
#include <vector>
#include <vtkCommand.h>
#include <vtkDataObject.h>
#include <vtkImageData.h>
#include <vtkInformation.h>
#include <vtkInformationVector.h>
#include <vtkObjectFactory.h>
#include <vtkPointData.h>
#include <vtkRenderer.h>
#include <vtkStreamingDemandDrivenPipeline.h>

using namespace teravox;
using namespace teravox::test;

namespace
{

constexpr int Steps = 4;
constexpr double Times[Steps] = { 0, 0.5, 2, 10 };
constexpr int BrickEdge = 8;

// The field moves and grows.
vtkSmartPointer<vtkImageData> ImageOfStep(int step)
{
  ImageOptions options;
  options.Type = ScalarType::UInt16;
  options.High = 200 + 15 * step;
  return MakeImage(options,
    [step](double x, double y, double z)
    { return BlobField(x * (1 - 0.1 * step), y + 0.06 * step, z); });
}

class MemorySeries : public BrickSeries
{
public:
  explicit MemorySeries(bool holdsThem)
    : HoldsThem(holdsThem)
  {
    for (int step = 0; step < Steps; ++step)
    {
      this->Sources.push_back(
        std::make_shared<RecordingSource>(SourceOfImage(ImageOfStep(step), BrickEdge, false)));
    }
  }
  int NumberOfSteps() const override { return Steps; }
  Result<std::shared_ptr<BrickSource>> Step(int step) override
  {
    if (!this->HoldsThem)
    {
      return Status(StatusCode::InputOutput, "There is nothing to read ahead.");
    }
    return std::shared_ptr<BrickSource>(this->Sources[static_cast<std::size_t>(step)]);
  }
  RecordingSource& Of(int step) { return *this->Sources[static_cast<std::size_t>(step)]; }
  // Bricks and ranges that were read, of all steps.
  std::size_t Reads() const
  {
    std::size_t reads = 0;
    for (const auto& source : this->Sources)
    {
      reads += source->Reads() + source->RangeReads();
    }
    return reads;
  }

  std::vector<std::shared_ptr<RecordingSource>> Sources;
  bool HoldsThem;
};

class SeriesAlgorithm : public vtkBrickSourceAlgorithm
{
public:
  static SeriesAlgorithm* New();
  vtkTypeMacro(SeriesAlgorithm, vtkBrickSourceAlgorithm);
  std::shared_ptr<MemorySeries> Series = std::make_shared<MemorySeries>(true);

protected:
  std::shared_ptr<BrickSource> MakeBrickSource(std::string&) override { return nullptr; }
  std::vector<double> FindTimes() override { return { Times, Times + Steps }; }
  std::shared_ptr<BrickSeries> MakeBrickSeries(std::string&) override { return this->Series; }
};
vtkStandardNewMacro(SeriesAlgorithm);

// An ordinary image for each time, as filters of VTK make them.
class ImagesInTime : public vtkImageAlgorithm
{
public:
  static ImagesInTime* New();
  vtkTypeMacro(ImagesInTime, vtkImageAlgorithm);

protected:
  ImagesInTime() { this->SetNumberOfInputPorts(0); }
  int RequestInformation(
    vtkInformation*, vtkInformationVector**, vtkInformationVector* outputs) override
  {
    vtkInformation* info = outputs->GetInformationObject(0);
    const double range[2] = { Times[0], Times[Steps - 1] };
    info->Set(vtkStreamingDemandDrivenPipeline::TIME_STEPS(), Times, Steps);
    info->Set(vtkStreamingDemandDrivenPipeline::TIME_RANGE(), range, 2);
    int extent[6];
    ImageOfStep(0)->GetExtent(extent);
    info->Set(vtkStreamingDemandDrivenPipeline::WHOLE_EXTENT(), extent, 6);
    return 1;
  }
  int RequestData(vtkInformation*, vtkInformationVector**, vtkInformationVector* outputs) override
  {
    vtkInformation* info = outputs->GetInformationObject(0);
    const double time = info->Has(vtkStreamingDemandDrivenPipeline::UPDATE_TIME_STEP())
      ? info->Get(vtkStreamingDemandDrivenPipeline::UPDATE_TIME_STEP())
      : 0;
    int step = 0;
    while (step + 1 < Steps && Times[step + 1] <= time)
    {
      ++step;
    }
    vtkImageData::GetData(info)->ShallowCopy(ImageOfStep(step));
    return 1;
  }
};
vtkStandardNewMacro(ImagesInTime);

void Prepare(Stage& stage)
{
  stage.Mapper->SetBrickSize(BrickEdge);
  stage.SetTransfer(MakeTransfer(OpacityShape::Ramp));
  stage.Look({ 0.4, 1, -0.3 }, 0.8);
}

const std::vector<float>& Alone(int step)
{
  static std::vector<float> pictures[Steps];
  std::vector<float>& picture = pictures[step];
  if (picture.empty())
  {
    Stage stage(48, 48);
    stage.SetImage(ImageOfStep(step));
    Prepare(stage);
    picture = stage.Draw();
  }
  return picture;
}

} // namespace

TEST(TimeSteps, ThePipelineChoosesEachIsDrawnAsIfAlone)
{
  for (int step = 1; step < Steps; ++step)
  {
    ASSERT_FALSE(AreImagesIdentical(Alone(step), Alone(step - 1)));
  }
  vtkNew<SeriesAlgorithm> bricks;
  vtkNew<ImagesInTime> images;
  vtkImageAlgorithm* const algorithms[2] = { bricks, images };
  for (vtkImageAlgorithm* algorithm : algorithms)
  {
    Stage stage(48, 48);
    stage.Mapper->SetInputConnection(algorithm->GetOutputPort());
    Prepare(stage);
    EXPECT_TRUE(AreImagesIdentical(stage.Draw(), Alone(0))) << algorithm->GetClassName();
    const double times[] = { 0.5, 2, 10, 1e9, 9.99, -3, 0.49, 0.5 };
    const int steps[] = { 1, 2, 3, 3, 2, 0, 0, 1 };
    for (std::size_t i = 0; i < 8; ++i)
    {
      algorithm->UpdateTimeStep(times[i]);
      EXPECT_TRUE(AreImagesIdentical(stage.Draw(), Alone(steps[i])))
        << algorithm->GetClassName() << " at " << times[i];
      EXPECT_EQ(stage.Mapper->CheckInvariants(), "");
    }
  }
  EXPECT_EQ(bricks->GetNumberOfTimeSteps(), Steps);
  EXPECT_EQ(bricks->GetPresentedTimeStep(), 1);
  EXPECT_EQ(bricks->GetOutput()->GetInformation()->Get(vtkDataObject::DATA_TIME_STEP()), Times[1]);
}

// After the picture is complete, the steps beside it are there: neither brick nor range is read
// when they are shown, and the budget holds all the while.
TEST(TimeSteps, NeighboursAreReadAhead)
{
  constexpr std::uint64_t budget = 8 << 20;
  for (const bool skip : { true, false })
  {
    Stage stage(48, 48);
    stage.Mapper->SetHostMemoryBudget(budget);
    stage.Mapper->SetEmptySpaceSkipping(skip);
    vtkNew<SeriesAlgorithm> algorithm;
    algorithm->SetLevel(2);
    stage.Mapper->SetInputConnection(algorithm->GetOutputPort());
    Prepare(stage);
    algorithm->UpdateTimeStep(Times[1]);
    stage.Draw();
    ASSERT_TRUE(stage.Mapper->WaitForReadAhead(60));
    const std::uint64_t ahead = stage.Mapper->GetNumberOfBricksReadAhead();
    EXPECT_GT(ahead, 20u);
    EXPECT_EQ(algorithm->Series->Of(3).Reads(), 0u); // not a neighbour
    for (const int step : { 2, 1, 0, 1, 2, 3, 2 })
    {
      ASSERT_TRUE(stage.Mapper->WaitForReadAhead(60));
      algorithm->UpdateTimeStep(Times[step]); // reads the level that the pipeline presents
      RecordingSource& source = algorithm->Series->Of(step);
      const std::size_t bricks = source.Reads();
      const std::size_t ranges = source.RangeReads();
      EXPECT_TRUE(AreImagesIdentical(stage.Draw(), Alone(step))) << step;
      EXPECT_EQ(source.Reads(), bricks) << step << skip;
      EXPECT_EQ(source.RangeReads(), ranges) << step << skip;
      EXPECT_LE(stage.Mapper->GetHostMemoryUsed(), budget);
    }
    ASSERT_TRUE(stage.Mapper->WaitForReadAhead(60));
    EXPECT_GT(stage.Mapper->GetNumberOfBricksReadAhead(), ahead); // those of step 3
    EXPECT_LE(stage.Mapper->GetPeakHostMemoryUsed(), budget);
  }
}

// What is set aside for the sources of other steps is as large as these may need, not a share of
// gigabytes.
TEST(TimeSteps, SmallOnesSetLittleAside)
{
  Stage stage(48, 48);
  stage.Mapper->SetHostMemoryBudget(std::uint64_t{ 4 } << 30);
  vtkNew<SeriesAlgorithm> algorithm;
  stage.Mapper->SetInputConnection(algorithm->GetOutputPort());
  Prepare(stage);
  algorithm->UpdateTimeStep(Times[1]);
  stage.Draw();
  ASSERT_TRUE(stage.Mapper->WaitForReadAhead(60));
  EXPECT_GT(stage.Mapper->GetNumberOfBricksReadAhead(), 20u);
  EXPECT_LE(stage.Mapper->GetHostMemoryUsed(), std::uint64_t{ 16 } << 20);
}

// Where the budget doesn't hold all of it, the present step's bricks stay, and what is read ahead
// is what is near the eye.
TEST(TimeSteps, PresentBricksStayWhereTheBudgetIsSmall)
{
  for (const std::uint64_t budget :
    { std::uint64_t{ 700 } << 10, std::uint64_t{ 1000 } << 10, std::uint64_t{ 1600 } << 10 })
  {
    Stage stage(48, 48);
    stage.Mapper->SetHostMemoryBudget(budget);
    vtkNew<SeriesAlgorithm> algorithm;
    algorithm->SetLevel(2);
    stage.Mapper->SetInputConnection(algorithm->GetOutputPort());
    Prepare(stage);
    algorithm->UpdateTimeStep(Times[1]);
    const std::vector<float> picture = stage.Draw();
    EXPECT_TRUE(AreImagesIdentical(picture, Alone(1))) << budget;
    ASSERT_TRUE(stage.Mapper->WaitForReadAhead(60));
    EXPECT_LE(stage.Mapper->GetPeakHostMemoryUsed(), budget);
    const std::uint64_t ahead = stage.Mapper->GetNumberOfBricksReadAhead();
    std::printf("  %llu KiB: %llu bricks read ahead\n",
      static_cast<unsigned long long>(budget >> 10), static_cast<unsigned long long>(ahead));
    const std::size_t before = algorithm->Series->Of(1).Reads();
    // Another atlas: all bricks come from the host's cache again, as far as they were there.
    Stage control(48, 48);
    stage.Mapper->SetMaximumNumberOfSlots(200);
    EXPECT_TRUE(AreImagesIdentical(stage.Draw(), picture)) << budget;
    const std::size_t again = algorithm->Series->Of(1).Reads() - before;
    // The same without anything to read ahead.
    auto lonely = std::make_shared<MemorySeries>(false);
    vtkNew<vtkBrickSource> holder;
    holder->SetBrickSource(lonely->Sources[1]);
    holder->SetBrickSeries(lonely, 1);
    control.Mapper->SetHostMemoryBudget(budget);
    control.Mapper->SetBrickSource(holder);
    Prepare(control);
    control.Draw();
    ASSERT_TRUE(control.Mapper->WaitForReadAhead(60));
    EXPECT_EQ(control.Mapper->GetNumberOfBricksReadAhead(), 0u);
    const std::size_t first = lonely->Of(1).Reads();
    control.Mapper->SetMaximumNumberOfSlots(200);
    control.Draw();
    EXPECT_LE(again, lonely->Of(1).Reads() - first) << budget;
    // And on to the next one.
    algorithm->UpdateTimeStep(Times[2]);
    EXPECT_TRUE(AreImagesIdentical(stage.Draw(), Alone(2))) << budget;
    ASSERT_TRUE(stage.Mapper->WaitForReadAhead(60));
    EXPECT_LE(stage.Mapper->GetPeakHostMemoryUsed(), budget);
  }
}

// Another source ends the series: nothing of it stays.
TEST(TimeSteps, AnotherVolumeDropsTheSeries)
{
  Stage stage(48, 48);
  vtkNew<SeriesAlgorithm> algorithm;
  stage.Mapper->SetInputConnection(algorithm->GetOutputPort());
  Prepare(stage);
  stage.Draw();
  ASSERT_TRUE(stage.Mapper->WaitForReadAhead(60));
  const std::uint64_t used = stage.Mapper->GetHostMemoryUsed();
  stage.Mapper->RemoveAllInputConnections(0);
  stage.SetImage(ImageOfStep(2));
  EXPECT_TRUE(AreImagesIdentical(stage.Draw(), Alone(2)));
  EXPECT_LT(stage.Mapper->GetHostMemoryUsed(), used);
  std::weak_ptr<BrickSource> kept = algorithm->Series->Sources[1];
  EXPECT_EQ(kept.use_count(), 1); // the series' own
}

TEST(TimeSteps, SeriesOfPyramidFiles)
{
  std::vector<std::string> files;
  for (int step = 0; step < 3; ++step)
  {
    files.push_back(FreshFileName("step" + std::to_string(step) + ".h5"));
    vtkNew<vtkHDF5PyramidWriter> writer;
    writer->SetInputData(ImageOfStep(step));
    writer->SetFileName(files.back().c_str());
    writer->SetBrickSize(16);
    ASSERT_EQ(writer->Write(), 1);
  }
  const auto draw = [&](Stage& stage, vtkHDF5PyramidReader* reader)
  {
    reader->SetBrickSize(BrickEdge);
    reader->SetLevel(1);
    stage.Mapper->SetInputConnection(reader->GetOutputPort());
    Prepare(stage);
    return stage.Draw();
  };
  Stage stage(48, 48);
  vtkNew<vtkHDF5PyramidReader> reader;
  for (int step = 0; step < 3; ++step)
  {
    reader->AddFileName(files[static_cast<std::size_t>(step)].c_str());
    reader->SetTimeValue(step, 100 + step);
  }
  reader->UpdateInformation();
  vtkInformation* info = reader->GetOutputInformation(0);
  ASSERT_EQ(info->Length(vtkStreamingDemandDrivenPipeline::TIME_STEPS()), 3);
  EXPECT_EQ(info->Get(vtkStreamingDemandDrivenPipeline::TIME_STEPS())[2], 102);
  draw(stage, reader);
  const auto series = reader->GetBrickSource()->GetBrickSeries();
  for (const int step : { 1, 2, 1, 0 })
  {
    ASSERT_TRUE(stage.Mapper->WaitForReadAhead(60));
    reader->UpdateTimeStep(100 + step);
    EXPECT_EQ(reader->GetPresentedTimeStep(), step);
    const auto source = series->Step(step).Value();
    const std::uint64_t bytes = source->BytesRead();
    EXPECT_GT(bytes, 0u);
    const std::vector<float> picture = stage.Draw();
    EXPECT_EQ(source->BytesRead(), bytes) << step; // all of it was there
    Stage alone(48, 48);
    vtkNew<vtkHDF5PyramidReader> one;
    one->SetFileName(files[static_cast<std::size_t>(step)].c_str());
    EXPECT_TRUE(AreImagesIdentical(picture, draw(alone, one))) << step;
    EXPECT_EQ(one->GetNumberOfTimeSteps(), 1);
  }
  // A step that can't be opened is an error when it is shown, not before.
  reader->AddFileName(FreshFileName("nothing.h5").c_str());
  reader->SetTimeValue(3, 103);
  vtkNew<MessageRecorder> errors;
  reader->AddObserver(vtkCommand::ErrorEvent, errors);
  reader->UpdateTimeStep(102);
  stage.Draw();
  ASSERT_TRUE(stage.Mapper->WaitForReadAhead(60));
  EXPECT_TRUE(errors->Messages.empty()) << errors->Messages[0];
  reader->UpdateTimeStep(103);
  ASSERT_FALSE(errors->Messages.empty());
  EXPECT_NE(errors->Messages[0].find("nothing.h5"), std::string::npos) << errors->Messages[0];
}
