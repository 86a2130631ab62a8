// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// What lives in a context is freed with it, before it, or forgotten when it is gone: many times at
// constant memory, counted in bytes of the process and in OpenGL's objects. Testing/cycles.sh runs
// each a thousand times; by default, few: shaders are compiled each time, with the marcher of the
// GPU many.
#include "GLApi.h"
#include "ProcessMemory.h"
#include "Scene.h"
#include "vtkOutOfCoreVolumeMapper.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <gtest/gtest.h>
#include <memory>
#include <vector>
#include <vtkActor.h>
#include <vtkCamera.h>
#include <vtkCubeSource.h>
#include <vtkImageData.h>
#include <vtkPolyDataMapper.h>
#include <vtkRenderWindow.h>
#include <vtkRenderer.h>
#include <vtkRendererCollection.h>
#include <vtkVolume.h>
#include <vtkVolumeProperty.h>

using namespace teravox;
using namespace teravox::test;

namespace
{

int CyclesOf(int byDefault, int ofGPU)
{
  const char* wanted = std::getenv("TERAVOX_TEST_CYCLES");
  if (wanted != nullptr)
  {
    return std::max(std::atoi(wanted), 8);
  }
  return TestedMarcher() == vtkOutOfCoreVolumeMapper::MARCHER_GPU ? ofGPU : byDefault;
}

// Objects of the current context, of all kinds that the mapper makes.
int CountObjects()
{
  int count = 0;
  for (GLuint name = 1; name < 4096; ++name)
  {
    count += glIsTexture(name) != 0 ? 1 : 0;
    count += glIsBuffer(name) != 0 ? 1 : 0;
    count += glIsFramebuffer(name) != 0 ? 1 : 0;
    count += glIsVertexArray(name) != 0 ? 1 : 0;
    count += glIsProgram(name) != 0 ? 1 : 0;
    count += glIsShader(name) != 0 ? 1 : 0;
  }
  return count;
}

// Of some cycles, after as many as it takes until caches are full. What is allocated is the median
// of a few stretches: what leaks does so in each of them, and what grows in one (a driver takes 256
// KiB at once in one of fifty runs) is kept for later.
struct Growth
{
  double AllocatedPerCycle = 0; ///< bytes
  double ResidentPerCycle = 0;  ///< bytes
  int Cycles = 0;

  // Roundings of allocators, and what a driver keeps now and then; each object of the mapper, each
  // of its tables is larger.
  // The first few hundred programs also stay in Mesa's shader cache, with up to 5 KiB each: without
  // it (MESA_SHADER_CACHE_DISABLE=true) a cycle of release grows by 20 bytes with the shaders, too.
  static double Allowed()
  {
    return TestedMarcher() == vtkOutOfCoreVolumeMapper::MARCHER_GPU ? 8192 : 512;
  }
  // In a few cycles what a driver's caches take can't be told from growth with the shaders: there
  // objects are counted, and memory where TERAVOX_TEST_CYCLES asks for many (cycles.sh).
  static bool IsTold()
  {
    return TestedMarcher() != vtkOutOfCoreVolumeMapper::MARCHER_GPU ||
      std::getenv("TERAVOX_TEST_CYCLES") != nullptr;
  }
  bool IsConstant() const { return !IsTold() || this->AllocatedPerCycle < Allowed(); }
};

Growth Measure(const char* name, int cycles, const std::function<void(int)>& cycle)
{
  const int before = cycles / 4 + 1;
  for (int i = 0; i < before; ++i)
  {
    cycle(i);
  }
  const auto resident = static_cast<double>(ResidentBytes());
  Growth growth;
  growth.Cycles = cycles - before;
  constexpr int stretches = 5;
  std::array<double, stretches> allocated{};
  for (int k = 0, i = before; k < stretches; ++k)
  {
    const int first = i;
    const auto atFirst = static_cast<double>(AllocatedBytes());
    for (; i < before + growth.Cycles * (k + 1) / stretches; ++i)
    {
      cycle(i);
    }
    allocated[static_cast<std::size_t>(k)] =
      (static_cast<double>(AllocatedBytes()) - atFirst) / std::max(i - first, 1);
  }
  std::nth_element(allocated.begin(), allocated.begin() + stretches / 2, allocated.end());
  growth.AllocatedPerCycle = allocated[stretches / 2];
  growth.ResidentPerCycle =
    (static_cast<double>(ResidentBytes()) - resident) / static_cast<double>(growth.Cycles);
  std::printf("  %s: %d cycles, %.1f bytes allocated, %.1f resident per cycle\n", name, cycles,
    growth.AllocatedPerCycle, growth.ResidentPerCycle);
  return growth;
}

void Furnish(Stage& stage)
{
  ImageOptions options;
  options.Dimensions = { 14, 12, 16 };
  stage.Mapper->SetBrickSize(8);
  stage.Mapper->SetGPUMemoryBudget(std::uint64_t{ 4 } << 20);
  stage.Mapper->SetNumberOfLoaderThreads(1);
  stage.SetImage(MakeImage(options));
  stage.SetTransfer(MakeTransfer(OpacityShape::Ramp));
  stage.Look({ 0.4, 1, -0.3 }, 0.6);
}

// A window that shows a volume the way a stage does.
struct OtherWindow
{
  explicit OtherWindow(Stage& stage)
  {
    this->Window->SetOffScreenRendering(1);
    this->Window->SetMultiSamples(0);
    this->Window->SetSize(stage.Width(), stage.Height());
    this->Window->AddRenderer(this->Renderer);
    this->Renderer->AddVolume(stage.Volume);
    this->Renderer->GetActiveCamera()->DeepCopy(stage.Renderer->GetActiveCamera());
  }
  vtkNew<vtkRenderWindow> Window;
  vtkNew<vtkRenderer> Renderer;
};

} // namespace

