// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

namespace teravox
{

/// How far two float RGBA pictures are apart, over all channels of all pixels. A pair that is not
/// finite and not the same counts as infinitely far apart.
struct ImageDifference
{
  double Max = 0;
  double Mean = 0;
  double Rms = 0;
  double Percentile99 = 0;    ///< smallest d such that at least 99 % of all channels differ by <= d
  std::size_t WorstPixel = 0; ///< the first pixel with the difference Max
  std::size_t WorstChannel = 0;
};

/// Requires: both have the same size, a multiple of 4 (asserted); x fastest.
ImageDifference CompareImages(const std::vector<float>& a, const std::vector<float>& b);

/// The amounts by which a picture leaves [lower, upper]; 0 inside.
ImageDifference ExcessOverEnvelope(const std::vector<float>& image, const std::vector<float>& lower,
  const std::vector<float>& upper);

/// Equal bit for bit: +0 and -0 differ, a NaN equals the same NaN.
bool AreImagesIdentical(const std::vector<float>& a, const std::vector<float>& b);

/// Channels whose bits differ, for messages.
std::size_t CountDifferentBits(const std::vector<float>& a, const std::vector<float>& b);

} // namespace teravox
