// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "GLApi.h"

#include <array>

namespace teravox
{

/// Saves the GL state that the marcher changes and puts exactly that back, so that what VTK
/// believes about the state (vtkOpenGLState caches it) stays true.
class GLStateGuard
{
public:
  GLStateGuard();
  ~GLStateGuard();
  GLStateGuard(const GLStateGuard&) = delete;
  GLStateGuard& operator=(const GLStateGuard&) = delete;
  GLStateGuard(GLStateGuard&&) = delete;
  GLStateGuard& operator=(GLStateGuard&&) = delete;

  GLuint DrawFramebuffer() const { return static_cast<GLuint>(this->Draw); }
  GLuint ReadFramebuffer() const { return static_cast<GLuint>(this->Read); }

private:
  static constexpr std::size_t Units = 10;
  static constexpr std::array<GLenum, 5> Switches = { GL_BLEND, GL_DEPTH_TEST, GL_SCISSOR_TEST,
    GL_CULL_FACE, GL_STENCIL_TEST };
  GLint Draw = 0;
  GLint Read = 0;
  GLint Program = 0;
  GLint VertexArray = 0;
  GLint ArrayBuffer = 0;
  GLint UnpackBuffer = 0;
  GLint PackBuffer = 0;
  GLint ActiveTexture = 0;
  GLint DepthMask = 0;
  std::array<GLint, 4> Viewport{};
  std::array<GLint, 4> Scissor{};
  std::array<GLint, 4> Blend{};
  std::array<GLint, 4> ColorMask{};
  std::array<GLint, 6> Unpack{};
  std::array<GLint, 4> Pack{};
  std::array<bool, Switches.size()> Enabled{};
  struct UnitState
  {
    GLint Texture2D = 0;
    GLint Texture3D = 0;
    GLint TextureBuffer = 0;
    GLint Sampler = 0;
  };
  std::array<UnitState, Units> Textures{};
};

} // namespace teravox
