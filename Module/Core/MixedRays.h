// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace teravox
{

/// Premultiplied red, green, blue, and opacity.
using MixedColor = std::array<float, 4>;

/// What several volumes show together of a stretch of a ray, each of which shows `colors[v]` of it
/// alone, if each one's extinction is spread over the stretch as the others' is. Extinctions add up
/// (Beer-Lambert), so the opacity is 1 - prod(1 - a), however they are spread; light is shared by
/// extinction (Hillman, "The Theory of OpenEXR Deep Samples", 2013, section on merging).
/// `ambiguity`: what a channel may be off at most if they are spread in any other way, as one
/// behind the other: half of the sum of a b over all pairs, for light of at most 1.
MixedColor MixStretch(const MixedColor* colors, std::size_t volumes, float& ambiguity);

/// Rays through several volumes that fill the same places. A marcher draws one volume at a time;
/// what they show together is found from stretches of the rays, drawn for each volume and mixed by
/// MixStretch(). Each ray chooses its stretches itself: two halves are drawn at a time, and what
/// they are together must be what mixing the whole of them gives, within a tolerance; else they are
/// halved. Front to back, until nothing is left of the ray. Thread: not shared.
class MixedRays
{
public:
  struct Options
  {
    /// What a channel of a ray may be off by the order of what lies in a stretch, 0...1: an
    /// estimate, and never more than Certain times as much.
    double Tolerance = 0.5 / 255;
    /// View depths between which more than one volume may be there.
    double ZoneBegin = 0;
    double ZoneEnd = 0;
    double LeastLength = 0; ///< of view depth; stretches as short as that aren't halved
  };
  static constexpr double Certain = 4;

  /// A stretch of a ray, as view depths; nothing where End <= Begin.
  struct Stretch
  {
    double Begin = 0;
    double End = 0;
  };
  static constexpr double FromNear = -1.0e300; ///< a Begin: at the near plane
  static constexpr double ToEnd = 1.0e300;     ///< an End: where the ray ends anyway

  /// Begins. `whole`: of each volume alone, per ray, the colours of the whole ray. Rays that only
  /// one volume contributes to end at once.
  MixedRays(const Options& options, const std::vector<std::vector<float>>& whole);

  bool IsDone() const { return this->Active.empty(); }
  /// The stretch that has to be drawn next of each ray; of those that are done nothing.
  std::vector<Stretch> Next() const;
  /// What was drawn of that, for each volume; empty: it shows nothing.
  void Take(const std::vector<std::vector<float>>& drawn);
  /// Of rays that aren't done: their whole mixed as one stretch.
  const std::vector<float>& Colors() const { return this->Result; }
  std::uint64_t Rounds() const { return this->Rounds_; }

  /// What rays take of main memory.
  static std::uint64_t BytesPerRay(std::size_t volumes);

private:
  enum class Phase : std::uint8_t
  {
    Before,     ///< in front of the zone
    FirstHalf,  ///< of a stretch
    SecondHalf, ///< likewise
    Behind      ///< behind the zone
  };
  struct Ray
  {
    double At = 0;
    double Length = 0; ///< of the stretch
    MixedColor Color{};
    Phase State = Phase::Before;
  };
  double EndOf(const Ray& ray) const;
  double MiddleOf(const Ray& ray) const;
  void Add(std::uint32_t index, const MixedColor& color);
  bool Decide(std::uint32_t index, Ray& ray, const MixedColor* second);
  void Finish(std::uint32_t index);

  Options Choice;
  std::size_t Volumes;
  std::vector<Ray> Rays;
  std::vector<MixedColor> FirstHalves; ///< volumes together, ray after ray
  std::vector<std::uint32_t> Active;
  std::vector<float> Result;
  std::uint64_t Rounds_ = 0;
};

} // namespace teravox
