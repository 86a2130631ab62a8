// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "RayMarcher.h"

#include "MarchSetup.h"
#include "SharedLayout.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <type_traits>
#include <utility>

namespace teravox
{

static_assert(sizeof(MarchParameters) ==
    16 * (9 + 3 + 96 + 7 + 2 + 3 + 3 + 1 + 1 + 64 + 256 + 5 + 1 + 12 + 1 + 4 + 2 + 4 + 1 + 16),
  "the uniform block of Shaders/Library/Bindings.glsl has no padding");

static_assert(shared::MAXIMUM_ISO_VALUES == MarchParameters::MaximumIsoValues);
static_assert(shared::MAXIMUM_CLIPPED_PLANES == MarchParameters::MaximumClippedPlanes);

Result<std::unique_ptr<RayMarcher>> RayMarcher::Make(GPUMemory& memory)
{
  GLint major = 0;
  GLint minor = 0;
  glGetIntegerv(GL_MAJOR_VERSION, &major);
  glGetIntegerv(GL_MINOR_VERSION, &minor);
  if (major < MinimumGLMajor || (major == MinimumGLMajor && minor < MinimumGLMinor))
  {
    const auto* renderer = reinterpret_cast<const char*>(glGetString(GL_RENDERER));
    return Status(StatusCode::Unsupported,
      "Out-of-core volume rendering needs OpenGL " + std::to_string(MinimumGLMajor) + "." +
        std::to_string(MinimumGLMinor) +
        " (shader storage buffers, image load/store); this context has " + std::to_string(major) +
        "." + std::to_string(minor) + " (" + (renderer != nullptr ? renderer : "unknown renderer") +
        ").");
  }
  std::unique_ptr<RayMarcher> marcher(new RayMarcher(memory));
  marcher->Uniforms =
    GLBuffer(memory, GL_UNIFORM_BUFFER, sizeof(MarchParameters), nullptr, GL_DYNAMIC_DRAW);
  marcher->Vertices = GLVertexArray::Make();
  marcher->TileVertices = GLVertexArray::Make();
  return marcher;
}

Result<const GLProgram*> RayMarcher::Program(
  const std::string& vertex, const std::string& fragment, const ShaderVariant& variant)
{
  const std::string key = vertex + "+" + fragment + "+" + std::to_string(variant.Key());
  const auto found = this->Programs.find(key);
  if (found != this->Programs.end())
  {
    return &found->second;
  }
  Result<std::string> vertexText = AssembleShader(vertex, variant);
  if (!vertexText)
  {
    return vertexText.GetStatus();
  }
  Result<std::string> fragmentText = AssembleShader(fragment, variant);
  if (!fragmentText)
  {
    return fragmentText.GetStatus();
  }
  std::string error;
  GLProgram program(vertexText.Value(), fragmentText.Value(), error);
  if (program.Id() == 0)
  {
    std::string files;
    for (int i = 0; ShaderFileName(i) != "?"; ++i)
    {
      files += (i == 0 ? "" : ", ") + std::to_string(i) + " = " + ShaderFileName(i);
    }
    return Status(StatusCode::Unsupported,
      "The shader " + fragment + " doesn't compile with this driver (files: " + files + "):\n" +
        error);
  }
  return &this->Programs.emplace(key, std::move(program)).first->second;
}

void RayMarcher::SetTransferTable(const TransferTable& table)
{
  this->Table = &table;
  this->ComponentTables = nullptr;
  this->LabelTables = nullptr;
  this->UploadTables(&table, 1);
}

void RayMarcher::SetTransferTables(const std::vector<TransferTable>& tables)
{
  this->Table = &tables.back();
  this->ComponentTables = &tables;
  this->LabelTables = nullptr;
  this->UploadTables(tables.data(), tables.size());
}

void RayMarcher::SetLabelTables(const std::vector<TransferTable>& tables)
{
  this->Table = tables.data();
  this->ComponentTables = nullptr;
  this->LabelTables = &tables;
  this->UploadTables(tables.data(), tables.size());
}

void RayMarcher::UploadTables(const TransferTable* tables, std::size_t count)
{
  this->TableVersion = this->TableVersion == ~0u ? 1 : this->TableVersion + 1;
  const auto put = [&](auto member, GLenum format, GLBuffer& buffer, GLTexture& texture)
  {
    std::decay_t<decltype(tables[0].*member)> joined;
    for (std::size_t t = 0; count > 1 && t < count; ++t)
    {
      const auto& more = tables[t].*member;
      joined.insert(joined.end(), more.begin(), more.end());
    }
    const auto& words = count > 1 ? joined : tables[0].*member;
    const std::size_t bytes = words.size() * sizeof(words[0]);
    if (buffer.Size() == bytes)
    {
      buffer.Write(0, bytes, words.data());
      return;
    }
    texture.Release();
    buffer.Release();
    buffer = GLBuffer(this->Memory, GL_TEXTURE_BUFFER, bytes, words.data(), GL_STATIC_DRAW);
    texture = GLTexture(this->Memory, format, buffer);
  };
  put(&TransferTable::Integrals, GL_RGBA32F, this->TransferBuffer, this->TransferTexture);
  put(&TransferTable::Colors, GL_RGBA32UI, this->ColorBuffer, this->ColorTexture);
  put(&TransferTable::Occupied, GL_R16UI, this->OccupiedBuffer, this->OccupiedTexture);
}

namespace
{
// Four floats per node for the shaders; what has the same size is written anew in place.
void UploadNodes(GPUMemory& memory, const std::vector<std::array<float, 4>>& nodes,
  GLBuffer& buffer, GLTexture& texture)
{
  const std::size_t bytes = nodes.size() * sizeof(nodes[0]);
  if (bytes != 0 && buffer.Size() == bytes)
  {
    buffer.Write(0, bytes, nodes.data());
    return;
  }
  texture.Release();
  buffer.Release();
  if (bytes != 0)
  {
    buffer = GLBuffer(memory, GL_TEXTURE_BUFFER, bytes, nodes.data(), GL_STATIC_DRAW);
    texture = GLTexture(memory, GL_RGBA32F, buffer);
  }
}
} // namespace

void RayMarcher::SetGradientTable(const GradientTable& table)
{
  this->Gradient = &table;
  UploadNodes(this->Memory, table.Values, this->GradientBuffer, this->GradientTexture);
}

void RayMarcher::SetPlane(const TransferPlane& plane)
{
  this->Plane = &plane;
  std::vector<std::array<float, 4>> nodes = plane.Nodes;
  nodes.insert(nodes.end(), plane.Bounds.begin(), plane.Bounds.end());
  UploadNodes(this->Memory, nodes, this->PlaneBuffer, this->PlaneTexture);
}

void RayMarcher::CopyDepth(ViewState& view, GLuint framebuffer, int x, int y)
{
  glBindFramebuffer(GL_READ_FRAMEBUFFER, framebuffer);
  GLint samples = 0;
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, framebuffer);
  glGetIntegerv(GL_SAMPLES, &samples);
  GLFramebuffer resolved;
  GLTexture depth;
  if (samples > 0)
  {
    // A blit between sample counts needs one format on both sides.
    const GLenum attachment = framebuffer == 0 ? GL_DEPTH : GL_DEPTH_ATTACHMENT;
    GLint bits = 0;
    GLint type = 0;
    GLint stencil = 0;
    glGetFramebufferAttachmentParameteriv(
      GL_READ_FRAMEBUFFER, attachment, GL_FRAMEBUFFER_ATTACHMENT_DEPTH_SIZE, &bits);
    glGetFramebufferAttachmentParameteriv(
      GL_READ_FRAMEBUFFER, attachment, GL_FRAMEBUFFER_ATTACHMENT_COMPONENT_TYPE, &type);
    glGetFramebufferAttachmentParameteriv(
      GL_READ_FRAMEBUFFER, attachment, GL_FRAMEBUFFER_ATTACHMENT_STENCIL_SIZE, &stencil);
    GLenum format = GL_DEPTH_COMPONENT24;
    if (type == GL_FLOAT)
    {
      format = stencil > 0 ? GL_DEPTH32F_STENCIL8 : GL_DEPTH_COMPONENT32F;
    }
    else if (bits == 16)
    {
      format = GL_DEPTH_COMPONENT16;
    }
    else if (bits == 32)
    {
      format = GL_DEPTH_COMPONENT32;
    }
    else if (stencil > 0)
    {
      format = GL_DEPTH24_STENCIL8;
    }
    depth = GLTexture(
      this->Memory, GL_TEXTURE_2D, format, x + view.Width(), y + view.Height(), 1, 8, GL_NEAREST);
    resolved = GLFramebuffer::Make();
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, resolved.Id());
    glFramebufferTexture2D(GL_DRAW_FRAMEBUFFER,
      stencil > 0 ? GL_DEPTH_STENCIL_ATTACHMENT : GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D, depth.Id(),
      0);
    glBlitFramebuffer(x, y, x + view.Width(), y + view.Height(), x, y, x + view.Width(),
      y + view.Height(), GL_DEPTH_BUFFER_BIT, GL_NEAREST);
    glBindFramebuffer(GL_READ_FRAMEBUFFER, resolved.Id());
  }
  view.Depth.Bind(0);
  glCopyTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, x, y, view.Width(), view.Height());
  if (view.IsNative())
  {
    glGetTexImage(GL_TEXTURE_2D, 0, GL_DEPTH_COMPONENT, GL_FLOAT, view.Native.Depth.data());
  }
}

