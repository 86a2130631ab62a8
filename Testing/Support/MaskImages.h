// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "PyramidLayout.h"
#include "Scene.h"
#include "TruthVolume.h"
#include "vtkOutOfCoreVolumeMapper.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <vector>
#include <vtkDataArray.h>
#include <vtkGPUVolumeRayCastMapper.h>
#include <vtkImageData.h>
#include <vtkPointData.h>
#include <vtkSmartPointer.h>

namespace teravox::test
{

/// Of a voxel: whether it is in a binary mask, or which label it has.
using InMask = std::function<bool(std::int64_t, std::int64_t, std::int64_t)>;
using LabelOf = std::function<int(std::int64_t, std::int64_t, std::int64_t)>;

/// Labels as an image of a VTK type that holds them.
inline vtkSmartPointer<vtkImageData> LabelImage(
  const std::array<int, 3>& n, const LabelOf& labelOf, int type = VTK_INT)
{
  auto image = vtkSmartPointer<vtkImageData>::New();
  image->SetDimensions(n.data());
  image->AllocateScalars(type, 1);
  vtkDataArray* voxels = image->GetPointData()->GetScalars();
  vtkIdType at = 0;
  for (int k = 0; k < n[2]; ++k)
  {
    for (int j = 0; j < n[1]; ++j)
    {
      for (int i = 0; i < n[0]; ++i)
      {
        voxels->SetTuple1(at++, labelOf(i, j, k));
      }
    }
  }
  return image;
}

inline vtkSmartPointer<vtkImageData> MaskImage(const std::array<int, 3>& n, const InMask& isIn)
{
  return LabelImage(
    n, [&](auto i, auto j, auto k) { return isIn(i, j, k) ? 255 : 0; }, VTK_UNSIGNED_CHAR);
}

/// Three quarters of a volume, with steps in all directions and a few single voxels in and out.
inline InMask Sponge(const std::array<int, 3>& n)
{
  return [n](std::int64_t i, std::int64_t j, std::int64_t k)
  {
    const std::int64_t hash = (i * 7919 + j * 104729 + k * 1299709) % 101;
    const bool block = i < n[0] / 2 && j < n[1] / 2;
    const bool stairs = i / 3 + k / 4 > j / 2 + 2;
    return hash == 0 ? block || !stairs : !block && stairs;
  };
}

/// The levels of a mask, `valueOf` a coarser voxel from the values of its voxels of level 0.
inline std::vector<TruthLevel> LevelsOf(const PyramidLayout& layout, const LabelOf& fine,
  const std::function<double(const std::vector<int>&)>& valueOf)
{
  std::vector<TruthLevel> levels;
  const Int3 n = layout.Dimensions(0);
  for (int l = 0; l < layout.NumberOfLevels(); ++l)
  {
    const Int3 f = layout.Factor(l);
    levels.push_back(TruthLevel::FromFunction(
      [=](std::int64_t i, std::int64_t j, std::int64_t k)
      {
        std::vector<int> values;
        for (std::int64_t z = k * f[2]; z < std::min((k + 1) * f[2], n[2]); ++z)
        {
          for (std::int64_t y = j * f[1]; y < std::min((j + 1) * f[1], n[1]); ++y)
          {
            for (std::int64_t x = i * f[0]; x < std::min((i + 1) * f[0], n[0]); ++x)
            {
              values.push_back(fine(x, y, z));
            }
          }
        }
        return valueOf(values);
      },
      layout.Dimensions(l), f));
  }
  return levels;
}

/// A coarser level is in a binary mask where any of its voxels is.
inline std::vector<TruthLevel> MaskLevels(const PyramidLayout& layout, const InMask& isIn)
{
  return LevelsOf(
    layout, [isIn](auto i, auto j, auto k) { return isIn(i, j, k) ? 1 : 0; },
    [](const std::vector<int>& v)
    { return static_cast<double>(*std::max_element(v.begin(), v.end())); });
}

inline void SetMask(vtkGPUVolumeRayCastMapper* mapper, vtkImageData* mask)
{
  mapper->SetMaskInput(mask);
  mapper->SetMaskTypeToBinary();
}

inline void SetLabelMask(vtkGPUVolumeRayCastMapper* mapper, vtkImageData* mask)
{
  mapper->SetMaskInput(mask);
  mapper->SetMaskTypeToLabelMap();
}

/// A volume that a mask cuts: its image, a ramp of opacity, a view from outside.
inline void PrepareForMask(
  Stage& stage, int brickEdge, vtkImageData* image, const ImageOptions& options = {})
{
  stage.Mapper->SetBrickSize(brickEdge);
  stage.SetImage(image);
  stage.SetTransfer(MakeTransfer(OpacityShape::Ramp, options.Low, options.High));
  stage.Look({ 0.4, 1, -0.3 }, 0.8);
}

/// Does any pixel of a picture with `edge`^2 of them show a level coarser than 0?
inline bool HasCoarserLevels(const StageTruth& truth, int edge)
{
  for (int i = 0; i < edge * edge; ++i)
  {
    for (const TruthLevelSpan& span : LevelSpans(truth.Scene(), i % edge, i / edge))
    {
      if (span.Level > 0)
      {
        return true;
      }
    }
  }
  return false;
}

} // namespace teravox::test
