// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "vtkPVHDF5PyramidReader.h"

#include "vtkBrickSource.h"
#include "vtkFieldData.h"
#include "vtkIdTypeArray.h"
#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkSmartPointer.h"
#include "vtkStringArray.h"
#include "vtksys/SystemInformation.hxx"

#include <cstdio>

namespace
{
std::string BytesText(double bytes)
{
  const char* const units[] = { "B", "KiB", "MiB", "GiB", "TiB", "PiB", "EiB" };
  int unit = 0;
  for (; bytes >= 1024 && unit < 6; ++unit)
  {
    bytes /= 1024;
  }
  char text[32];
  std::snprintf(text, sizeof(text), unit == 0 ? "%.0f %s" : "%.4g %s", bytes, units[unit]);
  return text;
}

std::string CountText(double count)
{
  char text[64];
  std::snprintf(text, sizeof(text), "%.0f", count);
  return text;
}

// The largest number instead of those that are larger.
vtkIdType IdOf(double count)
{
  return count < static_cast<double>(VTK_ID_MAX) ? static_cast<vtkIdType>(count) : VTK_ID_MAX;
}

void AddCount(vtkFieldData* fields, const char* name, long long count)
{
  vtkNew<vtkIdTypeArray> array;
  array->SetName(name);
  array->InsertNextValue(count);
  fields->AddArray(array);
}

void AddText(vtkFieldData* fields, const std::string& name, const std::string& text)
{
  vtkNew<vtkStringArray> array;
  array->SetName(name.c_str());
  array->InsertNextValue(text);
  fields->AddArray(array);
}
} // namespace

vtkStandardNewMacro(vtkPVHDF5PyramidReader);

vtkPVHDF5PyramidReader::vtkPVHDF5PyramidReader()
  : LevelTexts(vtkSmartPointer<vtkStringArray>::New())
  , ChannelNames(vtkSmartPointer<vtkStringArray>::New())
{
}

vtkPVHDF5PyramidReader::~vtkPVHDF5PyramidReader() = default;

void vtkPVHDF5PyramidReader::AddFile(const char* name)
{
  this->Files.emplace_back(name ? name : "");
  if (this->Files.size() == 1)
  {
    this->SetFileName(name);
    return;
  }
  if (this->Files.size() == 2)
  {
    this->AddFileName(this->Files[0].c_str());
  }
  this->AddFileName(name);
}

void vtkPVHDF5PyramidReader::RemoveAllFiles()
{
  this->Files.clear();
  this->RemoveAllFileNames();
  this->SetFileName(nullptr);
}

vtkPVHDF5PyramidReader::LevelSize vtkPVHDF5PyramidReader::SizeOf(int level)
{
  LevelSize size;
  vtkBrickSource* source = this->GetBrickSource();
  if (!source)
  {
    return size;
  }
  source->GetLevelDimensions(level, size.Dimensions);
  size.Bricks = 1;
  size.Bytes = static_cast<double>(vtkDataArray::GetDataTypeSize(source->GetScalarType())) *
    source->GetNumberOfComponents();
  const int brick = this->GetBrickSize();
  for (const long long n : size.Dimensions)
  {
    size.Bricks *= static_cast<double>((n + brick - 1) / brick);
    size.Bytes *= static_cast<double>(n);
  }
  return size;
}

vtkStringArray* vtkPVHDF5PyramidReader::GetLevelTexts()
{
  this->LevelTexts->Initialize();
  const int levels = this->Files.empty() ? 0 : this->GetNumberOfLevels();
  for (int level = 0; level < levels; ++level)
  {
    const LevelSize size = this->SizeOf(level);
    const long long* n = size.Dimensions;
    this->LevelTexts->InsertNextValue(std::to_string(n[0]) + " x " + std::to_string(n[1]) + " x " +
      std::to_string(n[2]) + ", " + CountText(size.Bricks) +
      (size.Bricks == 1 ? " brick, " : " bricks, ") + BytesText(size.Bytes));
  }
  return this->LevelTexts;
}

