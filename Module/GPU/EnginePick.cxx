// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "GLStateGuard.h"
#include "VolumeEngine.h"

#include <cmath>
#include <limits>
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
  if (!request.UseDepth || view == this->Views.end() ||
    view->second->Width() != request.Camera.Width ||
    view->second->Height() != request.Camera.Height)
  {
    return none;
  }
  const std::vector<float> depths = RayMarcher::ReadDepth(*view->second);
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

Result<FirstHits> VolumeEngine::DrawOneRay(
  const FrameRequest& request, int x, int y, double opacity)
{
  if (!this->Source_)
  {
    return Status(StatusCode::InvalidArgument, "There is no brick source to draw.");
  }
  FrameRequest ray = request;
  ray.View = &this->OneRay;
  {
    const GLStateGuard guard;
    ray.EndDepth = this->OpaqueDepth(request, x, y);
  }
  ray.UseDepth = false;
  ray.Camera = CameraOfPixel(request.Camera, x, y);
  if (request.SliceDepths)
  {
    const std::size_t pixel =
      static_cast<std::size_t>(y) * static_cast<std::size_t>(request.Camera.Width) +
      static_cast<std::size_t>(x);
    ray.SliceDepths =
      std::make_shared<const std::vector<double>>(1, request.SliceDepths->at(pixel));
  }
  ray.HitOpacity = opacity;
  ray.Show = false;
  ray.Converge = true;
  ray.CountSamples = false;
  ray.ShowLevel = false;
  ray.ShowSamples = false;
  ray.ShowFrames = false;
  ray.ErrorEstimate = false;
  ray.RecordBricks = false;
  ray.Abort = nullptr;

  // What is known of the last frame stays, and so does what it asked for.
  const FrameStatistics frame = this->Frame;
  const std::uint64_t operations = this->Operations_;
  const double looseness = this->Looseness;
  const MarchParameters::Vec step = this->EstimateStep;
  const bool known = this->EstimateKnown;
  Feedback unanswered = std::exchange(this->Unanswered, {});
  const Status status = this->Render(ray);
  std::optional<FirstHits> hits;
  if (status)
  {
    hits = this->ReadFirstHits(ray.View);
  }
  this->Views.erase(ray.View);
  this->Frame = frame;
  this->Operations_ = operations;
  this->Looseness = looseness;
  this->EstimateStep = step;
  this->EstimateKnown = known;
  this->Unanswered = std::move(unanswered);
  return !status ? Result<FirstHits>(status)
                 : Result<FirstHits>(std::move(hits).value_or(FirstHits{}));
}

} // namespace teravox
