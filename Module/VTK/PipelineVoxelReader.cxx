// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "PipelineVoxelReader.h"

#include "ErrorText.h"
#include "VTKScalarType.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <exception>
#include <limits>
#include <memory>
#include <utility>
#include <vtkAlgorithm.h>
#include <vtkCallbackCommand.h>
#include <vtkCellData.h>
#include <vtkDataArray.h>
#include <vtkImageData.h>
#include <vtkInformation.h>
#include <vtkInformationVector.h>
#include <vtkMatrix3x3.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkStreamingDemandDrivenPipeline.h>
#include <vtkTrivialProducer.h>

namespace teravox
{
namespace
{

std::string Quoted(const std::string& name)
{
  return name.empty() ? "without a name" : "\"" + name + "\"";
}

} // namespace

PipelineVoxelReader::PipelineVoxelReader(vtkAlgorithm* producer, int port, Options options)
  : Producer(producer)
  , Port(port)
  , Settings(std::move(options))
{
}

Result<std::shared_ptr<PipelineVoxelReader>> PipelineVoxelReader::Make(
  vtkAlgorithm* producer, int port, const Options& options)
{
  auto reader = std::make_shared<PipelineVoxelReader>(producer, port, options);
  Status status = reader->Open();
  if (!status.Ok())
  {
    return status;
  }
  return reader;
}

Status PipelineVoxelReader::Open()
{
  if (this->Producer->UpdateInformation(); !this->Producer->GetOutputInformation(this->Port))
  {
    return { StatusCode::InvalidArgument,
      "The input has no output port " + std::to_string(this->Port) + "." };
  }
  vtkInformation* info = this->Producer->GetOutputInformation(this->Port);
  if (!info->Has(vtkStreamingDemandDrivenPipeline::WHOLE_EXTENT()))
  {
    return { StatusCode::InvalidArgument,
      "The input tells no extent: it isn't an image, or it couldn't be opened." };
  }
  info->Get(vtkStreamingDemandDrivenPipeline::WHOLE_EXTENT(), this->WholeExtent.data());
  double points = 1.0;
  std::array<int, 6> first{};
  for (std::size_t a = 0; a < 3; ++a)
  {
    const double count =
      static_cast<double>(this->WholeExtent[2 * a + 1]) - this->WholeExtent[2 * a] + 1.0;
    if (count < 1.0)
    {
      return { StatusCode::InvalidArgument, "The input image has no voxels." };
    }
    points *= count;
    first[2 * a] = this->WholeExtent[2 * a];
    // Two points, so that cell data have one cell.
    first[2 * a + 1] = this->WholeExtent[2 * a] + (count > 1.0 ? 1 : 0);
  }
  // Eight bytes and four components are the largest voxels there are.
  const bool inMemory = vtkTrivialProducer::SafeDownCast(this->Producer) != nullptr;
  const int bytesPerVoxel = [&]
  {
    const int type = vtkImageData::HasScalarType(info) ? vtkImageData::GetScalarType(info) : 0;
    const auto known = FromVTK(type);
    return known && vtkImageData::HasNumberOfScalarComponents(info)
      ? static_cast<int>(SizeOf(*known)) * vtkImageData::GetNumberOfScalarComponents(info)
      : 32;
  }();
  this->Whole =
    inMemory || points * bytesPerVoxel <= static_cast<double>(this->Settings.WholeLimit);
  auto image = this->UpdateExtent(this->Whole ? this->WholeExtent : first);
  if (!image.Ok())
  {
    return image.GetStatus();
  }
  if (this->Whole && !inMemory)
  {
    this->Held = static_cast<std::uint64_t>(points * bytesPerVoxel);
  }
  return this->OpenGeometry(image.Value());
}

Status PipelineVoxelReader::OpenGeometry(vtkImageData* image)
{
  auto found = this->FindArray(image);
  if (!found.Ok())
  {
    return found.GetStatus();
  }
  vtkDataArray* array = found.Value();
  this->FoundName = array->GetName() ? array->GetName() : "";
  const auto type = FromVTK(array->GetDataType());
  if (!type)
  {
    return { StatusCode::Unsupported,
      "The array " + Quoted(this->FoundName) + " has the type " + array->GetDataTypeAsString() +
        "; pyramids have integers of 8, 16 and 32 bits and floats of 32 and 64 bits." };
  }
  Description& volume = this->Volume;
  volume.Type = *type;
  volume.Components = array->GetNumberOfComponents();
  if (volume.Components < 1 || volume.Components > 4)
  {
    return { StatusCode::Unsupported,
      "The array " + Quoted(this->FoundName) + " has " + std::to_string(volume.Components) +
        " components; pyramids have 1 to 4." };
  }
  if (!this->FoundName.empty())
  {
    volume.ArrayName = this->FoundName;
  }
  volume.FillValue = this->Settings.FillValue;
  vtkMatrix3x3* direction = image->GetDirectionMatrix();
  if (!(std::abs(direction->Determinant()) > 1e-12))
  {
    return { StatusCode::InvalidArgument, "The direction matrix of the input is singular." };
  }
  for (std::size_t a = 0; a < 3; ++a)
  {
    volume.Spacing[a] = image->GetSpacing()[a];
    if (!(volume.Spacing[a] > 0.0) || !std::isfinite(volume.Spacing[a]))
    {
      return { StatusCode::InvalidArgument,
        "The spacing of the input is " + std::to_string(volume.Spacing[a]) + " along axis " +
          std::to_string(a) + "; it must be above 0." };
    }
    volume.ExtentStart[a] = this->WholeExtent[2 * a];
    volume.Dimensions[a] = std::int64_t{ this->WholeExtent[2 * a + 1] } - this->WholeExtent[2 * a] +
      (volume.CellData ? 0 : 1);
    if (volume.Dimensions[a] < 1)
    {
      return { StatusCode::InvalidArgument,
        "The input has cell data, but no cell along axis " + std::to_string(a) + "." };
    }
  }
  for (std::size_t row = 0; row < 3; ++row)
  {
    volume.Origin[row] = image->GetOrigin()[row];
    for (std::size_t a = 0; a < 3; ++a)
    {
      const double d = direction->GetElement(static_cast<int>(row), static_cast<int>(a));
      volume.Direction[3 * row + a] = d;
      volume.Origin[row] += d * volume.Spacing[a] *
        (static_cast<double>(volume.ExtentStart[a]) + (volume.CellData ? 0.5 : 0.0));
    }
  }
  return {};
}

Result<vtkImageData*> PipelineVoxelReader::UpdateExtent(const std::array<int, 6>& extent)
{
  auto* executive = vtkStreamingDemandDrivenPipeline::SafeDownCast(this->Producer->GetExecutive());
  if (!executive)
  {
    return Status(StatusCode::Unsupported, "The input isn't a streaming pipeline.");
  }
  // With an observer VTK hands the text over instead of printing it. Some readers report an error
  // and succeed all the same.
  std::string reported;
  vtkNew<vtkCallbackCommand> observer;
  observer->SetClientData(&reported);
  observer->SetCallback(
    [](vtkObject*, unsigned long, void* client, void* text)
    {
      auto* first = static_cast<std::string*>(client);
      if (first->empty())
      {
        *first = ErrorText(static_cast<const char*>(text));
      }
    });
  const unsigned long tag = this->Producer->AddObserver(vtkCommand::ErrorEvent, observer);
  bool updated = false;
  try
  {
    executive->UpdateInformation();
    vtkInformation* info = executive->GetOutputInformation(this->Port);
    info->Set(vtkStreamingDemandDrivenPipeline::UPDATE_EXTENT(), extent.data(), 6);
    updated = executive->Update(this->Port) != 0;
  }
  catch (const std::exception& error)
  {
    reported = std::string("it failed with ") + error.what() + ".";
  }
  this->Producer->RemoveObserver(tag);
  auto* image = vtkImageData::SafeDownCast(this->Producer->GetOutputDataObject(this->Port));
  if (this->Producer->GetAbortExecute() != 0)
  {
    return Status(StatusCode::Cancelled, "Reading the input was stopped.");
  }
  if (!updated || !image || !reported.empty() || this->Producer->GetErrorCode() != 0)
  {
    return Status(StatusCode::InputOutput,
      reported.empty() ? "The input couldn't be read." : "The input couldn't be read: " + reported);
  }
  const int* has = image->GetExtent();
  for (std::size_t a = 0; a < 3; ++a)
  {
    if (has[2 * a] > extent[2 * a] || has[2 * a + 1] < extent[2 * a + 1])
    {
      return Status(StatusCode::InputOutput,
        "The input delivered the voxels " + std::to_string(has[2 * a]) + " to " +
          std::to_string(has[2 * a + 1]) + " along axis " + std::to_string(a) + " instead of " +
          std::to_string(extent[2 * a]) + " to " + std::to_string(extent[2 * a + 1]) + ".");
    }
  }
  return image;
}

Result<vtkDataArray*> PipelineVoxelReader::FindArray(vtkImageData* image)
{
  vtkDataSetAttributes* const attributes[2] = { image->GetPointData(), image->GetCellData() };
  const std::int64_t tuples[2] = { image->GetNumberOfPoints(), image->GetNumberOfCells() };
  for (const bool cells : { false, true })
  {
    vtkDataSetAttributes* data = attributes[cells ? 1 : 0];
    vtkDataArray* array = nullptr;
    if (!this->Settings.ArrayName.empty())
    {
      array = data->GetArray(this->Settings.ArrayName.c_str());
    }
    else
    {
      array = data->GetScalars();
      if (!array && data->GetNumberOfArrays() == 1)
      {
        array = data->GetArray(0);
      }
    }
    if (array && array->GetNumberOfTuples() == tuples[cells ? 1 : 0])
    {
      this->Volume.CellData = cells;
      return array;
    }
  }
  return Status(StatusCode::NotFound,
    this->Settings.ArrayName.empty()
      ? "The input has no scalars."
      : "The input has no array " + Quoted(this->Settings.ArrayName) + ".");
}

Status PipelineVoxelReader::ReadBox(const Int3& start, const Int3& size, void* out)
{
  // Whole slices where one fits into a piece, else rows of one slice: both lie densely in `out`.
  const std::uint64_t rowBytes = static_cast<std::uint64_t>(size[0]) * SizeOf(this->Volume.Type) *
    static_cast<std::uint64_t>(this->Volume.Components);
  const auto limit = this->Whole ? std::numeric_limits<std::int64_t>::max()
                                 : static_cast<std::int64_t>(this->Settings.PieceLimit / rowBytes);
  const std::int64_t rows = std::clamp<std::int64_t>(limit, 1, size[1]);
  const std::int64_t slices = std::clamp<std::int64_t>(limit / size[1], 1, size[2]);
  auto* to = static_cast<std::byte*>(out);
  for (std::int64_t z = 0; z < size[2]; z += slices)
  {
    for (std::int64_t y = 0; y < size[1]; y += rows)
    {
      const Int3 piece{ size[0], std::min(rows, size[1] - y), std::min(slices, size[2] - z) };
      Status status = this->ReadPiece({ start[0], start[1] + y, start[2] + z }, piece, to);
      if (!status.Ok())
      {
        return status;
      }
      to += rowBytes * static_cast<std::uint64_t>(piece[1] * piece[2]);
    }
  }
  return {};
}

std::size_t PipelineVoxelReader::VoxelBytes() const
{
  return SizeOf(this->Volume.Type) * static_cast<std::size_t>(this->Volume.Components);
}

Result<PipelineVoxelReader::Piece> PipelineVoxelReader::UpdatePiece(
  const Int3& start, const Int3& size)
{
  const int more = this->Volume.CellData ? 0 : 1;
  std::array<int, 6> extent{};
  for (std::size_t a = 0; a < 3; ++a)
  {
    extent[2 * a] = static_cast<int>(this->WholeExtent[2 * a] + start[a]);
    extent[2 * a + 1] = static_cast<int>(extent[2 * a] + size[a] - more);
  }
  auto image = this->UpdateExtent(this->Whole ? this->WholeExtent : extent);
  if (!image.Ok())
  {
    return image.GetStatus();
  }
  const bool cellsBefore = this->Volume.CellData;
  auto found = this->FindArray(image.Value());
  if (!found.Ok())
  {
    return found.GetStatus();
  }
  vtkDataArray* array = found.Value();
  if (array->GetDataType() != ToVTK(this->Volume.Type) &&
    FromVTK(array->GetDataType()) != this->Volume.Type)
  {
    return Status(StatusCode::Corrupt, "The input changed its scalar type between two boxes.");
  }
  if (array->GetNumberOfComponents() != this->Volume.Components ||
    this->Volume.CellData != cellsBefore || !array->HasStandardMemoryLayout())
  {
    return Status(StatusCode::Unsupported,
      "The input changed its array between two boxes, or holds it in a layout of its own.");
  }
  const int* has = image.Value()->GetExtent();
  Int3 dims{};
  for (std::size_t a = 0; a < 3; ++a)
  {
    dims[a] = std::int64_t{ has[2 * a + 1] } - has[2 * a] + more;
  }
  const std::int64_t first =
    ((extent[4] - has[4]) * dims[1] + (extent[2] - has[2])) * dims[0] + extent[0] - has[0];
  return Piece{ image.Value(),
    static_cast<const std::byte*>(array->GetVoidPointer(0)) +
      static_cast<std::size_t>(first) * this->VoxelBytes(),
    dims[0], dims[0] * dims[1] };
}

const void* PipelineVoxelReader::FindBox(const Int3& start, const Int3& size)
{
  if (!this->Whole)
  {
    return nullptr;
  }
  const auto piece = this->UpdatePiece(start, size);
  const bool dense = piece.Ok() && piece.Value().Row == size[0] &&
    (piece.Value().Slice == size[0] * size[1] || size[2] == 1);
  return dense ? piece.Value().First : nullptr; // ReadBox() says what is wrong
}

Status PipelineVoxelReader::ReadPiece(const Int3& start, const Int3& size, std::byte* out)
{
  const auto piece = this->UpdatePiece(start, size);
  if (!piece.Ok())
  {
    return piece.GetStatus();
  }
  const auto rowBytes = static_cast<std::size_t>(size[0]) * this->VoxelBytes();
  std::byte* to = out;
  for (std::int64_t z = 0; z < size[2]; ++z)
  {
    for (std::int64_t y = 0; y < size[1]; ++y, to += rowBytes)
    {
      const auto voxel = static_cast<std::size_t>(z * piece.Value().Slice + y * piece.Value().Row);
      std::memcpy(to, piece.Value().First + voxel * this->VoxelBytes(), rowBytes);
    }
  }
  if (!this->Whole)
  {
    piece.Value().Image->ReleaseData(); // the next box shall not find room taken by this one
  }
  return {};
}

} // namespace teravox
