// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Pixels between those whose rays have been cast (M. Levoy, "Volume rendering by adaptive
// refinement", The Visual Computer 6, 1990): interpolated where the picture is smooth around them
// and no voxel can hide between the rays, else cast themselves. Where a ray that was cast isn't
// what interpolation would have given, the picture only looked smooth: pixels next to it are cast,
// too, and theirs in turn. Which ones there are is told by Core/ImageLattice.h.

// Of the largest second difference around a pixel, what interpolation is taken to err. With many
// rays per voxel it errs by 3/8 of it at a kink and by 1/2 at a step; with one, a voxel in the
// middle of four rays that is the largest of all around it raises each of them by a quarter of what
// it does in the middle, of which a cubic sees a third: 11/4.
constexpr float LeastWeight = 0.4f;
constexpr float LargestWeight = 2.75f;

constexpr std::uint8_t RayDeferred = NativeScene::RayDeferred;
constexpr std::uint8_t RayInside = NativeScene::RayInside;
constexpr std::uint8_t RayBetween = NativeScene::RayBetween;
constexpr std::uint8_t RaySurprising = NativeScene::RaySurprising;
constexpr std::uint8_t RayJudged = NativeScene::RayJudged;

inline std::size_t PixelAt(const NativeScene& scene, int x, int y)
{
  return static_cast<std::size_t>(y) * static_cast<std::size_t>(scene.Width) +
    static_cast<std::size_t>(x);
}

// Threads read marks of neighbours while these change: none of the bits that a step reads of others
// is written in it.
inline std::uint8_t LoadMarks(const NativeScene& scene, std::size_t pixel)
{
  return __atomic_load_n(scene.Lattice + pixel, __ATOMIC_RELAXED);
}
inline void StoreMarks(const NativeScene& scene, std::size_t pixel, int marks)
{
  __atomic_store_n(scene.Lattice + pixel, static_cast<std::uint8_t>(marks), __ATOMIC_RELAXED);
}

TERAVOX_INLINE Quad ColorAt(const NativeScene& scene, std::size_t pixel)
{
  Quad color;
  __builtin_memcpy(&color, scene.Color + 4 * pixel, sizeof(color));
  return color;
}
TERAVOX_INLINE float LargestOfFour(Quad v)
{
  return Max(Largest(v), v[3]);
}

// The lattice around a pixel that is decided on: four by four rays, whose lines stand upright
// around a centre and on their tips around the middle of an edge.
struct Neighbourhood
{
  Quad Ray[4][4];
  std::size_t Nearest[4];
};

// The pixel of the lattice at i and j: -3, -1, 1, 3.
inline std::size_t LatticePixel(const NativeScene& scene, std::size_t pixel, std::ptrdiff_t half,
  bool center, std::ptrdiff_t i, std::ptrdiff_t j)
{
  const auto width = static_cast<std::ptrdiff_t>(scene.Width);
  const std::ptrdiff_t x = center ? i : (i + j) / 2;
  const std::ptrdiff_t y = center ? j : (i - j) / 2;
  return static_cast<std::size_t>(static_cast<std::ptrdiff_t>(pixel) + half * (x + width * y));
}

inline void TakeNearest(
  const NativeScene& scene, std::size_t pixel, std::ptrdiff_t half, bool center, Neighbourhood& n)
{
  n.Nearest[0] = LatticePixel(scene, pixel, half, center, -1, -1);
  n.Nearest[1] = LatticePixel(scene, pixel, half, center, -1, 1);
  n.Nearest[2] = LatticePixel(scene, pixel, half, center, 1, -1);
  n.Nearest[3] = LatticePixel(scene, pixel, half, center, 1, 1);
}

inline void TakeRaysAround(
  const NativeScene& scene, std::size_t pixel, std::ptrdiff_t half, bool center, Neighbourhood& n)
{
  for (int i = 0; i < 4; ++i)
  {
    for (int j = 0; j < 4; ++j)
    {
      n.Ray[i][j] = ColorAt(scene, LatticePixel(scene, pixel, half, center, 2 * i - 3, 2 * j - 3));
    }
  }
}

