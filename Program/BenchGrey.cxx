// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "BenchGrey.h"

#include <algorithm>
#include <cmath>
#include <type_traits>

namespace teravox::program
{
namespace
{

constexpr double VoxelsPerPeriod = 55; // not a divisor of a chunk's edge
constexpr float Air = 0.35F;
constexpr int Largest = 4095;
constexpr std::uint32_t NoiseLevels = 16; // of 4096

std::uint32_t Hash(std::int64_t x, std::int64_t y, std::int64_t z)
{
  std::uint32_t h = static_cast<std::uint32_t>(x) * 0x9E3779B1u +
    static_cast<std::uint32_t>(y) * 0x85EBCA77u + static_cast<std::uint32_t>(z) * 0xC2B2AE3Du;
  h = (h ^ h >> 15) * 0x2C1B3C6Du;
  return h ^ h >> 13;
}

} // namespace

GreyReader::GreyReader(ScalarType type, std::int64_t edge)
  : Type(type)
  , Edge(edge)
{
  for (std::int64_t i = 0; i < edge; ++i)
  {
    const double angle = 2 * M_PI * static_cast<double>(i) / VoxelsPerPeriod;
    this->Sines.push_back(static_cast<float>(std::sin(angle)));
    this->Cosines.push_back(static_cast<float>(std::cos(angle)));
  }
}

VoxelReader::Description GreyReader::Describe() const
{
  Description volume;
  volume.Dimensions = { this->Edge, this->Edge, this->Edge };
  volume.Type = this->Type;
  return volume;
}

int GreyReader::ValueAt(std::int64_t x, std::int64_t y, std::int64_t z) const
{
  const auto i = static_cast<std::size_t>(x);
  const auto j = static_cast<std::size_t>(y);
  const auto k = static_cast<std::size_t>(z);
  const float f = 0.5F +
    0.3F *
      (this->Sines[i] * this->Cosines[j] + this->Sines[j] * this->Cosines[k] +
        this->Sines[k] * this->Cosines[i]);
  if (f <= Air)
  {
    return 0;
  }
  const int noise = static_cast<int>(Hash(x, y, z) % NoiseLevels);
  return std::clamp(static_cast<int>(f * Largest) + noise, 0, Largest);
}

Status GreyReader::ReadBox(const Int3& start, const Int3& size, void* out)
{
  DispatchScalarType(this->Type,
    [&](auto example)
    {
      using T = decltype(example);
      T* const voxels = static_cast<T*>(out);
#pragma omp parallel for schedule(dynamic, 1)
      for (std::int64_t z = 0; z < size[2]; ++z)
      {
        T* to = voxels + z * size[1] * size[0];
        for (std::int64_t y = start[1]; y < start[1] + size[1]; ++y)
        {
          for (std::int64_t x = start[0]; x < start[0] + size[0]; ++x)
          {
            const int grey = this->ValueAt(x, y, start[2] + z);
            if constexpr (std::is_floating_point_v<T>)
            {
              *to++ = static_cast<T>(grey) * T(0.25);
            }
            else
            {
              *to++ = static_cast<T>(sizeof(T) == 1 ? grey >> 4 : grey);
            }
          }
        }
      }
    });
  return {};
}

} // namespace teravox::program
