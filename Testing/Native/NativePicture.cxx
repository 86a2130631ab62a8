// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "NativePicture.h"

#include "AtlasPlan.h"
#include "BrickTexels.h"
#include "GradientTable.h"
#include "LabelTables.h"
#include "MarchSetup.h"
#include "NativeAtlas.h"
#include "NativeMarcher.h"
#include "PageTable.h"
#include "Residency.h"
#include "SharedLayout.h"
#include "TransferPlane.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <gtest/gtest.h>
#include <omp.h>
#include <optional>
#include <thread>
#include <utility>

namespace teravox::test
{

namespace
{
constexpr std::uint64_t MostPasses = 200000;
constexpr const char* IsaVariable = "TERAVOX_NATIVE_ISA";

// Sets a variable of the environment, or removes it, as long as it lives.
class Variable
{
public:
  explicit Variable(const char* value)
  {
    const char* before = std::getenv(IsaVariable);
    this->Before = before != nullptr ? std::optional<std::string>(before) : std::nullopt;
    Set(value);
  }
  Variable(const Variable&) = delete;
  Variable& operator=(const Variable&) = delete;
  Variable(Variable&&) = delete;
  Variable& operator=(Variable&&) = delete;
  ~Variable() { Set(this->Before ? this->Before->c_str() : nullptr); }

private:
  static void Set(const char* value)
  {
    if (value != nullptr)
    {
      setenv(IsaVariable, value, 1);
    }
    else
    {
      unsetenv(IsaVariable);
    }
  }
  std::optional<std::string> Before;
};

NativeKernel KernelOf(bool baseline, bool gradient = false)
{
  const Variable isa(baseline ? "baseline" : nullptr);
  return gradient ? ChooseGradientKernel() : ChooseNativeKernel();
}

std::unique_ptr<NativeMarcher> MarcherOf(bool baseline)
{
  const Variable isa(baseline ? "baseline" : nullptr);
  return std::make_unique<NativeMarcher>();
}

class Threads
{
public:
  explicit Threads(int count)
    : Before(omp_get_max_threads())
  {
    omp_set_num_threads(count);
  }
  Threads(const Threads&) = delete;
  Threads& operator=(const Threads&) = delete;
  Threads(Threads&&) = delete;
  Threads& operator=(Threads&&) = delete;
  ~Threads() { omp_set_num_threads(this->Before); }

private:
  int Before;
};

LoadResult Load(BrickSource& source, const BrickKey& key)
{
  LoadResult result;
  result.Key = key;
  if (key.PageLevel == 0)
  {
    Result<BrickPointer> brick = source.ReadBrick(key);
    result.Outcome = brick.GetStatus();
    if (brick)
    {
      result.Brick = brick.Value();
    }
    return result;
  }
  auto ranges =
    source.ReadRanges(key.FirstChild(), { PageBlockEdge, PageBlockEdge, PageBlockEdge });
  result.Outcome = ranges.GetStatus();
  if (ranges)
  {
    result.Ranges = std::make_shared<const std::vector<ValueRange>>(std::move(ranges.Value()));
  }
  return result;
}
} // namespace

float Picture::Strongest() const
{
  float strongest = 0;
  for (std::size_t i = 3; i < this->Colors.size(); i += 4)
  {
    strongest = std::max(strongest, 1 - this->Colors[i]);
  }
  return strongest;
}

struct PictureMaker::Parts
{
  PictureScene Scene;
  PictureMeans Means;
  TexelFormat Format;
  AtlasPlan Plan;
  TransferTable Transfer;
  GradientTable OpacityOfGradient;
  TransferPlane Plane;
  std::vector<TransferTable> OfLabels;
  std::vector<NativeScene::LabelTable> LabelTables;
  std::uint32_t TableVersion = 1;
  std::unique_ptr<NativeAtlas> Atlas;
  std::unique_ptr<PageTable> Table;
  std::unique_ptr<Residency> Manager;
  std::unique_ptr<NativeMarcher> Marcher;
  ViewGeometry Geometry;
  NativeView View;
  std::string Error;

