// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "vtkImagePiecesReader.h"

#include "ErrorText.h"
#include "Import/PieceIndex.h"
#include "Status.h"
#include "VTKScalarType.h"

#include <algorithm>
#include <cstring>
#include <exception>
#include <vtkCallbackCommand.h>
#include <vtkCellData.h>
#include <vtkCommand.h>
#include <vtkDataArray.h>
#include <vtkDataArraySelection.h>
#include <vtkImageData.h>
#include <vtkInformation.h>
#include <vtkInformationVector.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>
#include <vtkPointData.h>
#include <vtkSmartPointer.h>
#include <vtkStreamingDemandDrivenPipeline.h>
#include <vtkXMLImageDataReader.h>

namespace
{
using teravox::PieceIndex;
using teravox::Status;
using teravox::StatusCode;
using Extent = PieceIndex::Extent;

/// The place of an index in an array of an extent.
vtkIdType PlaceIn(const Extent& extent, int x, int y, int z)
{
  const vtkIdType row = vtkIdType{ extent[1] } - extent[0] + 1;
  const vtkIdType rows = vtkIdType{ extent[3] } - extent[2] + 1;
  return ((z - extent[4]) * rows + (y - extent[2])) * row + (x - extent[0]);
}

std::string Text(const int* extent)
{
  std::string text;
  for (int i = 0; i < 6; ++i)
  {
    text += (i > 0 ? " " : "") + std::to_string(extent[i]);
  }
  return text;
}

/// Only this one.
void Select(vtkDataArraySelection* selection, const std::string& name, bool here)
{
  selection->DisableAllArrays();
  if (here)
  {
    selection->EnableArray(name.c_str());
  }
}

vtkDataArray* ArrayOf(vtkImageData* image, const PieceIndex::Array& array)
{
  vtkDataSetAttributes* data = array.Cells
    ? static_cast<vtkDataSetAttributes*>(image->GetCellData())
    : static_cast<vtkDataSetAttributes*>(image->GetPointData());
  return data->GetArray(array.Name.c_str());
}

/// Reads a part of a piece to where it belongs in `out`, an array of the extent `all`.
Status ReadPart(const PieceIndex& index, const PieceIndex::Part& part,
  const PieceIndex::Array& array, const Extent& all, vtkDataArray* out)
{
  const PieceIndex::Piece& piece = index.Pieces[part.Piece];
  const std::string name = "The piece '" + piece.File + "' ";
  const vtkNew<vtkXMLImageDataReader> reader;
  std::string reported;
  const vtkNew<vtkCallbackCommand> observer;
  observer->SetClientData(&reported);
  observer->SetCallback(
    [](vtkObject*, unsigned long, void* client, void* text)
    {
      auto* first = static_cast<std::string*>(client);
      *first = first->empty() ? teravox::ErrorText(static_cast<const char*>(text)) : *first;
    });
  reader->AddObserver(vtkCommand::ErrorEvent, observer);
  reader->SetFileName(piece.File.c_str());
  if (reader->CanReadFile(piece.File.c_str()) == 0)
  {
    return { StatusCode::Corrupt, name + "isn't a VTK image (.vti), or it is damaged." };
  }
  reader->UpdateInformation();
  Extent has{ 0, -1, 0, -1, 0, -1 };
  reader->GetOutputInformation(0)->Get(
    vtkStreamingDemandDrivenPipeline::WHOLE_EXTENT(), has.data());
  // Points of the part; a cell has two of each axis that has more than one.
  Extent points = part.Indices;
  bool inside = reported.empty();
  for (std::size_t i = 0; i < 6; i += 2)
  {
    points.at(i + 1) += array.Cells && index.Whole.at(i) < index.Whole.at(i + 1) ? 1 : 0;
    inside = inside && has.at(i) <= points.at(i) && points.at(i + 1) <= has.at(i + 1);
  }
  if (reported.empty() && !inside)
  {
    return { StatusCode::Corrupt,
      name + "has the extent " + Text(has.data()) + ", not " + Text(piece.Points.data()) + "." };
  }
  if (reported.empty())
  {
    Select(reader->GetPointDataArraySelection(), array.Name, !array.Cells);
    Select(reader->GetCellDataArraySelection(), array.Name, array.Cells);
    // The class has a member of that name.
    static_cast<vtkAlgorithm*>(reader.Get())->UpdateExtent(points.data());
  }
  vtkDataArray* read = ArrayOf(reader->GetOutput(), array);
  if (!reported.empty() || read == nullptr)
  {
    return { StatusCode::Corrupt,
      name +
        (reported.empty() ? "has no array \"" + array.Name + "\"."
                          : "can't be read: " + reported) };
  }
  Extent got{};
  reader->GetOutput()->GetExtent(got.data());
  const Extent indices = index.IndicesOf(got, array.Cells);
  if (teravox::FromVTK(read->GetDataType()) != array.Type ||
    read->GetNumberOfComponents() != out->GetNumberOfComponents() ||
    read->GetNumberOfTuples() <= PlaceIn(indices, indices[1], indices[3], indices[5]))
  {
    return { StatusCode::Corrupt,
      name + "has an array \"" + array.Name + "\" of another type or size than '" + array.TypeName +
        "'." };
  }
  const auto voxel =
    static_cast<std::size_t>(out->GetDataTypeSize()) * out->GetNumberOfComponents();
  const auto* from = static_cast<const std::byte*>(read->GetVoidPointer(0));
  auto* to = static_cast<std::byte*>(out->GetVoidPointer(0));
  for (const Extent& box : part.Boxes)
  {
    const std::size_t row = voxel * static_cast<std::size_t>(box[1] - box[0] + 1);
    for (int z = box[4]; z <= box[5]; ++z)
    {
      for (int y = box[2]; y <= box[3]; ++y)
      {
        std::memcpy(to + voxel * static_cast<std::size_t>(PlaceIn(all, box[0], y, z)),
          from + voxel * static_cast<std::size_t>(PlaceIn(indices, box[0], y, z)), row);
      }
    }
  }
  return {};
}
} // namespace

