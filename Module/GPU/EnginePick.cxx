// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "GLStateGuard.h"
#include "VolumeEngine.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>

namespace teravox
{

namespace
{
// The camera whose whole picture is one pixel of another's.
ViewInput CameraOfPixel(const ViewInput& camera, int x, int y)
{
  // ndc' = (ndc - center) * size, per axis
  Matrix4 zoom{};
  zoom[0] = camera.Width;
  zoom[3] = camera.Width - (2 * x + 1);
  zoom[5] = camera.Height;
  zoom[7] = camera.Height - (2 * y + 1);
  zoom[10] = 1;
  zoom[15] = 1;
  ViewInput pixel = camera;
  pixel.ClipFromView = MultiplyMatrices(zoom, camera.ClipFromView);
  pixel.Width = 1;
  pixel.Height = 1;
  return pixel;
}
} // namespace

double VolumeEngine::OpaqueDepth(const FrameRequest& request, int x, int y) const
{
  constexpr double none = std::numeric_limits<double>::infinity();
  const auto view = this->Views.find(request.View);
  const bool isThere = view != this->Views.end() && view->second->Width() == request.Camera.Width &&
    view->second->Height() == request.Camera.Height;
  if (!request.Depths && (!request.UseDepth || !isThere))
  {
    return none;
  }
  const std::vector<float> depths =
    request.Depths ? request.Depths->End : RayMarcher::ReadDepth(*view->second);
  const float depth =
    depths[static_cast<std::size_t>(y) * static_cast<std::size_t>(request.Camera.Width) +
      static_cast<std::size_t>(x)];
  const Result<ViewGeometry> geometry =
    ViewGeometry::Make(this->Source_->Info().Layout, request.Camera);
  if (!(depth < 1) || !geometry)
  {
    return none;
  }
  const ViewGeometry& g = geometry.Value();
  return g.DepthOrigin + g.DepthOfWindow(request.Camera, x + 0.5, y + 0.5, depth);
}

// The picture of one pixel of another's; it ends where that one's rays ended at opaque geometry.
FrameRequest VolumeEngine::RayOf(const FrameRequest& request, int x, int y) const
{
  FrameRequest ray = request;
  {
    const GLStateGuard guard;
    ray.EndDepth = this->OpaqueDepth(request, x, y);
  }
  ray.UseDepth = false;
  ray.Depths = nullptr;
  ray.Camera = CameraOfPixel(request.Camera, x, y);
  if (request.SliceDepths)
  {
    const std::size_t pixel =
      static_cast<std::size_t>(y) * static_cast<std::size_t>(request.Camera.Width) +
      static_cast<std::size_t>(x);
    ray.SliceDepths =
      std::make_shared<const std::vector<double>>(1, request.SliceDepths->at(pixel));
  }
  return ray;
}

Result<FirstHits> VolumeEngine::DrawOneRay(
  const FrameRequest& request, int x, int y, double opacity)
{
  if (!this->Source_)
  {
    return Status(StatusCode::InvalidArgument, "There is no brick source to draw.");
  }
  return this->DrawAside(this->RayOf(request, x, y), opacity);
}

Result<double> VolumeEngine::OpacityOfRay(
  const FrameRequest& request, int x, int y, double endDepth)
{
  if (!this->Source_)
  {
    return Status(StatusCode::InvalidArgument, "There is no brick source to draw.");
  }
  FrameRequest ray = this->RayOf(request, x, y);
  ray.EndDepth = std::min(ray.EndDepth, endDepth);
  std::vector<float> colors;
  const Result<FirstHits> drawn = this->DrawAside(std::move(ray), std::nullopt, &colors);
  return !drawn ? Result<double>(drawn.GetStatus()) : static_cast<double>(colors.at(3));
}

Result<FirstHits> VolumeEngine::DrawHits(const FrameRequest& request, double opacity)
{
  return this->DrawAside(request, opacity);
}

Result<FirstHits> VolumeEngine::DrawAside(
  FrameRequest request, std::optional<double> opacity, std::vector<float>* colors)
{
  request.View = &this->Aside;
  request.HitOpacity = opacity;
  request.Show = false;
  request.Converge = true;
  request.CountSamples = false;
  request.ShowLevel = false;
  request.ShowSamples = false;
  request.ShowFrames = false;
  request.ErrorEstimate = false;
  request.RecordBricks = false;
  request.Abort = nullptr;

  // What is known of the last frame stays, and so does what it asked for.
  const FrameStatistics frame = this->Frame;
  const std::uint64_t operations = this->Operations_;
  const FramePace pace = this->Pace;
  const MarchParameters::Vec step = this->EstimateStep;
  const bool known = this->EstimateKnown;
  Feedback unanswered = std::exchange(this->Unanswered, {});
  const Status status = this->Render(request);
  std::optional<FirstHits> hits;
  if (status && opacity)
  {
    hits = this->ReadFirstHits(request.View);
  }
  if (status && colors != nullptr)
  {
    int width = 0;
    int height = 0;
    *colors = this->ReadColors(request.View, width, height);
  }
  this->Views.erase(request.View);
  this->Frame = frame;
  this->Operations_ = operations;
  this->Pace = pace;
  this->EstimateStep = step;
  this->EstimateKnown = known;
  this->Unanswered = std::move(unanswered);
  return !status ? Result<FirstHits>(status)
                 : Result<FirstHits>(std::move(hits).value_or(FirstHits{}));
}

void VolumeEngine::PutPixels(
  const FrameRequest& request, const std::vector<std::array<std::uint8_t, 4>>& pixels)
{
  const int width = request.Camera.Width;
  const int height = request.Camera.Height;
  const GLStateGuard guard;
  std::vector<std::array<std::uint8_t, 4>> all(pixels.size());
  glBindFramebuffer(GL_READ_FRAMEBUFFER, request.Framebuffer);
  glReadPixels(request.X, request.Y, width, height, GL_RGBA, GL_UNSIGNED_BYTE, all.data());
  for (std::size_t i = 0; i < all.size(); ++i)
  {
    all[i] = pixels[i][3] != 0 ? pixels[i] : all[i];
  }
  const GLTexture texture(this->Memory_, GL_TEXTURE_2D, GL_RGBA8, width, height, 1, 4, GL_NEAREST);
  texture.Bind(0);
  glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, width, height, GL_RGBA, GL_UNSIGNED_BYTE, all.data());
  const GLFramebuffer from = GLFramebuffer::Make();
  glBindFramebuffer(GL_READ_FRAMEBUFFER, from.Id());
  glFramebufferTexture2D(GL_READ_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, texture.Id(), 0);
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, request.Framebuffer);
  glBlitFramebuffer(0, 0, width, height, request.X, request.Y, request.X + width,
    request.Y + height, GL_COLOR_BUFFER_BIT, GL_NEAREST);
}

} // namespace teravox
