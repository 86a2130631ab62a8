// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "Scene.h"

#include <functional>
#include <string>
#include <vector>
#include <vtkOpenGLGPUVolumeRayCastMapper.h>

namespace teravox::test
{

/// Colours only: what VTK leaves in the window's alpha is another matter.
std::vector<float> WithoutAlpha(std::vector<float> picture);

/// The least and the largest of nine pictures within +-1/32 pixel, and the one in their middle.
struct PictureEnvelope
{
  std::vector<float> Low;
  std::vector<float> High;
  std::vector<float> Middle;
};
/// Of what a stage shows, drawn by another mapper, without alpha.
PictureEnvelope EnvelopeOf(Stage& stage, vtkVolumeMapper* mapper);

/// One image drawn by the out-of-core mapper and by vtkGPUVolumeRayCastMapper with a sample
/// distance of 0.1 voxel, no automatic adjustment, no jitter, and scalars of 16 bits (software
/// drivers filter 8-bit textures with 8-bit weights).
class BesideVTK
{
public:
  /// What may lie between them: the mean difference, and the largest one beyond the envelope of
  /// nine pictures of VTK's, shifted by up to 1/32 pixel. In 1/255.
  struct Tolerance
  {
    double Mean = 1;
    double Max = 6;
  };

  BesideVTK(const ImageOptions& options, int size);
  /// Clipping planes and cropping of the out-of-core mapper become VTK's. Its cropping planes lie
  /// up to half a voxel off for point data: it is told where they have to be.
  void CopyCuts();
  /// Draws both and compares; GoogleTest's failures.
  void Expect(const std::string& name, const Tolerance& tolerance);
  void Expect(const std::string& name) { this->Expect(name, {}); }
  /// Both pictures side by side into a PNG, ours left.
  void Save(const std::string& file);

  vtkSmartPointer<vtkImageData> Image;
  Stage Shown;
  /// Called before VTK's mapper draws (true) and before ours does (false), where they need other
  /// properties for the same picture.
  std::function<void(bool theirs)> Prepare = [](bool) {};
  vtkNew<vtkOpenGLGPUVolumeRayCastMapper> Theirs;

private:
  vtkSmartPointer<vtkImageData> Wide;
};

} // namespace teravox::test
