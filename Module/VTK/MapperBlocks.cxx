// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// What vtkOutOfCoreVolumeMapper does for sort-last rendering: pictures of blocks to be joined, and
// what one hides of another.
#include "BlockPictures.h"
#include "MapperInternals.h"
#include "vtkFloatArray.h"
#include "vtkImageData.h"
#include "vtkOpenGLShaderCache.h"
#include "vtkPointData.h"

#include <algorithm>

namespace
{
std::vector<float> PixelsOf(vtkImageData* image)
{
  auto* scalars = vtkFloatArray::SafeDownCast(image->GetPointData()->GetScalars());
  return scalars ? std::vector<float>(
                     scalars->GetPointer(0), scalars->GetPointer(0) + scalars->GetNumberOfValues())
                 : std::vector<float>();
}
} // namespace

bool vtkOutOfCoreVolumeMapper::GetGatheredImage(vtkImageData* gathered)
{
  const vtkInternals& in = *this->Internals;
  if (!gathered || !in.Window || !in.LastView)
  {
    return false;
  }
  int width = 0;
  int height = 0;
  const std::vector<float> pixels = in.Engine.ReadGathered(in.LastView, width, height);
  return teravox::SetPixels(gathered, pixels, width, height);
}

bool vtkOutOfCoreVolumeMapper::JoinGatheredImage(vtkImageData* sum, vtkImageData* more)
{
  const vtkInternals& in = *this->Internals;
  const auto shown = in.Shown_.find(in.LastRenderer);
  std::vector<float> rays = PixelsOf(sum);
  const std::vector<float> others = PixelsOf(more);
  if (shown == in.Shown_.end() || rays.empty() || rays.size() != others.size() ||
    sum->GetNumberOfScalarComponents() != more->GetNumberOfScalarComponents())
  {
    vtkErrorMacro("Only images of GetGatheredImage() of the same size can be joined.");
    return false;
  }
  const teravox::BlendKind blend = shown->second.Request.Blend.Kind;
  const auto channels = static_cast<std::size_t>(sum->GetNumberOfScalarComponents());
  const int components = shown->second.Components;
  if (teravox::GatheredChannels(blend, components) != sum->GetNumberOfScalarComponents())
  {
    vtkErrorMacro("Only images that belong to the mapper's blend mode can be joined.");
    return false;
  }
  for (std::size_t i = 0; i < rays.size(); i += channels)
  {
    teravox::JoinRays(blend, components, &others[i], &rays[i], shown->second.Dependent);
  }
  std::copy(rays.begin(), rays.end(), static_cast<float*>(sum->GetScalarPointer()));
  sum->Modified();
  return true;
}

bool vtkOutOfCoreVolumeMapper::ResolveGatheredImage(vtkImageData* gathered, vtkImageData* colors)
{
  vtkInternals& in = *this->Internals;
  std::vector<float> resolved;
  if (in.Window && in.LastView)
  {
    in.Window->MakeCurrent();
    in.Window->GetShaderCache()->ReleaseCurrentShader();
    resolved = in.Engine.ResolveGathered(in.LastView, PixelsOf(gathered));
  }
  int size[3];
  gathered->GetDimensions(size);
  if (!teravox::SetPixels(colors, resolved, size[0], size[1]))
  {
    vtkErrorMacro("What rays gathered becomes colours by the functions of a last frame of the same "
                  "size, of a block, in the blend mode maximum, minimum, average or additive.");
    return false;
  }
  return true;
}

bool vtkOutOfCoreVolumeMapper::GetOpacityTiles(vtkFloatArray* tiles)
{
  static_assert(OpacityTileSize == teravox::OpacityTileEdge);
  vtkInternals& in = *this->Internals;
  if (!tiles || !in.Window || !in.LastView)
  {
    return false;
  }
  int width = 0;
  int height = 0;
  const std::vector<float> colors = in.ReadColors(width, height);
  if (colors.empty())
  {
    return false;
  }
  const std::vector<float> least = teravox::LeastOpacities(colors, width, height);
  tiles->SetNumberOfComponents(1);
  tiles->SetNumberOfTuples(static_cast<vtkIdType>(least.size()));
  std::copy(least.begin(), least.end(), tiles->GetPointer(0));
  return true;
}

