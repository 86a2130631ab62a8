// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// The integral along a ray through one interpolation cell.

// Share of the deviation of colours at the ends from a linear change that is taken as an error: of
// any, and where one kink explains it (99 of 100 random pieces err less). And of the bend of the
// field.
const float KINK_WEIGHT = 0.25;
const float SINGLE_KINK_WEIGHT = 0.05;
const float LEAST_KINK = 1.0e-3;
const float BEND_WEIGHT = 0.1;

// The line of a ray through a cell.
struct CellLine
{
  vec3 begin; // in the cell
  vec3 along; // to where it ends
  vec4 cubic; // the field, in nodes of the transfer table
  vec2 turns; // where that turns
};

CellLine LineThrough(BrickView view, CellWalk walk, VisitedCell visited)
{
  precise vec3 w0 = (walk.first + visited.begin * view.direction) - visited.cell;
  precise vec3 dw = (walk.t - visited.begin) * view.direction;
  vec4 cubic = CubicAlong(visited.corners, w0, dw);
  cubic *= view.scale;
  cubic.x += view.offset;
  cubic *= u_transfer.z;
  return CellLine(w0, dw, cubic, TurningPoints(cubic));
}

// The corners reach further than the line: a piece between ends that see nothing adds 0.
bool IsLineEmpty(CellLine line)
{
  vec3 ends = vec3(Along(line.cubic, min(line.turns.x, 1.0)),
    Along(line.cubic, min(line.turns.y, 1.0)), Along(line.cubic, 1.0));
  return u_switches.x != 0u && IsEmptyBetween(min(Minimum(ends), line.cubic.x), max(Maximum(ends), line.cubic.x));
}

