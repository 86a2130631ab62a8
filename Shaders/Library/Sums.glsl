// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Sums of the table's values along a ray, over the part where values count.

#if TERAVOX_BLEND == BLEND_AVERAGE || TERAVOX_BLEND == BLEND_ADDITIVE
// What a sum may be off by in a piece, as a share of what the piece adds and at least.
const float SUM_TOLERANCE = 1.0e-3;
const float LEAST_SUM_TOLERANCE = 1.0e-6;
const float SMALLEST_PART = 1.0 / 512.0; // of a cell

// What is added up: the values of a table, of averages those between two nodes only.
struct SumRule
{
  int first; // node
  float nodes;
  float low;
  float high;
};

#if TERAVOX_COMPONENTS
SumRule SumRuleOf(int component)
{
  vec4 rule = u_componentProjection[component];
  return SumRule(int(u_componentTable[component].x), u_componentTransfer[component].w, rule.y, rule.z);
}

void AddSum(int component, vec2 sum)
{
  precise float s = g_sums[component] + sum.x;
  precise float l = g_lengths[component] + sum.y;
  g_sums[component] = s;
  g_lengths[component] = l;
}
#else
SumRule TheSumRule()
{
  return SumRule(0, u_transfer.w, u_projection.z, u_projection.w);
}

void AddSum(vec2 sum)
{
  precise float s = g_sum + sum.x;
  precise float l = g_length + sum.y;
  g_sum = s;
  g_length = l;
}
#endif

// Of a piece on which the field is nearly linear: mean of the table, 0 where values don't count,
// and the share of the piece where they do.
vec2 SumBetween(SumRule rule, float a, float b)
{
  float share = 1.0;
  float from = a;
  float to = b;
#if TERAVOX_BLEND == BLEND_AVERAGE
  from = clamp(a, rule.low, rule.high);
  to = clamp(b, rule.low, rule.high);
  precise float whole = b - a;
  // A piece of nearly one value counts or doesn't.
  bool flatPiece = abs(whole) < 1.0e-6 * max(abs(a), abs(b)) + 1.0e-20;
  bool inside = a >= rule.low && a <= rule.high;
  share = flatPiece ? (inside ? 1.0 : 0.0) : (to - from) / (flatPiece ? 1.0 : whole);
#endif
  precise float mean = MeanExtinction(SampleTable(rule.first, rule.nodes, from),
                         SampleTable(rule.first, rule.nodes, to)) *
    share;
  return vec2(mean, share);
}

// Over a cell, piece after piece: halves of what isn't exact enough as four linear ones. Pieces end
// where the cubic turns, so that nothing is missed between their ends.
vec2 SumCell(inout State state, SumRule rule, vec4 cubic, vec2 turns, float length_)
{
  precise vec2 sum = vec2(0.0);
  float u = 0.0;
  float size = 1.0;
  for (int i = 0; i < 4096; ++i)
  {
    if (u >= 1.0)
    {
      break;
    }
    float stop = u < turns.x ? turns.x : u < turns.y ? turns.y : 1.0;
    float to = min(u + size, stop);
    precise float quarter = 0.25 * (to - u);
    float a = Along(cubic, u);
    float b = Along(cubic, u + quarter);
    float c = Along(cubic, u + 2.0 * quarter);
    float d = Along(cubic, u + 3.0 * quarter);
    float e = Along(cubic, to);
    vec2 two = 0.5 * (SumBetween(rule, a, c) + SumBetween(rule, c, e));
    precise vec2 four = 0.25 *
      ((SumBetween(rule, a, b) + SumBetween(rule, b, c)) +
        (SumBetween(rule, c, d) + SumBetween(rule, d, e)));
    bool exact = all(lessThanEqual(
      abs(four - two), SUM_TOLERANCE * abs(four) + vec2(LEAST_SUM_TOLERANCE)));
    state.steps += 1u;
    if (exact || to - u <= SMALLEST_PART)
    {
      sum += four * ((to - u) * length_);
      u = to;
      size = 2.0 * size;
    }
    else
    {
      size = 0.5 * (to - u);
    }
  }
  return sum;
}
#endif