vtkStringArray* vtkPVHDF5PyramidReader::GetChannelNames()
{
  this->ChannelNames->Initialize();
  const int channels = this->Files.empty() ? 0 : this->GetNumberOfChannels();
  for (int channel = 0; channel < channels; ++channel)
  {
    const std::string name = this->GetChannelName(channel);
    this->ChannelNames->InsertNextValue(name.empty() ? std::to_string(channel) : name);
  }
  return this->ChannelNames;
}

vtkIdType vtkPVHDF5PyramidReader::GetNumberOfBricks()
{
  double bricks = 0;
  const int levels = this->Files.empty() ? 0 : this->GetNumberOfLevels();
  for (int level = 0; level < levels; ++level)
  {
    bricks += this->SizeOf(level).Bricks;
  }
  return IdOf(bricks);
}

vtkIdType vtkPVHDF5PyramidReader::GetNumberOfVoxelBytes()
{
  double bytes = 0;
  const int levels = this->Files.empty() ? 0 : this->GetNumberOfLevels();
  for (int level = 0; level < levels; ++level)
  {
    bytes += this->SizeOf(level).Bytes;
  }
  return IdOf(bytes);
}

int vtkPVHDF5PyramidReader::GetNumberOfSteps()
{
  return this->Files.empty() ? 0
    : this->Files.size() > 1 ? static_cast<int>(this->Files.size())
                             : this->GetNumberOfTimePoints();
}

int vtkPVHDF5PyramidReader::RequestInformation(
  vtkInformation* request, vtkInformationVector** inputVector, vtkInformationVector* outputVector)
{
  return this->Superclass::RequestInformation(request, inputVector, outputVector) &&
    this->FitsMemory();
}

// ParaView reads the level that is presented with the next Apply, whole.
bool vtkPVHDF5PyramidReader::FitsMemory()
{
  const int level = this->GetPresentedLevel();
  const double bytes = this->SizeOf(level).Bytes;
  vtksys::SystemInformation system;
  system.RunMemoryCheck();
  const auto memory = static_cast<double>(system.GetTotalPhysicalMemory()) * 1024 * 1024;
  if (memory <= 0 || bytes <= memory / 2)
  {
    return true;
  }
  vtkErrorMacro("Level " << level << " of " << this->GetFileName() << " has " << BytesText(bytes)
                         << " of voxels, which is more than half of the main memory. Ask for a "
                            "coarser level; `teravox convert` makes the levels of a file that has "
                            "none.");
  return false;
}

int vtkPVHDF5PyramidReader::RequestData(
  vtkInformation* request, vtkInformationVector** inputVector, vtkInformationVector* outputVector)
{
  // Comes also after RequestInformation() has failed.
  if (!this->FitsMemory() || !this->Superclass::RequestData(request, inputVector, outputVector))
  {
    return 0;
  }
  vtkFieldData* fields = vtkImageData::GetData(outputVector)->GetFieldData();
  AddCount(fields, "Presented level", this->GetPresentedLevel());
  vtkStringArray* levels = this->GetLevelTexts();
  for (vtkIdType level = 0; level < levels->GetNumberOfValues(); ++level)
  {
    AddText(fields, "Level " + std::to_string(level), levels->GetValue(level));
  }
  // ParaView shows six texts of an array and puts nothing between them.
  vtkStringArray* channels = this->GetChannelNames();
  std::string text;
  for (vtkIdType channel = 0; channel < channels->GetNumberOfValues(); ++channel)
  {
    text += (channel > 0 ? ", " : "") + std::string(channels->GetValue(channel));
  }
  AddText(fields, "Channels", text);
  AddCount(fields, "Time steps", this->GetNumberOfSteps());
  AddCount(fields, "Bricks", this->GetNumberOfBricks());
  AddCount(fields, "Bytes", this->GetNumberOfVoxelBytes());
  return 1;
}

void vtkPVHDF5PyramidReader::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "Files: " << this->Files.size() << "\n";
}
