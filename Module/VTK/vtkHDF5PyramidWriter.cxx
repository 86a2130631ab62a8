// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "vtkHDF5PyramidWriter.h"

#include "Import/DescribedReader.h"
#include "Import/ImageVolume.h"
#include "PipelineVoxelReader.h"
#include "PyramidWriter.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vtkAlgorithmOutput.h>
#include <vtkCommand.h>
#include <vtkImageData.h>
#include <vtkInformation.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>
#include <vtkTrivialProducer.h>

vtkStandardNewMacro(vtkHDF5PyramidWriter);

vtkHDF5PyramidWriter::vtkHDF5PyramidWriter()
{
  this->SetNumberOfInputPorts(1);
  this->SetNumberOfOutputPorts(0);
  std::fill_n(this->ImageSpacing, 3, std::numeric_limits<double>::quiet_NaN());
  std::fill_n(this->ImageOrigin, 3, std::numeric_limits<double>::quiet_NaN());
}

int vtkHDF5PyramidWriter::FillInputPortInformation(int, vtkInformation* info)
{
  info->Set(vtkAlgorithm::INPUT_REQUIRED_DATA_TYPE(), "vtkImageData");
  return 1;
}

void vtkHDF5PyramidWriter::SetInputData(vtkDataObject* data)
{
  if (!data)
  {
    this->SetInputConnection(nullptr);
    return;
  }
  vtkNew<vtkTrivialProducer> producer;
  producer->SetOutput(data);
  this->SetInputConnection(producer->GetOutputPort());
}

void vtkHDF5PyramidWriter::SetImageFileName(const char* name)
{
  this->ImageFileName = name ? name : "";
  this->Modified();
}

void vtkHDF5PyramidWriter::SetImageSeries(const char* uid)
{
  this->ImageSeries = uid ? uid : "";
  this->Modified();
}

int vtkHDF5PyramidWriter::CanReadImageFile(const char* name)
{
  if (!name || !teravox::ImageVolume::IsImage(name))
  {
    return 0;
  }
  teravox::ImageVolume::Request request;
  request.Name = name;
  const auto status = teravox::ImageVolume::Open(request).GetStatus();
  return status.Code() == teravox::StatusCode::Unsupported ? 0 : 1;
}

void vtkHDF5PyramidWriter::SetFileName(const char* name)
{
  this->FileName = name ? name : "";
  this->Modified();
}

void vtkHDF5PyramidWriter::SetArrayName(const char* name)
{
  this->ArrayName = name ? name : "";
  this->Modified();
}

void vtkHDF5PyramidWriter::SetSourceName(const char* name)
{
  this->SourceName = name ? name : "";
  this->Modified();
}

int vtkHDF5PyramidWriter::Write()
{
  this->BytesDone = this->BytesTotal = this->FileBytes = 0;
  this->NumberOfLevels = 0;
  this->NumberOfChunksSaved = 0;
  this->AbortExecute = 0;
  if (this->FileName.empty())
  {
    vtkErrorMacro("No file name was set.");
    return 0;
  }
  return (this->ImageFileName.empty() ? this->WriteInput() : this->WriteImage()) ? 1 : 0;
}

bool vtkHDF5PyramidWriter::WriteImage()
{
  teravox::ImageVolume::Request request;
  request.Name = this->ImageFileName;
  request.Series = this->ImageSeries;
  request.Memory = this->MemoryLimit;
  const auto image = teravox::ImageVolume::Open(request);
  if (!image.Ok())
  {
    vtkErrorMacro(<< image.GetStatus().Message());
    return false;
  }
  const teravox::ImageVolume& volume = image.Value();
  const std::string source = this->SourceName.empty()
    ? teravox::ImageVolume::SourceName(this->ImageFileName + " " + this->ImageSeries, volume.Files)
    : this->SourceName;
  teravox::VoxelReader::Description description = volume.Reader->Describe();
  description.FillValue = this->FillValue;
  for (std::size_t a = 0; a < 3; ++a)
  {
    const double spacing = this->ImageSpacing[a];
    const double origin = this->ImageOrigin[a];
    description.Spacing.at(a) = std::isnan(spacing) ? description.Spacing.at(a) : spacing;
    description.Origin.at(a) = std::isnan(origin) ? description.Origin.at(a) : origin;
  }
  teravox::DescribedReader reader(*volume.Reader, description);
  return this->WriteVolume(reader, source, volume.ReaderBytes);
}

