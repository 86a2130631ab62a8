// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Where cubics turn.

// Where a cubic turns, ascending; 1 where it doesn't in (0, 1).
struct Turns
{
  Floats First;
  Floats Second;
};
TERAVOX_INLINE Turns TurnsOf(const Cubic& c)
{
  // Roots of B + 2 C u + 3 D u^2, without cancellation.
  const Floats zero = {};
  const Floats one = zero + 1.0f;
  const Floats discriminant = c.C * c.C - 3.0f * c.D * c.B;
  const Ints real = discriminant > zero;
  const Floats root = SquareRoot(Select(real, discriminant, zero));
  const Floats q = -(c.C + Select(c.C < zero, -root, root));
  const Floats a = q / (3.0f * c.D);
  const Floats b = c.B / q;
  const auto within = [&](Floats u) { return Select(real & (u > zero) & (u < one), u, one); };
  const Floats u = within(a);
  const Floats v = within(b);
  return { Min(u, v), Max(u, v) };
}

// Where pieces are cut. One that turns once is cut even where rounding hides a root; both ends of
// one that turns twice may see nothing of what it meets in between.
TERAVOX_INLINE Turns TurningPoints(const Cubic& c)
{
  const Floats three = 3.0f * c.D;
  const Floats end = c.B + (2.0f * c.C + three);
  const Ints crosses = (c.B > 0.0f) != (end > 0.0f);
  // The root at which the slope changes its sign as it does from 0 to 1, by the quotient in which
  // nothing cancels.
  const Floats discriminant = c.C * c.C - three * c.B;
  const Floats root = SquareRoot(Max(discriminant, Floats{}));
  const Floats signedRoot = Select(c.B > 0.0f, root, -root);
  const Ints alike = (c.B > 0.0f) == (c.C > 0.0f);
  const Floats u = Select(alike, -c.C - signedRoot, c.B) / Select(alike, three, signedRoot - c.C);
  const Floats one = Splat(1.0f);
  Turns turns{ Select(crosses & (u > 0.0f) & (u < 1.0f), u, one), one };
  const Ints twice = (discriminant > 0.0f) & (c.B * c.D > 0.0f) & (c.C * c.D < 0.0f) &
    (Abs(c.C) < Abs(three)) & ~crosses;
  if (Bits(twice) != 0)
  {
    const Turns both = TurnsOf(c);
    turns.First = Select(twice, both.First, turns.First);
    turns.Second = Select(twice, both.Second, one);
  }
  return turns;
}
