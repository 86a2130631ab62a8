// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "ByteCount.h"
#include "Commands.h"
#include "ErrorCapture.h"
#include "Formats/Sidecar.h"
#include "ImageInput.h"
#include "Import/DescribedReader.h"
#include "Interrupt.h"
#include "ProgressBar.h"
#include "PyramidWriter.h"
#include "VolumeInput.h"
#include "vtkHDF5PyramidWriter.h"

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fmt/format.h>
#include <system_error>
#include <vtkCallbackCommand.h>
#include <vtkNew.h>

namespace teravox::program
{
namespace
{

/// Draws the bar, and hands an interrupt on to the reader and the writer.
struct Watch
{
  vtkHDF5PyramidWriter* Writer = nullptr;
  vtkAlgorithm* Reader = nullptr;
  ProgressBar* Bar = nullptr;

  static void OnProgress(vtkObject*, unsigned long, void* clientData, void*)
  {
    auto* self = static_cast<Watch*>(clientData);
    if (WasInterrupted())
    {
      self->Reader->SetAbortExecute(1);
      self->Writer->SetAbortExecute(1);
    }
    if (self->Bar && self->Writer->GetBytesTotal() > 0)
    {
      self->Bar->Update(self->Writer->GetBytesDone(), self->Writer->GetBytesTotal());
    }
  }
};

void Configure(vtkHDF5PyramidWriter* writer, const ConvertOptions& options)
{
  writer->SetFileName(options.Output.c_str());
  writer->SetArrayName(options.Array.c_str());
  writer->SetBrickSize(options.BrickSize);
  writer->SetCompression(options.Compression == "none" ? vtkHDF5PyramidWriter::NONE
      : options.Compression == "deflate"               ? vtkHDF5PyramidWriter::DEFLATE
                                                       : vtkHDF5PyramidWriter::LZ4);
  writer->SetCompressionLevel(options.CompressionLevel);
  writer->SetDownsampling(
    options.Downsampling == "mode" ? vtkHDF5PyramidWriter::MODE : vtkHDF5PyramidWriter::AVERAGE);
  writer->SetFillValue(options.FillValue);
}

/// An image file, or a formula at its finest level.
Result<ImageInput> OpenInput(const ConvertOptions& options)
{
  if (!IsFormula(options.Input.Name))
  {
    return OpenImage(options.Input, options.Import, options.Array, options.Memory);
  }
  auto formula = OpenVolume(options.Input);
  if (!formula.Ok())
  {
    return formula.GetStatus();
  }
  formula.Value().Last->SetLevel(0);
  ImageInput input;
  input.Pipeline = formula.Value().Last.GetPointer();
  return input;
}

/// What is told in the end.
struct Written
{
  std::uint64_t VoxelBytes = 0;
  std::uint64_t FileBytes = 0;
  int Levels = 0;
  std::uint64_t ChunksSaved = 0;
};

/// What the voxels are made of: files, and what was chosen in them.
std::string SourceOf(const ImageInput& input, const ConvertOptions& options)
{
  return ImageVolume::SourceName(
    fmt::format("{} {} {} {} {}", options.Input.Name, options.Input.Dataset, options.Input.Channel,
      options.Input.TimePoint, options.Array),
    input.Volume.Files);
}

/// Of a reader of our own, with what the command line says instead of it.
Result<Written> WriteStreamed(
  const ImageInput& input, const ConvertOptions& options, ProgressBar* bar)
{
  VoxelReader::Description volume = input.Volume.Reader->Describe();
  volume.FillValue = options.FillValue;
  volume.Spacing = options.Import.Spacing.value_or(volume.Spacing);
  volume.Origin = options.Import.Origin.value_or(volume.Origin);
  DescribedReader reader(*input.Volume.Reader, volume);
  const std::string array = reader.Describe().ArrayName;
  if (!options.Array.empty() && options.Array != array)
  {
    return Status(StatusCode::NotFound,
      fmt::format("{} has no array \"{}\", but \"{}\".", options.Input.Name, options.Array, array));
  }
  PyramidWriterOptions writer;
  writer.BrickSize = options.BrickSize;
  writer.Compression = options.Compression == "none" ? PyramidCompression::None
    : options.Compression == "deflate"               ? PyramidCompression::Deflate
                                                     : PyramidCompression::LZ4;
  writer.CompressionLevel = options.CompressionLevel;
  writer.Downsampling =
    options.Downsampling == "mode" ? PyramidDownsampling::Mode : PyramidDownsampling::Average;
  writer.MemoryLimit = options.Memory - input.Volume.ReaderBytes;
  writer.Resume = options.Resume;
  writer.Source = SourceOf(input, options);
  writer.Progress = [bar](std::uint64_t done, std::uint64_t total)
  {
    if (bar != nullptr)
    {
      bar->Update(done, total);
    }
    return !WasInterrupted();
  };
  const auto report = PyramidWriter::Write(options.Output, reader, writer);
  if (!report.Ok())
  {
    return report.GetStatus();
  }
  return Written{ report.Value().VoxelBytes, report.Value().FileBytes, report.Value().Levels,
    report.Value().ChunksSaved };
}

/// Of a pipeline of VTK's.
Result<Written> WritePipeline(
  const ImageInput& opened, const ConvertOptions& options, ProgressBar* bar)
{
  ErrorCapture errors;
  vtkAlgorithm* input = opened.Pipeline;
  vtkNew<vtkHDF5PyramidWriter> writer;
  Configure(writer, options);
  writer->SetMemoryLimit(options.Memory - opened.Volume.ReaderBytes);
  writer->SetResume(options.Resume);
  writer->SetSourceName(SourceOf(opened, options).c_str());
  writer->SetInputConnection(input->GetOutputPort());
  Watch watch{ writer, input, bar };
  vtkNew<vtkCallbackCommand> progress;
  progress->SetCallback(&Watch::OnProgress);
  progress->SetClientData(&watch);
  writer->AddObserver(vtkCommand::ProgressEvent, progress);
  const unsigned long tag = input->AddObserver(vtkCommand::ProgressEvent, progress);
  const bool written = writer->Write() != 0;
  input->RemoveObserver(tag);
  if (written)
  {
    return Written{ static_cast<std::uint64_t>(writer->GetBytesTotal()),
      static_cast<std::uint64_t>(writer->GetFileBytes()), writer->GetNumberOfLevels(),
      static_cast<std::uint64_t>(writer->GetNumberOfChunksSaved()) };
  }
  const std::string& name = options.Input.Name;
  const std::string reason = errors.First();
  const bool named =
    reason.find(name) != std::string::npos || reason.find(options.Output) != std::string::npos;
  return Status(StatusCode::InputOutput,
    reason.empty() ? fmt::format("{} can't be converted.", name)
      : named      ? reason
                   : fmt::format("{}: {}", name, reason));
}

/// Writes under another name, because a sidecar must never be there without its marks.
Status ConvertToSidecar(ConvertOptions options)
{
  const std::string final = sidecar::NameFor(options.Input.Name);
  options.Output = final + ".unmarked";
  VolumeRequest request;
  request.Path = options.Input.Dataset;
  request.Channel = options.Input.Channel;
  request.TimePoint = options.Input.TimePoint;
  std::error_code error;
  // An older one would be read instead of the file.
  std::filesystem::remove(final, error);
  Status status = RunConvert(options);
  if (status.Ok())
  {
    status = sidecar::Mark(options.Output, options.Input.Name, request);
  }
  if (status.Ok())
  {
    std::filesystem::rename(options.Output, final, error);
    status = error ? Status(StatusCode::InputOutput,
                       fmt::format("{} can't be written: {}.", final, error.message()))
                   : Status();
  }
  if (!status.Ok())
  {
    std::filesystem::remove(options.Output, error);
  }
  else if (!options.Quiet)
  {
    fmt::print("{} is read instead of {} from now on\n", final, options.Input.Name);
  }
  return status;
}

} // namespace

Status RunConvert(const ConvertOptions& given)
{
  if (given.Output.empty())
  {
    return ConvertToSidecar(given);
  }
  const ConvertOptions& options = given;
  std::error_code error;
  const std::string& name = options.Input.Name;
  if (std::filesystem::equivalent(name, options.Output, error))
  {
    return { StatusCode::InvalidArgument,
      fmt::format("{} is the input as well as the output.", name) };
  }
  auto input = [&options]
  {
    const ErrorCapture errors; // VTK's readers would print
    return OpenInput(options);
  }();
  if (!input.Ok())
  {
    return input.GetStatus();
  }
  if (options.Resume)
  {
    CatchInterrupts("", "");
  }
  else
  {
    CatchInterrupts(
      PyramidWriter::TemporaryName(options.Output), PyramidWriter::LogName(options.Output));
  }
  ProgressBar bar;
  ProgressBar* shown = options.Quiet ? nullptr : &bar;
  const auto written = input.Value().Volume.Reader ? WriteStreamed(input.Value(), options, shown)
                                                   : WritePipeline(input.Value(), options, shown);
  bar.Clear();
  if (WasInterrupted() && !written.Ok())
  {
    return { StatusCode::Cancelled,
      fmt::format("interrupted; {} was not written{}.", options.Output,
        options.Resume ? ", --resume goes on" : "") };
  }
  if (!written.Ok())
  {
    return written.GetStatus();
  }
  if (!options.Quiet)
  {
    const auto bytes = static_cast<double>(written.Value().VoxelBytes);
    fmt::print("{}: {} of voxels in {} ({}/s), {} levels, {} on disk{}\n", options.Output,
      FormatByteCount(bytes), FormatDuration(bar.Seconds()),
      FormatByteCount(bytes / std::max(bar.Seconds(), 1e-3)), written.Value().Levels,
      FormatByteCount(static_cast<double>(written.Value().FileBytes)),
      written.Value().ChunksSaved > 0
        ? fmt::format("; {} chunks were there already", written.Value().ChunksSaved)
        : "");
  }
  return {};
}

} // namespace teravox::program
