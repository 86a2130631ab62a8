// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "BenchMeasure.h"

#include "BenchClock.h"
#include "ErrorCapture.h"
#include "SelfOutput.h"
#include "vtkOutOfCoreVolumeMapper.h"

#include <algorithm>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <fstream>
#include <nlohmann/json.hpp>
#include <vtkCamera.h>
#include <vtkFixedPointRayCastImage.h>
#include <vtkFixedPointVolumeRayCastMapper.h>
#include <vtkGPUVolumeRayCastMapper.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkRenderWindow.h>
#include <vtkRenderer.h>
#include <vtkUnsignedCharArray.h>
#include <vtkVolume.h>
#include <vtkVolumeProperty.h>

namespace teravox::program
{
namespace
{

std::string ResultFile(const std::string& work)
{
  return work + "/points.json";
}

struct Duration
{
  double Seconds = 0;
  double CPUSeconds = 0; ///< of all threads
};

/// A window with the scene and one of the mappers.
class Stage
{
public:
  explicit Stage(const std::string& mapper)
    : Name(mapper)
  {
  }

  Status SetUp(const BenchScene& scene, const BenchVolume& data, const std::array<int, 2>& size)
  {
    this->Voxel = data.SmallestSpacing();
    this->Size = size;
    if (IsOurs(this->Name))
    {
      this->Own = vtkSmartPointer<vtkOutOfCoreVolumeMapper>::New();
      this->Own->SetGPUMemoryBudget(std::uint64_t{ 2 } << 30);
      this->Own->SetHostMemoryBudget(std::uint64_t{ 2 } << 30);
      if (this->Name == OwnMapper)
      {
        this->Own->SetMaximumLevel(0); // what VTK's mappers draw
      }
      this->Mapper = this->Own;
    }
    else if (this->Name == FixedPointMapper)
    {
      this->FixedPoint = vtkSmartPointer<vtkFixedPointVolumeRayCastMapper>::New();
      this->FixedPoint->SetAutoAdjustSampleDistances(0);
      this->Mapper = this->FixedPoint;
    }
    else
    {
      this->GPU = vtkSmartPointer<vtkGPUVolumeRayCastMapper>::New();
      this->GPU->SetAutoAdjustSampleDistances(0);
      this->GPU->SetUseJittering(0);
      this->GPU->SetMaxMemoryInBytes(vtkIdType{ 4 } << 30);
      this->GPU->SetMaxMemoryFraction(1.0F);
      this->Mapper = this->GPU;
    }
    this->Mapper->SetInputDataObject(ToImage(data, this->Name == WideGPUMapper));
    program::SetUp(scene, data, this->Volume->GetProperty());
    this->Volume->SetMapper(this->Mapper);
    this->Renderer->SetBackground(0, 0, 0);
    this->Renderer->SetActiveCamera(this->Camera);
    this->Renderer->AddVolume(this->Volume);
    this->Window->SetOffScreenRendering(1);
    this->Window->SetMultiSamples(0);
    this->Window->SetSize(size[0], size[1]);
    this->Window->AddRenderer(this->Renderer);
    return program::SetUp(
      scene, data, static_cast<double>(size[0]) / size[1], this->ReferenceCamera);
  }

  void SetSetting(double setting)
  {
    if (this->Own)
    {
      this->Own->SetImageErrorTolerance(setting / 255);
    }
    else if (this->GPU)
    {
      this->GPU->SetSampleDistance(static_cast<float>(setting * this->Voxel));
    }
    else
    {
      this->FixedPoint->SetSampleDistance(static_cast<float>(setting * this->Voxel));
    }
  }

  /// Draws from the reference camera turned by some degrees.
  Duration Draw(double degrees)
  {
    this->Camera->DeepCopy(this->ReferenceCamera);
    this->Camera->Azimuth(degrees);
    const BenchClock clock;
    this->Window->Render();
    this->Window->WaitForCompletion();
    return { clock.Seconds(), clock.CPUSeconds() };
  }

  bool IsConverged() { return !this->Own || this->Own->IsConverged(); }

  /// Samples per pixel, and how many of them contribute.
  void Count(BenchPoint& point)
  {
    if (this->Own)
    {
      this->Own->CountSamplesOn();
      this->Draw(-0.1);
      this->Own->CountSamplesOff();
      const double pixels = static_cast<double>(this->Size[0]) * this->Size[1];
      point.SamplesPerPixel = static_cast<double>(this->Own->GetNumberOfSamples()) / pixels;
      point.ContributingPerPixel =
        static_cast<double>(this->Own->GetNumberOfContributingSamples()) / pixels;
    }
  }

