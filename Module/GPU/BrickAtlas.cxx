// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "BrickAtlas.h"

#include <algorithm>
#include <array>

namespace teravox
{

Result<std::unique_ptr<BrickAtlas>> BrickAtlas::Make(
  GPUMemory& memory, const AtlasPlan& plan, const VoxelFormat& format, int storedSize)
{
  while (glGetError() != GL_NO_ERROR)
  {
  }
  const std::uint64_t peak = memory.Peak;
  std::unique_ptr<BrickAtlas> atlas(new BrickAtlas);
  atlas->Plan_ = plan;
  atlas->Format_ = format;
  atlas->StoredSize = storedSize;
  atlas->CellsPerBrick = static_cast<int>(CeilDiv(storedSize - 2 * BrickBorder, CellEdge));
  if (plan.Native)
  {
    Result<std::unique_ptr<NativeAtlas>> native = NativeAtlas::Make(plan);
    if (!native)
    {
      return native.GetStatus();
    }
    atlas->Native_ = std::move(native.Value());
    atlas->NativeBytes = MemoryShare(memory, plan.TotalBytes());
    return atlas;
  }
  atlas->Texture = GLTexture(memory, GL_TEXTURE_3D, format.InternalFormat,
    static_cast<int>(plan.AtlasSize[0]), static_cast<int>(plan.AtlasSize[1]),
    static_cast<int>(plan.AtlasSize[2] * plan.Components), format.BytesPerTexel, GL_NEAREST);
  const auto cells = [&](std::size_t a)
  { return static_cast<int>(plan.SlotsPerAxis[a]) * atlas->CellsPerBrick; };
  atlas->Cells = GLTexture(memory, GL_TEXTURE_3D, format.CellFormat, cells(0), cells(1),
    cells(2) * static_cast<int>(plan.Components), std::size_t{ 2 } * format.BytesPerTexel,
    GL_NEAREST);
  const std::vector<PageEntry> unknown(
    static_cast<std::size_t>(plan.DirectoryBytes + plan.PageBlockBytes) / sizeof(PageEntry));
  atlas->Table = GLBuffer(memory, GL_SHADER_STORAGE_BUFFER, unknown.size() * sizeof(PageEntry),
    unknown.data(), GL_DYNAMIC_DRAW);
  atlas->TableTexture = GLTexture(memory, GL_RGB32UI, atlas->Table);
  // The binding must exist for all variants; four floats where no slot table is needed.
  atlas->Slots = GLBuffer(memory, GL_SHADER_STORAGE_BUFFER,
    static_cast<std::size_t>(std::max<std::uint64_t>(plan.SlotTableBytes, 16)), nullptr,
    GL_DYNAMIC_DRAW);
  if (glGetError() != GL_NO_ERROR)
  {
    atlas.reset();
    memory.Peak = peak; // what was refused was never held
    return Status(StatusCode::ResourceExhausted,
      "The driver can't allocate " + std::to_string(plan.TotalBytes()) +
        " bytes for the brick atlas and its page table; choose a smaller GPU memory budget.");
  }
  return atlas;
}

void BrickAtlas::Upload(std::uint32_t slot, const Brick& brick)
{
  const std::vector<ConvertedBrick> components = ConvertComponents(brick, this->Format_);
  for (std::uint32_t c = 0; c < components.size(); ++c)
  {
    const ConvertedBrick& texels = components[c];
    this->BytesUploaded_ += texels.Bytes.size() + texels.Cells.size();
    if (this->Native_)
    {
      this->Native_->Write(slot, texels.Bytes.data(), texels.Bytes.size(), texels.Cells.data(),
        texels.Cells.size(), c);
      if (this->Plan_.SlotTableBytes != 0)
      {
        this->Native_->WriteEntry(slot, texels.OffsetHigh, texels.OffsetLow, texels.Scale, c);
      }
      continue;
    }
    this->UploadToTexture(slot, c, texels);
    if (this->Plan_.SlotTableBytes != 0)
    {
      const std::array<float, 4> entry{ texels.OffsetHigh, texels.OffsetLow, texels.Scale, 0 };
      const std::size_t place = std::size_t{ slot } * this->Plan_.Components + c;
      this->Slots.Write(place * sizeof(entry), sizeof(entry), entry.data());
    }
  }
}

void BrickAtlas::UploadToTexture(
  std::uint32_t slot, std::uint32_t component, const ConvertedBrick& texels)
{
  const auto& n = this->Plan_.SlotsPerAxis;
  const std::int64_t s = slot;
  const std::array<std::int64_t, 3> at{ s % n[0], s / n[0] % n[1],
    s / (n[0] * n[1]) * this->Plan_.Components + component };
  const auto put = [&](const GLTexture& texture, GLsizei edge, GLenum channels, const void* data)
  {
    texture.Bind(0);
    glTexSubImage3D(GL_TEXTURE_3D, 0, static_cast<GLint>(at[0]) * edge,
      static_cast<GLint>(at[1]) * edge, static_cast<GLint>(at[2]) * edge, edge, edge, edge,
      channels, this->Format_.DataType, data);
  };
  put(this->Texture, static_cast<GLsizei>(this->StoredSize), GL_RED, texels.Bytes.data());
  put(this->Cells, static_cast<GLsizei>(this->CellsPerBrick), GL_RG, texels.Cells.data());
}

void BrickAtlas::Apply(const PageTable& table, const std::vector<PageTable::Change>& changes)
{
  for (const PageTable::Change& change : changes)
  {
    // The native marcher reads the table itself.
    if (!this->Native_)
    {
      this->Table.Write(change.First * sizeof(PageEntry), change.Count * sizeof(PageEntry),
        table.Entries().data() + change.First);
    }
    this->TableBytesUploaded += change.Count * sizeof(PageEntry);
  }
}

void BrickAtlas::Bind() const
{
  this->Texture.Bind(0);
  this->Cells.Bind(4);
  this->TableTexture.Bind(6);
  glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 2, this->Slots.Id());
}

} // namespace teravox
