// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// Order of convergence: without error control (ImageErrorTolerance = 0) the error of a picture
// falls with the square of SampleDistance. Measured against the reference integrator, over all
// pixels and channels. More isn't possible: steps cross the faces of interpolation cells, where the
// field's derivative jumps. The steps end before the rounding of the accumulators shows (3e-7 RMS).
#include "Scene.h"
#include "vtkOutOfCoreVolumeMapper.h"

#include <cmath>
#include <cstdio>
#include <gtest/gtest.h>
#include <vtkCamera.h>
#include <vtkColorTransferFunction.h>
#include <vtkImageData.h>
#include <vtkPiecewiseFunction.h>
#include <vtkRenderer.h>
#include <vtkVolumeProperty.h>

using namespace teravox;
using namespace teravox::test;

namespace
{

constexpr double Low = -1.3;
constexpr double High = 2.9;

// Smooth and nowhere constant, so that no voxel has an error of zero for free.
double WaveField(double x, double y, double z)
{
  return 0.5 + 0.24 * std::sin(5.1 * x + 1.7 * z + 0.3) + 0.22 * std::cos(4.3 * y - 2.9 * x * z);
}

// Opacity and colour without a kink inside the data's range.
void SetSmooth(Stage& stage)
{
  stage.SetTransfer({ {}, {}, 6 });
  stage.Opacity->AddPoint(Low, 0.02, 0.5, 0.3); // Hermite's curve up to the next point
  stage.Opacity->AddPoint(High, 0.5);
  stage.Color->AddRGBPoint(Low, 0.9, 0.15, 0.1);
  stage.Color->AddRGBPoint(High, 0.1, 0.8, 1.0);
}

// Linear between knots that are no nodes of the transfer table and lie at different values for
// opacity and colour.
void SetKinked(Stage& stage)
{
  const auto at = [](double t) { return Low + t * (High - Low); };
  stage.SetTransfer({ { { at(0), 0.01 }, { at(0.2713), 0.03 }, { at(0.4142), 0.42 },
                        { at(0.5577), 0.05 }, { at(0.7389), 0.3 }, { at(1), 0.08 } },
    { { at(0), 0.9, 0.2, 0.1 }, { at(0.3571), 0.1, 0.9, 0.3 }, { at(0.6180), 0.8, 0.8, 0.1 },
      { at(1), 0.2, 0.3, 1 } },
    6 });
}

// The slope of the line that fits log(error) over log(step) best.
double Order(const std::vector<double>& steps, const std::vector<double>& errors)
{
  double sx = 0;
  double sy = 0;
  double sxx = 0;
  double sxy = 0;
  for (std::size_t i = 0; i < steps.size(); ++i)
  {
    const double x = std::log(steps[i]);
    const double y = std::log(errors[i]);
    sx += x;
    sy += y;
    sxx += x * x;
    sxy += x * y;
  }
  const auto n = static_cast<double>(steps.size());
  return (n * sxy - sx * sy) / (n * sxx - sx * sx);
}

} // namespace

class OrderOfConvergence : public testing::TestWithParam<bool>
{
};

TEST_P(OrderOfConvergence, IsTwo)
{
  ImageOptions options;
  options.Type = ScalarType::Float32;
  options.Dimensions = { 24, 22, 9 };
  options.Spacing = { 1, 1, 5 };
  options.Low = Low;
  options.High = High;
  const auto image = MakeImage(options, WaveField);
  const auto source = SourceOfImage(image, 16, false);
  Stage stage(40, 40);
  stage.Mapper->SetBrickSize(16);
  stage.Mapper->SetMaximumLevel(0);
  stage.Mapper->SetImageErrorTolerance(0);
  stage.SetImage(image);
  if (GetParam())
  {
    SetKinked(stage);
  }
  else
  {
    SetSmooth(stage);
  }
  stage.Look({ 0.6, 1, -0.35 }, 0.85);
  stage.Renderer->GetActiveCamera()->SetWindowCenter(0.35, -0.2);
  const StageTruth truth(stage, *source);
  TruthScene scene = truth.Scene();
  scene.Tolerance = 1e-9;
  const std::vector<float> exact = ToFloat(RenderTruth(scene, AllPixels(scene.Camera)));

  std::vector<double> steps;
  std::vector<double> errors;
  for (double step = 2; step > 0.05; step *= 0.5)
  {
    stage.Mapper->SetSampleDistance(static_cast<float>(step));
    const std::vector<float> picture = stage.Draw();
    ASSERT_TRUE(stage.Mapper->IsConverged());
    ASSERT_EQ(picture.size(), exact.size());
    const ImageDifference difference = CompareImages(picture, exact);
    steps.push_back(step);
    errors.push_back(difference.Rms);
    std::printf("  step %.5f: RMS %.3e, max %.3e", step, difference.Rms, difference.Max);
    if (steps.size() > 1)
    {
      std::printf(", order %.2f", std::log2(errors[errors.size() - 2] / difference.Rms));
    }
    std::printf("\n");
  }
  std::printf("  order %.3f\n", Order(steps, errors));
  EXPECT_GE(Order(steps, errors), 2 - 0.15);
}

INSTANTIATE_TEST_SUITE_P(Contract, OrderOfConvergence, testing::Bool(),
  [](const auto& test) { return std::string(test.param ? "Kinked" : "Smooth"); });
