// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "BenchClock.h"
#include "Commands.h"
#include "ErrorCapture.h"
#include "SelfOutput.h"
#include "View.h"
#include "vtkBrickSource.h"
#include "vtkOutOfCoreTransferFunction.h"
#include "vtkOutOfCoreVolumeMapper.h"
#include "vtkProceduralVolumeSource.h"

#include <array>
#include <cstdio>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>
#include <vtkCamera.h>
#include <vtkFixedPointVolumeRayCastMapper.h>
#include <vtkGPUVolumeRayCastMapper.h>
#include <vtkNew.h>
#include <vtkRenderWindow.h>
#include <vtkRenderer.h>
#include <vtkVolume.h>
#include <vtkVolumeProperty.h>

namespace teravox::program
{
namespace
{

/// One cell of the table. Each is measured in a process of its own: VTK's GPU mapper is slower for
/// the rest of a process that has drawn shaded once.
struct Measurement
{
  std::string Mapper; ///< teravox, vtk-gpu, vtk-fixed-point
  int VolumeSize = 256;
  bool Shade = false;
  double FirstSeconds = 0.0;
  double MedianSeconds = 0.0;
};

constexpr std::array<const char*, 3> Mappers{ "teravox", "vtk-gpu", "vtk-fixed-point" };

std::string NameOf(const Measurement& m)
{
  return fmt::format("{}:{}:{}", m.Mapper, m.VolumeSize, m.Shade ? "shaded" : "unshaded");
}

vtkSmartPointer<vtkVolumeMapper> MakeMapper(const std::string& name)
{
  if (name == "vtk-gpu")
  {
    const auto mapper = vtkSmartPointer<vtkGPUVolumeRayCastMapper>::New();
    mapper->SetAutoAdjustSampleDistances(0);
    mapper->SetSampleDistance(1.0F);
    mapper->SetMaxMemoryInBytes(vtkIdType{ 4 } << 30);
    mapper->SetMaxMemoryFraction(1.0F);
    return mapper.GetPointer();
  }
  if (name == "vtk-fixed-point")
  {
    const auto mapper = vtkSmartPointer<vtkFixedPointVolumeRayCastMapper>::New();
    mapper->SetAutoAdjustSampleDistances(0);
    mapper->SetSampleDistance(1.0F);
    return mapper.GetPointer();
  }
  return vtkSmartPointer<vtkOutOfCoreVolumeMapper>::New().GetPointer();
}

double SecondsOf(vtkRenderWindow* window)
{
  const BenchClock clock;
  window->Render();
  window->WaitForCompletion();
  return clock.Seconds();
}

/// Draws a turning volume; the first frame includes all preparations, the median doesn't.
Status Measure(const BenchOptions& options, Measurement& m)
{
  ErrorCapture errors;
  vtkNew<vtkProceduralVolumeSource> source;
  source->SetFunction(vtkProceduralVolumeSource::SHELLS);
  source->SetDimensions(m.VolumeSize, m.VolumeSize, m.VolumeSize);
  source->SetLevel(0);
  vtkNew<vtkVolume> volume;
  vtkOutOfCoreTransferFunction::MakeAutomatic(source->GetBrickSource(), volume->GetProperty());
  volume->GetProperty()->SetShade(m.Shade ? 1 : 0);
  const vtkSmartPointer<vtkVolumeMapper> mapper = MakeMapper(m.Mapper);
  mapper->SetInputConnection(source->GetOutputPort());
  source->Update();
  volume->SetMapper(mapper);
  vtkNew<vtkRenderer> renderer;
  renderer->AddVolume(volume);
  vtkNew<vtkRenderWindow> window;
  window->SetOffScreenRendering(1);
  window->SetMultiSamples(0);
  window->SetSize(options.Size[0], options.Size[1]);
  window->AddRenderer(renderer);
  vtkCamera* camera = renderer->GetActiveCamera();
  Status placed = PlaceCamera(camera, CameraOptions(), volume->GetBounds(),
    static_cast<double>(options.Size[0]) / options.Size[1], 1.0);
  if (!placed.Ok())
  {
    return placed;
  }
  m.FirstSeconds = SecondsOf(window);
  std::vector<double> seconds;
  for (int i = 0; i < options.Frames; ++i)
  {
    camera->Azimuth(1.0);
    seconds.push_back(SecondsOf(window));
  }
  m.MedianSeconds = MedianOf(seconds);
  return errors.HasError() ? Status(StatusCode::InputOutput, errors.First()) : Status();
}

Result<Measurement> MeasurementOf(const std::string& name)
{
  for (const char* mapper : Mappers)
  {
    for (const bool shade : { false, true })
    {
      Measurement m;
      m.Mapper = mapper;
      m.Shade = shade;
      const std::string prefix = m.Mapper + ":";
      const std::string suffix = shade ? ":shaded" : ":unshaded";
      if (name.size() > prefix.size() + suffix.size() &&
        name.compare(0, prefix.size(), prefix) == 0 &&
        name.compare(name.size() - suffix.size(), suffix.size(), suffix) == 0)
      {
        m.VolumeSize = std::atoi(name.c_str() + prefix.size());
        return m;
      }
    }
  }
  return Status(StatusCode::InvalidArgument, fmt::format("'{}' names no measurement.", name));
}

/// Runs one measurement in a process of its own.
Status MeasureApart(const BenchOptions& options, Measurement& m)
{
  const auto text =
    OutputOfSelf({ "bench", "--only", NameOf(m), "--size", std::to_string(options.Size[0]),
      std::to_string(options.Size[1]), "--frames", std::to_string(options.Frames) });
  if (!text.Ok())
  {
    return text.GetStatus();
  }
  if (std::sscanf(text.Value().c_str(), "%lf %lf", &m.FirstSeconds, &m.MedianSeconds) != 2)
  {
    return { StatusCode::InputOutput, fmt::format("The measurement {} failed.", NameOf(m)) };
  }
  return {};
}

void PrintTable(const std::vector<Measurement>& all)
{
  fmt::print(
    "{:<16} {:>6} {:>9} {:>12} {:>12}\n", "mapper", "voxels", "", "first [ms]", "median [ms]");
  for (const Measurement& m : all)
  {
    fmt::print("{:<16} {:>5}^3 {:>9} {:>12.0f} {:>12.1f}\n", m.Mapper, m.VolumeSize,
      m.Shade ? "shaded" : "unshaded", 1e3 * m.FirstSeconds, 1e3 * m.MedianSeconds);
  }
}

void PrintJson(const BenchOptions& options, const std::vector<Measurement>& all)
{
  nlohmann::ordered_json json;
  json["size"] = options.Size;
  json["frames"] = options.Frames;
  for (const Measurement& m : all)
  {
    json["measurements"].push_back(
      { { "mapper", m.Mapper }, { "voxels_per_axis", m.VolumeSize }, { "shaded", m.Shade },
        { "first_seconds", m.FirstSeconds }, { "median_seconds", m.MedianSeconds } });
  }
  fmt::print("{}\n", json.dump(2));
}

} // namespace

Status RunBench(const BenchOptions& options)
{
  Status display = CheckDisplay();
  if (!display.Ok())
  {
    return display;
  }
  if (!options.Only.empty())
  {
    auto m = MeasurementOf(options.Only);
    Status status = m.Ok() ? Measure(options, m.Value()) : m.GetStatus();
    if (status.Ok())
    {
      fmt::print("{} {}\n", m.Value().FirstSeconds, m.Value().MedianSeconds);
    }
    return status;
  }
  std::vector<Measurement> all;
  for (const int size : options.Sizes)
  {
    for (const bool shade : { false, true })
    {
      for (const char* mapper : Mappers)
      {
        Measurement m;
        m.Mapper = mapper;
        m.VolumeSize = size;
        m.Shade = shade;
        Status status = MeasureApart(options, m);
        if (!status.Ok())
        {
          return status;
        }
        all.push_back(m);
      }
    }
  }
  if (options.Json)
  {
    PrintJson(options, all);
  }
  else
  {
    PrintTable(all);
  }
  return {};
}

} // namespace teravox::program
