// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "ImageInput.h"

#include "ByteCount.h"
#include "Import/DICOMSeries.h"
#include "Import/FileList.h"
#include "Import/RawVolume.h"
#include "Import/SliceVoxelReader.h"
#include "Import/TIFFStack.h"
#include "VolumeInput.h"
#include "vtkHDF5PyramidReader.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <filesystem>
#include <fmt/format.h>
#include <system_error>
#include <vector>
#include <vtkDataArray.h>
#include <vtkImageData.h>
#include <vtkImageReader2.h>
#include <vtkInformation.h>
#include <vtkMetaImageReader.h>
#include <vtkNIFTIImageReader.h>
#include <vtkNrrdReader.h>
#include <vtkStreamingDemandDrivenPipeline.h>
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

Opened OpenHDF5(const VolumeOptions& options)
{
  const auto reader = vtkSmartPointer<vtkHDF5PyramidReader>::New();
  reader->SetFileName(options.Name.c_str());
  reader->SetDatasetPath(options.Dataset.c_str());
  reader->SetChannel(options.Channel);
  reader->SetTimePoint(options.TimePoint);
  reader->SetLevel(0);
  return vtkSmartPointer<vtkAlgorithm>(reader.GetPointer());
}

bool EndsWith(const std::string& text, const std::string& end)
{
  return text.size() >= end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

std::string Lower(const std::string& text)
{
  std::string lower = text;
  std::transform(lower.begin(), lower.end(), lower.begin(),
    [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return lower;
}

bool EndsWithAny(const std::string& text, const std::vector<const char*>& ends)
{
  return std::any_of(
    ends.begin(), ends.end(), [&](const char* end) { return EndsWith(text, end); });
}

Result<ImageInput> Streamed(const Result<std::shared_ptr<VoxelReader>>& reader,
  std::uint64_t memory, std::vector<std::string> files)
{
  if (!reader.Ok())
  {
    return reader.GetStatus();
  }
  ImageInput input;
  if (const auto* slices = dynamic_cast<const SliceVoxelReader*>(reader.Value().get()))
  {
    input.ReaderBytes = std::max<std::uint64_t>(memory / 4, slices->SliceBytes());
    if (input.ReaderBytes > memory / 2)
    {
      return Status(StatusCode::ResourceExhausted,
        fmt::format("A slice of {} takes {} of memory; half of --memory is {}.", files.front(),
          FormatByteCount(static_cast<double>(input.ReaderBytes)),
          FormatByteCount(static_cast<double>(memory) / 2)));
    }
  }
  input.Reader = reader.Value();
  input.Files = std::move(files);
  return input;
}

Result<ImageInput> Streamed(
  const Result<RawVolume>& volume, std::uint64_t memory, const std::string& name)
{
  if (!volume.Ok())
  {
    return volume.GetStatus();
  }
  std::vector<std::string> files = volume.Value().Files;
  if (files.front() != name)
  {
    files.push_back(name);
  }
  return Streamed(RawVolume::Open(volume.Value(), memory / 4), memory, std::move(files));
}

/// VTK's readers of these formats hold the whole volume, whatever part of it is asked for.
Result<ImageInput> Whole(const Opened& opened, const std::string& fileName, std::uint64_t memory)
{
  if (!opened.Ok())
  {
    return opened.GetStatus();
  }
  vtkAlgorithm* reader = opened.Value();
  reader->UpdateInformation();
  vtkInformation* info = reader->GetOutputInformation(0);
  double bytes = 1;
  if (info->Has(vtkStreamingDemandDrivenPipeline::WHOLE_EXTENT()))
  {
    std::array<int, 6> extent{};
    info->Get(vtkStreamingDemandDrivenPipeline::WHOLE_EXTENT(), extent.data());
    for (std::size_t a = 0; a < 3; ++a)
    {
      bytes *= static_cast<double>(extent.at(2 * a + 1)) - extent.at(2 * a) + 1;
    }
    if (vtkImageData::HasScalarType(info) && vtkImageData::HasNumberOfScalarComponents(info))
    {
      bytes *= vtkDataArray::GetDataTypeSize(vtkImageData::GetScalarType(info)) *
        vtkImageData::GetNumberOfScalarComponents(info);
    }
  }
  if (bytes > static_cast<double>(memory) / 2)
  {
    return Status(StatusCode::ResourceExhausted,
      fmt::format(
        "{} can only be read as a whole, which takes {} of memory; half of --memory is {}.",
        fileName, FormatByteCount(bytes), FormatByteCount(static_cast<double>(memory) / 2)));
  }
  return ImageInput{ nullptr, opened.Value(), { fileName }, 0 };
}

/// Ours, or VTK's for what ours leave.
template <typename Reader>
Result<ImageInput> StreamedOrWhole(Result<ImageInput> streamed, const std::string& fileName,
  const ImportOptions& import, std::uint64_t memory)
{
  if (streamed.Ok() || streamed.GetStatus().Code() != StatusCode::Unsupported || import.Spacing ||
    import.Origin)
  {
    return streamed;
  }
  const Opened opened = OpenImageFile<Reader>(fileName);
  return opened.Ok() ? Whole(opened, fileName, memory) : Result<ImageInput>(streamed.GetStatus());
}

Result<ImageInput> OpenStack(
  const VolumeOptions& options, std::uint64_t memory, std::vector<std::string> files)
{
  TIFFStack::Request request;
  request.Files = files;
  request.Channel = options.Channel;
  request.TimePoint = options.TimePoint;
  request.CacheBytes = memory / 4;
  return Streamed(TIFFStack::Open(request), memory, std::move(files));
}

Result<ImageInput> OpenSeries(
  const VolumeOptions& options, std::uint64_t memory, std::vector<std::string> files)
{
  DICOMSeries::Request request;
  request.Files = files;
  request.Series = options.Dataset;
  request.CacheBytes = memory / 4;
  return Streamed(DICOMSeries::Open(request), memory, std::move(files));
}

/// A folder or a pattern.
Result<ImageInput> OpenSeveral(
  const VolumeOptions& options, std::uint64_t memory, const std::vector<std::string>& files)
{
  const auto dicom = [](const std::string& file) { return DICOMSeries::IsDICOM(file); };
  if (std::any_of(files.begin(), files.end(), dicom))
  {
    return OpenSeries(options, memory, files);
  }
  std::vector<std::string> pictures;
  std::copy_if(files.begin(), files.end(), std::back_inserter(pictures),
    [](const std::string& file) {
      return EndsWithAny(Lower(file), { ".tif", ".tiff" });
    });
  if (pictures.empty())
  {
    return Status(StatusCode::NotFound,
      IsPattern(options.Name)
        ? fmt::format("{} matches no DICOM or TIFF files.", options.Name)
        : fmt::format("{} is a folder without DICOM or TIFF files.", options.Name));
  }
  return OpenStack(options, memory, pictures);
}

Result<ImageInput> OpenRaw(
  const VolumeOptions& options, const ImportOptions& import, std::uint64_t memory)
{
  const auto type = ScalarTypeFromName(options.Type);
  if (!type)
  {
    return Status(StatusCode::InvalidArgument,
      fmt::format("'{}' is none of u8, i8, u16, i16, u32, i32, f32, f64.", options.Type));
  }
  RawVolume raw;
  raw.Volume.Dimensions = options.Dimensions;
  raw.Volume.Type = *type;
  raw.Volume.Components = import.Components;
  raw.Files = { options.Name };
  raw.Offset = import.Header.value_or(0);
  raw.BigEndian = import.BigEndian;
  std::error_code error;
  const auto size = static_cast<double>(std::filesystem::file_size(options.Name, error));
  const double wanted = static_cast<double>(SizeOf(*type)) * import.Components *
    static_cast<double>(options.Dimensions[0]) * static_cast<double>(options.Dimensions[1]) *
    static_cast<double>(options.Dimensions[2]);
  if (!import.Header && !error && size > wanted)
  {
    return Status(StatusCode::InvalidArgument,
      fmt::format("{} has {:.0f} bytes, but such voxels take {:.0f}: tell --dimensions, --type, or "
                  "with --header how many bytes come before them.",
        options.Name, size, wanted));
  }
  return Streamed(Result<RawVolume>(raw), memory, options.Name);
}

} // namespace

bool IsHDF5Name(const std::string& fileName)
{
  return EndsWithAny(
    Lower(fileName), { ".h5", ".hdf5", ".hdf", ".vtkhdf", ".ims", ".xml", ".emd", ".nxs", ".he5" });
}

bool IsRaw(const VolumeOptions& options, const ImportOptions& import)
{
  return import.Raw || EndsWith(Lower(options.Name), ".raw");
}

Result<ImageInput> OpenImage(
  const VolumeOptions& options, const ImportOptions& import, std::uint64_t memory)
{
  const std::string& fileName = options.Name;
  if (IsPattern(fileName))
  {
    return OpenSeveral(options, memory, FilesLike(fileName));
  }
  std::error_code error;
  const auto status = std::filesystem::status(fileName, error);
  if (!std::filesystem::exists(status))
  {
    return Status(StatusCode::NotFound, fmt::format("{} doesn't exist.", fileName));
  }
  if (std::filesystem::is_directory(status))
  {
    return OpenSeveral(options, memory, FilesIn(fileName));
  }
  const std::string lower = Lower(fileName);
  const auto any = [&](const std::vector<const char*>& ends) { return EndsWithAny(lower, ends); };
  if (IsRaw(options, import))
  {
    return OpenRaw(options, import, memory);
  }
  if (any({ ".nii", ".nii.gz", ".hdr", ".hdr.gz", ".img", ".img.gz" }))
  {
    return StreamedOrWhole<vtkNIFTIImageReader>(
      Streamed(ReadNIfTIHeader(fileName, options.TimePoint), memory, fileName), fileName, import,
      memory);
  }
  if (any({ ".mha", ".mhd" }))
  {
    return StreamedOrWhole<vtkMetaImageReader>(
      Streamed(ReadMetaImageHeader(fileName), memory, fileName), fileName, import, memory);
  }
  if (any({ ".nrrd", ".nhdr" }))
  {
    return StreamedOrWhole<vtkNrrdReader>(
      Streamed(ReadNRRDHeader(fileName), memory, fileName), fileName, import, memory);
  }
  if (any({ ".tif", ".tiff" }))
  {
    return StreamedOrWhole<vtkTIFFReader>(
      OpenStack(options, memory, { fileName }), fileName, import, memory);
  }
  if (any({ ".dcm" }) || DICOMSeries::IsDICOM(fileName))
  {
    return OpenSeries(options, memory, { fileName });
  }
  if (import.Spacing || import.Origin)
  {
    return Status(StatusCode::InvalidArgument,
      fmt::format(
        "{} says itself where its voxels lie; --spacing and --origin are for images.", fileName));
  }
  if (any({ ".vtk" }))
  {
    return Whole(OpenLegacyImage(fileName), fileName, memory);
  }
  const Opened opened = any({ ".vti" }) ? OpenXMLImage(fileName)
    : IsHDF5Name(fileName)
    ? OpenHDF5(options)
    : Opened(Status(StatusCode::Unsupported,
        fmt::format("{} has an extension that no reader belongs to; known are .nii, "
                    ".nii.gz, .mha, .mhd, .nrrd, .tif, .dcm, .raw, .vti, .vtk, .h5, .ims "
                    "and .xml, and with --raw voxels without a header.",
          fileName)));
  return opened.Ok() ? Result<ImageInput>(ImageInput{ nullptr, opened.Value(), { fileName }, 0 })
                     : Result<ImageInput>(opened.GetStatus());
}

} // namespace teravox::program
