// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Cells whose corners may be visible while the ray sees nothing between them: a spot smaller than a
// voxel may lie beside the ray. Where the ray sees something in the next cell it is just the begin
// of that. What is noted depends on the cells that may be visible only, so not on what is skipped,
// nor on the lots that they come in.

// How long such a spot is taken to be, in voxels: what one voxel adds to the field reaches as far.
constexpr float SpotLength = 2.0f;

// Ends a run of cells.
inline void EndRun(Context& c)
{
  WatchState& w = c.Watch;
  if (!w.Seen)
  {
    float least = 0;
    float largest = 0;
    ExtremesBetween(c.Table, w.Least, w.Largest, least, largest);
    w.Missed = Max(w.Missed, w.Light * OpacityOf(largest * (SpotLength * w.Voxel)));
  }
  w.Seen = true;
  w.Least = FarAway;
  w.Largest = -FarAway;
}

inline void NoteSeen(Context& c, float end)
{
  c.Watch.Seen = true;
  c.Watch.End = end;
}

// Of a lot: the cells that may be visible, and those of which the ray sees something.
inline void NoteLot(Context& c, Floats begin, Floats end, Floats least, Floats largest,
  unsigned visible, unsigned seen)
{
  WatchState& w = c.Watch;
  if (visible == seen && w.Seen && visible != 0)
  {
    w.End = end[31 - __builtin_clz(visible)];
    return;
  }
  for (; visible != 0; visible &= visible - 1)
  {
    const int lane = __builtin_ctz(visible);
    if (begin[lane] > w.End)
    {
      EndRun(c);
      w.Seen = false;
    }
    w.Seen = w.Seen || (seen >> lane & 1) != 0;
    w.Least = Min(w.Least, least[lane]);
    w.Largest = Max(w.Largest, largest[lane]);
    w.End = end[lane];
  }
}
