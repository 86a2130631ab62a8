// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Blend modes other than composite: what they make of the cubics of cells, of one component or of
// each of several.

// What an average may be off by in a cell, as a share of what the cell adds and at least.
constexpr float SumTolerance = 1.0e-3f;
constexpr float LeastSumTolerance = 1.0e-6f;

// Values with the sign that makes the wanted extreme the largest, where more makes no difference
// to the picture cut off; of a table with so many nodes.
template <typename F>
TERAVOX_INLINE F ExtremeWithin(float sign, float nodes, F signedNode)
{
  const F zero = F{};
  return sign > 0.0f ? Min(Max(signedNode, zero - 1.0f), zero + nodes)
                     : Min(Max(signedNode, zero - nodes), zero + 1.0f);
}

// The best value of each cell, at its ends or where its cubic turns. `least` and `largest`: of its
// corners.
TERAVOX_INLINE Floats BestAlong(const Cubic& field, float sign, Floats least, Floats largest)
{
  const Turns turns = TurnsOf(field);
  const Floats ends = Max(sign * field.A, sign * Along(field, Splat(1.0f)));
  const Floats middle = Max(sign * Along(field, turns.First), sign * Along(field, turns.Second));
  // Between the corners, whatever rounding does.
  return Min(
    Max(Max(ends, middle), Min(sign * least, sign * largest)), Max(sign * least, sign * largest));
}

// The same, and where along the cell it is first.
TERAVOX_INLINE Floats BestAlong(
  const Cubic& field, float sign, Floats least, Floats largest, Floats& where)
{
  const Turns turns = TurnsOf(field);
  where = Floats{};
  Floats best = sign * field.A;
  for (const Floats& u : { turns.First, turns.Second, Splat(1.0f) })
  {
    const Floats there = sign * Along(field, u);
    where = Select(there > best, u, where);
    best = Max(best, there);
  }
  return Min(Max(best, Min(sign * least, sign * largest)), Max(sign * least, sign * largest));
}

// What is added up: the values of a table, of averages those between two nodes only.
struct SumRule
{
  const Transfer& Table;
  bool InRange;
  float Low;
  float High;
};

// Of a piece on which the field is nearly linear: the integral of the table, over the part where
// values count, and the share of that part.
struct PieceSum
{
  Floats Mean;
  Floats Share;
};
TERAVOX_INLINE PieceSum SumBetween(const SumRule& rule, Floats a, Floats b)
{
  const Floats zero = {};
  const Floats one = zero + 1.0f;
  PieceSum s;
  s.Share = one;
  Floats from = a;
  Floats to = b;
  if (rule.InRange)
  {
    const Floats low = zero + rule.Low;
    const Floats high = zero + rule.High;
    from = Min(Max(a, low), high);
    to = Min(Max(b, low), high);
    const Floats whole = b - a;
    // A piece of nearly one value counts or doesn't.
    const Ints flat = Abs(whole) < 1.0e-6f * Max(Abs(a), Abs(b)) + 1.0e-20f;
    const Ints inside = (a >= low) & (a <= high);
    s.Share = Select(flat, Select(inside, one, zero), (to - from) / Select(flat, one, whole));
  }
  const Sample<Floats> first = SampleTransfer(rule.Table, from);
  const Sample<Floats> last = SampleTransfer(rule.Table, to);
  s.Mean = MeanExtinction(first, last, zero, zero).Mean * s.Share;
  return s;
}

// Eight pieces of one or several cubics: as two and as four linear ones.
struct PieceSums
{
  Floats Sum; // lengths are shares of the piece
  Floats Share;
  Ints Exact; // halves wouldn't differ
};
TERAVOX_INLINE PieceSums SumsOf(const SumRule& rule, const Cubic& f, Floats from, Floats to)
{
  const Floats size = to - from;
  Floats at[5];
  for (int i = 0; i < 5; ++i)
  {
    at[i] = Along(f, from + size * (0.25f * static_cast<float>(i)));
  }
  const auto add = [](const PieceSum& a, const PieceSum& b) {
    return PieceSum{ a.Mean + b.Mean, a.Share + b.Share };
  };
  const PieceSum two = add(SumBetween(rule, at[0], at[2]), SumBetween(rule, at[2], at[4]));
  const PieceSum four = add(add(SumBetween(rule, at[0], at[1]), SumBetween(rule, at[1], at[2])),
    add(SumBetween(rule, at[2], at[3]), SumBetween(rule, at[3], at[4])));
  PieceSums s;
  s.Sum = four.Mean * 0.25f;
  s.Share = four.Share * 0.25f;
  const Floats offSum = Abs(s.Sum - 0.5f * two.Mean);
  const Floats offShare = Abs(s.Share - 0.5f * two.Share);
  s.Exact = (offSum <= SumTolerance * s.Sum + LeastSumTolerance) &
    (offShare <= SumTolerance * s.Share + LeastSumTolerance);
  return s;
}

// What a cell adds to sums: the integral of the table, and the length where values count.
struct CellSum
{
  float Sum;
  float Length;
};

// Of a part of a cell that isn't smooth: in eighths and eighths of those.
inline void SumInParts(const SumRule& rule, const Cubic& f, float from, float to, float length,
  CellSum& sum, std::uint32_t& steps)
{
  const Floats eighths = { 0.0f, 0.125f, 0.25f, 0.375f, 0.5f, 0.625f, 0.75f, 0.875f };
  const Floats begin = from + (to - from) * eighths;
  const Floats end = from + (to - from) * (eighths + 0.125f);
  const PieceSums s = SumsOf(rule, f, begin, end);
  steps += 4;
  const float part = length * 0.125f;
  for (int l = 0; l < Lanes; ++l)
  {
    if (s.Exact[l] == 0 && to - from > 8.0f * SmallestPiece)
    {
      SumInParts(rule, f, begin[l], end[l], part, sum, steps);
      continue;
    }
    sum.Sum += s.Sum[l] * part;
    sum.Length += s.Share[l] * part;
  }
}

// Of one of eight cells, of which `whole` are the sums as one piece.
inline CellSum SumOfCell(const SumRule& rule, const Cubic& field, const Turns& turns,
  const PieceSums& whole, int l, float length, std::uint32_t& steps)
{
  if (whole.Exact[l] != 0 && !(turns.First[l] < 1.0f))
  {
    return { whole.Sum[l] * length, whole.Share[l] * length };
  }
  const Cubic lane{ Splat(field.A[l]), Splat(field.B[l]), Splat(field.C[l]), Splat(field.D[l]) };
  CellSum sum{ 0, 0 };
  // Nothing is missed between the ends of a part that doesn't turn.
  const float ends[4] = { 0.0f, turns.First[l], turns.Second[l], 1.0f };
  for (int i = 0; i < 3; ++i)
  {
    if (ends[i] < ends[i + 1])
    {
      SumInParts(rule, lane, ends[i], ends[i + 1], (ends[i + 1] - ends[i]) * length, sum, steps);
    }
  }
  return sum;
}
