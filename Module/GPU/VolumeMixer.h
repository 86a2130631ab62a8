// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "MixedRays.h"
#include "VolumeEngine.h"

#include <map>
#include <optional>
#include <set>
#include <vector>

namespace teravox
{

/// One picture of several volumes that may fill the same places, each with an engine of its own.
/// Each is drawn alone; where more than one shows something, their rays are drawn again in
/// stretches and mixed, see MixedRays. Half of the tolerance is for the stretches, half for the
/// order of what lies in them. Thread: used by the render thread only, with the context current.
class VolumeMixer
{
public:
  struct Part
  {
    VolumeEngine* Engine = nullptr;
    FrameRequest Request; ///< Show and Final are those of the first; no debug views
    Int3 Voxels{};        ///< of level 0
  };
  /// GL. Draws one frame; `scratch`: a view for the stretches, of the same size. Frames that aren't
  /// to converge end when their time is over, rays that aren't done then show their volumes as if
  /// each was spread over the whole ray; the next frame of an unchanged scene goes on with them.
  /// Stretches of a frame (FrameRequest::IsStretch) are drawn as the engines draw them.
  /// Errors: those of VolumeEngine::Render; they leave the frame buffer untouched.
  Status Render(std::vector<Part>& parts, const void* scratch);

  /// Whether the last frame was complete, but for what the engines know.
  bool IsComplete() const { return this->Complete; }
  /// Premultiplied colours and opacities of the last frame of a view, as
  /// VolumeEngine::ReadColors().
  std::vector<float> ReadColors(const void* view, int& width, int& height) const;
  void KeepViews(const std::set<const void*>& views);
  void Clear() { this->Views.clear(); }

private:
  struct View
  {
    int Width = 0;
    int Height = 0;
    std::size_t Parts = 0;
    double Tolerance = 0;
    bool Exact = false; ///< what was mixed is what the engines' complete pictures are of
    std::optional<MixedRays> Rays;
  };
  static Status Mix(View& view, std::vector<Part>& parts, const void* scratch, double until);

  std::map<const void*, View> Views;
  bool Complete = false;
};

} // namespace teravox
