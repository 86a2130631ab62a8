// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// The integral along a ray through one interpolation cell.

const float SMALLEST_PIECE = 1.0 / 512.0; // of a cell

// Where in an opaque piece the light is gathered isn't known better than to this share of the
// piece.
const float OPAQUE_PLACE = 0.35;

// Share of the change of light, and of its deviation from a linear change, that is taken as its
// error: the light is that of the place where most of it is gathered.
const float LIGHT_WEIGHT = 0.06;
const float LIGHT_BEND_WEIGHT = 0.5;

// Where in (0, 1) the cubic turns, to a thousandth or so; 2 for nowhere. A cubic that turns twice
// inside hardly bends; what it does is part of the error of its pieces.
float TurningPoint(vec4 c)
{
  float begin = c.y;
  float end = c.y + 2.0 * c.z + 3.0 * c.w;
  // False position, twice.
  float u = begin / (begin - end);
  float at = c.y + u * (2.0 * c.z + 3.0 * c.w * u);
  bool before = (at > 0.0) == (end > 0.0);
  u = before ? u * begin / (begin - at) : u + (1.0 - u) * at / (at - end);
  return (begin > 0.0) != (end > 0.0) && u > 0.0 && u < 1.0 ? u : 2.0;
}

void IntegrateCell(
  inout State state, Ray ray, BrickView view, int level, CellWalk walk, VisitedCell visited)
{
  precise vec3 w0 = (walk.first + visited.begin * view.direction) - visited.cell;
  precise vec3 dw = (walk.t - visited.begin) * view.direction;
  vec4 cubic = CubicAlong(visited.corners, w0, dw);
  cubic *= view.scale;
  cubic.x += view.offset;
  cubic *= u_transfer.z;
  float length_ = (walk.t - visited.begin) * ray.world;
  float turn = TurningPoint(cubic);
  // Twice the largest second derivative.
  float bend = max(abs(cubic.z), abs(cubic.z + 3.0 * cubic.w));
#if TERAVOX_SHADE
  Gradient gradient = GradientAlong(view, ivec3(visited.cell), visited.corners, w0, dw);
  float scale = view.scale;
  vec3 perVoxel = scale / vec3(u_levelFactor[level].xyz);
#endif
  float u = 0.0;
  float size = 1.0;
  Sample a = SampleTransfer(cubic.x);
  vec3 colorA = TransferColor(cubic.x);
#if TERAVOX_SHADE
  Light lightA = Shade(Along(gradient, 0.0) * perVoxel, state.towardsLight);
#endif
  bool contributes = false;
  for (int i = 0; i < 512; ++i)
  {
    if (u >= 1.0 || state.transmittance <= u_step.z)
    {
      break;
    }
    float to = min(u + size, 1.0);
    to = turn > u && turn < to ? turn : to;
    precise float x = Along(cubic, to);
    Sample b = SampleTransfer(x);
    float mean = MeanExtinction(a, b);
    precise float pieceLength = (to - u) * length_;
    precise float depth = mean * pieceLength;
    float opacity = OpacityOf(depth);
    vec3 colorB = TransferColor(x);
    float gathered = CentroidOf(a.s, b.s, depth, opacity);
    vec3 color = mix(colorA, colorB, gathered);
    // How far the field is from the line between its ends; what that does to the optical depth.
    float off = bend * (to - u) * (to - u) * 0.25;
    float dx = abs(x - a.x);
    float rise = abs(b.s - a.s);
    float uneven = abs(mean - 0.5 * (a.s + b.s));
    float slope = max(max(abs(a.slope), abs(b.slope)), rise / max(dx, 1.0e-3));
    float change = min(
      0.67 * slope * off + 4.0 * uneven * min(1.0, off / max(dx, 1.0e-3)), a.s + b.s + 2.0 * mean);
    // Where in the piece light is gathered is known only as far as the extinction is linear.
    float thick = min(depth, 1.0);
    float place = OPAQUE_PLACE * thick * thick + 0.25 * uneven / max(mean, 1.0e-30);
    float shift = LargestOf(abs(colorB - colorA)) * place;
#if TERAVOX_SHADE
    Light lightB = Shade(Along(gradient, to) * perVoxel, state.towardsLight);
    Light light = Shade(Along(gradient, mix(u, to, gathered)) * perVoxel, state.towardsLight);
    vec3 litA = LitColor(colorA, lightA);
    vec3 litB = LitColor(colorB, lightB);
    color = LitColor(color, light);
    shift = LargestOf(abs(litB - litA)) * (LIGHT_WEIGHT + place) +
      LargestOf(abs(color - mix(litA, litB, gathered))) * LIGHT_BEND_WEIGHT;
#endif
    float gained = state.transmittance * opacity;
    float error = state.transmittance * min(change * pieceLength, 1.0) * (1.0 - opacity) +
      gained * min(shift, 1.0);
    state.steps += 1u;
    if (error > u_step.y * gained + u_step.w && to - u > SMALLEST_PIECE)
    {
      size = (to - u) * 0.5;
    }
    else
    {
      Accumulate(state, opacity, color);
      contributes = contributes || depth > 0.0;
      u = to;
      a = b;
      colorA = colorB;
#if TERAVOX_SHADE
      lightA = lightB;
#endif
      size *= 2.0;
    }
    if (u >= 1.0 || state.transmittance <= u_step.z)
    {
      break;
    }
  }
#if TERAVOX_COUNT
  state.contributing += contributes ? 1u : 0u;
#endif
}
