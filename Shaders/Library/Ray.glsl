// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Ray, brick faces, levels: which brick lies at which depth. All depths are computed each time from
// the ray and integer indices, never accumulated, so that it makes no difference where a ray was
// interrupted (contract 1b).

const float LARGEST_INTEGER = 2147483520.0; // of 32 bits that is a float

struct Ray
{
  vec3 origin;    // anchored corner coordinates of level 0 at depth 0
  vec3 direction; // voxels of level 0 per unit of depth; no component is 0
  vec3 inverse;
  uvec3 positive; // 1 where direction > 0
  float world;    // world length per unit of depth
};

Ray MakeRay(vec2 pixel)
{
  Ray ray;
  precise vec3 o = u_rayOrigin[0].xyz + pixel.x * u_rayOrigin[1].xyz + pixel.y * u_rayOrigin[2].xyz;
  precise vec3 d =
    u_rayDirection[0].xyz + pixel.x * u_rayDirection[1].xyz + pixel.y * u_rayDirection[2].xyz;
  precise vec3 w = u_rayWorld[0].xyz + pixel.x * u_rayWorld[1].xyz + pixel.y * u_rayWorld[2].xyz;
  // A component that is 0 never meets a face; a tiny one meets it very far away.
  float tiny = 1.0e-12 * max(abs(d.x), max(abs(d.y), abs(d.z)));
  d = mix(d, vec3(tiny), lessThan(abs(d), vec3(tiny)));
  ray.origin = o;
  ray.direction = d;
  ray.inverse = 1.0 / d;
  ray.positive = uvec3(greaterThan(d, vec3(0.0)));
  ray.world = length(w);
  return ray;
}

// A face of level 0 relative to the anchor; exact as long as |difference| < 2^24, else rounded
// monotonically.
vec3 Anchored(uvec3 face)
{
  return vec3(ivec3(min(face, u_dimensions.xyz) - u_anchor.xyz));
}

// What a ray needs to know of a level. Loaded once for all bricks of the level: drivers on the CPU
// gather uniforms of a varying index lane by lane.
struct Level
{
  uvec3 edge;   // of a brick, in voxels of level 0
  uvec3 bricks; // along each axis
  uint base;    // in the page directory
  uint depth;   // page levels below the directory
  float begin;  // depths
  float end;
};

Level LoadLevel(int level)
{
  Level l;
  l.edge = u_dimensions.w * u_levelFactor[level].xyz;
  l.bricks = u_levelBricks[level].xyz;
  l.base = u_levelFactor[level].w;
  l.depth = u_levelBricks[level].w;
  l.begin = level > int(u_levels.y) ? u_levelStart[level].x : -3.0e38;
  l.end = level < int(u_levels.z) ? u_levelStart[level + 1].x : 3.0e38;
  return l;
}

// Depths at which the ray crosses the faces with these brick indices of a level.
vec3 FaceDepths(Ray ray, Level level, uvec3 index)
{
  precise vec3 t = (Anchored(index * level.edge) - ray.origin) * ray.inverse;
  return t;
}

vec3 EntryDepths(Ray ray, Level level, uvec3 brick)
{
  return FaceDepths(ray, level, brick + (uvec3(1u) - ray.positive));
}

vec3 ExitDepths(Ray ray, Level level, uvec3 brick)
{
  return FaceDepths(ray, level, brick + ray.positive);
}

float Minimum(vec3 v)
{
  return min(v.x, min(v.y, v.z));
}

float Maximum(vec3 v)
{
  return max(v.x, max(v.y, v.z));
}

// lambda: the level at a depth.
int LevelAt(float t)
{
  int level = int(u_levels.y);
  for (int l = int(u_levels.y) + 1; l <= int(u_levels.z); ++l)
  {
    if (t < u_levelStart[l].x)
    {
      break;
    }
    level = l;
  }
  return level;
}

// The brick at a depth: on each axis the one whose entry face has been met and whose exit face
// hasn't. Exactly what stepping from face to face arrives at, so that a jump over an empty region
// changes nothing.
uvec3 BrickAt(Ray ray, Level level, float t)
{
  vec3 p = floor(ray.origin + t * ray.direction);
  ivec3 last = ivec3(level.bricks) - 1;
  // In 64 bits this would be one addition; here the sum is kept inside the volume on both sides,
  // and once more as integers: floats round the ends of a large volume to beyond them.
  vec3 low = -vec3(u_anchor.xyz);
  vec3 high = min(vec3(u_dimensions.xyz - 1u - u_anchor.xyz), vec3(LARGEST_INTEGER));
  ivec3 cell = clamp(ivec3(clamp(p, low, high)), -ivec3(u_anchor.xyz),
    ivec3(u_dimensions.xyz - 1u - u_anchor.xyz));
  uvec3 voxel = uvec3(ivec3(u_anchor.xyz) + cell);
  ivec3 b = min(ivec3(voxel / level.edge), last);
  ivec3 forward = ivec3(ray.positive) * 2 - 1;
  for (int i = 0; i < 4; ++i)
  {
    bvec3 passed = lessThanEqual(ExitDepths(ray, level, uvec3(b)), vec3(t));
    bvec3 ahead = greaterThan(EntryDepths(ray, level, uvec3(b)), vec3(t));
    ivec3 move = forward * (ivec3(passed) - ivec3(ahead));
    if (move == ivec3(0))
    {
      break;
    }
    b = clamp(b + move, ivec3(0), last);
  }
  return uvec3(b);
}
