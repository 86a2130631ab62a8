// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "ImageMetrics.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <utility>

namespace teravox
{
namespace
{

std::uint32_t BitsOf(float value)
{
  static_assert(sizeof(std::uint32_t) == sizeof(float), "32-bit float");
  std::uint32_t bits = 0;
  std::memcpy(&bits, &value, sizeof(bits));
  return bits;
}

double Distance(double a, double b)
{
  if (std::isfinite(a) && std::isfinite(b))
  {
    return std::fabs(a - b);
  }
  const bool same = a == b || (std::isnan(a) && std::isnan(b));
  return same ? 0 : std::numeric_limits<double>::infinity();
}

ImageDifference Summarize(std::vector<double> distances)
{
  ImageDifference result;
  if (distances.empty())
  {
    return result;
  }
  const auto count = static_cast<double>(distances.size());
  const auto worst = std::max_element(distances.begin(), distances.end());
  const auto index = static_cast<std::size_t>(worst - distances.begin());
  result.Max = *worst;
  result.WorstPixel = index / 4;
  result.WorstChannel = index % 4;
  for (const double distance : distances)
  {
    result.Mean += distance / count;
    result.Rms += distance * distance / count;
  }
  result.Rms = std::sqrt(result.Rms);
  // Integer arithmetic, so that 99 of 100 is exactly that.
  const std::size_t rank = (distances.size() * 99 + 99) / 100 - 1;
  std::nth_element(
    distances.begin(), distances.begin() + static_cast<std::ptrdiff_t>(rank), distances.end());
  result.Percentile99 = distances[rank];
  return result;
}

} // namespace

ImageDifference CompareImages(const std::vector<float>& a, const std::vector<float>& b)
{
  assert(a.size() == b.size() && a.size() % 4 == 0);
  std::vector<double> distances(a.size());
  for (std::size_t i = 0; i < a.size(); ++i)
  {
    distances[i] = Distance(a[i], b[i]);
  }
  return Summarize(std::move(distances));
}

ImageDifference ExcessOverEnvelope(
  const std::vector<float>& image, const std::vector<float>& lower, const std::vector<float>& upper)
{
  assert(image.size() == lower.size() && image.size() == upper.size() && image.size() % 4 == 0);
  std::vector<double> distances(image.size());
  for (std::size_t i = 0; i < image.size(); ++i)
  {
    const bool inside = lower[i] <= image[i] && image[i] <= upper[i];
    distances[i] =
      inside ? 0 : std::min(Distance(image[i], lower[i]), Distance(image[i], upper[i]));
  }
  return Summarize(std::move(distances));
}

bool AreImagesIdentical(const std::vector<float>& a, const std::vector<float>& b)
{
  return a.size() == b.size() && CountDifferentBits(a, b) == 0;
}

std::size_t CountDifferentBits(const std::vector<float>& a, const std::vector<float>& b)
{
  const std::size_t common = std::min(a.size(), b.size());
  std::size_t count = std::max(a.size(), b.size()) - common;
  for (std::size_t i = 0; i < common; ++i)
  {
    count += BitsOf(a[i]) != BitsOf(b[i]) ? 1 : 0;
  }
  return count;
}

} // namespace teravox
