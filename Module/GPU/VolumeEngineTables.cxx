// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// Functions of VolumeEngine: the tables made of them, and what marchers are told of these.
#include "BlockPictures.h"
#include "LabelTables.h"
#include "MarchSetup.h"
#include "ScaledBrickSource.h"
#include "VolumeEngine.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

namespace teravox
{

void VolumeEngine::SetTransferFunction(TransferFunction function, std::uint64_t version)
{
  if (version != this->FunctionVersion)
  {
    this->Function = std::move(function);
    this->FunctionVersion = version;
  }
}

void VolumeEngine::SetComponentFunctions(ComponentFunctions functions, std::uint64_t version)
{
  if (version != this->FunctionVersion)
  {
    this->Components_ = std::move(functions);
    this->FunctionVersion = version;
  }
}

Status VolumeEngine::PrepareTables(const FrameRequest& request)
{
  const VolumeInfo& info = this->Source_->Info();
  const bool current = this->TableVersion == this->FunctionVersion;
  if (!this->HasComponents())
  {
    if (!this->HasLabels())
    {
      this->Tables_.clear();
    }
    if (current && this->MainTable().Nodes != 0 && this->TableBlend == request.Blend.Kind)
    {
      return {};
    }
    this->Drawn = ProjectedFunction(
      ScaleTransferFunction(this->Function, this->Exponent), request.Blend.Kind, info.Range);
    if (this->HasLabels())
    {
      if (this->Drawn.Labels.size() + 1 != static_cast<std::size_t>(info.MaskLabels))
      {
        return Status(StatusCode::InvalidArgument,
          info.Name + " has a mask of " + std::to_string(info.MaskLabels - 1) +
            " labels with functions, but there are " + std::to_string(this->Drawn.Labels.size()) +
            " functions.");
      }
      this->Transfer = {};
      this->Tables_ =
        BuildLabelTables(this->Drawn, info.Range, !IsFloat(info.Type), request.ShortestLength);
      this->Marcher->SetLabelTables(this->Tables_);
    }
    else
    {
      this->Transfer =
        BuildTransferTable(this->Drawn, info.Range, !IsFloat(info.Type), request.ShortestLength);
      this->Marcher->SetTransferTable(this->Transfer);
    }
    this->Gradient = request.Blend.Kind == BlendKind::Composite ? BuildGradientTable(this->Drawn)
                                                                : GradientTable();
    this->Marcher->SetGradientTable(this->Gradient);
    this->Plane = request.Blend.Kind == BlendKind::Composite && !info.Masked
      ? BuildTransferPlane(this->Drawn, this->Transfer.LargestExtinction)
      : TransferPlane();
    this->Marcher->SetPlane(this->Plane);
  }
  else if (!current || this->Tables_.empty() || this->TableBlend != request.Blend.Kind)
  {
    const auto count = static_cast<std::size_t>(info.Components);
    const bool independent = this->Components_.Mode == ComponentMode::Independent;
    const bool isPlane = this->Components_.Mode == ComponentMode::Plane;
    if (count > MarchParameters::MaximumComponents || this->Components_.Functions.empty() ||
      (independent  ? this->Components_.Functions.size() < count
          : isPlane ? count != 2
                    : count == 3))
    {
      return Status(StatusCode::Unsupported,
        info.Name + " has " + std::to_string(count) +
          " components per voxel; 1 to 4 independent ones and 2 or 4 dependent ones can be drawn.");
    }
    if (!IsOfComponents(request.Blend.Kind, this->Components_.Mode))
    {
      return Status(StatusCode::Unsupported,
        info.Name + " has several components, which can't be drawn in this blend mode.");
    }
    this->Tables_ = BuildComponentTables(
      this->Components_, info, this->Exponent, request.ShortestLength, request.Blend.Kind);
    this->Marcher->SetTransferTables(this->Tables_);
    this->Gradient = request.Blend.Kind == BlendKind::Composite
      ? BuildGradientTables(this->Components_.Functions)
      : GradientTable();
    this->Marcher->SetGradientTable(this->Gradient);
    this->Plane = isPlane
      ? BuildTransferPlane(this->Components_.Functions.front(), this->Tables_[0].LargestExtinction)
      : TransferPlane();
    this->Marcher->SetPlane(this->Plane);
  }
  this->TableVersion = this->FunctionVersion;
  this->TableBlend = request.Blend.Kind;
  return {};
}

void VolumeEngine::FillParameters(const FrameRequest& request, MarchParameters& parameters) const
{
  const auto& n = this->Plan_.SlotsPerAxis;
  const VoxelFormat& format = this->Atlas->Format();
  parameters.Atlas = { static_cast<std::uint32_t>(n[0]), static_cast<std::uint32_t>(n[1]),
    static_cast<std::uint32_t>(n[2]),
    static_cast<std::uint32_t>(this->Source_->Info().Layout.StoredSize()) };
  parameters.Value = { static_cast<float>(
                         this->Plan_.Native ? format.Scale : format.NormalizedScale),
    static_cast<float>(format.Offset), 0.0f, 0.0f };
  if (this->HasComponents())
  {
    // In the place of nodes are values, which ranges of bricks are of.
    parameters.Transfer = { 0, 0, 1, 0 };
    SetComponents(
      parameters, this->Components_, this->Source_->Info(), this->Exponent, this->Tables_);
    if (!this->Plane.IsNone())
    {
      SetPlaneParameters(parameters, this->Plane, this->Components_.Functions.front(),
        this->Tables_[0], request.Camera.DatasetFromVoxel, this->Exponent);
    }
    else if (!this->Gradient.IsOne())
    {
      SetComponentGradients(parameters, this->Components_, this->Source_->Info().Components,
        request.Camera.DatasetFromVoxel, this->Exponent);
    }
  }
  else
  {
    parameters.Transfer = TransferParameters(this->MainTable());
    if (!this->Plane.IsNone())
    {
      SetPlaneParameters(parameters, this->Plane, this->Drawn, this->Transfer,
        request.Camera.DatasetFromVoxel, this->Exponent);
    }
    else if (!this->Gradient.IsOne())
    {
      parameters.Gradient =
        GradientParameters(this->Drawn, request.Camera.DatasetFromVoxel, this->Exponent);
    }
  }
  parameters.Step =
    StepParameters(request.SampleDistance, request.Tolerance, this->Pace.Looseness());
  if (request.HitOpacity)
  {
    // Rays that end early have met it, too.
    const auto left = static_cast<float>(1 - *request.HitOpacity);
    parameters.Value[3] = std::max(std::min(left, std::nextafter(1.0f, 0.0f)), parameters.Step[2]);
  }
  parameters.Switches[0] = request.EmptySpaceSkipping ? 1u : 0u;
  parameters.Switches[1] = request.ShowSamples ? 1u : 0u;
  parameters.Limits[0] = MostSteps;
  parameters.Material = request.Material;
  parameters.LightDiffuse = { request.LightDiffuse[0], request.LightDiffuse[1],
    request.LightDiffuse[2], request.TwoSided ? 1.0f : 0.0f };
  parameters.LightSpecular = { request.LightSpecular[0], request.LightSpecular[1],
    request.LightSpecular[2], this->LargestExtinction() };
  if (this->HasComponents())
  {
    // What is left of a ray may be brighter than it is, see ComponentFunctions.
    parameters.Step[2] /=
      static_cast<float>(LargestLight(this->Components_, this->Source_->Info().Components));
  }
  Projection scaled = request.Blend;
  for (double& value : scaled.IsoValues)
  {
    value = std::ldexp(value, -this->Exponent);
  }
  scaled.RangeLow = std::ldexp(scaled.RangeLow, -this->Exponent);
  scaled.RangeHigh = std::ldexp(scaled.RangeHigh, -this->Exponent);
  if (!this->HasComponents())
  {
    SetProjection(parameters, scaled, this->Drawn, this->MainTable(), this->Function.UnitDistance,
      format.Relative);
  }
  else if (scaled.Kind != BlendKind::Composite)
  {
    SetComponentProjection(parameters, scaled, this->Components_, this->Tables_, format.Relative);
  }
}

float VolumeEngine::LargestExtinction() const
{
  if (!this->HasComponents())
  {
    return static_cast<float>(this->MainTable().LargestExtinction);
  }
  // Components together have at most the largest extinction per weight.
  double largest = 0;
  for (std::size_t c = 0; c < this->Tables_.size(); ++c)
  {
    const double weight =
      this->Components_.Mode == ComponentMode::Independent ? this->Components_.Weight[c] : 1;
    largest = weight > 0 ? std::max(largest, this->Tables_[c].LargestExtinction / weight) : largest;
  }
  return static_cast<float>(largest);
}

ShaderVariant VolumeEngine::VariantOf(const FrameRequest& request, const VoxelFormat& format) const
{
  ShaderVariant variant;
  variant.Nearest = request.Nearest;
  variant.Blend = request.Blend.Kind;
  const bool isComposite = variant.Blend == BlendKind::Composite;
  variant.Masked = this->Source_->Info().Masked;
  variant.Labels = this->HasLabels();
  variant.FixedStep = !request.Nearest && request.Tolerance <= 0 && isComposite && !variant.Masked;
  variant.FloatData = format.IsFloat();
  variant.SlotTable = format.Relative;
  variant.Shade = request.Shade && AddsUpOpacity(variant.Blend);
  variant.Lights = variant.Shade && !request.Lights.empty();
  // Of two components no other function says what is seen.
  variant.Plane = !this->Plane.IsNone() && (!request.ShowLevel || this->HasComponents());
  variant.GradientOpacity = !variant.Plane && !this->Gradient.IsOne() && !request.ShowLevel;
  variant.ClippedGradient = request.ClippedIntensity && !request.Camera.ClipPlanes.empty() &&
    (variant.Shade || variant.GradientOpacity || (variant.Plane && !this->HasComponents()));
  variant.Interactive = !request.Converge;
  variant.Count = request.CountSamples || request.ShowSamples;
  variant.ShowLevel = request.ShowLevel;
  const bool isDebug = request.ShowLevel || request.ShowSamples;
  variant.Estimate = request.ErrorEstimate && !isDebug && isComposite;
  variant.Components = this->Source_->Info().Components;
  variant.Dependent = this->HasComponents() && this->Components_.Mode != ComponentMode::Independent;
  variant.FirstHit = request.HitOpacity.has_value() && !isDebug && AddsUpOpacity(variant.Blend);
  return variant;
}

} // namespace teravox