void RayMarcher::SetDepth(ViewState& view, const std::vector<float>& depths)
{
  view.Depth.Bind(0);
  glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, view.Width(), view.Height(), GL_DEPTH_COMPONENT, GL_FLOAT,
    depths.data());
  if (view.IsNative())
  {
    view.Native.Depth = depths;
  }
}

void RayMarcher::HidePixels(ViewState& view, const std::vector<std::uint8_t>& hidden, bool hasDepth)
{
  constexpr float beforeAll = -1; // nearer than the near plane
  std::vector<float> depths = hasDepth ? ReadDepth(view) : std::vector<float>(hidden.size(), 1.0f);
  for (std::size_t i = 0; i < hidden.size(); ++i)
  {
    depths[i] = hidden[i] != 0 ? beforeAll : depths[i];
  }
  SetDepth(view, depths);
}

std::vector<float> RayMarcher::ReadDepth(const ViewState& view)
{
  if (view.IsNative())
  {
    return view.Native.Depth;
  }
  std::vector<float> depth(
    static_cast<std::size_t>(view.Width()) * static_cast<std::size_t>(view.Height()));
  view.Depth.Bind(0);
  glGetTexImage(GL_TEXTURE_2D, 0, GL_DEPTH_COMPONENT, GL_FLOAT, depth.data());
  return depth;
}

