// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// Pictures, errors, depths and places that vtkOutOfCoreVolumeMapper hands out.
#include "MapperInternals.h"
#include "vtkImageData.h"
#include "vtkOpenGLShaderCache.h"

#include <algorithm>
#include <cmath>
#include <iterator>

bool teravox::SetPixels(
  vtkImageData* image, const std::vector<float>& pixels, int width, int height)
{
  if (pixels.empty())
  {
    return false;
  }
  image->SetDimensions(width, height, 1);
  const std::size_t count = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  image->AllocateScalars(VTK_FLOAT, static_cast<int>(pixels.size() / count));
  std::copy(pixels.begin(), pixels.end(), static_cast<float*>(image->GetScalarPointer()));
  return true;
}

bool vtkOutOfCoreVolumeMapper::GetColorAccumulator(vtkImageData* image)
{
  vtkInternals& in = *this->Internals;
  if (!image || !in.Window || !in.LastView)
  {
    return false;
  }
  int width = 0;
  int height = 0;
  const std::vector<float> colors = in.ReadColors(width, height);
  return teravox::SetPixels(image, colors, width, height);
}

bool vtkOutOfCoreVolumeMapper::GetErrorEstimateImage(vtkImageData* image)
{
  vtkInternals& in = *this->Internals;
  if (!image || !in.Window || !in.LastView)
  {
    return false;
  }
  in.Window->MakeCurrent();
  int width = 0;
  int height = 0;
  const std::vector<float> errors = in.Engine.ReadErrors(in.LastView, width, height);
  return teravox::SetPixels(image, errors, width, height);
}

std::vector<teravox::PickPart> vtkOutOfCoreVolumeMapper::vtkInternals::DrawnIn(const void* renderer)
{
  std::vector<teravox::PickPart> parts;
  const auto shown = this->Shown_.find(renderer);
  if (shown != this->Shown_.end())
  {
    parts.push_back({ &this->Engine, shown->second.Request, shown->second.Source });
  }
  const auto together = this->Together.find(renderer);
  if (together != this->Together.end())
  {
    std::transform(together->second.begin(), together->second.end(), std::back_inserter(parts),
      [](const ShownTogether& one) { return one.Part; });
  }
  return parts;
}

std::vector<teravox::PickPart> vtkOutOfCoreVolumeMapper::vtkInternals::Pickable(
  vtkRenderer* renderer)
{
  const auto shown = this->Shown_.find(renderer);
  bool same = shown == this->Shown_.end() ||
    (shown->second.FunctionVersion == this->FunctionVersion && shown->second.Source == this->Timed);
  const auto together = this->Together.find(renderer);
  if (together != this->Together.end())
  {
    same = same &&
      std::all_of(together->second.begin(), together->second.end(),
        [](const ShownTogether& one)
        {
          return one.FunctionVersion == one.Volume->FunctionVersion &&
            one.Part.Source == one.Volume->Timed;
        });
  }
  return same ? this->DrawnIn(renderer) : std::vector<teravox::PickPart>();
}

bool vtkOutOfCoreVolumeMapper::Pick(
  vtkRenderer* renderer, double displayX, double displayY, double opacity)
{
  vtkInternals& in = *this->Internals;
  const std::vector<teravox::PickPart> parts = in.Pickable(renderer);
  if (!in.Window || parts.empty())
  {
    vtkWarningMacro("There is nothing to pick: this mapper has to have drawn in the renderer.");
    return false;
  }
  const teravox::FrameRequest& request = parts[0].Request;
  const int x = static_cast<int>(std::floor(displayX)) - request.X;
  const int y = static_cast<int>(std::floor(displayY)) - request.Y;
  if (x < 0 || y < 0 || x >= request.Camera.Width || y >= request.Camera.Height)
  {
    return false;
  }
  in.Window->MakeCurrent();
  in.Window->GetShaderCache()->ReleaseCurrentShader();
  const double threshold = std::clamp(opacity, 0.0, 1.0);
  const auto picked = parts.size() == 1
    ? teravox::PickVolume(*parts[0].Engine, request, *parts[0].Source, x, y, threshold)
    : teravox::PickTogether(parts, x, y, threshold);
  if (!picked)
  {
    vtkErrorMacro(<< picked.GetStatus().Message());
    return false;
  }
  if (!picked.Value())
  {
    return false;
  }
  const teravox::VolumePick& place = *picked.Value();
  std::copy_n(place.Position.begin(), 3, this->PickPosition);
  this->PickLevel = place.Level;
  this->PickValue = place.Value;
  return true;
}

std::vector<teravox::SeenVolume> vtkOutOfCoreVolumeMapper::vtkInternals::ReadHits(
  const std::vector<teravox::PickPart>& parts)
{
  std::vector<teravox::SeenVolume> volumes;
  if (!this->Window || !this->LastView)
  {
    return volumes;
  }
  this->Window->MakeCurrent();
  for (const teravox::PickPart& part : parts)
  {
    std::optional<teravox::FirstHits> hits = part.Engine->ReadFirstHits(part.Request.View);
    if (!hits)
    {
      return {};
    }
    volumes.push_back({ *std::move(hits), part.Request.Camera });
  }
  return volumes;
}

void vtkOutOfCoreVolumeMapper::GetColorImage(vtkImageData* image)
{
  vtkInternals& in = *this->Internals;
  const std::vector<teravox::PickPart> parts = in.DrawnIn(in.LastRenderer);
  const std::vector<teravox::SeenVolume> volumes = in.ReadHits(parts);
  if (!image || volumes.empty())
  {
    vtkWarningMacro("There is no colour image: RenderToImage has to be on when a frame is drawn.");
    return;
  }
  int width = 0;
  int height = 0;
  const std::vector<float> colors = in.ReadColors(width, height);
  teravox::FillColorImage(image, colors, volumes, parts[0].Request.Final);
}

void vtkOutOfCoreVolumeMapper::GetDepthImage(vtkImageData* image)
{
  vtkInternals& in = *this->Internals;
  const std::vector<teravox::SeenVolume> volumes = in.ReadHits(in.DrawnIn(in.LastRenderer));
  if (!image || volumes.empty())
  {
    vtkWarningMacro("There is no depth image: RenderToImage has to be on when a frame is drawn.");
    return;
  }
  teravox::FillDepthImage(
    image, volumes, this->DepthImageScalarType, this->ClampDepthToBackface != 0);
}
