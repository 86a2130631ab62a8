// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// The estimate of the error of each pixel against its true error, on random scenes.
#include "Scene.h"
#include "vtkOutOfCoreVolumeMapper.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <gtest/gtest.h>
#include <random>
#include <string>
#include <vtkCamera.h>
#include <vtkColorTransferFunction.h>
#include <vtkImageData.h>
#include <vtkPiecewiseFunction.h>
#include <vtkRenderWindow.h>
#include <vtkRenderer.h>
#include <vtkVolumeProperty.h>

using namespace teravox;
using namespace teravox::test;

namespace
{

constexpr int Edge = 12; // of a picture
constexpr int BrickEdge = 8;
constexpr int Batches = 7;
constexpr int BatchesWithoutGradientOpacity = 4;
constexpr int BatchesWithoutImage = 6;
constexpr int ScenesPerBatch = 250;

std::vector<float> EstimateOf(Stage& stage)
{
  vtkNew<vtkImageData> image;
  if (!stage.Mapper->GetErrorEstimateImage(image))
  {
    return {};
  }
  const auto* pixels = static_cast<const float*>(image->GetScalarPointer());
  return { pixels, pixels + image->GetNumberOfPoints() };
}

/// Everything about a scene that is left to chance, of one sequence of numbers.
class RandomScene
{
public:
  explicit RandomScene(unsigned seed)
    : Random(seed)
  {
  }

  double Number(double low, double high)
  {
    return std::uniform_real_distribution<double>(low, high)(this->Random);
  }
  bool Chance(double probability) { return this->Number(0, 1) < probability; }
  int Whole(int low, int high)
  {
    return std::uniform_int_distribution<int>(low, high)(this->Random);
  }

  vtkSmartPointer<vtkImageData> MakeVolume()
  {
    ImageOptions options;
    options.Type = AllScalarTypes[static_cast<std::size_t>(this->Whole(0, 7))];
    for (std::size_t a = 0; a < 3; ++a)
    {
      options.Dimensions[a] = this->Whole(10, 30);
      options.Spacing[a] = this->Chance(0.5) ? 1 : this->Number(0.4, 2.5);
    }
    const bool isSmall = options.Type == ScalarType::UInt8 || options.Type == ScalarType::Int8;
    options.Low = this->Chance(0.5) && !IsUnsigned(options.Type) ? -100 : 0;
    options.High = isSmall ? options.Low + 200 : options.Low + 30000;
    options.ShareOfNaN = IsFloat(options.Type) && this->Chance(0.2) ? 0.02 : 0;
    this->Low = options.Low;
    this->High = options.High;
    std::array<double, 9> wave{};
    for (double& w : wave)
    {
      w = this->Number(-14, 14);
    }
    const auto seed = static_cast<std::uint64_t>(this->Whole(0, 1 << 30));
    const double side = this->Number(-0.5, 0.5);
    switch (this->Whole(0, 3))
    {
      case 0:
        return MakeImage(options);
      case 1: // waves
        return MakeImage(options,
          [wave](double x, double y, double z)
          {
            return 0.5 + 0.25 * std::sin(wave[0] * x + wave[1] * y + wave[2] * z) +
              0.25 * std::sin(wave[3] * x + wave[4] * y + wave[5] * z + wave[6]);
          });
      case 2: // noise
        return MakeImage(options,
          [seed](double x, double y, double z)
          {
            std::seed_seq sequence{ seed, static_cast<std::uint64_t>(x * 1e6),
              static_cast<std::uint64_t>(y * 1e6), static_cast<std::uint64_t>(z * 1e6) };
            std::array<std::uint32_t, 1> word{};
            sequence.generate(word.begin(), word.end());
            return word[0] / 4294967296.0;
          });
      default: // a sheet
        return MakeImage(options,
          [wave, side](double x, double y, double z)
          {
            const double d =
              (wave[0] * (x - 0.5) + wave[1] * (y - 0.5) + wave[2] * (z - 0.5)) / 14 - 0.3 * side;
            // Exactly 0 further off: the direction of differences that are mere roundings of
            // doubles is no shading.
            return std::max(std::exp(-900 * d * d) - 1e-4, 0.0);
          });
    }
  }

