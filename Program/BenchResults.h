// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "BenchScenes.h"
#include "BenchTruth.h"
#include "Commands.h"
#include "Status.h"

#include <string>
#include <vector>

namespace teravox::program
{

/// Is it our mapper, with or without levels of detail?
bool IsOurs(const std::string& mapper);

/// The mappers that are compared.
inline constexpr const char* OwnMapper = "teravox";
/// Ours with the levels of detail that it takes by default, measured against the pyramid's truth.
inline constexpr const char* LevelsMapper = "teravox-levels";
inline constexpr const char* GPUMapper = "vtk-gpu";
/// VTK's GPU mapper, 8-bit voxels given as 16-bit ones.
inline constexpr const char* WideGPUMapper = "vtk-gpu-wide";
inline constexpr const char* FixedPointMapper = "vtk-fixed-point";

/// A mapper at one setting.
struct BenchPoint
{
  std::string Mapper;
  double Setting = 0; ///< tolerance in 1/255, or sample distance in voxels
  double FirstSeconds = 0;
  double MedianSeconds = 0;
  double CPUSeconds = 0; ///< of a frame, all threads together; median
  bool Converged = true;
  double SamplesPerPixel = -1;      ///< -1: unknown
  double ContributingPerPixel = -1; ///< of these; -1: unknown
  double LimitSeconds = -1;         ///< processor time of the contributing samples' bare fetches
  std::string Picture;              ///< file, until it has been compared
  BenchErrors Errors;
};

/// A setting that wasn't measured, because a coarser one took too long.
struct BenchLeftOut
{
  std::string Mapper;
  double Setting = 0;
};

struct BenchSceneResult
{
  BenchScene Scene;
  std::string Skipped; ///< why, in one sentence; empty if it was measured
  std::string Type;
  Int3 Dimensions{ 0, 0, 0 };
  double FetchSeconds = 0; ///< see BareFetchSeconds
  std::vector<BenchPoint> Points;
  std::vector<BenchLeftOut> LeftOut;
};

/// What is compared.
struct BenchRule
{
  bool CPUTime = false;  ///< processor seconds: hardly depend on what else a machine does
  bool Envelope = false; ///< errors are what is left outside of the envelope
};

/// VTK's time over ours, at equal or smaller error (99.9th percentile).
struct BenchRatio
{
  std::string Mapper;
  double Setting = 0;
  double Own = 0; ///< our setting that it is compared with: the fastest that is as good
  double Ratio = 0;
  bool Reached = true; ///< false: no setting of ours was as good; compared with our best one
};
std::vector<BenchRatio> RatiosOf(const BenchSceneResult& result, const BenchRule& rule);

/// Geometric means over scenes.
struct BenchSummary
{
  std::string Mapper;
  int Scenes = 0;
  double AtOneVoxel = 0; ///< VTK at a sample distance of one voxel
  double AtAll = 0;      ///< of the means of all points of each scene
  int NotReached = 0;    ///< points that no setting of ours is as good as
};
std::vector<BenchSummary> Summarize(
  const std::vector<BenchSceneResult>& results, const BenchRule& rule);

void PrintHeader();
void PrintScene(const BenchSceneResult& result);
/// `cpuTime`: see BenchRule.
void PrintSummary(const std::vector<BenchSceneResult>& results, bool cpuTime);

/// Errors: the file can't be written.
Status WriteJson(const BenchErrorOptions& options, const std::vector<BenchSceneResult>& results,
  const std::string& file);
Status WriteCsv(const std::vector<BenchSceneResult>& results, const std::string& file);

} // namespace teravox::program
