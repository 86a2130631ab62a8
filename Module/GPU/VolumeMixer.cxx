// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "VolumeMixer.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <iterator>
#include <limits>
#include <memory>
#include <utility>

namespace teravox
{

namespace
{
double Now()
{
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

// The depth buffer's depth of view depths, which every projection of VTK's makes of them alone.
class WindowDepth
{
public:
  explicit WindowDepth(const Matrix4& clipFromView)
    : P(clipFromView)
  {
  }
  double Near() const { return (this->P[11] + this->P[15]) / (this->P[10] + this->P[14]); }
  double Far() const { return (this->P[15] - this->P[11]) / (this->P[14] - this->P[10]); }
  /// Of depths between those two.
  float operator()(double depth) const
  {
    const double z = this->P[11] - this->P[10] * depth;
    const double w = this->P[15] - this->P[14] * depth;
    return static_cast<float>(std::clamp(0.5 * (z / w + 1), 0.0, 1.0));
  }
  /// How far apart depths are, at this one, that the depth buffer can tell.
  double Resolution(double depth) const
  {
    const double z = this->P[11] - this->P[10] * depth;
    const double w = this->P[15] - this->P[14] * depth;
    const double change = 0.5 * std::fabs((this->P[14] * z - this->P[10] * w) / (w * w));
    return std::numeric_limits<float>::epsilon() / change;
  }

private:
  Matrix4 P;
};

DepthRange DepthsOf(const VolumeMixer::Part& part)
{
  return ViewDepthsOf(part.Request.Camera, part.Voxels);
}

double ShortestEdge(const VolumeMixer::Part& part)
{
  const Matrix4 m =
    MultiplyMatrices(part.Request.Camera.WorldFromDataset, part.Request.Camera.DatasetFromVoxel);
  double shortest = std::numeric_limits<double>::infinity();
  for (std::size_t a = 0; a < 3; ++a)
  {
    shortest = std::min(shortest, std::hypot(m[a], m[4 + a], m[8 + a]));
  }
  return shortest;
}

// Where more than one volume may be.
DepthRange ZoneOf(const std::vector<DepthRange>& ranges)
{
  std::vector<double> begins;
  std::vector<double> ends;
  for (const DepthRange& range : ranges)
  {
    begins.push_back(range.Near);
    ends.push_back(range.Far);
  }
  std::sort(begins.begin(), begins.end());
  std::sort(ends.begin(), ends.end(), std::greater<double>());
  return { begins[1], ends[1] };
}

MixedRays::Options OptionsOf(const std::vector<VolumeMixer::Part>& parts, double tolerance)
{
  std::vector<DepthRange> ranges;
  double shortest = std::numeric_limits<double>::infinity();
  for (const VolumeMixer::Part& part : parts)
  {
    ranges.push_back(DepthsOf(part));
    shortest = std::min(shortest, ShortestEdge(part));
  }
  const WindowDepth window(parts[0].Request.Camera.ClipFromView);
  const DepthRange zone = ZoneOf(ranges);
  MixedRays::Options options;
  options.Tolerance = tolerance;
  options.ZoneBegin = std::clamp(zone.Near, window.Near(), window.Far());
  options.ZoneEnd = std::clamp(zone.Far, window.Near(), window.Far());
  options.LeastLength = std::max(shortest / 16, 4 * window.Resolution(options.ZoneEnd));
  return options;
}

// Where there are stretches: in view depth and in the picture.
struct Region
{
  DepthRange Depths{ std::numeric_limits<double>::infinity(),
    -std::numeric_limits<double>::infinity() };
  std::array<int, 4> Pixels{ std::numeric_limits<int>::max(), std::numeric_limits<int>::max(), 0,
    0 };
};

// The stretches as far as rays run.
std::shared_ptr<const RayDepths> ToWindow(const std::vector<MixedRays::Stretch>& stretches,
  const WindowDepth& window, const RayDepths& rays, int width, Region& region)
{
  auto depths = std::make_shared<RayDepths>();
  depths->Begin.assign(stretches.size(), 1);
  depths->End.assign(stretches.size(), 0);
  for (std::size_t i = 0; i < stretches.size(); ++i)
  {
    const MixedRays::Stretch& stretch = stretches[i];
    if (!(stretch.Begin < stretch.End))
    {
      continue;
    }
    float begin = stretch.Begin == MixedRays::FromNear ? 0.0f : window(stretch.Begin);
    float end = stretch.End == MixedRays::ToEnd ? 1.0f : window(stretch.End);
    begin = rays.Begin.empty() ? begin : std::max(begin, rays.Begin[i]);
    end = rays.End.empty() ? end : std::min(end, rays.End[i]);
    if (begin < end)
    {
      depths->Begin[i] = begin;
      depths->End[i] = end;
      region.Depths.Near = std::min(region.Depths.Near, stretch.Begin);
      region.Depths.Far = std::max(region.Depths.Far, stretch.End);
      const int x = static_cast<int>(i % static_cast<std::size_t>(width));
      const int y = static_cast<int>(i / static_cast<std::size_t>(width));
      std::array<int, 4>& p = region.Pixels;
      p = { std::min(p[0], x), std::min(p[1], y), std::max(p[2], x + 1), std::max(p[3], y + 1) };
    }
  }
  return depths;
}

// Of a picture whose colours are mixed with others: nothing is shown, and nothing but colours kept,
// and of whole rays first hits.
FrameRequest ForMixing(const VolumeMixer::Part& part, bool isWhole = false)
{
  FrameRequest request = part.Request;
  request.Show = false;
  request.Final.PropColor = std::nullopt;
  request.ErrorEstimate = false;
  request.HitOpacity = isWhole ? request.HitOpacity : std::nullopt;
  request.ShowLevel = false;
  request.ShowSamples = false;
  request.ShowFrames = false;
  return request;
}

bool IsOver(const VolumeEngine& engine)
{
  return engine.LastFrame().TimedOut || engine.LastFrame().Aborted;
}
} // namespace

Status VolumeMixer::Mix(View& view, std::vector<Part>& parts, const void* scratch, double until)
{
  MixedRays& rays = *view.Rays;
  const FrameRequest& first = parts[0].Request;
  const WindowDepth window(first.Camera.ClipFromView);
  RayDepths runs;
  if (first.Depths)
  {
    runs = *first.Depths;
  }
  else if (first.UseDepth)
  {
    runs.End = parts[0].Engine->ReadDepth(first.View);
  }
  std::vector<DepthRange> ranges;
  std::transform(parts.begin(), parts.end(), std::back_inserter(ranges), DepthsOf);
  std::vector<std::vector<float>> drawn(parts.size());
  while (!rays.IsDone() && Now() < until)
  {
    Region region;
    const auto depths = ToWindow(rays.Next(), window, runs, view.Width, region);
    for (std::size_t v = 0; v < parts.size(); ++v)
    {
      drawn[v].clear();
      if (!(region.Depths.Near < ranges[v].Far && region.Depths.Far > ranges[v].Near))
      {
        continue;
      }
      VolumeEngine& engine = *parts[v].Engine;
      FrameRequest stretch = ForMixing(parts[v]);
      stretch.View = scratch;
      stretch.Depths = depths;
      stretch.Rectangle = region.Pixels;
      stretch.IsStretch = true;
      stretch.Continues = true;
      stretch.Tolerance /= 2;
      stretch.TimeBudget = 0; // not looser in a hurry: the next frame goes on
      if (Status status = engine.Render(stretch); !status)
      {
        return status;
      }
      view.Exact = view.Exact && engine.LastFrame().Converged;
      if (IsOver(engine))
      {
        return {};
      }
      int width = 0;
      int height = 0;
      drawn[v] = engine.ReadColors(scratch, width, height);
    }
    rays.Take(drawn);
  }
  return {};
}

Status VolumeMixer::Render(std::vector<Part>& parts, const void* scratch)
{
  const double began = Now();
  const FrameRequest& first = parts[0].Request;
  const bool before = !first.Continues || this->Complete;
  this->Complete = false;
  View& view = this->Views[first.View];
  bool same = view.Exact && view.Rays && view.Parts == parts.size() && !first.Depths;
  bool converged = true;
  bool over = false;
  // Half of it, as loose as the frame is.
  double tolerance = 0;
  for (Part& part : parts)
  {
    if (Status status = part.Engine->Render(ForMixing(part, true)); !status)
    {
      return status;
    }
    const FrameStatistics& frame = part.Engine->LastFrame();
    same = same && frame.Converged && frame.Passes == 0;
    converged = converged && frame.Converged;
    over = over || IsOver(*part.Engine);
    tolerance = std::max(tolerance, frame.Tolerance / 2);
  }
  // Steps of one length have no tolerance.
  tolerance = tolerance > 0 ? tolerance : FrameRequest().Tolerance / 2;
  if (!same || view.Tolerance != tolerance)
  {
    std::vector<std::vector<float>> whole;
    whole.reserve(parts.size());
    for (Part& part : parts)
    {
      whole.push_back(part.Engine->ReadColors(first.View, view.Width, view.Height));
    }
    view.Parts = parts.size();
    view.Tolerance = tolerance;
    view.Exact = converged;
    view.Rays.emplace(OptionsOf(parts, tolerance), whole);
  }
  if (!over)
  {
    const bool isTimed = !first.Converge && first.TimeBudget > 0;
    const double until =
      isTimed ? began + first.TimeBudget : std::numeric_limits<double>::infinity();
    if (Status status = Mix(view, parts, scratch, until); !status)
    {
      view.Exact = false;
      return status;
    }
  }
  this->Complete = before && view.Rays->IsDone() && view.Exact;
  FrameRequest shown = ForMixing(parts[0]);
  shown.View = scratch;
  shown.IsStretch = true;
  shown.Show = first.Show;
  shown.Final = first.Final;
  return parts[0].Engine->ShowColors(shown, view.Rays->Colors());
}

std::vector<float> VolumeMixer::ReadColors(const void* view, int& width, int& height) const
{
  const auto found = this->Views.find(view);
  if (found == this->Views.end() || !found->second.Rays)
  {
    width = height = 0;
    return {};
  }
  width = found->second.Width;
  height = found->second.Height;
  return found->second.Rays->Colors();
}

void VolumeMixer::KeepViews(const std::set<const void*>& views)
{
  for (auto at = this->Views.begin(); at != this->Views.end();)
  {
    at = views.count(at->first) != 0 ? std::next(at) : this->Views.erase(at);
  }
}

} // namespace teravox