  /// Red, green, blue of the last frame, as exact as they can be had: our mapper's in float, VTK's
  /// fixed-point mapper's in 15 bits, VTK's GPU mapper's as the window has them in 8 bits.
  std::vector<float> Picture()
  {
    return this->Own ? this->OwnPicture()
      : this->GPU    ? this->WindowPicture()
                     : this->FixedPointPicture();
  }

private:
  std::vector<float> OwnPicture()
  {
    std::vector<float> picture;
    vtkNew<vtkImageData> image;
    if (this->Own->GetColorAccumulator(image))
    {
      const auto* rgba = static_cast<const float*>(image->GetScalarPointer());
      for (vtkIdType i = 0; i < image->GetNumberOfPoints(); ++i)
      {
        picture.insert(picture.end(), rgba + 4 * i, rgba + 4 * i + 3);
      }
    }
    return picture;
  }

  /// The rays as they were cast, not the window's picture: on its way there VTK 9.1 stretches n
  /// pixels over n - 1 and interpolates, which costs more than all the rest.
  std::vector<float> FixedPointPicture()
  {
    std::vector<float> picture(3 * static_cast<std::size_t>(this->Size[0]) * this->Size[1], 0.0F);
    vtkFixedPointRayCastImage* image = this->FixedPoint->GetRayCastImage();
    const int* used = image->GetImageInUseSize();
    const int* stored = image->GetImageMemorySize();
    const int* origin = image->GetImageOrigin();
    constexpr float one = 32767;
    for (int y = 0; y < used[1]; ++y)
    {
      for (int x = 0; x < used[0]; ++x)
      {
        const unsigned short* rgba = image->GetImage() + 4 * (std::ptrdiff_t{ y } * stored[0] + x);
        const std::size_t at = 3 *
          (static_cast<std::size_t>(y + origin[1]) * this->Size[0] +
            static_cast<std::size_t>(x + origin[0]));
        for (std::size_t c = 0; c < 3; ++c)
        {
          picture.at(at + c) = std::min(static_cast<float>(rgba[c]) / one, 1.0F);
        }
      }
    }
    return picture;
  }

  std::vector<float> WindowPicture()
  {
    std::vector<float> picture;
    vtkNew<vtkUnsignedCharArray> pixels;
    this->Window->GetRGBACharPixelData(0, 0, this->Size[0] - 1, this->Size[1] - 1, 0, pixels);
    for (vtkIdType i = 0; i < pixels->GetNumberOfValues(); ++i)
    {
      if (i % 4 != 3)
      {
        picture.push_back(static_cast<float>(pixels->GetValue(i)) / 255.0F);
      }
    }
    return picture;
  }