  void SetFunctions(Stage& stage)
  {
    stage.Opacity->RemoveAllPoints();
    stage.Color->RemoveAllPoints();
    const int points = this->Whole(1, 8);
    const double highest = this->Chance(0.3) ? 1 : this->Chance(0.5) ? 0.3 : 0.03;
    for (int i = 0; i < points; ++i)
    {
      const double opacity = this->Chance(0.4) ? 0 : this->Number(0, highest);
      // Steps and smooth steps, too.
      const double sharpness = this->Chance(0.2) ? 1 : 0;
      stage.Opacity->AddPoint(
        this->Number(this->Low, this->High), opacity, this->Number(0.1, 0.9), sharpness);
      stage.Color->AddRGBPoint(this->Number(this->Low, this->High), this->Number(0, 1),
        this->Number(0, 1), this->Number(0, 1));
    }
    stage.Property->SetScalarOpacityUnitDistance(this->Number(0.3, 3));
    stage.Property->SetInterpolationType(
      this->Chance(0.15) ? VTK_NEAREST_INTERPOLATION : VTK_LINEAR_INTERPOLATION);
    stage.SetShade(this->Chance(0.4));
  }

  void SetGradientOpacity(Stage& stage)
  {
    vtkNew<vtkPiecewiseFunction> function;
    const int points = this->Whole(1, 5);
    for (int i = 0; i < points; ++i)
    {
      const double opacity = this->Chance(0.3) ? 0 : this->Chance(0.4) ? 1 : this->Number(0, 1);
      // Gradients are seldom near the largest ones that count.
      const double magnitude = 0.25 * (this->High - this->Low) * std::pow(this->Number(0, 1), 2);
      function->AddPoint(magnitude, opacity, this->Number(0.1, 0.9), this->Chance(0.2) ? 1 : 0);
    }
    stage.Property->SetGradientOpacity(function);
  }

  /// A 2-D transfer function: islands, or nodes that have nothing to do with each other.
  void SetTransferImage(Stage& stage)
  {
    const double highest = this->Chance(0.3) ? 1 : this->Chance(0.5) ? 0.3 : 0.03;
    const bool smooth = this->Chance(0.7);
    struct Island
    {
      double Value;
      double Gradient;
      double Wide;
      double Tall;
      double Opacity;
    };
    std::vector<Island> islands(static_cast<std::size_t>(this->Whole(1, 5)));
    for (Island& island : islands)
    {
      // Gradients are seldom near the largest ones that count.
      island = { this->Number(0, 1), std::pow(this->Number(0, 1), 2), this->Number(0.02, 0.5),
        this->Number(0.02, 0.5), this->Number(0, highest) };
    }
    stage.SetTransferImage(this->Whole(1, smooth ? 150 : 20), this->Whole(1, smooth ? 80 : 12),
      [&](double value, double gradient) -> std::array<double, 4>
      {
        double opacity = 0;
        for (const Island& i : islands)
        {
          const double off =
            std::hypot((value - i.Value) / i.Wide, (gradient - i.Gradient) / i.Tall);
          opacity = std::max(opacity, i.Opacity * std::min(1.0, 3 - 3 * off));
        }
        if (smooth)
        {
          return { value, gradient, 1 - value, opacity };
        }
        return { this->Number(0, 1), this->Number(0, 1), this->Number(0, 1),
          this->Chance(0.5) ? 0 : this->Number(0, highest) };
      });
  }

  void SetCamera(Stage& stage)
  {
    stage.Renderer->GetActiveCamera()->ParallelProjectionOff();
    std::array<double, 3> direction{};
    for (double& d : direction)
    {
      d = this->Number(-1, 1);
    }
    const bool parallel = this->Chance(0.2);
    // From inside to so far away that coarser levels are drawn.
    const double distance = this->Chance(0.2) ? 0.3 : this->Number(0.6, 4);
    stage.Look(direction, distance, parallel);
  }

  double Low = 0;
  double High = 1;

private:
  static bool IsUnsigned(ScalarType type)
  {
    return type == ScalarType::UInt8 || type == ScalarType::UInt16 || type == ScalarType::UInt32;
  }

  std::mt19937 Random;
};

/// What has been seen of all scenes.
struct Tally
{
  std::size_t Pixels = 0;
  std::size_t Below = 0;
  double LargestShortage = 0; // in units of the frame's tolerance
  std::string WorstScene;
  std::vector<double> Ratios; // estimate / true error
  std::size_t Incomplete = 0; // scenes
  std::size_t Substituted = 0;

