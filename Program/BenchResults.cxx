// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "BenchResults.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <fstream>
#include <nlohmann/json.hpp>
#include <utility>

namespace teravox::program
{
namespace
{

constexpr std::array<const char*, 3> Peers{ GPUMapper, WideGPUMapper, FixedPointMapper };

/// In the order of the files; the names follow "ratios" and "summary".
constexpr std::array<std::pair<const char*, BenchRule>, 4> Rules{ { { "", { false, false } },
  { "_envelope", { false, true } }, { "_cpu", { true, false } },
  { "_cpu_envelope", { true, true } } } };

double TimeOf(const BenchPoint& point, const BenchRule& rule)
{
  return std::max(rule.CPUTime ? point.CPUSeconds : point.MedianSeconds, 1e-9);
}

double ErrorOf(const BenchPoint& point, const BenchRule& rule)
{
  return rule.Envelope ? point.Errors.EnvelopePercentile999 : point.Errors.Percentile999;
}

std::string SettingText(const std::string& mapper, double setting)
{
  return IsOurs(mapper) ? fmt::format("{:g}/255", setting) : fmt::format("{:g} vox", setting);
}

/// Processor time over the limit; empty where that isn't known.
std::string TimesLimit(const BenchPoint& point)
{
  return point.LimitSeconds > 0 ? fmt::format("{:.1f}", point.CPUSeconds / point.LimitSeconds) : "";
}

std::string Count(double number)
{
  return number < 0 ? "" : fmt::format("{:.1f}", number);
}

nlohmann::ordered_json ToJson(const BenchErrors& errors)
{
  return { { "max", errors.Max }, { "percentile_99_9", errors.Percentile999 },
    { "percentile_99", errors.Percentile99 }, { "rms", errors.Rms },
    { "envelope_max", errors.EnvelopeMax },
    { "envelope_percentile_99_9", errors.EnvelopePercentile999 } };
}

nlohmann::ordered_json ToJson(const BenchPoint& point)
{
  nlohmann::ordered_json json{ { "mapper", point.Mapper },
    { IsOurs(point.Mapper) ? "tolerance" : "sample_distance",
      IsOurs(point.Mapper) ? point.Setting / 255 : point.Setting },
    { "first_seconds", point.FirstSeconds }, { "median_seconds", point.MedianSeconds },
    { "median_cpu_seconds", point.CPUSeconds }, { "error", ToJson(point.Errors) } };
  if (IsOurs(point.Mapper))
  {
    json["converged"] = point.Converged;
    json["samples_per_pixel"] = point.SamplesPerPixel;
    json["contributing_samples_per_pixel"] = point.ContributingPerPixel;
    json["limit_cpu_seconds"] = point.LimitSeconds;
  }
  return json;
}

nlohmann::ordered_json ToJson(const BenchRatio& ratio)
{
  return { { "mapper", ratio.Mapper }, { "sample_distance", ratio.Setting },
    { "own_tolerance", ratio.Own / 255 }, { "ratio", ratio.Ratio }, { "reached", ratio.Reached } };
}

nlohmann::ordered_json ToJson(const BenchSceneResult& result)
{
  nlohmann::ordered_json json{ { "name", result.Scene.Name },
    { "description", result.Scene.Description } };
  if (!result.Skipped.empty())
  {
    json["skipped"] = result.Skipped;
    return json;
  }
  json["dimensions"] = result.Dimensions;
  json["type"] = result.Type;
  json["shaded"] = result.Scene.Shade;
  json["bare_fetch_seconds"] = result.FetchSeconds;
  json["points"] = nlohmann::ordered_json::array();
  for (const BenchPoint& point : result.Points)
  {
    json["points"].push_back(ToJson(point));
  }
  json["left_out"] = nlohmann::ordered_json::array();
  for (const BenchLeftOut& left : result.LeftOut)
  {
    json["left_out"].push_back({ { "mapper", left.Mapper }, { "sample_distance", left.Setting } });
  }
  for (const auto& [name, rule] : Rules)
  {
    auto& ratios = json[fmt::format("ratios{}", name)];
    ratios = nlohmann::ordered_json::array();
    for (const BenchRatio& ratio : RatiosOf(result, rule))
    {
      ratios.push_back(ToJson(ratio));
    }
  }
  return json;
}

nlohmann::ordered_json ToJson(const std::vector<BenchSummary>& summaries)
{
  auto json = nlohmann::ordered_json::array();
  for (const BenchSummary& summary : summaries)
  {
    json.push_back({ { "mapper", summary.Mapper }, { "scenes", summary.Scenes },
      { "ratio_at_one_voxel", summary.AtOneVoxel }, { "ratio_at_all", summary.AtAll },
      { "points_not_reached", summary.NotReached } });
  }
  return json;
}

Status WriteText(const std::string& text, const std::string& file)
{
  std::ofstream stream(file, std::ios::binary);
  stream << text;
  stream.close();
  return stream ? Status() : Status(StatusCode::InputOutput, file + " can't be written.");
}

/// A geometric mean, number by number.
class Mean
{
public:
  void Add(double number)
  {
    this->Sum += std::log(number);
    ++this->Count;
  }
  bool IsEmpty() const { return this->Count == 0; }
  double Value() const { return this->IsEmpty() ? 0 : std::exp(this->Sum / this->Count); }

private:
  double Sum = 0;
  int Count = 0;
};

} // namespace

bool IsOurs(const std::string& mapper)
{
  return mapper == OwnMapper || mapper == LevelsMapper;
}

std::vector<BenchRatio> RatiosOf(const BenchSceneResult& result, const BenchRule& rule)
{
  std::vector<BenchRatio> ratios;
  for (const BenchPoint& peer : result.Points)
  {
    if (IsOurs(peer.Mapper))
    {
      continue;
    }
    const BenchPoint* fastest = nullptr;
    const BenchPoint* best = nullptr;
    for (const BenchPoint& own : result.Points)
    {
      if (own.Mapper != OwnMapper || !own.Converged)
      {
        continue;
      }
      if (ErrorOf(own, rule) <= ErrorOf(peer, rule) &&
        (!fastest || TimeOf(own, rule) < TimeOf(*fastest, rule)))
      {
        fastest = &own;
      }
      if (!best || ErrorOf(own, rule) < ErrorOf(*best, rule))
      {
        best = &own;
      }
    }
    if (const BenchPoint* own = fastest ? fastest : best)
    {
      ratios.push_back({ peer.Mapper, peer.Setting, own->Setting,
        TimeOf(peer, rule) / TimeOf(*own, rule), fastest != nullptr });
    }
  }
  return ratios;
}

std::vector<BenchSummary> Summarize(
  const std::vector<BenchSceneResult>& results, const BenchRule& rule)
{
  std::vector<BenchSummary> summaries;
  for (const char* mapper : Peers)
  {
    BenchSummary summary;
    summary.Mapper = mapper;
    Mean atOne;
    Mean atAll;
    for (const BenchSceneResult& result : results)
    {
      Mean ofScene;
      for (const BenchRatio& ratio : RatiosOf(result, rule))
      {
        if (ratio.Mapper != mapper)
        {
          continue;
        }
        ofScene.Add(ratio.Ratio);
        summary.NotReached += ratio.Reached ? 0 : 1;
        if (ratio.Setting == 1)
        {
          atOne.Add(ratio.Ratio);
        }
      }
      if (!ofScene.IsEmpty())
      {
        atAll.Add(ofScene.Value());
        ++summary.Scenes;
      }
    }
    summary.AtOneVoxel = atOne.Value();
    summary.AtAll = atAll.Value();
    if (summary.Scenes > 0)
    {
      summaries.push_back(summary);
    }
  }
  return summaries;
}

void PrintHeader()
{
  fmt::print("Errors in 1/255 (red, green, blue over black); envelope: what is left outside of 9 "
             "rays within 1/32 pixel.\n");
  fmt::print(
    "{:<22} {:<16} {:>9} {:>9} {:>9} {:>8} {:>8} {:>8} {:>8} | {:>8} {:>8} | {:>8} {:>8} {:>8}\n",
    "scene", "mapper", "setting", "ms", "CPU ms", "max", "99.9 %", "99 %", "rms", "env. max",
    "99.9 %", "samples", "contrib.", "x limit");
}

void PrintScene(const BenchSceneResult& result)
{
  if (!result.Skipped.empty())
  {
    fmt::print("{:<22} SKIPPED: {}\n", result.Scene.Name, result.Skipped);
    return;
  }
  for (const BenchPoint& point : result.Points)
  {
    const BenchErrors& e = point.Errors;
    fmt::print(
      "{:<22} {:<16} {:>9} {:>9.1f} {:>9.1f} {:>8.3f} {:>8.3f} {:>8.3f} {:>8.4f} | {:>8.3f} "
      "{:>8.3f} | {:>8} {:>8} {:>8}{}\n",
      result.Scene.Name, point.Mapper, SettingText(point.Mapper, point.Setting),
      1e3 * point.MedianSeconds, 1e3 * point.CPUSeconds, 255 * e.Max, 255 * e.Percentile999,
      255 * e.Percentile99, 255 * e.Rms, 255 * e.EnvelopeMax, 255 * e.EnvelopePercentile999,
      Count(point.SamplesPerPixel), Count(point.ContributingPerPixel), TimesLimit(point),
      point.Converged ? "" : " NOT CONVERGED");
  }
  for (const BenchLeftOut& left : result.LeftOut)
  {
    fmt::print("{:<22} {:<16} {:>9} left out, a coarser setting took too long\n", result.Scene.Name,
      left.Mapper, SettingText(left.Mapper, left.Setting));
  }
  std::fflush(stdout);
}

void PrintSummary(const std::vector<BenchSceneResult>& results, bool cpuTime)
{
  fmt::print("\nVTK's {} over ours at equal or smaller error (99.9th percentile); * no setting of "
             "ours was as good.\n",
    cpuTime ? "processor time" : "time");
  for (const BenchSceneResult& result : results)
  {
    std::string line;
    std::string mapper;
    for (const BenchRatio& ratio : RatiosOf(result, { cpuTime, false }))
    {
      if (ratio.Mapper != mapper)
      {
        mapper = ratio.Mapper;
        line += fmt::format("  {}:", mapper);
      }
      line += fmt::format("  {:g}: {:.2f}{}", ratio.Setting, ratio.Ratio, ratio.Reached ? "" : "*");
    }
    if (!line.empty())
    {
      fmt::print("{:<22}{}\n", result.Scene.Name, line);
    }
  }
  for (const bool envelope : { false, true })
  {
    for (const BenchSummary& summary : Summarize(results, { cpuTime, envelope }))
    {
      fmt::print("geometric mean of {} scenes, {}{}: {:.2f} at one voxel, {:.2f} over all points"
                 " ({} not reached)\n",
        summary.Scenes, summary.Mapper, envelope ? ", errors outside of the envelope" : "",
        summary.AtOneVoxel, summary.AtAll, summary.NotReached);
    }
  }
}

Status WriteJson(const BenchErrorOptions& options, const std::vector<BenchSceneResult>& results,
  const std::string& file)
{
  nlohmann::ordered_json json;
  json["version"] = TERAVOX_VERSION;
  json["size"] = options.Size;
  json["frames"] = options.Frames;
  json["every"] = options.Every;
  json["scenes"] = nlohmann::ordered_json::array();
  for (const BenchSceneResult& result : results)
  {
    json["scenes"].push_back(ToJson(result));
  }
  for (const auto& [name, rule] : Rules)
  {
    json[fmt::format("summary{}", name)] = ToJson(Summarize(results, rule));
  }
  return WriteText(json.dump(2) + "\n", file);
}

Status WriteCsv(const std::vector<BenchSceneResult>& results, const std::string& file)
{
  std::string text =
    "scene,mapper,setting,first_seconds,median_seconds,median_cpu_seconds,max,percentile_99_9,"
    "percentile_99,rms,envelope_max,envelope_percentile_99_9,samples_per_pixel,"
    "contributing_samples_per_pixel,limit_cpu_seconds,converged\n";
  for (const BenchSceneResult& result : results)
  {
    for (const BenchPoint& p : result.Points)
    {
      const BenchErrors& e = p.Errors;
      text +=
        fmt::format("{},{},{:g},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},"
                    "{},{},{},{}\n",
          result.Scene.Name, p.Mapper, p.Setting, p.FirstSeconds, p.MedianSeconds, p.CPUSeconds,
          e.Max, e.Percentile999, e.Percentile99, e.Rms, e.EnvelopeMax, e.EnvelopePercentile999,
          Count(p.SamplesPerPixel), Count(p.ContributingPerPixel),
          p.LimitSeconds < 0 ? "" : fmt::format("{:.6g}", p.LimitSeconds), p.Converged ? 1 : 0);
    }
  }
  return WriteText(text, file);
}

} // namespace teravox::program
