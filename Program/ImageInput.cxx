// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "ImageInput.h"

#include "ByteCount.h"
#include "HDF5BrickSource.h"
#include "Import/PieceIndex.h"
#include "VolumeInput.h"
#include "vtkBrickSource.h"
#include "vtkHDF5PyramidReader.h"
#include "vtkImagePiecesReader.h"

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

/// Of VTK's readers, which read what ours leave, or formats that ours don't know.
struct WholeReader
{
  std::vector<const char*> Ends;
  Opened (*Open)(const std::string& fileName);
};

const std::vector<WholeReader>& WholeReaders()
{
  static const std::vector<WholeReader> readers{
    { { ".nii", ".nii.gz", ".hdr", ".hdr.gz", ".img", ".img.gz" },
      &OpenImageFile<vtkNIFTIImageReader> },
    { { ".mha", ".mhd" }, &OpenImageFile<vtkMetaImageReader> },
    { { ".nrrd", ".nhdr" }, &OpenImageFile<vtkNrrdReader> },
    { { ".tif", ".tiff" }, &OpenImageFile<vtkTIFFReader> }, { { ".vtk" }, &OpenLegacyImage }
  };
  return readers;
}

/// Parallel VTK images stream, as serial ones do; so all their files are known.
Result<ImageInput> OpenPieces(const std::string& fileName, const std::string& array)
{
  const auto index = PieceIndex::Read(fileName);
  if (!index.Ok())
  {
    return index.GetStatus();
  }
  const auto reader = vtkSmartPointer<vtkImagePiecesReader>::New();
  reader->SetFileName(fileName.c_str());
  reader->SetArrayName(array.c_str());
  ImageInput input{ { nullptr, { fileName }, 0 }, reader.GetPointer() };
  for (const PieceIndex::Piece& piece : index.Value().Pieces)
  {
    input.Volume.Files.push_back(piece.File);
  }
  return input;
}

/// Its chunks are kept in at most this many bytes.
Opened OpenHDF5(const VolumeOptions& options, std::uint64_t chunks)
{
  const auto reader = vtkSmartPointer<vtkHDF5PyramidReader>::New();
  reader->SetFileName(options.Name.c_str());
  reader->SetDatasetPath(options.Dataset.c_str());
  reader->SetChannel(options.Channel);
  reader->SetTimePoint(options.TimePoint);
  reader->SetLevel(0);
  if (vtkBrickSource* source = reader->GetBrickSource())
  {
    source->GetBrickSource()->SetMemoryBudget(chunks);
  }
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

Result<ImageInput> Streamed(const Result<ImageVolume>& volume)
{
  if (!volume.Ok())
  {
    return volume.GetStatus();
  }
  return ImageInput{ volume.Value(), nullptr };
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
  return ImageInput{ { nullptr, { fileName }, 0 }, opened.Value() };
}

/// VTK's reader by extension; null: it has none that is used.
const WholeReader* WholeReaderOf(const std::string& lower)
{
  const auto found = std::find_if(WholeReaders().begin(), WholeReaders().end(),
    [&](const WholeReader& reader) { return EndsWithAny(lower, reader.Ends); });
  return found == WholeReaders().end() ? nullptr : &*found;
}

/// Why what VTK would read isn't, and what to do; empty for other extensions.
std::string Refusal(const std::string& lower)
{
  return EndsWithAny(lower, { ".dem" }) ? "holds heights of a surface, not a volume."
    : EndsWithAny(lower, { ".sgy", ".segy", ".seg" })
    ? "holds traces, which may be anywhere: write them as raw voxels or HDF5 (segyio), then "
      "convert "
      "that."
    : EndsWithAny(lower, { ".cube" })
    ? "is a Gaussian cube: give the grid that vtkGaussianCubeReader2 reads to Python's "
      "teravox.convert()."
    : EndsWithAny(lower, { ".mr", ".ct" })
    ? "is by its extension a GE Signa slice: convert the series to DICOM, then its folder."
    : "";
}

/// Ours, or VTK's for what ours leave.
Result<ImageInput> StreamedOrWhole(Result<ImageInput> streamed, const std::string& fileName,
  const ImportOptions& import, std::uint64_t memory)
{
  const WholeReader* reader = WholeReaderOf(Lower(fileName));
  if (streamed.Ok() || streamed.GetStatus().Code() != StatusCode::Unsupported || import.Spacing ||
    import.Origin || reader == nullptr)
  {
    return streamed;
  }
  const Opened opened = reader->Open(fileName);
  return opened.Ok() ? Whole(opened, fileName, memory) : Result<ImageInput>(streamed.GetStatus());
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
  return Streamed(ImageVolume::Open(Result<RawVolume>(raw), options.Name, memory));
}

} // namespace

