// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Voxels of a resident brick, and the trilinear field between eight of them along a ray (see
// Shaders/Library/Atlas.glsl): a cubic, known exactly from the corners.

constexpr float Border = 2.0f;

// A brick in the atlas, seen from a ray: local corner coordinates (border included) are
// Base + t * Direction.
struct BrickView
{
  Vector Base;
  Vector Direction;
  const std::uint8_t* Voxels;
  const std::uint8_t* Cells;
  std::int32_t Edge;       // stored voxels along each axis
  std::int32_t CellsAlong; // ranges along each axis
  float Scale; // data value above the transfer function's lower end = Scale * texel + Offset
  float Offset;
  float PerVoxelX; // of a central difference of texels, to data per voxel of level 0
  float PerVoxelY;
  float PerVoxelZ;
};

inline BrickView ViewBrick(const NativeScene& scene, const Transfer& transfer, const Ray& ray,
  int level, Index brick, std::uint32_t slot)
{
  const MarchParameters& p = *scene.Parameters;
  const UVec& factor = p.LevelFactor[static_cast<std::size_t>(level)];
  const std::uint32_t size = p.Dimensions[3];
  BrickView view;
  const auto along = [&](std::uint32_t b, std::size_t a, float origin, float direction, float& base,
                       float& perDepth)
  {
    const float f = 1.0f / static_cast<float>(factor[a]); // exact for powers of two
    const float face = Anchored(b * size * factor[a], p.Dimensions[a], p.Anchor[a]);
    base = (origin - face) * f + Border;
    perDepth = direction * f;
  };
  along(brick.X, 0, ray.Origin.X, ray.Direction.X, view.Base.X, view.Direction.X);
  along(brick.Y, 1, ray.Origin.Y, ray.Direction.Y, view.Base.Y, view.Direction.Y);
  along(brick.Z, 2, ray.Origin.Z, ray.Direction.Z, view.Base.Z, view.Direction.Z);
  const std::size_t edge = p.Atlas[3];
  const std::size_t cells = (size + shared::CELL_EDGE - 1) / shared::CELL_EDGE;
  view.Edge = static_cast<std::int32_t>(edge);
  view.CellsAlong = static_cast<std::int32_t>(cells);
  view.Voxels = scene.Voxels + slot * edge * edge * edge * scene.BytesPerTexel;
  view.Cells = scene.Cells + slot * cells * cells * cells * 2 * scene.BytesPerTexel;
  view.Scale = p.Value[0];
  view.Offset = (p.Value[1] - transfer.Low) + (p.Value[2] - transfer.LowRest);
  if (scene.SlotTable != nullptr)
  {
    const float* entry = scene.SlotTable + std::size_t{ slot } * 4;
    view.Scale = entry[2];
    view.Offset = (entry[0] - transfer.Low) + (entry[1] - transfer.LowRest);
  }
  view.PerVoxelX = view.Scale / static_cast<float>(factor[0]);
  view.PerVoxelY = view.Scale / static_cast<float>(factor[1]);
  view.PerVoxelZ = view.Scale / static_cast<float>(factor[2]);
  return view;
}

// Texels x and x + 1 of rows that begin at voxel i.
template <typename T>
inline void LoadPair(const std::uint8_t* voxels, Ints i, Floats& first, Floats& second)
{
  if constexpr (sizeof(T) == 1)
  {
    const Ints word = GatherWords(voxels, i);
    first = ToFloat(word & 0xff);
    second = ToFloat((word >> 8) & 0xff);
  }
  else if constexpr (sizeof(T) == 2)
  {
    const Ints word = GatherWords(voxels, i * 2);
    first = ToFloat(word & 0xffff);
    second = ToFloat((word >> 16) & 0xffff);
  }
  else
  {
    first = AsFloat(GatherWords(voxels, i * 4));
    second = AsFloat(GatherWords(voxels + 4, i * 4));
  }
}

// Texels x - 1 to x + 2.
template <typename T>
inline void LoadRow(const std::uint8_t* voxels, Ints i, Floats (&row)[4])
{
  if constexpr (sizeof(T) == 1)
  {
    const Ints word = GatherWords(voxels - 1, i);
    row[0] = ToFloat(word & 0xff);
    row[1] = ToFloat((word >> 8) & 0xff);
    row[2] = ToFloat((word >> 16) & 0xff);
    row[3] = ToFloat((word >> 24) & 0xff);
  }
  else
  {
    LoadPair<T>(voxels - sizeof(T), i, row[0], row[1]);
    LoadPair<T>(voxels + sizeof(T), i, row[2], row[3]);
  }
}

// Eight neighbouring values: index x + 2 y + 4 z.
struct Corners
{
  Floats V[8];
};

