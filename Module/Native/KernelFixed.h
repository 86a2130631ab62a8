// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Steps of a given length (see Shaders/Library/MarchFixed.glsl): what a user who switches error
// control off gets, and what the order of convergence is measured with.

template <typename T, bool Shade>
void IntegrateFixed(
  Context& c, State& state, const Ray& ray, const BrickView& view, float t0, float t1)
{
  const float step = c.P.Step[0] / ray.World;
  const Walk w = BeginWalk(ray, view, 0.5f, t1);
  float t = t0;
  while (t < t1)
  {
    float begins[Lanes];
    float ends[Lanes];
    int count = 0;
    for (; count < Lanes && t < t1; ++count)
    {
      // t is often a multiple itself, and t / step may be rounded to just below it.
      const float cut = __builtin_floorf(t / step);
      float next = (cut + 1.0f) * step;
      next = next > t ? next : (cut + 2.0f) * step;
      next = next > t ? Min(next, t1) : t1;
      begins[count] = t;
      ends[count] = next;
      t = next;
    }
    for (int l = count; l < Lanes; ++l)
    {
      begins[l] = ends[l] = t;
    }
    Floats begin;
    Floats end;
    __builtin_memcpy(&begin, begins, sizeof(begin));
    __builtin_memcpy(&end, ends, sizeof(end));
    const Floats length = end - begin;
    const Places front = PlacesAt<T>(c, view, w, begin);
    const Places back = PlacesAt<T>(c, view, w, end);
    Sample<Floats> a = SampleTransfer(c.Table, front.Node);
    Sample<Floats> b = SampleTransfer(c.Table, back.Node);
    Floats mean = MeanExtinction(a, b, Floats{}, Floats{}).Mean;
    Color<Floats> colorA = TransferColor(c.Table, a.X);
    Color<Floats> colorB = TransferColor(c.Table, b.X);
#if TERAVOX_GRADIENT_PLANE
    if (c.Plane.Nodes != nullptr)
    {
      const auto at = [&](const Places& place, const Sample<Floats>& s)
      {
        const GradientSample<Floats> gradient = GradientAt<T>(c, view, place);
        return SamplePlane(c.Plane, c.Gradient, s.X, gradient.Magnitude);
      };
      c.Report.Gradients += static_cast<std::uint64_t>(2 * count);
      const PlaneSample<Floats> before = at(front, a);
      const PlaneSample<Floats> behind = at(back, b);
      a.S = before.S;
      b.S = behind.S;
      mean = 0.5f * (a.S + b.S);
      colorA = before.Value;
      colorB = behind.Value;
    }
#endif

#if TERAVOX_GRADIENT_OPACITY
    if (c.Plane.Nodes == nullptr && Bits(mean > 0.0f) != 0)
    {
      c.Report.Gradients += static_cast<std::uint64_t>(2 * count);
      const Floats before = GradientAt<T>(c, view, front).Opacity;
      const Floats behind = GradientAt<T>(c, view, back).Opacity;
      // What the ends say of both together, and for the rest of the extinction the mean opacity.
      const Floats unseen = mean - 0.5f * (a.S + b.S);
      a.S = a.S * before;
      b.S = b.S * behind;
      mean = Max(0.5f * (a.S + b.S) + unseen * (0.5f * (before + behind)), Floats{});
    }
#endif
    Floats depth = mean * (length * ray.World);
    depth = Select((a.X == a.X) & (b.X == b.X), depth, Floats{});
    const Floats opacity = OpacityOf(depth);
    const Floats gathered = CentroidOf(a.S, b.S, depth);
    Color<Floats> color = Mix(colorA, colorB, gathered);
    const unsigned seen = Bits(depth > 0.0f) & ((1u << count) - 1u);
    c.Report.Evaluated += static_cast<std::uint64_t>(count);
    if (Shade && seen != 0)
    {
      c.Report.Gradients += static_cast<std::uint64_t>(__builtin_popcount(seen));
      const Floats at = begin + length * gathered;
      const Places gatheredAt = PlacesAt<T>(c, view, w, at);
      color = LitColor(c.P, color, NormalAt<T>(c, view, gatheredAt), c.Light, at);
    }
    Quad colors[Lanes];
    ToQuads(color, opacity, colors);
    for (int l = 0; l < count; ++l)
    {
      c.Contributing += depth[l] > 0.0f ? 1 : 0;
      Accumulate(state, opacity[l], colors[l]);
      if (IsOver(c, state))
      {
        return;
      }
    }
    c.Steps += static_cast<std::uint32_t>(count);
    c.Samples += static_cast<std::uint64_t>(count);
  }
}
