// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "Status.h"
#include "VoxelReader.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vtkSmartPointer.h>

class vtkAlgorithm;
class vtkDataArray;
class vtkImageData;

namespace teravox
{

/// Gives the voxels of a VTK image pipeline to a PyramidWriter, box by box. Thread: the one that
/// made it; VTK's pipelines have no other.
class PipelineVoxelReader : public VoxelReader
{
public:
  struct Options
  {
    std::string ArrayName; ///< empty: active scalars of the points, else of the cells
    double FillValue = 0.0;
    /// An input of at most this many bytes is asked for as a whole.
    std::uint64_t WholeLimit = 0;
    /// A larger one is asked for in pieces of about this many bytes.
    std::uint64_t PieceLimit = std::uint64_t{ 64 } << 20;
  };

  /// Updates the pipeline: its whole extent, or the first voxel. `port` is the output port.
  /// Errors: an empty image, no array, a type or number of components that pyramids don't have, an
  /// upstream failure, a singular direction matrix, a spacing that isn't above 0.
  static Result<std::shared_ptr<PipelineVoxelReader>> Make(
    vtkAlgorithm* producer, int port, const Options& options);

  Description Describe() const override { return this->Volume; }
  Status ReadBox(const Int3& start, const Int3& size, void* out) override;
  /// Whole slices of an image that is held as a whole.
  const void* FindBox(const Int3& start, const Int3& size) override;

  /// Bytes of the image that are held throughout; 0 if it streams or belongs to the user.
  std::uint64_t HeldBytes() const { return this->Held; }
  bool IsWhole() const { return this->Whole; }

  PipelineVoxelReader(vtkAlgorithm* producer, int port, Options options);

private:
  Status Open();
  Status OpenGeometry(vtkImageData* image);
  /// Updates the pipeline for an extent of points; the image then contains it.
  Result<vtkImageData*> UpdateExtent(const std::array<int, 6>& extent);
  Result<vtkDataArray*> FindArray(vtkImageData* image);
  /// Voxels of a piece where the pipeline has them: the first one, and from row to row, slice to
  /// slice in voxels.
  struct Piece
  {
    vtkImageData* Image = nullptr;
    const std::byte* First = nullptr;
    std::int64_t Row = 0;
    std::int64_t Slice = 0;
  };
  Result<Piece> UpdatePiece(const Int3& start, const Int3& size);
  std::size_t VoxelBytes() const;
  Status ReadPiece(const Int3& start, const Int3& size, std::byte* out);

  vtkSmartPointer<vtkAlgorithm> Producer;
  int Port;
  Options Settings;
  Description Volume;
  std::array<int, 6> WholeExtent{ 0, -1, 0, -1, 0, -1 };
  std::string FoundName; // of the array; empty for one without a name
  bool Whole = false;
  std::uint64_t Held = 0;
};

} // namespace teravox