#if TERAVOX_PLANE
void IntegrateLine(inout State state, Ray ray, BrickView view, int level, CellWalk walk,
  VisitedCell visited, CellLine line)
{
  COUNT(evaluated, true);
  COUNT(gradients, true);
#if TERAVOX_COUNT
  float before = state.transmittance;
#endif
  float extent = walk.t - visited.begin;
  IntegratePlane(state,
    PlaneLine(line.cubic, line.turns,
      GradientAlong(view, ivec3(visited.cell), visited.corners, line.begin, line.along),
      view.scale / vec3(u_levelFactor[level].xyz), visited.begin, extent),
    extent * ray.world);
  COUNT(contributing, state.transmittance < before);
}
#else
void IntegrateLine(inout State state, Ray ray, BrickView view, int level, CellWalk walk,
  VisitedCell visited, CellLine line)
{
  vec4 cubic = line.cubic;
  vec2 turns = line.turns;
  float length_ = (walk.t - visited.begin) * ray.world;
  COUNT(evaluated, true);
#if TERAVOX_SHADE || TERAVOX_GRADIENT_OPACITY
  COUNT(gradients, true);
  Gradient gradient =
    GradientAlong(view, ivec3(visited.cell), visited.corners, line.begin, line.along);
  float scale = view.scale;
  float extent = walk.t - visited.begin;
  vec3 perVoxel = scale / vec3(u_levelFactor[level].xyz);
#endif
  float u = 0.0;
  float size = 1.0;
  Sample a = SampleTransfer(cubic.x);
  vec3 slopeA;
  vec3 colorA = TransferColor(cubic.x, slopeA);
#if TERAVOX_SHADE
  vec3 normalA = NormalOf(Along(gradient, 0.0) * perVoxel);
#endif
#if TERAVOX_GRADIENT_OPACITY
  SampledGradient front = SampleGradient(MainGradients(), Along(gradient, 0.0) * perVoxel);
#endif
#if TERAVOX_COUNT
  float before = state.transmittance;
#endif
  // Pieces of 1/512, and tries that failed before them.
  for (int i = 0; i < 2048; ++i)
  {
    if (u >= 1.0 || state.transmittance <= u_step.z)
    {
      break;
    }
    float to = min(u + size, 1.0);
    to = turns.x > u && turns.x < to ? turns.x : to;
    to = turns.y > u && turns.y < to ? turns.y : to;
    precise float x = Along(cubic, to);
    Sample b = SampleTransfer(x);
    float size_ = to - u;
    // Half of the second derivatives at both ends; the mean of the cubic above that of its ends.
    float bendA = cubic.z + 3.0 * cubic.w * u;
    float bendB = cubic.z + 3.0 * cubic.w * to;
    float excess = (-1.0 / 6.0) * (bendA + 1.5 * cubic.w * size_) * size_ * size_;
    float off = 0.25 * max(abs(bendA), abs(bendB)) * size_ * size_;
    float chord = MeanExtinction(a, b);
    float dx = x - a.x;
    bool wide = IsWide(dx, IsJump(a, b));
    float slope = wide ? (b.s - a.s) / dx : 0.5 * (a.slope + b.slope);
    // The mean of the cubic is known: only what the function bends is an error.
    precise float mean = max(chord + slope * excess, 0.0);
    float uneven = abs(chord - 0.5 * (a.s + b.s));
    float share = min(1.0, off / max(abs(dx), 1.0e-3));
    float variation = max(abs(a.slope - slope), abs(b.slope - slope));
    float change = min(0.67 * variation * off + 4.0 * uneven * share, a.s + b.s + 2.0 * chord);
    float sA = a.s;
    float sB = b.s;
#if TERAVOX_GRADIENT_OPACITY
    float half_ = 0.5 * (u + to);
    Sample m = SampleTransfer(Along(cubic, half_));
    float bendM = cubic.z + 3.0 * cubic.w * half_;
    float quarter = 0.25 * size_ * size_;
    float third = 0.75 * cubic.w * size_;
    SampledGradient middle = SampleGradient(MainGradients(), Along(gradient, half_) * perVoxel);
    SampledGradient back = SampleGradient(MainGradients(), Along(gradient, to) * perVoxel);
    float varied = Attenuate(MainGradients(), MeanOfPart(a, m, max(abs(bendA), abs(bendM)) * quarter,
                (-1.0 / 6.0) * (bendA + third) * quarter),
      MeanOfPart(m, b, max(abs(bendM), abs(bendB)) * quarter,
        (-1.0 / 6.0) * (bendM + third) * quarter),
      vec3(sA, m.s, sB), uneven, front, middle, back, GradientBend(gradient, perVoxel * u_gradient.xyz, u, to),
      mean, change);
    sA *= front.opacity;
    sB *= back.opacity;
    uneven = abs(mean - 0.5 * (sA + sB));
#endif
    precise float pieceLength = size_ * length_;
    precise float depth = mean * pieceLength;
    float opacity = OpacityOf(depth);
    vec3 slopeB;
    vec3 colorB = TransferColor(x, slopeB);
    float gathered = CentroidOf(sA, sB, depth);
    vec3 color =
      mix(colorA, colorB, clamp(gathered + (wide ? excess / dx : 0.0), 0.0, 1.0));
    // Where the slopes at the ends say so, a channel has one kink in between: then the peak of the
    // triangle above the line between the ends is known.
    vec3 before = slopeA * dx - (colorB - colorA);
    vec3 behind = (colorB - colorA) - slopeB * dx;
    vec3 most = max(abs(before), abs(behind));
    vec3 single = step(vec3(LEAST_KINK), most) * (vec3(1.0) - step(before * behind, vec3(0.0)));
    vec3 triangle = single * (0.5 * (before * behind)) / mix(vec3(1.0), before + behind, single);
    color = clamp(color + triangle, vec3(0.0), vec3(1.0));
    float kink = LargestOf(most * mix(vec3(KINK_WEIGHT), vec3(SINGLE_KINK_WEIGHT), single));
    // Where in the piece light is gathered is known only as far as the extinction is linear.
    float thick = min(depth * (1.0 / OPAQUE_DEPTH), 1.0);
    float place = OPAQUE_PLACE * thick * thick + 0.25 * uneven / max(mean, 1.0e-30);
#if TERAVOX_GRADIENT_OPACITY
    place = max(place, FrontError(depth, varied));
#endif
#if TERAVOX_SHADE
    vec3 normalB = NormalOf(Along(gradient, to) * perVoxel);
    vec3 litA = LitColor(colorA, LightFrom(normalA, state.light, visited.begin + u * extent));
    vec3 litB = LitColor(colorB, LightFrom(normalB, state.light, visited.begin + to * extent));
    float at = mix(u, to, gathered);
    color = LitColor(color,
      Shade(Along(gradient, at) * perVoxel, state.light, visited.begin + at * extent));
    // Where there is none at one end, as where values saturate, it usually has one direction still.
    bool both = normalA != vec3(0.0) && normalB != vec3(0.0);
    float turned = both ? 1.0 - dot(normalA, normalB) : 0.0;
    float shift = LargestOf(abs(litB - litA)) * (LIGHT_WEIGHT + place) +
      LargestOf(abs(color - mix(litA, litB, gathered))) * LIGHT_BEND_WEIGHT +
      NORMAL_WEIGHT * turned * turned;
#else
    float shift = LargestOf(abs(colorB - colorA)) * (place + BEND_WEIGHT * share);
#endif
    shift += kink;
    float gained = state.transmittance * opacity;
#if TERAVOX_GRADIENT_OPACITY
    float lost = LostOpacity(depth, opacity, change * pieceLength);
#else
    float lost = min(change * pieceLength, 1.0) * (1.0 - opacity);
#endif
    float error = state.transmittance * lost + gained * min(shift, 1.0);
    state.steps += 1u;
    if (error > u_step.y * gained + u_step.w && to - u > SMALLEST_PIECE)
    {
      size = (to - u) * 0.5;
    }
    else
    {
#if TERAVOX_ESTIMATE
      state.error += error;
#endif
      Accumulate(state, opacity, color);
      u = to;
      a = b;
      colorA = colorB;
      slopeA = slopeB;
#if TERAVOX_SHADE
      normalA = normalB;
#endif
#if TERAVOX_GRADIENT_OPACITY
      front = back;
#endif
      size *= 2.0;
    }
    if (u >= 1.0 || state.transmittance <= u_step.z)
    {
      break;
    }
  }
  COUNT(contributing, state.transmittance < before);
}
#endif

void IntegrateCell(
  inout State state, Ray ray, BrickView view, int level, CellWalk walk, VisitedCell visited)
{
  CellLine line = LineThrough(view, walk, visited);
  if (!IsLineEmpty(line))
  {
    IntegrateLine(state, ray, view, level, walk, visited, line);
  }
}
