// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// Contract 4: of regions far from all rays nothing is written into the page table.
#include "ViewGeometry.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <gtest/gtest.h>
#include <random>
#include <vector>
#include <vtkCamera.h>
#include <vtkMatrix4x4.h>
#include <vtkNew.h>

namespace teravox
{

namespace
{
Matrix4 MatrixOf(vtkMatrix4x4* matrix)
{
  Matrix4 m{};
  std::copy_n(&matrix->Element[0][0], 16, m.begin());
  return m;
}

std::array<double, 4> Times(const Matrix4& m, const std::array<double, 4>& p)
{
  std::array<double, 4> r{};
  for (std::size_t i = 0; i < 16; ++i)
  {
    r[i / 4] += m[i] * p[i % 4];
  }
  return r;
}

// What a camera sees of a volume that lies askew in the world.
ViewInput InputOf(vtkCamera* camera, const Double3& spacing)
{
  ViewInput input;
  input.Width = 120;
  input.Height = 90;
  const double c = std::cos(0.3);
  const double s = std::sin(0.3);
  input.DatasetFromVoxel = { spacing[0], 0, 0, -7, 0, spacing[1], 0, 11, 0, 0, spacing[2], 0.5, 0,
    0, 0, 1 };
  input.WorldFromDataset = { c, -s, 0, 3, s, c, 0, -2, 0, 0, 1, 8, 0, 0, 0, 1 };
  input.ViewFromWorld = MatrixOf(camera->GetViewTransformMatrix());
  input.ClipFromView = MatrixOf(
    camera->GetProjectionTransformMatrix(static_cast<double>(input.Width) / input.Height, -1, 1));
  return input;
}
} // namespace

TEST(Contract4, BricksOutOfViewMeetNoRay)
{
  std::mt19937_64 random(23);
  const auto uniform = [&](double low, double high)
  { return std::uniform_real_distribution<double>(low, high)(random); };
  int met = 0;
  for (int view = 0; view < 200; ++view)
  {
    const double edge = std::exp2(view % 2 == 0 ? 9 : 24);
    const auto n = static_cast<std::int64_t>(edge);
    const Double3 spacing{ 1, uniform(0.8, 1.3), uniform(0.5, 3) };
    const PyramidLayout layout =
      PyramidLayout::MakeDefault({ n, n - 37, n / 2 }, spacing, 32).Value();
    vtkNew<vtkCamera> camera;
    const bool inside = view % 3 != 0;
    const double reach = inside ? 0.4 * edge : 2 * edge;
    camera->SetPosition(uniform(-reach, reach), uniform(-reach, reach), uniform(-reach, reach));
    camera->SetFocalPoint(uniform(0, edge), uniform(0, edge), uniform(0, 0.5 * edge));
    camera->SetParallelProjection(view % 5 == 0 ? 1 : 0);
    camera->SetParallelScale(uniform(0.1, 1) * edge);
    camera->SetViewAngle(uniform(10, 70));
    camera->SetWindowCenter(uniform(-0.5, 0.5), 0);
    camera->SetClippingRange(view % 7 == 0 ? 0.3 * edge : 1.0, uniform(0.5, 8) * edge);
    ViewInput input = InputOf(camera, spacing);
    input.MinimumLevel = view % 4 == 3 ? 2 : 0;
    input.LevelBias = uniform(-1, 1);
    const ViewGeometry geometry = ViewGeometry::Make(layout, input).Value();
    const std::vector<BrickBox>& boxes = geometry.Order.InView;
    ASSERT_EQ(boxes.size(), static_cast<std::size_t>(layout.NumberOfLevels()));

    const Matrix4 viewFromClip = InvertMatrix(input.ClipFromView).Value();
    const Matrix4 voxelFromView =
      InvertMatrix(MultiplyMatrices(input.ViewFromWorld,
                     MultiplyMatrices(input.WorldFromDataset, input.DatasetFromVoxel)))
        .Value();
    for (int i = 0; i < 2000; ++i)
    {
      const double x = uniform(-1, 1);
      const double y = uniform(-1, 1);
      const std::array<double, 4> a = Times(viewFromClip, { x, y, -1, 1 });
      const std::array<double, 4> b = Times(viewFromClip, { x, y, 1, 1 });
      const double along = std::pow(uniform(0, 1), 3);
      std::array<double, 4> p{ 0, 0, 0, 1 };
      for (std::size_t k = 0; k < 3; ++k)
      {
        p[k] = (1 - along) * a[k] / a[3] + along * b[k] / b[3];
      }
      const std::array<double, 4> voxel = Times(voxelFromView, p);
      bool outside = false;
      for (std::size_t k = 0; k < 3; ++k)
      {
        outside =
          outside || voxel[k] < 0 || voxel[k] >= static_cast<double>(layout.Dimensions(0)[k]);
      }
      if (outside)
      {
        continue;
      }
      int level = geometry.Levels.Minimum;
      while (level < geometry.Levels.Maximum &&
        -p[2] >= geometry.Levels.Start[static_cast<std::size_t>(level) + 1])
      {
        ++level;
      }
      ++met;
      // The level itself, and all that may be drawn instead.
      for (; level < layout.NumberOfLevels(); ++level)
      {
        const BrickBox& box = boxes[static_cast<std::size_t>(level)];
        for (std::size_t k = 0; k < 3; ++k)
        {
          const auto brick =
            static_cast<std::int64_t>(voxel[k]) / (layout.BrickSize() * layout.Factor(level)[k]);
          ASSERT_GE(brick, box.Low[k]) << "view " << view << ", level " << level;
          ASSERT_LT(brick, box.High[k]) << "view " << view << ", level " << level;
        }
      }
    }
  }
  EXPECT_GT(met, 10000);
}

TEST(Contract4, BricksInViewFollowThePicture)
{
  const std::int64_t edge = std::int64_t{ 1 } << 30;
  const PyramidLayout layout =
    PyramidLayout::MakeDefault({ edge, edge, edge }, { 1, 1, 1 }, 32).Value();
  vtkNew<vtkCamera> camera;
  const auto middle = static_cast<double>(edge / 2);
  camera->SetPosition(middle, middle, middle);
  camera->SetFocalPoint(middle + 1, middle + 0.3, middle + 0.2);
  camera->SetClippingRange(1, static_cast<double>(edge));
  const ViewGeometry geometry = ViewGeometry::Make(layout, InputOf(camera, { 1, 1, 1 })).Value();
  for (int l = 0; l < layout.NumberOfLevels(); ++l)
  {
    const BrickBox& box = geometry.Order.InView[static_cast<std::size_t>(l)];
    for (std::size_t a = 0; a < 3; ++a)
    {
      // A level's voxels are as wide as a pixel: it ends after some 2 * 120 of them.
      EXPECT_LE(box.High[a] - box.Low[a], 24) << "level " << l;
      EXPECT_GE(box.High[a] - box.Low[a], 1) << "level " << l;
    }
  }
  // From afar, only coarse levels: nothing of the others.
  camera->SetPosition(middle, middle, -2.5 * static_cast<double>(edge));
  camera->SetFocalPoint(middle, middle, middle);
  camera->SetClippingRange(0.1 * static_cast<double>(edge), 5 * static_cast<double>(edge));
  const ViewGeometry afar = ViewGeometry::Make(layout, InputOf(camera, { 1, 1, 1 })).Value();
  EXPECT_EQ(afar.Order.InView[0], (BrickBox{ { 0, 0, 0 }, { 0, 0, 0 } }));
  EXPECT_EQ(afar.Order.InView[15], (BrickBox{ { 0, 0, 0 }, { 0, 0, 0 } }));
  EXPECT_EQ(afar.Order.InView.back(), (BrickBox{ { 0, 0, 0 }, { 1, 1, 1 } }));
}

} // namespace teravox
