// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "vtkRepeatVolume.h"

#include "ImageBrickSource.h"
#include "RepeatBrickSource.h"
#include "vtkBrickSource.h"

#include <algorithm>
#include <array>
#include <vtkAlgorithmOutput.h>
#include <vtkDataArray.h>
#include <vtkImageData.h>
#include <vtkInformation.h>
#include <vtkInformationVector.h>
#include <vtkObjectFactory.h>
#include <vtkStreamingDemandDrivenPipeline.h>
#include <vtkWeakPointer.h>

vtkStandardNewMacro(vtkRepeatVolume);

/// What the repeated source was made of, to know when the input has changed.
class vtkRepeatVolume::vtkInternals
{
public:
  std::shared_ptr<teravox::BrickSource> Inner;
  vtkWeakPointer<vtkDataArray> Array; // of an ordinary image
  vtkMTimeType ArrayTime = 0;
  vtkMTimeType ImageTime = 0;
};

vtkRepeatVolume::vtkRepeatVolume()
  : Internals(std::make_unique<vtkInternals>())
{
  this->SetNumberOfInputPorts(1);
}

vtkRepeatVolume::~vtkRepeatVolume() = default;

int vtkRepeatVolume::FillInputPortInformation(int, vtkInformation* info)
{
  info->Set(vtkAlgorithm::INPUT_REQUIRED_DATA_TYPE(), "vtkImageData");
  info->Set(vtkAlgorithm::INPUT_IS_OPTIONAL(), 1);
  return 1;
}

void vtkRepeatVolume::SetInputBrickSource(vtkBrickSource* source)
{
  if (this->InputBrickSource != source)
  {
    this->InputBrickSource = source;
    this->BrickSourceModified();
  }
}

vtkBrickSource* vtkRepeatVolume::GetInputBrickSource()
{
  return this->InputBrickSource;
}

void vtkRepeatVolume::SetRepetitions(long long x, long long y, long long z)
{
  const long long values[3] = { x, y, z };
  this->SetRepetitions(values);
}

void vtkRepeatVolume::SetRepetitions(const long long repetitions[3])
{
  if (!std::equal(repetitions, repetitions + 3, this->Repetitions))
  {
    std::copy_n(repetitions, 3, this->Repetitions);
    this->BrickSourceModified();
  }
}

void vtkRepeatVolume::GetRepetitions(long long repetitions[3])
{
  std::copy_n(this->Repetitions, 3, repetitions);
}

void vtkRepeatVolume::SetPitch(long long x, long long y, long long z)
{
  const long long values[3] = { x, y, z };
  this->SetPitch(values);
}

void vtkRepeatVolume::SetPitch(const long long pitch[3])
{
  if (!std::equal(pitch, pitch + 3, this->Pitch))
  {
    std::copy_n(pitch, 3, this->Pitch);
    this->BrickSourceModified();
  }
}

void vtkRepeatVolume::GetPitch(long long pitch[3])
{
  std::copy_n(this->Pitch, 3, pitch);
}

void vtkRepeatVolume::SetBackground(double value)
{
  if (this->Background != value)
  {
    this->Background = value;
    this->BrickSourceModified();
  }
}

int vtkRepeatVolume::RequestUpdateExtent(
  vtkInformation*, vtkInformationVector** inputVector, vtkInformationVector*)
{
  if (this->GetNumberOfInputConnections(0) == 0)
  {
    return 1;
  }
  vtkInformation* input = inputVector[0]->GetInformationObject(0);
  std::array<int, 6> extent{};
  input->Get(vtkStreamingDemandDrivenPipeline::WHOLE_EXTENT(), extent.data());
  if (vtkBrickSourceAlgorithm::SafeDownCast(this->GetInputAlgorithm(0, 0)))
  {
    // Its voxels are read through its source; the pipeline asks for one, because it must for some.
    for (std::size_t a = 0; a < 3; ++a)
    {
      extent[2 * a + 1] = std::min(extent[2 * a + 1], extent[2 * a] + 1);
    }
  }
  input->Set(vtkStreamingDemandDrivenPipeline::UPDATE_EXTENT(), extent.data(), 6);
  return 1;
}