Status RayMarcher::Begin(ViewState& view, MarchParameters& parameters,
  const IntervalParameters& intervals, const std::vector<PlaneAlongRays>& planes,
  const std::vector<float>& slice, const std::vector<float>& begins, const LatticeOptions& lattice,
  const std::array<float, 4>& ray)
{
  view.ActiveTiles = TilesOf(intervals.Rectangle);
  if (view.IsNative())
  {
    view.Native.Clear(lattice.Stage, lattice.Limits, ray);
    view.NativeChanged = true;
    this->Intervals = intervals;
    this->Planes = planes;
    view.Native.Begin = begins;
    if (!slice.empty())
    {
      view.Native.SetSlice(slice, intervals);
    }
    return {};
  }
  ShaderVariant variant;
  variant.OpaqueDepth = intervals.HasDepth;
  Result<const GLProgram*> program = this->Program("FullScreen.vert", "Intervals.frag", variant);
  if (!program)
  {
    return program.GetStatus();
  }
  this->Uniforms.Write(0, sizeof(parameters), &parameters);
  glBindBufferBase(GL_UNIFORM_BUFFER, 0, this->Uniforms.Id());
  glViewport(0, 0, view.Width(), view.Height());
  const GLProgram& p = *program.Value();
  glUseProgram(p.Id());
  glUniform3fv(p.Uniform("u_boxLow"), 1, intervals.BoxLow.data());
  glUniform3fv(p.Uniform("u_boxHigh"), 1, intervals.BoxHigh.data());
  glUniform3fv(p.Uniform("u_blockLow"), 1, intervals.BlockLow.data());
  glUniform3fv(p.Uniform("u_blockHigh"), 1, intervals.BlockHigh.data());
  glUniform2f(p.Uniform("u_nearFar"), intervals.Near, intervals.Far);
  glUniform1i(p.Uniform("u_hasSlice"), slice.empty() ? 0 : 1);
  glUniform1i(p.Uniform("u_hasBegin"), begins.empty() ? 0 : 1);
  view.Position.Bind(8);
  if (!slice.empty() || !begins.empty())
  {
    // Until positions are cleared, their place holds the slice and where rays begin.
    std::vector<std::array<float, 2>> places(std::max(slice.size(), begins.size()));
    for (std::size_t i = 0; i < places.size(); ++i)
    {
      places[i] = { slice.empty() ? 0.0f : slice[i], begins.empty() ? 0.0f : begins[i] };
    }
    glTexSubImage2D(
      GL_TEXTURE_2D, 0, 0, 0, view.Width(), view.Height(), GL_RG_INTEGER, GL_INT, places.data());
  }
  glUniform1i(p.Uniform("u_planeCount"), static_cast<GLint>(planes.size()));
  GLBuffer planeBuffer;
  if (!planes.empty())
  {
    planeBuffer = GLBuffer(this->Memory, GL_SHADER_STORAGE_BUFFER,
      planes.size() * sizeof(PlaneAlongRays), planes.data(), GL_STREAM_DRAW);
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 3, planeBuffer.Id());
  }
  if (intervals.HasDepth)
  {
    glUniform4fv(p.Uniform("u_depthToView"), 1, intervals.DepthToView.data());
    view.Depth.Bind(0);
  }
  glBindFramebuffer(GL_FRAMEBUFFER, view.IntervalTarget.Id());
  glBindVertexArray(this->Vertices.Id());
  glDrawArrays(GL_TRIANGLES, 0, 3);

  glBindFramebuffer(GL_FRAMEBUFFER, view.StateTarget.Id());
  const std::array<float, 4> clear{ 0, 0, 0, 0 };
  const std::array<GLint, 4> nowhere{ 0, 0, 0, 0 };
  glClearBufferfv(GL_COLOR, 0, ray.data());
  glClearBufferiv(GL_COLOR, 1, nowhere.data());
  if (view.Error.Id() != 0)
  {
    glClearBufferfv(GL_COLOR, 2, clear.data());
  }
  if (view.HasLengths())
  {
    glBindFramebuffer(GL_FRAMEBUFFER, view.LengthsTarget.Id());
    glClearBufferfv(GL_COLOR, 0, clear.data());
  }
  if (view.HasFirstHit())
  {
    glBindFramebuffer(GL_FRAMEBUFFER, view.HitTarget.Id());
    const std::array<float, 4> none{ NativeView::NoHit, NativeView::NoHit, 0, 0 };
    glClearBufferfv(GL_COLOR, 0, none.data());
  }
  return {};
}

