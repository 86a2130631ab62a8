// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "TruthMath.h"

#include <array>
#include <cmath>
#include <cstddef>

namespace teravox
{

/// Gauss-Legendre nodes on (0, 1) with weights, and the matrix that integrates the interpolant from
/// 0 to each node. Used on the pair tau' = sigma, C' = c sigma exp(-tau) it is the Gauss
/// collocation method, of order 2 N.
template <std::size_t N>
struct TruthGaussRule
{
  std::array<double, N> Nodes{};
  std::array<double, N> Weights{};
  std::array<std::array<double, N>, N> Partial{}; ///< integral of basis function j from 0 to node i

  TruthGaussRule();
  static const TruthGaussRule& Get();
};

extern template struct TruthGaussRule<4>;
extern template struct TruthGaussRule<8>;

/// Emission and attenuation at a point.
struct TruthMedium
{
  double Sigma = 0; ///< per unit of the parameter that is integrated over
  Double3 Color{};
};

/// Light of a piece of a ray, as it leaves the near end of the piece.
struct TruthLight
{
  double Tau = 0;
  Double3 Color{}; ///< premultiplied
};

/// One application of a rule on [lower, upper]. `medium(s)` gives a TruthMedium.
template <std::size_t N, typename Medium>
TruthLight ApplyRule(const Medium& medium, double lower, double upper)
{
  const TruthGaussRule<N>& rule = TruthGaussRule<N>::Get();
  const double length = upper - lower;
  std::array<TruthMedium, N> samples{};
  for (std::size_t i = 0; i < N; ++i)
  {
    samples[i] = medium(lower + length * rule.Nodes[i]);
  }
  TruthLight light;
  for (std::size_t i = 0; i < N; ++i)
  {
    double tau = 0;
    for (std::size_t j = 0; j < N; ++j)
    {
      tau += rule.Partial[i][j] * samples[j].Sigma;
    }
    const double weight = length * rule.Weights[i] * samples[i].Sigma;
    const double arriving = weight * std::exp(-length * tau);
    light.Tau += weight;
    light.Color = light.Color + arriving * samples[i].Color;
  }
  return light;
}

/// Adaptive: appends the light of [lower, upper] to `light`, to an absolute tolerance. Singular
/// points and kinks may lie at the ends; kinks inside cost work, and accuracy where they lie next
/// to an end.
template <typename Medium>
void IntegrateMedium(const Medium& medium, double lower, double upper, double tolerance,
  TruthLight& light, int depth = 0)
{
  const TruthLight coarse = ApplyRule<4>(medium, lower, upper);
  const TruthLight fine = ApplyRule<8>(medium, lower, upper);
  double difference = std::fabs(fine.Tau - coarse.Tau) * std::exp(-std::fmin(fine.Tau, coarse.Tau));
  for (std::size_t c = 0; c < 3; ++c)
  {
    difference = std::fmax(difference, std::fabs(fine.Color[c] - coarse.Color[c]));
  }
  // The difference is the error of the coarse rule (order 8); that of the fine one (order 16) goes
  // like its square where the medium is smooth, of which 3/2 is a cautious form.
  const double transmittance = std::exp(-light.Tau);
  const double error = transmittance * std::fmin(difference, std::pow(100 * difference, 1.5));
  const double middle = 0.5 * (lower + upper);
  // A very dense piece hides its light from both rules, which then agree on nothing: halve it
  // first.
  const bool dense = fine.Tau > 3 && transmittance > tolerance;
  if ((dense || error > tolerance) && depth < 60 && middle > lower && middle < upper)
  {
    IntegrateMedium(medium, lower, middle, tolerance, light, depth + 1);
    IntegrateMedium(medium, middle, upper, tolerance, light, depth + 1);
    return;
  }
  light.Color = light.Color + transmittance * fine.Color;
  light.Tau += fine.Tau;
}

} // namespace teravox
