// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Voxels of a resident brick.

// A brick in the atlas, seen from a ray: local corner coordinates (border included) are
// base + t * direction.
struct BrickView
{
  vec3 base;
  vec3 direction;
  vec3 slotOrigin; // first texel of the slot
  float scale;     // data value = scale * texel + offset
  vec3 cellOrigin; // first cell of the slot
  float offsetHigh; // relative to the lower end of the transfer function's domain
};

const float BORDER = 2.0;

BrickView ViewBrick(Ray ray, int level, uvec3 brick, uint slot)
{
  BrickView view;
  vec3 f = 1.0 / vec3(u_levelFactor[level].xyz); // exact for powers of two
  precise vec3 face = Anchored(brick * u_dimensions.w * u_levelFactor[level].xyz);
  precise vec3 base = (ray.origin - face) * f + BORDER;
  precise vec3 direction = ray.direction * f;
  view.base = base;
  view.direction = direction;
  uvec3 at = uvec3(slot % u_atlas.x, slot / u_atlas.x % u_atlas.y, slot / (u_atlas.x * u_atlas.y));
  view.slotOrigin = vec3(at * u_atlas.w);
  view.cellOrigin = vec3(at * ((u_dimensions.w + CELL_EDGE - 1u) / CELL_EDGE));
#if TERAVOX_SLOT_TABLE
  vec4 entry = b_slots[slot];
  precise float offset = (entry.x - u_transfer.x) + (entry.y - u_transfer.y);
  view.scale = entry.z;
#else
  precise float offset = (u_value.y - u_transfer.x) + (u_value.z - u_transfer.y);
  view.scale = u_value.x;
#endif
  view.offsetHigh = offset;
  return view;
}

vec3 LocalPosition(BrickView view, float t)
{
  precise vec3 p = view.base + t * view.direction;
  return p;
}

// Positions are rounded to 2^-12 voxel: in an atlas whose edges are powers of two all following
// arithmetic of the driver is exact up to the weights, hence the same in every slot (contract 1c).
vec3 RoundPosition(vec3 local)
{
  return clamp(floor(local * 4096.0 + 0.5) * (1.0 / 4096.0), vec3(0.5), vec3(float(u_atlas.w) - 0.5));
}

float FetchLinear(BrickView view, vec3 local)
{
  vec3 p = RoundPosition(local);
#if TERAVOX_DRIVER_FILTER
  return textureLod(u_atlasTexture, (view.slotOrigin + p) * u_atlasScale.xyz, 0.0).r;
#else
  vec3 q = p - 0.5;
  vec3 corner = min(floor(q), vec3(float(u_atlas.w) - 2.0));
  precise vec3 w = q - corner;
  ivec3 at = ivec3(view.slotOrigin + corner);
  float v000 = texelFetch(u_atlasTexture, at, 0).r;
  float v100 = texelFetch(u_atlasTexture, at + ivec3(1, 0, 0), 0).r;
  float v010 = texelFetch(u_atlasTexture, at + ivec3(0, 1, 0), 0).r;
  float v110 = texelFetch(u_atlasTexture, at + ivec3(1, 1, 0), 0).r;
  float v001 = texelFetch(u_atlasTexture, at + ivec3(0, 0, 1), 0).r;
  float v101 = texelFetch(u_atlasTexture, at + ivec3(1, 0, 1), 0).r;
  float v011 = texelFetch(u_atlasTexture, at + ivec3(0, 1, 1), 0).r;
  float v111 = texelFetch(u_atlasTexture, at + ivec3(1, 1, 1), 0).r;
  precise float a = v000 + w.x * (v100 - v000);
  precise float b = v010 + w.x * (v110 - v010);
  precise float c = v001 + w.x * (v101 - v001);
  precise float d = v011 + w.x * (v111 - v011);
  precise float e = a + w.y * (b - a);
  precise float g = c + w.y * (d - c);
  precise float v = e + w.z * (g - e);
  return v;
#endif
}

float FetchNearest(BrickView view, ivec3 voxel)
{
  return texelFetch(u_atlasTexture, ivec3(view.slotOrigin) + voxel, 0).r;
}

Sample Classify(BrickView view, float texel)
{
  precise float fromLow = texel * view.scale + view.offsetHigh;
  Sample s = SampleTransfer(fromLow * u_transfer.z);
#if TERAVOX_FLOAT_DATA
  if (isnan(texel))
  {
    s.x = -1.0;
    s.s = 0.0;
  }
#endif
  return s;
}

Sample SampleAt(BrickView view, float t)
{
  return Classify(view, FetchLinear(view, LocalPosition(view, t)));
}

struct Cell
{
  bool empty; // under the transfer function, filter support included
  float end;  // depth at which the ray leaves it
};

// The cell of a brick at a depth. Counted on the far side where the depth lies on a face.
Cell CellAt(BrickView view, Ray ray, float t)
{
  float cells = ceil(float(u_dimensions.w) / float(CELL_EDGE));
  vec3 p = (view.base + t * view.direction - BORDER) * (1.0 / float(CELL_EDGE));
  vec3 forward = vec3(ray.positive);
  vec3 index = clamp(mix(ceil(p - 1.0e-4) - 1.0, floor(p + 1.0e-4), forward), 0.0, cells - 1.0);
  vec3 exits =
    ((index + forward) * float(CELL_EDGE) + BORDER - view.base) / view.direction;
  vec2 range = texelFetch(u_cells, ivec3(view.cellOrigin + index), 0).rg * view.scale + view.offsetHigh;
  Cell cell;
  cell.end = min(exits.x, min(exits.y, exits.z));
  cell.empty = u_switches.x != 0u &&
    (range.x > range.y || IsEmptyBetween(range.x * u_transfer.z, range.y * u_transfer.z));
  return cell;
}

// Central difference over +-1 voxel of the brick's level, in data units per two voxels.
vec3 CentralDifference(BrickView view, vec3 local)
{
#if TERAVOX_NEAREST
  vec3 p = floor(local) + 0.5;
#else
  vec3 p = local;
#endif
  vec3 forward = vec3(FetchLinear(view, p + vec3(1, 0, 0)), FetchLinear(view, p + vec3(0, 1, 0)),
    FetchLinear(view, p + vec3(0, 0, 1)));
  vec3 backward = vec3(FetchLinear(view, p - vec3(1, 0, 0)), FetchLinear(view, p - vec3(0, 1, 0)),
    FetchLinear(view, p - vec3(0, 0, 1)));
  precise vec3 difference = (forward - backward) * view.scale;
  return difference;
}
