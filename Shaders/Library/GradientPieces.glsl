// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Opacity by gradient over a piece of a ray: of each half of it the extinction alone is known
// exactly in the mean; what the two make together is taken from the ends of the piece and its
// middle. Where they may do something else in between, it is an error of the mean.
#if !TERAVOX_NEAREST && !TERAVOX_FIXED_STEP
#if TERAVOX_GRADIENT_OPACITY || TERAVOX_PLANE

// Of the optical depth: through a dense piece light comes where gradients leave nothing.
const float DENSE_WEIGHT = 2.0;

// The least magnitude on the line between two gradients.
float LeastBetween(vec3 a, vec3 b)
{
  vec3 d = b - a;
  float along = clamp(-dot(a, d) / max(dot(d, d), 1.0e-30), 0.0, 1.0);
  return length(a + along * d);
}

// How far the gradient may be from a line between the middle of a piece and its ends: at most an
// eighth of the second derivative of its cubics times the square of half the size, in nodes.
// `scale`: nodes per unit of the gradient.
float GradientBend(Gradient g, vec3 scale, float from, float to)
{
  vec3 second = vec3(g.x.z, g.y.z, g.z.z) * scale;
  vec3 third = vec3(g.x.w, g.y.w, g.z.w) * scale * 3.0;
  float size = to - from;
  return max(length(second + third * from), length(second + third * to)) * (0.0625 * size * size);
}

// Where in a piece of this depth light is gathered isn't known better than to this share of it, if
// the opacity may change by a share of `varied`: a dense one begins where gradients leave something.
float FrontError(float depth, float varied)
{
  float thick = min(depth * (1.0 / OPAQUE_DEPTH), 1.0);
  return varied * thick * thick;
}

// How far off the opacity of a piece may be, whose optical depth may be so by `change`.
float LostOpacity(float depth, float opacity, float change)
{
  float off = change * (1.0 + DENSE_WEIGHT * min(depth * (1.0 / OPAQUE_DEPTH), 1.0));
  float less = opacity - OpacityOf(max(depth - off, 0.0));
  return max(less, min(change, 1.0) * (1.0 - opacity));
}
#endif

#if TERAVOX_GRADIENT_OPACITY

// Shares of what is seen that are taken as the error of a mean: of the difference between Simpson's
// rule and the trapezoidal one; of the deviation of the opacity between two places from what the
// slopes at them say; of what it may do at magnitudes that no place has seen; of extinction of
// which it isn't known where in half a piece it is, and that the opacity changes there.
const float PRODUCT_RULE_WEIGHT = 0.25;
const float PRODUCT_KINK_WEIGHT = 0.25;
const float PRODUCT_UNSEEN_WEIGHT = 0.25;
const float PRODUCT_PLACE_WEIGHT = 0.5;

float GradientMoved(vec4 table, float x)
{
  float fraction;
  vec4 node = GradientNode(table, x, fraction);
  return node.y + fraction * (node.w - node.y);
}

// Of half a piece, from its outer end to its inner one: x: the extinction's exact mean less that of
// the parabola through the ends and the middle of the piece, for which the opacity is that in the
// middle of the half, y. z: the change of the opacity; w: how far it may be from what its ends say.
vec4 HalfOf(float mean, float outer, float inner, float other, SampledGradient a, SampledGradient b)
{
  precise float rest = mean - ((5.0 * outer - other) + 8.0 * inner) * (1.0 / 12.0);
  precise float opacity = 0.5 * (a.opacity + b.opacity);
  float chord = b.opacity - a.opacity;
  float dx = b.magnitude - a.magnitude;
  return vec4(rest, opacity, abs(chord), max(abs(a.slope * dx - chord), abs(chord - b.slope * dx)));
}

// What the mean extinction of a piece and its error become. `first`, `last`: both of its halves;
// `s`: the extinction at the ends and in the middle; `uneven`: of the whole piece, how far its mean
// is from that of the ends; `bend`: see GradientBend(). Returns how far the
// opacity may change there, as a share of the largest.
float Attenuate(vec4 table, vec2 first, vec2 last, vec3 s, float uneven, SampledGradient a,
  SampledGradient m, SampledGradient b, float bend, inout float mean, out float change)
{
  precise vec3 g = vec3(a.opacity, m.opacity, b.opacity);
  precise vec3 product = s * g;
  vec4 front = HalfOf(first.x, s.x, s.y, s.z, a, m);
  vec4 back = HalfOf(last.x, s.z, s.y, s.x, b, m);
  precise float all_ = 0.5 * (first.x + last.x);
  precise float bySimpson = ((product.x + product.z) + 4.0 * product.y) * (1.0 / 6.0) +
    0.5 * (front.x * front.y + back.x * back.y);
  float byTrapezoid = ((product.x + product.z) + 2.0 * product.y) * 0.25 +
    0.5 * ((first.x - 0.5 * (s.x + s.y)) * front.y + (last.x - 0.5 * (s.y + s.z)) * back.y);
  float least = min(g.x, min(g.y, g.z));
  float largest = max(g.x, max(g.y, g.z));
  float from =
    min(LeastBetween(a.gradient, m.gradient), LeastBetween(m.gradient, b.gradient)) - bend;
  float to = max(a.magnitude, max(m.magnitude, b.magnitude)) + bend;
  float unseen = max(GradientMoved(table, to) - GradientMoved(table, from) - (largest - least), 0.0);
  precise float attenuated = clamp(bySimpson, all_ * least, all_ * largest);
  float changed = 0.5 * (first.y + last.y) * min(largest + unseen, 1.0) +
    PRODUCT_RULE_WEIGHT * abs(bySimpson - byTrapezoid) +
    (0.5 * PRODUCT_PLACE_WEIGHT) *
      (abs(front.x) * (front.z + front.w + unseen) + abs(back.x) * (back.z + back.w + unseen)) +
    all_ * ((0.5 * PRODUCT_KINK_WEIGHT) * (front.w + back.w) + PRODUCT_UNSEEN_WEIGHT * unseen);
  // Where the ends, and what lies between them, see nothing there is nothing, as for those who skip
  // it. The mean alone doesn't say so: what the field's bend takes from it may leave nothing.
  bool any_ = (s.x + s.z) + uneven > 0.0;
  mean = any_ ? attenuated : 0.0;
  change = any_ ? changed : 0.0;
  float most = largest + unseen;
  return (most - least) / max(most, 1.0e-30);
}
#endif
#endif
