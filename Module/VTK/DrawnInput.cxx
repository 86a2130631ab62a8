// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "DrawnInput.h"

#include "VolumePlace.h"
#include "vtkBrickSource.h"

#include <vtkDataArray.h>
#include <vtkImageData.h>
#include <vtkMatrix3x3.h>

namespace teravox
{

namespace
{
Drawn PlaceBySource(const std::shared_ptr<BrickSource>& source)
{
  const VolumeInfo& info = source->Info();
  return { source, DatasetFromVoxel(info), info.CellData, nullptr, 0, nullptr };
}

Matrix4 ImageToDataset(vtkImageData* image)
{
  const double* origin = image->GetOrigin();
  const double* spacing = image->GetSpacing();
  return IndexToDataset({ origin[0], origin[1], origin[2] }, { spacing[0], spacing[1], spacing[2] },
    image->GetDirectionMatrix()->GetData());
}

// The image shows one level, or a part of it; its index space is that level's.
Drawn PlaceByImage(vtkImageData* image, vtkBrickSource* holder)
{
  const std::shared_ptr<BrickSource>& source = holder->GetBrickSource();
  const VolumeInfo& info = source->Info();
  long long first[3];
  holder->GetPresentedFirstVoxel(first);
  const Int3& factor = info.Layout.Factor(holder->GetPresentedLevel());
  const int* extent = image->GetExtent();
  // Index of VTK of a point p in corner coordinates of level 0: centres of the presented level lie
  // at whole indices for point data, cells between them for cell data.
  const double half = info.CellData ? 0.0 : 0.5;
  Double3 scale{};
  Double3 shift{};
  for (std::size_t a = 0; a < 3; ++a)
  {
    scale[a] = 1.0 / static_cast<double>(factor[a]);
    shift[a] = extent[2 * a] - static_cast<double>(first[a]) - half;
  }
  return { source, MultiplyMatrices(ImageToDataset(image), ScaleAndShift(scale, shift)),
    info.CellData, nullptr, 0, nullptr };
}
} // namespace

Drawn FindDrawn(vtkBrickSource* explicitSource, vtkImageData* image, vtkDataArray* scalars,
  int cellFlag, const std::function<std::shared_ptr<BrickSource>(std::string&)>& ofArray,
  std::string& error)
{
  if (explicitSource)
  {
    if (!explicitSource->GetBrickSource())
    {
      error = "The vtkBrickSource given to the mapper holds no source.";
      return {};
    }
    Drawn drawn = PlaceBySource(explicitSource->GetBrickSource());
    drawn.Series = explicitSource->GetBrickSeries();
    drawn.Step = explicitSource->GetStep();
    return drawn;
  }
  if (!image || !scalars)
  {
    return {};
  }
  vtkBrickSource* holder = vtkBrickSource::Get(scalars);
  if (holder && holder->GetBrickSource())
  {
    Drawn drawn = PlaceByImage(image, holder);
    drawn.Series = holder->GetBrickSeries();
    drawn.Step = holder->GetStep();
    drawn.Image = image;
    return drawn;
  }
  Drawn drawn;
  drawn.Source = ofArray(error);
  drawn.CellData = cellFlag != 0;
  drawn.Image = image;
  const int* extent = image->GetExtent();
  const double half = drawn.CellData ? 0.0 : 0.5;
  drawn.DatasetFromVoxel = MultiplyMatrices(ImageToDataset(image),
    ScaleAndShift({ 1, 1, 1 }, { extent[0] - half, extent[2] - half, extent[4] - half }));
  return drawn;
}

} // namespace teravox
