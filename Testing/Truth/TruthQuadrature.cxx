// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "TruthQuadrature.h"

namespace teravox
{
namespace
{

/// Legendre polynomial P_n and its derivative at x in (-1, 1).
void Legendre(std::size_t n, long double x, long double& value, long double& derivative)
{
  long double previous = 1;
  value = x;
  for (std::size_t k = 2; k <= n; ++k)
  {
    const auto m = static_cast<long double>(k);
    const long double next = ((2 * m - 1) * x * value - (m - 1) * previous) / m;
    previous = value;
    value = next;
  }
  derivative = static_cast<long double>(n) * (x * value - previous) / (x * x - 1);
}

} // namespace

template <std::size_t N>
TruthGaussRule<N>::TruthGaussRule()
{
  for (std::size_t i = 0; i < N; ++i)
  {
    const long double pi = 3.141592653589793238462643383279503L;
    long double x =
      -std::cos(pi * (static_cast<long double>(i) + 0.75L) / (static_cast<long double>(N) + 0.5L));
    long double value = 0;
    long double derivative = 1;
    for (int iteration = 0; iteration < 20; ++iteration)
    {
      Legendre(N, x, value, derivative);
      x -= value / derivative;
    }
    Legendre(N, x, value, derivative);
    this->Nodes[i] = static_cast<double>((x + 1) / 2);
    this->Weights[i] = static_cast<double>(1 / ((1 - x * x) * derivative * derivative));
  }
  // The basis polynomials have degree N - 1, which the rule itself integrates exactly.
  for (std::size_t i = 0; i < N; ++i)
  {
    for (std::size_t j = 0; j < N; ++j)
    {
      double sum = 0;
      for (std::size_t k = 0; k < N; ++k)
      {
        double basis = 1;
        for (std::size_t m = 0; m < N; ++m)
        {
          if (m != j)
          {
            basis *= (this->Nodes[i] * this->Nodes[k] - this->Nodes[m]) /
              (this->Nodes[j] - this->Nodes[m]);
          }
        }
        sum += this->Weights[k] * basis;
      }
      this->Partial[i][j] = this->Nodes[i] * sum;
    }
  }
}

template <std::size_t N>
const TruthGaussRule<N>& TruthGaussRule<N>::Get()
{
  static const TruthGaussRule rule;
  return rule;
}

template struct TruthGaussRule<4>;
template struct TruthGaussRule<8>;

} // namespace teravox
