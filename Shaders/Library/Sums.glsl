// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Sums of the table's values along a ray, over the part where values count.

#if TERAVOX_BLEND == BLEND_AVERAGE || TERAVOX_BLEND == BLEND_ADDITIVE
// What a sum may be off by in a piece, as a share of what the piece adds and at least.
const float SUM_TOLERANCE = 1.0e-3;
const float LEAST_SUM_TOLERANCE = 1.0e-6;
const float SMALLEST_PART = 1.0 / 512.0; // of a cell

// Of a piece on which the field is nearly linear: mean of the table, 0 where values don't count,
// and the share of the piece where they do.
vec2 SumBetween(float a, float b)
{
  float share = 1.0;
  float from = a;
  float to = b;
#if TERAVOX_BLEND == BLEND_AVERAGE
  from = clamp(a, u_projection.z, u_projection.w);
  to = clamp(b, u_projection.z, u_projection.w);
  precise float whole = b - a;
  // A piece of nearly one value counts or doesn't.
  bool flatPiece = abs(whole) < 1.0e-6 * max(abs(a), abs(b)) + 1.0e-20;
  bool inside = a >= u_projection.z && a <= u_projection.w;
  share = flatPiece ? (inside ? 1.0 : 0.0) : (to - from) / (flatPiece ? 1.0 : whole);
#endif
  precise float mean = MeanExtinction(SampleTransfer(from), SampleTransfer(to)) * share;
  return vec2(mean, share);
}

void AddSum(vec2 sum, float length_)
{
  precise float s = g_sum + sum.x * length_;
  precise float l = g_length + sum.y * length_;
  g_sum = s;
  g_length = l;
}

// Over a cell, piece after piece: halves of what isn't exact enough as four linear ones. Pieces end
// where the cubic turns, so that nothing is missed between their ends.
void SumCell(inout State state, vec4 cubic, vec2 turns, float length_)
{
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
    vec2 two = 0.5 * (SumBetween(a, c) + SumBetween(c, e));
    precise vec2 four =
      0.25 * ((SumBetween(a, b) + SumBetween(b, c)) + (SumBetween(c, d) + SumBetween(d, e)));
    bool exact = all(lessThanEqual(
      abs(four - two), SUM_TOLERANCE * abs(four) + vec2(LEAST_SUM_TOLERANCE)));
    state.steps += 1u;
    if (exact || to - u <= SMALLEST_PART)
    {
      AddSum(four, (to - u) * length_);
      u = to;
      size = 2.0 * size;
    }
    else
    {
      size = 0.5 * (to - u);
    }
  }
}
#endif
