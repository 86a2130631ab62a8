// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Voxels of a resident brick. Only whole texels are fetched, so that no value depends on the slot,
// on the size of the atlas or on the driver's filter (contract 1c).

// A brick in the atlas, seen from a ray: local corner coordinates (border included) are
// base + t * direction.
struct BrickView
{
  vec3 base;
  vec3 direction;
  ivec3 firstVoxel;
  ivec3 firstCell;
  float scale; // data value above the transfer function's lower end = scale * texel + offset
  float offset;
#if TERAVOX_CLIPPED_GRADIENT
  float clipped; // texel of what is cut away
#endif
#if TERAVOX_COMPONENTS
  vec2 parts[TERAVOX_COMPONENTS]; // scale and offset of each component, above its own lower end
#endif
};

const float BORDER = 2.0;
#include "Library/ClippedGradient.glsl"

int CellsAlong()
{
  return int((u_dimensions.w + CELL_EDGE - 1u) / CELL_EDGE);
}

BrickView ViewBrick(Ray ray, int level, uvec3 brick, uint slot)
{
  BrickView view;
  vec3 f = 1.0 / vec3(u_levelFactor[level].xyz); // exact for powers of two
  precise vec3 face = Anchored(brick * u_dimensions.w * u_levelFactor[level].xyz);
  precise vec3 base = (ray.origin - face) * f + BORDER;
  precise vec3 direction = ray.direction * f;
  view.base = base;
  view.direction = direction;
  int cells = CellsAlong();
  uvec3 at = uvec3(slot % u_atlas.x, slot / u_atlas.x % u_atlas.y, slot / (u_atlas.x * u_atlas.y));
#if TERAVOX_COMPONENTS
  const uint parts = uint(TERAVOX_COMPONENTS + TERAVOX_MASK);
  at.z *= parts; // one component behind the other, and a mask
#elif TERAVOX_MASK
  at.z *= 2u; // the mask behind the voxels
  slot *= 2u;
#endif
  view.firstVoxel = ivec3(at * u_atlas.w);
  view.firstCell = ivec3(at) * cells;
#if TERAVOX_COMPONENTS
  view.scale = 1.0;
  precise float offset = 0.0; // see PartOf()
  for (int c = 0; c < TERAVOX_COMPONENTS; ++c)
  {
#if TERAVOX_SLOT_TABLE
    vec4 value = b_slots[slot * parts + uint(c)];
    float scale = value.z;
    vec2 lowest = value.xy;
#else
    float scale = u_value.x;
    vec2 lowest = u_value.yz;
#endif
    precise float above =
      (lowest.x - u_componentTransfer[c].x) + (lowest.y - u_componentTransfer[c].y);
    view.parts[c] = vec2(scale, above);
  }
#elif TERAVOX_SLOT_TABLE
  vec4 entry = b_slots[slot];
  precise float offset = (entry.x - u_transfer.x) + (entry.y - u_transfer.y);
  view.scale = entry.z;
#else
  precise float offset = (u_value.y - u_transfer.x) + (u_value.z - u_transfer.y);
  view.scale = u_value.x;
#endif
  view.offset = offset;
#if TERAVOX_CLIPPED_GRADIENT
  view.clipped = ClippedTexel(view.scale, view.offset, u_transfer.xy); // see PartOf()
#endif
  return view;
}

vec3 LocalPosition(BrickView view, float t)
{
  precise vec3 p = view.base + t * view.direction;
  return p;
}

// One voxel of the stored brick.
float Voxel(BrickView view, ivec3 at)
{
  return texelFetch(u_atlasTexture, view.firstVoxel + at, 0).r;
}

// Least and largest texel of a cell of CELL_EDGE^3 voxels, filter support included.
vec2 CellRange(BrickView view, ivec3 at)
{
  return texelFetch(u_cells, view.firstCell + at, 0).rg;
}

// Position of a texel value in nodes of the transfer table.
float NodeOf(BrickView view, float texel)
{
  precise float fromLow = texel * view.scale + view.offset;
  precise float node = fromLow * u_transfer.z;
  return node;
}

// Eight neighbouring voxels: near.xyzw are (0,0,0), (1,0,0), (0,1,0), (1,1,0), far the same at z
// = 1.
struct Corners
{
  vec4 near;
  vec4 far;
};

// A voxel and its neighbours in x, y and both.
vec4 Quad(BrickView view, ivec3 at)
{
  return vec4(Voxel(view, at), Voxel(view, at + ivec3(1, 0, 0)), Voxel(view, at + ivec3(0, 1, 0)),
    Voxel(view, at + ivec3(1, 1, 0)));
}

Corners FetchCorners(BrickView view, ivec3 at)
{
  return Corners(Quad(view, at), Quad(view, at + ivec3(0, 0, 1)));
}

#if TERAVOX_FLOAT_DATA
bool HasValues(Corners k)
{
  return !isnan(dot(k.near + k.far, vec4(1.0)));
}
#endif

