// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Eight lanes of float and int32 with the compiler's vector types. Included by each translation
// unit of the kernel, inside of its own namespace and with its own instruction set: nothing here
// may be shared by the linker, so there are no headers of the standard library but <cstdint>.
// Only operations that IEEE 754 defines to the bit, so that all instruction sets draw the same.

constexpr int Lanes = 8;
using Floats = float __attribute__((vector_size(4 * Lanes)));
using Ints = std::int32_t __attribute__((vector_size(4 * Lanes)));
// x, y, z and something else.
using Quad = float __attribute__((vector_size(16)));
using QuadMask = std::int32_t __attribute__((vector_size(16)));
// Of bricks or voxels of a level: x, y, z and 0.
using Index = std::uint32_t __attribute__((vector_size(16)));

#define TERAVOX_INLINE inline __attribute__((always_inline))

inline Floats Splat(float v)
{
  return v - Floats{};
}
inline Ints Splat(std::int32_t v)
{
  return v - Ints{};
}

// The same names for one lane and for eight.
inline float Select(bool m, float a, float b)
{
  return m ? a : b;
}
inline Floats Select(Ints m, Floats a, Floats b)
{
  return m ? a : b;
}
template <typename T>
inline T Min(T a, T b)
{
  return a < b ? a : b;
}
template <typename T>
inline T Max(T a, T b)
{
  return a > b ? a : b;
}
template <typename T>
inline T Abs(T a)
{
  return Max(a, -a);
}
inline std::int32_t Truncate(float v)
{
  return static_cast<std::int32_t>(v);
}
inline Ints Truncate(Floats v)
{
  return __builtin_convertvector(v, Ints);
}
inline float ToFloat(std::int32_t v)
{
  return static_cast<float>(v);
}
inline Floats ToFloat(Ints v)
{
  return __builtin_convertvector(v, Floats);
}
// The largest integer below, for |v| < 2^31.
inline std::int32_t Floor(float v)
{
  const auto i = static_cast<std::int32_t>(v);
  return i - (static_cast<float>(i) > v ? 1 : 0);
}
TERAVOX_INLINE Quad Floor(Quad v)
{
  const Quad i = __builtin_convertvector(__builtin_convertvector(v, QuadMask), Quad);
  return i > v ? i - 1.0f : i;
}
TERAVOX_INLINE Quad Spread(float v)
{
  return v - Quad{};
}
// The same with another fourth lane. (An assignment to the lane goes through memory.)
TERAVOX_INLINE Quad WithFourth(Quad v, float fourth)
{
  const QuadMask three = { -1, -1, -1, 0 };
  return three ? v : Spread(fourth);
}
TERAVOX_INLINE Index WithFourth(Index v, std::uint32_t fourth)
{
  const Index three = { ~0u, ~0u, ~0u, 0u };
  const Index last = { 0u, 0u, 0u, fourth };
  return (v & three) | last;
}
TERAVOX_INLINE Index Spread(std::uint32_t v)
{
  return v - Index{};
}
// For |v| < 2^31.
TERAVOX_INLINE Quad ToFloat(Index v)
{
  return __builtin_convertvector(reinterpret_cast<QuadMask>(v), Quad);
}
TERAVOX_INLINE float Largest(Quad v)
{
  return Max(v[0], Max(v[1], v[2]));
}
// The least of x, y and z, in each of them.
TERAVOX_INLINE Quad LeastOfThree(Quad v)
{
  const Quad a = __builtin_shufflevector(v, v, 1, 2, 0, 3);
  const Quad b = __builtin_shufflevector(v, v, 2, 0, 1, 3);
  const Quad least = v < a ? v : a;
  return least < b ? least : b;
}
TERAVOX_INLINE unsigned Bits(QuadMask m)
{
#ifdef __SSE__
  return static_cast<unsigned>(_mm_movemask_ps(reinterpret_cast<__m128>(m)));
#else
  return (m[0] != 0 ? 1u : 0u) | (m[1] != 0 ? 2u : 0u) | (m[2] != 0 ? 4u : 0u) |
    (m[3] != 0 ? 8u : 0u);
#endif
}
// One bit per lane.
inline unsigned Bits(bool m)
{
  return m ? 1 : 0;
}
inline unsigned Bits(Ints m)
{
#ifdef __AVX2__
  return static_cast<unsigned>(_mm256_movemask_ps(reinterpret_cast<__m256>(m)));
#else
  unsigned bits = 0;
  for (int l = 0; l < Lanes; ++l)
  {
    bits |= (m[l] != 0 ? 1u : 0u) << l;
  }
  return bits;
#endif
}
inline float SquareRoot(float v)
{
  return __builtin_sqrtf(v);
}
inline Floats SquareRoot(Floats v)
{
#ifdef __AVX2__
  return reinterpret_cast<Floats>(_mm256_sqrt_ps(reinterpret_cast<__m256>(v)));
#else
  Floats r;
  for (int l = 0; l < Lanes; ++l)
  {
    r[l] = __builtin_sqrtf(v[l]);
  }
  return r;
#endif
}

