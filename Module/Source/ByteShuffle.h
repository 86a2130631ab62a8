// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>

namespace teravox
{

namespace detail
{
// With the size known, whole elements are written at once.
template <std::size_t ElementSize>
void Interleave(const std::byte* in, std::size_t n, std::byte* out)
{
  for (std::size_t i = 0; i < n; ++i)
  {
    for (std::size_t b = 0; b < ElementSize; ++b)
    {
      out[i * ElementSize + b] = in[b * n + i];
    }
  }
}
} // namespace detail

/// From the first bytes of all `n` elements, their second bytes and so on, to whole elements of
/// `elementSize` bytes. `in` and `out` have n * elementSize bytes and don't overlap.
inline void Unshuffle(const std::byte* in, std::size_t n, std::size_t elementSize, std::byte* out)
{
  switch (elementSize)
  {
    case 2:
      detail::Interleave<2>(in, n, out);
      break;
    case 4:
      detail::Interleave<4>(in, n, out);
      break;
    case 8:
      detail::Interleave<8>(in, n, out);
      break;
    default:
      for (std::size_t b = 0; b < elementSize; ++b)
      {
        const std::byte* from = in + b * n;
        std::byte* to = out + b;
        for (std::size_t i = 0; i < n; ++i)
        {
          to[i * elementSize] = from[i];
        }
      }
  }
}

} // namespace teravox
