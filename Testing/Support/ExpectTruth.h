// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "Scene.h"

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace teravox::test
{

/// What is asked of the excess over the envelope of truth, in units of the image error tolerance.
struct Bounds
{
  double Max = 1;
  double Percentile99 = 1;
};

/// Draws what the stage is set to and compares it with the truth of `source`: prints the
/// differences, fails (GoogleTest) where they are beyond the bounds, the picture isn't converged or
/// shows nothing.
void ExpectTruth(
  Stage& stage, BrickSource& source, const std::string& name, const Bounds& bounds = {});
/// The same with a truth that is already there.
void ExpectTruth(
  Stage& stage, const StageTruth& truth, const std::string& name, const Bounds& bounds = {});
/// The same with any truth. `find`: the excess of a picture over an envelope, where the plain
/// difference is more than `small`, and the plain difference itself. `where`: what is to be said of
/// the worst pixel.
void ExpectExcess(Stage& stage,
  const std::function<ImageDifference(
    const std::vector<float>& picture, double small, ImageDifference* plain)>& find,
  const std::function<std::string(
    const std::vector<float>& picture, const ImageDifference& excess)>& where,
  const std::string& name, const Bounds& bounds = {});

/// Draws with steps of 0.4 and of 0.1 units of the world, and fails where the mean error of the
/// short ones isn't below `share` of that of the long ones.
void ExpectFixedStepsConverge(Stage& stage, BrickSource& source, double share);

/// Draws, and fails where the picture isn't converged, counters contradict each other, or a bit of
/// it differs from `reference`, which becomes the picture where it is empty. Returns the bricks
/// loaded.
std::uint64_t ExpectSamePicture(
  Stage& stage, std::vector<float>& reference, const std::string& name);

} // namespace teravox::test