// Eight quads as four vectors: all x, all y, all z, all w.
TERAVOX_INLINE void Transpose(const Quad (&in)[Lanes], Floats (&out)[4])
{
  const auto join = [&](int l)
  { return __builtin_shufflevector(in[l], in[l + 4], 0, 1, 2, 3, 4, 5, 6, 7); };
  const Floats a = join(0);
  const Floats b = join(1);
  const Floats c = join(2);
  const Floats d = join(3);
  const Floats ab = __builtin_shufflevector(a, b, 0, 8, 1, 9, 4, 12, 5, 13);
  const Floats cd = __builtin_shufflevector(c, d, 0, 8, 1, 9, 4, 12, 5, 13);
  const Floats abHigh = __builtin_shufflevector(a, b, 2, 10, 3, 11, 6, 14, 7, 15);
  const Floats cdHigh = __builtin_shufflevector(c, d, 2, 10, 3, 11, 6, 14, 7, 15);
  out[0] = __builtin_shufflevector(ab, cd, 0, 1, 8, 9, 4, 5, 12, 13);
  out[1] = __builtin_shufflevector(ab, cd, 2, 3, 10, 11, 6, 7, 14, 15);
  out[2] = __builtin_shufflevector(abHigh, cdHigh, 0, 1, 8, 9, 4, 5, 12, 13);
  out[3] = __builtin_shufflevector(abHigh, cdHigh, 2, 3, 10, 11, 6, 7, 14, 15);
}
// The other way round.
TERAVOX_INLINE void Transpose(const Floats (&in)[4], Quad (&out)[Lanes])
{
  const Floats xy = __builtin_shufflevector(in[0], in[1], 0, 8, 1, 9, 4, 12, 5, 13);
  const Floats xyHigh = __builtin_shufflevector(in[0], in[1], 2, 10, 3, 11, 6, 14, 7, 15);
  const Floats zw = __builtin_shufflevector(in[2], in[3], 0, 8, 1, 9, 4, 12, 5, 13);
  const Floats zwHigh = __builtin_shufflevector(in[2], in[3], 2, 10, 3, 11, 6, 14, 7, 15);
  const auto put = [&](int l, Floats a, Floats b)
  {
    const Floats first = __builtin_shufflevector(a, b, 0, 1, 8, 9, 4, 5, 12, 13);
    const Floats second = __builtin_shufflevector(a, b, 2, 3, 10, 11, 6, 7, 14, 15);
    out[l] = __builtin_shufflevector(first, first, 0, 1, 2, 3);
    out[l + 1] = __builtin_shufflevector(second, second, 0, 1, 2, 3);
    out[l + 4] = __builtin_shufflevector(first, first, 4, 5, 6, 7);
    out[l + 5] = __builtin_shufflevector(second, second, 4, 5, 6, 7);
  };
  put(0, xy, zw);
  put(2, xyHigh, zwHigh);
}

