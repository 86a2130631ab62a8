// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "Status.h"
#include "Types.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace teravox
{

/// What a parallel VTK image file (.pvti) says: an image, its arrays, and which file has which part
/// of it. Nothing is said about the files themselves. Thread: a value.
struct PieceIndex
{
  /// First and last index along x, y, z, as VTK has them.
  using Extent = std::array<int, 6>;
  struct Array
  {
    std::string Name;
    std::optional<ScalarType> Type; ///< none: one that voxels can't have
    std::string TypeName;           ///< in the file's words
    int Components = 1;
    bool Cells = false;
  };
  struct Piece
  {
    Extent Points{}; ///< of points, also where data are those of cells
    std::string File;
  };

  Extent Whole{};
  Double3 Origin{ 0, 0, 0 };
  Double3 Spacing{ 1, 1, 1 };
  std::array<double, 9> Direction{ 1, 0, 0, 0, 1, 0, 0, 0, 1 };
  std::vector<Array> Arrays;
  std::string PointScalars; ///< names of those that are active; empty: none
  std::string CellScalars;
  std::vector<Piece> Pieces;

  /// Errors: NotFound, InputOutput, Corrupt; NotFound also for a piece whose file isn't there.
  static Result<PieceIndex> Read(const std::string& fileName);

  /// The array of that name; for an empty one the active scalars of points, else of cells, else the
  /// only array. Errors: NotFound (with those that there are), Unsupported (its type or its number
  /// of components isn't one of voxels).
  Result<Array> Choose(const std::string& fileName, const std::string& name) const;

  /// The extent of what an array has: points, or cells, of which an axis of one point has one.
  Extent IndicesOf(const Extent& points, bool cells) const;

  /// Which part of a piece's data to read for a request, and what of that isn't another's.
  struct Part
  {
    std::size_t Piece = 0;
    Extent Indices{};            ///< to be read: around the boxes
    std::vector<Extent> Boxes{}; ///< to be taken
  };
  /// Each index once: where pieces overlap, the first one is taken.
  /// Errors: Corrupt, if an index has no piece; Unsupported for too many pieces that overlap.
  Result<std::vector<Part>> PartsOf(
    const std::string& fileName, const Extent& indices, bool cells) const;
};

} // namespace teravox
