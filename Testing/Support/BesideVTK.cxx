// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "BesideVTK.h"

#include "vtkOutOfCoreVolumeMapper.h"

#include <algorithm>
#include <cstdio>
#include <gtest/gtest.h>
#include <vtkCamera.h>
#include <vtkImageData.h>
#include <vtkPNGWriter.h>
#include <vtkPlaneCollection.h>
#include <vtkPointData.h>
#include <vtkRenderer.h>

namespace teravox::test
{

std::vector<float> WithoutAlpha(std::vector<float> picture)
{
  for (std::size_t i = 3; i < picture.size(); i += 4)
  {
    picture[i] = 0;
  }
  return picture;
}

namespace
{
// Accumulators over the renderer's background.
std::vector<float> OverBackground(Stage& stage)
{
  std::vector<float> picture = stage.Draw();
  const double* background = stage.Renderer->GetBackground();
  for (std::size_t i = 0; i < picture.size(); ++i)
  {
    const std::size_t channel = i % 4;
    picture[i] += channel == 3
      ? 0.0f
      : static_cast<float>(background[channel]) * (1 - picture[i - channel + 3]);
  }
  return WithoutAlpha(std::move(picture));
}
} // namespace

PictureEnvelope EnvelopeOf(Stage& stage, vtkVolumeMapper* mapper)
{
  vtkCamera* camera = stage.Renderer->GetActiveCamera();
  double center[2];
  camera->GetWindowCenter(center);
  PictureEnvelope envelope;
  for (int i = 0; i < 9; ++i)
  {
    // The window is two units wide.
    camera->SetWindowCenter(center[0] + (i % 3 - 1) * 2.0 / 32 / stage.Width(),
      center[1] + (i / 3 - 1) * 2.0 / 32 / stage.Height());
    const std::vector<float> picture = WithoutAlpha(stage.DrawPictureWith(mapper));
    if (i == 0)
    {
      envelope.Low = envelope.High = picture;
    }
    for (std::size_t p = 0; p < picture.size(); ++p)
    {
      envelope.Low[p] = std::min(envelope.Low[p], picture[p]);
      envelope.High[p] = std::max(envelope.High[p], picture[p]);
    }
    if (i == 4)
    {
      envelope.Middle = picture;
    }
  }
  camera->SetWindowCenter(center[0], center[1]);
  return envelope;
}

BesideVTK::BesideVTK(const ImageOptions& options, int size)
  : Image(MakeImage(options))
  , Shown(size, size)
  , Wide(WithWideScalars(this->Image))
{
  this->Shown.Mapper->SetBrickSize(16);
  this->Shown.SetImage(this->Image);
  this->Theirs->SetInputData(this->Wide);
  this->Theirs->SetScalarMode(this->Shown.Mapper->GetScalarMode());
  this->Theirs->SetAutoAdjustSampleDistances(0);
  this->Theirs->UseJitteringOff();
  this->Theirs->SetSampleDistance(
    static_cast<float>(0.1 * *std::min_element(options.Spacing.begin(), options.Spacing.end())));
}

void BesideVTK::CopyCuts()
{
  this->Theirs->SetClippingPlanes(this->Shown.Mapper->GetClippingPlanes());
  this->Theirs->SetCropping(this->Shown.Mapper->GetCropping());
  this->Theirs->SetCroppingRegionFlags(this->Shown.Mapper->GetCroppingRegionFlags());
  double planes[6];
  this->Shown.Mapper->GetCroppingRegionPlanes(planes);
  if (this->Image->GetPointData()->GetScalars())
  {
    // VTK compares a place's texture coordinate, (u (n - 1) + 0.5) / n, with u of the plane.
    double b[6];
    this->Image->GetBounds(b);
    const int* n = this->Image->GetDimensions();
    for (int i = 0; i < 6; ++i)
    {
      const double low = b[i / 2 * 2];
      const double size = b[i / 2 * 2 + 1] - low;
      const double u = (planes[i] - low) / size;
      planes[i] = low + size * (u * (n[i / 2] - 1) + 0.5) / n[i / 2];
    }
  }
  this->Theirs->SetCroppingRegionPlanes(planes);
}

void BesideVTK::Expect(const std::string& name, const Tolerance& tolerance)
{
  this->Prepare(false);
  const std::vector<float> ours = OverBackground(this->Shown);
  ASSERT_TRUE(this->Shown.Mapper->IsConverged()) << name;
  this->Prepare(true);
  const PictureEnvelope theirs = EnvelopeOf(this->Shown, this->Theirs);
  const ImageDifference plain = CompareImages(ours, theirs.Middle);
  const ImageDifference excess = ExcessOverEnvelope(ours, theirs.Low, theirs.High);
  std::printf("  %-44s mean %.3f/255, max %.2f/255 beyond the envelope, plain max %.2f/255\n",
    name.c_str(), 255 * plain.Mean, 255 * excess.Max, 255 * plain.Max);
  EXPECT_GT(*std::max_element(theirs.Middle.begin(), theirs.Middle.end()), 0.1f)
    << name << ": empty";
  EXPECT_LE(plain.Mean, tolerance.Mean / 255) << name;
  EXPECT_LE(excess.Max, tolerance.Max / 255)
    << name << ", pixel " << excess.WorstPixel % static_cast<std::size_t>(this->Shown.Width())
    << ", " << excess.WorstPixel / static_cast<std::size_t>(this->Shown.Width());
}

void BesideVTK::Save(const std::string& file)
{
  const std::vector<float> ours = this->Shown.DrawPicture();
  const std::vector<float> theirs = this->Shown.DrawPictureWith(this->Theirs);
  const int w = this->Shown.Width();
  const int h = this->Shown.Height();
  vtkNew<vtkImageData> both;
  both->SetDimensions(2 * w, h, 1);
  both->AllocateScalars(VTK_UNSIGNED_CHAR, 3);
  for (int y = 0; y < h; ++y)
  {
    for (int x = 0; x < 2 * w; ++x)
    {
      const std::vector<float>& from = x < w ? ours : theirs;
      for (int c = 0; c < 3; ++c)
      {
        const std::size_t at = 4 * static_cast<std::size_t>(y * w + x % w);
        both->SetScalarComponentFromFloat(x, y, 0, c, 255 * from[at + static_cast<std::size_t>(c)]);
      }
    }
  }
  vtkNew<vtkPNGWriter> writer;
  writer->SetInputData(both);
  writer->SetFileName(file.c_str());
  writer->Write();
}

} // namespace teravox::test
