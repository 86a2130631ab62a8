// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "GLObjects.h"

#include <string>
#include <vector>

namespace teravox
{

int& LostContext::Depth()
{
  thread_local int depth = 0;
  return depth;
}

bool IsSoftwareRenderer()
{
  const auto* text = reinterpret_cast<const char*>(glGetString(GL_RENDERER));
  const std::string renderer = text != nullptr ? text : "";
  return renderer.find("llvmpipe") != std::string::npos ||
    renderer.find("softpipe") != std::string::npos || renderer.find("SWR") != std::string::npos;
}

GLBuffer::GLBuffer(
  GPUMemory& memory, GLenum target, std::size_t bytes, const void* data, GLenum usage)
  : Memory(&memory)
  , Target(target)
  , Bytes(bytes)
{
  glGenBuffers(1, &this->Name);
  glBindBuffer(target, this->Name);
  glBufferData(target, static_cast<GLsizeiptr>(bytes), data, usage);
  glBindBuffer(target, 0);
  memory.Add(bytes);
}

void GLBuffer::Write(std::size_t offset, std::size_t bytes, const void* data)
{
  glBindBuffer(this->Target, this->Name);
  glBufferSubData(
    this->Target, static_cast<GLintptr>(offset), static_cast<GLsizeiptr>(bytes), data);
  glBindBuffer(this->Target, 0);
}

void GLBuffer::Read(std::size_t offset, std::size_t bytes, void* data) const
{
  glBindBuffer(this->Target, this->Name);
  glGetBufferSubData(
    this->Target, static_cast<GLintptr>(offset), static_cast<GLsizeiptr>(bytes), data);
  glBindBuffer(this->Target, 0);
}

void GLBuffer::Release()
{
  if (this->Name != 0)
  {
    if (!LostContext::Is())
    {
      glDeleteBuffers(1, &this->Name);
    }
    this->Memory->Remove(this->Bytes);
    this->Name = 0;
    this->Bytes = 0;
  }
}

void GLBuffer::Swap(GLBuffer& o)
{
  std::swap(this->Memory, o.Memory);
  std::swap(this->Target, o.Target);
  std::swap(this->Name, o.Name);
  std::swap(this->Bytes, o.Bytes);
}

GLTexture::GLTexture(GPUMemory& memory, GLenum target, GLenum internalFormat, int width, int height,
  int depth, std::size_t bytesPerTexel, GLenum filter)
  : Memory(&memory)
  , Target(target)
  , Bytes(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) *
      static_cast<std::size_t>(depth) * bytesPerTexel)
{
  glGenTextures(1, &this->Name);
  glBindTexture(target, this->Name);
  if (target == GL_TEXTURE_3D)
  {
    glTexStorage3D(target, 1, internalFormat, width, height, depth);
    glTexParameteri(target, GL_TEXTURE_WRAP_R, GL_CLAMP_TO_EDGE);
  }
  else
  {
    glTexStorage2D(target, 1, internalFormat, width, height);
  }
  glTexParameteri(target, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  glTexParameteri(target, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  glTexParameteri(target, GL_TEXTURE_MIN_FILTER, static_cast<GLint>(filter));
  glTexParameteri(target, GL_TEXTURE_MAG_FILTER, static_cast<GLint>(filter));
  glBindTexture(target, 0);
  memory.Add(this->Bytes);
}

GLTexture::GLTexture(GPUMemory& memory, GLenum internalFormat, const GLBuffer& buffer)
  : Memory(&memory)
  , Target(GL_TEXTURE_BUFFER)
{
  glGenTextures(1, &this->Name);
  glBindTexture(GL_TEXTURE_BUFFER, this->Name);
  glTexBuffer(GL_TEXTURE_BUFFER, internalFormat, buffer.Id());
  glBindTexture(GL_TEXTURE_BUFFER, 0);
}

void GLTexture::Bind(GLuint unit) const
{
  glActiveTexture(GL_TEXTURE0 + unit);
  glBindTexture(this->Target, this->Name);
}

void GLTexture::Release()
{
  if (this->Name != 0)
  {
    if (!LostContext::Is())
    {
      glDeleteTextures(1, &this->Name);
    }
    this->Memory->Remove(this->Bytes);
    this->Name = 0;
    this->Bytes = 0;
  }
}

void GLTexture::Swap(GLTexture& o)
{
  std::swap(this->Memory, o.Memory);
  std::swap(this->Target, o.Target);
  std::swap(this->Name, o.Name);
  std::swap(this->Bytes, o.Bytes);
}

GLFramebuffer GLFramebuffer::Make()
{
  GLFramebuffer made;
  glGenFramebuffers(1, &made.Name);
  return made;
}

void GLFramebuffer::Release()
{
  if (this->Name != 0)
  {
    if (!LostContext::Is())
    {
      glDeleteFramebuffers(1, &this->Name);
    }
    this->Name = 0;
  }
}

GLVertexArray GLVertexArray::Make()
{
  GLVertexArray made;
  glGenVertexArrays(1, &made.Name);
  return made;
}

void GLVertexArray::Release()
{
  if (this->Name != 0)
  {
    if (!LostContext::Is())
    {
      glDeleteVertexArrays(1, &this->Name);
    }
    this->Name = 0;
  }
}

namespace
{
GLuint Compile(GLenum stage, const std::string& source, std::string& error)
{
  const GLuint shader = glCreateShader(stage);
  const char* text = source.c_str();
  glShaderSource(shader, 1, &text, nullptr);
  glCompileShader(shader);
  GLint done = 0;
  glGetShaderiv(shader, GL_COMPILE_STATUS, &done);
  if (done == 0)
  {
    GLint length = 0;
    glGetShaderiv(shader, GL_INFO_LOG_LENGTH, &length);
    std::vector<char> log(static_cast<std::size_t>(length) + 1, '\0');
    glGetShaderInfoLog(shader, length, nullptr, log.data());
    error = log.data();
    glDeleteShader(shader);
    return 0;
  }
  return shader;
}
} // namespace

GLProgram::GLProgram(const std::string& vertex, const std::string& fragment, std::string& error)
{
  const GLuint vs = Compile(GL_VERTEX_SHADER, vertex, error);
  const GLuint fs = vs != 0 ? Compile(GL_FRAGMENT_SHADER, fragment, error) : 0;
  if (fs != 0)
  {
    this->Name = glCreateProgram();
    glAttachShader(this->Name, vs);
    glAttachShader(this->Name, fs);
    glLinkProgram(this->Name);
    GLint done = 0;
    glGetProgramiv(this->Name, GL_LINK_STATUS, &done);
    if (done == 0)
    {
      std::vector<char> log(4096, '\0');
      glGetProgramInfoLog(this->Name, 4095, nullptr, log.data());
      error = log.data();
      this->Release();
    }
    glDeleteShader(fs);
  }
  if (vs != 0)
  {
    glDeleteShader(vs);
  }
}

void GLProgram::Release()
{
  if (this->Name != 0)
  {
    if (!LostContext::Is())
    {
      glDeleteProgram(this->Name);
    }
    this->Name = 0;
  }
}

} // namespace teravox
