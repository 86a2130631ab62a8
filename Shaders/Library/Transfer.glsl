// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// The transfer function as tables over nodes, linear in between: extinction s(x), emission
// g(x) = c(x) s(x), and their integrals S, K over x as pairs of floats. Along a piece of a ray on
// which the value is linear, the mean extinction is (S(b) - S(a)) / (b - a): nothing between the
// ends is missed, however narrow (integral functions: Engel, Kraus, Ertl 2001, section 3.4; here with
// attenuation and with a sum that doesn't cancel).
//
// Texels of node i: (S high, S low, s_i, s_i+1), (K high, number of non-zero intervals before i),
// (K low, 0), (g_i, 0).

struct Sample
{
  float x; // position in nodes; < 0: no value (NaN)
  float s;
  float integralHigh;
  float integralLow;
  vec3 g;
  vec3 emissionHigh;
  vec3 emissionLow;
};

// Position in nodes of a data value given as a float pair.
float TransferPosition(float valueHigh, float valueLow)
{
  precise float fromLow = (valueHigh - u_transfer.x) + (valueLow - u_transfer.y);
  return fromLow * u_transfer.z;
}

Sample SampleTransfer(float position)
{
  Sample r;
  float x = clamp(position, 0.0, u_transfer.w - 1.0);
  int i = min(int(x), int(u_transfer.w) - 2);
  precise float f = x - float(i);
  int at = i * int(TRANSFER_TEXELS);
  vec4 t0 = texelFetch(u_transferTable, at);
  vec3 t1 = texelFetch(u_transferTable, at + 1).xyz;
  vec3 t2 = texelFetch(u_transferTable, at + 2).xyz;
  vec3 g0 = texelFetch(u_transferTable, at + 3).xyz;
  vec3 g1 = texelFetch(u_transferTable, at + 7).xyz;
  r.x = x;
  precise float s = t0.z + f * (t0.w - t0.z);
  precise float integral = t0.y + f * (t0.z + 0.5 * f * (t0.w - t0.z));
  precise vec3 g = g0 + f * (g1 - g0);
  precise vec3 emission = t2 + f * (g0 + 0.5 * f * (g1 - g0));
  r.s = s;
  r.integralHigh = t0.x;
  r.integralLow = integral;
  r.g = g;
  r.emissionHigh = t1;
  r.emissionLow = emission;
  return r;
}

// True if the table is exactly 0 between two positions (contract 1e). The margin covers the rounding
// of interpolated values.
bool IsEmptyBetween(float fromPosition, float toPosition)
{
  float last = u_transfer.w - 1.0;
  float from = clamp(fromPosition - 0.001, 0.0, last);
  float to = clamp(toPosition + 0.001, 0.0, last);
  int a = min(int(floor(from)), int(last) - 1);
  int b = max(int(ceil(to)), a + 1);
  return texelFetch(u_transferTable, a * int(TRANSFER_TEXELS) + 1).w ==
    texelFetch(u_transferTable, b * int(TRANSFER_TEXELS) + 1).w;
}

// The same for a range of data values; a range without any value is empty.
bool IsEmpty(float low, float high)
{
  return low > high || IsEmptyBetween(TransferPosition(low, 0.0), TransferPosition(high, 0.0));
}

struct Piece
{
  float depth;   // optical depth
  vec3 emission; // what leaves the near end
};

// The integral over a piece with linear value, `length_` in world units.
Piece IntegratePiece(Sample a, Sample b, float length_)
{
  precise float dx = b.x - a.x;
  precise float ds = (b.integralHigh - a.integralHigh) + (b.integralLow - a.integralLow);
  precise vec3 dk = (b.emissionHigh - a.emissionHigh) + (b.emissionLow - a.emissionLow);
  bool wide = abs(dx) >= 0.015625;
  float over = 1.0 / (wide ? dx : 1.0);
  precise float s = wide ? ds * over : 0.5 * (a.s + b.s);
  precise vec3 g = wide ? dk * over : 0.5 * (a.g + b.g);
  s = max(s, 0.0);
  g = max(g, vec3(0.0));
#if TERAVOX_FLOAT_DATA
  if (a.x < 0.0 || b.x < 0.0)
  {
    s = 0.0;
    g = vec3(0.0);
  }
#endif
  Piece piece;
  precise float depth = s * length_;
  // (1 - exp(-depth)) / depth, without cancellation.
  precise float attenuation = depth < 0.03
    ? 1.0 - depth * (0.5 - depth * (0.16666667 - depth * 0.041666667))
    : (1.0 - exp(-depth)) / depth;
  precise vec3 emission = g * (length_ * attenuation);
  piece.depth = depth;
  piece.emission = emission;
  return piece;
}