// The meter itself: what it has to find.
TEST(Resources, TheMeterNoticesALeak)
{
  if (AllocatedBytes() == 0)
  {
    GTEST_SKIP() << "this allocator doesn't tell what it has given out";
  }
  std::vector<std::vector<char>> leaked;
  leaked.reserve(100);
  const auto size = static_cast<std::size_t>(2 * Growth::Allowed());
  EXPECT_GE(Measure("a leak", 100, [&](int) { leaked.emplace_back(size); }).AllocatedPerCycle,
    Growth::Allowed());
  Stage stage(16, 16);
  Furnish(stage);
  stage.Draw();
  const int before = CountObjects();
  GLuint texture = 0;
  glGenTextures(1, &texture);
  glBindTexture(GL_TEXTURE_2D, texture);
  EXPECT_EQ(CountObjects(), before + 1);
  glDeleteTextures(1, &texture);
}

TEST(Resources, ReleasedAndMadeAgain)
{
  Stage stage(16, 16);
  Furnish(stage);
  const std::vector<float> picture = stage.Draw();
  // VTK makes and frees objects of its own in the first frames.
  stage.Mapper->ReleaseGraphicsResources(stage.Window);
  stage.Draw();
  stage.Draw();
  const int with = CountObjects();
  stage.Mapper->ReleaseGraphicsResources(stage.Window);
  const int without = CountObjects();
  stage.Draw();
  EXPECT_GT(with, without + 2);
  const Growth growth = Measure("released", CyclesOf(200, 32),
    [&](int i)
    {
      stage.Mapper->ReleaseGraphicsResources(stage.Window);
      if (i % 16 == 0)
      {
        EXPECT_EQ(CountObjects(), without);
        EXPECT_EQ(stage.Mapper->GetGPUMemoryUsed(), 0u);
      }
      ASSERT_TRUE(AreImagesIdentical(stage.Draw(), picture)) << i;
      if (i % 16 == 0)
      {
        EXPECT_EQ(CountObjects(), with);
      }
    });
  EXPECT_TRUE(growth.IsConstant());
  EXPECT_EQ(CountObjects(), with);
}

TEST(Resources, TwoWindowsInTurn)
{
  Stage stage(16, 16);
  Furnish(stage);
  OtherWindow other(stage);
  const std::vector<float> picture = stage.Draw();
  other.Window->Render();
  const int inOther = CountObjects();
  stage.Window->Render();
  const int inFirst = CountObjects();
  const Growth growth = Measure("in turn", CyclesOf(60, 24),
    [&](int i)
    {
      other.Window->Render();
      ASSERT_TRUE(AreImagesIdentical(stage.Accumulator(), picture)) << i;
      EXPECT_EQ(i % 16 == 0 ? CountObjects() : inOther, inOther);
      stage.Window->Render();
      ASSERT_TRUE(AreImagesIdentical(stage.Accumulator(), picture)) << i;
      EXPECT_EQ(i % 16 == 0 ? CountObjects() : inFirst, inFirst);
    });
  EXPECT_TRUE(growth.IsConstant());
  other.Renderer->RemoveVolume(stage.Volume);
}

// Renderers come and go in a window that stays: what was kept of their views goes with them.
TEST(Resources, RenderersComeAndGo)
{
  Stage stage(16, 16);
  Furnish(stage);
  const std::vector<float> picture = stage.Draw();
  stage.Window->RemoveRenderer(stage.Renderer);
  int objects = 0;
  const Growth growth = Measure("renderers", CyclesOf(80, 24),
    [&](int i)
    {
      vtkNew<vtkRenderer> renderer;
      // One more that keeps its address from being used again.
      vtkNew<vtkRenderer> next;
      renderer->AddVolume(stage.Volume);
      renderer->GetActiveCamera()->DeepCopy(stage.Renderer->GetActiveCamera());
      stage.Window->AddRenderer(renderer);
      ASSERT_TRUE(AreImagesIdentical(stage.Draw(), picture)) << i;
      if (i == 8)
      {
        objects = CountObjects();
      }
      if (i > 8 && i % 8 == 0)
      {
        EXPECT_EQ(CountObjects(), objects);
      }
      // Without releasing the props' resources, as a program might that keeps its props.
      stage.Window->GetRenderers()->RemoveItem(renderer);
    });
  EXPECT_TRUE(growth.IsConstant());
}