  void Add(Stage& stage, BrickSource& source, const std::string& name)
  {
    const std::vector<float> picture = stage.Accumulator();
    const std::vector<float> estimate = EstimateOf(stage);
    ASSERT_EQ(estimate.size() * 4, picture.size()) << name;
    // In a hurry steps follow a larger one, so how much depends on what else the machine does.
    const double tolerance = stage.Mapper->GetFrameErrorTolerance();
    ASSERT_GE(tolerance, stage.Mapper->GetImageErrorTolerance()) << name;
    const StageTruth truth(stage, source);
    this->Incomplete += stage.Mapper->IsConverged() ? 0 : 1;
    for (std::size_t i = 0; i < estimate.size(); ++i)
    {
      const double e = static_cast<double>(estimate[i]);
      ASSERT_TRUE(e >= 0 && e <= 1) << name << ": " << e;
      const int x = static_cast<int>(i) % Edge;
      const int y = static_cast<int>(i) / Edge;
      const TruthColor color = IntegratePixel(truth.Scene(), x, y);
      double error = 0;
      for (std::size_t c = 0; c < 4; ++c)
      {
        error = std::max(error, std::abs(static_cast<double>(picture[4 * i + c]) - color[c]));
      }
      if (error > e)
      {
        // Grazing rays are ill-conditioned: what the envelope of 9 rays holds is no error.
        const TruthPixel pixel{ x, y };
        const std::vector<float> taken(picture.begin() + static_cast<std::ptrdiff_t>(4 * i),
          picture.begin() + static_cast<std::ptrdiff_t>(4 * i + 4));
        const TruthBounds bounds = truth.Bounds({ pixel }, { taken }, 0);
        error = ExcessOverEnvelope(taken, bounds.Low, bounds.High).Max;
      }
      ++this->Pixels;
      this->Below += error > e ? 1 : 0;
      if ((error - e) / tolerance > this->LargestShortage)
      {
        this->LargestShortage = (error - e) / tolerance;
        this->WorstScene = name + ", pixel " + std::to_string(x) + ", " + std::to_string(y) +
          ": error " + std::to_string(error / tolerance) + ", estimate " +
          std::to_string(e / tolerance);
      }
      if (error > 1e-4)
      {
        this->Ratios.push_back(e / error);
      }
    }
  }

  double MedianRatio()
  {
    std::sort(this->Ratios.begin(), this->Ratios.end());
    return this->Ratios.empty() ? 0 : this->Ratios[this->Ratios.size() / 2];
  }
};

void DrawScene(unsigned seed, bool gradientOpacity, bool transferImage, Stage& stage, Tally& tally)
{
  RandomScene scene(seed);
  const auto image = scene.MakeVolume();
  stage.SetImage(image);
  scene.SetFunctions(stage);
  if (gradientOpacity)
  {
    scene.SetGradientOpacity(stage);
  }
  if (transferImage)
  {
    scene.SetTransferImage(stage);
  }
  scene.SetCamera(stage);
  const std::array<double, 4> tolerances{ 0.25, 1, 4, 16 };
  const double tolerance = tolerances[static_cast<std::size_t>(scene.Whole(0, 3))] / 255;
  stage.Mapper->SetImageErrorTolerance(tolerance);
  stage.Mapper->SetMaximumNumberOfSlots(static_cast<unsigned>(scene.Whole(4, 60)));
  // One frame of an animation, with what is there, or a picture that is waited for.
  const bool interactive = scene.Chance(0.35);
  stage.Mapper->SetFrameTimeBudget(interactive ? 0.02 : 0);
  const int frames = interactive ? scene.Whole(1, 3) : 1;
  for (int i = 0; i < frames; ++i)
  {
    stage.Window->Render();
  }
  const auto source = SourceOfImage(image, BrickEdge, false);
  tally.Add(stage, *source, "scene " + std::to_string(seed));
}

} // namespace

class ErrorEstimate : public testing::TestWithParam<int>
{
};

