// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Opacity and colour over the value and the gradient's magnitude, from a table of nodes
// (TransferPlane, Shaders/Library/TransferPlane.glsl). The transfer table is an upper bound of its
// extinction then: what is empty there is exactly 0 here.

// -ln(1 - opacity), without cancellation; of 1 it is 87.
template <typename F>
TERAVOX_INLINE F DepthOf(F opacity)
{
  // As in PowerOf().
  const F one = F{} + 1.0f;
  const auto bits = AsInt(Max(one - opacity, F{} + 1.2e-38f)) - 0x3f3504f3;
  const F e = ToFloat(bits >> 23);
  const F m = AsFloat((bits & 0x7fffff) + 0x3f3504f3);
  const F f = Select(e == F{}, opacity, one - m) / (one + m);
  const F s = f * f;
  const F series = f * (2.0f + s * (0.66666667f + s * (0.4f + s * (0.28571429f + s * 0.24f))));
  return series - e * 0.69314718f;
}

template <typename F>
struct PlaneSample
{
  F S; // extinction
  Color<F> Value;
};

// In columns, of a position in nodes of the transfer table.
template <typename F>
TERAVOX_INLINE F ColumnOf(const PlaneTable& plane, F position)
{
  return Min(Max(position * plane.Scale[0][0] + plane.Scale[0][1], F{}), F{} + plane.Scale[0][2]);
}

// `row`: a magnitude in rows, at least 0.
template <typename F>
TERAVOX_INLINE PlaneSample<F> SamplePlane(
  const PlaneTable& plane, const GradientOpacityTable& gradient, F position, F row)
{
  const F x = ColumnOf(plane, position);
  const F y = Min(row, F{} + gradient.Scale[3]);
  const auto i = Truncate(Min(x, F{} + (plane.Scale[0][2] - 1.0f)));
  const auto j = Truncate(Min(y, F{} + (gradient.Scale[3] - 1.0f)));
  const F u = x - ToFloat(i);
  const F v = y - ToFloat(j);
  const auto first = i + j * plane.Columns;
  F a[4];
  F b[4];
  F c[4];
  F d[4];
  LoadFour(plane.Nodes, first, a);
  LoadFour(plane.Nodes, first + 1, b);
  LoadFour(plane.Nodes, first + plane.Columns, c);
  LoadFour(plane.Nodes, first + (plane.Columns + 1), d);
  F mixed[4];
  for (int k = 0; k < 4; ++k)
  {
    const F near = a[k] + u * (b[k] - a[k]);
    mixed[k] = near + v * ((c[k] + u * (d[k] - c[k])) - near);
  }
  // Rounding must leave an opacity.
  const F opacity = Min(Max(mixed[3], F{}), F{} + 1.0f);
  const F s = Min(DepthOf(opacity) * plane.Scale[1][0], F{} + plane.Scale[1][1]);
  return { Select(opacity < F{} + 1.0f, s, F{} + plane.Scale[1][1]),
    { mixed[0], mixed[1], mixed[2] } };
}

// How far extinction and colour may move between two columns and two rows, from <= to.
struct PlaneReach
{
  Floats Extinction;
  Floats Largest; // of the extinction
  Floats Color;
};
TERAVOX_INLINE PlaneReach ReachOf(const PlaneTable& plane, const GradientOpacityTable& gradient,
  Floats left, Floats right, Floats low, Floats high)
{
  const Floats wide = Max(right - left, Floats{});
  const Floats tall = Max(high - low, Floats{});
  // The first level whose blocks are twice as large.
  const Floats most = Max(Max(wide, tall), Splat(1.0f));
  const Ints level =
    Min(((AsInt(most) - 1) >> 23) - 126, Splat(static_cast<std::int32_t>(plane.Scale[0][3]) - 1));
  const Ints x = Truncate(Min(left, Splat(plane.Scale[0][2] - 1.0f)));
  const Ints y = Truncate(Min(low, Splat(gradient.Scale[3] - 1.0f)));
  Ints at;
  for (int l = 0; l < Lanes; ++l)
  {
    const std::int32_t width = ((plane.Columns - 2) >> level[l]) + 1;
    at[l] = plane.First[level[l]] + (x[l] >> level[l]) + (y[l] >> level[l]) * width;
  }
  Floats bounds[4];
  LoadFour(plane.Bounds, at, bounds);
  return { Min(bounds[1] * wide + bounds[2] * tall, bounds[0]), bounds[0],
    Min(bounds[3] * (wide + tall), Splat(1.0f)) };
}
