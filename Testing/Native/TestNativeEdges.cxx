// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Where rounding could lead astray: odd sizes, rays along axes, eyes on faces, data without values.
#include "FaultyBrickSource.h"
#include "NativeVolumes.h"

#include <gtest/gtest.h>

namespace teravox
{

namespace
{
using namespace test;

constexpr std::array<ScalarType, 4> Types = { ScalarType::UInt8, ScalarType::UInt16,
  ScalarType::Float32, ScalarType::Float64 };

PictureScene SceneOf(const Volume& volume)
{
  PictureScene scene;
  scene.Source = volume.Source;
  scene.Function =
    volume.Function({ 0.0, 0.3, 0.42, 0.5, 0.65, 0.7, 1.0 }, { 0, 0, 0.15, 0, 0, 0.04, 0.3 });
  return scene;
}

// Linear, shaded, nearest, fixed step.
void ForEachWay(PictureScene scene, const std::function<void(const PictureScene&)>& f)
{
  f(scene);
  scene.Shade = true;
  f(scene);
  scene.Nearest = true;
  f(scene);
  scene.Nearest = false;
  scene.Tolerance = 0;
  f(scene);
}

// Large and small atlas, long and short passes: sound, and the same bits.
Picture ExpectSoundInAnyAtlas(const PictureScene& scene, const std::string& what)
{
  const Picture whole = Draw(scene);
  ExpectSound(whole, what);
  PictureMeans means;
  means.Slots = 2;
  means.StepsPerPass = 100;
  const Picture small = Draw(scene, means);
  ExpectSound(small, what);
  ExpectSameBits(whole, small, what);
  return whole;
}
} // namespace

TEST(NativeEdges, BricksOfAnySize)
{
  for (const int brick : { 2, 3, 7, 10, 33 })
  {
    // Partial bricks at the ends; not so many of the smallest.
    const Int3 dimensions =
      brick < 5 ? Int3{ 9, 11, 8 } : Int3{ 2 * brick + 1, brick + 2, brick + brick / 2 };
    for (const ScalarType type : Types)
    {
      const Volume volume = MakeVolume(type, dimensions, brick, Landscape(dimensions, 5));
      PictureScene scene = SceneOf(volume);
      scene.Camera = Outside(volume.Source->Info(), 12, 11);
      ForEachWay(scene,
        [&](const PictureScene& s)
        {
          const std::string what = std::to_string(brick) + ", " + ToString(type) +
            (s.Shade ? ", shaded" : "") + (s.Nearest ? ", nearest" : "");
          EXPECT_GT(ExpectSoundInAnyAtlas(s, what).Strongest(), 0.1f) << what;
        });
    }
  }
}

TEST(NativeEdges, PicturesOfAnySize)
{
  const Int3 dimensions{ 20, 18, 22 };
  const Volume volume = MakeVolume(ScalarType::UInt8, dimensions, 8, Landscape(dimensions, 2));
  PictureScene scene = SceneOf(volume);
  scene.Shade = true;
  scene.Function = volume.Function({ 0, 1 }, { 0.05, 0.05 });
  for (const auto& size : { std::array<int, 2>{ 1, 1 }, { 33, 31 }, { 31, 33 }, { 65, 1 } })
  {
    const std::string what = std::to_string(size[0]) + " x " + std::to_string(size[1]);
    scene.Camera = Outside(volume.Source->Info(), size[0], size[1]);
    const Picture picture = ExpectSoundInAnyAtlas(scene, what);
    EXPECT_EQ(picture.Colors.size(), static_cast<std::size_t>(4 * size[0] * size[1])) << what;
    EXPECT_GT(picture.Strongest(), 0.1f) << what;
  }
}

TEST(NativeEdges, EyesInside)
{
  const Int3 dimensions{ 30, 26, 28 };
  const Volume volume = MakeVolume(ScalarType::Float32, dimensions, 7, Landscape(dimensions, 4));
  PictureScene scene = SceneOf(volume);
  const Double3 eye{ 14.3, 12.9, 13.4 };
  int seen = 0;
  for (const Double3& towards :
    { Double3{ 1, 0.2, 0.3 }, { -1, 0.1, 0.4 }, { 0.3, 1, 0.1 }, { 0.2, -0.3, -1 } })
  {
    const Double3 focus{ eye[0] + towards[0], eye[1] + towards[1], eye[2] + towards[2] };
    scene.Camera = MakeCamera(volume.Source->Info(), 20, 20, LookAt(eye, focus, { 0.1, 0.3, 0.9 }),
      Perspective(90, 1, 1e-3, 200));
    ForEachWay(scene,
      [&](const PictureScene& s)
      { seen += ExpectSoundInAnyAtlas(s, "inside").Strongest() > 0.1f ? 1 : 0; });
  }
  EXPECT_EQ(seen, 16);
}

// The opacity is the same for all values: the transmittance follows from the length of the ray
// alone, whatever happens in the cells. Rays lie on voxel centres (faces of interpolation cells),
// on voxel faces and brick faces, and between.
TEST(NativeEdges, RaysAlongAxesMeetTheirClosedForm)
{
  const Int3 dimensions{ 24, 16, 20 };
  constexpr double opacity = 0.05;
  for (const ScalarType type : Types)
  {
    const Volume volume = MakeVolume(type, dimensions, 8, Landscape(dimensions, 6));
    PictureScene scene;
    scene.Source = volume.Source;
    scene.Function = volume.Function({ 0, 1 }, { opacity, opacity });
    for (std::size_t axis = 0; axis < 3; ++axis)
    {
      for (const double sign : { 1.0, -1.0 })
      {
        for (const double offset : { 0.0, 0.5, 0.25 })
        {
          // Four by four voxels around the middle, which is a corner of a brick along y.
          Double3 focus{ 12 + offset, 8 + offset, 10 + offset };
          Double3 eye = focus;
          eye[axis] -= sign * 50;
          Double3 up{};
          up[(axis + 1) % 3] = 1;
          scene.Camera = MakeCamera(
            volume.Source->Info(), 9, 9, LookAt(eye, focus, up), Parallel(9 * 0.5, 1, 0.1, 200));
          const std::string what = std::string(ToString(type)) + ", axis " + std::to_string(axis) +
            ", offset " + std::to_string(offset);
          const auto expected =
            static_cast<float>(std::pow(1 - opacity, static_cast<double>(dimensions[axis] - 1)));
          ForEachWay(scene,
            [&](const PictureScene& s)
            {
              const Picture picture = ExpectSoundInAnyAtlas(s, what);
              for (std::size_t i = 3; i < picture.Colors.size(); i += 4)
              {
                ASSERT_NEAR(picture.Colors[i], expected, 2e-5f) << what << ", pixel " << i / 4;
              }
            });
        }
      }
    }
  }
}

// Eyes at brick corners, brick faces, voxel corners and voxel centres, inside and on the volume's
// faces; the ray of the middle pixel runs exactly along an axis.
TEST(NativeEdges, EyesOnFaces)
{
  const Int3 dimensions{ 24, 16, 24 };
  constexpr double opacity = 0.05;
  const Volume volume = MakeVolume(ScalarType::UInt8, dimensions, 8, Landscape(dimensions, 1));
  PictureScene scene;
  scene.Source = volume.Source;
  scene.Function = volume.Function({ 0, 1 }, { opacity, opacity });
  for (const Double3& eye : { Double3{ 8, 8, 8 }, { 16, 5, 11.3 }, { 5, 6, 7 }, { 5.5, 6.5, 7.5 },
         { 0, 0, 0 }, { 24, 16, 24 }, { 0.5, 8.5, 12.5 }, { 12, 8, 0 }, { 23.5, 15.5, 23.5 } })
  {
    for (std::size_t axis = 0; axis < 3; ++axis)
    {
      for (const double sign : { 1.0, -1.0 })
      {
        Double3 focus = eye;
        focus[axis] += sign;
        Double3 up{};
        up[(axis + 2) % 3] = 1;
        scene.Camera = MakeCamera(
          volume.Source->Info(), 9, 9, LookAt(eye, focus, up), Perspective(60, 1, 1e-4, 100));
        const std::string what = "eye " + std::to_string(eye[0]) + ", " + std::to_string(eye[1]) +
          ", " + std::to_string(eye[2]) + ", axis " + std::to_string(axis);
        ForEachWay(scene, [&](const PictureScene& s) { ExpectSoundInAnyAtlas(s, what); });
        // Where the middle ray lies inside the box of outer voxel centres, its length is known.
        const Picture picture = Draw(scene);
        bool inside = true;
        for (std::size_t a = 0; a < 3; ++a)
        {
          const double last = static_cast<double>(dimensions[a]) - 0.5;
          inside = inside && (a == axis || (eye[a] > 0.5 && eye[a] < last));
        }
        if (inside)
        {
          const double last = static_cast<double>(dimensions[axis]) - 0.5;
          const double length =
            sign > 0 ? last - std::max(eye[axis], 0.5) : std::min(eye[axis], last) - 0.5;
          EXPECT_NEAR(picture.Colors[std::size_t{ 4 * 40 } + 3],
            std::pow(1 - opacity, std::max(length, 0.0)), 2e-5)
            << what;
        }
      }
    }
  }
}

TEST(NativeEdges, DataWithoutNumbers)
{
  const Int3 dimensions{ 13, 12, 14 };
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  constexpr double infinity = std::numeric_limits<double>::infinity();
  const std::vector<std::pair<std::string, VoxelField>> fields{ { "NaN",
                                                                  [](const Int3&) { return nan; } },
    { "infinity", [](const Int3&) { return infinity; } },
    { "minus infinity", [](const Int3&) { return -infinity; } },
    { "both infinities",
      [](const Int3& at) { return (at[0] + at[1] + at[2]) % 2 == 0 ? infinity : -infinity; } },
    { "NaN, infinities and numbers",
      [](const Int3& at)
      {
        const std::array<double, 5> values{ nan, infinity, 0.4, -infinity, 0.75 };
        return values[static_cast<std::size_t>((at[0] + 2 * at[1] + at[0] * at[2]) % 5)];
      } },
    { "halves", [](const Int3& at) {
       return at[0] < 5 ? nan : at[1] < 6 ? infinity : at[2] < 7 ? 0.4 : 0.8;
     } } };
  for (const ScalarType type : { ScalarType::Float32, ScalarType::Float64 })
  {
    for (const auto& field : fields)
    {
      const Volume volume = MakeVolume(type, dimensions, 5, field.second);
      PictureScene scene = SceneOf(volume);
      scene.Camera = Outside(volume.Source->Info(), 14, 14);
      for (const bool flat : { false, true })
      {
        scene.Function = flat ? volume.Function({ 0, 1 }, { 0.2, 0.2 }) : SceneOf(volume).Function;
        ForEachWay(scene,
          [&](const PictureScene& s)
          {
            const std::string what = field.first + ", " + ToString(type) +
              (s.Shade ? ", shaded" : "") + (s.Nearest ? ", nearest" : "") + (flat ? ", flat" : "");
            const Picture picture = ExpectSoundInAnyAtlas(s, what);
            if (field.first == "NaN")
            {
              EXPECT_EQ(picture.Strongest(), 0.0f) << what;
            }
            else if (field.first == "halves" && flat)
            {
              EXPECT_GT(picture.Strongest(), 0.5f) << what;
            }
          });
      }
    }
  }
}

TEST(NativeEdges, BricksThatCantBeRead)
{
  const Int3 dimensions{ 30, 31, 32 };
  const Volume volume = MakeVolume(ScalarType::UInt16, dimensions, 8, Landscape(dimensions, 9));
  PictureScene scene = SceneOf(volume);
  scene.Camera = Outside(volume.Source->Info(), 20, 20);
  const Picture whole = Draw(scene);
  ExpectSound(whole, "readable");
  EXPECT_FALSE(whole.Fallback);
  const auto faulty = std::make_shared<FaultyBrickSource>(volume.Source);
  scene.Source = faulty;
  faulty->SetFaults(
    [](const BrickKey& key)
    {
      return key.PageLevel == 0 && key.Level == 0 && (key.X + key.Y + key.Z) % 3 == 1
        ? Fault::Status
        : Fault::None;
    });
  const Picture coarser = ExpectSoundInAnyAtlas(scene, "some bricks fail");
  EXPECT_TRUE(coarser.Fallback);
  EXPECT_GT(coarser.Strongest(), 0.2f);
  faulty->SetFaults(
    [](const BrickKey& key) { return key.PageLevel == 0 ? Fault::Status : Fault::None; });
  const Picture nothing = ExpectSoundInAnyAtlas(scene, "all bricks fail");
  EXPECT_TRUE(nothing.Fallback);
}

} // namespace teravox
