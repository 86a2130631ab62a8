// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Rays, levels, bricks and the page table: Shaders/Library/Ray.glsl and PageWalk.glsl for one ray
// at a time. Faces and positions are computed from the ray and integer indices, never accumulated.

constexpr float FarAway = 3.0e38f;

struct Vector
{
  float X;
  float Y;
  float Z;
};
struct Index
{
  std::uint32_t X;
  std::uint32_t Y;
  std::uint32_t Z;
};

inline float Least(const Vector& v)
{
  return Min(v.X, Min(v.Y, v.Z));
}
inline float Largest(const Vector& v)
{
  return Max(v.X, Max(v.Y, v.Z));
}
inline float Dot(const Vec& a, const Vector& b)
{
  return (a[0] * b.X + a[1] * b.Y) + a[2] * b.Z;
}
struct Ray
{
  Vector Origin;    // anchored corner coordinates of level 0 at depth 0
  Vector Direction; // voxels of level 0 per unit of depth; no component is 0
  Vector Inverse;
  Index Positive; // 1 where the direction is > 0
  float World;    // world length per unit of depth
};

inline Vector AtPixel(const std::array<Vec, 3>& v, float x, float y)
{
  return { (v[0][0] + x * v[1][0]) + y * v[2][0], (v[0][1] + x * v[1][1]) + y * v[2][1],
    (v[0][2] + x * v[1][2]) + y * v[2][2] };
}

inline Ray MakeRay(const MarchParameters& p, float x, float y)
{
  Ray ray;
  ray.Origin = AtPixel(p.RayOrigin, x, y);
  Vector d = AtPixel(p.RayDirection, x, y);
  const Vector w = AtPixel(p.RayWorld, x, y);
  // A component that is 0 never meets a face; a tiny one meets it very far away.
  const float tiny = 1.0e-12f * Max(Abs(d.X), Max(Abs(d.Y), Abs(d.Z)));
  d.X = Abs(d.X) < tiny ? tiny : d.X;
  d.Y = Abs(d.Y) < tiny ? tiny : d.Y;
  d.Z = Abs(d.Z) < tiny ? tiny : d.Z;
  ray.Direction = d;
  ray.Inverse = { 1.0f / d.X, 1.0f / d.Y, 1.0f / d.Z };
  ray.Positive = { d.X > 0 ? 1u : 0u, d.Y > 0 ? 1u : 0u, d.Z > 0 ? 1u : 0u };
  ray.World = SquareRoot((w.X * w.X + w.Y * w.Y) + w.Z * w.Z);
  return ray;
}

// A face of level 0 relative to the anchor; exact as long as |difference| < 2^24, else rounded
// monotonically.
inline float Anchored(std::uint32_t face, std::uint32_t size, std::uint32_t anchor)
{
  return static_cast<float>(static_cast<std::int32_t>(Min(face, size) - anchor));
}

struct Level
{
  Index Edge;   // of a brick, in voxels of level 0
  Index Bricks; // along each axis
  std::uint32_t Base; // in the page directory
  float Begin;        // depths
  float End;
};

inline Level LoadLevel(const MarchParameters& p, int level)
{
  const auto l = static_cast<std::size_t>(level);
  const UVec& factor = p.LevelFactor[l];
  const std::uint32_t size = p.Dimensions[3];
  Level r;
  r.Edge = { size * factor[0], size * factor[1], size * factor[2] };
  r.Bricks = { p.LevelBricks[l][0], p.LevelBricks[l][1], p.LevelBricks[l][2] };
  r.Base = factor[3];
  r.Begin = level > static_cast<int>(p.Levels[1]) ? p.LevelStart[l][0] : -FarAway;
  r.End = level < static_cast<int>(p.Levels[2]) ? p.LevelStart[l + 1][0] : FarAway;
  return r;
}

// Depths at which the ray crosses the faces with these brick indices of a level.
inline Vector FaceDepths(const MarchParameters& p, const Ray& ray, const Level& level, Index index)
{
  const UVec& n = p.Dimensions;
  return { (Anchored(index.X * level.Edge.X, n[0], p.Anchor[0]) - ray.Origin.X) * ray.Inverse.X,
    (Anchored(index.Y * level.Edge.Y, n[1], p.Anchor[1]) - ray.Origin.Y) * ray.Inverse.Y,
    (Anchored(index.Z * level.Edge.Z, n[2], p.Anchor[2]) - ray.Origin.Z) * ray.Inverse.Z };
}

inline Vector EntryDepths(const MarchParameters& p, const Ray& ray, const Level& level, Index b)
{
  return FaceDepths(p, ray, level,
    { b.X + 1 - ray.Positive.X, b.Y + 1 - ray.Positive.Y, b.Z + 1 - ray.Positive.Z });
}

inline Vector ExitDepths(const MarchParameters& p, const Ray& ray, const Level& level, Index b)
{
  return FaceDepths(
    p, ray, level, { b.X + ray.Positive.X, b.Y + ray.Positive.Y, b.Z + ray.Positive.Z });
}

// lambda: the level at a depth.
inline int LevelAt(const MarchParameters& p, float t)
{
  int level = static_cast<int>(p.Levels[1]);
  while (level < static_cast<int>(p.Levels[2]) &&
    t >= p.LevelStart[static_cast<std::size_t>(level) + 1][0])
  {
    ++level;
  }
  return level;
}

