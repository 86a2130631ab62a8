// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "VolumeEngine.h"

#include <functional>
#include <memory>

class vtkAbstractMapper;
class vtkDualDepthPeelingPass;
class vtkOpenGLRenderWindow;
class vtkProp;
class vtkVolume;

namespace teravox
{

/// What draws stretches of rays: one engine, or several together.
struct StretchPainter
{
  /// See VolumeEngine::PrepareStretch(), Render() and, of the view that was drawn, StretchColors().
  std::function<Result<GLuint>(const FrameRequest&)> Prepare;
  std::function<Status(const FrameRequest&)> Render;
  std::function<GLuint(bool keep)> Colors;

  static StretchPainter Of(VolumeEngine& engine, const void* view)
  {
    return { [&engine](const FrameRequest& request) { return engine.PrepareStretch(request); },
      [&engine](const FrameRequest& request) { return engine.Render(request); },
      [&engine, view](bool keep) { return engine.StretchColors(view, keep); } };
  }
};

/// A volume between translucent geometry. vtkDualDepthPeelingPass renders volumes once before its
/// first peel and once with each: what lies in front of the foremost geometry and behind the
/// backmost, then, peel after peel, between one surface and the next, from the front and from the
/// back. It says so in GLSL, which it puts into the shader of VTK's mapper, and which blends the
/// colours of the stretches into its targets; here into Shaders/Peel.frag.
/// Thread: used by the render thread only, with the context current.
class DepthPeeling
{
public:
  /// The pass that is rendering this prop, if one is.
  static vtkDualDepthPeelingPass* PassOf(vtkProp* prop);

  /// Draws what the pass wants now, into the targets that it has bound. `request`: of the picture
  /// without peels; gets the depth where rays end, for who asks for the whole rays afterwards.
  /// Errors: those of VolumeEngine::Render, Unsupported (the pass's text can't be compiled).
  Status Draw(const StretchPainter& painter, FrameRequest& request, vtkDualDepthPeelingPass* pass,
    vtkAbstractMapper* mapper, vtkVolume* volume, vtkOpenGLRenderWindow* window);

  /// Whether that was the first of the stretches of a frame.
  bool IsFirst() const { return this->First; }

private:
  bool First = false;
  bool Begun = false;                     ///< a stretch of the frame has been drawn
  std::shared_ptr<const RayDepths> Whole; ///< of the frame under way
};

} // namespace teravox