TERAVOX_INLINE std::int32_t WordAt(const std::uint8_t* at)
{
  std::int32_t v = 0;
  __builtin_memcpy(&v, at, 4);
  return v;
}
// 32-bit words at base + i. Single loads, which many processors do faster than gathers.
TERAVOX_INLINE Ints GatherWords(const std::uint8_t* base, const std::int32_t (&i)[Lanes])
{
  return Ints{ WordAt(base + i[0]), WordAt(base + i[1]), WordAt(base + i[2]), WordAt(base + i[3]),
    WordAt(base + i[4]), WordAt(base + i[5]), WordAt(base + i[6]), WordAt(base + i[7]) };
}
TERAVOX_INLINE void Spill(Ints v, std::int32_t (&out)[Lanes])
{
  __builtin_memcpy(out, &v, sizeof(v));
}

// Four words at table + 4 i, word by word.
inline void LoadFour(const float* table, std::int32_t i, float (&out)[4])
{
  for (int k = 0; k < 4; ++k)
  {
    out[k] = table[4 * i + k];
  }
}
TERAVOX_INLINE void LoadFour(const float* table, Ints i, Floats (&out)[4])
{
  alignas(32) std::int32_t at[Lanes];
  Spill(i, at);
  Quad rows[Lanes];
  for (int l = 0; l < Lanes; ++l)
  {
    __builtin_memcpy(&rows[l], table + 4 * at[l], sizeof(Quad));
  }
  Transpose(rows, out);
}

inline std::int32_t AsInt(float v)
{
  std::int32_t r = 0;
  __builtin_memcpy(&r, &v, 4);
  return r;
}
inline Ints AsInt(Floats v)
{
  return reinterpret_cast<Ints>(v);
}
inline float AsFloat(std::int32_t v)
{
  float r = 0;
  __builtin_memcpy(&r, &v, 4);
  return r;
}
inline Floats AsFloat(Ints v)
{
  return reinterpret_cast<Floats>(v);
}

// exp(-x) for x >= 0 to two units in the last place; x is cut to 87.
template <typename F>
TERAVOX_INLINE F ExpOfMinus(F x)
{
  x = Min(x, F{} + 87.0f);
  const F n = ToFloat(Truncate(x * 1.44269504f + 0.5f));
  const F r = (n * 0.693359375f - x) - n * 2.12194440e-4f; // |r| <= ln(2) / 2
  F p = r * 1.9875691e-4f + 1.3981999e-3f;
  p = p * r + 8.3334519e-3f;
  p = p * r + 4.1665796e-2f;
  p = p * r + 1.6666665e-1f;
  p = p * r + 0.5f;
  p = p * r * r + r + 1.0f;
  return p * AsFloat((127 - Truncate(n)) << 23);
}

// x^power for x in (0, 1], power >= 0; 0 where x is below the least normal number.
template <typename F>
TERAVOX_INLINE F PowerOf(F x, float power)
{
  // log2 by the series of atanh around sqrt(1/2) ... sqrt(2) (as in fdlibm's e_logf.c).
  const F least = F{} + 1.2e-38f;
  const auto bits = AsInt(Max(x, least)) - 0x3f3504f3;
  const F e = ToFloat(bits >> 23);
  const F m = AsFloat((bits & 0x7fffff) + 0x3f3504f3);
  const F f = (m - 1.0f) / (m + 1.0f);
  const F s = f * f;
  const F series = f * (2.0f + s * (0.66666667f + s * (0.4f + s * (0.28571429f + s * 0.24f))));
  const F minusLog = -(e * 0.69314718f + series);
  return Select(x > least, ExpOfMinus(Max(minusLog * power, F{})), F{});
}
