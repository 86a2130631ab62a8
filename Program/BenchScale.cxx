// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// Does the cost follow the picture, and not the volume? One picture of volumes of all sizes that
// look the same, as formulas and as sparse files of what is seen of those, from outside and from
// deep within.
#include "BenchAllocations.h"
#include "BenchClock.h"
#include "ByteCount.h"
#include "Commands.h"
#include "ErrorCapture.h"
#include "Interrupt.h"
#include "SeenFile.h"
#include "SelfOutput.h"
#include "TemporaryFolder.h"
#include "View.h"
#include "vtkBrickSource.h"
#include "vtkHDF5PyramidReader.h"
#include "vtkOutOfCoreVolumeMapper.h"
#include "vtkProceduralVolumeSource.h"

#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fmt/format.h>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <utility>
#include <vector>
#include <vtkCamera.h>
#include <vtkColorTransferFunction.h>
#include <vtkNew.h>
#include <vtkPiecewiseFunction.h>
#include <vtkRenderWindow.h>
#include <vtkRenderer.h>
#include <vtkSmartPointer.h>
#include <vtkVolume.h>
#include <vtkVolumeProperty.h>

namespace teravox::program
{
namespace
{

using Json = nlohmann::ordered_json;

/// What is measured of a volume, and how the table shows it.
struct Column
{
  const char* Name; ///< in JSON
  const char* Head;
  enum
  {
    Milliseconds,
    Bytes,
    Count
  } Unit;
};

// Of the first, converged picture; "frame": of a view turned by a degree after it, the median.
// Traffic: voxels and page table to the renderer, and what is read from the file.
constexpr std::array<Column, 16> Columns{ {
  { "first_seconds", "converge", Column::Milliseconds },
  { "first_cpu_seconds", "(CPU)", Column::Milliseconds },
  { "frame_seconds", "frame", Column::Milliseconds },
  { "frame_cpu_seconds", "(CPU)", Column::Milliseconds },
  { "addressing_bytes", "addressing", Column::Bytes },
  { "host_bytes", "host", Column::Bytes },
  { "process_bytes", "process", Column::Bytes },
  { "bytes_read", "read", Column::Bytes },
  { "bytes_uploaded", "uploaded", Column::Bytes },
  { "traffic_bytes", "traffic", Column::Bytes },
  { "frame_traffic_bytes", "/frame", Column::Bytes },
  { "bricks", "bricks", Column::Count },
  { "operations", "operations", Column::Count },
  { "frame_operations", "/frame", Column::Count },
  { "allocations", "allocs", Column::Count },
  { "frame_allocations", "/frame", Column::Count },
} };

/// What is looked at. From within, the near plane lies where the smallest volume has just one voxel
/// for each pixel: nearer, it has less detail than the others.
struct ScaleView
{
  const char* Name;
  bool Inside;
};
constexpr std::array<ScaleView, 2> Views{ { { "outside", false }, { "inside", true } } };
constexpr double InsideNear = 0.1; // of the edge
constexpr double SmallestEdge = 512;
constexpr double InsideAngle = 60;

/// Most main memory that this process has held; 0 where the system doesn't tell.
std::uint64_t PeakProcessMemory()
{
  std::ifstream status("/proc/self/status");
  std::string word;
  while (status >> word)
  {
    if (word == "VmHWM:")
    {
      std::uint64_t kibibytes = 0;
      status >> kibibytes;
      return kibibytes * 1024;
    }
  }
  return 0;
}

vtkSmartPointer<vtkBrickSourceAlgorithm> MakeFormula(std::int64_t edge)
{
  const auto source = vtkSmartPointer<vtkProceduralVolumeSource>::New();
  source->SetFunction(vtkProceduralVolumeSource::SHELLS);
  source->SetDimensions(edge, edge, edge);
  return source.GetPointer();
}

vtkSmartPointer<vtkBrickSourceAlgorithm> OpenFile(const std::string& fileName)
{
  const auto reader = vtkSmartPointer<vtkHDF5PyramidReader>::New();
  reader->SetFileName(fileName.c_str());
  return reader.GetPointer();
}

/// The same look for every volume: what a length adds is relative to the edge.
void SetLook(vtkVolumeProperty* property, double edge)
{
  vtkNew<vtkPiecewiseFunction> opacity;
  opacity->AddPoint(0, 0);
  opacity->AddPoint(80, 0);
  opacity->AddPoint(120, 0.3);
  opacity->AddPoint(255, 0.3);
  vtkNew<vtkColorTransferFunction> color;
  color->AddRGBPoint(0, 0.2, 0.3, 0.9);
  color->AddRGBPoint(255, 1.0, 0.8, 0.4);
  property->SetScalarOpacity(opacity);
  property->SetColor(color);
  property->SetScalarOpacityUnitDistance(edge / 128);
  property->SetInterpolationTypeToLinear();
}

/// What one picture cost.
struct PictureCost
{
  double Seconds = 0;
  double CPUSeconds = 0;
  double Traffic = 0;
  double Operations = 0;
  double Allocations = 0;
};

double TrafficOf(vtkOutOfCoreVolumeMapper* mapper)
{
  return static_cast<double>(
    mapper->GetBytesUploaded() + mapper->GetPageTableBytesUploaded() + mapper->GetBytesRead());
}

PictureCost Draw(vtkRenderWindow* window, vtkOutOfCoreVolumeMapper* mapper)
{
  PictureCost cost;
  const double before = TrafficOf(mapper);
  const AllocationCounter allocations;
  const BenchClock clock;
  window->Render();
  window->WaitForCompletion();
  cost.Seconds = clock.Seconds();
  cost.CPUSeconds = clock.CPUSeconds();
  cost.Allocations = static_cast<double>(allocations.Count());
  cost.Traffic = TrafficOf(mapper) - before;
  cost.Operations = static_cast<double>(mapper->GetNumberOfOperations());
  return cost;
}

double MedianCost(const std::vector<PictureCost>& costs, double PictureCost::*number)
{
  std::vector<double> numbers;
  for (const PictureCost& cost : costs)
  {
    numbers.push_back(cost.*number);
  }
  return MedianOf(std::move(numbers));
}

/// Where the camera is. From within, deep in the volume: pixels of equal angles see voxels of equal
/// angles at all depths, whatever the size of the volume.
Status PlaceScaleCamera(
  const ScaleOptions& options, vtkCamera* camera, const double bounds[6], double edge)
{
  const double aspect = static_cast<double>(options.Size[0]) / options.Size[1];
  CameraOptions placed;
  if (options.Inside)
  {
    placed.Given = true;
    placed.Position = { 0.45, 0.47, 0.44 };
    placed.FocalPoint = { 1.0, 0.98, 0.99 };
    placed.ViewAngle = InsideAngle;
  }
  Status status = PlaceCamera(camera, placed, bounds, aspect, 1.0);
  if (status.Ok() && options.Inside)
  {
    camera->SetClippingRange(InsideNear * edge, 2 * edge);
  }
  return status;
}

/// Makes a pixel as wide as one voxel of the smallest volume at the near plane.
double InsideBias(const ScaleOptions& options)
{
  const double pixel = 2 * std::tan(0.5 * InsideAngle * M_PI / 180) / options.Size[1];
  return std::log2(1 / (SmallestEdge * InsideNear * pixel));
}

/// One row, in this process. The programs of the GPU are made before, with a volume of one brick:
/// else the first row would be theirs.
Result<Json> Measure(const ScaleOptions& options, vtkBrickSource* holder)
{
  ErrorCapture errors;
  const auto failure = [&errors](const char* otherwise)
  { return Status(StatusCode::InputOutput, errors.HasError() ? errors.First() : otherwise); };
  long long dimensions[3] = { 0, 0, 0 };
  if (holder)
  {
    holder->GetLevelDimensions(0, dimensions);
  }
  if (dimensions[0] <= 0)
  {
    return failure("The volume can't be opened.");
  }
  const auto edge = static_cast<double>(dimensions[0]);
  const auto warm = MakeFormula(32);
  vtkNew<vtkOutOfCoreVolumeMapper> mapper;
  mapper->SetGPUMemoryBudget(options.GPUMemory);
  mapper->SetHostMemoryBudget(options.HostMemory);
  mapper->SetBrickSource(warm->GetBrickSource());
  if (options.Inside)
  {
    mapper->SetLevelOfDetailBias(InsideBias(options));
  }
  vtkNew<vtkVolume> volume;
  SetLook(volume->GetProperty(), 32);
  volume->SetMapper(mapper);
  vtkNew<vtkRenderer> renderer;
  renderer->AddVolume(volume);
  vtkNew<vtkRenderWindow> window;
  window->SetOffScreenRendering(1);
  window->SetMultiSamples(0);
  window->SetSize(options.Size[0], options.Size[1]);
  window->AddRenderer(renderer);
  vtkCamera* camera = renderer->GetActiveCamera();
  for (const bool warming : { true, false })
  {
    const Status placed =
      PlaceScaleCamera(options, camera, volume->GetBounds(), warming ? 32 : edge);
    if (!placed.Ok())
    {
      return placed;
    }
    if (warming)
    {
      window->Render();
      mapper->SetBrickSource(holder);
      SetLook(volume->GetProperty(), edge);
    }
  }
  const std::uint64_t bricks = mapper->GetNumberOfBricksLoaded();
  const std::uint64_t uploaded = mapper->GetBytesUploaded();
  Json row;
  row["voxels_per_axis"] = dimensions[0];
  const PictureCost first = Draw(window, mapper);
  row["first_seconds"] = first.Seconds;
  row["first_cpu_seconds"] = first.CPUSeconds;
  if (errors.HasError() || !mapper->IsConverged())
  {
    return failure("The picture didn't converge.");
  }
  row["addressing_bytes"] = mapper->GetAddressingMemoryUsed();
  row["gpu_bytes"] = mapper->GetGPUMemoryUsed();
  row["host_bytes"] = mapper->GetHostMemoryUsed();
  row["bytes_read"] = mapper->GetBytesRead();
  row["bytes_uploaded"] = mapper->GetBytesUploaded() - uploaded;
  row["bricks"] = mapper->GetNumberOfBricksLoaded() - bricks;
  row["passes"] = mapper->GetNumberOfPasses();
  row["operations"] = first.Operations;
  row["traffic_bytes"] = first.Traffic;
  row["allocations"] = first.Allocations;
  std::vector<PictureCost> frames;
  for (int i = 0; i < options.Frames; ++i)
  {
    if (options.Inside)
    {
      camera->Yaw(1.0);
    }
    else
    {
      camera->Azimuth(1.0);
    }
    frames.push_back(Draw(window, mapper));
  }
  if (errors.HasError() || !mapper->IsConverged())
  {
    return failure("A frame didn't converge.");
  }
  row["frame_seconds"] = MedianCost(frames, &PictureCost::Seconds);
  row["frame_cpu_seconds"] = MedianCost(frames, &PictureCost::CPUSeconds);
  row["frame_traffic_bytes"] = MedianCost(frames, &PictureCost::Traffic);
  row["frame_operations"] = MedianCost(frames, &PictureCost::Operations);
  row["frame_allocations"] = MedianCost(frames, &PictureCost::Allocations);
  row["process_bytes"] = PeakProcessMemory();
  return row;
}

// What is measured, or written to be measured, in a process of its own.
constexpr std::string_view FormulaName = "formula:"; // voxels per axis
constexpr std::string_view FileName = "file:";
constexpr std::string_view WriteName = "write:"; // voxels per axis:file

/// One measurement, in a process of its own: memory and caches of one volume don't serve the next.
Result<Json> MeasureOnce(const ScaleOptions& options, const std::string& name)
{
  std::vector<std::string> arguments(
    { "bench", "scale", "--only", name, "--size", std::to_string(options.Size[0]),
      std::to_string(options.Size[1]), "--frames", std::to_string(options.Frames), "--gpu-memory",
      std::to_string(options.GPUMemory), "--host-memory", std::to_string(options.HostMemory) });
  if (options.Inside)
  {
    arguments.emplace_back("--inside");
  }
  const auto text = OutputOfSelf(arguments);
  if (!text.Ok())
  {
    return text.GetStatus();
  }
  Json row = Json::parse(text.Value(), nullptr, false);
  return row.is_object()
    ? Result<Json>(std::move(row))
    : Result<Json>(Status(StatusCode::InputOutput, "The measurement " + name + " failed."));
}

/// One row: the medians of several measurements. In which order bricks arrive, and so how many
/// passes a first picture takes, is different each time.
Result<Json> MeasureApart(const ScaleOptions& options, const std::string& name)
{
  std::vector<Json> rows;
  rows.reserve(static_cast<std::size_t>(options.Repetitions));
  for (int i = 0; i < options.Repetitions; ++i)
  {
    auto row = MeasureOnce(options, name);
    if (!row.Ok() || WasInterrupted())
    {
      return row;
    }
    rows.push_back(row.Value());
  }
  Json median = rows.front();
  for (auto& [key, value] : median.items())
  {
    std::vector<double> numbers;
    numbers.reserve(rows.size());
    for (const Json& row : rows)
    {
      numbers.push_back(row.at(key).get<double>());
    }
    value = MedianOf(std::move(numbers));
  }
  return median;
}

/// The largest volume's costs by the smallest one's; null where that has none.
Json RatioOf(const Json& rows)
{
  Json ratio;
  for (const Column& column : Columns)
  {
    const double first = rows.front().at(column.Name).get<double>();
    const double last = rows.back().at(column.Name).get<double>();
    ratio[column.Name] = first > 0 ? Json(last / first) : Json();
  }
  return ratio;
}

/// Takes each row as soon as it is there.
using OnRow = std::function<void(const Json& row)>;

Result<Json> MeasureFormulas(const ScaleOptions& options, const OnRow& onRow)
{
  Json rows = Json::array();
  for (const std::int64_t edge : options.Volumes)
  {
    auto row = MeasureApart(options, fmt::format("{}{}", FormulaName, edge));
    if (WasInterrupted())
    {
      return Status(StatusCode::Cancelled, "It was interrupted.");
    }
    if (!row.Ok())
    {
      return row;
    }
    rows.push_back(row.Value());
    onRow(row.Value());
  }
  return rows;
}

Result<Json> MeasureFiles(
  const ScaleOptions& options, const std::string& folder, const OnRow& onRow)
{
  Json rows = Json::array();
  for (const std::int64_t edge : options.Files)
  {
    const std::string file = fmt::format("{}/{}.h5", folder, edge);
    // One file holds what is seen in both views.
    const auto written = std::filesystem::exists(file)
      ? Result<Json>(Json())
      : MeasureOnce(options, fmt::format("{}{}:{}", WriteName, edge, file));
    auto row = written.Ok() ? MeasureApart(options, fmt::format("{}{}", FileName, file)) : written;
    if (WasInterrupted())
    {
      return Status(StatusCode::Cancelled, "It was interrupted; its files are removed.");
    }
    if (!row.Ok())
    {
      return row;
    }
    rows.push_back(row.Value());
    onRow(row.Value());
  }
  return rows;
}

void PrintLine(const std::string& name, const Json& row, bool ratios)
{
  fmt::print("{:<18}", name);
  for (const Column& column : Columns)
  {
    std::string text = "-";
    const Json& value = row.at(column.Name);
    if (ratios && value.is_number())
    {
      text = fmt::format("{:.2f}x", value.get<double>());
    }
    else if (value.is_number())
    {
      text = column.Unit == Column::Milliseconds
        ? fmt::format("{:.0f} ms", 1e3 * value.get<double>())
        : column.Unit == Column::Bytes ? FormatByteCount(value.get<double>())
                                       : fmt::format("{:.0f}", value.get<double>());
    }
    fmt::print(" {:>9}", text);
  }
  fmt::print("\n");
}

void PrintHead(const std::string& name)
{
  fmt::print("{:<18}", name);
  for (const Column& column : Columns)
  {
    fmt::print(" {:>9}", column.Head);
  }
  fmt::print("\n");
}

/// Draws all pictures of a formula, and writes what they took of it.
Result<Json> WriteSeen(const ScaleOptions& options, std::int64_t edge, const std::string& file)
{
  const auto formula = MakeFormula(edge);
  const std::shared_ptr<BrickSource> source = formula->GetBrickSource()->GetBrickSource();
  const auto seen = std::make_shared<SeenBricks>(source);
  vtkNew<vtkBrickSource> holder;
  holder->SetBrickSource(seen);
  for (const ScaleView& view : Views)
  {
    ScaleOptions drawn = options;
    drawn.Inside = view.Inside;
    auto row = Measure(drawn, holder);
    if (!row.Ok())
    {
      return row;
    }
  }
  const Status written = WriteSeenFile(file, *source, seen->Keys());
  return written.Ok() ? Result<Json>(Json::object()) : Result<Json>(written);
}

Status RunOnly(const ScaleOptions& options)
{
  const std::string& name = options.Only;
  const auto is = [&name](std::string_view kind) { return name.rfind(kind, 0) == 0; };
  Result<Json> row =
    Status(StatusCode::InvalidArgument, fmt::format("'{}' names no measurement.", name));
  if (is(FormulaName))
  {
    const auto formula = MakeFormula(std::atoll(name.c_str() + FormulaName.size()));
    row = Measure(options, formula->GetBrickSource());
  }
  else if (is(FileName))
  {
    const auto file = OpenFile(name.substr(FileName.size()));
    row = Measure(options, file->GetBrickSource());
  }
  else if (is(WriteName))
  {
    const std::string rest = name.substr(WriteName.size());
    row = WriteSeen(options, std::atoll(rest.c_str()), rest.substr(rest.find(':') + 1));
  }
  if (row.Ok())
  {
    fmt::print("{}\n", row.Value().dump());
  }
  return row.GetStatus();
}

} // namespace

Status RunBenchScale(const ScaleOptions& options)
{
  Status display = CheckDisplay();
  if (!display.Ok())
  {
    return display;
  }
  if (!options.Only.empty())
  {
    return RunOnly(options);
  }
  // Until the folder is gone, Ctrl-C only asks.
  CatchInterrupts("");
  const TemporaryFolder folder;
  if (folder.Path().empty())
  {
    return { StatusCode::InputOutput, "There is no folder for temporary files." };
  }
  Json all;
  all["size"] = options.Size;
  all["frames"] = options.Frames;
  all["repetitions"] = options.Repetitions;
  all["gpu_memory"] = options.GPUMemory;
  all["host_memory"] = options.HostMemory;
  const auto print = [&options](const std::string& name, const Json& row, bool ratios)
  {
    if (!options.Json)
    {
      PrintLine(name, row, ratios);
      std::fflush(stdout); // minutes may pass between two rows
    }
  };
  const auto onRow = [&print](const Json& row)
  { print(fmt::format("{}^3", row.at("voxels_per_axis").get<long long>()), row, false); };
  for (const bool files : { false, true })
  {
    for (const ScaleView& view : Views)
    {
      ScaleOptions seen = options;
      seen.Inside = view.Inside;
      const std::string group = files ? "file" : "formula";
      if (!options.Json)
      {
        PrintHead(fmt::format("{}, {}", group, view.Name));
      }
      const auto rows =
        files ? MeasureFiles(seen, folder.Path(), onRow) : MeasureFormulas(seen, onRow);
      if (!rows.Ok())
      {
        return rows.GetStatus();
      }
      Json& result = all[group][view.Name];
      result = { { "rows", rows.Value() }, { "ratio", RatioOf(rows.Value()) } };
      print("last / first", result["ratio"], true);
    }
  }
  if (options.Json)
  {
    fmt::print("{}\n", all.dump(2));
  }
  return {};
}

} // namespace teravox::program
