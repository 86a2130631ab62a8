// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "ViewState.h"

#include "SharedLayout.h"

#include <array>
#include <cstring>

namespace teravox
{

static_assert(shared::REQUEST_ENTRIES == RequestTableEntries);
static_assert(shared::REQUEST_WORDS == RequestTableWords);
static_assert(shared::FEEDBACK_HEADER_WORDS == FeedbackHeaderWords);
static_assert(shared::TILE_SIZE == 32);
static_assert(shared::CELL_EDGE == CellEdge);

bool PictureKey::operator==(const PictureKey& o) const
{
  const auto same = [&](auto IntervalParameters::*member)
  { return this->Intervals.*member == o.Intervals.*member; };
  static_assert(sizeof(MarchParameters) % sizeof(MarchParameters::Vec) == 0, "no padding");
  return this->FunctionVersion == o.FunctionVersion && this->Variant == o.Variant &&
    std::memcmp(&this->Parameters, &o.Parameters, sizeof(MarchParameters)) == 0 &&
    same(&IntervalParameters::BoxLow) && same(&IntervalParameters::BoxHigh) &&
    same(&IntervalParameters::BlockLow) && same(&IntervalParameters::BlockHigh) &&
    same(&IntervalParameters::HasBlock) && same(&IntervalParameters::Near) &&
    same(&IntervalParameters::Far) && same(&IntervalParameters::HasDepth) &&
    same(&IntervalParameters::DepthToView) && same(&IntervalParameters::Rectangle) &&
    this->Planes == o.Planes && this->Lights == o.Lights && this->Slice == o.Slice &&
    this->LatticeStage == o.LatticeStage;
}

std::uint32_t ViewState::BlockStampIndex() const
{
  return shared::FEEDBACK_STAMPS + this->Slots;
}

std::uint32_t ViewState::TileStampIndex() const
{
  return this->BlockStampIndex() + this->PageBlocks;
}

std::size_t ViewState::FeedbackWords() const
{
  return this->TileStampIndex() +
    static_cast<std::size_t>(this->TilesX()) * static_cast<std::size_t>(this->TilesY());
}

bool ViewState::Resize(GPUMemory& memory, int width, int height, const AtlasPlan& plan,
  bool estimate, bool firstHit, bool peels, bool lengths)
{
  if (width == this->Width_ && height == this->Height_ && plan.Slots == this->Slots &&
    plan.PageBlocks == this->PageBlocks && plan.Native == this->Native_ &&
    estimate == this->Estimate_ && firstHit == this->FirstHit_ && peels == this->Peels_ &&
    lengths == this->Lengths_ && this->Color.Id() != 0)
  {
    return true;
  }
  this->Release();
  this->Width_ = width;
  this->Height_ = height;
  this->Slots = plan.Slots;
  this->PageBlocks = plan.PageBlocks;
  this->Native_ = plan.Native;
  this->Estimate_ = estimate;
  this->FirstHit_ = firstHit;
  this->Peels_ = peels;
  this->Lengths_ = lengths;
  while (glGetError() != GL_NO_ERROR)
  {
  }
  const auto make = [&](GLenum format, std::size_t bytes)
  { return GLTexture(memory, GL_TEXTURE_2D, format, width, height, 1, bytes, GL_NEAREST); };
  this->Color = make(GL_RGBA32F, 16);
  this->Depth = make(GL_DEPTH_COMPONENT32F, 4);
  if (peels)
  {
    this->Peel = make(GL_RGBA32F, 16);
  }
  if (plan.Native)
  {
    this->Native.Resize(width, height, estimate, firstHit, lengths);
    this->NativeBytes = MemoryShare(memory,
      (NativeView::BytesPerPixel + (estimate ? sizeof(float) : 0) +
        (firstHit ? FirstHitBytesPerPixel : 0) + (peels ? sizeof(float) : 0) +
        (lengths ? LengthsBytesPerPixel : 0)) *
        static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height));
    return glGetError() == GL_NO_ERROR;
  }
  this->Position = make(GL_RGBA32I, 16);
  this->Intervals = make(GL_RGBA32F, 16);
  const std::vector<std::uint32_t> zeros(this->FeedbackWords(), 0);
  this->Feedback =
    GLBuffer(memory, GL_SHADER_STORAGE_BUFFER, zeros.size() * 4, zeros.data(), GL_DYNAMIC_READ);
  this->TileList = GLBuffer(memory, GL_ARRAY_BUFFER,
    static_cast<std::size_t>(this->TilesX()) * static_cast<std::size_t>(this->TilesY()) * 8,
    nullptr, GL_STREAM_DRAW);

  this->StateTarget = GLFramebuffer::Make();
  glBindFramebuffer(GL_FRAMEBUFFER, this->StateTarget.Id());
  glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, this->Color.Id(), 0);
  glFramebufferTexture2D(
    GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT1, GL_TEXTURE_2D, this->Position.Id(), 0);
  if (estimate)
  {
    this->Error = make(GL_R32F, 4);
    glFramebufferTexture2D(
      GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT2, GL_TEXTURE_2D, this->Error.Id(), 0);
  }
  const std::array<GLenum, 3> targets{ GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1,
    GL_COLOR_ATTACHMENT2 };
  glDrawBuffers(estimate ? 3 : 2, targets.data());
  if (firstHit)
  {
    this->FirstHit = make(GL_RG32F, FirstHitBytesPerPixel);
    this->HitTarget = GLFramebuffer::Make();
    glBindFramebuffer(GL_FRAMEBUFFER, this->HitTarget.Id());
    glFramebufferTexture2D(
      GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, this->FirstHit.Id(), 0);
  }
  if (lengths)
  {
    this->Lengths = make(GL_RGBA32F, LengthsBytesPerPixel);
    this->LengthsTarget = GLFramebuffer::Make();
    glBindFramebuffer(GL_FRAMEBUFFER, this->LengthsTarget.Id());
    glFramebufferTexture2D(
      GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, this->Lengths.Id(), 0);
  }
  this->IntervalTarget = GLFramebuffer::Make();
  glBindFramebuffer(GL_FRAMEBUFFER, this->IntervalTarget.Id());
  glFramebufferTexture2D(
    GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, this->Intervals.Id(), 0);
  this->EmptyTarget = GLFramebuffer::Make();
  glBindFramebuffer(GL_FRAMEBUFFER, this->EmptyTarget.Id());
  glFramebufferParameteri(GL_FRAMEBUFFER, GL_FRAMEBUFFER_DEFAULT_WIDTH, width);
  glFramebufferParameteri(GL_FRAMEBUFFER, GL_FRAMEBUFFER_DEFAULT_HEIGHT, height);
  return glGetError() == GL_NO_ERROR;
}

void ViewState::Release()
{
  this->Native = {};
  this->NativeBytes.Release();
  this->Color.Release();
  this->Position.Release();
  this->Intervals.Release();
  this->Depth.Release();
  this->Error.Release();
  this->FirstHit.Release();
  this->Lengths.Release();
  this->LengthsTarget.Release();
  this->Peel.Release();
  this->HitTarget.Release();
  this->Geometry.reset();
  this->Feedback.Release();
  this->TileList.Release();
  this->StateTarget.Release();
  this->IntervalTarget.Release();
  this->EmptyTarget.Release();
  this->Frames.reset();
  this->Gathered.reset();
  this->ActiveTiles.clear();
  this->Complete.reset();
  this->Native_ = false;
  this->Estimate_ = false;
  this->FirstHit_ = false;
  this->Peels_ = false;
  this->Lengths_ = false;
  this->Width_ = 0;
  this->Height_ = 0;
}

} // namespace teravox