namespace
{
void BindLengths(const ViewState& view)
{
  if (view.HasLengths())
  {
    glBindImageTexture(4, view.Lengths.Id(), 0, GL_FALSE, 0, GL_READ_WRITE, GL_RGBA32F);
    view.Lengths.Bind(9);
  }
}
} // namespace

void RayMarcher::SetLights(std::vector<MarchParameters::Vec> table)
{
  this->Lights = std::move(table);
}

PassResult RayMarcher::DrawNativePass(ViewState& view, const BrickAtlas& atlas,
  const PageTable& table, const MarchParameters& parameters, const ShaderVariant& variant)
{
  NativeScene scene;
  scene.Parameters = &parameters;
  scene.Intervals = &this->Intervals;
  scene.Planes = this->Planes.empty() ? nullptr : this->Planes.front().data();
  scene.NumberOfPlanes = static_cast<int>(this->Planes.size());
  if (this->ComponentTables != nullptr)
  {
    SetTables(scene, *this->ComponentTables, this->TableVersion);
  }
  else
  {
    SetTables(scene, *this->Table, this->TableVersion);
  }
  if (variant.GradientOpacity)
  {
    teravox::SetGradientTable(scene, *this->Gradient);
  }
  if (variant.Plane)
  {
    teravox::SetPlane(scene, *this->Plane);
  }
  std::vector<NativeScene::LabelTable> labels;
  if (variant.Labels)
  {
    teravox::SetLabelTables(
      labels, *this->LabelTables, variant.GradientOpacity ? *this->Gradient : GradientTable());
    scene.LabelTables = labels.data();
  }
  SetAtlas(scene, *atlas.Native(), table, atlas.Format());
  SetView(scene, view.Native, view.Width(), view.Height());
  scene.Lights = this->Lights.empty() ? nullptr : this->Lights.data();
  scene.Masked = variant.Masked;
  scene.Nearest = variant.Nearest;
  scene.FixedStep = variant.FixedStep;
  scene.Shade = variant.Shade;
  scene.Interactive = variant.Interactive;
  scene.ShowLevel = variant.ShowLevel;
  scene.FirstHit = variant.FirstHit ? scene.FirstHit : nullptr;
  scene.Blend = variant.Blend;
  // Samples of pixels are in the place of errors.
  float* samples = parameters.Switches[1] != 0 ? std::exchange(scene.Error, nullptr) : nullptr;
  PassResult result = this->Native.DrawPass(scene, atlas.Plan().Slots, atlas.Plan().PageBlocks,
    view.ActiveTiles, samples, view.Native.Begin);
  if (view.ActiveTiles.empty() && view.Native.LatticeStage > 0)
  {
    view.ActiveTiles = this->Native.Refine(scene, view.Native, TilesOf(this->Intervals.Rectangle));
    result.Unfinished = !view.ActiveTiles.empty();
  }
  return result;
}