// The brick at a depth: on each axis the one whose entry face has been met and whose exit face
// hasn't. Exactly what stepping from face to face arrives at, so that a jump over an empty region
// changes nothing.
inline Index BrickAt(const MarchParameters& p, const Ray& ray, const Level& level, float t)
{
  const auto along = [&](float origin, float direction, float inverse, std::uint32_t positive,
                       std::uint32_t edge, std::uint32_t bricks, std::size_t a)
  {
    const std::uint32_t size = p.Dimensions[a];
    const std::uint32_t anchor = p.Anchor[a];
    const float at = origin + t * direction;
    const float low = -static_cast<float>(anchor);
    const float high = static_cast<float>(size - 1 - anchor);
    const std::uint32_t voxel =
      anchor + static_cast<std::uint32_t>(Floor(Min(Max(at, low), high)));
    std::uint32_t b = Min(Min(voxel, size - 1) / edge, bricks - 1);
    for (int i = 0; i < 4; ++i)
    {
      const float exit = (Anchored((b + positive) * edge, size, anchor) - origin) * inverse;
      const float entry = (Anchored((b + 1 - positive) * edge, size, anchor) - origin) * inverse;
      const int move = ((exit <= t ? 1 : 0) - (entry > t ? 1 : 0)) * (positive != 0 ? 1 : -1);
      if (move == 0 || (move < 0 && b == 0) || (move > 0 && b == bricks - 1))
      {
        break;
      }
      b = move > 0 ? b + 1 : b - 1;
    }
    return b;
  };
  return { along(ray.Origin.X, ray.Direction.X, ray.Inverse.X, ray.Positive.X, level.Edge.X,
             level.Bricks.X, 0),
    along(ray.Origin.Y, ray.Direction.Y, ray.Inverse.Y, ray.Positive.Y, level.Edge.Y,
      level.Bricks.Y, 1),
    along(ray.Origin.Z, ray.Direction.Z, ray.Inverse.Z, ray.Positive.Z, level.Edge.Z,
      level.Bricks.Z, 2) };
}

enum class FoundKind
{
  Empty,   // the transfer function is 0 on the region of page level Region
  Single,  // one value, (Low, High) as a float pair
  Mapped,  // in atlas slot Slot
  Missing, // the brick, or a page block on the way
  Failed   // can't be read
};

struct Found
{
  FoundKind Kind = FoundKind::Missing;
  std::uint32_t Slot = 0;
  int Region = 0;
  float Low = 0;
  float High = 0;
};

inline void Stamp(std::uint8_t* stamps, std::uint32_t at)
{
  // Read first: stamps of one slot are set by many rays of several threads.
  if (__atomic_load_n(stamps + at, __ATOMIC_RELAXED) == 0)
  {
    __atomic_store_n(stamps + at, std::uint8_t{ 1 }, __ATOMIC_RELAXED);
  }
}

inline Found Translate(const NativeScene& scene, const Transfer& transfer, const Level& level,
  Index brick)
{
  const MarchParameters& p = *scene.Parameters;
  Found found;
  const auto depth = static_cast<int>(p.Levels[3]);
  const std::uint32_t shift = shared::PAGE_SHIFT * static_cast<std::uint32_t>(depth);
  const std::uint32_t columns = shared::PagesAlong(level.Bricks.X, p.Levels[3]);
  const std::uint32_t rows = shared::PagesAlong(level.Bricks.Y, p.Levels[3]);
  std::size_t entry = level.Base + (brick.X >> shift) +
    std::size_t{ columns } * ((brick.Y >> shift) + std::size_t{ rows } * (brick.Z >> shift));
  for (int k = depth; k >= 0; --k)
  {
    const std::uint32_t* words = scene.PageTable + 3 * entry;
    const std::uint32_t state = shared::PageState(words[0]);
    const float low = AsFloat(static_cast<std::int32_t>(words[1]));
    const float high = AsFloat(static_cast<std::int32_t>(words[2]));
    // A single value is a pair of floats, else these are the ends of the range.
    const bool single = state == shared::PAGE_SINGLE;
    const float from = TransferPosition(transfer, low, single ? high : 0.0f);
    const float to = single ? from : TransferPosition(transfer, high, 0.0f);
    const bool none = !single && low > high; // no value at all
    if (p.Switches[0] != 0 && (none || IsEmptyBetween(transfer, from, to)))
    {
      found.Kind = FoundKind::Empty;
      found.Region = single ? 0 : k;
      return found;
    }
    if (single)
    {
      found.Kind = FoundKind::Single;
      found.Low = low;
      found.High = high;
      return found;
    }
    if (state != shared::PAGE_MAPPED)
    {
      found.Kind = state == shared::PAGE_FAILED ? FoundKind::Failed : FoundKind::Missing;
      return found;
    }
    found.Slot = shared::PageSlot(words[0]);
    if (k == 0)
    {
      break;
    }
    Stamp(scene.UsedBlocks, found.Slot);
    const std::uint32_t down = shared::PAGE_SHIFT * static_cast<std::uint32_t>(k - 1);
    entry = p.LevelBricks[0][3] + std::size_t{ found.Slot } * shared::PAGE_BLOCK_ENTRIES +
      shared::IndexInBlock(brick.X >> down, brick.Y >> down, brick.Z >> down);
  }
  found.Kind = FoundKind::Mapped;
  Stamp(scene.UsedSlots, found.Slot);
  return found;
}
