// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "BenchFetch.h"

#include "BenchClock.h"
#include "BenchVolumes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <ctime>
#include <random>
#include <vector>

namespace teravox::program
{
namespace
{

constexpr int Rays = 200000;
constexpr int Repetitions = 5;

/// Processor time of the calling thread: waiting for other threads isn't part of a fetch.
double ThreadSeconds()
{
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

/// A brick of 64^3 voxels and one more on either side, or as much of it as there is.
template <typename T>
struct Block
{
  std::array<int, 3> Size{};
  std::vector<T> Voxels;

  explicit Block(const BenchVolume& volume)
  {
    std::array<std::size_t, 3> first{};
    for (std::size_t axis = 0; axis < 3; ++axis)
    {
      const auto all = volume.Dimensions.at(axis);
      this->Size.at(axis) = static_cast<int>(std::min<std::int64_t>(all, 66));
      first.at(axis) = static_cast<std::size_t>((all - this->Size.at(axis)) / 2);
    }
    const auto width = static_cast<std::size_t>(this->Size[0]);
    this->Voxels.resize(
      width * static_cast<std::size_t>(this->Size[1]) * static_cast<std::size_t>(this->Size[2]));
    T* to = this->Voxels.data();
    for (std::size_t z = 0; z < static_cast<std::size_t>(this->Size[2]); ++z)
    {
      for (std::size_t y = 0; y < static_cast<std::size_t>(this->Size[1]); ++y, to += width)
      {
        const std::size_t row =
          (first[2] + z) * static_cast<std::size_t>(volume.Dimensions[1]) + first[1] + y;
        const std::size_t at = row * static_cast<std::size_t>(volume.Dimensions[0]) + first[0];
        std::memcpy(to, volume.Voxels.data() + at * sizeof(T), width * sizeof(T));
      }
    }
  }

  float Fetch(const std::array<float, 3>& place) const
  {
    const int x = static_cast<int>(place[0]);
    const int y = static_cast<int>(place[1]);
    const int z = static_cast<int>(place[2]);
    const float u = place[0] - static_cast<float>(x);
    const float v = place[1] - static_cast<float>(y);
    const float w = place[2] - static_cast<float>(z);
    const std::ptrdiff_t row = this->Size[0];
    const std::ptrdiff_t layer = row * this->Size[1];
    const T* at = this->Voxels.data() + z * layer + y * row + x;
    const auto alongX = [u](const T* pair)
    {
      const auto low = static_cast<float>(pair[0]);
      return low + u * (static_cast<float>(pair[1]) - low);
    };
    const auto alongY = [&](const T* face)
    {
      const float low = alongX(face);
      return low + v * (alongX(face + row) - low);
    };
    const float low = alongY(at);
    return low + w * (alongY(at + layer) - low);
  }
};

struct Ray
{
  std::array<float, 3> Begin{};
  std::array<float, 3> Step{};
  int Steps = 0;
};

/// From a place within the block in any direction, as far as its cells go.
std::vector<Ray> RandomRays(const std::array<int, 3>& size)
{
  std::mt19937 random(1); // NOLINT(cert-msc51-cpp): the same rays each time
  std::vector<Ray> rays(Rays);
  for (Ray& ray : rays)
  {
    std::normal_distribution<float> normal;
    float length = 0;
    for (std::size_t axis = 0; axis < 3; ++axis)
    {
      ray.Begin.at(axis) =
        std::uniform_real_distribution<float>(0, static_cast<float>(size.at(axis) - 1))(random);
      ray.Step.at(axis) = normal(random);
      length += ray.Step.at(axis) * ray.Step.at(axis);
    }
    float steps = 66;
    for (std::size_t axis = 0; axis < 3; ++axis)
    {
      ray.Step.at(axis) /= std::sqrt(length);
      const float far = ray.Step.at(axis) < 0 ? 0.01F : static_cast<float>(size.at(axis)) - 1.01F;
      steps = std::min(steps, (far - ray.Begin.at(axis)) / ray.Step.at(axis));
    }
    ray.Steps = static_cast<int>(std::max(steps, 0.0F));
  }
  return rays;
}

template <typename T>
double SecondsOf(const BenchVolume& volume)
{
  const Block<T> block(volume);
  const std::vector<Ray> rays = RandomRays(block.Size);
  std::size_t fetches = 0;
  for (const Ray& ray : rays)
  {
    fetches += static_cast<std::size_t>(ray.Steps);
  }
  if (fetches == 0)
  {
    return 0; // a volume without interpolation cells
  }
  std::vector<double> seconds;
  float sum = 0;
  for (int i = 0; i < Repetitions; ++i)
  {
    double spent = 0;
#pragma omp parallel reduction(+ : sum, spent)
    {
      const double begin = ThreadSeconds();
#pragma omp for schedule(dynamic, 64) nowait
      for (int j = 0; j < Rays; ++j)
      {
        const Ray& ray = rays[static_cast<std::size_t>(j)];
        std::array<float, 3> place = ray.Begin;
        for (int step = 0; step < ray.Steps; ++step)
        {
          sum += block.Fetch(place);
          for (std::size_t axis = 0; axis < 3; ++axis)
          {
            place[axis] += ray.Step[axis];
          }
        }
      }
      spent += ThreadSeconds() - begin;
    }
    seconds.push_back(spent / static_cast<double>(fetches));
  }
  [[maybe_unused]] const volatile float used = sum; // or else a compiler leaves the fetches out
  return MedianOf(seconds);
}

} // namespace

double BareFetchSeconds(const BenchVolume& volume)
{
  return DispatchScalarType(volume.Type, [&](auto t) { return SecondsOf<decltype(t)>(volume); });
}

} // namespace teravox::program