// The trilinear field of eight corners along w0 + u * dw (in cell units) is a cubic in u:
// c.x + c.y u + c.z u^2 + c.w u^3.
vec4 CubicAlong(Corners k, vec3 w0, vec3 dw)
{
  precise float kx = k.near.y - k.near.x;
  precise float ky = k.near.z - k.near.x;
  precise float kz = k.far.x - k.near.x;
  precise float kxy = (k.near.w - k.near.z) - kx;
  precise float kxz = (k.far.y - k.far.x) - kx;
  precise float kyz = (k.far.z - k.far.x) - ky;
  precise float kxyz = ((k.far.w - k.far.z) - (k.far.y - k.far.x)) - kxy;
  precise float atYZ = kx + kxy * w0.y + (kxz + kxyz * w0.y) * w0.z;
  precise float atXZ = ky + kyz * w0.z + (kxy + kxyz * w0.z) * w0.x;
  precise float atXY = kz + kxz * w0.x + (kyz + kxyz * w0.x) * w0.y;
  precise vec4 c;
  c.x = k.near.x + kx * w0.x + (ky + kxy * w0.x) * w0.y + atXY * w0.z;
  c.y = atYZ * dw.x + atXZ * dw.y + atXY * dw.z;
  c.z = (kxy + kxyz * w0.z) * (dw.x * dw.y) + (kxz + kxyz * w0.y) * (dw.x * dw.z) +
    (kyz + kxyz * w0.x) * (dw.y * dw.z);
  c.w = kxyz * (dw.x * dw.y * dw.z);
  return c;
}

float Along(vec4 cubic, float u)
{
  precise float v = cubic.x + u * (cubic.y + u * (cubic.z + u * cubic.w));
  return v;
}

#if TERAVOX_SHADE || TERAVOX_GRADIENT_OPACITY || TERAVOX_PLANE
// Differences over +-1 voxel along each axis as cubics along the same line: the gradient that VTK
// interpolates.
struct Gradient
{
  vec4 x;
  vec4 y;
  vec4 z;
};

vec4 DifferenceAlong(
  BrickView view, int axis, Corners below, Corners above, vec3 w0, vec3 dw)
{
#if TERAVOX_CLIPPED_GRADIENT
  below.near = PlaceTexels(2 * axis, below.near, view.clipped);
  below.far = PlaceTexels(2 * axis, below.far, view.clipped);
  above.near = PlaceTexels(2 * axis + 1, above.near, view.clipped);
  above.far = PlaceTexels(2 * axis + 1, above.far, view.clipped);
#endif
  return CubicAlong(Corners(above.near - below.near, above.far - below.far), w0, dw);
}

Gradient GradientAlong(BrickView view, ivec3 at, Corners k, vec3 w0, vec3 dw)
{
  Corners below;
  Corners above;
  Gradient g;
  // Neighbours below and above the eight corners along each axis; a Quad has x = 0, 1 at y = 0,
  // then at y = 1.
  vec4 nearLow = Quad(view, at + ivec3(-1, 0, 0));
  vec4 farLow = Quad(view, at + ivec3(-1, 0, 1));
  vec4 nearHigh = Quad(view, at + ivec3(1, 0, 0));
  vec4 farHigh = Quad(view, at + ivec3(1, 0, 1));
  below.near = vec4(nearLow.x, k.near.x, nearLow.z, k.near.z);
  below.far = vec4(farLow.x, k.far.x, farLow.z, k.far.z);
  above.near = vec4(k.near.y, nearHigh.y, k.near.w, nearHigh.w);
  above.far = vec4(k.far.y, farHigh.y, k.far.w, farHigh.w);
  g.x = DifferenceAlong(view, 0, below, above, w0, dw);
  nearLow = Quad(view, at + ivec3(0, -1, 0));
  farLow = Quad(view, at + ivec3(0, -1, 1));
  nearHigh = Quad(view, at + ivec3(0, 1, 0));
  farHigh = Quad(view, at + ivec3(0, 1, 1));
  below.near = vec4(nearLow.xy, k.near.xy);
  below.far = vec4(farLow.xy, k.far.xy);
  above.near = vec4(k.near.zw, nearHigh.zw);
  above.far = vec4(k.far.zw, farHigh.zw);
  g.y = DifferenceAlong(view, 1, below, above, w0, dw);
  below = Corners(Quad(view, at + ivec3(0, 0, -1)), k.near);
  above = Corners(k.far, Quad(view, at + ivec3(0, 0, 2)));
  g.z = DifferenceAlong(view, 2, below, above, w0, dw);
  return g;
}

vec3 Along(Gradient g, float u)
{
  return vec3(Along(g.x, u), Along(g.y, u), Along(g.z, u));
}

// Central difference over +-1 voxel at a voxel, in data units per two voxels.
vec3 CentralDifference(BrickView view, ivec3 at)
{
  vec3 forward = vec3(Voxel(view, at + ivec3(1, 0, 0)), Voxel(view, at + ivec3(0, 1, 0)),
    Voxel(view, at + ivec3(0, 0, 1)));
  vec3 backward = vec3(Voxel(view, at - ivec3(1, 0, 0)), Voxel(view, at - ivec3(0, 1, 0)),
    Voxel(view, at - ivec3(0, 0, 1)));
#if TERAVOX_CLIPPED_GRADIENT
  for (int a = 0; a < 3; ++a)
  {
    backward[a] = PlaceTexel(2 * a, backward[a], view.clipped);
    forward[a] = PlaceTexel(2 * a + 1, forward[a], view.clipped);
  }
#endif
  precise vec3 difference = (forward - backward) * view.scale;
  return difference;
}
#endif
#include "Library/Mask.glsl"
#include "Library/ComponentTables.glsl"
