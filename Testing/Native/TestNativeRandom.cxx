// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Scenes that nobody thought of.
#include "Effort.h"
#include "NativeVolumes.h"

#include <algorithm>
#include <gtest/gtest.h>
#include <utility>

namespace teravox
{

namespace
{
using namespace test;

class Dice
{
public:
  explicit Dice(unsigned seed)
    : Random(seed)
  {
  }
  /// A whole number, both ends included.
  int Whole(int low, int high)
  {
    return low + static_cast<int>(this->Random() % static_cast<unsigned>(high - low + 1));
  }
  double Real(double low, double high)
  {
    return low + (high - low) * static_cast<double>(this->Random()) / 4294967296.0;
  }
  bool OneIn(int n) { return this->Whole(1, n) == 1; }

private:
  std::mt19937 Random; // its numbers are the same everywhere, unlike those of distributions
};

TransferFunction RandomFunction(Dice& dice, const Volume& volume)
{
  std::vector<double> shares{ dice.OneIn(3) ? 0.0 : dice.Real(0, 0.5) };
  std::vector<double> opacities;
  const int knots = dice.Whole(2, 6);
  for (int i = 1; i < knots; ++i)
  {
    shares.push_back(shares.back() + (dice.OneIn(4) ? 1e-3 : dice.Real(0.02, 0.5)));
  }
  for (int i = 0; i < knots; ++i)
  {
    opacities.push_back(dice.OneIn(2) ? 0 : dice.OneIn(5) ? 1 : dice.Real(0, 0.6));
  }
  return volume.Function(shares, opacities);
}

ViewInput RandomCamera(Dice& dice, const VolumeInfo& info)
{
  const int width = dice.Whole(1, 24);
  const int height = dice.Whole(1, 24);
  const double aspect = static_cast<double>(width) / height;
  Double3 size{};
  Double3 eye{};
  Double3 focus{};
  const bool inside = dice.OneIn(3);
  const bool onLattice = dice.OneIn(4);
  double diagonal = 0;
  for (std::size_t a = 0; a < 3; ++a)
  {
    const auto voxels = static_cast<int>(info.Layout.Dimensions(0)[a]);
    size[a] = voxels * info.Spacing[a];
    focus[a] = dice.Real(0.2, 0.8) * size[a];
    eye[a] = (inside ? dice.Real(0, 1) : dice.Real(-1, 2)) * size[a];
    if (onLattice)
    {
      eye[a] = 0.5 * dice.Whole(0, 2 * voxels) * info.Spacing[a];
    }
    diagonal += size[a] * size[a];
  }
  diagonal = std::sqrt(diagonal);
  if (dice.OneIn(4)) // along an axis
  {
    focus = eye;
    focus[static_cast<std::size_t>(dice.Whole(0, 2))] += dice.OneIn(2) ? 1 : -1;
  }
  else if (eye == focus)
  {
    focus[0] += 1;
  }
  const Matrix4 view = LookAt(eye, focus, { 0.31, 0.52, 0.79 });
  ViewInput camera = MakeCamera(info, width, height, view,
    dice.OneIn(4) ? Parallel(dice.Real(0.2, 1.5) * diagonal, aspect, -5 * diagonal, 20 * diagonal)
                  : Perspective(dice.Real(5, 120), aspect, 1e-3 * diagonal, 20 * diagonal));
  camera.LevelBias = dice.OneIn(3) ? dice.Real(-1, 3) : 0;
  camera.CellData = dice.OneIn(4);
  return camera;
}
} // namespace

TEST(NativeRandom, AnySceneConvergesToOnePicture)
{
  int seen = 0;
  std::uint64_t evictions = 0;
  std::uint64_t interrupted = 0;
  const unsigned scenes = Effort(300u, 60u);
  for (unsigned seed = 1; seed <= scenes; ++seed)
  {
    Dice dice(seed);
    const Int3 dimensions{ dice.Whole(1, dice.OneIn(2) ? 40 : 12), dice.Whole(1, 30),
      dice.Whole(1, 24) };
    constexpr std::array<int, 9> bricks{ 2, 3, 4, 5, 8, 9, 13, 16, 33 };
    const int brick = bricks[static_cast<std::size_t>(dice.Whole(0, 8))];
    const ScalarType type = AllScalarTypes[static_cast<std::size_t>(dice.Whole(0, 7))];
    const Double3 spacing{ dice.OneIn(2) ? 1 : dice.Real(0.3, 3), 1,
      dice.OneIn(2) ? 1 : dice.Real(0.3, 3) };
    const Volume volume = MakeVolume(type, dimensions, brick,
      Landscape(dimensions, seed, IsFloat(type) && dice.OneIn(2)), spacing);
    PictureScene scene;
    scene.Source = volume.Source;
    scene.Function = RandomFunction(dice, volume);
    scene.Camera = RandomCamera(dice, volume.Source->Info());
    scene.Shade = dice.OneIn(2);
    scene.Nearest = dice.OneIn(4);
    scene.Tolerance = dice.OneIn(6) ? 0 : dice.OneIn(3) ? 1e-3 : 1.0 / 255;
    scene.SampleDistance = dice.Real(0.2, 2);
    scene.TwoSided = dice.OneIn(2);
    Dice more(seed + 100000);
    if (more.OneIn(3))
    {
      const double range = volume.High - volume.Low;
      const double low = more.OneIn(3) ? -1 : more.Real(0, 0.1);
      scene.Function = WithGradientOpacity(std::move(scene.Function), low * range,
        (std::max(low, 0.0) + (more.OneIn(4) ? 1e-4 : more.Real(0.01, 0.3))) * range);
    }
    Dice yetMore(seed + 200000);
    if (yetMore.OneIn(4))
    {
      // Opacity and colour over value and gradient: a node in three has some.
      scene.Function = volume.Plane(yetMore.Whole(1, 30), yetMore.Whole(1, 20),
        [&](double value, double gradient) -> std::array<float, 4>
        {
          const double opacity = yetMore.OneIn(30) ? 1
            : yetMore.OneIn(3)                     ? yetMore.Real(0, 0.3)
                                                   : 0;
          return { static_cast<float>(value), static_cast<float>(gradient), 0.5f,
            static_cast<float>(opacity) };
        });
    }
    const std::string what = "scene " + std::to_string(seed);

    const Picture whole = Draw(scene);
    ExpectSound(whole, what);
    PictureMeans means;
    means.Slots = static_cast<std::uint32_t>(dice.Whole(2, 9));
    means.PageBlocks = dice.OneIn(2) ? 1 : 0;
    means.StepsPerPass = static_cast<std::uint32_t>(dice.OneIn(3) ? 16384 : dice.Whole(20, 300));
    means.Skip = !dice.OneIn(4);
    means.Baseline = dice.OneIn(2);
    PictureMaker maker(scene, means);
    const Picture small = maker.Draw();
    ExpectSound(small, what);
    ExpectSameBits(whole, small, what);
    ExpectSameBits(whole, maker.Draw(), what + ", again");
    ASSERT_FALSE(HasFailure()) << what;
    seen += whole.Strongest() > 0 ? 1 : 0;
    evictions += small.Evictions;
    interrupted += small.Passes > whole.Passes ? 1 : 0;
  }
  // The dice must not have made it easy.
  EXPECT_GT(seen, static_cast<int>(scenes) / 3);
  EXPECT_GT(interrupted, scenes / 5);
  EXPECT_GT(evictions, 5u * scenes);
}

} // namespace teravox
