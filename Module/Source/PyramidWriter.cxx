// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "PyramidWriter.h"

#include "ConversionLog.h"
#include "PyramidBuilder.h"
#include "PyramidFileWriter.h"
#include "PyramidFormat.h"
#include "PyramidLayout.h"
#include "PyramidMetadata.h"

#include <algorithm>
#include <exception>
#include <limits>
#include <memory>
#include <type_traits>

namespace teravox
{

namespace
{
// Of statistics that are kept while a file is written.
constexpr std::uint64_t LeastForCells = std::uint64_t{ 2 } << 20;
constexpr std::uint64_t MostForCells = std::uint64_t{ 32 } << 20;
constexpr std::uint64_t AmpleMemory = std::uint64_t{ 512 } << 20;

// HDF5's own limit of a chunk, and LZ4's of a block.
constexpr std::int64_t LargestChunk = std::int64_t{ 1 } << 30;

Status Invalid(const std::string& fileName, const std::string& what)
{
  return { StatusCode::InvalidArgument, "'" + fileName + "' can't be written: " + what + "." };
}

bool IsRepresentable(ScalarType type, double value)
{
  return DispatchScalarType(type,
    [&](auto example)
    {
      using T = decltype(example);
      if constexpr (std::is_floating_point_v<T>)
      {
        return true;
      }
      else
      {
        return value >= static_cast<double>(std::numeric_limits<T>::lowest()) &&
          value <= static_cast<double>(std::numeric_limits<T>::max()) &&
          static_cast<double>(static_cast<T>(value)) == value;
      }
    });
}

Status Check(const std::string& fileName, const VoxelReader::Description& volume,
  const PyramidWriterOptions& options)
{
  if (fileName.empty())
  {
    return { StatusCode::InvalidArgument, "No file name was given for the pyramid." };
  }
  if (options.BrickSize < 8 || options.BrickSize > 512 ||
    options.BrickSize % PyramidFormat::CellEdge != 0)
  {
    return Invalid(fileName,
      "the brick size is " + std::to_string(options.BrickSize) +
        " voxels; it must be a multiple of 8 from 8 to 512");
  }
  if (options.CompressionLevel < 0 || options.CompressionLevel > 12)
  {
    return Invalid(fileName,
      "the compression level is " + std::to_string(options.CompressionLevel) +
        "; it must be 0 to 12");
  }
  if (volume.Components < 1 || volume.Components > 4)
  {
    return Invalid(fileName,
      "the voxels have " + std::to_string(volume.Components) + " components; 1 to 4 are possible");
  }
  const std::int64_t edge = options.BrickSize;
  if (edge * edge * edge * volume.Components * static_cast<std::int64_t>(SizeOf(volume.Type)) >
    LargestChunk)
  {
    return Invalid(fileName, "a brick would take more than 1 GiB");
  }
  if (!IsRepresentable(volume.Type, volume.FillValue))
  {
    return Invalid(fileName, "the fill value isn't a value of the voxels' type");
  }
  const Status geometry =
    PyramidMetadata::CheckGeometry(volume.Origin, volume.Spacing, volume.Direction);
  return geometry.Ok() ? geometry : Invalid(fileName, geometry.Message());
}

Result<PyramidWriterReport> WriteChecked(const std::string& fileName, VoxelReader& reader,
  const VoxelReader::Description& volume, const PyramidWriterOptions& options)
{
  Result<PyramidLayout> layout =
    PyramidLayout::MakeDefault(volume.Dimensions, volume.Spacing, options.BrickSize);
  if (!layout.Ok())
  {
    return Status(layout.GetStatus().Code(),
      "'" + fileName + "' can't be written: " + layout.GetStatus().Message());
  }
  std::unique_ptr<SavedChunks> saved;
  PyramidWriterOptions left = options;
  if (options.Resume)
  {
    auto loaded = SavedChunks::Load(fileName, ConversionLog::Task(volume, options));
    if (!loaded.Ok())
    {
      return loaded.GetStatus();
    }
    saved = std::move(loaded.Value());
    left.MemoryLimit -= std::min(left.MemoryLimit, saved ? saved->MemoryUsed() : 0);
  }
  // Not of what is left: it decides where statistics lie in the file, which is the same after all.
  const std::uint64_t cellMemory = options.MemoryLimit < AmpleMemory ? LeastForCells : MostForCells;
  PyramidBuilder builder(volume, left, layout.Value(), reader, cellMemory);
  Status status = builder.Plan(fileName);
  if (!status.Ok())
  {
    return status;
  }
  Result<std::unique_ptr<PyramidFileWriter>> file =
    PyramidFileWriter::Create(fileName, volume, options, layout.Value(), std::move(saved));
  if (!file.Ok())
  {
    return file.GetStatus();
  }
  status = builder.Run(*file.Value());
  if (!status.Ok())
  {
    return status;
  }
  Result<std::uint64_t> size = file.Value()->Finish(
    builder.Range(), builder.Histogram().Bins(PyramidFormat::HistogramBins, builder.Range()));
  if (!size.Ok())
  {
    return size.GetStatus();
  }
  PyramidWriterReport report = builder.Report();
  report.FileBytes = size.Value();
  return report;
}
} // namespace

std::string PyramidWriter::TemporaryName(const std::string& fileName)
{
  return unfinished::PartName(fileName);
}

std::string PyramidWriter::LogName(const std::string& fileName)
{
  return unfinished::LogName(unfinished::PartName(fileName));
}

Result<PyramidWriterReport> PyramidWriter::Write(
  const std::string& fileName, VoxelReader& reader, const PyramidWriterOptions& options)
{
  try
  {
    const VoxelReader::Description volume = reader.Describe();
    const Status status = Check(fileName, volume, options);
    return status.Ok() ? WriteChecked(fileName, reader, volume, options)
                       : Result<PyramidWriterReport>(status);
  }
  catch (const std::bad_alloc&)
  {
    return Status(StatusCode::ResourceExhausted,
      "Writing '" + fileName + "' failed: the memory is full. A smaller memory limit may help.");
  }
  catch (const std::exception& e)
  {
    return Status(
      StatusCode::InputOutput, "Writing '" + fileName + "' failed: " + std::string(e.what()) + ".");
  }
}

} // namespace teravox
