// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "GLStateGuard.h"

namespace teravox
{

namespace
{
constexpr std::array<GLenum, 6> UnpackNames = { GL_UNPACK_ALIGNMENT, GL_UNPACK_ROW_LENGTH,
  GL_UNPACK_IMAGE_HEIGHT, GL_UNPACK_SKIP_PIXELS, GL_UNPACK_SKIP_ROWS, GL_UNPACK_SKIP_IMAGES };
constexpr std::array<GLint, 6> UnpackValues = { 1, 0, 0, 0, 0, 0 };
constexpr std::array<GLenum, 4> PackNames = { GL_PACK_ALIGNMENT, GL_PACK_ROW_LENGTH,
  GL_PACK_SKIP_PIXELS, GL_PACK_SKIP_ROWS };
constexpr std::array<GLint, 4> PackValues = { 1, 0, 0, 0 };
constexpr std::array<GLenum, 4> BlendNames = { GL_BLEND_SRC_RGB, GL_BLEND_DST_RGB,
  GL_BLEND_SRC_ALPHA, GL_BLEND_DST_ALPHA };

void SetSwitch(GLenum name, bool on)
{
  if (on)
  {
    glEnable(name);
  }
  else
  {
    glDisable(name);
  }
}
} // namespace

GLStateGuard::GLStateGuard()
{
  glGetIntegerv(GL_DRAW_FRAMEBUFFER_BINDING, &this->Draw);
  glGetIntegerv(GL_READ_FRAMEBUFFER_BINDING, &this->Read);
  glGetIntegerv(GL_CURRENT_PROGRAM, &this->Program);
  glGetIntegerv(GL_VERTEX_ARRAY_BINDING, &this->VertexArray);
  glGetIntegerv(GL_ARRAY_BUFFER_BINDING, &this->ArrayBuffer);
  glGetIntegerv(GL_PIXEL_UNPACK_BUFFER_BINDING, &this->UnpackBuffer);
  glGetIntegerv(GL_PIXEL_PACK_BUFFER_BINDING, &this->PackBuffer);
  glGetIntegerv(GL_ACTIVE_TEXTURE, &this->ActiveTexture);
  glGetIntegerv(GL_DEPTH_WRITEMASK, &this->DepthMask);
  glGetIntegerv(GL_VIEWPORT, this->Viewport.data());
  glGetIntegerv(GL_SCISSOR_BOX, this->Scissor.data());
  glGetIntegerv(GL_COLOR_WRITEMASK, this->ColorMask.data());
  for (std::size_t i = 0; i < BlendNames.size(); ++i)
  {
    glGetIntegerv(BlendNames[i], &this->Blend[i]);
  }
  for (std::size_t i = 0; i < UnpackNames.size(); ++i)
  {
    glGetIntegerv(UnpackNames[i], &this->Unpack[i]);
    glPixelStorei(UnpackNames[i], UnpackValues[i]);
  }
  for (std::size_t i = 0; i < PackNames.size(); ++i)
  {
    glGetIntegerv(PackNames[i], &this->Pack[i]);
    glPixelStorei(PackNames[i], PackValues[i]);
  }
  for (std::size_t i = 0; i < Switches.size(); ++i)
  {
    this->Enabled[i] = glIsEnabled(Switches[i]) != 0;
  }
  for (std::size_t i = 0; i < Units; ++i)
  {
    glActiveTexture(static_cast<GLenum>(GL_TEXTURE0 + i));
    glGetIntegerv(GL_TEXTURE_BINDING_2D, &this->Textures[i].Texture2D);
    glGetIntegerv(GL_TEXTURE_BINDING_3D, &this->Textures[i].Texture3D);
    glGetIntegerv(GL_TEXTURE_BINDING_BUFFER, &this->Textures[i].TextureBuffer);
    glGetIntegerv(GL_SAMPLER_BINDING, &this->Textures[i].Sampler);
    glBindSampler(static_cast<GLuint>(i), 0);
  }
  glBindBuffer(GL_PIXEL_UNPACK_BUFFER, 0);
  glBindBuffer(GL_PIXEL_PACK_BUFFER, 0);
  for (const GLenum name : Switches)
  {
    glDisable(name);
  }
  glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
}

GLStateGuard::~GLStateGuard()
{
  for (std::size_t i = 0; i < Units; ++i)
  {
    glActiveTexture(static_cast<GLenum>(GL_TEXTURE0 + i));
    glBindTexture(GL_TEXTURE_2D, static_cast<GLuint>(this->Textures[i].Texture2D));
    glBindTexture(GL_TEXTURE_3D, static_cast<GLuint>(this->Textures[i].Texture3D));
    glBindTexture(GL_TEXTURE_BUFFER, static_cast<GLuint>(this->Textures[i].TextureBuffer));
    glBindSampler(static_cast<GLuint>(i), static_cast<GLuint>(this->Textures[i].Sampler));
  }
  glActiveTexture(static_cast<GLenum>(this->ActiveTexture));
  for (std::size_t i = 0; i < UnpackNames.size(); ++i)
  {
    glPixelStorei(UnpackNames[i], this->Unpack[i]);
  }
  for (std::size_t i = 0; i < PackNames.size(); ++i)
  {
    glPixelStorei(PackNames[i], this->Pack[i]);
  }
  for (std::size_t i = 0; i < Switches.size(); ++i)
  {
    SetSwitch(Switches[i], this->Enabled[i]);
  }
  glBlendFuncSeparate(static_cast<GLenum>(this->Blend[0]), static_cast<GLenum>(this->Blend[1]),
    static_cast<GLenum>(this->Blend[2]), static_cast<GLenum>(this->Blend[3]));
  const auto mask = [this](std::size_t i) { return static_cast<GLboolean>(this->ColorMask[i]); };
  glColorMask(mask(0), mask(1), mask(2), mask(3));
  glDepthMask(static_cast<GLboolean>(this->DepthMask));
  glViewport(this->Viewport[0], this->Viewport[1], this->Viewport[2], this->Viewport[3]);
  glScissor(this->Scissor[0], this->Scissor[1], this->Scissor[2], this->Scissor[3]);
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, static_cast<GLuint>(this->Draw));
  glBindFramebuffer(GL_READ_FRAMEBUFFER, static_cast<GLuint>(this->Read));
  glBindVertexArray(static_cast<GLuint>(this->VertexArray));
  glBindBuffer(GL_ARRAY_BUFFER, static_cast<GLuint>(this->ArrayBuffer));
  glBindBuffer(GL_PIXEL_UNPACK_BUFFER, static_cast<GLuint>(this->UnpackBuffer));
  glBindBuffer(GL_PIXEL_PACK_BUFFER, static_cast<GLuint>(this->PackBuffer));
  glUseProgram(static_cast<GLuint>(this->Program));
}

} // namespace teravox
