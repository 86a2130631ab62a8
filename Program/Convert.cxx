// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "ByteCount.h"
#include "Commands.h"
#include "ErrorCapture.h"
#include "ImageInput.h"
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
  writer->SetMemoryLimit(options.Memory);
  writer->SetFillValue(options.FillValue);
}

/// An image file, or a formula at its finest level.
Result<vtkSmartPointer<vtkAlgorithm>> OpenInput(const VolumeOptions& options)
{
  if (!IsFormula(options.Name))
  {
    return OpenImage(options.Name, options.Dataset);
  }
  auto formula = OpenVolume(options);
  if (!formula.Ok())
  {
    return formula.GetStatus();
  }
  formula.Value().Last->SetLevel(0);
  return vtkSmartPointer<vtkAlgorithm>(formula.Value().Last.GetPointer());
}

} // namespace

Status RunConvert(const ConvertOptions& options)
{
  std::error_code error;
  const std::string& name = options.Input.Name;
  if (std::filesystem::equivalent(name, options.Output, error))
  {
    return { StatusCode::InvalidArgument,
      fmt::format("{} is the input as well as the output.", name) };
  }
  ErrorCapture errors;
  auto input = OpenInput(options.Input);
  if (!input.Ok())
  {
    return input.GetStatus();
  }
  CatchInterrupts(PyramidWriter::TemporaryName(options.Output));
  ProgressBar bar;
  vtkNew<vtkHDF5PyramidWriter> writer;
  Configure(writer, options);
  writer->SetInputConnection(input.Value()->GetOutputPort());

  Watch watch{ writer, input.Value(), options.Quiet ? nullptr : &bar };
  vtkNew<vtkCallbackCommand> progress;
  progress->SetCallback(&Watch::OnProgress);
  progress->SetClientData(&watch);
  writer->AddObserver(vtkCommand::ProgressEvent, progress);
  const unsigned long tag = input.Value()->AddObserver(vtkCommand::ProgressEvent, progress);
  const bool written = writer->Write() != 0;
  input.Value()->RemoveObserver(tag);
  bar.Clear();
  if (WasInterrupted() && !written)
  {
    return { StatusCode::Cancelled,
      fmt::format("interrupted; {} was not written.", options.Output) };
  }
  if (!written)
  {
    const std::string reason = errors.First();
    const bool named =
      reason.find(name) != std::string::npos || reason.find(options.Output) != std::string::npos;
    return { StatusCode::InputOutput,
      reason.empty() ? fmt::format("{} can't be converted.", name)
        : named      ? reason
                     : fmt::format("{}: {}", name, reason) };
  }
  if (!options.Quiet)
  {
    const auto bytes = static_cast<double>(writer->GetBytesTotal());
    fmt::print("{}: {} of voxels in {} ({}/s), {} levels, {} on disk\n", options.Output,
      FormatByteCount(bytes), FormatDuration(bar.Seconds()),
      FormatByteCount(bytes / std::max(bar.Seconds(), 1e-3)), writer->GetNumberOfLevels(),
      FormatByteCount(static_cast<double>(writer->GetFileBytes())));
  }
  return {};
}

} // namespace teravox::program
