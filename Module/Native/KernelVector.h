// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Eight lanes of float and int32 with the compiler's vector types. Included by each translation
// unit of the kernel, inside of its own namespace and with its own instruction set: nothing here
// may be shared by the linker, so there are no headers of the standard library but <cstdint>.
// Only operations that IEEE 754 defines to the bit, so that all instruction sets draw the same.

constexpr int Lanes = 8;
using Floats = float __attribute__((vector_size(4 * Lanes)));
using Ints = std::int32_t __attribute__((vector_size(4 * Lanes)));

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
// One bit per lane.
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

// 32-bit words at byte addresses base + i.
inline Ints GatherWords(const std::uint8_t* base, Ints i)
{
#ifdef __AVX2__
  return reinterpret_cast<Ints>(
    _mm256_i32gather_epi32(reinterpret_cast<const int*>(base), reinterpret_cast<__m256i>(i), 1));
#else
  Ints r;
  for (int l = 0; l < Lanes; ++l)
  {
    std::int32_t v = 0;
    __builtin_memcpy(&v, base + i[l], 4);
    r[l] = v;
  }
  return r;
#endif
}

// Four words at table + 4 i, word by word.
inline void LoadFour(const float* table, std::int32_t i, float (&out)[4])
{
  for (int k = 0; k < 4; ++k)
  {
    out[k] = table[4 * i + k];
  }
}
inline void LoadFour(const float* table, Ints i, Floats (&out)[4])
{
#ifdef __AVX2__
  const auto pair = [&](int l)
  {
    return _mm256_insertf128_ps(_mm256_castps128_ps256(_mm_loadu_ps(table + 4 * i[l])),
      _mm_loadu_ps(table + 4 * i[l + 4]), 1);
  };
  const __m256 a = pair(0);
  const __m256 b = pair(1);
  const __m256 c = pair(2);
  const __m256 d = pair(3);
  const __m256 ab = _mm256_unpacklo_ps(a, b);
  const __m256 cd = _mm256_unpacklo_ps(c, d);
  const __m256 abHigh = _mm256_unpackhi_ps(a, b);
  const __m256 cdHigh = _mm256_unpackhi_ps(c, d);
  out[0] = reinterpret_cast<Floats>(_mm256_shuffle_ps(ab, cd, 0x44));
  out[1] = reinterpret_cast<Floats>(_mm256_shuffle_ps(ab, cd, 0xee));
  out[2] = reinterpret_cast<Floats>(_mm256_shuffle_ps(abHigh, cdHigh, 0x44));
  out[3] = reinterpret_cast<Floats>(_mm256_shuffle_ps(abHigh, cdHigh, 0xee));
#else
  for (int l = 0; l < Lanes; ++l)
  {
    for (int k = 0; k < 4; ++k)
    {
      out[k][l] = table[4 * i[l] + k];
    }
  }
#endif
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
inline F ExpOfMinus(F x)
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
inline F PowerOf(F x, float power)
{
  // log2 by the series of atanh around sqrt(1/2) ... sqrt(2) (as in fdlibm's e_logf.c).
  const auto bits = AsInt(x) - 0x3f3504f3;
  const F e = ToFloat(bits >> 23);
  const F m = AsFloat((bits & 0x7fffff) + 0x3f3504f3);
  const F f = (m - 1.0f) / (m + 1.0f);
  const F s = f * f;
  const F series = f * (2.0f + s * (0.66666667f + s * (0.4f + s * (0.28571429f + s * 0.24f))));
  const F minusLog = -(e * 0.69314718f + series);
  return Select(x > F{} + 1.2e-38f, ExpOfMinus(Max(minusLog * power, F{})), F{});
}
