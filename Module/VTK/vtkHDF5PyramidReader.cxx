// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "vtkHDF5PyramidReader.h"

#include "HDF5BrickSource.h"

#include <algorithm>
#include <filesystem>
#include <string>
#include <system_error>
#include <vtkObjectFactory.h>

vtkStandardNewMacro(vtkHDF5PyramidReader);

namespace
{

/// Changes when the file is replaced or written to; empty if there is none.
std::string VersionOf(const std::string& fileName)
{
  std::error_code error;
  const auto size = std::filesystem::file_size(fileName, error);
  if (error)
  {
    return {};
  }
  const auto time = std::filesystem::last_write_time(fileName, error);
  return std::to_string(size) + "/" + std::to_string(time.time_since_epoch().count());
}

teravox::Result<std::shared_ptr<teravox::HDF5BrickSource>> OpenFile(
  const std::string& fileName, const std::string& datasetPath, int brickSize)
{
  teravox::HDF5OpenOptions options;
  options.DatasetPath = datasetPath;
  options.BrickSize = brickSize;
  return teravox::HDF5BrickSource::Open(fileName, options);
}

} // namespace

void vtkHDF5PyramidReader::SetFileName(const char* name)
{
  const std::string value = name ? name : "";
  if (this->FileName != value)
  {
    this->FileName = value;
    this->BrickSourceModified();
  }
}

void vtkHDF5PyramidReader::SetDatasetPath(const char* path)
{
  const std::string value = path ? path : "";
  if (this->DatasetPath != value)
  {
    this->DatasetPath = value;
    this->BrickSourceModified();
  }
}

void vtkHDF5PyramidReader::SetBrickSize(int size)
{
  size = std::clamp(size, 2, 1024);
  if (this->BrickSize != size)
  {
    this->BrickSize = size;
    this->BrickSourceModified();
  }
}

int vtkHDF5PyramidReader::CanReadFile(const char* name)
{
  return name && OpenFile(name, this->DatasetPath, this->BrickSize).Ok() ? 1 : 0;
}

std::shared_ptr<teravox::BrickSource> vtkHDF5PyramidReader::MakeBrickSource(std::string& reason)
{
  if (this->FileName.empty())
  {
    reason = "No file name was set.";
    return nullptr;
  }
  this->CheckedTime = this->GetMTime();
  this->OpenedVersion = VersionOf(this->FileName);
  auto opened = OpenFile(this->FileName, this->DatasetPath, this->BrickSize);
  if (!opened.Ok())
  {
    reason = opened.GetStatus().Message();
    return nullptr;
  }
  return opened.Value();
}

bool vtkHDF5PyramidReader::IsBrickSourceOutdated()
{
  if (this->GetMTime() == this->CheckedTime)
  {
    return false;
  }
  this->CheckedTime = this->GetMTime();
  return VersionOf(this->FileName) != this->OpenedVersion;
}

void vtkHDF5PyramidReader::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "FileName: " << this->FileName << "\n";
  os << indent << "DatasetPath: " << this->DatasetPath << "\n";
  os << indent << "BrickSize: " << this->BrickSize << "\n";
}
