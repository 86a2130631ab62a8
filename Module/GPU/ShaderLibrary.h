// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "MarchParameters.h"
#include "Status.h"

#include <string>
#include <vector>

namespace teravox
{

/// The features that change the text of the marcher, as one comparable value: the key of the
/// program cache. What a scene doesn't use isn't in its shader. Thread: immutable value.
/// OpaqueDepth is a feature of Intervals.frag, all others are those of RayMarch.frag.
struct ShaderVariant
{
  bool Nearest = false;
  bool FixedStep = false;
  bool FloatData = false;
  bool SlotTable = false;
  bool Shade = false;
  bool Lights = false;
  bool Interactive = false;
  bool Substitute = false;
  bool Count = false;
  bool ShowLevel = false;
  bool OpaqueDepth = false;
  bool Estimate = false;
  bool FirstHit = false;
  bool GradientOpacity = false;
  bool Plane = false; ///< instead of that: opacity and colour over value and gradient
  BlendKind Blend = BlendKind::Composite; ///< TERAVOX_BLEND
  int Components = 1;                     ///< of a voxel; TERAVOX_COMPONENTS, 0 for one
  bool Dependent = false;                 ///< of several components; also with a Plane
  bool Masked = false;                    ///< slots hold a mask behind the voxels
  bool Labels = false;                    ///< which tells which of many tables count
  bool ClippedGradient = false; ///< gradients find a value of its own behind clipping planes

  /// One bit per feature, above them the blend mode and the number of components.
  unsigned Key() const;
  bool operator<(const ShaderVariant& o) const { return this->Key() < o.Key(); }
  /// "#define TERAVOX_NEAREST 0" and so on, one line each.
  std::string Defines() const;
  /// All variants of the marcher that can occur.
  static std::vector<ShaderVariant> All();
};

/// Puts the text of a shader together: "#version 430 core", the variant's defines, the file with
/// its includes (each file once, paths relative to Shaders/), with "#line" so that drivers report
/// file index and line. Files come from the binary, or from the folder that the environment
/// variable TERAVOX_SHADER_DIR names. Errors: NotFound.
Result<std::string> AssembleShader(const std::string& file, const ShaderVariant& variant);

/// The name of the file with this index in a driver's message about an assembled shader.
std::string ShaderFileName(int index);

} // namespace teravox
