// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "MapperScene.h"

#include "ImageLattice.h"
#include "PropertyFunctions.h"
#include "ShaderReplacements.h"
#include "VTKVersions.h"
#include "vtkContourValues.h"
#include "vtkDataArray.h"
#include "vtkGPUVolumeRayCastMapper.h"
#include "vtkLight.h"
#include "vtkLightCollection.h"
#include "vtkOutOfCoreVolumeMapper.h"
#include "vtkPlane.h"
#include "vtkPlaneCollection.h"
#include "vtkPropCollection.h"
#include "vtkRenderWindow.h"
#include "vtkRenderer.h"
#include "vtkVolume.h"
#include "vtkVolumeProperty.h"

#include <algorithm>
#include <cmath>

namespace teravox
{
// The sample distance of the picture, adjusted to it in powers of the square root of two.
int LatticeStagesOf(vtkOutOfCoreVolumeMapper* m)
{
  if (!m->GetAutoAdjustSampleDistances())
  {
    return 0;
  }
  const double most = std::max(static_cast<double>(m->GetMaximumImageSampleDistance()), 1.0);
  return static_cast<int>(std::min(2 * std::log2(most), static_cast<double>(MostLatticeStages)));
}

// A label mask is one only together with labels of the property, and as far as it counts.
bool HasLabelMask(vtkOutOfCoreVolumeMapper* m, vtkVolumeProperty* p)
{
  return m->GetMaskInput() != nullptr &&
    m->GetMaskType() == vtkGPUVolumeRayCastMapper::LabelMapMaskType &&
    m->GetMaskBlendFactor() > 0 && !LabelsOf(p).empty();
}

static bool HasMask(vtkOutOfCoreVolumeMapper* m, vtkVolumeProperty* p)
{
  const bool isBinary =
    m->GetMaskInput() != nullptr && m->GetMaskType() == vtkGPUVolumeRayCastMapper::BinaryMaskType;
  return isBinary || HasLabelMask(m, p);
}

bool IsMasked(vtkOutOfCoreVolumeMapper* m, vtkVolumeProperty* p, int components)
{
  return HasMask(m, p) &&
    (!HasLabelMask(m, p) ||
      (components == 1 && m->GetBlendMode() == vtkVolumeMapper::COMPOSITE_BLEND));
}

Projection MakeProjection(vtkOutOfCoreVolumeMapper* m, vtkVolumeProperty* p)
{
  Projection projection;
  switch (m->GetBlendMode())
  {
    case vtkVolumeMapper::MAXIMUM_INTENSITY_BLEND:
      projection.Kind = BlendKind::Maximum;
      break;
    case vtkVolumeMapper::MINIMUM_INTENSITY_BLEND:
      projection.Kind = BlendKind::Minimum;
      break;
    case vtkVolumeMapper::AVERAGE_INTENSITY_BLEND:
    {
      double range[2];
      m->GetAverageIPScalarRange(range);
      projection.Kind = BlendKind::Average;
      projection.RangeLow = range[0];
      projection.RangeHigh = range[1];
      break;
    }
    case vtkVolumeMapper::ADDITIVE_BLEND:
      projection.Kind = BlendKind::Additive;
      break;
    case vtkVolumeMapper::ISOSURFACE_BLEND:
    {
      vtkContourValues* contours = p->GetIsoSurfaceValues();
      projection.Kind = BlendKind::Isosurface;
      projection.IsoValues.assign(
        contours->GetValues(), contours->GetValues() + contours->GetNumberOfContours());
      break;
    }
    case vtkVolumeMapper::SLICE_BLEND:
      projection.Kind = BlendKind::Slice;
      break;
    default:
      break;
  }
  return projection;
}

bool IsImageDrawn(vtkOutOfCoreVolumeMapper* m, vtkVolumeProperty* p, const VolumeInfo& info)
{
  return HasTransferImage(p) && info.Components == 1 && !HasMask(m, p) &&
    m->GetBlendMode() == vtkVolumeMapper::COMPOSITE_BLEND && IsImageRange(info.Range);
}

std::vector<std::string> FindUnsupported(vtkOutOfCoreVolumeMapper* m, vtkVolumeProperty* p,
  vtkVolume* v, int components, const ValueRange& data, bool together)
{
  std::vector<std::string> names;
  const auto check = [&names](bool differs, const char* name)
  {
    if (differs)
    {
      names.emplace_back(name);
    }
  };
  // Those that a later VTK may add.
  check(m->GetBlendMode() < vtkVolumeMapper::COMPOSITE_BLEND ||
      m->GetBlendMode() > vtkVolumeMapper::SLICE_BLEND,
    "BlendMode");
  const bool masked = HasMask(m, p);
  check(m->GetInputCount() > 1 && !together,
    "SetInputConnection of a port other than 0 without vtkMultiVolume");
  if (together)
  {
    check(m->GetBlendMode() != vtkVolumeMapper::COMPOSITE_BLEND, "BlendMode of vtkMultiVolume");
    check(m->GetMaskInput() != nullptr, "MaskInput of vtkMultiVolume");
    check(m->GetErrorEstimate() != 0, "ErrorEstimate of vtkMultiVolume");
    check(
      m->GetDebugView() != vtkOutOfCoreVolumeMapper::NO_DEBUG_VIEW, "DebugView of vtkMultiVolume");
    check(m->GetBlock() != 0, "Block of vtkMultiVolume");
  }
  check(HasLabelMask(m, p) && components > 1, "MaskTypeToLabelMap with components");
  check(HasLabelMask(m, p) && m->GetBlendMode() != vtkVolumeMapper::COMPOSITE_BLEND,
    "MaskTypeToLabelMap with BlendMode");
  check(IsMasked(m, p, components) && m->GetImageErrorTolerance() <= 0,
    "ImageErrorTolerance of 0 with MaskInput");
  check(m->GetUseJittering() != 0, "UseJittering");
  check(m->GetUseDepthPass() != 0, "UseDepthPass");
  check(m->GetFinalColorWindow() == 0, "FinalColorWindow of 0");
  if (m->GetWarnOfSampling())
  {
    check(m->GetImageSampleDistance() != 1.0f, "ImageSampleDistance");
    check(m->GetMinimumImageSampleDistance() != 1.0f, "MinimumImageSampleDistance");
    check(m->GetLockSampleDistanceToInputSpacing() != 0, "LockSampleDistanceToInputSpacing");
    check(m->GetSampleDistance() != 1.0f && m->GetImageErrorTolerance() > 0, "SampleDistance");
  }
  check(m->GetReportProgress() != true, "ReportProgress");
  bool hasGradientOpacity = false;
  for (int c = 0; c < std::min(components, VTK_MAX_VRCOMP); ++c)
  {
    hasGradientOpacity = hasGradientOpacity || HasGradientOpacity(p, c);
  }
  check(hasGradientOpacity && m->GetBlendMode() != vtkVolumeMapper::COMPOSITE_BLEND,
    "GradientOpacity in this BlendMode");
  check(HasLabelMask(m, p) && m->GetMaskBlendFactor() < 1 &&
      (hasGradientOpacity || HasLabelGradientOpacity(p)),
    "GradientOpacity with MaskBlendFactor");
  const bool hasImage = HasTransferImage(p);
  check(p->GetTransferFunctionMode() != vtkVolumeProperty::TF_1D && !hasImage,
    "TransferFunctionMode without a TransferFunction2D of four floats per node");
  check(hasImage && components > 1, "TransferFunction2D with components");
  check(hasImage && masked, "TransferFunction2D with MaskInput");
  check(hasImage && m->GetBlendMode() != vtkVolumeMapper::COMPOSITE_BLEND,
    "TransferFunction2D in this BlendMode");
  check(hasImage && !IsImageRange(data), "TransferFunction2D of data of unknown range");
  check(components == 3 && p->GetIndependentComponents() == 0,
    "IndependentComponents off with 3 components");
  check(!CanBlendComponents(p, components, MakeProjection(m, p).Kind), "BlendMode with components");
  check(p->GetUseClippedVoxelIntensity() != 0 && m->GetClippingPlanes() &&
      m->GetClippingPlanes()->GetNumberOfItems() >
        static_cast<int>(MarchParameters::MaximumClippedPlanes),
    "UseClippedVoxelIntensity of more than 16 planes");
  check(HasShaderReplacements(v), "ShaderProperty");
  check(m->GetBlendMode() == vtkVolumeMapper::ISOSURFACE_BLEND &&
      p->GetIsoSurfaceValues()->GetNumberOfContours() > static_cast<int>(MaximumIsoValues),
    "IsoSurfaceValues beyond the first 256 visible ones");
  CheckNewerSettings(m, p, check);
  return names;
}

void SetOutput(vtkOutOfCoreVolumeMapper* m, FrameRequest& request)
{
  const float window = m->GetFinalColorWindow();
  if (window != 0)
  {
    request.Final.Scale = 1 / window;
    request.Final.Bias = 0.5f - m->GetFinalColorLevel() / window;
  }
  if (m->GetRenderToImage())
  {
    request.Show = false;
    request.HitOpacity = 0; // where anything is seen at all
    request.CountSamples = false;
    request.ErrorEstimate = false;
  }
}

void SetCuts(vtkOutOfCoreVolumeMapper* mapper, ViewInput& view)
{
  if (vtkPlaneCollection* planes = mapper->GetClippingPlanes())
  {
    vtkCollectionSimpleIterator it = nullptr;
    planes->InitTraversal(it);
    while (vtkPlane* plane = planes->GetNextPlane(it))
    {
      const double* o = plane->GetOrigin();
      const double* n = plane->GetNormal();
      view.ClipPlanes.push_back({ { o[0], o[1], o[2] }, { n[0], n[1], n[2] } });
    }
  }
  view.Crop.On = mapper->GetCropping() != 0;
  view.Crop.Flags = static_cast<std::uint32_t>(mapper->GetCroppingRegionFlags());
  std::copy_n(mapper->GetCroppingRegionPlanes(), 6, view.Crop.Planes.begin());
  if (mapper->GetBlock())
  {
    const int* extent = mapper->GetBlockExtent();
    view.Block.emplace();
    for (std::size_t a = 0; a < 3; ++a)
    {
      view.Block->Low[a] = extent[2 * a];
      view.Block->High[a] = std::int64_t{ extent[2 * a + 1] } + 1;
    }
  }
}

static LightInput ToLight(vtkLight* light)
{
  LightInput result;
  double position[3];
  double focus[3];
  light->GetTransformedPosition(position);
  light->GetTransformedFocalPoint(focus);
  for (std::size_t a = 0; a < 3; ++a)
  {
    result.Ambient[a] = light->GetAmbientColor()[a] * light->GetIntensity();
    result.Diffuse[a] = light->GetDiffuseColor()[a] * light->GetIntensity();
    result.Specular[a] = light->GetSpecularColor()[a] * light->GetIntensity();
    result.Position[a] = position[a];
    result.Direction[a] = focus[a] - position[a];
    result.Attenuation[a] = light->GetAttenuationValues()[a];
  }
  result.Positional = light->GetPositional() != 0;
  result.ConeAngle = light->GetConeAngle();
  result.Exponent = light->GetExponent();
  return result;
}

void SetMaterial(
  vtkRenderer* ren, vtkVolumeProperty* property, int component, FrameRequest& request)
{
  request.Shade = property->GetShade() != 0;
  if (property->GetUseClippedVoxelIntensity() != 0)
  {
    request.ClippedIntensity = property->GetClippedVoxelIntensity();
  }
  request.Material = { static_cast<float>(property->GetAmbient(component)),
    static_cast<float>(property->GetDiffuse(component)),
    static_cast<float>(property->GetSpecular(component)),
    static_cast<float>(property->GetSpecularPower(component)) };
  request.TwoSided = ren->GetTwoSidedLighting() != 0;
  request.LightDiffuse = { 0, 0, 0 };
  request.LightSpecular = { 0, 0, 0 };
  bool headlight = true;
  vtkCollectionSimpleIterator it = nullptr;
  ren->GetLights()->InitTraversal(it);
  while (vtkLight* light = ren->GetLights()->GetNextLight(it))
  {
    if (light->GetSwitch() == 0)
    {
      continue;
    }
    headlight = headlight && request.Lights.empty() && light->LightTypeIsHeadlight() != 0 &&
      light->GetPositional() == 0 && light->GetIntensity() == 1;
    if (headlight)
    {
      for (std::size_t c = 0; c < 3; ++c)
      {
        request.LightDiffuse[c] =
          static_cast<float>(light->GetDiffuseColor()[c] * light->GetIntensity());
        request.LightSpecular[c] =
          static_cast<float>(light->GetSpecularColor()[c] * light->GetIntensity());
      }
    }
    request.Lights.push_back(ToLight(light));
  }
  if (request.Lights.empty())
  {
    request.Material[0] = 0; // the ambient part is of a light, too
  }
  if (headlight)
  {
    request.Lights.clear();
  }
}

bool MayMeetGeometry(vtkRenderer* ren, vtkVolume* vol)
{
  vtkRenderWindow* window = ren->GetRenderWindow();
  if (ren->GetPass() != nullptr || ren->GetPreserveDepthBuffer() != 0 || ren->GetErase() == 0 ||
    window->GetErase() == 0 || ren->GetTexturedBackground() || ren->GetGradientBackground())
  {
    return true;
  }
  vtkCollectionSimpleIterator it = nullptr;
  vtkPropCollection* props = ren->GetViewProps();
  props->InitTraversal(it);
  while (vtkProp* prop = props->GetNextProp(it))
  {
    if (prop != vol && prop->GetVisibility() != 0)
    {
      return true;
    }
  }
  return false;
}
} // namespace teravox
