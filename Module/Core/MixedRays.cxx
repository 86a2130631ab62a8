// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "MixedRays.h"

#include <algorithm>
#include <cmath>

namespace teravox
{

namespace
{
constexpr std::size_t Channels = 4;
// How much longer a stretch is at most than the one before, or shorter where it is drawn again.
constexpr double FastestRise = 2;
constexpr double FastestFall = 0.2;
constexpr double FirstStretches = 8; ///< of the zone, before anything is known
/// What is left of a ray that is done, as share of the tolerance.
constexpr double LeftOver = 0.5;

// One behind the other.
MixedColor Over(const MixedColor& front, const MixedColor& back)
{
  MixedColor both = front;
  const float left = 1.0f - front[3];
  for (std::size_t c = 0; c < Channels; ++c)
  {
    both[c] += left * back[c];
  }
  return both;
}

// Optical depth; of what is opaque as much as a float can tell from it.
double DepthOf(float opacity)
{
  constexpr double least = 1.0 / (1 << 24);
  return -std::log(std::max(1.0 - static_cast<double>(opacity), least));
}
} // namespace

MixedColor MixStretch(const MixedColor* colors, std::size_t volumes, float& ambiguity)
{
  ambiguity = 0;
  std::size_t there = 0;
  std::size_t one = 0;
  float sum = 0;
  for (std::size_t v = 0; v < volumes; ++v)
  {
    const float opacity = colors[v][3];
    if (opacity > 0)
    {
      ambiguity += sum * opacity / 2;
      sum += opacity;
      one = v;
      ++there;
    }
  }
  if (there <= 1)
  {
    return colors[one];
  }
  double total = 0;
  std::array<double, Channels> light{};
  for (std::size_t v = 0; v < volumes; ++v)
  {
    if (colors[v][3] > 0)
    {
      const double depth = DepthOf(colors[v][3]);
      const double each = depth / static_cast<double>(colors[v][3]);
      total += depth;
      for (std::size_t c = 0; c < 3; ++c)
      {
        light[c] += each * static_cast<double>(colors[v][c]);
      }
    }
  }
  const double opacity = -std::expm1(-total);
  MixedColor mixed{};
  for (std::size_t c = 0; c < 3; ++c)
  {
    mixed[c] = static_cast<float>(light[c] / total * opacity);
  }
  mixed[3] = static_cast<float>(opacity);
  return mixed;
}

std::uint64_t MixedRays::BytesPerRay(std::size_t volumes)
{
  // Also the colours of the whole and of what is drawn, and the stretches.
  return sizeof(Ray) + sizeof(std::uint32_t) + Channels * sizeof(float) +
    volumes * 3 * sizeof(MixedColor) + sizeof(Stretch) + 2 * sizeof(float);
}

MixedRays::MixedRays(const Options& options, const std::vector<std::vector<float>>& whole)
  : Choice(options)
  , Volumes(whole.size())
{
  const std::size_t count = whole.empty() ? 0 : whole[0].size() / Channels;
  this->Result.resize(count * Channels);
  this->Rays.resize(count);
  this->FirstHalves.resize(count * this->Volumes);
  std::vector<MixedColor> colors(this->Volumes);
  const double zone = std::max(options.ZoneEnd - options.ZoneBegin, 0.0);
  for (std::size_t i = 0; i < count; ++i)
  {
    for (std::size_t v = 0; v < this->Volumes; ++v)
    {
      std::copy_n(&whole[v][Channels * i], Channels, colors[v].begin());
    }
    float ambiguity = 0;
    const MixedColor mixed = MixStretch(colors.data(), this->Volumes, ambiguity);
    std::copy(mixed.begin(), mixed.end(), &this->Result[Channels * i]);
    if (static_cast<double>(ambiguity) > LeftOver * options.Tolerance)
    {
      this->Rays[i].At = FromNear;
      this->Rays[i].Length = zone / FirstStretches;
      this->Active.push_back(static_cast<std::uint32_t>(i));
    }
  }
}

double MixedRays::EndOf(const Ray& ray) const
{
  const double end = ray.At + ray.Length;
  return end + this->Choice.LeastLength < this->Choice.ZoneEnd ? end : this->Choice.ZoneEnd;
}

double MixedRays::MiddleOf(const Ray& ray) const
{
  return ray.At + (this->EndOf(ray) - ray.At) / 2;
}

std::vector<MixedRays::Stretch> MixedRays::Next() const
{
  std::vector<Stretch> stretches(this->Rays.size());
  for (const std::uint32_t index : this->Active)
  {
    const Ray& ray = this->Rays[index];
    switch (ray.State)
    {
      case Phase::Before:
        stretches[index] = { FromNear, this->Choice.ZoneBegin };
        break;
      case Phase::FirstHalf:
        stretches[index] = { ray.At, this->MiddleOf(ray) };
        break;
      case Phase::SecondHalf:
        stretches[index] = { this->MiddleOf(ray), this->EndOf(ray) };
        break;
      case Phase::Behind:
        stretches[index] = { ray.At, ToEnd };
        break;
    }
  }
  return stretches;
}

void MixedRays::Add(std::uint32_t index, const MixedColor& color)
{
  Ray& ray = this->Rays[index];
  ray.Color = Over(ray.Color, color);
}

// Takes both halves, or halves the stretch. Returns whether it was taken.
bool MixedRays::Decide(std::uint32_t index, Ray& ray, const MixedColor* second)
{
  const MixedColor* first = &this->FirstHalves[index * this->Volumes];
  float firstAmbiguity = 0;
  float secondAmbiguity = 0;
  const MixedColor front = MixStretch(first, this->Volumes, firstAmbiguity);
  const MixedColor back = MixStretch(second, this->Volumes, secondAmbiguity);
  const MixedColor halves = Over(front, back);
  const double end = this->EndOf(ray);
  const double length = end - ray.At;
  const auto left = static_cast<double>(1.0f - ray.Color[3]);
  // What a stretch may be off: its share of the ray's opacity, and of its length.
  const auto allow = [&](float opacity, double part)
  {
    return 0.5 * this->Choice.Tolerance *
      (left * static_cast<double>(opacity) +
        part / (this->Choice.ZoneEnd - this->Choice.ZoneBegin));
  };
  const double allowed = allow(halves[3], length);
  const double ambiguity =
    left * static_cast<double>(firstAmbiguity + (1.0f - front[3]) * secondAmbiguity);
  double difference = 0;
  if (ambiguity > allowed)
  {
    // Of each volume alone the whole is certain.
    std::vector<MixedColor> alone(this->Volumes);
    for (std::size_t v = 0; v < this->Volumes; ++v)
    {
      alone[v] = Over(first[v], second[v]);
    }
    float unused = 0;
    const MixedColor whole = MixStretch(alone.data(), this->Volumes, unused);
    for (std::size_t c = 0; c < Channels; ++c)
    {
      difference =
        std::max(difference, left * static_cast<double>(std::fabs(whole[c] - halves[c])));
    }
  }
  // The difference grows with the third power of the length, what is certain with the second; what
  // is allowed with the first.
  const double fit = std::min(std::sqrt(allowed / std::max(difference, 1e-3 * allowed)),
    Certain * allowed / std::max(ambiguity, 1e-3 * allowed));
  if (fit < 1 && ambiguity > allowed && length > this->Choice.LeastLength)
  {
    ray.Length = std::clamp(0.9 * fit, FastestFall, 0.5) * length;
    ray.State = Phase::FirstHalf;
    // What is certain needn't be drawn again.
    if (left * static_cast<double>(firstAmbiguity) <= allow(front[3], length / 2))
    {
      ray.At += length / 2;
      this->Add(index, front);
      return true;
    }
    return false;
  }
  this->Add(index, halves);
  ray.At = end;
  ray.Length = std::clamp(0.9 * fit, 1.0, FastestRise) * length;
  return true;
}

void MixedRays::Finish(std::uint32_t index)
{
  std::copy(this->Rays[index].Color.begin(), this->Rays[index].Color.end(),
    &this->Result[Channels * index]);
}

void MixedRays::Take(const std::vector<std::vector<float>>& drawn)
{
  ++this->Rounds_;
  std::vector<MixedColor> colors(this->Volumes);
  std::vector<std::uint32_t> still;
  for (const std::uint32_t index : this->Active)
  {
    for (std::size_t v = 0; v < this->Volumes; ++v)
    {
      colors[v] = {};
      if (!drawn[v].empty())
      {
        std::copy_n(&drawn[v][Channels * index], Channels, colors[v].begin());
      }
    }
    Ray& ray = this->Rays[index];
    float ambiguity = 0;
    bool taken = true;
    switch (ray.State)
    {
      case Phase::Before:
        this->Add(index, MixStretch(colors.data(), this->Volumes, ambiguity));
        ray.At = this->Choice.ZoneBegin;
        break;
      case Phase::FirstHalf:
        std::copy(colors.begin(), colors.end(),
          this->FirstHalves.begin() + static_cast<std::ptrdiff_t>(index * this->Volumes));
        ray.State = Phase::SecondHalf;
        taken = false;
        break;
      case Phase::SecondHalf:
        taken = this->Decide(index, ray, colors.data());
        break;
      case Phase::Behind:
        this->Add(index, MixStretch(colors.data(), this->Volumes, ambiguity));
        this->Finish(index);
        continue;
    }
    if (taken)
    {
      if (static_cast<double>(1.0f - ray.Color[3]) <= LeftOver * this->Choice.Tolerance)
      {
        this->Finish(index);
        continue;
      }
      ray.State = ray.At < this->Choice.ZoneEnd ? Phase::FirstHalf : Phase::Behind;
    }
    still.push_back(index);
  }
  this->Active = std::move(still);
}

} // namespace teravox