struct vtkImagePiecesReader::Content
{
  PieceIndex Index;
  PieceIndex::Array Array;
};

vtkStandardNewMacro(vtkImagePiecesReader);

vtkImagePiecesReader::vtkImagePiecesReader()
{
  this->SetNumberOfInputPorts(0);
}

vtkImagePiecesReader::~vtkImagePiecesReader() = default;

void vtkImagePiecesReader::SetFileName(const char* name)
{
  this->FileName = name ? name : "";
  this->Modified();
}

void vtkImagePiecesReader::SetArrayName(const char* name)
{
  this->ArrayName = name ? name : "";
  this->Modified();
}

int vtkImagePiecesReader::CanReadFile(const char* name)
{
  return name && PieceIndex::Read(name).Ok() ? 1 : 0;
}

int vtkImagePiecesReader::GetNumberOfPieces() const
{
  return this->Read ? static_cast<int>(this->Read->Index.Pieces.size()) : 0;
}

const char* vtkImagePiecesReader::GetPieceFileName(int piece) const
{
  return piece >= 0 && piece < this->GetNumberOfPieces()
    ? this->Read->Index.Pieces[static_cast<std::size_t>(piece)].File.c_str()
    : nullptr;
}

int vtkImagePiecesReader::RequestInformation(
  vtkInformation*, vtkInformationVector**, vtkInformationVector* outputs)
{
  this->Read.reset();
  auto index = PieceIndex::Read(this->FileName);
  auto array = index.Ok() ? index.Value().Choose(this->FileName, this->ArrayName)
                          : teravox::Result<PieceIndex::Array>(index.GetStatus());
  if (!array.Ok())
  {
    vtkErrorMacro(<< array.GetStatus().Message());
    return 0;
  }
  this->Read = std::make_unique<Content>(Content{ std::move(index.Value()), array.Value() });
  PieceIndex& read = this->Read->Index;
  vtkInformation* info = outputs->GetInformationObject(0);
  info->Set(vtkStreamingDemandDrivenPipeline::WHOLE_EXTENT(), read.Whole.data(), 6);
  info->Set(vtkDataObject::ORIGIN(), read.Origin.data(), 3);
  info->Set(vtkDataObject::SPACING(), read.Spacing.data(), 3);
  info->Set(vtkDataObject::DIRECTION(), read.Direction.data(), 9);
  info->Set(vtkAlgorithm::CAN_PRODUCE_SUB_EXTENT(), 1);
  if (!array.Value().Cells)
  {
    vtkDataObject::SetPointDataActiveScalarInfo(
      info, teravox::ToVTK(*array.Value().Type), array.Value().Components);
  }
  return 1;
}

int vtkImagePiecesReader::RequestData(
  vtkInformation*, vtkInformationVector**, vtkInformationVector* outputs)
{
  vtkInformation* info = outputs->GetInformationObject(0);
  vtkImageData* output = vtkImageData::GetData(info);
  if (!this->Read)
  {
    return 0;
  }
  const PieceIndex& index = this->Read->Index;
  const PieceIndex::Array& array = this->Read->Array;
  Extent extent{};
  info->Get(vtkStreamingDemandDrivenPipeline::UPDATE_EXTENT(), extent.data());
  const Extent indices = index.IndicesOf(extent, array.Cells);
  Status status;
  try
  {
    const auto parts = index.PartsOf(this->FileName, indices, array.Cells);
    status = parts.GetStatus();
    output->SetExtent(extent.data());
    output->SetOrigin(index.Origin.data());
    output->SetSpacing(index.Spacing.data());
    output->SetDirectionMatrix(index.Direction.data());
    const auto values = vtkSmartPointer<vtkDataArray>::Take(
      vtkDataArray::CreateDataArray(teravox::ToVTK(*array.Type)));
    values->SetName(array.Name.c_str());
    values->SetNumberOfComponents(array.Components);
    values->SetNumberOfTuples(1 + PlaceIn(indices, indices[1], indices[3], indices[5]));
    for (std::size_t i = 0; status.Ok() && i < parts.Value().size(); ++i)
    {
      status = this->GetAbortExecute() != 0
        ? Status(StatusCode::Cancelled, "Reading was cancelled.")
        : ReadPart(index, parts.Value()[i], array, indices, values);
    }
    vtkDataSetAttributes* data = array.Cells
      ? static_cast<vtkDataSetAttributes*>(output->GetCellData())
      : static_cast<vtkDataSetAttributes*>(output->GetPointData());
    data->SetScalars(values);
  }
  catch (const std::exception& error)
  {
    status = { StatusCode::ResourceExhausted,
      this->FileName + " can't be read: " + error.what() + "." };
  }
  if (!status.Ok())
  {
    output->Initialize();
    vtkErrorMacro(<< status.Message());
    return 0;
  }
  return 1;
}

void vtkImagePiecesReader::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "FileName: " << this->FileName << "\n";
  os << indent << "ArrayName: " << this->ArrayName << "\n";
  os << indent << "NumberOfPieces: " << this->GetNumberOfPieces() << "\n";
}
