// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Rays, levels, bricks and the page table: Shaders/Library/Ray.glsl and PageWalk.glsl for one ray
// at a time. Faces and positions are computed from the ray and integer indices, never accumulated.

constexpr float FarAway = 3.0e38f;
constexpr float LargestInteger = 2147483520.0f; // of 32 bits that is a float

TERAVOX_INLINE float Dot(const Vec& a, Quad b)
{
  return (a[0] * b[0] + a[1] * b[1]) + a[2] * b[2];
}
TERAVOX_INLINE Quad Load(const Vec& v)
{
  Quad r;
  __builtin_memcpy(&r, v.data(), sizeof(r));
  return r;
}
TERAVOX_INLINE Index Load(const UVec& v)
{
  Index r;
  __builtin_memcpy(&r, v.data(), sizeof(r));
  return r;
}

// The fourth lanes are such that nothing is ever met there.
struct Ray
{
  Quad Origin;    // anchored corner coordinates of level 0 at depth 0
  Quad Direction; // voxels of level 0 per unit of depth; no component is 0
  Quad Inverse;
  Index Positive; // 1 where the direction is > 0
  float World;    // world length per unit of depth
};

TERAVOX_INLINE Quad AtPixel(const std::array<Vec, 3>& v, float x, float y)
{
  return (Load(v[0]) + x * Load(v[1])) + y * Load(v[2]);
}

inline Ray MakeRay(const MarchParameters& p, float x, float y)
{
  Ray ray;
  ray.Origin = WithFourth(AtPixel(p.RayOrigin, x, y), 0.0f);
  const Quad none = {};
  Quad d = WithFourth(AtPixel(p.RayDirection, x, y), 0.0f);
  const Quad w = AtPixel(p.RayWorld, x, y);
  // A component that is 0 never meets a face; a tiny one meets it very far away.
  const Quad size = d < none ? -d : d;
  const float tiny = 1.0e-12f * Largest(size);
  d = size < Spread(tiny) ? Spread(tiny) : d;
  ray.Inverse = WithFourth(1.0f / d, FarAway);
  ray.Positive = WithFourth(reinterpret_cast<Index>((d > none) & 1), 1);
  ray.Direction = WithFourth(d, 0.0f);
  ray.World = SquareRoot((w[0] * w[0] + w[1] * w[1]) + w[2] * w[2]);
  return ray;
}

// A face of level 0 relative to the anchor; exact as long as |difference| < 2^24, else rounded
// monotonically.
TERAVOX_INLINE Quad Anchored(const MarchParameters& p, Index face)
{
  const Index size = Load(p.Dimensions);
  return ToFloat((face < size ? face : size) - Load(p.Anchor));
}

struct Level
{
  Index Edge;          // of a brick, in voxels of level 0
  Index Bricks;        // along each axis
  std::uint32_t Base;  // in the page directory
  std::uint32_t Depth; // of its page hierarchy
  float Begin;         // depths
  float End;
};

inline Level LoadLevel(const MarchParameters& p, int level)
{
  const auto l = static_cast<std::size_t>(level);
  Level r;
  // One brick of no extent in the fourth lane.
  r.Edge = WithFourth(p.Dimensions[3] * Load(p.LevelFactor[l]), 1);
  r.Bricks = WithFourth(Load(p.LevelBricks[l]), 1);
  r.Base = p.LevelFactor[l][3];
  r.Depth = p.LevelBricks[l][3];
  r.Begin = level > static_cast<int>(p.Levels[1]) ? p.LevelStart[l][0] : -FarAway;
  r.End = level < static_cast<int>(p.Levels[2]) ? p.LevelStart[l + 1][0] : FarAway;
  return r;
}

// Depths at which the ray crosses the faces with these brick indices of a level; far away in the
// fourth lane, if its index is not 0.
TERAVOX_INLINE Quad FaceDepths(
  const MarchParameters& p, const Ray& ray, const Level& level, Index index)
{
  return (Anchored(p, index * level.Edge) - ray.Origin) * ray.Inverse;
}

