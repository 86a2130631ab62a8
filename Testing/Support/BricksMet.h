// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "RecordingSource.h"
#include "Scene.h"

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace teravox::test
{

/// Fails (GoogleTest) unless all of a is in b; names the first that isn't.
void ExpectWithin(const BrickSet& a, const BrickSet& b, const std::string& what);

/// What the rays of a picture meet.
struct Met
{
  BrickSet Passed;  ///< before the ray has ended
  BrickSet Visible; ///< of them those whose range, filter support included, isn't invisible
  /// Of them those in which something is added to the picture, and that have more than one value:
  /// what has to be read.
  BrickSet Touched;
  double Visits = 0; ///< bricks, and largest empty regions left at once
  double Bricks = 0; ///< bricks crossed, one by one
};

/// A walk of its own along the rays of a stage: from face to face of the bricks in double
/// precision, with camera, levels, field and transfer function of the reference integrator. Knows
/// nothing of marchers and page tables. Thread: the test's own.
class BrickWalk
{
public:
  /// `source`: what the stage draws.
  BrickWalk(Stage& stage, const std::shared_ptr<BrickSource>& source,
    VoxelAccess access = VoxelAccess::Whole);

  /// The view depth of opaque geometry at a pixel.
  using OpaqueDepth = std::function<double(int x, int y)>;
  /// `samples`: per voxel; with 0 it isn't asked what is touched, and rays end where they leave the
  /// volume.
  Met Walk(double samples = 4, const OpaqueDepth& opaqueDepth = nullptr) const;

  /// Whether nothing can be seen of a region, as far as the source's ranges tell.
  bool IsEmpty(int level, int pageLevel, const Int3& region) const;
  /// Whether a brick of a level has one value, filter support included.
  bool IsSingle(int level, const Int3& brick) const
  {
    return this->RangeOf(level, 0, brick).IsSingle();
  }
  const TruthScene& Scene() const { return this->Truth.Scene(); }

private:
  struct Line
  {
    Double3 Origin; ///< corner coordinates of level 0, per world length
    Double3 Direction;
  };
  const ValueRange& RangeOf(int level, int pageLevel, const Int3& region) const;
  double ExitOf(int level, int pageLevel, const Line& line, const Double3& p, double end) const;
  void WalkRay(Met& met, int x, int y, double samples, double opaqueDepth) const;
  bool Gather(int level, const Line& line, double begin, double end, double samples,
    double& transmittance) const;

  BrickSource& Source;
  StageTruth Truth;
  const PyramidLayout& Layout;
  std::vector<std::vector<std::vector<ValueRange>>> Ranges; // by level and page level
};

} // namespace teravox::test