void RayMarcher::CastAll(ViewState& view) const
{
  if (view.IsNative() && view.Native.LatticeStage > 0)
  {
    view.Native.CastAll();
    view.ActiveTiles = TilesOf(this->Intervals.Rectangle);
  }
}

Result<PassResult> RayMarcher::DrawPass(ViewState& view, const BrickAtlas& atlas,
  const PageTable& table, MarchParameters& parameters, const ShaderVariant& variant)
{
  if (atlas.Native() != nullptr)
  {
    return this->DrawNativePass(view, atlas, table, parameters, variant);
  }
  Result<const GLProgram*> program = this->Program("Tiles.vert", "RayMarch.frag", variant);
  if (!program)
  {
    return program.GetStatus();
  }
  // Stamps are compared for equality only; 0 is what a new buffer holds.
  this->Stamp = this->Stamp == ~0u ? 1 : this->Stamp + 1;
  parameters.Limits[1] = this->Stamp;
  parameters.Limits[2] = view.BlockStampIndex();
  parameters.Limits[3] = view.TileStampIndex();
  parameters.Switches[2] = static_cast<std::uint32_t>(view.TilesX());
  this->Uniforms.Write(0, sizeof(parameters), &parameters);

  const std::vector<std::uint32_t> zeros(shared::FEEDBACK_STAMPS, 0);
  view.Feedback.Write(0, zeros.size() * 4, zeros.data());
  std::vector<std::uint32_t> tiles;
  tiles.reserve(view.ActiveTiles.size() * 2);
  for (const std::uint32_t tile : view.ActiveTiles)
  {
    tiles.push_back(tile & 0xffffu);
    tiles.push_back(tile >> 16);
  }
  view.TileList.Write(0, tiles.size() * 4, tiles.data());

  const GLProgram& p = *program.Value();
  glUseProgram(p.Id());
  glUniform2f(p.Uniform("u_pictureSize"), static_cast<float>(view.Width()),
    static_cast<float>(view.Height()));
  glBindFramebuffer(GL_FRAMEBUFFER, view.EmptyTarget.Id());
  glViewport(0, 0, view.Width(), view.Height());
  glBindBufferBase(GL_UNIFORM_BUFFER, 0, this->Uniforms.Id());
  glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 1, view.Feedback.Id());
  glBindImageTexture(0, view.Color.Id(), 0, GL_FALSE, 0, GL_READ_WRITE, GL_RGBA32F);
  glBindImageTexture(1, view.Position.Id(), 0, GL_FALSE, 0, GL_READ_WRITE, GL_RGBA32I);
  if (variant.Estimate || parameters.Switches[1] != 0)
  {
    glBindImageTexture(2, view.Error.Id(), 0, GL_FALSE, 0, GL_READ_WRITE, GL_R32F);
  }
  if (variant.FirstHit)
  {
    glBindImageTexture(3, view.FirstHit.Id(), 0, GL_FALSE, 0, GL_WRITE_ONLY, GL_RG32F);
  }
  BindLengths(view);
  if (variant.Lights)
  {
    const std::size_t bytes = this->Lights.size() * sizeof(this->Lights[0]);
    if (this->LightBuffer.Size() != bytes)
    {
      this->LightBuffer.Release();
      this->LightBuffer =
        GLBuffer(this->Memory, GL_SHADER_STORAGE_BUFFER, bytes, nullptr, GL_DYNAMIC_DRAW);
    }
    this->LightBuffer.Write(0, bytes, this->Lights.data());
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 4, this->LightBuffer.Id());
  }
  atlas.Bind();
  this->TransferTexture.Bind(1);
  this->ColorTexture.Bind(5);
  this->OccupiedTexture.Bind(3);
  if (variant.GradientOpacity)
  {
    this->GradientTexture.Bind(9);
  }
  if (variant.Plane)
  {
    this->PlaneTexture.Bind(9);
  }
  view.Intervals.Bind(2);
  view.Color.Bind(7);
  view.Position.Bind(8);
  glBindVertexArray(this->TileVertices.Id());
  glBindBuffer(GL_ARRAY_BUFFER, view.TileList.Id());
  glEnableVertexAttribArray(0);
  glVertexAttribIPointer(0, 2, GL_UNSIGNED_INT, 8, nullptr);
  glVertexAttribDivisor(0, 1);
  glMemoryBarrier(GL_ALL_BARRIER_BITS);
  glDrawArraysInstanced(GL_TRIANGLE_STRIP, 0, 4, static_cast<GLsizei>(view.ActiveTiles.size()));
  glMemoryBarrier(GL_ALL_BARRIER_BITS);

  PassResult result;
  this->ReadFeedback(view, atlas.Plan(), result);
  return result;
}

