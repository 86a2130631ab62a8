// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// `teravox bench error`: run time against error, our mapper beside VTK's.
#include "BenchFetch.h"
#include "BenchMeasure.h"
#include "BenchPlots.h"
#include "BenchResults.h"
#include "BenchScenes.h"
#include "BenchTruth.h"
#include "Commands.h"
#include "Interrupt.h"
#include "TemporaryFolder.h"
#include "View.h"

#include <algorithm>
#include <filesystem>
#include <fmt/format.h>
#include <map>
#include <memory>
#include <system_error>
#include <utility>

namespace teravox::program
{
namespace
{

Status MakeFolder(const std::string& folder)
{
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  return error ? Status(StatusCode::InputOutput, folder + " can't be made a folder.") : Status();
}

void PrintList()
{
  for (const BenchScene& scene : AllBenchScenes())
  {
    fmt::print("{:<22} {}\n", scene.Name, scene.Description);
  }
}

const std::vector<double>& SettingsOf(const BenchErrorOptions& options, const std::string& mapper)
{
  return IsOurs(mapper)          ? options.Tolerances
    : mapper == FixedPointMapper ? options.FixedPointDistances
                                 : options.Distances;
}

Status CompareWithTruth(
  const BenchErrorOptions& options, BenchTruth& truth, std::vector<BenchPoint>& points)
{
  for (BenchPoint& point : points)
  {
    const auto picture = ReadPicture(point.Picture, options.Size);
    if (!picture.Ok())
    {
      return picture.GetStatus();
    }
    point.Errors = truth.Compare(picture.Value());
  }
  return {};
}

/// `options.Work` and `options.Cache` are folders that exist.
Result<BenchSceneResult> MeasureScene(const BenchErrorOptions& options, const BenchScene& scene)
{
  BenchSceneResult result;
  result.Scene = scene;
  const auto volume = MakeBenchVolume(scene.Field, scene.Size);
  if (!volume.Ok())
  {
    if (volume.GetStatus().Code() == StatusCode::NotFound)
    {
      result.Skipped = volume.GetStatus().Message();
      return result;
    }
    return volume.GetStatus();
  }
  result.Type = ToString(volume.Value().Type);
  result.Dimensions = volume.Value().Dimensions;
  result.FetchSeconds = BareFetchSeconds(volume.Value());
  Status status = WriteBenchVolume(volume.Value(), VolumeFile(options.Work));
  std::map<BenchLevels, std::unique_ptr<BenchTruth>> truths;
  for (const std::string& mapper : options.Mappers)
  {
    if (mapper == WideGPUMapper && SizeOf(volume.Value().Type) != 1)
    {
      continue; // as it is in vtk-gpu
    }
    const BenchLevels levels = mapper == LevelsMapper ? BenchLevels::ByPixel : BenchLevels::Finest;
    if (status.Ok() && !truths[levels])
    {
      auto truth =
        BenchTruth::Make(scene, volume.Value(), options.Size, options.Every, levels, options.Cache);
      status = truth.GetStatus();
      truths[levels] = truth.Ok() ? std::move(truth.Value()) : nullptr;
    }
    if (!status.Ok())
    {
      return status;
    }
    std::vector<double> settings = SettingsOf(options, mapper);
    std::sort(settings.rbegin(), settings.rend());
    auto measured = MeasureApart(options, { scene.Name, mapper, settings });
    status = measured.Ok()
      ? CompareWithTruth(options, *truths[levels], measured.Value().Points)
      : Status(StatusCode::InputOutput,
          fmt::format("{} with {}: {}", scene.Name, mapper, measured.GetStatus().Message()));
    if (!status.Ok())
    {
      return status;
    }
    BenchTaskResult& own = measured.Value();
    for (BenchPoint& point : own.Points)
    {
      const double pixels = static_cast<double>(options.Size[0]) * options.Size[1];
      point.LimitSeconds = point.ContributingPerPixel < 0
        ? -1
        : point.ContributingPerPixel * pixels * result.FetchSeconds;
    }
    result.Points.insert(result.Points.end(), own.Points.begin(), own.Points.end());
    result.LeftOut.insert(result.LeftOut.end(), own.LeftOut.begin(), own.LeftOut.end());
  }
  for (const auto& [levels, truth] : truths)
  {
    status = status.Ok() ? truth->Save() : status;
  }
  return status.Ok() ? Result<BenchSceneResult>(std::move(result)) : status;
}

/// After each scene, so that a long run that is ended leaves what it has.
Status WriteFiles(const BenchErrorOptions& options, const std::vector<BenchSceneResult>& results)
{
  Status status;
  if (!options.Json.empty())
  {
    status = WriteJson(options, results, options.Json);
  }
  if (status.Ok() && !options.Csv.empty())
  {
    status = WriteCsv(results, options.Csv);
  }
  if (status.Ok() && !options.Plots.empty())
  {
    const BenchSceneResult& last = results.back();
    status = WritePlot(last, fmt::format("{}/{}.png", options.Plots, last.Scene.Name));
  }
  return status;
}

Status CheckMappers(const std::vector<std::string>& mappers)
{
  for (const std::string& mapper : mappers)
  {
    if (!IsOurs(mapper) && mapper != GPUMapper && mapper != WideGPUMapper &&
      mapper != FixedPointMapper)
    {
      return { StatusCode::InvalidArgument,
        fmt::format("'{}' is no mapper; there are {}, {}, {}, {} and {}.", mapper, OwnMapper,
          LevelsMapper, GPUMapper, WideGPUMapper, FixedPointMapper) };
    }
  }
  return {};
}

Status MeasureAll(BenchErrorOptions& options, const std::vector<BenchScene>& scenes)
{
  const TemporaryFolder work;
  options.Work = work.Path();
  if (options.Work.empty())
  {
    return { StatusCode::InputOutput, "There is no folder for temporary files." };
  }
  Status status = options.Cache.empty() ? Status() : MakeFolder(options.Cache);
  options.Cache = options.Cache.empty() ? options.Work : options.Cache;
  if (status.Ok() && !options.Plots.empty())
  {
    status = MakeFolder(options.Plots);
  }
  if (!status.Ok())
  {
    return status;
  }
  CatchInterrupts("");
  PrintHeader();
  std::vector<BenchSceneResult> results;
  for (const BenchScene& scene : scenes)
  {
    auto result = MeasureScene(options, scene);
    if (WasInterrupted())
    {
      return { StatusCode::Cancelled, "Interrupted." };
    }
    if (!result.Ok())
    {
      return result.GetStatus();
    }
    PrintScene(result.Value());
    results.push_back(std::move(result.Value()));
    status = WriteFiles(options, results);
    if (!status.Ok())
    {
      return status;
    }
  }
  PrintSummary(results, options.CPUTime);
  return {};
}

} // namespace

Status RunBenchError(const BenchErrorOptions& given)
{
  BenchErrorOptions options = given;
  if (options.List)
  {
    PrintList();
    return {};
  }
  Status status = CheckMappers(options.Mappers);
  status = status.Ok() ? CheckDisplay() : status;
  if (!status.Ok())
  {
    return status;
  }
  if (!options.Only.empty())
  {
    return Measure(options, { options.Only, options.Mappers.front(), options.Settings });
  }
  const auto scenes = FindBenchScenes(options.Scenes);
  return scenes.Ok() ? MeasureAll(options, scenes.Value()) : scenes.GetStatus();
}

} // namespace teravox::program
