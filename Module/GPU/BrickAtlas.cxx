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
  atlas->Texture =
    GLTexture(memory, GL_TEXTURE_3D, format.InternalFormat, static_cast<int>(plan.AtlasSize[0]),
      static_cast<int>(plan.AtlasSize[1]), static_cast<int>(plan.AtlasSize[2]),
      format.BytesPerTexel, format.DriverFilter ? GL_LINEAR : GL_NEAREST);
  atlas->CellsPerBrick = static_cast<int>(CeilDiv(storedSize - 2 * BrickBorder, CellEdge));
  const auto cells = [&](std::size_t a)
  { return static_cast<int>(plan.SlotsPerAxis[a]) * atlas->CellsPerBrick; };
  atlas->Cells = GLTexture(memory, GL_TEXTURE_3D, format.CellFormat, cells(0), cells(1), cells(2),
    std::size_t{ 2 } * format.BytesPerTexel, GL_NEAREST);
  atlas->Table = GLBuffer(memory, GL_SHADER_STORAGE_BUFFER,
    static_cast<std::size_t>(plan.DirectoryBytes + plan.PageBlockBytes), nullptr, GL_DYNAMIC_DRAW);
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
  const ConvertedBrick texels = ConvertBrick(brick, this->Format_);
  const auto& n = this->Plan_.SlotsPerAxis;
  const std::int64_t s = slot;
  const std::array<std::int64_t, 3> at{ s % n[0], s / n[0] % n[1], s / (n[0] * n[1]) };
  const auto edge = static_cast<GLsizei>(this->StoredSize);
  this->Texture.Bind(0);
  glTexSubImage3D(GL_TEXTURE_3D, 0, static_cast<GLint>(at[0] * edge),
    static_cast<GLint>(at[1] * edge), static_cast<GLint>(at[2] * edge), edge, edge, edge, GL_RED,
    this->Format_.DataType, texels.Bytes.data());
  const GLsizei cells = this->CellsPerBrick;
  this->Cells.Bind(0);
  glTexSubImage3D(GL_TEXTURE_3D, 0, static_cast<GLint>(at[0]) * cells,
    static_cast<GLint>(at[1]) * cells, static_cast<GLint>(at[2]) * cells, cells, cells, cells,
    GL_RG, this->Format_.DataType, texels.Cells.data());
  this->BytesUploaded_ += texels.Bytes.size() + texels.Cells.size();
  if (this->Plan_.SlotTableBytes != 0)
  {
    const std::array<float, 4> entry{ texels.OffsetHigh, texels.OffsetLow, texels.Scale, 0 };
    this->Slots.Write(std::size_t{ slot } * sizeof(entry), sizeof(entry), entry.data());
  }
}

void BrickAtlas::Apply(const PageTable& table, const PageTable::Changes& changes)
{
  const auto write = [&](std::size_t first, std::size_t count)
  {
    this->Table.Write(
      first * sizeof(PageEntry), count * sizeof(PageEntry), table.Entries().data() + first);
    this->TableBytesUploaded += count * sizeof(PageEntry);
  };
  if (changes.Directory)
  {
    write(0, static_cast<std::size_t>(table.Layout().DirectoryEntries()));
  }
  for (const std::uint32_t slot : changes.Blocks)
  {
    write(table.BlockOffset(slot), PageTable::EntriesPerBlock);
  }
}

void BrickAtlas::Bind() const
{
  this->Texture.Bind(0);
  this->Cells.Bind(4);
  glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 0, this->Table.Id());
  glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 2, this->Slots.Id());
}

} // namespace teravox
