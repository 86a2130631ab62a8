// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace teravox
{

/// The colours that the pixels of a picture are numbers of: BMP, TGA. One whose colours are all
/// grey and opaque stands for one value per pixel, not for three.
struct Palette
{
  static constexpr std::size_t Most = 256;

  std::array<std::array<std::uint8_t, 4>, Most> Colors{}; ///< red, green, blue, alpha
  std::size_t Size = 0;
  bool HasAlpha = false;

  /// Values per pixel: 1, 3 or 4.
  int Components() const
  {
    bool grey = !this->HasAlpha;
    for (std::size_t i = 0; i < this->Size && grey; ++i)
    {
      const auto& color = this->Colors.at(i);
      grey = color[0] == color[1] && color[1] == color[2];
    }
    return this->HasAlpha ? 4 : grey ? 1 : 3;
  }
  /// Components() values for each of the numbers. Returns false if one of them is none's.
  bool Put(const std::uint8_t* numbers, std::size_t count, std::byte* out) const
  {
    const auto components = static_cast<std::size_t>(this->Components());
    for (std::size_t i = 0; i < count; ++i)
    {
      if (numbers[i] >= this->Size)
      {
        return false;
      }
      const auto& color = this->Colors.at(numbers[i]);
      for (std::size_t c = 0; c < components; ++c)
      {
        *out++ = std::byte{ color.at(c) };
      }
    }
    return true;
  }
};

} // namespace teravox
