// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "BenchPlots.h"

#include "ErrorCapture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <limits>
#include <vtkAxis.h>
#include <vtkChartLegend.h>
#include <vtkChartXY.h>
#include <vtkContextActor.h>
#include <vtkContextScene.h>
#include <vtkDoubleArray.h>
#include <vtkNew.h>
#include <vtkPNGWriter.h>
#include <vtkPen.h>
#include <vtkPlotPoints.h>
#include <vtkRenderWindow.h>
#include <vtkRenderer.h>
#include <vtkStringArray.h>
#include <vtkTable.h>
#include <vtkTextProperty.h>
#include <vtkWindowToImageFilter.h>

namespace teravox::program
{
namespace
{

struct Curve
{
  const char* Mapper;
  const char* Label;
  std::array<unsigned char, 3> Color;
  int Marker;
};

constexpr std::array<Curve, 5> Curves{ {
  { OwnMapper, "Teravox", { 200, 40, 30 }, vtkPlotPoints::CIRCLE },
  { LevelsMapper, "Teravox, with levels", { 240, 150, 60 }, vtkPlotPoints::DIAMOND },
  { GPUMapper, "VTK GPU", { 30, 90, 200 }, vtkPlotPoints::SQUARE },
  { WideGPUMapper, "VTK GPU, 16 bits", { 110, 150, 220 }, vtkPlotPoints::DIAMOND },
  { FixedPointMapper, "VTK fixed point", { 20, 140, 60 }, vtkPlotPoints::CROSS },
} };

/// Errors below this (in 1/255) are drawn here: a logarithmic axis has no 0.
constexpr double SmallestError = 1e-3;

/// A logarithmic axis over whole decades.
void SetUpAxis(vtkAxis* axis, const std::string& title, double low, double high)
{
  axis->SetTitle(title);
  axis->SetLogScale(true);
  const int first = static_cast<int>(std::floor(std::log10(low)));
  const int last = static_cast<int>(std::ceil(std::log10(high) + 1e-9));
  axis->SetBehavior(vtkAxis::FIXED);
  vtkNew<vtkDoubleArray> places;
  vtkNew<vtkStringArray> labels;
  for (int decade = first; decade <= last; ++decade)
  {
    places->InsertNextValue(decade);
    labels->InsertNextValue(fmt::format("{:g}", std::pow(10, decade)));
    for (int step = 2; step < 10 && decade < last; ++step)
    {
      places->InsertNextValue(decade + std::log10(step));
      labels->InsertNextValue("");
    }
  }
  axis->SetCustomTickPositions(places, labels);
  axis->SetUnscaledRange(std::pow(10, first), std::pow(10, last));
  axis->GetTitleProperties()->SetFontSize(16);
  axis->GetLabelProperties()->SetFontSize(14);
}

} // namespace

Status WritePlot(const BenchSceneResult& result, const std::string& file)
{
  const ErrorCapture errors;
  vtkNew<vtkChartXY> chart;
  chart->SetTitle(result.Scene.Name + ": " + result.Scene.Description);
  chart->GetTitleProperties()->SetFontSize(18);
  chart->SetShowLegend(true);
  chart->GetLegend()->SetHorizontalAlignment(vtkChartLegend::RIGHT);
  chart->GetLegend()->SetVerticalAlignment(vtkChartLegend::TOP);
  std::array<double, 2> x{ std::numeric_limits<double>::infinity(), 0 };
  std::array<double, 2> y = x;
  for (const Curve& curve : Curves)
  {
    vtkNew<vtkDoubleArray> error;
    error->SetName("error");
    vtkNew<vtkDoubleArray> time;
    time->SetName(curve.Label);
    for (const BenchPoint& point : result.Points)
    {
      if (point.Mapper == curve.Mapper)
      {
        const double e = std::max(255 * point.Errors.Percentile999, SmallestError);
        const double t = 1e3 * point.MedianSeconds;
        error->InsertNextValue(e);
        time->InsertNextValue(t);
        x = { std::min(x[0], e), std::max(x[1], e) };
        y = { std::min(y[0], t), std::max(y[1], t) };
      }
    }
    if (error->GetNumberOfValues() == 0)
    {
      continue;
    }
    vtkNew<vtkTable> table;
    table->AddColumn(error);
    table->AddColumn(time);
    auto* plot = vtkPlotPoints::SafeDownCast(chart->AddPlot(
      error->GetNumberOfValues() == 1 ? vtkChart::POINTS : vtkChart::LINE)); // a line needs two
    plot->SetInputData(table, 0, 1);
    plot->SetColor(curve.Color[0], curve.Color[1], curve.Color[2], 255);
    plot->SetWidth(2);
    plot->SetMarkerStyle(curve.Marker);
    plot->SetMarkerSize(9);
  }
  if (!(x[0] <= x[1]))
  {
    return {}; // nothing was measured
  }
  SetUpAxis(chart->GetAxis(vtkAxis::BOTTOM), "error, 99.9th percentile [1/255]", x[0], x[1]);
  SetUpAxis(chart->GetAxis(vtkAxis::LEFT), "time per frame [ms]", y[0], y[1]);

  vtkNew<vtkContextActor> actor;
  actor->GetScene()->AddItem(chart);
  vtkNew<vtkRenderer> renderer;
  renderer->SetBackground(1, 1, 1);
  renderer->AddActor(actor);
  actor->GetScene()->SetRenderer(renderer);
  vtkNew<vtkRenderWindow> window;
  window->SetOffScreenRendering(1);
  window->SetMultiSamples(4);
  window->SetSize(800, 600);
  window->AddRenderer(renderer);
  window->Render();
  vtkNew<vtkWindowToImageFilter> picture;
  picture->SetInput(window);
  picture->ReadFrontBufferOff();
  vtkNew<vtkPNGWriter> writer;
  writer->SetInputConnection(picture->GetOutputPort());
  writer->SetFileName(file.c_str());
  writer->Write();
  return errors.HasError() ? Status(StatusCode::InputOutput, errors.First()) : Status();
}

} // namespace teravox::program