// The largest second difference along the lines of the lattice, of four channels.
inline float LargestDifference(const Neighbourhood& n)
{
  Quad most = {};
  const auto note = [&](Quad a, Quad b, Quad c, Quad d)
  { most = Max(most, Max(Abs((a - b) - (b - c)), Abs((b - c) - (c - d)))); };
  for (int i = 0; i < 4; ++i)
  {
    note(n.Ray[i][0], n.Ray[i][1], n.Ray[i][2], n.Ray[i][3]);
    note(n.Ray[0][i], n.Ray[1][i], n.Ray[2][i], n.Ray[3][i]);
  }
  return LargestOfFour(most);
}

// Cubic in both directions.
inline Quad InTheMiddle(const Neighbourhood& n)
{
  const auto cubic = [](Quad a, Quad b, Quad c, Quad d)
  { return 0.5625f * (b + c) - 0.0625f * (a + d); };
  Quad rows[4];
  for (int i = 0; i < 4; ++i)
  {
    rows[i] = cubic(n.Ray[i][0], n.Ray[i][1], n.Ray[i][2], n.Ray[i][3]);
  }
  return cubic(rows[0], rows[1], rows[2], rows[3]);
}

// How far the nearest ray passes by a pixel at a depth, in voxels of the level there, if `pixels`
// away in x (and y, too, if `both`).
inline float NearestRay(const MarchParameters& p, int level, float depth, float pixels, bool both)
{
  const Quad f = 1.0f / ToFloat(Load(p.LevelFactor[static_cast<std::size_t>(level)]));
  const Quad x = (Load(p.RayOrigin[1]) + depth * Load(p.RayDirection[1])) * f;
  const Quad y = (Load(p.RayOrigin[2]) + depth * Load(p.RayDirection[2])) * f;
  const auto squared = [](Quad v) { return (v[0] * v[0] + v[1] * v[1]) + v[2] * v[2]; };
  const float a = squared(x);
  const float b = squared(y);
  return pixels * SquareRoot(both ? a + b : Max(a, b));
}

// Where rays enter the volume, or what is left of it, and where they leave it (FindInterval()), for
// the pixels of a tile and around it at distances of `Step`. Opaque geometry isn't asked after.
// Cropped volumes and blocks have no lattice.
struct Faces
{
  static constexpr int Most = static_cast<int>(shared::TILE_SIZE) + 8;
  int Left = 0;
  int Bottom = 0;
  int Step = 0;
  float Begin[Most * Most];
  float End[Most * Most];

  std::size_t At(int x, int y) const
  {
    return static_cast<std::size_t>((y - this->Bottom) / this->Step) * Most +
      static_cast<std::size_t>((x - this->Left) / this->Step);
  }
};

TERAVOX_INLINE void FindIntervals(
  const NativeScene& scene, Floats x, float y, Floats& first, Floats& last)
{
  const MarchParameters& p = *scene.Parameters;
  const IntervalParameters& v = *scene.Intervals;
  const auto at = [&](const std::array<Vec, 3>& of, std::size_t a)
  { return (of[0][a] + x * of[1][a]) + y * of[2][a]; };
  Floats directions[3];
  Floats largest = {};
  for (std::size_t a = 0; a < 3; ++a)
  {
    directions[a] = at(p.RayDirection, a);
    largest = Max(largest, Abs(directions[a]));
  }
  const Floats tiny = 1.0e-12f * largest; // as in MakeRay()
  first = Splat(v.Near);
  last = Splat(v.Far);
  for (std::size_t a = 0; a < 3; ++a)
  {
    const Floats inverse = 1.0f / Select(Abs(directions[a]) < tiny, tiny, directions[a]);
    const Floats origin = at(p.RayOrigin, a);
    const Floats low = (v.BoxLow[a] - origin) * inverse;
    const Floats high = (v.BoxHigh[a] - origin) * inverse;
    first = Max(first, Min(low, high));
    last = Min(last, Max(low, high));
  }
  for (int i = 0; i < scene.NumberOfPlanes; ++i)
  {
    const float* w = scene.Planes + 8 * i;
    const Floats from = (w[0] + w[1] * x) + w[2] * y;
    const Floats slope = (w[4] + w[5] * x) + w[6] * y;
    const Floats cut = -from / slope;
    first = Select(slope > 0.0f, Max(first, cut), first);
    last =
      Select(slope < 0.0f, Min(last, cut), Select((slope == 0.0f) & (from < 0.0f), first, last));
  }
}