void RayMarcher::ReadFeedback(ViewState& view, const AtlasPlan& plan, PassResult& result)
{
  std::vector<std::uint32_t> words(view.FeedbackWords());
  view.Feedback.Read(0, words.size() * 4, words.data());
  result.Waiting = words[shared::FEEDBACK_WAITING] != 0;
  result.Unfinished = words[shared::FEEDBACK_UNFINISHED] != 0;
  result.Overflow = words[shared::FEEDBACK_OVERFLOW] != 0;
  result.Fallback = words[shared::FEEDBACK_FALLBACK] != 0;
  result.Samples = words[shared::FEEDBACK_SAMPLES];
  result.Evaluated = words[shared::FEEDBACK_EVALUATED];
  result.Contributing = words[shared::FEEDBACK_CONTRIBUTING];
  result.Gradients = words[shared::FEEDBACK_GRADIENTS];
  result.Visits = words[shared::FEEDBACK_VISITS];
  for (std::uint32_t e = 0; e < shared::REQUEST_ENTRIES; ++e)
  {
    const std::uint32_t* entry = &words[shared::FEEDBACK_HEADER_WORDS + e * shared::REQUEST_WORDS];
    if (entry[0] != 0 && entry[4] != 0)
    {
      Feedback::Miss miss;
      miss.Key.X = entry[1];
      miss.Key.Y = entry[2];
      miss.Key.Z = entry[3];
      miss.Key.Level = static_cast<std::uint8_t>(entry[4] - 1);
      miss.Weight = entry[5];
      result.Report.Missed.push_back(miss);
    }
  }
  for (std::uint32_t s = 0; s < plan.Slots; ++s)
  {
    if (words[shared::FEEDBACK_STAMPS + s] == this->Stamp)
    {
      result.Report.UsedSlots.push_back(s);
    }
  }
  for (std::uint32_t s = 0; s < plan.PageBlocks; ++s)
  {
    if (words[view.BlockStampIndex() + s] == this->Stamp)
    {
      result.Report.UsedBlocks.push_back(s);
    }
  }
  view.ActiveTiles.clear();
  const auto columns = static_cast<std::uint32_t>(view.TilesX());
  const std::uint32_t count = columns * static_cast<std::uint32_t>(view.TilesY());
  for (std::uint32_t t = 0; t < count; ++t)
  {
    if (words[view.TileStampIndex() + t] == this->Stamp)
    {
      view.ActiveTiles.push_back((t % columns) | (t / columns) << 16);
    }
  }
}

Status RayMarcher::Resolve(
  ViewState& view, const MarchParameters& parameters, const ShaderVariant& variant)
{
  if (view.IsNative())
  {
    NativeScene scene;
    scene.Parameters = &parameters;
    scene.Blend = variant.Blend;
    SetView(scene, view.Native, view.Width(), view.Height());
    if (this->ComponentTables != nullptr)
    {
      SetTables(scene, *this->ComponentTables, this->TableVersion);
      ChooseComponentResolver()(scene);
      return {};
    }
    SetTables(scene, *this->Table, this->TableVersion);
    ChooseNativeResolver()(scene);
    return {};
  }
  ShaderVariant resolve;
  resolve.Components = variant.Components;
  resolve.Dependent = variant.Dependent;
  Result<const GLProgram*> program = this->Program("FullScreen.vert", "Resolve.frag", resolve);
  if (!program)
  {
    return program.GetStatus();
  }
  this->Uniforms.Write(0, sizeof(parameters), &parameters);
  const GLProgram& p = *program.Value();
  glUseProgram(p.Id());
  glUniform1i(p.Uniform("u_blend"), static_cast<GLint>(variant.Blend));
  glBindFramebuffer(GL_FRAMEBUFFER, view.EmptyTarget.Id());
  glViewport(0, 0, view.Width(), view.Height());
  glBindBufferBase(GL_UNIFORM_BUFFER, 0, this->Uniforms.Id());
  glBindImageTexture(0, view.Color.Id(), 0, GL_FALSE, 0, GL_READ_WRITE, GL_RGBA32F);
  this->TransferTexture.Bind(1);
  this->ColorTexture.Bind(5);
  view.Color.Bind(7);
  BindLengths(view);
  glBindVertexArray(this->Vertices.Id());
  glMemoryBarrier(GL_ALL_BARRIER_BITS);
  glDrawArrays(GL_TRIANGLES, 0, 3);
  glMemoryBarrier(GL_ALL_BARRIER_BITS);
  return {};
}