// A mapper outlives its windows.
TEST(Resources, WindowsComeAndGo)
{
  Stage stage(16, 16);
  Furnish(stage);
  const std::vector<float> picture = stage.Draw();
  const auto cycle = [&](int i, bool volume)
  {
    auto other = std::make_unique<OtherWindow>(stage);
    if (!volume)
    {
      other->Renderer->RemoveVolume(stage.Volume);
    }
    other->Window->Render();
    if (volume)
    {
      EXPECT_TRUE(AreImagesIdentical(stage.Accumulator(), picture)) << i;
      if (i % 2 == 0)
      {
        // The volume is shown by another mapper when the window goes: nobody tells ours to release.
        stage.Volume->SetMapper(nullptr);
      }
    }
    other.reset();
    stage.Volume->SetMapper(stage.Mapper);
  };
  const int cycles = CyclesOf(48, 12);
  // What windows themselves leave behind in VTK and in the driver: some KiB each, now more, now
  // less.
  const Growth own = Measure("windows without a volume", cycles, [&](int i) { cycle(i, false); });
  const Growth growth = Measure("windows", cycles, [&](int i) { cycle(i, true); });
  EXPECT_LT(growth.AllocatedPerCycle, own.AllocatedPerCycle + 8 * Growth::Allowed());
  EXPECT_TRUE(AreImagesIdentical(stage.Draw(), picture));
}

// The context is made anew behind the mapper's back. Names of its old objects mean others then,
// which have to stay.
TEST(Resources, ContextLost)
{
  Stage stage(16, 16);
  Furnish(stage);
  const std::vector<float> picture = stage.Draw();
  stage.Volume->SetVisibility(0);
  stage.Window->Render();
  stage.Volume->SetVisibility(1);
  const auto cycle = [&](int i)
  {
    stage.Volume->SetMapper(nullptr);
    stage.Window->Finalize();
    stage.Volume->SetMapper(stage.Mapper);
    ASSERT_TRUE(AreImagesIdentical(stage.Draw(), picture)) << i;
    EXPECT_EQ(stage.Mapper->CheckInvariants(), "");
  };
  cycle(0);
  const int objects = CountObjects();
  const std::uint64_t memory = stage.Mapper->GetGPUMemoryUsed();
  for (int i = 1; i < CyclesOf(12, 3); ++i)
  {
    cycle(i);
    EXPECT_EQ(CountObjects(), objects);
    EXPECT_EQ(stage.Mapper->GetGPUMemoryUsed(), memory);
  }
  // Released while the context is gone: a second window, whose context is the current one now,
  // keeps what it has.
  OtherWindow second(stage);
  second.Renderer->RemoveVolume(stage.Volume);
  vtkNew<vtkCubeSource> cube;
  vtkNew<vtkPolyDataMapper> mapper;
  mapper->SetInputConnection(cube->GetOutputPort());
  vtkNew<vtkActor> actor;
  actor->SetMapper(mapper);
  second.Renderer->AddActor(actor);
  second.Window->Render();
  const int others = CountObjects();
  EXPECT_GT(others, 3);
  stage.Volume->SetMapper(nullptr);
  stage.Window->Finalize();
  second.Window->Render();
  stage.Mapper->ReleaseGraphicsResources(stage.Window);
  EXPECT_EQ(stage.Mapper->GetGPUMemoryUsed(), 0u);
  second.Window->MakeCurrent();
  EXPECT_EQ(CountObjects(), others);
  stage.Volume->SetMapper(stage.Mapper);
}

// The window goes first, another one's context is current when the mapper goes.
TEST(Resources, MapperOutlivesItsWindow)
{
  Stage other(16, 16);
  Furnish(other);
  const std::vector<float> picture = other.Draw();
  for (int i = 0; i < 4; ++i)
  {
    auto mapper = vtkSmartPointer<vtkOutOfCoreVolumeMapper>::New();
    {
      Stage stage(16, 16);
      Furnish(stage);
      mapper = stage.Mapper;
      stage.Draw();
      stage.Volume->SetMapper(nullptr);
    }
    EXPECT_EQ(mapper->GetGPUMemoryUsed(), 0u);
    other.Window->Render();
    const int objects = CountObjects();
    mapper = nullptr;
    other.Window->MakeCurrent();
    EXPECT_EQ(CountObjects(), objects);
    other.Mapper->Modified();
    other.Property->SetAmbient(0.1 * i);
    EXPECT_EQ(other.Draw().size(), picture.size());
  }
}