void vtkOutOfCoreVolumeMapper::SuspectHidden(vtkFloatArray* inFront)
{
  vtkInternals& in = *this->Internals;
  in.Confirmed = nullptr;
  in.Suspected = inFront ? std::make_shared<const std::vector<float>>(inFront->GetPointer(0),
                             inFront->GetPointer(0) + inFront->GetNumberOfValues())
                         : nullptr;
}

bool vtkOutOfCoreVolumeMapper::ConfirmHidden(vtkFloatArray* inFront)
{
  vtkInternals& in = *this->Internals;
  const auto shown = in.Shown_.find(in.LastRenderer);
  const vtkIdType tiles = shown == in.Shown_.end()
    ? 0
    : vtkIdType{ teravox::OpacityTilesAlong(shown->second.Request.Camera.Width) } *
      teravox::OpacityTilesAlong(shown->second.Request.Camera.Height);
  if (!inFront || !in.Suspected || tiles == 0 || inFront->GetNumberOfValues() != tiles)
  {
    vtkErrorMacro(
      "What hides a block is confirmed after a frame in which it was suspected, with one "
      "opacity for each of its tiles.");
    return false;
  }
  in.Confirmed = std::make_shared<const std::vector<float>>(
    inFront->GetPointer(0), inFront->GetPointer(0) + inFront->GetNumberOfValues());
  in.ConfirmedFor = shown->second;
  return true;
}

namespace
{
bool IsSamePlane(const teravox::ClipPlane& a, const teravox::ClipPlane& b)
{
  return a.Origin == b.Origin && a.Normal == b.Normal;
}

// Whether opacities of two pictures are the same, data and functions aside.
bool AreOpacitiesOfOneView(const teravox::FrameRequest& a, const teravox::FrameRequest& b)
{
  const teravox::ViewInput& v = a.Camera;
  const teravox::ViewInput& w = b.Camera;
  return a.View == b.View && v.ViewFromWorld == w.ViewFromWorld &&
    v.ClipFromView == w.ClipFromView && v.DatasetFromVoxel == w.DatasetFromVoxel &&
    v.WorldFromDataset == w.WorldFromDataset && v.Width == w.Width && v.Height == w.Height &&
    v.LevelBias == w.LevelBias && v.MinimumLevel == w.MinimumLevel &&
    v.MaximumLevel == w.MaximumLevel && v.CellData == w.CellData && v.Block == w.Block &&
    std::equal(v.ClipPlanes.begin(), v.ClipPlanes.end(), w.ClipPlanes.begin(), w.ClipPlanes.end(),
      IsSamePlane) &&
    v.Crop.On == w.Crop.On && v.Crop.Planes == w.Crop.Planes && v.Crop.Flags == w.Crop.Flags &&
    a.Blend.Kind == b.Blend.Kind && a.Blend.IsoValues == b.Blend.IsoValues &&
    a.SliceDepths == b.SliceDepths && a.Nearest == b.Nearest && a.Tolerance == b.Tolerance;
}
} // namespace

// A confirmation is of one view; what was hidden there may be seen in another.
void vtkOutOfCoreVolumeMapper::vtkInternals::ChooseHidden(
  teravox::FrameRequest& request, const std::shared_ptr<teravox::BrickSource>& source)
{
  if (this->Confirmed &&
    !(AreOpacitiesOfOneView(this->ConfirmedFor.Request, request) &&
      this->ConfirmedFor.FunctionVersion == this->FunctionVersion &&
      this->ConfirmedFor.Source == source))
  {
    this->Confirmed = nullptr;
    this->Suspected = nullptr;
  }
  request.SuspectedInFront = this->Suspected;
  request.ConfirmedInFront = this->Confirmed;
}