std::shared_ptr<teravox::BrickSource> vtkRepeatVolume::FindInner(std::string& reason)
{
  vtkInternals& internals = *this->Internals;
  internals.Array = nullptr;
  if (this->InputBrickSource)
  {
    if (!this->InputBrickSource->GetBrickSource())
    {
      reason = "The brick source to repeat is empty.";
    }
    return this->InputBrickSource->GetBrickSource();
  }
  vtkAlgorithmOutput* connection = this->GetInputConnection(0, 0);
  if (!connection)
  {
    reason = "There is nothing to repeat: neither an input nor a brick source is set.";
    return nullptr;
  }
  if (auto* input = vtkBrickSourceAlgorithm::SafeDownCast(connection->GetProducer()))
  {
    vtkBrickSource* holder = input->GetBrickSource(); // reports its own errors
    return holder ? holder->GetBrickSource() : nullptr;
  }
  connection->GetProducer()->UpdateWholeExtent();
  auto* image = vtkImageData::SafeDownCast(
    connection->GetProducer()->GetOutputDataObject(connection->GetIndex()));
  bool cellData = false;
  vtkDataArray* array = image ? teravox::FindScalars(image, cellData) : nullptr;
  if (!array)
  {
    reason = "The input has no scalars to repeat.";
    return nullptr;
  }
  internals.Array = array;
  internals.ArrayTime = array->GetMTime();
  internals.ImageTime = image->GetMTime();
  if (vtkBrickSource* holder = vtkBrickSource::Get(array))
  {
    return holder->GetBrickSource();
  }
  auto source = teravox::MakeImageBrickSource(image, array, cellData, 64);
  if (!source.Ok())
  {
    reason = source.GetStatus().Message();
    return nullptr;
  }
  return source.Value();
}

bool vtkRepeatVolume::IsBrickSourceOutdated()
{
  const vtkInternals& internals = *this->Internals;
  if (this->InputBrickSource)
  {
    return this->InputBrickSource->GetBrickSource() != internals.Inner;
  }
  vtkAlgorithmOutput* connection = this->GetInputConnection(0, 0);
  if (!connection)
  {
    return true;
  }
  if (auto* input = vtkBrickSourceAlgorithm::SafeDownCast(connection->GetProducer()))
  {
    vtkBrickSource* holder = input->GetBrickSource();
    return !holder || holder->GetBrickSource() != internals.Inner;
  }
  connection->GetProducer()->UpdateWholeExtent();
  auto* image = vtkImageData::SafeDownCast(
    connection->GetProducer()->GetOutputDataObject(connection->GetIndex()));
  bool cellData = false;
  vtkDataArray* array = image ? teravox::FindScalars(image, cellData) : nullptr;
  return !array || array != internals.Array || array->GetMTime() != internals.ArrayTime ||
    image->GetMTime() != internals.ImageTime;
}

std::shared_ptr<teravox::BrickSource> vtkRepeatVolume::MakeBrickSource(std::string& reason)
{
  this->Internals->Inner = this->FindInner(reason);
  if (!this->Internals->Inner)
  {
    return nullptr;
  }
  teravox::RepeatDescription repeat;
  repeat.Inner = this->Internals->Inner;
  std::copy_n(this->Repetitions, 3, repeat.Repetitions.begin());
  std::copy_n(this->Pitch, 3, repeat.Pitch.begin());
  repeat.Background = this->Background;
  auto source = teravox::RepeatBrickSource::Make(repeat);
  if (!source.Ok())
  {
    reason = source.GetStatus().Message();
    return nullptr;
  }
  return source.Value();
}

void vtkRepeatVolume::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "Repetitions: " << this->Repetitions[0] << " " << this->Repetitions[1] << " "
     << this->Repetitions[2] << "\n";
  os << indent << "Pitch: " << this->Pitch[0] << " " << this->Pitch[1] << " " << this->Pitch[2]
     << "\n";
  os << indent << "Background: " << this->Background << "\n";
  os << indent << "InputBrickSource: " << this->InputBrickSource.GetPointer() << "\n";
}