// A polynomial along a line, A + u (B + u (C + u D)).
struct Cubic
{
  Floats A;
  Floats B;
  Floats C;
  Floats D;
};

inline Floats Along(const Cubic& c, Floats u)
{
  return c.A + u * (c.B + u * (c.C + u * c.D));
}

struct Vectors
{
  Floats X;
  Floats Y;
  Floats Z;
};

// The trilinear field of eight corners along w + u * d (in cell units).
inline Cubic CubicAlong(const Corners& k, const Vectors& w, const Vectors& d)
{
  const Floats x = k.V[1] - k.V[0];
  const Floats y = k.V[2] - k.V[0];
  const Floats z = k.V[4] - k.V[0];
  const Floats xy = (k.V[3] - k.V[2]) - x;
  const Floats xz = (k.V[5] - k.V[4]) - x;
  const Floats yz = (k.V[6] - k.V[4]) - y;
  const Floats xyz = ((k.V[7] - k.V[6]) - (k.V[5] - k.V[4])) - xy;
  const Floats xyAtZ = xy + xyz * w.Z;
  const Floats xzAtY = xz + xyz * w.Y;
  const Floats yzAtX = yz + xyz * w.X;
  const Floats atYZ = x + xy * w.Y + xzAtY * w.Z;
  const Floats atXZ = y + yz * w.Z + xyAtZ * w.X;
  const Floats atXY = z + xz * w.X + yzAtX * w.Y;
  const Floats dxdy = d.X * d.Y;
  Cubic c;
  c.A = k.V[0] + x * w.X + (y + xy * w.X) * w.Y + atXY * w.Z;
  c.B = atYZ * d.X + atXZ * d.Y + atXY * d.Z;
  c.C = xyAtZ * dxdy + xzAtY * (d.X * d.Z) + yzAtX * (d.Y * d.Z);
  c.D = xyz * (dxdy * d.Z);
  return c;
}

// Central differences over +-1 voxel along each axis as cubics along the same line: the gradient
// that VTK interpolates.
struct Gradient
{
  Cubic X;
  Cubic Y;
  Cubic Z;
};

template <typename T>
inline Corners LoadCorners(const BrickView& view, Ints at)
{
  const std::int32_t row = view.Edge;
  const std::int32_t slice = view.Edge * view.Edge;
  Corners k;
  LoadPair<T>(view.Voxels, at, k.V[0], k.V[1]);
  LoadPair<T>(view.Voxels, at + row, k.V[2], k.V[3]);
  LoadPair<T>(view.Voxels, at + slice, k.V[4], k.V[5]);
  LoadPair<T>(view.Voxels, at + (slice + row), k.V[6], k.V[7]);
  return k;
}

template <typename T>
inline Gradient LoadGradient(
  const BrickView& view, Ints at, const Corners& k, const Vectors& w, const Vectors& d)
{
  const std::int32_t row = view.Edge;
  const std::int32_t slice = view.Edge * view.Edge;
  Gradient g;
  Corners difference;
  for (int i = 0; i < 4; ++i)
  {
    Floats around[4];
    LoadRow<T>(view.Voxels, at + ((i & 1) * row + (i >> 1) * slice), around);
    difference.V[2 * i] = around[2] - around[0];
    difference.V[2 * i + 1] = around[3] - around[1];
  }
  g.X = CubicAlong(difference, w, d);
  for (int z = 0; z < 2; ++z)
  {
    Floats before[2];
    Floats behind[2];
    LoadPair<T>(view.Voxels, at + (z * slice - row), before[0], before[1]);
    LoadPair<T>(view.Voxels, at + (z * slice + 2 * row), behind[0], behind[1]);
    for (int x = 0; x < 2; ++x)
    {
      difference.V[4 * z + x] = k.V[4 * z + 2 + x] - before[x];
      difference.V[4 * z + 2 + x] = behind[x] - k.V[4 * z + x];
    }
  }
  g.Y = CubicAlong(difference, w, d);
  for (int y = 0; y < 2; ++y)
  {
    Floats before[2];
    Floats behind[2];
    LoadPair<T>(view.Voxels, at + (y * row - slice), before[0], before[1]);
    LoadPair<T>(view.Voxels, at + (y * row + 2 * slice), behind[0], behind[1]);
    for (int x = 0; x < 2; ++x)
    {
      difference.V[2 * y + x] = k.V[4 + 2 * y + x] - before[x];
      difference.V[4 + 2 * y + x] = behind[x] - k.V[2 * y + x];
    }
  }
  g.Z = CubicAlong(difference, w, d);
  return g;
}

template <typename T>
inline Floats LoadTexel(const BrickView& view, Ints at)
{
  Floats texel;
  Floats next;
  LoadPair<T>(view.Voxels, at, texel, next);
  return texel;
}