// half: pixels to the nearest rays.
inline void FindFaces(
  const NativeScene& scene, int left, int bottom, int right, int top, int half, Faces& faces)
{
  faces.Left = left - half;
  faces.Bottom = bottom - half;
  faces.Step = half;
  const Floats lanes = { 0.0f, 1.0f, 2.0f, 3.0f, 4.0f, 5.0f, 6.0f, 7.0f };
  for (int y = faces.Bottom; y <= top + half; y += half)
  {
    for (int x = faces.Left; x <= right + half; x += Lanes * half)
    {
      Floats first;
      Floats last;
      FindIntervals(scene, (static_cast<float>(x) + 0.5f) + static_cast<float>(half) * lanes,
        static_cast<float>(y) + 0.5f, first, last);
      const std::size_t at = faces.At(x, y);
      __builtin_memcpy(faces.Begin + at, &first, sizeof(first));
      __builtin_memcpy(faces.End + at, &last, sizeof(last));
    }
  }
}

// Around a pixel: how far apart along the rays the places are where they and the nearest ones enter
// the volume, or what is left of it, and where they leave it, in voxels of the level there. On a
// face that is seen at a grazing angle neighbours meet voxels that have nothing to do with each
// other.
inline float ApartOnFaces(
  const NativeScene& scene, const Faces& faces, int x, int y, bool center, int level, bool over)
{
  const MarchParameters& p = *scene.Parameters;
  const std::size_t here = faces.At(x, y);
  constexpr std::ptrdiff_t row = Faces::Most;
  const std::ptrdiff_t nearest[4] = { center ? -row - 1 : -row, center ? 1 - row : -1,
    center ? row - 1 : 1, center ? row + 1 : row };
  float most = 0;
  for (const std::ptrdiff_t offset : nearest)
  {
    const auto other = static_cast<std::size_t>(static_cast<std::ptrdiff_t>(here) + offset);
    if (!(faces.Begin[other] < faces.End[other]))
    {
      return FarAway;
    }
    // Behind rays that are over nothing is seen of the face where they would leave.
    most = Max(most,
      Max(Abs(faces.Begin[other] - faces.Begin[here]),
        over ? 0.0f : Abs(faces.End[other] - faces.End[here])));
  }
  const Quad direction =
    AtPixel(p.RayDirection, static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f) *
    (1.0f / ToFloat(Load(p.LevelFactor[static_cast<std::size_t>(level)])));
  return most *
    SquareRoot(
      (direction[0] * direction[0] + direction[1] * direction[1]) + direction[2] * direction[2]);
}

// A pixel that may be interpolated: the rays around it, and what is known of those next to it.
struct Between
{
  Neighbourhood Around;
  float Difference = 0;
  float Missed = 0;
  float Reach = -FarAway;
  float Spent = 0;
  bool Over = true;
  bool Inside = true;
};

inline bool HasNeighbourhood(const NativeScene& scene, int x, int y, int half)
{
  return x >= 3 * half && y >= 3 * half && x + 3 * half < scene.Width &&
    y + 3 * half < scene.Height;
}

// Returns whether the rays next to it let it be interpolated, whatever their colours.
inline bool LookBeside(const NativeScene& scene, const std::size_t (&nearest)[4], Between& b)
{
  for (const std::size_t n : nearest)
  {
    b.Inside = b.Inside && (scene.Lattice[n] & RayInside) != 0;
    b.Missed = Max(b.Missed, scene.Missed[n]);
    b.Reach = Max(b.Reach, scene.Reach[n]);
    b.Spent = Max(b.Spent, scene.Error != nullptr ? scene.Error[n] : 0.0f);
    b.Over = b.Over && scene.Color[4 * n + 3] <= scene.Parameters->Step[2];
  }
  return b.Inside && b.Missed <= scene.LatticeMissed;
}