bool vtkHDF5PyramidWriter::WriteInput()
{
  vtkAlgorithmOutput* connection = this->GetInputConnection(0, 0);
  if (!connection)
  {
    vtkErrorMacro("There is no input to write to " << this->FileName << ".");
    return false;
  }
  teravox::PipelineVoxelReader::Options input;
  input.ArrayName = this->ArrayName;
  input.FillValue = this->FillValue;
  input.WholeLimit = this->MemoryLimit / 2;
  input.PieceLimit = this->MemoryLimit / 8;
  auto reader =
    teravox::PipelineVoxelReader::Make(connection->GetProducer(), connection->GetIndex(), input);
  if (!reader.Ok())
  {
    vtkErrorMacro(<< reader.GetStatus().Message());
    return false;
  }
  return this->WriteVolume(*reader.Value(), this->SourceName,
    reader.Value()->IsWhole() ? reader.Value()->HeldBytes() : input.PieceLimit);
}

bool vtkHDF5PyramidWriter::WriteVolume(
  teravox::VoxelReader& reader, const std::string& source, unsigned long long forInput)
{
  teravox::PyramidWriterOptions options;
  options.BrickSize = this->BrickSize;
  options.Compression = this->Compression == NONE ? teravox::PyramidCompression::None
    : this->Compression == DEFLATE                ? teravox::PyramidCompression::Deflate
                                                  : teravox::PyramidCompression::LZ4;
  options.CompressionLevel = this->CompressionLevel;
  options.Downsampling = this->Downsampling == MODE ? teravox::PyramidDownsampling::Mode
                                                    : teravox::PyramidDownsampling::Average;
  options.Resume = this->Resume;
  options.Source = source;
  options.MemoryLimit = this->MemoryLimit - forInput;
  options.Progress = [this](std::uint64_t done, std::uint64_t total)
  {
    this->BytesDone = done;
    this->BytesTotal = total;
    this->UpdateProgress(total == 0 ? 1.0 : static_cast<double>(done) / static_cast<double>(total));
    return this->GetAbortExecute() == 0;
  };
  this->InvokeEvent(vtkCommand::StartEvent);
  auto report = teravox::PyramidWriter::Write(this->FileName, reader, options);
  this->InvokeEvent(vtkCommand::EndEvent);
  if (!report.Ok())
  {
    if (report.GetStatus().Code() != teravox::StatusCode::Cancelled)
    {
      vtkErrorMacro(<< report.GetStatus().Message()
                    << (report.GetStatus().Code() == teravox::StatusCode::ResourceExhausted &&
                             forInput > 0
                           ? " Beside that, the input takes " + std::to_string(forInput) + " bytes."
                           : ""));
    }
    return false;
  }
  this->FileBytes = report.Value().FileBytes;
  this->NumberOfLevels = report.Value().Levels;
  this->NumberOfChunksSaved = static_cast<vtkIdType>(report.Value().ChunksSaved);
  return true;
}

void vtkHDF5PyramidWriter::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "ImageFileName: " << this->ImageFileName << "\n";
  os << indent << "ImageSeries: " << this->ImageSeries << "\n";
  os << indent << "ImageSpacing: " << this->ImageSpacing[0] << " " << this->ImageSpacing[1] << " "
     << this->ImageSpacing[2] << "\n";
  os << indent << "ImageOrigin: " << this->ImageOrigin[0] << " " << this->ImageOrigin[1] << " "
     << this->ImageOrigin[2] << "\n";
  os << indent << "FileName: " << this->FileName << "\n";
  os << indent << "ArrayName: " << this->ArrayName << "\n";
  os << indent << "BrickSize: " << this->BrickSize << "\n";
  os << indent << "Compression: " << this->Compression << "\n";
  os << indent << "CompressionLevel: " << this->CompressionLevel << "\n";
  os << indent << "Downsampling: " << this->Downsampling << "\n";
  os << indent << "MemoryLimit: " << this->MemoryLimit << "\n";
  os << indent << "Resume: " << this->Resume << "\n";
  os << indent << "SourceName: " << this->SourceName << "\n";
  os << indent << "FillValue: " << this->FillValue << "\n";
}
