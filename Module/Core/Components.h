// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "BrickSource.h"
#include "MarchParameters.h"
#include "Projection.h"
#include "TransferTable.h"
#include "ViewGeometry.h"

#include <array>
#include <vector>

namespace teravox
{

/// What the components of a voxel stand for. The numbers are those of
/// MarchParameters::Components[1].
enum class ComponentMode : std::uint32_t
{
  /// Each is a field of its own, with an opacity and a colour.
  Independent = 0,
  /// Two: the first has the colour, the second the opacity. Four: red, green and blue as they are,
  /// and the opacity.
  Dependent = 1,
  /// Two, of which opacity and colour are one function: TransferFunction::Image with a Second.
  /// Light falls on the first.
  Plane = 2
};

/// How voxels of two to four components become light.
///
/// Dependent components are one medium: the extinction is that of the last component's opacity,
/// and each light that it adds has the colour that the others have at the same place.
///
/// Independent components with weights w share the ray. vtkGPUVolumeRayCastMapper (VTK 9.1, the
/// composer of its fragment shader) takes a sample with opacities a_i and colours c_i as
///
///     A = sum_j w_j a_j,   rgb = sum_i w_i a_i c_i,   alpha = sum_i a_i^2 / A     (i: w_i > 0)
///
/// where a_i = 1 - exp(-s_i d) for a step of length d and extinctions s_i. As d goes to 0, a_i / d
/// goes to s_i, and what a length adds and takes away to
///
///     emission    e = sum_i w_i s_i c_i
///     extinction  k = sum_i s_i^2 / sum_j w_j s_j
///
/// which is what is integrated here, each s_i times its component's gradient opacity: the picture
/// is the integral of e exp(-integral of k). A single component of weight w has e = w s c and k = s
/// / w. The light per extinction, e / k, is at most sum w_i^2 (Cauchy and Schwarz) and may so be
/// more than 1: pictures are clamped where they are shown, as VTK's are.
struct ComponentFunctions
{
  ComponentMode Mode = ComponentMode::Independent;
  /// One per component; of dependent ones a single one, whose opacity is that of the last component
  /// and whose colour that of the first of two; of a plane a single one.
  std::vector<TransferFunction> Functions;
  std::array<double, 4> Weight{ 1, 1, 1, 1 }; ///< of independent ones, 0..1
  /// MarchParameters::Material for each; of dependent ones and a plane only the first.
  std::array<MarchParameters::Vec, 4> Material{};
};

/// Whether a component has an opacity of its own.
bool HasOpacity(const ComponentFunctions& functions, std::size_t component, std::size_t components);

/// Whether voxels with such components can be drawn in a blend mode: maximum and minimum of
/// independent and dependent ones, average and additive of independent ones.
bool IsOfComponents(BlendKind kind, ComponentMode mode);

/// The range of the values of one component, or of all where that isn't known.
const ValueRange& ComponentRange(const VolumeInfo& info, int component);

/// The largest light per extinction that there may be, at least 1.
double LargestLight(const ComponentFunctions& functions, int components);

/// One table per component of the volume, those without a function empty (Nodes = 0). `exponent`:
/// values of `info` are the user's times 2^-exponent (see ScaleExponent). `kind`: blend mode;
/// others than composite are of independent components.
std::vector<TransferTable> BuildComponentTables(const ComponentFunctions& functions,
  const VolumeInfo& info, int exponent, double smallestStep, BlendKind kind = BlendKind::Composite);

/// MarchParameters::Components, ComponentTransfer, ComponentTable and ComponentMaterial.
void SetComponents(MarchParameters& parameters, const ComponentFunctions& functions,
  const VolumeInfo& info, int exponent, const std::vector<TransferTable>& tables);

/// MarchParameters::Gradient and ComponentGradient, for tables made by BuildGradientTables() of the
/// functions. Independent components have opacities by their own gradients, dependent ones by that
/// of the last one, which has the opacity. See GradientParameters().
void SetComponentGradients(MarchParameters& parameters, const ComponentFunctions& functions,
  int components, const Matrix4& datasetFromVoxel, int exponent);

/// MarchParameters::Projection and ComponentProjection. `projection` is in data values like those
/// of `info`, `tables` are those of the mode. `relative`: see SetProjection().
///
/// Of dependent components the ray shows the place where the last one has its extreme, the first
/// such place on the ray: the opacity there, and the colour that the others have there, as in VTK.
///
/// Of independent ones: as vtkGPUVolumeRayCastMapper (VTK 9.1) does it, of components with
/// opacities a_i, colours c_i and weights w_i: of extremes the colour is sum w_i a_i c_i and the
/// opacity sum w_i a_i, each at the component's own extreme; averages and sums are those of a_i
/// times the value's place in the range of the component, and sum w_i of them is a gray that hides
/// all behind. VTK 9.1 takes maxima for minima there, and adds squares of opacities to blue instead
/// of opacities to the opacity: minima here are what its maxima are of the negative.
void SetComponentProjection(MarchParameters& parameters, const Projection& projection,
  const ComponentFunctions& functions, const std::vector<TransferTable>& tables, bool relative);

} // namespace teravox
