// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "PyramidLayout.h"
#include "Status.h"
#include "TexelFormat.h"

#include <cstdint>

namespace teravox
{

/// How the GPU budget is divided: the one place where its parts are computed.
/// Thread: immutable value.
struct AtlasPlan
{
  Int3 SlotsPerAxis{ 0, 0, 0 };
  Int3 AtlasSize{ 0, 0, 0 }; ///< voxels
  /// Slots lie one after the other in the memory of the host, for the native marcher.
  bool Native = false;
  /// Of a voxel, its mask included. A slot holds one volume of texels (and of ranges of cells) per
  /// component, in a texture one behind the other along z.
  std::uint32_t Components = 1;
  std::uint32_t Slots = 0;      ///< at most SlotsPerAxis[0]*[1]*[2]
  std::uint32_t PageBlocks = 0; ///< blocks in the pool
  std::uint64_t AtlasBytes = 0;
  std::uint64_t CellBytes = 0;      ///< ranges of the cells of each slot
  std::uint64_t OccupancyBytes = 0; ///< native marcher: two bits per cell, a version per slot
  std::uint64_t DirectoryBytes = 0;
  std::uint64_t PageBlockBytes = 0;
  std::uint64_t SlotTableBytes = 0; ///< value offset and scale per slot and component
  std::uint64_t FeedbackBytes = 0;  ///< request table and stamps

  /// What address translation needs: directory, page blocks and the table of slots.
  std::uint64_t AddressingBytes() const
  {
    return this->DirectoryBytes + this->PageBlockBytes + this->SlotTableBytes;
  }
  std::uint64_t TotalBytes() const
  {
    return this->AtlasBytes + this->CellBytes + this->OccupancyBytes + this->AddressingBytes() +
      this->FeedbackBytes;
  }
};

/// Edge of a cell in voxels: the unit in which emptiness inside a resident brick is known.
inline constexpr int CellEdge = 4;
/// Cells along each axis whose bits are one word, for the native marcher.
inline constexpr int MacroEdge = 4;

struct AtlasRequest
{
  std::uint64_t BudgetBytes = 0;   ///< for everything in TotalBytes() and what is reserved
  std::uint64_t ReservedBytes = 0; ///< ray states, transfer tables
  std::uint32_t BytesPerTexel = 1; ///< of the atlas, all components
  std::uint32_t Components = 1;
  bool SlotTable = false;                 ///< wide types are stored relative to their brick
  std::int64_t MaximumTextureSize = 2048; ///< texels per axis of a 3-D texture
  bool Native = false; ///< for the native marcher: in the memory of the host, of any size
  std::uint32_t MaximumSlots = ~std::uint32_t{ 0 }; ///< for tests of small atlases

  /// The request for voxels of a format and a picture of a size; budget and limits as above.
  static AtlasRequest For(const TexelFormat& format, int components, int width, int height);
};

/// Ray states of a picture, per pixel: colour, position and intervals (16 bytes each), depth (4);
/// or for the native marcher colour, position, depth, and colour and depth once more where OpenGL
/// has them; and the estimate of the error (4), whether it is asked for or not.
inline constexpr std::uint64_t RayStateBytesPerPixel = 60;
/// Ray states, tile list and stamps of a picture. Edges in pixels.
std::uint64_t PictureBytes(int width, int height);
/// Reserved for uniforms and the tables of the transfer function, so that an edit of the function
/// doesn't change the atlas; larger tables reserve what they take.
inline constexpr std::uint64_t TableBytesReserved = std::uint64_t{ 1 } << 20;

/// Entries of the request table of one pass.
inline constexpr std::uint32_t RequestTableEntries = 4096;
/// Words of one entry of the request table: tag, x, y, z, level, weight.
inline constexpr std::uint32_t RequestTableWords = 6;
/// Words before the request table: flags and counters.
inline constexpr std::uint32_t FeedbackHeaderWords = 16;

/// Divides a budget. The atlas never has more slots than the pyramid has bricks (but at least 2).
/// Errors: ResourceExhausted, with the least budget that works.
Result<AtlasPlan> PlanAtlas(const PyramidLayout& layout, const AtlasRequest& request);

} // namespace teravox
