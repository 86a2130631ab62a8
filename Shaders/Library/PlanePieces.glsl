// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// The integral through a cell of which value and gradient decide together, or the values of two
// components, from the ends and the middle of each piece. What may lie between these is bounded by
// the table's changes there.
#if TERAVOX_PLANE

// Shares of what is seen that are taken as the error of a mean: of the deviation of the middle from
// the line between the ends; of what no place has seen. Likewise of the colour.
const float PLANE_BEND_WEIGHT = 0.25;
const float PLANE_UNSEEN_WEIGHT = 0.25;
const float PLANE_LIGHT_BEND_WEIGHT = 0.25;
const float PLANE_KINK_WEIGHT = 0.25;

// What is known of a place on the line.
struct PlacedSample
{
  float node;
#if !TERAVOX_COMPONENTS
  vec3 gradient; // in rows
#endif
  float row;
  PlaneSample plain;
  vec3 color; // lit
#if TERAVOX_SHADE
  vec3 normal;
#endif
};

float LargestChange(vec3 a, vec3 b)
{
  vec3 d = abs(a - b);
  return max(d.x, max(d.y, d.z));
}

#if TERAVOX_SHADE && !TERAVOX_COMPONENTS
// Where there is a normal at both: the square of 1 - the cosine between them.
float TurnedBetween(vec3 a, vec3 b)
{
  float turned = a != vec3(0.0) && b != vec3(0.0) ? 1.0 - dot(a, b) : 0.0;
  return turned * turned;
}
#endif

// The mean of the parabola through a piece's ends and its middle, over the half at `outer`.
float MeanOfHalf(float outer, float middle, float other)
{
  precise float mean = max((5.0 * outer - other) + 8.0 * middle, 0.0) * (1.0 / 12.0);
  return mean;
}

// The line of a ray through a cell: where along it nodes and rows come from.
struct PlaneLine
{
  vec4 cubic; // the field, in nodes of the transfer table
  vec2 turns; // where that turns
#if TERAVOX_COMPONENTS
  vec4 row; // the second component, in rows
#endif
#if !TERAVOX_COMPONENTS || TERAVOX_SHADE
  Gradient gradient;
  vec3 perVoxel;
#endif
  float begin; // depth
  float extent;
};

// Light alone, and not the whole state: compilers follow what is `precise` through every part of it.
#if TERAVOX_SHADE
#define SAMPLE_LINE(u) SampleLine(line, state.light, u)
PlacedSample SampleLine(PlaneLine line, RayLight light, float u)
#else
#define SAMPLE_LINE(u) SampleLine(line, u)
PlacedSample SampleLine(PlaneLine line, float u)
#endif
{
  PlacedSample p;
  p.node = Along(line.cubic, u);
#if !TERAVOX_COMPONENTS || TERAVOX_SHADE
  vec3 difference = Along(line.gradient, u) * line.perVoxel;
#endif
#if TERAVOX_COMPONENTS
  p.row = max(Along(line.row, u), 0.0);
#else
  precise vec3 gradient = difference * u_gradient.xyz;
  p.gradient = gradient;
  p.row = RowOf(gradient);
#endif
  p.plain = SamplePlane(p.node, p.row);
  p.color = p.plain.color;
#if TERAVOX_SHADE
  p.normal = NormalOf(difference);
  float at = line.begin + u * line.extent;
#if TERAVOX_COMPONENTS
  p.color = LitColor(p.color, LightOn(u_componentMaterial[0], p.normal, light, at));
#else
  p.color = LitColor(p.color, LightFrom(p.normal, light, at));
#endif
#endif
  return p;
}

// The rows that a piece may meet.
vec2 RowsBetween(PlaneLine line, PlacedSample a, PlacedSample m, PlacedSample b, float u, float to)
{
  vec2 rows = vec2(min(a.row, min(m.row, b.row)), max(a.row, max(m.row, b.row)));
#if TERAVOX_COMPONENTS
  // As GradientBend().
  vec4 f = line.row;
  float size = to - u;
  float bend = max(abs(f.z + 3.0 * f.w * u), abs(f.z + 3.0 * f.w * to)) * (0.0625 * size * size);
#else
  rows.x = min(LeastBetween(a.gradient, m.gradient), LeastBetween(m.gradient, b.gradient));
  float bend = GradientBend(line.gradient, line.perVoxel * u_gradient.xyz, u, to);
#endif
  return clamp(vec2(rows.x - bend, rows.y + bend), 0.0, u_gradient.w);
}

