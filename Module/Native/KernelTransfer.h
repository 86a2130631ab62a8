// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// The tables of the transfer function (see TransferTable and Shaders/Library/Transfer.glsl), for
// one lane or eight.

template <typename F>
struct Sample
{
  F X;     // position in nodes
  F S;     // extinction
  F Slope; // of the extinction, per node
  F High;  // integral up to here, a pair of floats
  F Low;
};

// What the kernel reads of the tables, loaded once per tile.
struct Transfer
{
  const float* Integrals;
  const float* Colors; // words of two 16-bit numbers
  const std::uint16_t* Occupied;
  const float* Extremes; // pairs
  const float* Variation;
  std::int32_t Blocks;
  std::int32_t ExtremesBlock;
  float Low;
  float LowRest;
  float NodesPerUnit;
  float Nodes;
};

// Position in nodes of a data value given as a float pair.
inline float TransferPosition(const Transfer& t, float valueHigh, float valueLow)
{
  return ((valueHigh - t.Low) + (valueLow - t.LowRest)) * t.NodesPerUnit;
}

// The node before a position, and how far behind it the position is; beyond the first and the last
// node the function is constant.
template <typename F>
TERAVOX_INLINE auto NodeBefore(const Transfer& t, F position, F& fraction)
{
  const F zero = F{};
  const F x = Min(Max(position, zero), zero + (t.Nodes - 1.0f));
  const auto i = Truncate(Min(x, zero + (t.Nodes - 2.0f)));
  fraction = x - ToFloat(i);
  return i;
}

// Where an interval has a jump, each of its sides has the value of its node.
template <typename F, typename I, typename Mask>
__attribute__((noinline)) void SetBesideJump(
  const Transfer& t, I i, F f, Mask jumps, const F (&node)[4], Sample<F>& r)
{
  F colors[4];
  LoadFour(t.Colors, i, colors);
  const F at = colors[3];
  const F s = Select(f <= at, node[2], -node[3]);
  const F beyond = r.X - (ToFloat(i) + f);
  const F before = Min(f, at) * node[2] - Max(f - at, F{}) * node[3];
  r.S = Select(jumps, s, r.S);
  r.Slope = Select(jumps, F{}, r.Slope);
  r.Low = Select(jumps, node[1] + (before + beyond * s), r.Low);
}

template <typename F>
TERAVOX_INLINE Sample<F> SampleTransfer(const Transfer& t, F position)
{
  F f;
  const auto i = NodeBefore(t, position, f);
  F node[4];
  LoadFour(t.Integrals, i, node);
  const F slope = node[3] - node[2];
  const F s = node[2] + f * slope;
  Sample<F> r;
  r.X = position;
  r.S = s;
  r.Slope = Select(position == ToFloat(i) + f, slope, F{});
  r.High = node[0];
  r.Low = node[1] + (f * (node[2] + 0.5f * f * slope) + (position - (ToFloat(i) + f)) * s);
  const auto jumps = AsInt(node[3]) < 0;
  if (Bits(jumps) != 0)
  {
    SetBesideJump(t, i, f, jumps, node, r);
  }
  return r;
}

template <typename F>
struct Color
{
  F Red;
  F Green;
  F Blue;
};

// `fraction` on the way to the next node: beside a jump 0 or 1.
template <typename F>
TERAVOX_INLINE F ColorBetween(F word, F fraction, F& slope)
{
  const auto bits = AsInt(word);
  const F a = ToFloat(bits & 0xffff);
  slope = (ToFloat((bits >> 16) & 0xffff) - a) * (1.0f / 65535.0f);
  return a * (1.0f / 65535.0f) + fraction * slope;
}

// The colour at a position, and how it changes per node.
template <typename F>
TERAVOX_INLINE Color<F> TransferColor(const Transfer& t, F position, Color<F>& slope)
{
  F f;
  const auto i = NodeBefore(t, position, f);
  F node[4];
  LoadFour(t.Colors, i, node);
  const auto jumps = node[3] <= 1.0f;
  const bool any = Bits(jumps) != 0;
  if (any)
  {
    f = Select(jumps, Select(f <= node[3], F{}, F{} + 1.0f), f);
  }
  const Color<F> color{ ColorBetween(node[0], f, slope.Red), ColorBetween(node[1], f, slope.Green),
    ColorBetween(node[2], f, slope.Blue) };
  if (any)
  {
    slope.Red = Select(jumps, F{}, slope.Red);
    slope.Green = Select(jumps, F{}, slope.Green);
    slope.Blue = Select(jumps, F{}, slope.Blue);
  }
  return color;
}

template <typename F>
TERAVOX_INLINE Color<F> TransferColor(const Transfer& t, F position)
{
  Color<F> slope;
  return TransferColor(t, position, slope);
}

