// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// The mean extinction of a piece of a ray.

// Whether the extinction is multiplied by a function of the gradient's magnitude: a kernel of its
// own (KernelGradient.h), so that the others have nothing of it.
#ifndef TERAVOX_GRADIENT_OPACITY
#define TERAVOX_GRADIENT_OPACITY 0
#endif
constexpr bool GradientOpacity = TERAVOX_GRADIENT_OPACITY != 0;
// The same kernel draws opacity and colour over value and magnitude (KernelPlane.h), of volumes
// without a mask; that for components those over two.
#define TERAVOX_GRADIENT_PLANE (TERAVOX_GRADIENT_OPACITY && !TERAVOX_MASK)
#define TERAVOX_TRANSFER_PLANE (TERAVOX_GRADIENT_PLANE || TERAVOX_COMPONENTS)

// TransferPlane; Nodes is null where there is none.
struct PlaneTable
{
  const float* Nodes;
  const float* Bounds;
  const std::int32_t* First; // of the levels of Bounds
  std::int32_t Columns;
  std::array<Vec, 2> Scale; // MarchParameters::Plane
};

struct Extinction
{
  Floats Mean;
  Floats Uneven; // |mean - half of the sum of the ends|, without the field's bend
  Floats Change; // how much the mean may be off
  Floats Off;   // how far the cubic is from the line between its ends, as a share of their distance
  Floats Ahead; // how far its mean is ahead of theirs, likewise
};

// Mean extinction between two samples of a cubic, `bend` twice the largest second derivative of
// that part and `excess` the mean of the cubic above the mean of its ends.
TERAVOX_INLINE Extinction MeanExtinction(
  const Sample<Floats>& a, const Sample<Floats>& b, Floats bend, Floats excess)
{
  const Floats dx = b.X - a.X;
  const Floats distance = Abs(dx);
  const Floats ds = (b.High - a.High) + (b.Low - a.Low);
  const Floats half = 0.5f * (a.S + b.S);
  const Floats one = Splat(1.0f);
  // Between two nodes the mean of the ends is exact, and nothing has to cancel; but for intervals
  // with a jump, which have no slope.
  const auto interval = [&](Floats x) { return Truncate(Max(x, -one) + 1.0f); };
  const Ints jump = (a.S != b.S) & (a.Slope == Floats{}) & (b.Slope == Floats{});
  const Ints wide = distance >= Select(jump, Splat(0.001f), Splat(0.015625f));
  const Floats inverse = one / Select(wide, dx, one);
  const Floats chord =
    Max(Select(wide & ((interval(a.X) != interval(b.X)) | jump), ds * inverse, half), Floats{});
  const Floats slope = Select(wide, (b.S - a.S) * inverse, 0.5f * (a.Slope + b.Slope));
  Extinction e;
  e.Mean = Max(chord + slope * excess, Floats{});
  e.Uneven = Abs(chord - half);
  const Floats off = 0.25f * bend;
  e.Off = Min(one, off / Max(distance, Splat(1.0e-3f)));
  e.Ahead = Select(wide, excess * inverse, Floats{});
  const Floats variation = Max(Abs(a.Slope - slope), Abs(b.Slope - slope));
  e.Change = Min(0.67f * variation * off + 4.0f * e.Uneven * e.Off, a.S + b.S + 2.0f * chord);
  return e;
}
