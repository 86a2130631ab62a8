// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "BrickSource.h"
#include "TransferTable.h"
#include "ViewGeometry.h"

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace teravox::test
{

/// What is drawn, and how exactly.
struct PictureScene
{
  std::shared_ptr<BrickSource> Source;
  TransferFunction Function;
  ViewInput Camera;
  bool Shade = false;
  bool Nearest = false;
  double Tolerance = 1.0 / 255; ///< 0: steps of SampleDistance
  double SampleDistance = 0.4;
  std::array<float, 4> Material{ 0.1f, 0.7f, 0.3f, 20.0f };
  bool TwoSided = true;
};

/// What must not change a bit of the picture.
struct PictureMeans
{
  std::uint32_t Slots = ~std::uint32_t{ 0 };
  std::uint32_t PageBlocks = 0; ///< 0: as many as are planned
  std::uint32_t StepsPerPass = 16384;
  bool Skip = true;
  bool Baseline = false; ///< the instruction set that every processor has
  /// Of OpenMP. Pictures here are so small that several would only wait for each other.
  int Threads = 1;
};

struct Picture
{
  std::string Error; ///< empty if the picture has converged and all invariants held
  int Width = 0;
  int Height = 0;
  std::vector<float> Colors; ///< premultiplied colour, transmittance
  std::uint64_t Passes = 0;
  std::uint64_t Uploads = 0;
  std::uint64_t Evictions = 0;
  std::uint64_t Samples = 0;
  bool Fallback = false; ///< an ancestor was drawn for a brick that can't be read

  /// Largest opacity of a pixel.
  float Strongest() const;
};

/// What VolumeEngine does, without OpenGL and without loader threads: passes of the native marcher,
/// page table, residency and an atlas in memory, until no ray is under way.
class PictureMaker
{
public:
  PictureMaker(PictureScene scene, const PictureMeans& means);
  PictureMaker(const PictureMaker&) = delete;
  PictureMaker& operator=(const PictureMaker&) = delete;
  PictureMaker(PictureMaker&&) = delete;
  PictureMaker& operator=(PictureMaker&&) = delete;
  ~PictureMaker();

  /// Begins with what the picture before has left in the atlas.
  Picture Draw();
  /// One pass over a picture that Draw() has drawn, tile by tile by threads of the standard
  /// library, which a sanitizer understands. Requires: an atlas that holds all bricks.
  Picture DrawWithThreads(int threads);

private:
  struct Parts;
  std::unique_ptr<Parts> Own;
};

/// Draws once with everything new.
Picture Draw(const PictureScene& scene, const PictureMeans& means = {});

/// Is there more than one instruction set to compare?
bool HasSeveralInstructionSets();

/// Two pictures are equal to the bit; the message names the first pixel that isn't.
void ExpectSameBits(const Picture& a, const Picture& b, const std::string& what);
/// Of all channels of two pictures of one size.
float LargestDifference(const Picture& a, const Picture& b);
/// Converged, and each accumulator is a number that a picture can hold.
void ExpectSound(const Picture& picture, const std::string& what);

/// Perspective and parallel cameras in world coordinates.
Matrix4 LookAt(const Double3& eye, const Double3& focus, const Double3& up);
/// `angle`: degrees of the picture's height.
Matrix4 Perspective(double angle, double aspect, double nearDepth, double farDepth);
/// `height`: world length of the picture's height.
Matrix4 Parallel(double height, double aspect, double nearDepth, double farDepth);
/// A camera for a source that lies where its origin and spacing put it.
ViewInput MakeCamera(const VolumeInfo& info, int width, int height, const Matrix4& viewFromWorld,
  const Matrix4& clipFromView);

/// Gradients below `low` (data values per mean distance of voxels) are left nothing, those above
/// `high` all.
TransferFunction WithGradientOpacity(TransferFunction function, double low, double high);

/// Nodes of opacity and colour over `values` and magnitudes up to `lastGradient`, by a function of
/// places in 0..1 per axis.
TransferFunction MakePlane(int columns, int rows, const ValueRange& values, double lastGradient,
  const std::function<std::array<float, 4>(double, double)>& node, double unitDistance = 1);

/// Opacity between values, linear between knots; colours run from blue over green to red.
TransferFunction MakeFunction(
  std::vector<double> values, std::vector<double> opacities, double unitDistance = 1);

} // namespace teravox::test