template <typename F>
TERAVOX_INLINE Color<F> Mix(const Color<F>& a, const Color<F>& b, F weight)
{
  return { a.Red + weight * (b.Red - a.Red), a.Green + weight * (b.Green - a.Green),
    a.Blue + weight * (b.Blue - a.Blue) };
}

// A colour and what is to be added, as far as that leaves a colour.
template <typename F>
TERAVOX_INLINE Color<F> Moved(const Color<F>& a, const Color<F>& by)
{
  const F zero = F{};
  const F one = zero + 1.0f;
  return { Min(Max(a.Red + by.Red, zero), one), Min(Max(a.Green + by.Green, zero), one),
    Min(Max(a.Blue + by.Blue, zero), one) };
}

template <typename F>
TERAVOX_INLINE F Difference(const Color<F>& a, const Color<F>& b)
{
  return Max(Max(Abs(a.Red - b.Red), Abs(a.Green - b.Green)), Abs(a.Blue - b.Blue));
}

template <typename F>
TERAVOX_INLINE Color<F> Times(const Color<F>& c, F factor)
{
  return { c.Red * factor, c.Green * factor, c.Blue * factor };
}

// True if the table is exactly 0 between two positions (contract 1e). The margin covers the
// rounding of interpolated values.
inline bool IsEmptyBetween(const Transfer& t, float from, float to)
{
  const float first = Min(Max(from + 0.98f, 0.0f), t.Nodes);
  const float last = Min(Max(to + 1.02f, 0.0f), t.Nodes);
  return static_cast<float>(t.Occupied[static_cast<std::int32_t>(first)]) > last;
}
TERAVOX_INLINE Ints IsEmptyBetween(const Transfer& t, Floats from, Floats to)
{
  const Floats zero = {};
  const Floats nodes = Splat(t.Nodes);
  const Floats first = Min(Max(from + 0.98f, zero), nodes);
  const Floats last = Min(Max(to + 1.02f, zero), nodes);
  alignas(32) std::int32_t at[Lanes];
  Spill(Truncate(first) * 2, at);
  const Ints word = GatherWords(reinterpret_cast<const std::uint8_t*>(t.Occupied), at);
  return ToFloat(word & 0xffff) > last;
}

// Bounds of the extinction between two positions in nodes.
inline void ExtremesBetween(const Transfer& t, float from, float to, float& least, float& largest)
{
  const auto block = [&](float position)
  {
    const float x = Min(Max(position, 0.0f), t.Nodes - 1.0f);
    return Min(static_cast<std::int32_t>(x) / t.ExtremesBlock, t.Blocks - 1);
  };
  const std::int32_t first = block(from);
  const std::int32_t count = block(to) - first + 1;
  const int level = 31 - __builtin_clz(static_cast<unsigned>(Max(count, 1)));
  const float* a = t.Extremes + 2 * (static_cast<std::ptrdiff_t>(level) * t.Blocks + first);
  const float* z = a + 2 * (Max(count, 1) - (1 << level));
  least = Min(a[0], z[0]);
  largest = Max(a[1], z[1]);
}

// How far the colour moves between two positions in nodes, from <= to.
inline float VariationBetween(const Transfer& t, float from, float to)
{
  const auto at = [&](float position)
  {
    float f = 0;
    const std::int32_t i = NodeBefore(t, position, f);
    return t.Variation[i] + f * (t.Variation[i + 1] - t.Variation[i]);
  };
  return at(to) - at(from);
}

// 1 - exp(-depth), without cancellation.
template <typename F>
TERAVOX_INLINE F OpacityOf(F depth)
{
  const F small = depth * (1.0f - depth * (0.5f - depth * (0.16666667f - depth * 0.041666667f)));
  return Select(depth < 0.03f, small, 1.0f - ExpOfMinus(depth));
}

// Where along a piece, from 0 at its front to 1, its light comes from: the first moment of
// s(u) exp(-depth so far) for a linear s. Exact to the first order of the depth, with coefficients
// fitted to the integral: off by 0.0035 at most up to a depth of 4, 0.028 up to 12.
template <typename F>
TERAVOX_INLINE F CentroidOf(F sFront, F sBack, F depth)
{
  const F zero = F{};
  const F sum = sFront + sBack;
  const F front = Select(sum > 0.0f, sFront / Max(sum, zero + 1.0e-37f), zero + 0.5f);
  const F d = Min(depth, zero + 100.0f);
  const F thin = (2.0f - front) * 0.33333333f;
  const F n = 0.147802f - front * (0.264173f - front * 0.122512f);
  const F m = 0.028545f + front * (0.046648f - front * 0.034667f);
  return thin * thin * (1.0f + n * d) /
    (thin * (1.0f + d * (n + m * d)) + d * (1.0f + front * (1.0f - front)) * 0.066666667f);
}
