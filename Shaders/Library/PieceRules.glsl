// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// What pieces of a ray through a cell have in common, of one component or several: where cubics
// turn, how what isn't known is weighted as an error.
#if !TERAVOX_BLEND && !TERAVOX_NEAREST

const float SMALLEST_PIECE = 1.0 / 512.0; // of a cell

// Where in a piece of an optical depth of OPAQUE_DEPTH and more light is gathered isn't known better
// than to this share of the piece: the front of the extinction decides.
const float OPAQUE_PLACE = 0.35;
const float OPAQUE_DEPTH = 4.0;

// Share of the change of light, and of its deviation from a linear change, that is taken as its
// error: the light is that of the place where most of it is gathered.
const float LIGHT_WEIGHT = 0.06;
const float LIGHT_BEND_WEIGHT = 0.5;

// Of the square of 1 - the cosine between the normals at the ends: between such ends light may do
// anything.
const float NORMAL_WEIGHT = 0.3;

// Where in (0, 1) the cubic turns, ascending; 2 for nowhere.
vec2 TurningPoints(vec4 c)
{
  float three = 3.0 * c.w;
  float end = c.y + 2.0 * c.z + three;
  float discriminant = c.z * c.z - three * c.y;
  if ((c.y > 0.0) == (end > 0.0))
  {
    // Both ends of one that turns twice may see nothing of what it meets in between.
    bool twice =
      discriminant > 0.0 && c.y * c.w > 0.0 && c.z * c.w < 0.0 && abs(c.z) < abs(three);
    float q = -(c.z + (c.z < 0.0 ? -sqrt(discriminant) : sqrt(discriminant)));
    return twice ? vec2(c.y / q, q / three) : vec2(2.0);
  }
  // The root at which the slope changes its sign as it does from 0 to 1, by the quotient in which
  // nothing cancels.
  float root = sqrt(max(discriminant, 0.0));
  root = c.y > 0.0 ? root : -root;
  float u = (c.y > 0.0) == (c.z > 0.0) ? (-c.z - root) / three : c.y / (root - c.z);
  return vec2(u > 0.0 && u < 1.0 ? u : 2.0, 2.0);
}

// The mean between two samples of a cubic and how much it may be off, as in IntegrateLine(). `bend`:
// twice the largest second derivative of that part; `excess`: the mean of the cubic above that of
// its ends.
vec2 MeanOfPart(Sample a, Sample b, float bend, float excess)
{
  precise float dx = b.x - a.x;
  float chord = MeanExtinction(a, b);
  float slope = IsWide(dx, IsJump(a, b)) ? (b.s - a.s) / dx : 0.5 * (a.slope + b.slope);
  precise float mean = max(chord + slope * excess, 0.0);
  float off = 0.25 * bend;
  float uneven = abs(chord - 0.5 * (a.s + b.s));
  float variation = max(abs(a.slope - slope), abs(b.slope - slope));
  float share = min(1.0, off / max(abs(dx), 1.0e-3));
  return vec2(
    mean, min(0.67 * variation * off + 4.0 * uneven * share, a.s + b.s + 2.0 * chord));
}
#endif

#if TERAVOX_BLEND && !TERAVOX_NEAREST
// Where a cubic turns, ascending; 1 where it doesn't in (0, 1).
vec2 TurnsOf(vec4 c)
{
  // Roots of B + 2 C u + 3 D u^2, without cancellation.
  precise float discriminant = c.z * c.z - 3.0 * c.w * c.y;
  bool real = discriminant > 0.0;
  float root = sqrt(real ? discriminant : 0.0);
  precise float q = -(c.z + (c.z < 0.0 ? -root : root));
  precise float a = q / (3.0 * c.w);
  precise float b = c.y / q;
  float u = real && a > 0.0 && a < 1.0 ? a : 1.0;
  float v = real && b > 0.0 && b < 1.0 ? b : 1.0;
  return vec2(min(u, v), max(u, v));
}
#endif