  const std::string Name;
  double Voxel = 1;
  std::array<int, 2> Size{};
  vtkNew<vtkCamera> ReferenceCamera;
  vtkNew<vtkCamera> Camera;
  vtkNew<vtkRenderWindow> Window;
  vtkNew<vtkRenderer> Renderer;
  vtkNew<vtkVolume> Volume;
  vtkSmartPointer<vtkVolumeMapper> Mapper;
  vtkSmartPointer<vtkOutOfCoreVolumeMapper> Own;
  vtkSmartPointer<vtkGPUVolumeRayCastMapper> GPU;
  vtkSmartPointer<vtkFixedPointVolumeRayCastMapper> FixedPoint;
};

/// The camera turns a little before each frame, so that nothing of the one before can be reused;
/// the last one is drawn from the reference camera.
BenchPoint MeasurePoint(Stage& stage, const BenchErrorOptions& options, double setting)
{
  BenchPoint point;
  point.Setting = setting;
  stage.SetSetting(setting);
  point.FirstSeconds = stage.Draw(0.1 * options.Frames).Seconds;
  std::vector<double> seconds;
  std::vector<double> cpuSeconds;
  for (int frame = options.Frames - 1; frame >= 0; --frame)
  {
    const Duration duration = stage.Draw(0.1 * frame);
    seconds.push_back(duration.Seconds);
    cpuSeconds.push_back(duration.CPUSeconds);
  }
  point.MedianSeconds = MedianOf(seconds);
  point.CPUSeconds = MedianOf(cpuSeconds);
  return point;
}

Status WritePicture(const std::vector<float>& picture, const std::string& file)
{
  std::ofstream stream(file, std::ios::binary);
  stream.write(reinterpret_cast<const char*>(picture.data()),
    static_cast<std::streamsize>(picture.size() * sizeof(float)));
  stream.close();
  return stream ? Status() : Status(StatusCode::InputOutput, file + " can't be written.");
}

} // namespace

std::string VolumeFile(const std::string& work)
{
  return work + "/volume";
}

Result<std::vector<float>> ReadPicture(const std::string& file, const std::array<int, 2>& size)
{
  std::vector<float> picture(3 * static_cast<std::size_t>(size[0]) * size[1]);
  std::ifstream stream(file, std::ios::binary);
  stream.read(reinterpret_cast<char*>(picture.data()),
    static_cast<std::streamsize>(picture.size() * sizeof(float)));
  return stream ? Result<std::vector<float>>(std::move(picture))
                : Status(StatusCode::InputOutput, file + " can't be read.");
}

Status Measure(const BenchErrorOptions& options, const BenchTask& task)
{
  const ErrorCapture errors;
  const auto scenes = FindBenchScenes({ task.Scene });
  const auto volume = ReadBenchVolume(VolumeFile(options.Work));
  if (!scenes.Ok() || !volume.Ok())
  {
    return scenes.Ok() ? volume.GetStatus() : scenes.GetStatus();
  }
  Stage stage(task.Mapper);
  Status status = stage.SetUp(scenes.Value().front(), volume.Value(), options.Size);
  if (!status.Ok())
  {
    return status;
  }
  nlohmann::json json{ { "points", nlohmann::json::array() },
    { "left_out", nlohmann::json::array() } };
  bool tooSlow = false;
  for (std::size_t i = 0; i < task.Settings.size(); ++i)
  {
    if (tooSlow)
    {
      json["left_out"].push_back(task.Settings[i]);
      continue;
    }
    BenchPoint point = MeasurePoint(stage, options, task.Settings[i]);
    tooSlow = point.MedianSeconds > options.Longest && !IsOurs(task.Mapper);
    const bool converged = stage.IsConverged();
    const std::string file = fmt::format("{}/picture-{}", options.Work, i);
    status = WritePicture(stage.Picture(), file);
    stage.Count(point);
    if (status.Ok() && errors.HasError())
    {
      status = { StatusCode::InputOutput, errors.First() };
    }
    if (!status.Ok())
    {
      return status;
    }
    json["points"].push_back({ { "setting", point.Setting }, { "first", point.FirstSeconds },
      { "median", point.MedianSeconds }, { "cpu", point.CPUSeconds }, { "converged", converged },
      { "samples", point.SamplesPerPixel }, { "contributing", point.ContributingPerPixel },
      { "picture", file } });
  }
  std::ofstream stream(ResultFile(options.Work));
  stream << json;
  stream.close();
  return stream ? Status() : Status(StatusCode::InputOutput, "The work folder can't be written.");
}

Result<BenchTaskResult> MeasureApart(const BenchErrorOptions& options, const BenchTask& task)
{
  const Status status = OutputOfSelf(
    { "bench", "error", "--only", task.Scene, "--mappers", task.Mapper, "--settings",
      fmt::format("{}", fmt::join(task.Settings, ",")), "--work", options.Work, "--size",
      std::to_string(options.Size[0]), std::to_string(options.Size[1]), "--frames",
      std::to_string(options.Frames), "--longest", fmt::format("{}", options.Longest) })
                          .GetStatus();
  if (!status.Ok())
  {
    return status;
  }
  std::ifstream stream(ResultFile(options.Work));
  const auto json = nlohmann::json::parse(stream, nullptr, false);
  if (json.is_discarded())
  {
    return Status(StatusCode::InputOutput, "A process of its own left no result.");
  }
  BenchTaskResult result;
  for (const auto& entry : json["points"])
  {
    BenchPoint point;
    point.Mapper = task.Mapper;
    point.Setting = entry["setting"];
    point.FirstSeconds = entry["first"];
    point.MedianSeconds = entry["median"];
    point.CPUSeconds = entry["cpu"];
    point.Converged = entry["converged"];
    point.SamplesPerPixel = entry["samples"];
    point.ContributingPerPixel = entry["contributing"];
    point.Picture = entry["picture"];
    result.Points.push_back(point);
  }
  for (const auto& entry : json["left_out"])
  {
    result.LeftOut.push_back({ task.Mapper, entry.get<double>() });
  }
  return result;
}

} // namespace teravox::program