// `length_`: of the line, world units.
void IntegratePlane(inout State state, PlaneLine line, float length_)
{
  vec2 turns = line.turns;
  PlacedSample a = SAMPLE_LINE(0.0);
  float u = 0.0;
  float size = 1.0;
  // Of the smallest pieces there are 512, and each may have been tried as a part of larger ones.
  for (int i = 0; i < 2048; ++i)
  {
    if (u >= 1.0 || state.transmittance <= u_step.z)
    {
      break;
    }
    float to = min(u + size, 1.0);
    to = turns.x > u && turns.x < to ? turns.x : to;
    to = turns.y > u && turns.y < to ? turns.y : to;
    PlacedSample m = SAMPLE_LINE(0.5 * (u + to));
    PlacedSample b = SAMPLE_LINE(to);
    // Where the ends see nothing there is nothing, as for those who skip it.
#if TERAVOX_COMPONENTS
    bool empty = IsPartEmpty(0, min(a.node, b.node), max(a.node, b.node));
#else
    bool empty = IsEmptyBetween(min(a.node, b.node), max(a.node, b.node));
#endif
    vec3 s = empty ? vec3(0.0) : vec3(a.plain.s, m.plain.s, b.plain.s);
    float least = min(s.x, min(s.y, s.z));
    float largest = max(s.x, max(s.y, s.z));
    vec2 columns = vec2(ColumnOf(a.node), ColumnOf(b.node));
    vec2 reach = PlaneReach(vec2(min(columns.x, columns.y), max(columns.x, columns.y)),
      RowsBetween(line, a, m, b, u, to));
    float unseen = empty ? 0.0 : max(reach.x - (largest - least), 0.0);
    float off = abs(s.y - 0.5 * (s.x + s.z));
    precise float pieceLength = (to - u) * length_;
    precise float depthA = MeanOfHalf(s.x, s.y, s.z) * (0.5 * pieceLength);
    precise float depthB = MeanOfHalf(s.z, s.y, s.x) * (0.5 * pieceLength);
    precise float depth = depthA + depthB;
    float opacity = OpacityOf(depth);
    float behind = opacity > 0.0
      ? min((1.0 - OpacityOf(depthA)) * OpacityOf(depthB) / max(opacity, 1.0e-37), 1.0)
      : 0.0;
    vec3 color = mix(mix(a.color, m.color, CentroidOf(s.x, s.y, depthA)),
      mix(m.color, b.color, CentroidOf(s.y, s.z, depthB)), behind);
    float most = largest + unseen;
    float varied = (most - least) / max(most, 1.0e-30);
    float thick = min(depth * (1.0 / OPAQUE_DEPTH), 1.0);
    float uneven = min((0.25 * off + PLANE_UNSEEN_WEIGHT * unseen) / max(largest, 1.0e-30), 1.0);
    float place = max(OPAQUE_PLACE * thick * thick + uneven, FrontError(depth, varied));
    float step_ = max(LargestChange(a.color, m.color), LargestChange(m.color, b.color));
    float sag = LargestChange(m.color, mix(a.color, b.color, 0.5));
    float seen =
      LargestChange(a.plain.color, m.plain.color) + LargestChange(m.plain.color, b.plain.color);
    float shift = PLANE_UNSEEN_WEIGHT * max(reach.y - seen, 0.0);
#if TERAVOX_SHADE
    shift += step_ * (LIGHT_WEIGHT + place) + sag * PLANE_LIGHT_BEND_WEIGHT +
      NORMAL_WEIGHT * max(TurnedBetween(a.normal, m.normal), TurnedBetween(m.normal, b.normal));
#else
    shift += step_ * place + sag * PLANE_KINK_WEIGHT;
#endif
    float gained = state.transmittance * opacity;
    float change = (PLANE_BEND_WEIGHT * off + PLANE_UNSEEN_WEIGHT * unseen) * pieceLength;
    float error =
      state.transmittance * LostOpacity(depth, opacity, change) + gained * min(shift, 1.0);
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
      size *= 2.0;
    }
    if (u >= 1.0 || state.transmittance <= u_step.z)
    {
      break;
    }
  }
}
#endif