std::vector<float> RayMarcher::ReadGathered(const ViewState& view, int channels)
{
  const std::size_t pixels =
    static_cast<std::size_t>(view.Width()) * static_cast<std::size_t>(view.Height());
  std::vector<float> state(4 * pixels);
  std::vector<float> lengths(channels > 4 ? 4 * pixels : 0);
  if (view.IsNative())
  {
    state = view.Native.Color;
    if (!lengths.empty())
    {
      lengths = view.Native.Lengths;
    }
  }
  else
  {
    glMemoryBarrier(GL_ALL_BARRIER_BITS);
    view.Color.Bind(0);
    glGetTexImage(GL_TEXTURE_2D, 0, GL_RGBA, GL_FLOAT, state.data());
    if (!lengths.empty())
    {
      view.Lengths.Bind(0);
      glGetTexImage(GL_TEXTURE_2D, 0, GL_RGBA, GL_FLOAT, lengths.data());
    }
  }
  if (lengths.empty())
  {
    return state;
  }
  std::vector<float> both;
  both.reserve(8 * pixels);
  for (std::size_t i = 0; i < 4 * pixels; i += 4)
  {
    const auto at = static_cast<std::ptrdiff_t>(i);
    both.insert(both.end(), state.begin() + at, state.begin() + at + 4);
    both.insert(both.end(), lengths.begin() + at, lengths.begin() + at + 4);
  }
  return both;
}

void RayMarcher::SetGathered(ViewState& view, const std::vector<float>& pixels, int channels)
{
  std::vector<float> state;
  std::vector<float> lengths;
  const std::size_t stride = static_cast<std::size_t>(channels);
  for (std::size_t i = 0; i < pixels.size(); i += stride)
  {
    const float* from = &pixels[i];
    state.insert(state.end(), from, from + 4);
    lengths.insert(lengths.end(), from + 4, from + stride);
  }
  if (view.IsNative())
  {
    view.Native.Color = std::move(state);
    view.NativeChanged = true;
    if (!lengths.empty())
    {
      view.Native.Lengths = std::move(lengths);
    }
    return;
  }
  const auto write = [&](const GLTexture& texture, const std::vector<float>& values)
  {
    texture.Bind(0);
    glTexSubImage2D(
      GL_TEXTURE_2D, 0, 0, 0, view.Width(), view.Height(), GL_RGBA, GL_FLOAT, values.data());
  };
  write(view.Color, state);
  if (!lengths.empty())
  {
    write(view.Lengths, lengths);
  }
}

float SampleShade(float samples)
{
  constexpr std::uint32_t one = 0x3f800000;    // the bits of 1.0f
  constexpr std::uint32_t sixteen = 1u << 27u; // as many octaves: 23 bits of a float each
  std::uint32_t bits = 0;
  const float n = 1 + samples;
  std::memcpy(&bits, &n, sizeof(bits));
  return static_cast<float>(std::min(bits - one, sixteen)) / static_cast<float>(sixteen);
}

