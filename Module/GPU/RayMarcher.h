// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "BrickAtlas.h"
#include "BrickFrames.h"
#include "GLObjects.h"
#include "GradientTable.h"
#include "MarchParameters.h"
#include "NativeMarcher.h"
#include "PassResult.h"
#include "ShaderLibrary.h"
#include "TransferPlane.h"
#include "TransferTable.h"
#include "ViewState.h"

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace teravox
{

/// What is made of a picture as it is put into the frame buffer.
struct Composition
{
  /// Premultiplied colours become Scale * colour + Bias * opacity.
  float Scale = 1;
  float Bias = 0;
  /// This instead of colours, where the opacity is large enough: which prop a pixel belongs to.
  std::optional<std::array<float, 3>> PropColor;
  float PropOpacity = 3.0f / 255; ///< as VTK's mapper has it
};

/// The gray of a number of samples: log2(1 + samples) / 16, linear between powers of two, at most
/// 1. So 0, 1, 3, 7, 15 ... samples are 0, 1/16, 2/16, 3/16, 4/16 ..., and no two numbers below
/// 2^16 have the same.
float SampleShade(float samples);

/// Draws passes of one variant with given atlas, transfer table, view and parameters. State of one
/// context. Thread: used by the render thread only, with the context current and saved by a
/// GLStateGuard.
class RayMarcher
{
public:
  /// Errors: Unsupported (the context lacks OpenGL 4.3; what is missing), a shader that doesn't
  /// compile.
  static Result<std::unique_ptr<RayMarcher>> Make(GPUMemory& memory);

  /// The table must stay where it is.
  void SetTransferTable(const TransferTable& table);
  /// The same for voxels with several components: one table each, those without a function empty.
  void SetTransferTables(const std::vector<TransferTable>& tables);
  /// The same for a label mask, by its values: see BuildLabelTables().
  void SetLabelTables(const std::vector<TransferTable>& tables);
  /// Read by variants with GradientOpacity; must stay where it is.
  void SetGradientTable(const GradientTable& table);
  /// Likewise, with Plane.
  void SetPlane(const TransferPlane& plane);

  /// Copies the depth of the frame buffer that is bound for drawing, resolving samples.
  void CopyDepth(ViewState& view, GLuint framebuffer, int x, int y);
  /// Depths in 0..1 instead of those of a frame buffer, rows from the bottom.
  static void SetDepth(ViewState& view, const std::vector<float>& depths);
  /// No rays at these pixels (not 0): their depth becomes less than any. `hasDepth`: the view has
  /// the depth of the others, else nothing ends those.
  static void HidePixels(ViewState& view, const std::vector<std::uint8_t>& hidden, bool hasDepth);
  /// What CopyDepth() has copied, in 0..1, rows from the bottom. Waits for the GPU.
  static std::vector<float> ReadDepth(const ViewState& view);
  /// Begins a picture: intervals, cleared accumulators, all tiles active. `slice`: per pixel the
  /// depth along its ray at which it meets the slice to be drawn, NaN if it doesn't; empty for
  /// blend modes without one. `begins`: per pixel the depth (as the depth buffer counts it) where
  /// its ray begins; empty: at the near plane. `lattice`: see NativeView::Clear(); of the native
  /// marcher only. `ray`: see NewRay().
  struct LatticeOptions
  {
    int Stage = 0;
    LatticeLimits Limits;
  };
  Status Begin(ViewState& view, MarchParameters& parameters, const IntervalParameters& intervals,
    const std::vector<PlaneAlongRays>& planes, const std::vector<float>& slice,
    const std::vector<float>& begins, const LatticeOptions& lattice,
    const std::array<float, 4>& ray);
  /// Color has the colours, from whichever marcher.
  static void UpdateColor(ViewState& view);
  /// LightTable of the picture under way (see LightSetup.h); empty: one headlight.
  void SetLights(std::vector<MarchParameters::Vec> table);
  /// Casts what a lattice has left out: see NativeView::CastAll(). Nothing if all rays are.
  void CastAll(ViewState& view) const;
  /// One pass over the active tiles.
  Result<PassResult> DrawPass(ViewState& view, const BrickAtlas& atlas, const PageTable& table,
    MarchParameters& parameters, const ShaderVariant& variant);
  /// Turns what rays gathered in a blend mode other than composite into colours.
  Status Resolve(ViewState& view, const MarchParameters& parameters, const ShaderVariant& variant);
  /// What Resolve() finds, GatheredChannels() floats per pixel. Waits for the GPU.
  static std::vector<float> ReadGathered(const ViewState& view, int channels);
  static void SetGathered(ViewState& view, const std::vector<float>& pixels, int channels);
  /// Makes colours of how many samples each ray took, which are in the place of errors: see
  /// SampleShade(). Rays without one leave nothing.
  static void ShowSamples(ViewState& view);
  /// Blends the accumulators into a frame buffer at a place in pixels.
  Status Compose(ViewState& view, GLuint framebuffer, int x, int y, const Composition& how);
  /// Draws lines over a viewport of a frame buffer, where its depth doesn't hide them.
  Status DrawFrames(
    const std::vector<FrameVertex>& lines, GLuint framebuffer, const std::array<int, 4>& viewport);
  /// What DrawFrames() takes of the GPU's budget while it draws.
  static constexpr std::size_t FrameBytes = sizeof(FrameVertex) * FrameVerticesPerBrick * 128;

private:
  RayMarcher(GPUMemory& memory)
    : Memory(memory)
  {
  }
  Result<const GLProgram*> Program(
    const std::string& vertex, const std::string& fragment, const ShaderVariant& variant);
  PassResult DrawNativePass(ViewState& view, const BrickAtlas& atlas, const PageTable& table,
    const MarchParameters& parameters, const ShaderVariant& variant);
  void ReadFeedback(ViewState& view, const AtlasPlan& plan, PassResult& result);
  void UploadTables(const TransferTable* tables, std::size_t count);

  GPUMemory& Memory;
  const TransferTable* Table = nullptr;
  const std::vector<TransferTable>* ComponentTables = nullptr; ///< instead of Table, or null
  const std::vector<TransferTable>* LabelTables = nullptr; ///< Table is the first of them; or null
  const GradientTable* Gradient = nullptr;
  const TransferPlane* Plane = nullptr;
  std::uint32_t TableVersion = 0; ///< counts the tables; never 0 once there is one
  NativeMarcher Native;
  IntervalParameters Intervals;       ///< of the picture under way, for the native marcher
  std::vector<PlaneAlongRays> Planes; ///< likewise
  std::vector<MarchParameters::Vec> Lights;
  GLBuffer Uniforms;
  GLBuffer LightBuffer;
  GLBuffer TransferBuffer;
  GLTexture TransferTexture;
  GLBuffer ColorBuffer;
  GLTexture ColorTexture;
  GLBuffer OccupiedBuffer;
  GLTexture OccupiedTexture;
  GLBuffer GradientBuffer;
  GLTexture GradientTexture;
  GLBuffer PlaneBuffer;
  GLTexture PlaneTexture;
  GLVertexArray Vertices;
  GLVertexArray TileVertices;
  std::map<std::string, GLProgram> Programs;
  std::uint32_t Stamp = 0;
};

} // namespace teravox
