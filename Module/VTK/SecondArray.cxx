// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "SecondArray.h"

#include "JoinedBrickSource.h"
#include "PropertyFunctions.h"
#include "ScalarBrickSource.h"
#include "vtkBrickSource.h"

#include <vtkCellData.h>
#include <vtkDataArray.h>
#include <vtkImageData.h>
#include <vtkPointData.h>

namespace teravox
{

std::shared_ptr<BrickSource> SecondArray::Find(
  vtkImageData* image, const char* name, bool cellData, int brickSize, std::string& error)
{
  vtkDataSetAttributes* fields = nullptr;
  if (image && cellData)
  {
    fields = image->GetCellData();
  }
  else if (image)
  {
    fields = image->GetPointData();
  }
  vtkDataArray* array = fields ? fields->GetArray(name) : nullptr;
  if (!array)
  {
    error = std::string("The input has no ") + (cellData ? "cell" : "point") + " array \"" + name +
      "\" of numbers.";
    return nullptr;
  }
  const vtkBrickSource* holder = vtkBrickSource::Get(array);
  if (holder && holder->GetBrickSource())
  {
    return holder->GetBrickSource();
  }
  std::string note; // the drawn array has the same
  return this->Array.Find(image, array, cellData, brickSize, error, note);
}

std::shared_ptr<BrickSource> SecondArray::Join(const std::shared_ptr<BrickSource>& source,
  vtkImageData* image, const char* name, bool cellData, int brickSize, std::string& error)
{
  const std::shared_ptr<BrickSource> beside = this->Find(image, name, cellData, brickSize, error);
  if (this->Both && beside && this->First == source && this->Beside == beside)
  {
    return this->Both;
  }
  this->First = this->Beside = this->Both = nullptr;
  if (!beside)
  {
    return nullptr;
  }
  const auto one = beside->Info().Components == 1
    ? beside
    : std::shared_ptr<BrickSource>(std::make_shared<ScalarBrickSource>(beside, 0));
  if (!IsImageRange(one->Info().Range))
  {
    error = "The range of the values of \"" + std::string(name) + "\" isn't known.";
    return nullptr;
  }
  auto joined = JoinedBrickSource::Make(source, one);
  if (!joined)
  {
    error = joined.GetStatus().Message();
    return nullptr;
  }
  this->First = source;
  this->Beside = beside;
  this->Both = joined.Value();
  return this->Both;
}

} // namespace teravox