void RayMarcher::ShowSamples(ViewState& view)
{
  const std::size_t pixels =
    static_cast<std::size_t>(view.Width()) * static_cast<std::size_t>(view.Height());
  std::vector<float> samples(pixels);
  if (view.IsNative())
  {
    samples = view.Native.Error;
  }
  else
  {
    view.Error.Bind(0);
    glGetTexImage(GL_TEXTURE_2D, 0, GL_RED, GL_FLOAT, samples.data());
  }
  std::vector<float> colors(4 * pixels);
  for (std::size_t i = 0; i < pixels; ++i)
  {
    std::fill_n(&colors[4 * i], 3, SampleShade(samples[i]));
    colors[4 * i + 3] = samples[i] > 0 ? 0.0f : 1.0f; // transmittance
  }
  if (view.IsNative())
  {
    view.Native.Color = std::move(colors);
    view.NativeChanged = true;
    return;
  }
  view.Color.Bind(0);
  glTexSubImage2D(
    GL_TEXTURE_2D, 0, 0, 0, view.Width(), view.Height(), GL_RGBA, GL_FLOAT, colors.data());
}

Status RayMarcher::DrawFrames(
  const std::vector<FrameVertex>& lines, GLuint framebuffer, const std::array<int, 4>& viewport)
{
  Result<const GLProgram*> program = this->Program("Frames.vert", "Frames.frag", {});
  if (!program)
  {
    return program.GetStatus();
  }
  GLBuffer buffer(this->Memory, GL_ARRAY_BUFFER, FrameBytes, nullptr, GL_STREAM_DRAW);
  const GLVertexArray vertices = GLVertexArray::Make();
  GLint depthFunction = GL_LESS;
  glGetIntegerv(GL_DEPTH_FUNC, &depthFunction);
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, framebuffer);
  glViewport(viewport[0], viewport[1], viewport[2], viewport[3]);
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_LEQUAL);
  glDepthMask(GL_FALSE);
  glUseProgram(program.Value()->Id());
  glBindVertexArray(vertices.Id());
  glBindBuffer(GL_ARRAY_BUFFER, buffer.Id());
  constexpr auto stride = static_cast<GLsizei>(sizeof(FrameVertex));
  glEnableVertexAttribArray(0);
  glVertexAttribPointer(0, 4, GL_FLOAT, GL_FALSE, stride, nullptr);
  glEnableVertexAttribArray(1);
  glVertexAttribPointer(1, 3, GL_FLOAT, GL_FALSE, stride,
    reinterpret_cast<const void*>(
      offsetof(FrameVertex, Color))); // NOLINT(performance-no-int-to-ptr)
  constexpr std::size_t lot = FrameBytes / sizeof(FrameVertex);
  for (std::size_t first = 0; first < lines.size(); first += lot)
  {
    const std::size_t count = std::min(lot, lines.size() - first);
    buffer.Write(0, count * sizeof(FrameVertex), &lines[first]);
    glBindBuffer(GL_ARRAY_BUFFER, buffer.Id());
    glDrawArrays(GL_LINES, 0, static_cast<GLsizei>(count));
  }
  glDepthFunc(static_cast<GLenum>(depthFunction));
  glDisable(GL_DEPTH_TEST);
  return {};
}

void RayMarcher::UpdateColor(ViewState& view)
{
  if (view.IsNative() && view.NativeChanged)
  {
    view.Color.Bind(0);
    glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, view.Width(), view.Height(), GL_RGBA, GL_FLOAT,
      view.Native.Color.data());
    view.NativeChanged = false;
  }
}

Status RayMarcher::Compose(
  ViewState& view, GLuint framebuffer, int x, int y, const Composition& how)
{
  Result<const GLProgram*> program = this->Program("FullScreen.vert", "Compose.frag", {});
  if (!program)
  {
    return program.GetStatus();
  }
  UpdateColor(view);
  const GLProgram& p = *program.Value();
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, framebuffer);
  glViewport(x, y, view.Width(), view.Height());
  how.PropColor ? glDisable(GL_BLEND) : glEnable(GL_BLEND);
  glBlendFuncSeparate(GL_ONE, GL_ONE_MINUS_SRC_ALPHA, GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
  glUseProgram(p.Id());
  glUniform2i(p.Uniform("u_offset"), x, y);
  glUniform2f(p.Uniform("u_window"), how.Scale, how.Bias);
  const std::array<float, 3> prop = how.PropColor.value_or(std::array<float, 3>{ 0, 0, 0 });
  glUniform4f(
    p.Uniform("u_prop"), prop[0], prop[1], prop[2], how.PropColor ? how.PropOpacity : 0.0f);
  view.Color.Bind(0);
  glBindVertexArray(this->Vertices.Id());
  glDrawArrays(GL_TRIANGLES, 0, 3);
  glDisable(GL_BLEND);
  return {};
}

} // namespace teravox