TERAVOX_INLINE Quad EntryDepths(
  const MarchParameters& p, const Ray& ray, const Level& level, Index b)
{
  return FaceDepths(p, ray, level, b + 1 - ray.Positive);
}

TERAVOX_INLINE Quad ExitDepths(
  const MarchParameters& p, const Ray& ray, const Level& level, Index b)
{
  return FaceDepths(p, ray, level, b + ray.Positive);
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
  const Index anchor = Load(p.Anchor);
  const Index last = Load(p.Dimensions) - 1;
  const Quad low = -ToFloat(anchor);
  const Quad high = Min(ToFloat(last - anchor), Spread(LargestInteger));
  Quad at = ray.Origin + t * ray.Direction;
  at = at < low ? low : at > high ? high : at;
  // Once more as integers: floats round the ends of a large volume to beyond them.
  const auto lowest = reinterpret_cast<QuadMask>(-anchor);
  const auto highest = reinterpret_cast<QuadMask>(last - anchor);
  QuadMask cell = __builtin_convertvector(Floor(at), QuadMask);
  cell = cell < lowest ? lowest : cell > highest ? highest : cell;
  const Index voxel = anchor + reinterpret_cast<Index>(cell);
  const Index end = level.Bricks - 1;
  Index b = { voxel[0] / level.Edge[0], voxel[1] / level.Edge[1], voxel[2] / level.Edge[2], 0 };
  b = b < end ? b : end;
  const Index forward = 2 * ray.Positive - 1; // 1 or -1
  for (int i = 0; i < 4; ++i)
  {
    const auto passed = reinterpret_cast<Index>(ExitDepths(p, ray, level, b) <= Spread(t));
    const auto ahead = reinterpret_cast<Index>(EntryDepths(p, ray, level, b) > Spread(t));
    // Masks are -1: forward where the exit has been passed, back where the entry is ahead.
    const Index next = b + WithFourth(forward * (ahead - passed), 0);
    // Not beyond the level: below 0 is a large number.
    const Index inside = next <= end ? next : b;
    if (Bits(reinterpret_cast<QuadMask>(inside != b)) == 0)
    {
      break;
    }
    b = inside;
  }
  return b;
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
  float Low = 0; // of a missing or failed one the ends of its range, in nodes
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

// `isEmpty`: whether nothing is to be seen of a region without any value, or with values between
// two positions in nodes.
template <typename IsEmpty>
TERAVOX_INLINE Found Translate(const NativeScene& scene, const Transfer& transfer,
  const Level& level, Index brick, const IsEmpty& isEmpty)
{
  const MarchParameters& p = *scene.Parameters;
  Found found;
  const auto depth = static_cast<int>(level.Depth);
  const std::uint32_t shift = shared::PAGE_SHIFT * level.Depth;
  const std::uint32_t columns = shared::PagesAlong(level.Bricks[0], level.Depth);
  const std::uint32_t rows = shared::PagesAlong(level.Bricks[1], level.Depth);
  std::size_t entry = level.Base + (brick[0] >> shift) +
    std::size_t{ columns } * ((brick[1] >> shift) + std::size_t{ rows } * (brick[2] >> shift));
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
    if (p.Switches[0] != 0 && isEmpty(none, from, to))
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
      found.Low = from;
      found.High = to;
      return found;
    }
    found.Slot = shared::PageSlot(words[0]);
    if (k == 0)
    {
      break;
    }
    Stamp(scene.UsedBlocks, found.Slot);
    const std::uint32_t down = shared::PAGE_SHIFT * static_cast<std::uint32_t>(k - 1);
    entry = p.Levels[3] + std::size_t{ found.Slot } * shared::PAGE_BLOCK_ENTRIES +
      shared::IndexInBlock(brick[0] >> down, brick[1] >> down, brick[2] >> down);
  }
  found.Kind = FoundKind::Mapped;
  Stamp(scene.UsedSlots, found.Slot);
  return found;
}

inline Found Translate(
  const NativeScene& scene, const Transfer& transfer, const Level& level, Index brick)
{
  return Translate(scene, transfer, level, brick,
    [&](bool none, float from, float to) { return none || IsEmptyBetween(transfer, from, to); });
}
