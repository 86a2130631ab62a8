// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "Status.h"
#include "Types.h"

#include <array>
#include <cstdint>
#include <string>

namespace teravox
{

/// What a DICOM file says of its one picture. Values, checked.
struct DICOMHeader
{
  std::int64_t Rows = 0;
  std::int64_t Columns = 0;
  int Samples = 1;       ///< per pixel, beside each other
  int BitsAllocated = 0; ///< 8, 16 or 32
  int BitsStored = 0;    ///< 1 to BitsAllocated
  bool Signed = false;
  double Slope = 1;
  double Intercept = 0;
  std::array<double, 2> PixelSpacing{ 1, 1 }; ///< from row to row, from column to column
  double SliceSpacing = 1;
  Double3 Position{ 0, 0, 0 };
  std::array<double, 6> Orientation{ 1, 0, 0, 0, 1, 0 }; ///< along a row, along a column
  std::string Series;
  std::int64_t PixelOffset = 0; ///< of the pixels in the file

  /// Errors: NotFound, InputOutput, Corrupt, Unsupported.
  static Result<DICOMHeader> Read(const std::string& fileName);
};

} // namespace teravox