// What of Difference interpolation is taken to err. nearest: see NearestRay().
inline float WeightAt(float nearest)
{
  return Min(Max(LargestWeight * 2.0f * nearest * nearest, LeastWeight), LargestWeight);
}

// Whether the ray of a pixel is over, which may be so before its stage (NativeView::CastAll()).
inline bool IsDone(const NativeScene& scene, std::size_t pixel)
{
  return (scene.Position[4 * pixel + 3] >> 16 & 3) == StatusDone;
}

// Whether a pixel may be interpolated; if it may, that is done, but for a ray that is over, unless
// `always`: it may have to stay what it is. Nothing reads the pixel before its stage is over. half:
// pixels to the nearest rays along x, y or both.
inline bool IsInterpolated(
  const NativeScene& scene, const Faces& faces, int x, int y, int half, bool center, bool always)
{
  const MarchParameters& p = *scene.Parameters;
  const std::size_t pixel = PixelAt(scene, x, y);
  if (!HasNeighbourhood(scene, x, y, half))
  {
    return false;
  }
  Between b;
  const float begin = faces.Begin[faces.At(x, y)];
  const float end = faces.End[faces.At(x, y)];
  TakeNearest(scene, pixel, half, center, b.Around);
  if (!(begin < end) || !LookBeside(scene, b.Around.Nearest, b))
  {
    return false;
  }
  if (scene.Intervals->HasDepth)
  {
    // The edge of what is in front would have to be known.
    bool clear = scene.Depth[pixel] >= 1.0f;
    for (const std::size_t n : b.Around.Nearest)
    {
      clear = clear && scene.Depth[n] >= 1.0f;
    }
    if (!clear)
    {
      return false;
    }
  }
  TakeRaysAround(scene, pixel, half, center, b.Around);
  b.Difference = LargestDifference(b.Around);
  if (!(b.Difference * LeastWeight <= scene.LatticeTolerance))
  {
    return false;
  }
  const int level = LevelAt(p, begin);
  const float depth = b.Over ? b.Reach : end;
  if (LevelAt(p, depth) != level)
  {
    return false;
  }
  const float nearest = NearestRay(p, level, Max(begin, depth), static_cast<float>(half), center);
  if (!(nearest <= scene.LatticeDistance &&
        b.Difference * WeightAt(nearest) <= scene.LatticeTolerance))
  {
    return false;
  }
  if (b.Difference > 0.0f &&
    !(ApartOnFaces(scene, faces, x, y, center, level, b.Over) <= scene.LatticeDistance))
  {
    return false;
  }
  if (!always && IsDone(scene, pixel))
  {
    return true;
  }
  const Quad none = {};
  Quad value = Max(InTheMiddle(b.Around), none);
  value = WithFourth(value, Min(value[3], 1.0f));
  __builtin_memcpy(scene.Color + 4 * pixel, &value, sizeof(value));
  scene.Missed[pixel] = b.Missed;
  scene.Reach[pixel] = b.Reach;
  if (scene.Error != nullptr)
  {
    scene.Error[pixel] = b.Spent + b.Difference * WeightAt(nearest) + b.Missed;
  }
  return true;
}

// Makes a pixel that was interpolated a ray that begins.
inline void BeginAnew(const NativeScene& scene, std::size_t pixel)
{
  const Quad nothing = { 0.0f, 0.0f, 0.0f, 1.0f };
  __builtin_memcpy(scene.Color + 4 * pixel, &nothing, sizeof(nothing));
  scene.Missed[pixel] = 0.0f;
  scene.Reach[pixel] = NativeScene::NothingReached;
  if (scene.Error != nullptr)
  {
    scene.Error[pixel] = 0.0f;
  }
}