// At least 99 of 100 pixels are estimated above their true error, and none is short of it by more
// than the tolerance; the median of estimate over error says what the estimate is worth.
TEST_P(ErrorEstimate, HoldsOnRandomScenes)
{
  Stage stage(Edge, Edge);
  stage.Mapper->SetBrickSize(BrickEdge);
  stage.Mapper->ErrorEstimateOn();
  Tally tally;
  // A thousand of the plain kind, half as many of the others.
  const int step = !TakesAll() ? 8 : GetParam() < BatchesWithoutGradientOpacity ? 1 : 2;
  for (int i = 0; i < ScenesPerBatch && !HasFatalFailure(); i += step)
  {
    DrawScene(static_cast<unsigned>(GetParam() * ScenesPerBatch + i),
      GetParam() >= BatchesWithoutGradientOpacity && GetParam() < BatchesWithoutImage,
      GetParam() >= BatchesWithoutImage, stage, tally);
  }
  std::printf("  %zu pixels, %zu (%.3f %%) below the error, short by %.3f tolerances at most (%s); "
              "median of estimate / error %.2f over %zu pixels that err; %zu incomplete pictures\n",
    tally.Pixels, tally.Below,
    100.0 * static_cast<double>(tally.Below) / static_cast<double>(tally.Pixels),
    tally.LargestShortage, tally.WorstScene.c_str(), tally.MedianRatio(), tally.Ratios.size(),
    tally.Incomplete);
  EXPECT_LE(static_cast<double>(tally.Below), 0.01 * static_cast<double>(tally.Pixels));
  EXPECT_LE(tally.LargestShortage, 1) << tally.WorstScene;
  EXPECT_GT(step * tally.Ratios.size(), 1000u);
  EXPECT_GT(step * tally.Incomplete, 10u);
  // Estimates of pieces are added, their errors cancel. Under images of values and gradients pieces
  // are bounded by whole rectangles of the image, and most pixels err by a hundredth of a
  // tolerance.
  EXPECT_LT(tally.MedianRatio(), GetParam() < BatchesWithoutImage ? 20 : 40);
}

INSTANTIATE_TEST_SUITE_P(Contract, ErrorEstimate, testing::Range(0, Batches));

TEST(ErrorEstimateImage, IsThereOnlyIfAskedForAndKnowsNothingOfFixedSteps)
{
  Stage stage(Edge, Edge);
  stage.SetImage(MakeImage({}));
  stage.SetTransfer(MakeTransfer(OpacityShape::Fog));
  stage.Look({ 1, 0.5, 0.2 });
  const std::vector<float> plain = stage.Draw();
  EXPECT_TRUE(EstimateOf(stage).empty());
  stage.Mapper->ErrorEstimateOn();
  // Asking changes nothing in the picture.
  EXPECT_TRUE(AreImagesIdentical(plain, stage.Draw()));
  const std::vector<float> estimate = EstimateOf(stage);
  ASSERT_EQ(estimate.size(), std::size_t{ Edge } * Edge);
  EXPECT_LT(*std::max_element(estimate.begin(), estimate.end()), 0.02f);
  stage.Mapper->SetImageErrorTolerance(0);
  stage.Mapper->SetSampleDistance(0.5f);
  stage.Draw();
  for (const float e : EstimateOf(stage))
  {
    ASSERT_EQ(e, 1.0f);
  }
}

// A medium of one extinction and one colour, in which rays end before it does: what is behind is
// taken to be as thick as what was met.
TEST(EndedRays, TakeTheirRestToBeLikeWhatTheyMet)
{
  constexpr double tolerance = 128.0 / 255;
  constexpr double left = tolerance / 4; // when they end
  constexpr double opacity = 0.02;       // per voxel
  constexpr std::array<double, 3> color{ 0.9, 0.5, 0.2 };
  constexpr std::size_t middle = 4 * (Edge * Edge / 2 + Edge / 2);
  Stage stage(Edge, Edge);
  stage.Mapper->SetBrickSize(BrickEdge);
  stage.Mapper->ErrorEstimateOn();
  stage.Mapper->SetImageErrorTolerance(tolerance);
  for (const int length : { 112, 128, 200, 400 })
  {
    ImageOptions options;
    options.Dimensions = { length + 1, 12, 12 };
    stage.SetImage(MakeImage(options));
    stage.SetTransfer({ { { 0, opacity }, { 255, opacity } },
      { { 0, color[0], color[1], color[2] }, { 255, color[0], color[1], color[2] } } });
    stage.LookFrom({ -100, 5.5, 5.5 }, { 0, 5.5, 5.5 }, 1, 600, 1);
    const std::vector<float> picture = stage.Draw();
    const double truth = 1 - std::pow(1 - opacity, length);
    const auto drawn = static_cast<double>(picture[middle + 3]);
    ASSERT_LT(1 - truth, left); // so they do end
    EXPECT_NEAR(drawn, truth, 0.1 * left) << length;
    for (std::size_t c = 0; c < 3; ++c)
    {
      // Colours of 16 bits.
      EXPECT_NEAR(static_cast<double>(picture[middle + c]), color[c] * drawn, 2e-5) << length;
    }
    // Nothing more might have come.
    EXPECT_GE(static_cast<double>(EstimateOf(stage)[middle / 4]), 0.7 * left * (1 - color[2]));
  }
}
