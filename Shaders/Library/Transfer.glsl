// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// The transfer function as tables over nodes: extinction s(x), linear between nodes, its integral S
// as a pair of floats, and the colour. Along a piece of a ray on which the value is linear the mean
// extinction is (S(b) - S(a)) / (b - a): nothing between the ends is missed, however narrow
// (integral functions: Engel, Kraus, Ertl 2001, section 3.4; here with differences that don't
// cancel).

struct Sample
{
  float x;     // position in nodes
  float s;     // extinction
  float slope; // of the extinction, per node
  float integralHigh;
  float integralLow;
};

// Position in nodes of a data value given as a float pair.
float TransferPosition(float valueHigh, float valueLow)
{
  precise float fromLow = (valueHigh - u_transfer.x) + (valueLow - u_transfer.y);
  return fromLow * u_transfer.z;
}

// Beyond its first and last node the function is constant. `nodes`: of the table that begins at
// `first`.
Sample SampleTable(int first, float nodes, float position)
{
  Sample r;
  float x = clamp(position, 0.0, nodes - 1.0);
  int i = min(int(x), int(nodes) - 2);
  precise float f = x - float(i);
  vec4 node = texelFetch(u_transferTable, first + i);
  precise float slope = node.w - node.z;
  precise float s = node.z + f * slope;
  precise float low = node.y + (f * (node.z + 0.5 * f * slope) + (position - x) * s);
  r.x = position;
  r.s = s;
  r.slope = x == position ? slope : 0.0;
  r.integralHigh = node.x;
  r.integralLow = low;
  if (floatBitsToInt(node.w) < 0)
  {
    // A jump lies in the interval: each of its sides has the value of its node.
    float at = uintBitsToFloat(texelFetch(u_transferColors, first + i).w);
    r.s = f <= at ? node.z : -node.w;
    r.slope = 0.0;
    precise float before = min(f, at) * node.z - max(f - at, 0.0) * node.w;
    precise float lowBeside = node.y + (before + (position - x) * r.s);
    r.integralLow = lowBeside;
  }
  return r;
}

#if TERAVOX_LABELS
// Of a label mask: which of the tables counts, by the mask's value. 0: what is known of all labels
// together, to skip by.
int g_label = 0;
#else
const int g_label = 0;
#endif

Sample SampleTransfer(float position)
{
  return SampleTable(g_label * int(u_transfer.w), u_transfer.w, position);
}

// The colour at a position, and how it changes per node.
vec3 TableColor(int first, float nodes, float position, out vec3 slope)
{
  float x = clamp(position, 0.0, nodes - 1.0);
  int i = min(int(x), int(nodes) - 2);
  precise float f = x - float(i);
  // Red, green, blue of this node and of the next, 16 bits each.
  uvec4 node = texelFetch(u_transferColors, first + i);
  vec3 a = vec3(node.xyz & 0xffffu);
  vec3 b = vec3(node.xyz >> 16u);
  slope = (b - a) * (1.0 / 65535.0);
  float jump = uintBitsToFloat(node.w);
  if (jump <= 1.0)
  {
    f = f <= jump ? 0.0 : 1.0;
    slope = vec3(0.0);
  }
  precise vec3 color = (a + f * (b - a)) * (1.0 / 65535.0);
  return color;
}

vec3 TransferColor(float position, out vec3 slope)
{
  return TableColor(g_label * int(u_transfer.w), u_transfer.w, position, slope);
}

vec3 TransferColor(float position)
{
  vec3 slope;
  return TransferColor(position, slope);
}

// True if the table is exactly 0 between two positions (contract 1e). The margin covers the
// rounding of interpolated values. `firstInterval`: of the table.
bool IsTableEmpty(int firstInterval, float nodes, float fromPosition, float toPosition)
{
  // Interval 0 is what lies before the first node, the last one what lies behind the last node.
  float from = clamp(fromPosition + 0.98, 0.0, nodes);
  float to = clamp(toPosition + 1.02, 0.0, nodes);
  return float(texelFetch(u_occupied, firstInterval + int(from)).x) > to;
}

bool IsEmptyBetween(float fromPosition, float toPosition)
{
  // A table has an interval before its first node, one behind its last, and an end.
  return IsTableEmpty(
    g_label * (int(u_transfer.w) + 2), u_transfer.w, fromPosition, toPosition);
}

// 1 - exp(-depth), without cancellation.
float OpacityOf(float depth)
{
  precise float small = depth * (1.0 - depth * (0.5 - depth * (0.16666667 - depth * 0.041666667)));
  precise float large = 1.0 - exp(-depth);
  return depth < 0.03 ? small : large;
}

// Whether a jump lies between two samples of one interval, or none that matters.
bool IsJump(Sample a, Sample b)
{
  return a.s != b.s && a.slope == 0.0 && b.slope == 0.0;
}

// Whether samples are far enough from each other for differences.
bool IsWide(float dx, bool jump)
{
  return abs(dx) >= (jump ? 0.001 : 0.015625);
}

// Mean extinction between two samples.
float MeanExtinction(Sample a, Sample b)
{
  precise float dx = b.x - a.x;
  precise float ds = (b.integralHigh - a.integralHigh) + (b.integralLow - a.integralLow);
  // Between two nodes the mean of the ends is exact, and nothing has to cancel; but for intervals
  // with a jump, which have no slope.
  bool jump = IsJump(a, b);
  bool wide = IsWide(dx, jump) && (floor(a.x) != floor(b.x) || jump);
  precise float s = wide ? ds / dx : 0.5 * (a.s + b.s);
  return max(s, 0.0);
}

// Where along a piece, from 0 at its front to 1, its light comes from: the first moment of
// s(u) exp(-depth so far) for a linear s. Exact to the first order of the depth, with coefficients
// fitted to the integral: off by 0.0035 at most up to a depth of 4, 0.028 up to 12.
float CentroidOf(float sFront, float sBack, float depth)
{
  float sum = sFront + sBack;
  float front = sum > 0.0 ? sFront / max(sum, 1.0e-37) : 0.5;
  float d = min(depth, 100.0);
  float thin = (2.0 - front) * 0.33333333;
  float n = 0.147802 - front * (0.264173 - front * 0.122512);
  float m = 0.028545 + front * (0.046648 - front * 0.034667);
  return thin * thin * (1.0 + n * d) /
    (thin * (1.0 + d * (n + m * d)) + d * (1.0 + front * (1.0 - front)) * 0.066666667);
}
