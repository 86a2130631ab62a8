// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// The transfer function as tables over nodes, linear in between: extinction s(x) and its integral S,
// the integral K of the emission c(x) s(x), integrals as pairs of floats. Along a piece of a ray on
// which the value is linear, the mean extinction is (S(b) - S(a)) / (b - a) and the mean colour
// (K(b) - K(a)) / (S(b) - S(a)): nothing between the ends is missed, however narrow (integral
// functions: Engel, Kraus, Ertl 2001, section 3.4; here with attenuation, and with differences that
// don't cancel).
//
// Words of node i: S high, S low, s_i, s_i+1; K high (3), red and green of the interval; K low (3),
// blue of the interval (16 bits each).

struct Sample
{
  float x; // position in nodes; < 0: no value (NaN)
  float s;
  float integralHigh;
  float integralLow;
  vec3 color;
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
  uvec4 t0 = texelFetch(u_transferTable, at);
  uvec4 t1 = texelFetch(u_transferTable, at + 1);
  uvec4 t2 = texelFetch(u_transferTable, at + 2);
  vec4 a = uintBitsToFloat(t0);
  r.color = vec3(float(t1.w & 0xffffu), float(t1.w >> 16u), float(t2.w)) * (1.0 / 65535.0);
  r.x = x;
  precise float s = a.z + f * (a.w - a.z);
  precise float inside = f * (a.z + 0.5 * f * (a.w - a.z));
  precise float low = a.y + inside;
  precise vec3 emissionLow = uintBitsToFloat(t2.xyz) + inside * r.color;
  r.s = s;
  r.integralHigh = a.x;
  r.integralLow = low;
  r.emissionHigh = uintBitsToFloat(t1.xyz);
  r.emissionLow = emissionLow;
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
  return texelFetch(u_occupied, a).x == texelFetch(u_occupied, b).x;
}

// The same for a range of data values; a range without any value is empty.
bool IsEmpty(float low, float high)
{
  return low > high || IsEmptyBetween(TransferPosition(low, 0.0), TransferPosition(high, 0.0));
}

// How far the mean extinction between a sample and a position beyond it is from the sample's own: what
// a linear piece doesn't see of a field that bulges beyond its ends.
float ExtinctionBeyond(Sample at, float position)
{
  float x = clamp(position, 0.0, u_transfer.w - 1.0);
  int i = min(int(x), int(u_transfer.w) - 2);
  precise float f = x - float(i);
  vec4 a = uintBitsToFloat(texelFetch(u_transferTable, i * int(TRANSFER_TEXELS)));
  precise float low = a.y + f * (a.z + 0.5 * f * (a.w - a.z));
  precise float ds = (a.x - at.integralHigh) + (low - at.integralLow);
  float dx = x - at.x;
  return abs(dx) >= 0.015625 ? abs(ds / dx - at.s) : 0.0;
}

struct Piece
{
  float depth;   // optical depth
  float opacity; // 1 - exp(-depth)
  vec3 color;    // mean, weighted with the extinction
};

// 1 - exp(-depth), without cancellation.
float OpacityOf(float depth)
{
  precise float small = depth * (1.0 - depth * (0.5 - depth * (0.16666667 - depth * 0.041666667)));
  precise float large = 1.0 - exp(-depth);
  return depth < 0.03 ? small : large;
}

// The integral over a piece with linear value, `length_` in units of dataset space.
Piece IntegratePiece(Sample a, Sample b, float length_)
{
  precise float dx = b.x - a.x;
  precise float ds = (b.integralHigh - a.integralHigh) + (b.integralLow - a.integralLow);
  precise vec3 dk = (b.emissionHigh - a.emissionHigh) + (b.emissionLow - a.emissionLow);
  // Between two nodes the mean of the ends is exact, and nothing has to cancel.
  bool wide = abs(dx) >= 0.015625 && floor(a.x) != floor(b.x);
  precise float s = wide ? ds / dx : 0.5 * (a.s + b.s);
  bool mean = wide && ds != 0.0;
  precise vec3 color = mean ? clamp(dk / ds, 0.0, 1.0) : 0.5 * (a.color + b.color);
  s = max(s, 0.0);
#if TERAVOX_FLOAT_DATA
  s = a.x < 0.0 || b.x < 0.0 ? 0.0 : s;
#endif
  Piece piece;
  precise float depth = s * length_;
  piece.depth = depth;
  piece.opacity = OpacityOf(depth);
  piece.color = color;
  return piece;
}
