// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

namespace teravox
{

/// What one mapper drew into a window, as far as refinement asks.
struct DrawnPicture
{
  bool Converged = false;
  bool Failed = false;            ///< bricks couldn't be read, so that it never converges
  std::uint64_t Missing = 0;      ///< bricks
  std::uint64_t BricksLoaded = 0; ///< since the mapper was made
};

/// Where mappers leave how complete their pictures are, and vtkProgressiveRefinement finds it: it
/// can't ask the mappers themselves, which may lie inside of others (vtkSmartVolumeMapper). One
/// board per window, while it is open; the window is a name only.
/// Thread: any, guarded by one lock.
class RefinementBoard
{
public:
  static void Open(const void* window);
  static void Close(const void* window);
  /// A new frame begins: what is left there is of the last one.
  static void Clear(const void* window);
  /// Nothing happens if the window has no open board.
  static void Post(const void* window, const DrawnPicture& picture);
  static std::vector<DrawnPicture> Read(const void* window);
};

} // namespace teravox