bool IsHDF5Name(const std::string& fileName)
{
  return EndsWithAny(Lower(fileName),
    { ".h5", ".hdf5", ".hdf", ".vtkhdf", ".ims", ".xml", ".emd", ".nxs", ".he5", ".mnc" });
}

bool IsRaw(const VolumeOptions& options, const ImportOptions& import)
{
  return import.Raw || EndsWith(Lower(options.Name), ".raw");
}

Result<ImageInput> OpenImage(const VolumeOptions& options, const ImportOptions& import,
  const std::string& array, std::uint64_t memory)
{
  const std::string& fileName = options.Name;
  const std::string lower = Lower(fileName);
  const auto any = [&](const std::vector<const char*>& ends) { return EndsWithAny(lower, ends); };
  if (ImageVolume::IsImage(fileName) && !IsRaw(options, import))
  {
    ImageVolume::Request request;
    request.Name = fileName;
    request.Channel = options.Channel;
    request.TimePoint = options.TimePoint;
    request.Series = options.Dataset;
    request.Memory = memory;
    return StreamedOrWhole(Streamed(ImageVolume::Open(request)), fileName, import, memory);
  }
  std::error_code error;
  if (!std::filesystem::exists(fileName, error))
  {
    return Status(StatusCode::NotFound, fmt::format("{} doesn't exist.", fileName));
  }
  if (IsRaw(options, import))
  {
    return OpenRaw(options, import, memory);
  }
  if (import.Spacing || import.Origin)
  {
    return Status(StatusCode::InvalidArgument,
      fmt::format(
        "{} says itself where its voxels lie; --spacing and --origin are for images.", fileName));
  }
  if (any({ ".pvti" }))
  {
    return OpenPieces(fileName, array);
  }
  if (const WholeReader* reader = WholeReaderOf(lower))
  {
    return Whole(reader->Open(fileName), fileName, memory);
  }
  if (const std::string refusal = Refusal(lower); !refusal.empty())
  {
    return Status(StatusCode::Unsupported, fmt::format("{} {}", fileName, refusal));
  }
  const bool chunked = IsHDF5Name(fileName);
  const std::uint64_t chunks = chunked ? std::min(memory / 4, HDF5OpenOptions().MemoryBudget) : 0;
  const Opened opened = any({ ".vti" }) ? OpenXMLImage(fileName)
    : chunked
    ? OpenHDF5(options, chunks)
    : Opened(Status(StatusCode::Unsupported,
        fmt::format("{} has an extension that no reader belongs to; known are .nii, "
                    ".nii.gz, .mha, .mhd, .nrrd, .mrc, .map, .tif, .png, .jpg, .dcm, .raw, .vti, "
                    ".pvti, .vtk, .h5, .ims and .xml, and with --raw voxels without a header.",
          fileName)));
  return opened.Ok()
    ? Result<ImageInput>(ImageInput{ { nullptr, { fileName }, chunks }, opened.Value() })
    : Result<ImageInput>(opened.GetStatus());
}

} // namespace teravox::program
