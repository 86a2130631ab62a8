// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "BenchVolumes.h"
#include "Commands.h"
#include "Status.h"

#include <array>
#include <string>
#include <vector>

class vtkCamera;
class vtkVolumeProperty;

namespace teravox::program
{

/// A picture of the suite that mappers are compared on: data, transfer function, light, camera.
struct BenchScene
{
  std::string Name;
  std::string Description;
  BenchField Field = BenchField::Shells;
  int Size = 0; ///< voxels per axis of a formula

  /// Value and opacity, value and colour; linear between the nodes, no two at one value.
  std::vector<std::array<double, 2>> Opacity;
  std::vector<std::array<double, 4>> Color;
  double UnitDistance = 1; ///< of the opacity, in voxels
  bool Shade = false;
  double Azimuth = 30;
  double Elevation = 20;
  double Zoom = 1;
};

/// The material of all shaded scenes. Nothing ambient: VTK's fixed-point mapper takes that from the
/// light, which has none, so that the pictures would differ by definition.
struct BenchMaterial
{
  double Ambient = 0;
  double Diffuse = 0.8;
  double Specular = 0.3;
  double SpecularPower = 12;
};

/// The whole suite, in the order of the tables.
const std::vector<BenchScene>& AllBenchScenes();

/// The scenes of a list of names; "NAME*" stands for all that begin so; an empty list for all.
/// Errors: a name that fits none.
Result<std::vector<BenchScene>> FindBenchScenes(const std::vector<std::string>& names);

/// What VTK's objects have to say of a scene.
void SetUp(const BenchScene& scene, const BenchVolume& volume, vtkVolumeProperty* property);
Status SetUp(const BenchScene& scene, const BenchVolume& volume, double aspect, vtkCamera* camera);

} // namespace teravox::program
