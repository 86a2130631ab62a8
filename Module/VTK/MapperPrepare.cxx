// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// From VTK's objects to what an engine is asked for: everything about a volume that isn't drawing
// it.
#include "MapperInternals.h"
#include "MapperScene.h"
#include "PropertyFunctions.h"
#include "ScalarBrickSource.h"
#include "VolumePlace.h"
#include "vtkBrickSource.h"
#include "vtkCamera.h"
#include "vtkImageData.h"
#include "vtkImplicitFunction.h"
#include "vtkOpenGLRenderWindow.h"
#include "vtkOpenGLShaderCache.h"
#include "vtkOutOfCoreVolumeMapper.h"
#include "vtkPiecewiseFunction.h"
#include "vtkRenderWindow.h"
#include "vtkRenderer.h"
#include "vtkVolume.h"
#include "vtkVolumeProperty.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <optional>
#include <string>

using teravox::Matrix4;

namespace
{
double Now()
{
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

// World units; 0 or infinite where the matrix is singular.
double ShortestVoxelEdge(const Matrix4& world)
{
  double shortest = VTK_DOUBLE_MAX;
  for (std::size_t a = 0; a < 3; ++a)
  {
    shortest = std::min(shortest,
      std::sqrt(world[a] * world[a] + world[4 + a] * world[4 + a] + world[8 + a] * world[8 + a]));
  }
  return shortest;
}
} // namespace

// The source itself where vectors aren't to become scalars, or aren't vectors; isosurfaces are of
// one component.
std::shared_ptr<teravox::BrickSource> vtkOutOfCoreVolumeMapper::vtkInternals::ScalarsOf(
  vtkOutOfCoreVolumeMapper* mapper, teravox::MapperVolume& part, vtkVolumeProperty* property,
  const std::shared_ptr<teravox::BrickSource>& source)
{
  const int components = source->Info().Components;
  const std::optional<int> surface =
    mapper->BlendMode == ISOSURFACE_BLEND && mapper->VectorMode == DISABLED
    ? teravox::SurfaceComponent(property, components)
    : std::nullopt;
  // Vectors become scalars for the functions of the first component.
  part.FunctionComponent = surface.value_or(0);
  if (components == 1 || (mapper->VectorMode == DISABLED && !surface))
  {
    part.Scalars = part.ScalarsSource = nullptr;
    return source;
  }
  const int component = surface       ? *surface
    : mapper->VectorMode == MAGNITUDE ? teravox::ScalarBrickSource::Magnitude
                                      : std::min(mapper->VectorComponent, components - 1);
  if (!part.Scalars || part.ScalarsSource != source || part.ScalarsComponent != component)
  {
    part.Scalars = std::make_shared<teravox::ScalarBrickSource>(source, component);
    part.ScalarsSource = source;
    part.ScalarsComponent = component;
  }
  return part.Scalars;
}

teravox::Drawn vtkOutOfCoreVolumeMapper::vtkInternals::FindInput(
  vtkOutOfCoreVolumeMapper* mapper, teravox::MapperVolume& part, int port)
{
  vtkOutOfCoreVolumeMapper& m = *mapper;
  vtkBrickSource* given = port == 0 ? this->Explicit.Get() : nullptr;
  vtkImageData* image = nullptr;
  vtkDataArray* scalars = nullptr;
  int cellFlag = 0;
  if (!given)
  {
    m.Update();
    image = vtkImageData::SafeDownCast(m.GetInputDataObject(port, 0));
    scalars = image ? vtkAbstractMapper::GetScalars(
                        image, m.ScalarMode, m.ArrayAccessMode, m.ArrayId, m.ArrayName, cellFlag)
                    : nullptr;
    m.CellFlag = cellFlag;
  }
  const auto ofArray = [&](std::string& error)
  {
    std::string note;
    auto found = part.Arrays.Find(image, scalars, cellFlag != 0, m.BrickSize, error, note);
    if (!note.empty())
    {
      vtkWarningWithObjectMacro(mapper, << note);
    }
    return found;
  };
  std::string error;
  teravox::Drawn drawn = teravox::FindDrawn(given, image, scalars, cellFlag, ofArray, error);
  if (!drawn.Source)
  {
    this->Fail(mapper,
      !error.empty()
        ? error
        : teravox::WhyNoArray(m.GetInputDataObject(port, 0),
            { m.ScalarMode, m.ArrayAccessMode, m.ArrayId, m.ArrayName ? m.ArrayName : "" }));
  }
  return drawn;
}

std::shared_ptr<teravox::BrickSource> vtkOutOfCoreVolumeMapper::vtkInternals::ChooseSource(
  vtkOutOfCoreVolumeMapper* mapper, teravox::MapperVolume& part, teravox::MapperFrame& frame,
  vtkVolume* volume, bool together)
{
  vtkOutOfCoreVolumeMapper& m = *mapper;
  const teravox::Drawn& drawn = frame.Drawn;
  vtkVolumeProperty* property = volume->GetProperty();
  std::shared_ptr<teravox::BrickSource> source = ScalarsOf(mapper, part, property, drawn.Source);
  frame.Components = source->Info().Components;
  frame.ByImage = teravox::IsImageDrawn(mapper, property, source->Info());
  for (const std::string& name : teravox::FindUnsupported(
         mapper, property, volume, frame.Components, source->Info().Range, together))
  {
    this->WarnOnce(
      mapper, name, name + " isn't supported by out-of-core rendering yet and is ignored.");
  }
  std::string error;
  if (frame.ByImage && m.GetTransfer2DYAxisArray() != nullptr)
  {
    const auto both = part.Second.Join(
      source, drawn.Image, m.GetTransfer2DYAxisArray(), drawn.CellData, m.BrickSize, error);
    if (!both)
    {
      this->WarnOnce(mapper, "Transfer2DYAxisArray",
        "Transfer2DYAxisArray is ignored, the gradient counts instead: " + error);
    }
    return both ? both : source;
  }
  if (together || !teravox::IsMasked(mapper, property, frame.Components))
  {
    return source;
  }
  source = part.Mask.Find(source, m.MaskInput,
    teravox::HasLabelMask(mapper, property) ? teravox::LabelsOf(property)
                                            : std::vector<std::int64_t>(),
    error);
  if (!source)
  {
    this->Fail(mapper, "MaskInput: " + error);
  }
  return source;
}

void vtkOutOfCoreVolumeMapper::vtkInternals::SetCamera(vtkOutOfCoreVolumeMapper* mapper,
  vtkRenderer* ren, vtkVolume* volume, const teravox::Drawn& drawn, teravox::FrameRequest& request)
{
  vtkOutOfCoreVolumeMapper& m = *mapper;
  // The viewport that other props are drawn into: render passes may choose another one than the
  // renderer's, in a frame buffer of their own.
  GLint viewport[4] = { 0, 0, 0, 0 };
  glGetIntegerv(GL_VIEWPORT, viewport);
  GLint framebuffer = 0;
  glGetIntegerv(GL_DRAW_FRAMEBUFFER_BINDING, &framebuffer);
  request.Framebuffer = static_cast<GLuint>(framebuffer);
  vtkCamera* camera = ren->GetActiveCamera();
  request.View =
    ViewOf(ren, ren->GetRenderWindow()->GetStereoRender() != 0 && camera->GetLeftEye() == 0);
  request.X = viewport[0];
  request.Y = viewport[1];
  request.Camera.Width = viewport[2];
  request.Camera.Height = viewport[3];
  request.Camera.ViewFromWorld = teravox::ToMatrix(camera->GetModelViewTransformMatrix());
  request.Camera.ClipFromView =
    teravox::ToMatrix(camera->GetProjectionTransformMatrix(ren->GetTiledAspectRatio(), -1, 1));
  request.Camera.DatasetFromVoxel = drawn.DatasetFromVoxel;
  request.Camera.WorldFromDataset = teravox::ToMatrix(volume->GetMatrix());
  request.Camera.LevelBias = m.LevelOfDetailBias;
  request.Camera.MinimumLevel = m.MinimumLevel;
  request.Camera.MaximumLevel = m.MaximumLevel;
  request.Camera.CellData = drawn.CellData;
  teravox::SetCuts(mapper, request.Camera);
}

void vtkOutOfCoreVolumeMapper::vtkInternals::SetOptions(
  vtkOutOfCoreVolumeMapper* mapper, teravox::FrameRequest& request)
{
  vtkOutOfCoreVolumeMapper& m = *mapper;
  request.Tolerance = m.ImageErrorTolerance;
  request.SampleDistance = static_cast<double>(m.SampleDistance);
  request.LatticeStages = teravox::LatticeStagesOf(mapper);
  request.EmptySpaceSkipping = m.EmptySpaceSkipping != 0;
  request.ReusePicture = m.PictureReuse != 0;
  request.CountSamples = m.CountSamples != 0;
  request.ShowLevel = m.DebugView == LEVELS;
  request.ShowSamples = m.DebugView == SAMPLES_PER_PIXEL;
  request.ShowFrames = m.DebugView == BRICK_FRAMES;
  request.ErrorEstimate = m.ErrorEstimate != 0;
  request.RecordBricks = m.RecordBricks != 0;
  request.Timeout = m.ConvergeTimeout;
  request.RetryAfter = m.FailureRetryInterval;
  teravox::SetOutput(mapper, request);
}

bool vtkOutOfCoreVolumeMapper::vtkInternals::SetBlend(vtkOutOfCoreVolumeMapper* mapper,
  teravox::MapperVolume& part, vtkVolume* volume, int components, bool together,
  teravox::FrameRequest& request)
{
  vtkVolumeProperty* property = volume->GetProperty();
  const teravox::Projection projection = teravox::MakeProjection(mapper, property);
  if (!together && !request.ShowLevel &&
    teravox::CanBlendComponents(property, components, projection.Kind))
  {
    request.Blend = projection;
  }
  if (request.Blend.Kind != teravox::BlendKind::Slice)
  {
    return true;
  }
  vtkImplicitFunction* function = property->GetSliceFunction();
  if (!function)
  {
    this->WarnOnce(
      mapper, "SliceFunction", "SliceFunction isn't set, so there is no slice to draw.");
    return true;
  }
  std::array<double, 6> bounds{};
  volume->GetBounds(bounds.data());
  const auto depths = part.Slice.Find(request.Camera, function, bounds);
  if (!depths)
  {
    this->Fail(mapper, depths.GetStatus().Message());
    return false;
  }
  request.SliceDepths = depths.Value();
  return true;
}

void vtkOutOfCoreVolumeMapper::vtkInternals::SetPatience(vtkOutOfCoreVolumeMapper* mapper,
  vtkOpenGLRenderWindow* window, vtkVolume* prop, teravox::FrameRequest& request)
{
  const bool automatic = mapper->FrameTimeBudget < 0;
  request.Converge = automatic
    ? window->GetOffScreenRendering() != 0 || window->GetShowWindow() == 0
    : mapper->FrameTimeBudget == 0;
  request.TimeBudget = automatic ? prop->GetAllocatedRenderTime() : mapper->FrameTimeBudget;
  request.Abort = [window]() { return window->CheckAbortStatus() != 0; };
}

teravox::EngineSettings vtkOutOfCoreVolumeMapper::vtkInternals::SettingsOf(
  vtkOutOfCoreVolumeMapper* mapper)
{
  vtkOutOfCoreVolumeMapper& m = *mapper;
  teravox::EngineSettings settings;
  settings.GPUMemoryBudget = m.GetEffectiveGPUMemoryBudget();
  settings.HostMemoryBudget = m.GetEffectiveHostMemoryBudget();
  settings.LoaderThreads = m.NumberOfLoaderThreads;
  settings.Marcher = static_cast<teravox::MarcherKind>(m.Marcher);
  if (m.MaximumNumberOfSlots != 0)
  {
    settings.MaximumSlots = std::max<std::uint32_t>(m.MaximumNumberOfSlots, 2);
  }
  if (m.ArrivalShuffleSeed != 0)
  {
    settings.ShuffleSeed = m.ArrivalShuffleSeed;
  }
  return settings;
}

// Anew where anything that they depend on has changed: how a function is sampled depends on the
// values of the source and on the size of its voxels, too.
void vtkOutOfCoreVolumeMapper::vtkInternals::SetFunctions(vtkOutOfCoreVolumeMapper* mapper,
  teravox::MapperVolume& part, vtkVolumeProperty* property,
  const std::shared_ptr<teravox::BrickSource>& source, const teravox::RangeChoice& range,
  bool masked, double shortestLength)
{
  vtkOutOfCoreVolumeMapper& m = *mapper;
  const vtkMTimeType functionTime =
    std::max({ property->GetMTime(), property->GetScalarOpacity()->GetMTime(),
      masked ? teravox::LabelTime(property) : 0, teravox::ImageTime(property) });
  if (part.FunctionOf == property && part.FunctionTime == functionTime &&
    part.FunctionVersion != 0 && part.FunctionFor == source && part.FunctionRange == range &&
    part.FunctionLength == shortestLength && part.FunctionBlend == m.MaskBlendFactor)
  {
    return;
  }
  part.FunctionOf = property;
  part.FunctionTime = functionTime;
  part.FunctionFor = source;
  part.FunctionRange = range;
  part.FunctionLength = shortestLength;
  part.FunctionBlend = m.MaskBlendFactor;
  ++part.FunctionVersion;
  if (source->Info().Components > 1)
  {
    part.Engine.SetComponentFunctions(
      teravox::MakeComponentFunctions(property, source->Info(), range), part.FunctionVersion);
    return;
  }
  const auto blend = static_cast<double>(m.MaskBlendFactor);
  part.Engine.SetTransferFunction(masked && teravox::HasLabelMask(mapper, property)
      ? teravox::MakeLabelFunctions(property, range, blend)
      : teravox::MakeTransferFunction(property, part.FunctionComponent, range),
    part.FunctionVersion);
}

std::optional<teravox::MapperFrame> vtkOutOfCoreVolumeMapper::vtkInternals::Prepare(
  vtkOutOfCoreVolumeMapper* mapper, teravox::MapperVolume& part, int port, vtkRenderer* ren,
  vtkVolume* volume, vtkVolume* prop)
{
  const double began = Now();
  vtkOutOfCoreVolumeMapper& m = *mapper;
  const bool together = volume != prop;
  auto* window = vtkOpenGLRenderWindow::SafeDownCast(ren->GetRenderWindow());
  vtkVolumeProperty* property = volume->GetProperty();
  teravox::MapperFrame frame;
  frame.Drawn = this->FindInput(mapper, part, port);
  const auto source = frame.Drawn.Source ? this->ChooseSource(mapper, part, frame, volume, together)
                                         : std::shared_ptr<teravox::BrickSource>();
  if (!source)
  {
    return std::nullopt;
  }

  this->Adopt(mapper, window, ren);
  teravox::FrameRequest& request = frame.Request;
  SetCamera(mapper, ren, volume, frame.Drawn, request);
  if (request.Camera.Width <= 0 || request.Camera.Height <= 0)
  {
    return std::nullopt;
  }
  request.Nearest = property->GetInterpolationType() == VTK_NEAREST_INTERPOLATION;
  teravox::SetMaterial(ren, property, part.FunctionComponent, request);
  SetOptions(mapper, request);
  const bool masked = source->Info().Masked;
  if (masked && request.Tolerance <= 0)
  {
    // Steps of a given length don't end where a mask does.
    request.Tolerance = teravox::FrameRequest().Tolerance;
  }
  request.UseDepth = teravox::MayMeetGeometry(ren, prop);
  if (!this->SetBlend(mapper, part, volume, frame.Components, together, request))
  {
    return std::nullopt;
  }
  SetPatience(mapper, window, prop, request);
  const double shortest = ShortestVoxelEdge(request.Camera.DatasetFromVoxel);
  if (!(shortest > 0) || !std::isfinite(shortest))
  {
    this->Fail(mapper,
      "The matrix from voxels to the world is singular: check spacing, direction matrix and the "
      "volume's transform.");
    return std::nullopt;
  }
  // A wall of a hundredth of the shortest voxel edge is opaque.
  request.ShortestLength = 0.01 * shortest;

  // Read ahead is whole bricks, not one scalar of them.
  const teravox::Drawn& drawn = frame.Drawn;
  part.Engine.SetSource(source, source == drawn.Source ? drawn.Series : nullptr, drawn.Step);
  if (part.Timed != drawn.Source)
  {
    part.Timed = drawn.Source;
    this->SourceTime = began;
    this->FirstPicture = 0;
    this->ConvergedAfter = 0;
  }
  part.Engine.SetSettings(SettingsOf(mapper));
  SetFunctions(mapper, part, property, source,
    { source->Info().Range, m.ColorRangeType == NATIVE, m.ScalarOpacityRangeType == NATIVE,
      m.GradientOpacityRangeType == NATIVE, frame.ByImage },
    masked, request.ShortestLength);
  window->GetShaderCache()->ReleaseCurrentShader();
  return frame;
}