  Status Prepare();
  void FillParameters();
  NativeScene MakeScene();
  std::vector<std::uint32_t> Begin();
  bool Carry(const FramePlan& plan, Picture& picture);
  void Run(Picture& picture);
  void Complete(Picture& picture);
};

Status PictureMaker::Parts::Prepare()
{
  const VolumeInfo& info = this->Scene.Source->Info();
  const ViewInput& camera = this->Scene.Camera;
  this->Format = TexelFormat::Choose(info.Type);
  AtlasRequest request =
    AtlasRequest::For(this->Format, AtlasComponents(info), camera.Width, camera.Height);
  request.BudgetBytes = std::uint64_t{ 1 } << 40;
  request.MaximumSlots = this->Means.Slots;
  request.Native = true;
  Result<AtlasPlan> plan = PlanAtlas(info.Layout, request);
  if (!plan)
  {
    return plan.GetStatus();
  }
  this->Plan = plan.Value();
  if (this->Means.PageBlocks != 0)
  {
    this->Plan.PageBlocks =
      std::max(this->Means.PageBlocks, static_cast<std::uint32_t>(info.Layout.PageDepth()));
  }
  Result<std::unique_ptr<NativeAtlas>> atlas = NativeAtlas::Make(this->Plan);
  if (!atlas)
  {
    return atlas.GetStatus();
  }
  this->Atlas = std::move(atlas.Value());
  this->Table = std::make_unique<PageTable>(info.Layout, this->Plan.PageBlocks);
  this->Manager = std::make_unique<Residency>(*this->Table, this->Plan.Slots);
  for (int l = 0; l < info.Layout.NumberOfLevels(); ++l)
  {
    BrickKey first;
    first.Level = static_cast<std::uint8_t>(l);
    first.PageLevel = static_cast<std::uint8_t>(info.Layout.PageDepth(l));
    const auto ranges =
      this->Scene.Source->ReadRanges(first, info.Layout.Pages(l, info.Layout.PageDepth(l)));
    if (ranges)
    {
      this->Table->SetDirectoryRanges(l, ranges.Value());
    }
  }
  Result<ViewGeometry> geometry = ViewGeometry::Make(info.Layout, camera);
  if (!geometry)
  {
    return geometry.GetStatus();
  }
  this->Geometry = geometry.Value();
  this->OpacityOfGradient = BuildGradientTable(this->Scene.Function);
  if (info.MaskLabels > 0)
  {
    this->OfLabels = BuildLabelTables(this->Scene.Function, info.Range, !IsFloat(info.Type), 1e-3);
    SetLabelTables(this->LabelTables, this->OfLabels, this->OpacityOfGradient);
    this->Transfer = this->OfLabels.front();
  }
  else
  {
    this->Transfer =
      BuildTransferTable(this->Scene.Function, info.Range, !IsFloat(info.Type), 1e-3);
  }
  this->Plane = BuildTransferPlane(this->Scene.Function, this->Transfer.LargestExtinction);
  this->Marcher = MarcherOf(this->Means.Baseline);
  this->View.Resize(camera.Width, camera.Height);
  this->FillParameters();
  return {};
}

// VolumeEngine::FillParameters.
void PictureMaker::Parts::FillParameters()
{
  MarchParameters& p = this->Geometry.Parameters;
  p.Atlas = { this->Plan.Slots, 1, 1,
    static_cast<std::uint32_t>(this->Scene.Source->Info().Layout.StoredSize()) };
  p.Value = { static_cast<float>(this->Format.Scale), static_cast<float>(this->Format.Offset), 0,
    0 };
  p.Transfer = TransferParameters(this->Transfer);
  p.Gradient = GradientParameters(this->Scene.Function, this->Scene.Camera.DatasetFromVoxel, 0);
  if (!this->Plane.IsNone())
  {
    SetPlaneParameters(
      p, this->Plane, this->Scene.Function, this->Transfer, this->Scene.Camera.DatasetFromVoxel, 0);
  }
  p.Step = StepParameters(this->Scene.SampleDistance, this->Scene.Tolerance, 1);
  p.Switches[0] = this->Means.Skip ? 1u : 0u;
  p.Limits[0] = this->Means.StepsPerPass;
  p.Material = this->Scene.Material;
  p.LightDiffuse = { 1, 1, 0.9f, this->Scene.TwoSided ? 1.0f : 0.0f };
  p.LightSpecular = { 1, 0.8f, 1, 0 };
}

NativeScene PictureMaker::Parts::MakeScene()
{
  NativeScene s;
  s.Parameters = &this->Geometry.Parameters;
  s.Intervals = &this->Geometry.Intervals;
  s.NumberOfPlanes = static_cast<int>(this->Geometry.Planes.size());
  s.Planes = this->Geometry.Planes.empty() ? nullptr : this->Geometry.Planes.front().data();
  SetTables(s, this->Transfer, this->TableVersion);
  SetGradientTable(s, this->OpacityOfGradient);
  SetPlane(s, this->Plane);
  s.LabelTables = this->LabelTables.empty() ? nullptr : this->LabelTables.data();
  SetAtlas(s, *this->Atlas, *this->Table, this->Format);
  SetView(s, this->View, this->Scene.Camera.Width, this->Scene.Camera.Height);
  s.Masked = this->Scene.Source->Info().Masked;
  s.Nearest = this->Scene.Nearest;
  s.FixedStep = !this->Scene.Nearest && this->Scene.Tolerance <= 0;
  s.Shade = this->Scene.Shade;
  return s;
}

std::vector<std::uint32_t> PictureMaker::Parts::Begin()
{
  this->View.Clear();
  return TilesOf(this->Geometry.Intervals.Rectangle);
}

bool PictureMaker::Parts::Carry(const FramePlan& plan, Picture& picture)
{
  for (const FramePlan::Upload& upload : plan.Uploads)
  {
    std::uint32_t component = 0;
    for (const ConvertedBrick& texels : ConvertComponents(*upload.Data, this->Format))
    {
      this->Atlas->Write(upload.Slot, texels.Bytes.data(), texels.Bytes.size(), texels.Cells.data(),
        texels.Cells.size(), component);
      if (this->Plan.SlotTableBytes != 0)
      {
        this->Atlas->WriteEntry(
          upload.Slot, texels.OffsetHigh, texels.OffsetLow, texels.Scale, component);
      }
      ++component;
    }
    ++picture.Uploads;
  }
  const bool changed = !this->Table->TakeChanges().empty();
  return changed || !plan.Uploads.empty();
}

// VolumeEngine::RunPasses, with a loader that answers before the next step.
void PictureMaker::Parts::Run(Picture& picture)
{
  std::vector<std::uint32_t> tiles = this->Begin();
  Feedback feedback;
  std::vector<LoadResult> finished;
  bool waiting = false;
  bool unfinished = true;
  while (waiting || unfinished)
  {
    const FramePlan plan = this->Manager->Step(feedback, std::move(finished), this->Geometry.Order);
    const bool changed = this->Carry(plan, picture);
    std::string broken = this->Manager->CheckInvariants();
    if (!broken.empty())
    {
      picture.Error = "after pass " + std::to_string(picture.Passes) + ": " + broken;
      return;
    }
    finished.clear();
    for (const LoadRequest& request : plan.Requests)
    {
      finished.push_back(Load(*this->Scene.Source, request.Key));
    }
    if (picture.Passes > 0 && waiting && !unfinished && !changed)
    {
      if (finished.empty())
      {
        picture.Error = "the rays wait and nothing is asked for";
        return;
      }
      continue; // nothing new for the rays
    }
    const PassResult pass =
      this->Marcher->DrawPass(this->MakeScene(), this->Plan.Slots, this->Plan.PageBlocks, tiles);
    ++picture.Passes;
    waiting = pass.Waiting;
    unfinished = pass.Unfinished;
    picture.Samples += pass.Samples;
    picture.Fallback = picture.Fallback || pass.Fallback;
    feedback = pass.Report;
    if (tiles.empty() == (waiting || unfinished))
    {
      picture.Error = "the tiles under way don't fit what the pass reports";
      return;
    }
    if (picture.Passes == MostPasses)
    {
      picture.Error = "the rays don't come to their ends";
      return;
    }
  }
}

// Takes the accumulators; all rays that may see the box must have ended.
void PictureMaker::Parts::Complete(Picture& picture)
{
  constexpr std::int32_t done = 2 << 16;
  const std::array<int, 4>& seen = this->Geometry.Intervals.Rectangle;
  const int width = this->Scene.Camera.Width;
  const int height = this->Scene.Camera.Height;
  for (int y = seen[1]; y < seen[3] && picture.Error.empty(); ++y)
  {
    for (int x = seen[0]; x < seen[2]; ++x)
    {
      const std::size_t pixel =
        static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
      if ((this->View.Position[4 * pixel + 3] & ~0xffff) != done)
      {
        picture.Error =
          "the ray of pixel " + std::to_string(x) + ", " + std::to_string(y) + " hasn't ended";
        break;
      }
    }
  }
  picture.Width = width;
  picture.Height = height;
  picture.Colors = this->View.Color;
  picture.Evictions = this->Manager->NumberOfEvictions();
}

PictureMaker::PictureMaker(PictureScene scene, const PictureMeans& means)
  : Own(std::make_unique<Parts>())
{
  this->Own->Scene = std::move(scene);
  this->Own->Means = means;
  const Threads threads(means.Threads);
  this->Own->Error = this->Own->Prepare().Message();
}

PictureMaker::~PictureMaker() = default;

Picture PictureMaker::Draw()
{
  Picture picture;
  picture.Error = this->Own->Error;
  if (picture.Error.empty())
  {
    const Threads threads(this->Own->Means.Threads);
    this->Own->Run(picture);
    this->Own->Complete(picture);
  }
  return picture;
}

Picture PictureMaker::DrawWithThreads(int threads)
{
  Picture picture;
  ++this->Own->TableVersion; // the bits of all slots are made anew, by several threads at once
  const std::vector<std::uint32_t> tiles = this->Own->Begin();
  std::vector<std::uint8_t> slots(this->Own->Plan.Slots);
  std::vector<std::uint8_t> blocks(this->Own->Plan.PageBlocks);
  NativeScene scene = this->Own->MakeScene();
  scene.UsedSlots = slots.data();
  scene.UsedBlocks = blocks.data();
  const NativeKernel kernel = KernelOf(
    this->Own->Means.Baseline, !this->Own->OpacityOfGradient.IsOne() || !this->Own->Plane.IsNone());
  std::atomic<std::size_t> next{ 0 };
  std::atomic<bool> missed{ false };
  const auto work = [&]
  {
    constexpr int edge = static_cast<int>(shared::TILE_SIZE);
    for (std::size_t i = next++; i < tiles.size(); i = next++)
    {
      NativeReport report;
      report.Context = &missed;
      report.Request = [](void* context, int, const std::uint32_t*, float)
      { *static_cast<std::atomic<bool>*>(context) = true; };
      const int x = static_cast<int>(tiles[i] & 0xffffu) * edge;
      const int y = static_cast<int>(tiles[i] >> 16) * edge;
      kernel(
        scene, x, y, std::min(x + edge, scene.Width), std::min(y + edge, scene.Height), report);
    }
  };
  std::vector<std::thread> workers;
  for (int i = 0; i < threads; ++i)
  {
    workers.emplace_back(work);
  }
  for (std::thread& worker : workers)
  {
    worker.join();
  }
  picture.Passes = 1;
  picture.Error = missed ? "a brick that was resident is missing" : "";
  this->Own->Complete(picture);
  return picture;
}

Picture Draw(const PictureScene& scene, const PictureMeans& means)
{
  return PictureMaker(scene, means).Draw();
}

bool HasSeveralInstructionSets()
{
  return KernelOf(true) != KernelOf(false);
}

void ExpectSameBits(const Picture& a, const Picture& b, const std::string& what)
{
  ASSERT_EQ(a.Colors.size(), b.Colors.size()) << what;
  if (a.Colors.empty() ||
    std::memcmp(a.Colors.data(), b.Colors.data(), a.Colors.size() * sizeof(float)) == 0)
  {
    return;
  }
  std::size_t different = 0;
  std::size_t first = a.Colors.size();
  float largest = 0;
  for (std::size_t i = 0; i < a.Colors.size(); ++i)
  {
    if (std::memcmp(&a.Colors[i], &b.Colors[i], sizeof(float)) != 0)
    {
      ++different;
      first = std::min(first, i);
      largest = std::max(largest, std::abs(a.Colors[i] - b.Colors[i]));
    }
  }
  const std::size_t pixel = first / 4;
  const auto width = static_cast<std::size_t>(a.Width);
  ADD_FAILURE() << what << ": " << different << " of " << a.Colors.size()
                << " numbers differ, by up to " << largest << "; the first is channel " << first % 4
                << " of pixel " << pixel % width << ", " << pixel / width << ": " << a.Colors[first]
                << " and " << b.Colors[first];
}

void ExpectSound(const Picture& picture, const std::string& what)
{
  ASSERT_EQ(picture.Error, "") << what;
  ASSERT_FALSE(picture.Colors.empty()) << what;
  for (std::size_t pixel = 0; pixel < picture.Colors.size() / 4; ++pixel)
  {
    const float* c = &picture.Colors[4 * pixel];
    // A comparison with NaN is false.
    bool sound = c[3] >= 0 && c[3] <= 1;
    for (int i = 0; i < 3; ++i)
    {
      // Premultiplied, up to the rounding of some hundred additions.
      sound = sound && c[i] >= 0 && c[i] <= 1 - c[3] + 1e-5f && c[i] <= 1 + 1e-5f;
    }
    ASSERT_TRUE(sound) << what << ": pixel " << pixel << " holds " << c[0] << ", " << c[1] << ", "
                       << c[2] << ", transmittance " << c[3];
  }
}

namespace
{
Double3 Minus(const Double3& a, const Double3& b)
{
  return { a[0] - b[0], a[1] - b[1], a[2] - b[2] };
}

Double3 Cross(const Double3& a, const Double3& b)
{
  return { a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0] };
}

double Dot(const Double3& a, const Double3& b)
{
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

Double3 Unit(const Double3& v)
{
  const double length = std::sqrt(Dot(v, v));
  return { v[0] / length, v[1] / length, v[2] / length };
}
} // namespace

Matrix4 LookAt(const Double3& eye, const Double3& focus, const Double3& up)
{
  const Double3 back = Unit(Minus(eye, focus));
  const Double3 right = Unit(Cross(up, back));
  const Double3 above = Cross(back, right);
  Matrix4 m{};
  const std::array<Double3, 3> axes{ right, above, back };
  for (std::size_t i = 0; i < 3; ++i)
  {
    for (std::size_t j = 0; j < 3; ++j)
    {
      m[4 * i + j] = axes[i][j];
    }
    m[4 * i + 3] = -Dot(axes[i], eye);
  }
  m[15] = 1;
  return m;
}

Matrix4 Perspective(double angle, double aspect, double nearDepth, double farDepth)
{
  const double f = 1 / std::tan(angle * 3.14159265358979323846 / 360);
  const double depth = nearDepth - farDepth;
  return { f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (farDepth + nearDepth) / depth,
    2 * farDepth * nearDepth / depth, 0, 0, -1, 0 };
}

Matrix4 Parallel(double height, double aspect, double nearDepth, double farDepth)
{
  const double depth = nearDepth - farDepth;
  return { 2 / (height * aspect), 0, 0, 0, 0, 2 / height, 0, 0, 0, 0, 2 / depth,
    (farDepth + nearDepth) / depth, 0, 0, 0, 1 };
}

ViewInput MakeCamera(const VolumeInfo& info, int width, int height, const Matrix4& viewFromWorld,
  const Matrix4& clipFromView)
{
  ViewInput input;
  input.ViewFromWorld = viewFromWorld;
  input.ClipFromView = clipFromView;
  input.WorldFromDataset = { 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1 };
  for (std::size_t a = 0; a < 3; ++a)
  {
    input.DatasetFromVoxel[5 * a] = info.Spacing[a];
    input.DatasetFromVoxel[4 * a + 3] = info.Origin[a] - 0.5 * info.Spacing[a];
  }
  input.DatasetFromVoxel[15] = 1;
  input.Width = width;
  input.Height = height;
  input.CellData = info.CellData;
  return input;
}

float LargestDifference(const Picture& a, const Picture& b)
{
  float largest = 0;
  for (std::size_t i = 0; i < a.Colors.size(); ++i)
  {
    largest = std::max(largest, std::abs(a.Colors[i] - b.Colors[i]));
  }
  return largest;
}

TransferFunction WithGradientOpacity(TransferFunction function, double low, double high)
{
  function.GradientOpacity = [low, high](double magnitude)
  { return std::clamp((magnitude - low) / (high - low), 0.0, 1.0); };
  function.LastGradient = high;
  return function;
}

TransferFunction MakePlane(int columns, int rows, const ValueRange& values, double lastGradient,
  const std::function<std::array<float, 4>(double, double)>& node, double unitDistance)
{
  TransferImage image;
  image.Columns = columns;
  image.Rows = rows;
  image.Values = values;
  image.LastGradient = lastGradient;
  for (int row = 0; row < rows; ++row)
  {
    for (int column = 0; column < columns; ++column)
    {
      image.Nodes.push_back(node(static_cast<double>(column) / std::max(columns - 1, 1),
        static_cast<double>(row) / std::max(rows - 1, 1)));
    }
  }
  return MakeImageFunction(std::move(image), unitDistance);
}

TransferFunction MakeFunction(
  std::vector<double> values, std::vector<double> opacities, double unitDistance)
{
  TransferFunction function;
  function.Knots = values;
  function.UnitDistance = unitDistance;
  const double low = values.front();
  const double range = std::max(values.back() - low, 1e-30);
  function.Opacity = [values = std::move(values), opacities = std::move(opacities)](double v)
  {
    if (!(v > values.front()))
    {
      return opacities.front();
    }
    for (std::size_t i = 1; i < values.size(); ++i)
    {
      if (v <= values[i])
      {
        const double share = (v - values[i - 1]) / (values[i] - values[i - 1]);
        return opacities[i - 1] + share * (opacities[i] - opacities[i - 1]);
      }
    }
    return opacities.back();
  };
  function.Color = [low, range](double v, double* rgb)
  {
    const double at = (v - low) / range;
    rgb[0] = std::clamp(2 * at - 1, 0.0, 1.0);
    rgb[1] = std::clamp(1 - std::abs(2 * at - 1), 0.0, 1.0);
    rgb[2] = std::clamp(1 - 2 * at, 0.0, 1.0);
  };
  return function;
}

} // namespace teravox::test
