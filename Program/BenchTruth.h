// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "BenchScenes.h"
#include "BenchVolumes.h"

#include <array>
#include <memory>
#include <string>
#include <vector>

namespace teravox::program
{

/// How far a picture is from the truth, in 0...1. A pixel's error is that of its worst channel of
/// red, green and blue over black; percentiles are over pixels.
struct BenchErrors
{
  double Max = 0;
  double Percentile999 = 0;
  double Percentile99 = 0;
  double Rms = 0; ///< over channels
  /// What is left outside of the envelope of 9 rays within +-1/32 pixel.
  double EnvelopeMax = 0;
  double EnvelopePercentile999 = 0;
};

/// Which truth: that of the data, which VTK's mappers draw, or that of the pyramid at the
/// resolution of pixels.
enum class BenchLevels
{
  Finest,
  ByPixel
};

/// The reference integrator's picture of a scene, on one pixel of each square of `every` x `every`.
/// What has been computed once is kept in a file. Requires: the volume outlives it.
class BenchTruth
{
public:
  /// `cache`: folder of the file.
  /// Errors: the camera, a level that can't be read.
  static Result<std::unique_ptr<BenchTruth>> Make(const BenchScene& scene,
    const BenchVolume& volume, const std::array<int, 2>& size, int every, BenchLevels levels,
    const std::string& cache);
  BenchTruth(const BenchTruth&) = delete;
  BenchTruth& operator=(const BenchTruth&) = delete;
  BenchTruth(BenchTruth&&) = delete;
  BenchTruth& operator=(BenchTruth&&) = delete;
  ~BenchTruth();

  /// `picture`: red, green, blue of all pixels, rows from the bottom.
  BenchErrors Compare(const std::vector<float>& picture);
  std::size_t NumberOfPixels() const;
  /// Computing it took so long; 0 where it was at hand.
  double Seconds() const;
  /// Writes what has been computed since. Errors: the file.
  Status Save() const;

private:
  BenchTruth();
  class Implementation;
  std::unique_ptr<Implementation> Self;
};

} // namespace teravox::program
