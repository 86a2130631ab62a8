// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// Whatever a user may do, in random order, with invariants checked after each step: soak.sh.
#include "ProcessMemory.h"
#include "Scene.h"
#include "TestPyramidSupport.h"
#include "VTKTestSupport.h"
#include "vtkHDF5PyramidReader.h"
#include "vtkOutOfCoreVolumeMapper.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <gtest/gtest.h>
#include <random>
#include <string>
#include <thread>
#include <vector>
#include <vtkDataObject.h>
#include <vtkInformation.h>
#include <vtkRenderWindow.h>
#include <vtkStreamingDemandDrivenPipeline.h>

using namespace teravox;
using namespace teravox::test;

namespace
{

int NumberOfSteps()
{
  const char* wanted = std::getenv("TERAVOX_TEST_STEPS");
  // New shaders take their time where processors draw.
  const int few = TestedMarcher() == vtkOutOfCoreVolumeMapper::MARCHER_NATIVE ? 150 : 40;
  return wanted != nullptr ? std::max(std::atoi(wanted), 1) : few;
}

/// Two files, one of them of three time steps, and a stage that draws one of them.
class User
{
public:
  User()
    : Shown(48, 48)
  {
    const Int3 sizes[2] = { { 60, 50, 70 }, { 40, 44, 36 } };
    for (unsigned file = 0; file < 4; ++file)
    {
      teravox::testing::ArrayVoxelReader voxels(
        teravox::testing::Describe(sizes[file == 0 ? 0 : 1], ScalarType::UInt16));
      voxels.GenerateMixed(file + 1);
      PyramidWriterOptions options;
      options.BrickSize = 16;
      const auto report = PyramidWriter::Write(this->Name(file), voxels, options);
      EXPECT_TRUE(report.Ok()) << report.GetStatus().Message();
    }
    this->Open(false);
    this->Shown.Look({ 1, 0.4, 0.3 });
    this->Recorder->Observe(this->Shown.Mapper);
  }

  /// One thing that a user may do.
  std::string Act(int action)
  {
    vtkOutOfCoreVolumeMapper* mapper = this->Shown.Mapper;
    switch (action)
    {
      case 0:
      case 1:
      case 2:
        this->Shown.Look({ this->Between(-1, 1), this->Between(-1, 1), this->Between(0.1, 1) },
          this->Between(0.3, 2), this->Below(4) == 0);
        return "camera";
      case 3:
        this->Shown.SetTransfer(MakeTransfer(static_cast<OpacityShape>(this->Below(5)), 0,
          this->Between(60, 200), this->Between(0.5, 5)));
        return "transfer function";
      case 4:
        mapper->SetCropping(this->Below(2));
        mapper->SetCroppingRegionPlanes(this->Between(0, 15), this->Between(16, 40),
          this->Between(0, 15), this->Between(16, 40), this->Between(0, 15), this->Between(16, 40));
        mapper->SetCroppingRegionFlags(static_cast<int>(this->Below(1u << 27)));
        return "crop";
      case 5:
        mapper->SetMinimumLevel(static_cast<int>(this->Below(2)));
        mapper->SetMaximumLevel(this->Below(2) == 0 ? 31 : static_cast<int>(1 + this->Below(2)));
        mapper->SetLevelOfDetailBias(this->Between(-1, 2));
        return "level";
      case 6:
        this->Reader->GetOutputInformation(0)->Set(
          vtkStreamingDemandDrivenPipeline::UPDATE_TIME_STEP(), double(this->Below(3)));
        this->Reader->UpdateTimeStep(double(this->Below(3)));
        return "time";
      case 7:
        mapper->SetGPUMemoryBudget((2u << 20) + this->Below(24u << 20));
        return "budget of the GPU";
      case 8:
        mapper->SetHostMemoryBudget((2u << 20) + this->Below(24u << 20));
        return "budget of the host";
      case 9:
        mapper->SetMaximumNumberOfSlots(this->Below(2) == 0 ? 0 : 2 + this->Below(40));
        return "slots";
      case 10:
        this->Open(this->Below(2) == 0);
        return "file";
      case 11:
        mapper->SetNumberOfLoaderThreads(static_cast<int>(1 + this->Below(4)));
        mapper->SetArrivalShuffleSeed(this->Below(3));
        return "threads";
      case 12:
        this->Shown.SetShade(this->Below(2) == 0);
        mapper->SetBlendMode(this->Below(3) == 0 ? static_cast<int>(this->Below(4)) : 0);
        return "shading and blending";
      default:
        mapper->SetFrameTimeBudget(this->Below(2) == 0 ? 0 : 1e3);
        return "mode";
    }
  }

  std::uint32_t Below(std::uint32_t n) { return static_cast<std::uint32_t>(this->Random()) % n; }
  double Between(double low, double high)
  {
    return low + (high - low) * this->Below(1 << 20) / double(1 << 20);
  }

