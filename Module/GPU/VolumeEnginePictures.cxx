// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// What becomes of the rays of VolumeEngine: shown, read back, joined with those of other blocks.
#include "BlockPictures.h"
#include "GLStateGuard.h"
#include "SharedLayout.h"
#include "VolumeEngine.h"

#include <algorithm>
#include <unordered_set>

namespace teravox
{

namespace
{
// Colours of 16 bits, and roundings of floats along a ray.
constexpr float FormatError = 2.0e-5f;
} // namespace

Status VolumeEngine::Show(const FrameRequest& request, ViewState& view)
{
  Status status = request.Show
    ? this->Marcher->Compose(view, request.Framebuffer, request.X, request.Y, request.Final)
    : Status();
  if (status && request.Show && request.ShowFrames && !request.Final.PropColor)
  {
    status = this->Marcher->DrawFrames(
      *view.Frames, request.Framebuffer, { request.X, request.Y, view.Width(), view.Height() });
  }
  this->Frame.Converged = this->Frame.Converged && status.Ok();
  return status;
}

std::vector<float> VolumeEngine::ReadDepth(const void* view) const
{
  const auto found = this->Views.find(view);
  const GLStateGuard guard;
  return found != this->Views.end() ? RayMarcher::ReadDepth(*found->second) : std::vector<float>();
}

Status VolumeEngine::ShowColors(const FrameRequest& request, const std::vector<float>& colors)
{
  const GLStateGuard guard;
  Result<ViewState*> view = this->PrepareView(request);
  if (!view)
  {
    return view.GetStatus();
  }
  std::vector<float> rays = colors;
  for (std::size_t i = 3; i < rays.size(); i += 4)
  {
    rays[i] = 1.0f - rays[i];
  }
  RayMarcher::SetGathered(*view.Value(), rays, 4);
  view.Value()->Complete.reset();
  return this->Show(request, *view.Value());
}

std::vector<float> VolumeEngine::ReadColors(const void* view, int& width, int& height)
{
  const auto found = this->Views.find(view);
  width = height = 0;
  if (found == this->Views.end() || found->second->Color.Id() == 0)
  {
    return {};
  }
  const GLStateGuard guard;
  width = found->second->Width();
  height = found->second->Height();
  std::vector<float> colors(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 4);
  if (found->second->IsNative())
  {
    colors = found->second->Native.Color;
  }
  else
  {
    found->second->Color.Bind(0);
    glGetTexImage(GL_TEXTURE_2D, 0, GL_RGBA, GL_FLOAT, colors.data());
  }
  for (std::size_t i = 3; i < colors.size(); i += 4)
  {
    colors[i] = 1.0f - colors[i];
  }
  return colors;
}

std::vector<float> VolumeEngine::ReadGathered(const void* view, int& width, int& height) const
{
  const auto found = this->Views.find(view);
  if (found == this->Views.end() || !found->second->Gathered)
  {
    width = height = 0;
    return {};
  }
  width = found->second->Width();
  height = found->second->Height();
  return found->second->Gathered->Pixels;
}

std::vector<float> VolumeEngine::ResolveGathered(
  const void* view, const std::vector<float>& gathered)
{
  const auto found = this->Views.find(view);
  if (found == this->Views.end() || !found->second->Gathered ||
    found->second->Gathered->Pixels.size() != gathered.size())
  {
    return {};
  }
  ViewState& state = *found->second;
  const ViewState::GatheredRays& how = *state.Gathered;
  const GLStateGuard guard;
  const int channels = GatheredChannels(how.Blend, how.Components);
  const std::vector<float> before = RayMarcher::ReadGathered(state, channels);
  RayMarcher::SetGathered(state, gathered, channels);
  ShaderVariant variant;
  variant.Blend = how.Blend;
  variant.Components = how.Components;
  variant.Dependent = how.Dependent;
  const Status status = this->Marcher->Resolve(state, how.Parameters, variant);
  int width = 0;
  int height = 0;
  std::vector<float> colors = status ? this->ReadColors(view, width, height) : std::vector<float>();
  RayMarcher::SetGathered(state, before, channels);
  return colors;
}

std::vector<float> VolumeEngine::ReadErrors(const void* view, int& width, int& height)
{
  const auto found = this->Views.find(view);
  if (found == this->Views.end() || !found->second->HasEstimate())
  {
    width = height = 0;
    return {};
  }
  const std::vector<float> colors = this->ReadColors(view, width, height);
  if (width <= 0)
  {
    return {};
  }
  ViewState& state = *found->second;
  const GLStateGuard guard;
  std::vector<std::int32_t> positions;
  std::vector<float> errors;
  if (state.IsNative())
  {
    positions = state.Native.Position;
    errors = state.Native.Error;
  }
  else
  {
    positions.resize(colors.size());
    errors.resize(colors.size() / 4);
    state.Position.Bind(0);
    glGetTexImage(GL_TEXTURE_2D, 0, GL_RGBA_INTEGER, GL_INT, positions.data());
    state.Error.Bind(0);
    glGetTexImage(GL_TEXTURE_2D, 0, GL_RED, GL_FLOAT, errors.data());
  }
  const float brightest = this->HasComponents()
    ? static_cast<float>(LargestLight(this->Components_, this->Source_->Info().Components))
    : 1.0f;
  const std::unordered_set<std::uint32_t> underWay(
    state.ActiveTiles.begin(), state.ActiveTiles.end());
  for (std::size_t i = 0; i < errors.size(); ++i)
  {
    const float left = 1 - colors[4 * i + 3];
    const auto x = static_cast<std::uint32_t>(i % static_cast<std::size_t>(width));
    const auto y = static_cast<std::uint32_t>(i / static_cast<std::size_t>(width));
    const std::uint32_t tile = x / shared::TILE_SIZE | y / shared::TILE_SIZE << 16;
    // The native marcher leaves out what pieces may err for the opacity that they add.
    errors[i] += state.IsNative() ? this->EstimateStep[1] * colors[4 * i + 3] : 0;
    constexpr std::int32_t done = 2;
    const bool ended = underWay.count(tile) == 0 || (positions[4 * i + 3] >> 16 & 3) == done;
    // Of rays that were over before their end the marchers tell, for light of at most 1.
    const bool over = ended && left <= this->EstimateStep[2];
    errors[i] += !ended ? brightest * left : over ? (brightest - 1) * this->EstimateStep[2] : 0;
    errors[i] = this->EstimateKnown ? std::min(errors[i] + FormatError, brightest) : brightest;
  }
  return errors;
}

std::optional<FirstHits> VolumeEngine::ReadFirstHits(const void* view)
{
  const auto found = this->Views.find(view);
  if (found == this->Views.end() || !found->second->HasFirstHit())
  {
    return std::nullopt;
  }
  const ViewState& state = *found->second;
  FirstHits hits;
  hits.Geometry = state.Geometry;
  const GLStateGuard guard;
  if (state.Geometry->Intervals.HasDepth)
  {
    hits.Opaque = RayMarcher::ReadDepth(state);
  }
  if (state.IsNative())
  {
    hits.DepthAndLevel = state.Native.FirstHit;
    return hits;
  }
  hits.DepthAndLevel.resize(
    static_cast<std::size_t>(state.Width()) * static_cast<std::size_t>(state.Height()) * 2);
  state.FirstHit.Bind(0);
  glGetTexImage(GL_TEXTURE_2D, 0, GL_RG, GL_FLOAT, hits.DepthAndLevel.data());
  return hits;
}

} // namespace teravox
