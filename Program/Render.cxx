// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "BrickSource.h"
#include "ByteCount.h"
#include "Commands.h"
#include "ErrorCapture.h"
#include "View.h"
#include "VolumeInput.h"
#include "vtkBrickSource.h"
#include "vtkOutOfCoreTransferFunction.h"
#include "vtkOutOfCoreVolumeMapper.h"

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fmt/format.h>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <unistd.h>
#include <vtkCamera.h>
#include <vtkErrorCode.h>
#include <vtkNew.h>
#include <vtkPNGWriter.h>
#include <vtkRenderWindow.h>
#include <vtkRenderer.h>
#include <vtkVolume.h>
#include <vtkVolumeProperty.h>
#include <vtkWindowToImageFilter.h>

namespace teravox::program
{
namespace
{

/// Can the file be written? Asked before minutes are spent on what goes into it.
Status CheckWritable(const std::string& fileName)
{
  std::filesystem::path folder = std::filesystem::path(fileName).parent_path();
  if (folder.empty())
  {
    folder = ".";
  }
  std::error_code error;
  if (!std::filesystem::is_directory(folder, error))
  {
    return { StatusCode::InputOutput,
      fmt::format("{} can't be written: the folder {} doesn't exist.", fileName, folder.string()) };
  }
  const bool exists = std::filesystem::exists(fileName, error);
  if (std::filesystem::is_directory(fileName, error) ||
    access(exists ? fileName.c_str() : folder.c_str(), W_OK) != 0)
  {
    return { StatusCode::InputOutput, fmt::format("{} can't be written.", fileName) };
  }
  return {};
}

nlohmann::ordered_json Statistics(const RenderOptions& options, vtkOutOfCoreVolumeMapper* mapper)
{
  nlohmann::ordered_json json;
  json["volume"] = options.Volume.Name;
  json["picture"] = options.Output;
  json["size"] = options.Size;
  json["converged"] = mapper->IsConverged();
  json["time_to_first_picture"] = mapper->GetTimeToFirstPicture();
  json["time_to_converged"] = mapper->GetTimeToConverged();
  json["bricks_loaded"] = mapper->GetNumberOfBricksLoaded();
  json["failed_bricks"] = mapper->GetNumberOfFailedBricks();
  json["missing_bricks"] = mapper->GetNumberOfMissingBricks();
  json["evictions"] = mapper->GetNumberOfEvictions();
  json["passes"] = mapper->GetNumberOfPasses();
  json["atlas_slots"] = mapper->GetNumberOfSlots();
  json["bytes_read"] = mapper->GetBytesRead();
  json["bytes_uploaded"] = mapper->GetBytesUploaded();
  json["gpu_memory_used"] = mapper->GetGPUMemoryUsed();
  json["gpu_memory_peak"] = mapper->GetPeakGPUMemoryUsed();
  json["gpu_memory_budget"] = mapper->GetEffectiveGPUMemoryBudget();
  json["host_memory_used"] = mapper->GetHostMemoryUsed();
  json["host_memory_budget"] = mapper->GetEffectiveHostMemoryBudget();
  json["addressing_memory_used"] = mapper->GetAddressingMemoryUsed();
  json["marcher"] = mapper->IsMarcherNative() ? "native" : "gpu";
  json["texture_size"] = mapper->GetMaximumTextureSize();
  return json;
}

void PrintSummary(const nlohmann::ordered_json& stats)
{
  const auto bytes = [&](const char* name)
  { return FormatByteCount(stats.at(name).get<double>()); };
  fmt::print("{}: first picture {}, converged {}\n  {} bricks, {} read, {} uploaded\n  GPU memory "
             "{} of {}, host memory {} of {}\n",
    stats.at("picture").get<std::string>(),
    FormatDuration(stats.at("time_to_first_picture").get<double>()),
    FormatDuration(stats.at("time_to_converged").get<double>()),
    stats.at("bricks_loaded").get<long long>(), bytes("bytes_read"), bytes("bytes_uploaded"),
    bytes("gpu_memory_used"), bytes("gpu_memory_budget"), bytes("host_memory_used"),
    bytes("host_memory_budget"));
}

Status WritePicture(vtkRenderWindow* window, const std::string& fileName)
{
  vtkNew<vtkWindowToImageFilter> picture;
  picture->SetInput(window);
  picture->SetInputBufferTypeToRGB();
  picture->ShouldRerenderOff();
  picture->ReadFrontBufferOff();
  vtkNew<vtkPNGWriter> writer;
  writer->SetInputConnection(picture->GetOutputPort());
  writer->SetFileName(fileName.c_str());
  writer->Write();
  if (writer->GetErrorCode() != vtkErrorCode::NoError)
  {
    return { StatusCode::InputOutput,
      fmt::format("{} can't be written: {}.", fileName,
        vtkErrorCode::GetStringFromErrorCode(writer->GetErrorCode())) };
  }
  return {};
}

/// Reason for a failure in VTK's own words, where it gave any.
Status FailureOf(const ErrorCapture& errors, const std::string& otherwise)
{
  return { StatusCode::InputOutput, errors.HasError() ? errors.First() : otherwise };
}

Status SetUpVolume(
  const RenderOptions& options, vtkBrickSourceAlgorithm* source, vtkVolumeProperty* property)
{
  vtkOutOfCoreTransferFunction::MakeAutomatic(source->GetBrickSource(), property);
  if (!options.TransferFunction.empty())
  {
    const std::string reason =
      vtkOutOfCoreTransferFunction::Read(options.TransferFunction, property);
    if (!reason.empty())
    {
      return { StatusCode::InvalidArgument, reason };
    }
  }
  return {};
}

void SetUpMapper(const RenderOptions& options, vtkOutOfCoreVolumeMapper* mapper)
{
  if (options.GPUMemory > 0)
  {
    mapper->SetGPUMemoryBudget(options.GPUMemory);
  }
  if (options.HostMemory > 0)
  {
    mapper->SetHostMemoryBudget(options.HostMemory);
  }
  mapper->SetImageErrorTolerance(options.Tolerance);
  mapper->SetMarcher(options.Marcher == "gpu" ? vtkOutOfCoreVolumeMapper::MARCHER_GPU
      : options.Marcher == "native"           ? vtkOutOfCoreVolumeMapper::MARCHER_NATIVE
                                              : vtkOutOfCoreVolumeMapper::MARCHER_AUTOMATIC);
}

double SmallestSpacing(vtkBrickSourceAlgorithm* source)
{
  const Double3& spacing = source->GetBrickSource()->GetBrickSource()->Info().Spacing;
  return *std::min_element(spacing.begin(), spacing.end());
}

} // namespace

Status RunRender(const RenderOptions& options)
{
  ErrorCapture errors;
  auto opened = OpenVolume(options.Volume);
  if (!opened.Ok())
  {
    return opened.GetStatus();
  }
  vtkBrickSourceAlgorithm* source = opened.Value().Last;
  if (!source->GetBrickSource())
  {
    return FailureOf(errors, fmt::format("{} can't be opened.", options.Volume.Name));
  }
  vtkNew<vtkVolume> volume;
  Status status = SetUpVolume(options, source, volume->GetProperty());
  for (const std::string* file : { &options.Output, &options.Stats })
  {
    if (status.Ok() && !file->empty())
    {
      status = CheckWritable(*file);
    }
  }
  if (status.Ok())
  {
    status = CheckDisplay();
  }
  if (!status.Ok())
  {
    return status;
  }
  vtkNew<vtkOutOfCoreVolumeMapper> mapper;
  mapper->SetInputConnection(source->GetOutputPort());
  SetUpMapper(options, mapper);
  volume->SetMapper(mapper);
  vtkNew<vtkRenderer> renderer;
  renderer->SetBackground(options.Background[0], options.Background[1], options.Background[2]);
  renderer->AddVolume(volume);
  vtkNew<vtkRenderWindow> window;
  window->SetOffScreenRendering(1);
  window->SetMultiSamples(0);
  window->SetSize(options.Size[0], options.Size[1]);
  window->AddRenderer(renderer);
  status = PlaceCamera(renderer->GetActiveCamera(), options.Camera, volume->GetBounds(),
    static_cast<double>(options.Size[0]) / options.Size[1], SmallestSpacing(source));
  if (!status.Ok())
  {
    return status;
  }
  window->Render();
  if (errors.HasError() && mapper->GetNumberOfFailedBricks() == 0)
  {
    return FailureOf(errors, {});
  }
  status = WritePicture(window, options.Output);
  if (!status.Ok())
  {
    return status;
  }
  const nlohmann::ordered_json stats = Statistics(options, mapper);
  if (!options.Stats.empty() && !(std::ofstream(options.Stats) << stats.dump(2) << '\n'))
  {
    return { StatusCode::InputOutput, fmt::format("{} can't be written.", options.Stats) };
  }
  if (!options.Quiet)
  {
    PrintSummary(stats);
  }
  if (!mapper->IsConverged())
  {
    return FailureOf(errors, "The picture didn't converge.");
  }
  return {};
}

} // namespace teravox::program
