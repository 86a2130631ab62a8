// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// What a piece of a ray through several components adds. Each component's extinction is known
// exactly in the mean, from its integral table; all that the components do together at the ends and
// in the middle. Where the two disagree, or light changes between the three, it may err.
#if TERAVOX_COMPONENTS && !TERAVOX_NEAREST && !TERAVOX_BLEND

// Share of the second difference of colours at the ends and in the middle that is taken as an error
// (a kink anywhere between them makes 0.085 at most), and of lit ones, which bend more.
const float COLOR_BEND = 0.1;
const float LIT_BEND = 0.2;
// Of the difference between two rules for what components do together.
const float RULE_WEIGHT = 0.5;
// Of the difference between a component's mean and what three places make of it: where it lies in
// the piece isn't known.
const float UNSEEN_PLACE = 0.25;
// Of light: less makes no difference.
const float LEAST_CHANGE = 1.0e-6;

// Of the extinction of each emitter, the mean and how much that may be off; how far opacities by
// gradient may change, as a share of the largest.
struct Means
{
  float varied;
  float mean[EMITTERS];
  float change[EMITTERS];
};

vec3 LightPerExtinction(Point p, vec3 else_)
{
  return p.kappa > LEAST_KAPPA ? p.light * (1.0 / p.kappa) : else_;
}

// Where between two ends, as a share of the optical depth between them, light comes from, less a
// half: 1/d - 1/(exp(d) - 1) - 1/2.
float FrontShare(float depth, float opacity)
{
  float d = max(depth, 0.03);
  float thick = 1.0 / d - (1.0 - opacity) / max(opacity, 0.01) - 0.5;
  return depth < 0.03 ? depth * (-1.0 / 12.0) : thick;
}

float BrightestOf(vec3 v)
{
  return max(v.x, max(v.y, v.z));
}

// How light changes from `from` to `to`, of which `middle` is the middle.
float BendOf(vec3 from, vec3 middle, vec3 to)
{
  return BrightestOf(abs((from - middle) + (to - middle)));
}

#if TERAVOX_SHADE
float TurnedBetween(vec3 a, vec3 b)
{
  float turned = a != vec3(0.0) && b != vec3(0.0) ? 1.0 - dot(a, b) : 0.0;
  return turned * turned;
}
#endif

struct Piece
{
  float opacity;
  vec3 color;
  vec2 error; // per transmittance: of what is behind; per opacity: of its own light
};

Piece Combine(Point a, Point m, Point b, Means means, float turned[EMITTERS], float length_)
{
  float simpson[EMITTERS];
  float trapezoid[EMITTERS];
  precise vec3 emission = vec3(0.0); // mean, of the piece
  float unseen = 0.0;                // of all extinctions
  float unseenLight = 0.0;
  float bent = 0.0; // light that may be of another colour
  float all_ = 0.0;
  float most = 0.0;
  float changed = 0.0;
  float perWeight = 0.0;
  for (int e = 0; e < EMITTERS; ++e)
  {
    int c = FIRST_EMITTER + e;
    float sa = a.left[e];
    float sm = m.left[e];
    float sb = b.left[e];
    simpson[e] = ((sa + sb) + 4.0 * sm) * (1.0 / 6.0);
    trapezoid[e] = ((sa + sb) + 2.0 * sm) * 0.25;
    // The colour of its light: weighted as the three places say, evenly where they see nothing.
    bool seen = simpson[e] > 0.0;
    vec3 weights = (seen ? vec3(sa, 4.0 * sm, sb) / simpson[e] : vec3(1.0, 4.0, 1.0)) * (1.0 / 6.0);
    float mean = means.mean[e];
    float light = mean * WeightOf(c);
    emission += light * ((weights.x * a.own[e] + weights.z * b.own[e]) + weights.y * m.own[e]);
    float missed = abs(mean - simpson[e]);
    unseen += missed;
    float moves =
      max(BrightestOf(abs(m.own[e] - a.own[e])), BrightestOf(abs(b.own[e] - m.own[e])));
    unseenLight += WeightOf(c) * missed * moves;
#if TERAVOX_SHADE
    bent += light * (BendOf(a.own[e], m.own[e], b.own[e]) * LIT_BEND + NORMAL_WEIGHT * turned[e]);
#else
    bent += light * BendOf(a.own[e], m.own[e], b.own[e]) * COLOR_BEND;
#endif
    float larger = max(mean, simpson[e]);
    all_ += larger;
    most = max(most, larger);
    changed += means.change[e] * PerWeight(c);
    perWeight = max(perWeight, PerWeight(c));
  }
  precise float kappa = TogetherOf(means.mean);
#if !TERAVOX_DEPENDENT
  // What components do together, beyond what their means do; of a piece with one of them nothing.
  precise float bySimpson =
    ((a.kappa + b.kappa) + 4.0 * m.kappa) * (1.0 / 6.0) - TogetherOf(simpson);
  precise float byTrapezoid = ((a.kappa + b.kappa) + 2.0 * m.kappa) * 0.25 - TogetherOf(trapezoid);
  kappa = max(kappa + bySimpson, 0.0);
  changed = 2.0 * changed + RULE_WEIGHT * abs(bySimpson - byTrapezoid) +
    (2.0 * perWeight) * min(unseen, max(all_ - most, 0.0));
#endif
  precise float depth = kappa * length_;
  float opacity = OpacityOf(depth);
  float largest = LargestLight();
  precise vec3 even =
    kappa > LEAST_KAPPA ? clamp(emission * (1.0 / kappa), 0.0, largest) : vec3(0.0);
  vec3 first = LightPerExtinction(a, even);
  vec3 middle = LightPerExtinction(m, even);
  vec3 last = LightPerExtinction(b, even);
  // The front of the piece hides its back. The nearer the mean over the optical depth is to one of
  // the ends, the more of the depth has its light: all of it behind the front of a wall.
  vec3 change = last - first;
  vec3 changes = step(vec3(LEAST_CHANGE), abs(change));
  vec3 moved = changes * (4.0 * max((even - first) * (last - even), vec3(0.0))) /
    mix(vec3(1.0), change, changes);
  precise vec3 color = clamp(even + moved * FrontShare(depth, opacity), 0.0, largest);

  float thick = min(depth * (1.0 / OPAQUE_DEPTH), 1.0);
  float deep = min(depth, 1.0);
  float perKappa = 1.0 / max(kappa, 1.0e-30);
  float slope = BrightestOf(abs(last - first));
  float bend = BendOf(first, middle, last);
  float uneven = min(unseen / max(all_, 1.0e-30), 1.0);
  float brightest = BrightestOf(color);
  float shift = (bent + unseenLight) * perKappa +
    (max(OPAQUE_PLACE, means.varied) * thick * thick + UNSEEN_PLACE * uneven * deep) *
      (slope + bend) +
    LIGHT_BEND_WEIGHT * 0.25 * deep * bend + brightest * deep * min(changed * perKappa, 1.0);
#if TERAVOX_GRADIENT_OPACITY && !TERAVOX_FIXED_STEP
  float lost = LostOpacity(depth, opacity, changed * length_);
#else
  float lost = min(changed * length_, 1.0) * (1.0 - opacity);
#endif
  return Piece(opacity, color, vec2(lost * max(1.0, brightest), min(shift, largest)));
}
#endif
