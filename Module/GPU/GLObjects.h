// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "GLApi.h"

#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>

namespace teravox
{

/// Bytes of GL storage that Teravox holds in one context: what budgets are compared with.
struct GPUMemory
{
  std::uint64_t Used = 0;
  std::uint64_t Peak = 0;

  void Add(std::uint64_t bytes)
  {
    this->Used += bytes;
    this->Peak = this->Used > this->Peak ? this->Used : this->Peak;
  }
  void Remove(std::uint64_t bytes) { this->Used -= bytes; }
};

/// While there is one, what is released belonged to a context that is gone: its names mean nothing,
/// or other objects, and are only forgotten. Thread: the render thread, for which it holds.
class LostContext
{
public:
  LostContext() { ++Depth(); }
  ~LostContext() { --Depth(); }
  LostContext(const LostContext&) = delete;
  LostContext& operator=(const LostContext&) = delete;
  LostContext(LostContext&&) = delete;
  LostContext& operator=(LostContext&&) = delete;
  static bool Is() { return Depth() > 0; }

private:
  static int& Depth();
};

/// Memory of the host that counts against the GPU's budget, because it is there in its stead.
/// Move-only value.
class MemoryShare
{
public:
  MemoryShare() = default;
  MemoryShare(GPUMemory& memory, std::uint64_t bytes)
    : Memory(&memory)
    , Bytes(bytes)
  {
    memory.Add(bytes);
  }
  ~MemoryShare() { this->Release(); }
  MemoryShare(const MemoryShare&) = delete;
  MemoryShare& operator=(const MemoryShare&) = delete;
  MemoryShare(MemoryShare&& o) noexcept
    : Memory(std::exchange(o.Memory, nullptr))
    , Bytes(o.Bytes)
  {
  }
  MemoryShare& operator=(MemoryShare&& o) noexcept
  {
    std::swap(this->Memory, o.Memory);
    std::swap(this->Bytes, o.Bytes);
    return *this;
  }
  void Release()
  {
    if (this->Memory != nullptr)
    {
      this->Memory->Remove(this->Bytes);
    }
    this->Memory = nullptr;
  }

private:
  GPUMemory* Memory = nullptr;
  std::uint64_t Bytes = 0;
};

/// Whether the current context draws on the CPU.
bool IsSoftwareRenderer();

/// A buffer object with its storage. Move-only; created and destroyed with the context current.
class GLBuffer
{
public:
  GLBuffer() = default;
  GLBuffer(GPUMemory& memory, GLenum target, std::size_t bytes, const void* data, GLenum usage);
  ~GLBuffer() { this->Release(); }
  GLBuffer(const GLBuffer&) = delete;
  GLBuffer& operator=(const GLBuffer&) = delete;
  GLBuffer(GLBuffer&& o) noexcept { this->Swap(o); }
  GLBuffer& operator=(GLBuffer&& o) noexcept
  {
    this->Swap(o);
    return *this;
  }

  GLuint Id() const { return this->Name; }
  std::size_t Size() const { return this->Bytes; }
  void Write(std::size_t offset, std::size_t bytes, const void* data);
  void Read(std::size_t offset, std::size_t bytes, void* data) const;
  void Release();

private:
  void Swap(GLBuffer& o);
  GPUMemory* Memory = nullptr;
  GLenum Target = 0;
  GLuint Name = 0;
  std::size_t Bytes = 0;
};

/// A texture with immutable storage of one mip level. Move-only.
class GLTexture
{
public:
  GLTexture() = default;
  GLTexture(GPUMemory& memory, GLenum target, GLenum internalFormat, int width, int height,
    int depth, std::size_t bytesPerTexel, GLenum filter);
  /// A buffer texture over a buffer that outlives it.
  GLTexture(GPUMemory& memory, GLenum internalFormat, const GLBuffer& buffer);
  ~GLTexture() { this->Release(); }
  GLTexture(const GLTexture&) = delete;
  GLTexture& operator=(const GLTexture&) = delete;
  GLTexture(GLTexture&& o) noexcept { this->Swap(o); }
  GLTexture& operator=(GLTexture&& o) noexcept
  {
    this->Swap(o);
    return *this;
  }

  GLuint Id() const { return this->Name; }
  std::size_t Size() const { return this->Bytes; }
  void Bind(GLuint unit) const;
  void Release();

private:
  void Swap(GLTexture& o);
  GPUMemory* Memory = nullptr;
  GLenum Target = 0;
  GLuint Name = 0;
  std::size_t Bytes = 0;
};

/// A frame buffer or vertex array: a name without storage. Move-only.
class GLFramebuffer
{
public:
  GLFramebuffer() = default;
  static GLFramebuffer Make();
  ~GLFramebuffer() { this->Release(); }
  GLFramebuffer(const GLFramebuffer&) = delete;
  GLFramebuffer& operator=(const GLFramebuffer&) = delete;
  GLFramebuffer(GLFramebuffer&& o) noexcept { std::swap(this->Name, o.Name); }
  GLFramebuffer& operator=(GLFramebuffer&& o) noexcept
  {
    std::swap(this->Name, o.Name);
    return *this;
  }
  GLuint Id() const { return this->Name; }
  void Release();

private:
  GLuint Name = 0;
};

class GLVertexArray
{
public:
  GLVertexArray() = default;
  static GLVertexArray Make();
  ~GLVertexArray() { this->Release(); }
  GLVertexArray(const GLVertexArray&) = delete;
  GLVertexArray& operator=(const GLVertexArray&) = delete;
  GLVertexArray(GLVertexArray&& o) noexcept { std::swap(this->Name, o.Name); }
  GLVertexArray& operator=(GLVertexArray&& o) noexcept
  {
    std::swap(this->Name, o.Name);
    return *this;
  }
  GLuint Id() const { return this->Name; }
  void Release();

private:
  GLuint Name = 0;
};

/// A linked program. Move-only.
class GLProgram
{
public:
  GLProgram() = default;
  /// Compiles and links. On failure Id() is 0 and `error` holds the driver's log.
  GLProgram(const std::string& vertex, const std::string& fragment, std::string& error);
  ~GLProgram() { this->Release(); }
  GLProgram(const GLProgram&) = delete;
  GLProgram& operator=(const GLProgram&) = delete;
  GLProgram(GLProgram&& o) noexcept { std::swap(this->Name, o.Name); }
  GLProgram& operator=(GLProgram&& o) noexcept
  {
    std::swap(this->Name, o.Name);
    return *this;
  }
  GLuint Id() const { return this->Name; }
  GLint Uniform(const char* name) const { return glGetUniformLocation(this->Name, name); }
  void Release();

private:
  GLuint Name = 0;
};

} // namespace teravox