  Stage Shown;
  vtkNew<ErrorRecorder> Recorder;

  void Open(bool series)
  {
    this->Reader = vtkSmartPointer<vtkHDF5PyramidReader>::New();
    this->Reader->SetBrickSize(16);
    if (series)
    {
      for (unsigned file = 1; file < 4; ++file)
      {
        this->Reader->AddFileName(this->Name(file).c_str());
      }
    }
    else
    {
      this->Reader->SetFileName(this->Name(0).c_str());
    }
    this->Shown.Mapper->SetInputConnection(this->Reader->GetOutputPort());
    this->Shown.SetTransfer(MakeTransfer(OpacityShape::Ramp, 0, 110));
  }

private:
  std::string Name(unsigned file) const
  {
    return this->Folder.File("soak" + std::to_string(file) + ".h5");
  }

  teravox::testing::TemporaryFolder Folder;
  std::mt19937 Random{ 20 };
  vtkSmartPointer<vtkHDF5PyramidReader> Reader;
};

} // namespace

// What was set aside for the steps beside the present one goes when the budget does; found by the
// random steps below.
TEST(Soak, ASmallerBudgetHoldsAtOnce)
{
  User user;
  vtkOutOfCoreVolumeMapper* mapper = user.Shown.Mapper;
  user.Open(true);
  mapper->SetHostMemoryBudget(64 << 20);
  user.Shown.Draw();
  ASSERT_TRUE(mapper->IsConverged());
  ASSERT_TRUE(mapper->WaitForReadAhead(60));
  ASSERT_GT(mapper->GetNumberOfBricksReadAhead(), 0u);
  for (const vtkTypeUInt64 budget : { vtkTypeUInt64{ 8 << 20 }, vtkTypeUInt64{ 5 << 19 } })
  {
    mapper->SetHostMemoryBudget(budget);
    user.Shown.Draw();
    EXPECT_TRUE(mapper->IsConverged());
    EXPECT_LE(mapper->GetHostMemoryUsed(), budget);
  }
}

TEST(Soak, RandomStepsKeepInvariantsAndBudgets)
{
  const int steps = NumberOfSteps();
  User user;
  vtkOutOfCoreVolumeMapper* mapper = user.Shown.Mapper;
  mapper->SetGPUMemoryBudget(16 << 20);
  mapper->SetHostMemoryBudget(16 << 20);
  std::vector<std::uint64_t> allocated;
  std::vector<std::uint64_t> resident;
  int converged = 0;
  for (int step = 0; step < steps; ++step)
  {
    const std::string what = user.Act(static_cast<int>(user.Below(14)));
    SCOPED_TRACE("step " + std::to_string(step) + ", " + what);
    const bool converging = mapper->GetFrameTimeBudget() == 0;
    user.Shown.Window->Render();
    ASSERT_EQ(mapper->CheckInvariants(), "");
    ASSERT_LE(mapper->GetGPUMemoryUsed(), mapper->GetEffectiveGPUMemoryBudget());
    ASSERT_LE(mapper->GetHostMemoryUsed(), mapper->GetEffectiveHostMemoryBudget());
    ASSERT_EQ(mapper->GetNumberOfFailedBricks() + mapper->GetNumberOfFailedPageBlocks(), 0u);
    // An error here may only be that a budget is too small, by name.
    for (const std::string& error : user.Recorder->Errors)
    {
      ASSERT_NE(error.find("budget"), std::string::npos) << error;
    }
    if (converging && user.Recorder->Errors.empty())
    {
      ASSERT_TRUE(mapper->IsConverged());
    }
    user.Recorder->Errors.clear();
    converged += mapper->IsConverged() ? 1 : 0;
    allocated.push_back(AllocatedBytes());
    resident.push_back(ResidentBytes());
  }
  EXPECT_GT(converged, steps / 4);
  // The most that the process held in the last quarter beside the second one: the first quarter
  // fills caches, budgets are as random in both.
  const auto most = [steps](const std::vector<std::uint64_t>& bytes, int quarter)
  {
    const auto first = bytes.begin() + steps * quarter / 4;
    return *std::max_element(first, first + std::max(steps / 4, 1));
  };
  std::printf(
    "  %d steps, %d complete; allocated %.1f, then %.1f MiB; resident %.1f, then %.1f MiB\n", steps,
    converged, double(most(allocated, 1)) / 1048576, double(most(allocated, 3)) / 1048576,
    double(most(resident, 1)) / 1048576, double(most(resident, 3)) / 1048576);
  // The host's and the GPU's budgets together may differ by 50 MiB between the quarters; more is
  // growth.
  EXPECT_LE(most(allocated, 3), most(allocated, 1) + (50u << 20));
  EXPECT_LE(most(resident, 3), most(resident, 1) + (80u << 20));
}
