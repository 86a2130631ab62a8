// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "PropertyFunctions.h"

#include "LabelTables.h"
#include "TransferPlane.h"
#include "TransferRange.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vtkColorTransferFunction.h>
#include <vtkDataArray.h>
#include <vtkImageData.h>
#include <vtkPiecewiseFunction.h>
#include <vtkPointData.h>
#include <vtkSmartPointer.h>
#include <vtkVolumeProperty.h>

namespace teravox
{

namespace
{
// Opacity over the magnitude of gradients. VTK takes magnitudes up to a quarter of the range of the
// data; beyond, the opacity is what it is there. Native: stretched over that from a quarter of the
// function's own range.
void SetGradientOpacity(
  vtkPiecewiseFunction* own, const RangeChoice& range, TransferFunction& function)
{
  auto opacity = vtkSmartPointer<vtkPiecewiseFunction>::New();
  opacity->DeepCopy(own);
  const bool isEmpty = opacity->GetSize() < 1;
  FitToRange(opacity, range.Data, false);
  double ends[2] = { 0, 0 };
  opacity->GetRange(ends);
  const double width = range.Data.Max - range.Data.Min;
  const bool isKnown =
    range.Data.IsKnown() && !range.Data.IsVoid() && std::isfinite(width) && width > 0;
  const double stretch = range.NativeGradient && !isEmpty && isKnown && ends[1] > ends[0]
    ? (ends[1] - ends[0]) / width
    : 1;
  const double last = isKnown ? 0.25 * width * stretch : ends[1];
  // Where the function is constant up to there, tables needn't reach so far.
  const double end = opacity->GetClamping() != 0 && ends[1] > 0 ? std::min(last, ends[1]) : last;
  function.LastGradient = end > 0 ? end / stretch : 1;
  function.GradientOpacity = [opacity, stretch, end](double m)
  { return opacity->GetValue(std::min(m * stretch, end)); };
}

// Values at which a function may bend.
template <int Numbers, typename Function>
void AddKnots(Function* of, TransferFunction& function)
{
  for (int i = 0; i < of->GetSize(); ++i)
  {
    double node[Numbers];
    of->GetNodeValue(i, node);
    function.Knots.push_back(node[0]);
    if (i + 1 < of->GetSize())
    {
      double next[Numbers];
      of->GetNodeValue(i + 1, next);
      function.Knots.push_back(node[0] + node[Numbers - 2] * (next[0] - node[0]));
    }
  }
  function.IsConstantBeyond = function.IsConstantBeyond && of->GetClamping() != 0;
}

void SetOpacity(const vtkSmartPointer<vtkPiecewiseFunction>& opacity, double unitDistance,
  TransferFunction& function)
{
  AddKnots<4>(opacity.Get(), function);
  function.UnitDistance = unitDistance;
  function.Opacity = [opacity](double v) { return opacity->GetValue(v); };
}

void SetColor(const vtkSmartPointer<vtkColorTransferFunction>& color, TransferFunction& function)
{
  AddKnots<6>(color.Get(), function);
  function.Color = [color](double v, double* rgb) { color->GetColor(v, rgb); };
}

void SetGray(const vtkSmartPointer<vtkPiecewiseFunction>& gray, TransferFunction& function)
{
  AddKnots<4>(gray.Get(), function);
  function.Color = [gray](double v, double* rgb) { rgb[0] = rgb[1] = rgb[2] = gray->GetValue(v); };
}

// The caller's own, as VTK draws with it.
template <typename Function>
vtkSmartPointer<Function> Fitted(Function* of, const RangeChoice& range, bool native)
{
  auto copy = vtkSmartPointer<Function>::New();
  copy->DeepCopy(of);
  FitToRange(copy, range.Data, native);
  return copy;
}

template <typename Function>
vtkSmartPointer<Function> CopyOf(Function* of)
{
  auto copy = vtkSmartPointer<Function>::New();
  copy->DeepCopy(of);
  return copy;
}

void SetOwnOpacity(
  vtkVolumeProperty* property, int component, const RangeChoice& range, TransferFunction& function)
{
  SetOpacity(Fitted(property->GetScalarOpacity(component), range, range.NativeOpacity),
    property->GetScalarOpacityUnitDistance(component), function);
}

void SetOwnColor(
  vtkVolumeProperty* property, int component, const RangeChoice& range, TransferFunction& function)
{
  if (property->GetColorChannels(component) == 3)
  {
    SetColor(
      Fitted(property->GetRGBTransferFunction(component), range, range.NativeColor), function);
  }
  else
  {
    SetGray(
      Fitted(property->GetGrayTransferFunction(component), range, range.NativeColor), function);
  }
}

void SortKnots(TransferFunction& function)
{
  std::sort(function.Knots.begin(), function.Knots.end());
  function.Knots.erase(
    std::unique(function.Knots.begin(), function.Knots.end()), function.Knots.end());
}

// Opacity and colour over the range of the data, and magnitudes of gradients up to a quarter of its
// width, or the range of a second component, as VTK lays them.
TransferFunction MakeImage(vtkVolumeProperty* property, const ValueRange& range,
  const std::optional<ValueRange>& second = std::nullopt)
{
  vtkImageData* nodes = property->GetTransferFunction2D(0);
  vtkDataArray* array = nodes->GetPointData()->GetScalars();
  TransferImage image;
  image.Columns = nodes->GetDimensions()[0];
  image.Rows = nodes->GetDimensions()[1];
  image.Values = range;
  const double width = range.Max - range.Min;
  image.LastGradient = width > 0 ? 0.25 * width : 1;
  image.Second = second;
  const vtkIdType count = vtkIdType{ image.Columns } * image.Rows;
  for (vtkIdType i = 0; i < count; ++i)
  {
    std::array<double, 4> node{};
    array->GetTuple(i, node.data());
    image.Nodes.push_back({ static_cast<float>(node[0]), static_cast<float>(node[1]),
      static_cast<float>(node[2]), static_cast<float>(node[3]) });
  }
  return MakeImageFunction(std::move(image), property->GetScalarOpacityUnitDistance(0));
}

// Opacity, also by gradient, and colour over values of two ranges.
TransferFunction MakeOwnFunction(
  vtkVolumeProperty* property, int component, const RangeChoice& opacity, const RangeChoice& color)
{
  TransferFunction function;
  SetOwnOpacity(property, component, opacity, function);
  SetOwnColor(property, component, color, function);
  SortKnots(function);
  if (property->GetInterpolationType() == VTK_NEAREST_INTERPOLATION)
  {
    function.FewestIntervals = TransferFunction::FewestIntervalsOfNearest;
  }
  if (HasGradientOpacity(property, component))
  {
    SetGradientOpacity(property->GetGradientOpacity(component), opacity, function);
  }
  return function;
}
} // namespace

bool AreDependent(vtkVolumeProperty* property, int components)
{
  return property->GetIndependentComponents() == 0 && (components == 2 || components == 4);
}

std::optional<int> SurfaceComponent(vtkVolumeProperty* property, int components)
{
  if (AreDependent(property, components))
  {
    return std::nullopt;
  }
  int largest = 0;
  for (int c = 1; c < components; ++c)
  {
    largest = property->GetComponentWeight(c) > property->GetComponentWeight(largest) ? c : largest;
  }
  return largest;
}

bool CanBlendComponents(vtkVolumeProperty* property, int components, BlendKind kind)
{
  return components == 1 ||
    IsOfComponents(kind,
      AreDependent(property, components) ? ComponentMode::Dependent : ComponentMode::Independent);
}

bool HasTransferImage(vtkVolumeProperty* property)
{
  vtkImageData* nodes = property->GetTransferFunctionMode() == vtkVolumeProperty::TF_2D
    ? property->GetTransferFunction2D(0)
    : nullptr;
  vtkDataArray* array = nodes ? nodes->GetPointData()->GetScalars() : nullptr;
  return array && nodes->GetDimensions()[2] == 1 && array->GetNumberOfTuples() > 0 &&
    array->GetNumberOfComponents() == 4 && array->GetDataType() == VTK_FLOAT;
}

bool IsImageRange(const ValueRange& range)
{
  return range.IsKnown() && !range.IsVoid() && std::isfinite(range.Max - range.Min);
}

vtkMTimeType ImageTime(vtkVolumeProperty* property)
{
  vtkImageData* nodes = property->GetTransferFunction2D(0);
  return nodes ? nodes->GetMTime() : 0;
}

bool HasGradientOpacity(vtkVolumeProperty* property, int component)
{
  return property->GetTransferFunctionMode() == vtkVolumeProperty::TF_1D &&
    property->HasGradientOpacity(component) && property->GetDisableGradientOpacity(component) == 0;
}

TransferFunction MakeTransferFunction(
  vtkVolumeProperty* property, int component, const RangeChoice& range)
{
  return range.Image ? MakeImage(property, range.Data)
                     : MakeOwnFunction(property, component, range, range);
}

ComponentFunctions MakeComponentFunctions(
  vtkVolumeProperty* property, const VolumeInfo& info, const RangeChoice& range)
{
  const auto of = [&](int component)
  {
    RangeChoice own = range;
    own.Data = ComponentRange(info, component);
    return own;
  };
  const int components = info.Components;
  const auto materialOf = [&](int c)
  {
    return MarchParameters::Vec{ static_cast<float>(property->GetAmbient(c)),
      static_cast<float>(property->GetDiffuse(c)), static_cast<float>(property->GetSpecular(c)),
      static_cast<float>(property->GetSpecularPower(c)) };
  };
  ComponentFunctions functions;
  if (range.Image)
  {
    functions.Mode = ComponentMode::Plane;
    functions.Functions.push_back(
      MakeImage(property, ComponentRange(info, 0), ComponentRange(info, 1)));
    functions.Material[0] = materialOf(0);
    return functions;
  }
  const bool dependent = AreDependent(property, components);
  functions.Mode = dependent ? ComponentMode::Dependent : ComponentMode::Independent;
  for (int c = 0; c < (dependent ? 1 : components); ++c)
  {
    const auto i = static_cast<std::size_t>(c);
    // The last of dependent ones has the opacity.
    functions.Functions.push_back(
      MakeOwnFunction(property, c, of(dependent ? components - 1 : c), of(c)));
    functions.Weight[i] = property->GetComponentWeight(c);
    functions.Material[i] = materialOf(c);
  }
  return functions;
}

std::vector<std::int64_t> LabelsOf(vtkVolumeProperty* property)
{
  std::vector<std::int64_t> labels;
  for (const int label : property->GetLabelMapLabels())
  {
    if (label != 0)
    {
      labels.push_back(label);
    }
  }
  return labels;
}

bool HasLabelGradientOpacity(vtkVolumeProperty* property)
{
  return property->HasLabelGradientOpacity() && property->GetDisableGradientOpacity(0) == 0;
}

vtkMTimeType LabelTime(vtkVolumeProperty* property)
{
  vtkMTimeType time = 0;
  const auto include = [&time](vtkObject* function)
  { time = function ? std::max(time, function->GetMTime()) : time; };
  for (const int label : property->GetLabelMapLabels())
  {
    include(property->GetLabelColor(label));
    include(property->GetLabelScalarOpacity(label));
    include(property->GetLabelGradientOpacity(label));
  }
  return time;
}

TransferFunction MakeLabelFunctions(
  vtkVolumeProperty* property, const RangeChoice& range, double blendFactor)
{
  TransferFunction function = MakeTransferFunction(property, 0, range);
  const bool gradients = HasLabelGradientOpacity(property);
  for (const std::int64_t name : LabelsOf(property))
  {
    const auto label = static_cast<int>(name);
    TransferFunction own;
    if (vtkPiecewiseFunction* opacity = property->GetLabelScalarOpacity(label))
    {
      SetOpacity(CopyOf(opacity), property->GetScalarOpacityUnitDistance(0), own);
    }
    else
    {
      SetOwnOpacity(property, 0, range, own);
    }
    if (vtkColorTransferFunction* color = property->GetLabelColor(label))
    {
      SetColor(CopyOf(color), own);
    }
    else
    {
      SetOwnColor(property, 0, range, own);
    }
    SortKnots(own);
    vtkPiecewiseFunction* gradient = gradients ? property->GetLabelGradientOpacity(label) : nullptr;
    if (gradient)
    {
      RangeChoice scalar = range;
      scalar.NativeGradient = false;
      SetGradientOpacity(gradient, scalar, own);
    }
    function.Labels.push_back(MixLabel(function, own, blendFactor));
  }
  return function;
}

} // namespace teravox
