// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Voxels of a resident brick, and the trilinear field between eight of them along a ray (see
// Shaders/Library/Atlas.glsl): a cubic, known exactly from the corners.

constexpr float Border = 2.0f;

// A brick in the atlas, seen from a ray: local corner coordinates (border included) are
// Base + t * Direction.
struct BrickView
{
  Quad Base;
  Quad Direction;
  const std::uint8_t* Voxels;
  const std::uint8_t* Cells;
  const std::uint64_t* Occupancy;
#if TERAVOX_MASK
  const std::uint8_t* Mask; // like Voxels and Cells: 0 where nothing is drawn, else 1
  const std::uint8_t* MaskCells;
#endif
  std::int32_t Edge;        // stored voxels along each axis
  std::int32_t CellsAlong;  // along each axis
  std::int32_t MacrosAlong; // words of bits along each axis
  float Scale; // data value above the transfer function's lower end = Scale * texel + Offset
  float Offset;
  float PerVoxelX; // of a central difference of texels, to data per voxel of level 0
  float PerVoxelY;
  float PerVoxelZ;
  unsigned Clipped; // which places of a difference are cut away (KernelClipped.h)
  float ClippedTexel;
};

inline BrickView ViewBrick(const NativeScene& scene, const Transfer& transfer, const Ray& ray,
  int level, Index brick, std::uint32_t slot)
{
  const MarchParameters& p = *scene.Parameters;
  const UVec& factor = p.LevelFactor[static_cast<std::size_t>(level)];
  const std::uint32_t size = p.Dimensions[3];
  BrickView view;
  const Quad f = 1.0f / ToFloat(Load(factor)); // exact for powers of two
  view.Base = (ray.Origin - Anchored(p, brick * size * Load(factor))) * f + Border;
  view.Direction = ray.Direction * f;
  const std::size_t edge = p.Atlas[3];
  const std::size_t cells = (size + shared::CELL_EDGE - 1) / shared::CELL_EDGE;
  view.Edge = static_cast<std::int32_t>(edge);
  view.CellsAlong = static_cast<std::int32_t>(cells);
  view.Voxels = scene.Voxels + slot * edge * edge * edge * scene.BytesPerTexel;
  view.MacrosAlong = static_cast<std::int32_t>((cells + MacroEdge - 1) / MacroEdge);
  view.Cells = scene.Cells + slot * cells * cells * cells * 2 * scene.BytesPerTexel;
  view.Occupancy = nullptr;
#if TERAVOX_MASK
  view.Mask = view.MaskCells = nullptr; // see ViewMasked()
#endif
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
  view.Clipped = 0;
  view.ClippedTexel = 0.0f;
  return view;
}

// Position in nodes of the transfer table of texel values, of one or of eight.
template <typename F>
TERAVOX_INLINE F NodeOf(const Transfer& transfer, const BrickView& view, F texel)
{
  return (texel * view.Scale + view.Offset) * transfer.NodesPerUnit;
}

// Byte offsets of eight voxels.
struct Offsets
{
  alignas(32) std::int32_t V[Lanes];
};
template <typename T>
TERAVOX_INLINE Offsets OffsetsOf(Ints voxels)
{
  Offsets o;
  Spill(voxels * static_cast<std::int32_t>(sizeof(T)), o.V);
  return o;
}

