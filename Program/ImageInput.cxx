// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "ImageInput.h"

#include "vtkHDF5PyramidReader.h"

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fmt/format.h>
#include <system_error>
#include <vector>
#include <vtkImageReader2.h>
#include <vtkMetaImageReader.h>
#include <vtkNIFTIImageReader.h>
#include <vtkNrrdReader.h>
#include <vtkStructuredPointsReader.h>
#include <vtkTIFFReader.h>
#include <vtkXMLImageDataReader.h>

namespace teravox::program
{
namespace
{

using Opened = Result<vtkSmartPointer<vtkAlgorithm>>;

template <typename Reader>
Opened OpenImageFile(const std::string& fileName)
{
  const auto reader = vtkSmartPointer<Reader>::New();
  if (reader->CanReadFile(fileName.c_str()) == 0)
  {
    return Status(StatusCode::Corrupt,
      fmt::format("{} isn't what its extension says, or it is damaged.", fileName));
  }
  reader->SetFileName(fileName.c_str());
  return vtkSmartPointer<vtkAlgorithm>(reader.GetPointer());
}

Opened OpenXMLImage(const std::string& fileName)
{
  return OpenImageFile<vtkXMLImageDataReader>(fileName);
}

Opened OpenLegacyImage(const std::string& fileName)
{
  const auto reader = vtkSmartPointer<vtkStructuredPointsReader>::New();
  reader->SetFileName(fileName.c_str());
  if (reader->IsFileStructuredPoints() == 0)
  {
    return Status(StatusCode::Unsupported,
      fmt::format("{} isn't a legacy VTK file with structured points.", fileName));
  }
  return vtkSmartPointer<vtkAlgorithm>(reader.GetPointer());
}

Opened OpenHDF5(const std::string& fileName, const std::string& dataset)
{
  const auto reader = vtkSmartPointer<vtkHDF5PyramidReader>::New();
  reader->SetFileName(fileName.c_str());
  reader->SetDatasetPath(dataset.c_str());
  reader->SetLevel(0);
  return vtkSmartPointer<vtkAlgorithm>(reader.GetPointer());
}

bool EndsWith(const std::string& text, const std::string& end)
{
  return text.size() >= end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

} // namespace

Opened OpenImage(const std::string& fileName, const std::string& dataset)
{
  std::error_code error;
  const auto status = std::filesystem::status(fileName, error);
  if (!std::filesystem::exists(status))
  {
    return Status(StatusCode::NotFound, fmt::format("{} doesn't exist.", fileName));
  }
  if (std::filesystem::is_directory(status))
  {
    return Status(StatusCode::InvalidArgument, fmt::format("{} is a folder.", fileName));
  }
  std::string lower = fileName;
  std::transform(lower.begin(), lower.end(), lower.begin(),
    [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  const auto any = [&](const std::vector<const char*>& ends)
  {
    return std::any_of(ends.begin(), ends.end(), [&](const char* e) { return EndsWith(lower, e); });
  };
  if (any({ ".nii", ".nii.gz", ".hdr", ".img", ".img.gz" }))
  {
    return OpenImageFile<vtkNIFTIImageReader>(fileName);
  }
  if (any({ ".mha", ".mhd" }))
  {
    return OpenImageFile<vtkMetaImageReader>(fileName);
  }
  if (any({ ".nrrd", ".nhdr" }))
  {
    return OpenImageFile<vtkNrrdReader>(fileName);
  }
  if (any({ ".tif", ".tiff" }))
  {
    return OpenImageFile<vtkTIFFReader>(fileName);
  }
  if (any({ ".vti" }))
  {
    return OpenXMLImage(fileName);
  }
  if (any({ ".vtk" }))
  {
    return OpenLegacyImage(fileName);
  }
  if (any({ ".h5", ".hdf5", ".hdf", ".vtkhdf" }))
  {
    return OpenHDF5(fileName, dataset);
  }
  return Status(StatusCode::Unsupported,
    fmt::format("{} has an extension that no reader belongs to; known are .nii, .nii.gz, .mha, "
                ".mhd, .nrrd, .vti, .vtk, .tif and .h5.",
      fileName));
}

} // namespace teravox::program
