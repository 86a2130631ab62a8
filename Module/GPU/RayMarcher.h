// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "BrickAtlas.h"
#include "GLObjects.h"
#include "Residency.h"
#include "ShaderLibrary.h"
#include "TransferTable.h"
#include "ViewState.h"

#include <array>
#include <cstdint>
#include <map>
#include <string>

namespace teravox
{

/// The uniform block of Shaders/Library/Bindings.glsl, std140: vectors of four only.
struct MarchParameters
{
  using Vec = std::array<float, 4>;
  using UVec = std::array<std::uint32_t, 4>;
  std::array<Vec, 3> RayOrigin{};
  std::array<Vec, 3> RayDirection{};
  std::array<Vec, 3> RayWorld{};
  UVec Anchor{};
  UVec Dimensions{};
  UVec Levels{};
  std::array<UVec, 32> LevelFactor{};
  std::array<UVec, 32> LevelBricks{};
  std::array<Vec, 32> LevelStart{};
  UVec Atlas{};
  Vec Value{};
  Vec Transfer{};
  Vec Step{};
  UVec Limits{};
  UVec Switches{};
  Vec Material{};
  Vec LightDiffuse{};
  Vec LightSpecular{};
  std::array<Vec, 3> Normal{};
  std::array<Vec, 3> Dataset{};
  Vec Eye{};
};

/// Where the rays of a picture may run.
struct IntervalParameters
{
  std::array<float, 3> BoxLow{};
  std::array<float, 3> BoxHigh{};
  float Near = 0; ///< view depths
  float Far = 0;
  bool HasDepth = false;              ///< ViewState::Depth holds the opaque depth
  std::array<float, 4> DepthToView{}; ///< view depth = (x + y d) / (z + w d)
  /// Pixels outside see nothing of the box: left, bottom, right, top, the last two exclusive.
  std::array<int, 4> Rectangle{};
};

struct PassResult
{
  Feedback Report;
  bool Waiting = false;
  bool Unfinished = false;
  bool Overflow = false;
  bool Fallback = false;
  std::uint64_t Samples = 0;
  std::uint64_t Contributing = 0;
};

/// Draws passes of one variant with given atlas, transfer table, view and parameters. State of one
/// context. Thread: used by the render thread only, with the context current and saved by a
/// GLStateGuard.
class RayMarcher
{
public:
  /// Errors: Unsupported (the context lacks OpenGL 4.3; what is missing), a shader that doesn't
  /// compile.
  static Result<std::unique_ptr<RayMarcher>> Make(GPUMemory& memory);

  void SetTransferTable(const TransferTable& table);

  /// Copies the depth of the frame buffer that is bound for drawing, resolving samples.
  void CopyDepth(ViewState& view, GLuint framebuffer, int x, int y);
  /// Begins a picture: intervals, cleared accumulators, all tiles active.
  Status Begin(ViewState& view, MarchParameters& parameters, const IntervalParameters& intervals);
  /// One pass over the active tiles.
  Result<PassResult> DrawPass(ViewState& view, const BrickAtlas& atlas, MarchParameters& parameters,
    const ShaderVariant& variant);
  /// Blends the accumulators into a frame buffer at a place in pixels.
  Status Compose(ViewState& view, GLuint framebuffer, int x, int y);

private:
  RayMarcher(GPUMemory& memory)
    : Memory(memory)
  {
  }
  Result<const GLProgram*> Program(
    const std::string& vertex, const std::string& fragment, const ShaderVariant& variant);
  void ReadFeedback(ViewState& view, const AtlasPlan& plan, PassResult& result);

  GPUMemory& Memory;
  GLBuffer Uniforms;
  GLBuffer TransferBuffer;
  GLTexture TransferTexture;
  GLBuffer ColorBuffer;
  GLTexture ColorTexture;
  GLBuffer OccupiedBuffer;
  GLTexture OccupiedTexture;
  GLVertexArray Vertices;
  GLVertexArray TileVertices;
  std::map<std::string, GLProgram> Programs;
  std::uint32_t Stamp = 0;
};

} // namespace teravox