// Texels x and x + 1 of four rows, `row` bytes apart from each other in y and `slice` in z.
template <typename T>
TERAVOX_INLINE void LoadPairs(const std::uint8_t* voxels, const Offsets& at, std::ptrdiff_t row,
  std::ptrdiff_t slice, Floats (&first)[4], Floats (&second)[4])
{
  if constexpr (sizeof(T) == 4)
  {
    Quad rows[Lanes];
    Quad rowsBehind[Lanes];
    for (int l = 0; l < Lanes; ++l)
    {
      const std::uint8_t* p = voxels + at.V[l];
      Quad a;
      float v[8];
      __builtin_memcpy(v, p, 8);
      __builtin_memcpy(v + 2, p + row, 8);
      __builtin_memcpy(v + 4, p + slice, 8);
      __builtin_memcpy(v + 6, p + slice + row, 8);
      a = Quad{ v[0], v[2], v[4], v[6] };
      rows[l] = a;
      rowsBehind[l] = Quad{ v[1], v[3], v[5], v[7] };
    }
    Transpose(rows, first);
    Transpose(rowsBehind, second);
  }
  else
  {
    Quad rows[Lanes];
    for (int l = 0; l < Lanes; ++l)
    {
      const std::uint8_t* p = voxels + at.V[l];
      rows[l] = reinterpret_cast<Quad>(
        QuadMask{ WordAt(p), WordAt(p + row), WordAt(p + slice), WordAt(p + slice + row) });
    }
    Floats words[4];
    Transpose(rows, words);
    constexpr int bits = 8 * sizeof(T);
    constexpr int mask = (1 << bits) - 1;
    for (int i = 0; i < 4; ++i)
    {
      const Ints word = AsInt(words[i]);
      first[i] = ToFloat(word & mask);
      second[i] = ToFloat((word >> bits) & mask);
    }
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

TERAVOX_INLINE Floats Along(const Cubic& c, Floats u)
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
TERAVOX_INLINE Cubic CubicAlong(const Corners& k, const Vectors& w, const Vectors& d)
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

// The eight corners of cells. Index i of a pair: y + 2 z.
template <typename T>
TERAVOX_INLINE Corners LoadCorners(const BrickView& view, const Offsets& at)
{
  const std::ptrdiff_t row = static_cast<std::ptrdiff_t>(sizeof(T)) * view.Edge;
  Floats first[4];
  Floats second[4];
  LoadPairs<T>(view.Voxels, at, row, row * view.Edge, first, second);
  return { { first[0], second[0], first[1], second[1], first[2], second[2], first[3], second[3] } };
}

// Offsets of neighbours along each axis, in bytes.
template <typename T>
TERAVOX_INLINE std::ptrdiff_t StepAlong(const BrickView& view, int axis)
{
  const auto step = static_cast<std::ptrdiff_t>(sizeof(T));
  const std::ptrdiff_t row = step * view.Edge;
  return axis == 0 ? step : axis == 1 ? row : row * view.Edge;
}

// The same where clipping planes cut some of it away.
template <typename T>
__attribute__((noinline)) Gradient LoadClippedGradient(
  const BrickView& view, const Offsets& at, const Vectors& w, const Vectors& d)
{
  Cubic cubics[3];
  for (int a = 0; a < 3; ++a)
  {
    const auto beside = [&](int place) -> Corners
    {
      if ((view.Clipped >> place & 1u) != 0)
      {
        const Floats v = Splat(view.ClippedTexel);
        return { { v, v, v, v, v, v, v, v } };
      }
      BrickView moved = view;
      moved.Voxels += place % 2 == 0 ? -StepAlong<T>(view, a) : StepAlong<T>(view, a);
      return LoadCorners<T>(moved, at);
    };
    const Corners before = beside(2 * a);
    Corners difference = beside(2 * a + 1);
    for (int i = 0; i < 8; ++i)
    {
      difference.V[i] -= before.V[i];
    }
    cubics[a] = CubicAlong(difference, w, d);
  }
  return { cubics[0], cubics[1], cubics[2] };
}

template <typename T>
inline Gradient LoadGradient(
  const BrickView& view, const Offsets& at, const Corners& k, const Vectors& w, const Vectors& d)
{
  if (view.Clipped != 0)
  {
    return LoadClippedGradient<T>(view, at, w, d);
  }
  const auto step = static_cast<std::ptrdiff_t>(sizeof(T));
  const std::ptrdiff_t row = step * view.Edge;
  const std::ptrdiff_t slice = row * view.Edge;
  Gradient g;
  Corners difference;
  // Pairs that end before and begin behind the cell along x.
  Floats before[4];
  Floats behind[4];
  Floats unused[4];
  LoadPairs<T>(view.Voxels - step, at, row, slice, before, unused);
  LoadPairs<T>(view.Voxels + 2 * step, at, row, slice, behind, unused);
  for (int i = 0; i < 4; ++i)
  {
    difference.V[2 * i] = k.V[2 * i + 1] - before[i];
    difference.V[2 * i + 1] = behind[i] - k.V[2 * i];
  }
  g.X = CubicAlong(difference, w, d);
  // Rows before and behind along y: index `side + 2 z`.
  Floats second[4];
  LoadPairs<T>(view.Voxels - row, at, 3 * row, slice, before, second);
  for (int z = 0; z < 2; ++z)
  {
    difference.V[4 * z] = k.V[4 * z + 2] - before[2 * z];
    difference.V[4 * z + 1] = k.V[4 * z + 3] - second[2 * z];
    difference.V[4 * z + 2] = before[2 * z + 1] - k.V[4 * z];
    difference.V[4 * z + 3] = second[2 * z + 1] - k.V[4 * z + 1];
  }
  g.Y = CubicAlong(difference, w, d);
  // The same along z: index `y + 2 side`.
  LoadPairs<T>(view.Voxels - slice, at, row, 3 * slice, before, second);
  for (int y = 0; y < 2; ++y)
  {
    difference.V[2 * y] = k.V[4 + 2 * y] - before[y];
    difference.V[2 * y + 1] = k.V[5 + 2 * y] - second[y];
    difference.V[4 + 2 * y] = before[2 + y] - k.V[2 * y];
    difference.V[5 + 2 * y] = second[2 + y] - k.V[2 * y + 1];
  }
  g.Z = CubicAlong(difference, w, d);
  return g;
}

template <typename T>
inline Floats LoadTexel(const BrickView& view, const Offsets& at, std::ptrdiff_t offset)
{
  Floats texel;
  for (int l = 0; l < Lanes; ++l)
  {
    T v;
    __builtin_memcpy(&v, view.Voxels + at.V[l] + offset, sizeof(v));
    texel[l] = static_cast<float>(v);
  }
  return texel;
}

// Central differences at voxels, in data per voxel of level 0.
template <typename T>
TERAVOX_INLINE Vectors DifferenceOf(const BrickView& view, const Offsets& at)
{
  const float perVoxel[3] = { view.PerVoxelX, view.PerVoxelY, view.PerVoxelZ };
  Floats along[3];
  for (int a = 0; a < 3; ++a)
  {
    const auto beside = [&](int place)
    {
      const std::ptrdiff_t step = StepAlong<T>(view, a);
      return (view.Clipped >> place & 1u) != 0
        ? Splat(view.ClippedTexel)
        : LoadTexel<T>(view, at, place % 2 == 0 ? -step : step);
    };
    along[a] = (beside(2 * a + 1) - beside(2 * a)) * perVoxel[a];
  }
  return { along[0], along[1], along[2] };
}