// Whether one of the pixels next to one that a stage adds, of those that it adds, is marked.
inline bool HasNeighbour(
  const NativeScene& scene, int x, int y, int half, bool center, std::uint8_t mark)
{
  const int step = center ? 2 * half : half;
  for (int v = -2 * half; v <= 2 * half; v += step)
  {
    for (int u = -2 * half; u <= 2 * half; u += step)
    {
      // Of the middles of edges, those whose steps in x and in y have the same parity.
      const bool added = center || ((u + v) / half & 1) == 0;
      const bool there = x + u >= 0 && y + v >= 0 && x + u < scene.Width && y + v < scene.Height;
      if ((u != 0 || v != 0) && added && there &&
        (LoadMarks(scene, PixelAt(scene, x + u, y + v)) & mark) != 0)
      {
        return true;
      }
    }
  }
  return false;
}

// Whether interpolation would have given a pixel that was cast another colour.
inline bool IsSurprising(const NativeScene& scene, int x, int y, int half, bool center)
{
  if (!HasNeighbourhood(scene, x, y, half))
  {
    return false;
  }
  const std::size_t pixel = PixelAt(scene, x, y);
  Neighbourhood around;
  TakeRaysAround(scene, pixel, half, center, around);
  const Quad off = InTheMiddle(around) - ColorAt(scene, pixel);
  return !(LargestOfFour(Abs(off)) <= scene.LatticeTolerance);
}

// One step of a stage at one of the pixels that it adds.
inline void RefinePixel(const NativeScene& scene, const Faces& faces, LatticeStep step, int x,
  int y, int half, bool center, LatticeCount& count)
{
  const std::size_t pixel = PixelAt(scene, x, y);
  const std::uint8_t marks = LoadMarks(scene, pixel);
  const bool between = (marks & RayBetween) != 0;
  if (step == LatticeStep::Choose && IsInterpolated(scene, faces, x, y, half, center, false))
  {
    StoreMarks(scene, pixel, marks | RayBetween);
  }
  else if (step == LatticeStep::Choose ||
    (step == LatticeStep::Spread && between &&
      HasNeighbour(scene, x, y, half, center, RaySurprising)))
  {
    const bool done = IsDone(scene, pixel);
    if (between && !done)
    {
      BeginAnew(scene, pixel);
    }
    StoreMarks(scene, pixel, marks & RayInside);
    count.Chosen += 1;
    count.ToCast += done ? 0 : 1;
  }
  else if (step == LatticeStep::Judge && !between && (marks & RayJudged) == 0)
  {
    // Those beside it that are interpolated only become fewer.
    const bool surprising = HasNeighbour(scene, x, y, half, center, RayBetween) &&
      IsSurprising(scene, x, y, half, center);
    StoreMarks(scene, pixel, marks | RayJudged | (surprising ? RaySurprising : 0));
    count.Surprising += surprising ? 1 : 0;
  }
  else if (step == LatticeStep::Fill && between)
  {
    if (IsDone(scene, pixel))
    {
      Faces around;
      FindFaces(scene, x, y, x, y, half, around);
      IsInterpolated(scene, around, x, y, half, center, true);
    }
    StoreMarks(scene, pixel, RayInside);
    scene.Position[4 * pixel + 3] = StatusDone << 16;
  }
}

// The first number from `from` on that is `rest` more than a multiple of `step`, a power of two.
constexpr int CeilTo(int from, int step, int rest)
{
  return from + ((rest - from) & (step - 1));
}

LatticeCount RefineTile(
  const NativeScene& scene, int stage, LatticeStep step, int left, int bottom, int right, int top)
{
  const int edge = LatticeEdge(stage);
  const int half = edge / 2;
  const bool center = stage % 2 == 0;
  LatticeCount count;
  Faces faces;
  if (step == LatticeStep::Choose)
  {
    FindFaces(scene, left, bottom, right, top, half, faces);
  }
  for (int y = CeilTo(bottom, half, 0); y < top; y += half)
  {
    const bool betweenRows = y % edge == half;
    if (center && !betweenRows)
    {
      continue;
    }
    for (int x = CeilTo(left, edge, center || !betweenRows ? half : 0); x < right; x += edge)
    {
      RefinePixel(scene, faces, step, x, y, half, center, count);
    }
  }
  return count;
}
