// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "ImageVolume.h"

#include "DICOMSeries.h"
#include "FileList.h"
#include "PictureStack.h"
#include "SLCVolume.h"
#include "SliceVoxelReader.h"
#include "TIFFStack.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <system_error>
#include <utility>

namespace teravox
{

namespace
{
enum class Kind
{
  None,
  MetaImage,
  NRRD,
  NIfTI,
  TIFF,
  Picture,
  DICOM,
  LegacyVTK,
  MRC,
  SLC
};

struct Extension
{
  const char* End;
  Kind Of;
};

constexpr std::array<Extension, 33> Extensions{ { { ".nii", Kind::NIfTI },
  { ".nii.gz", Kind::NIfTI }, { ".hdr", Kind::NIfTI }, { ".hdr.gz", Kind::NIfTI },
  { ".img", Kind::NIfTI }, { ".img.gz", Kind::NIfTI }, { ".mha", Kind::MetaImage },
  { ".mhd", Kind::MetaImage }, { ".nrrd", Kind::NRRD }, { ".nhdr", Kind::NRRD },
  { ".tif", Kind::TIFF }, { ".tiff", Kind::TIFF }, { ".png", Kind::Picture },
  { ".jpg", Kind::Picture }, { ".jpeg", Kind::Picture }, { ".bmp", Kind::Picture },
  { ".pnm", Kind::Picture }, { ".pgm", Kind::Picture }, { ".ppm", Kind::Picture },
  { ".tga", Kind::Picture }, { ".dcm", Kind::DICOM }, { ".vtk", Kind::LegacyVTK },
  { ".slc", Kind::SLC }, { ".mrc", Kind::MRC }, { ".mrcs", Kind::MRC }, { ".map", Kind::MRC },
  { ".ccp4", Kind::MRC }, { ".rec", Kind::MRC }, { ".st", Kind::MRC }, { ".ali", Kind::MRC },
  { ".mrc.gz", Kind::MRC }, { ".map.gz", Kind::MRC }, { ".ccp4.gz", Kind::MRC } } };

Kind KindByName(const std::string& name)
{
  std::string lower = name;
  std::transform(lower.begin(), lower.end(), lower.begin(),
    [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  for (const Extension& extension : Extensions)
  {
    const std::string end = extension.End;
    if (lower.size() >= end.size() &&
      lower.compare(lower.size() - end.size(), end.size(), end) == 0)
    {
      return extension.Of;
    }
  }
  return Kind::None;
}

bool IsFolder(const std::string& name)
{
  std::error_code error;
  return std::filesystem::is_directory(name, error);
}

Result<ImageVolume> OfReader(const Result<std::shared_ptr<VoxelReader>>& reader,
  std::uint64_t memory, std::vector<std::string> files)
{
  if (!reader.Ok())
  {
    return reader.GetStatus();
  }
  ImageVolume volume;
  if (const auto* slices = dynamic_cast<const SliceVoxelReader*>(reader.Value().get()))
  {
    volume.ReaderBytes =
      std::max<std::uint64_t>(memory / 4, slices->SliceBytes()) + slices->DecoderBytes();
    if (volume.ReaderBytes > memory / 2)
    {
      return Status(StatusCode::ResourceExhausted,
        "A slice of " + files.front() + " takes " + std::to_string(volume.ReaderBytes) +
          " bytes of memory; half of what is allowed is " + std::to_string(memory / 2) + ".");
    }
  }
  volume.Reader = reader.Value();
  volume.Files = std::move(files);
  return volume;
}

Result<ImageVolume> OpenStack(const ImageVolume::Request& request, std::vector<std::string> files)
{
  TIFFStack::Request stack;
  stack.Files = files;
  stack.Channel = request.Channel;
  stack.TimePoint = request.TimePoint;
  stack.CacheBytes = request.Memory / 4;
  std::vector<std::string> others;
  const auto reader = TIFFStack::Open(stack, others);
  files.insert(files.end(), others.begin(), others.end());
  return OfReader(reader, request.Memory, std::move(files));
}

Result<ImageVolume> OpenPictures(
  const ImageVolume::Request& request, std::vector<std::string> files)
{
  PictureStack::Request stack;
  stack.Files = files;
  stack.CacheBytes = request.Memory / 4;
  return OfReader(PictureStack::Open(stack), request.Memory, std::move(files));
}

/// Damaged ones, too, which their names tell.
bool IsPicture(const std::string& file)
{
  const Kind kind = KindByName(file);
  return kind == Kind::Picture || (kind == Kind::None && PictureStack::IsPicture(file));
}

Result<ImageVolume> OpenSeries(const ImageVolume::Request& request, std::vector<std::string> files)
{
  DICOMSeries::Request series;
  series.Files = files;
  series.Series = request.Series;
  series.CacheBytes = request.Memory / 4;
  return OfReader(DICOMSeries::Open(series), request.Memory, std::move(files));
}

/// A folder or a pattern.
Result<ImageVolume> OpenSeveral(
  const ImageVolume::Request& request, const std::vector<std::string>& files)
{
  if (std::any_of(files.begin(), files.end(), &DICOMSeries::IsDICOM))
  {
    return OpenSeries(request, files);
  }
  const auto those = [&files](const auto& wanted)
  {
    std::vector<std::string> found;
    std::copy_if(files.begin(), files.end(), std::back_inserter(found), wanted);
    return found;
  };
  auto slices = those([](const std::string& file) { return KindByName(file) == Kind::TIFF; });
  if (!slices.empty())
  {
    return OpenStack(request, std::move(slices));
  }
  slices = those(&IsPicture);
  if (!slices.empty())
  {
    return OpenPictures(request, std::move(slices));
  }
  return Status(StatusCode::NotFound,
    request.Name +
      (IsPattern(request.Name)
          ? " matches no DICOM, TIFF, PNG, JPEG, PNM, BMP or TGA files."
          : " is a folder without DICOM, TIFF, PNG, JPEG, PNM, BMP or TGA files."));
}

Result<ImageVolume> OpenVoxels(
  const Result<RawVolume>& volume, const std::string& name, std::uint64_t memory)
{
  if (!volume.Ok())
  {
    return volume.GetStatus();
  }
  std::vector<std::string> files = volume.Value().Files;
  if (files.empty() || files.front() != name)
  {
    files.push_back(name);
  }
  return OfReader(RawVolume::Open(volume.Value(), memory / 4), memory, std::move(files));
}

Result<ImageVolume> OpenAny(const ImageVolume::Request& request)
{
  const std::string& name = request.Name;
  if (IsPattern(name))
  {
    return OpenSeveral(request, FilesLike(name));
  }
  std::error_code error;
  if (!std::filesystem::exists(name, error))
  {
    return Status(StatusCode::NotFound, name + " doesn't exist.");
  }
  if (IsFolder(name))
  {
    return OpenSeveral(request, FilesIn(name));
  }
  switch (KindByName(name))
  {
    case Kind::NIfTI:
      return OpenVoxels(ReadNIfTIHeader(name, request.TimePoint), name, request.Memory);
    case Kind::MetaImage:
      return OpenVoxels(ReadMetaImageHeader(name), name, request.Memory);
    case Kind::NRRD:
      return OpenVoxels(ReadNRRDHeader(name), name, request.Memory);
    case Kind::LegacyVTK:
      return OpenVoxels(ReadLegacyVTKHeader(name), name, request.Memory);
    case Kind::MRC:
      return OpenVoxels(ReadMRCHeader(name, request.TimePoint), name, request.Memory);
    case Kind::SLC:
      return OfReader(OpenSLC(name, request.Memory / 4), request.Memory, { name });
    case Kind::TIFF:
      return OpenStack(request, { name });
    case Kind::Picture:
      return OpenPictures(request, { name });
    case Kind::DICOM:
      return OpenSeries(request, { name });
    case Kind::None:
    default:
      break;
  }
  return DICOMSeries::IsDICOM(name) ? OpenSeries(request, { name })
    : IsPicture(name)               ? OpenPictures(request, { name })
    : IsMRC(name) ? OpenVoxels(ReadMRCHeader(name, request.TimePoint), name, request.Memory)
                  : Result<ImageVolume>(Status(
                      StatusCode::Unsupported, name + " is no image that is read piece by piece."));
}

/// Callers are VTK and Python, which no exception may reach.
template <typename F>
Result<ImageVolume> WithoutExceptions(const std::string& name, const F& open)
{
  try
  {
    return open();
  }
  catch (const std::exception& error)
  {
    return Status(StatusCode::ResourceExhausted, name + " can't be opened: " + error.what() + ".");
  }
}
} // namespace

bool ImageVolume::IsImage(const std::string& name)
{
  return IsPattern(name) || IsFolder(name) || KindByName(name) != Kind::None ||
    DICOMSeries::IsDICOM(name) || PictureStack::IsPicture(name) || IsMRC(name);
}

Result<ImageVolume> ImageVolume::Open(
  const Result<RawVolume>& volume, const std::string& name, std::uint64_t memory)
{
  return WithoutExceptions(name, [&] { return OpenVoxels(volume, name, memory); });
}

Result<ImageVolume> ImageVolume::Open(const Request& request)
{
  return WithoutExceptions(request.Name, [&] { return OpenAny(request); });
}

std::string ImageVolume::SourceName(
  const std::string& choice, const std::vector<std::string>& files)
{
  std::string text = choice;
  for (const std::string& file : files)
  {
    std::error_code error;
    const auto size = std::filesystem::file_size(file, error);
    const auto time = std::filesystem::last_write_time(file, error).time_since_epoch().count();
    text += "\n" + file + " " + std::to_string(size) + " " + std::to_string(time);
  }
  // Thousands of slices have a long text: its hash tells them apart as well.
  std::uint64_t hash = 14695981039346656037ULL;
  for (const char c : text)
  {
    hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211ULL;
  }
  std::array<char, 32> hex{};
  std::snprintf(hex.data(), hex.size(), "%016llx", static_cast<unsigned long long>(hash));
  return std::to_string(files.size()) + " files " + hex.data();
}

} // namespace teravox
