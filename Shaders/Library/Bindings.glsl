// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Everything the marcher reads and writes, in one place.
//
// Spaces: positions along a ray are *view depths* t in world units. Points are in corner
// coordinates of level 0 (voxel i covers [i, i+1]) relative to the integer point u_anchor, so that
// accuracy depends neither on the size of the volume nor on the place in it.

layout(std140, binding = 0) uniform View
{
  vec4 u_rayOrigin[3];    // xyz: at pixel corner (0,0), change per pixel in x, in y; anchored voxels
  vec4 u_rayDirection[3]; // xyz: voxels per unit of view depth, likewise
  vec4 u_rayWorld[3];     // xyz: length in dataset space per unit of view depth, likewise
  uvec4 u_anchor;         // xyz: integer point of level 0
  uvec4 u_dimensions;     // xyz: voxels of level 0; w: brick size
  uvec4 u_levels;         // x: number of levels, y: minimum, z: maximum level, w: page depth
  uvec4 u_levelFactor[MAXIMUM_LEVELS]; // xyz: downsampling factors; w: base in the page directory
  uvec4 u_levelBricks[MAXIMUM_LEVELS]; // xyz: bricks along each axis
  vec4 u_levelStart[MAXIMUM_LEVELS];   // x: view depth where the level begins
  uvec4 u_atlas;      // xyz: slots per axis; w: stored size of a brick
  vec4 u_atlasScale;  // xyz: 1 / texels of the atlas
  vec4 u_value;       // x, y: data value = x * texel + (y + z); z: low part of the offset
  vec4 u_transfer;    // x, y: lower end of the domain as a float pair; z: nodes per unit; w: nodes
  vec4 u_step;        // x: base step in voxels, or < 0: -step in world units; y: tolerance of a
                      // segment; z: transmittance at which a ray ends; w: largest refinement (log2)
  uvec4 u_limits;     // x: steps per pass; y: stamp; z: index of the block stamps; w: of the tiles
  uvec4 u_switches;   // x: skip empty regions; y: volume number; z: tiles along x
  vec4 u_material;    // ambient, diffuse, specular, specular power
  vec4 u_lightDiffuse;  // rgb; w: 1 if two-sided
  vec4 u_lightSpecular; // rgb
  vec4 u_normal[3];   // rows: central difference in voxels of level 0 -> dataset space
  vec4 u_dataset[3];  // rows: direction in voxels -> dataset space (world without the prop's matrix)
  vec4 u_eye;         // xyz: the camera's position, anchored voxels
};

layout(binding = 0) uniform sampler3D u_atlasTexture;
layout(binding = 1) uniform usamplerBuffer u_transferTable;
layout(binding = 3) uniform usamplerBuffer u_occupied; // non-zero intervals before each node
layout(binding = 4) uniform sampler3D u_cells; // least and largest texel of each cell
layout(binding = 2) uniform sampler2D u_intervals; // two intervals of view depth per pixel

layout(binding = 0, rgba32f) uniform coherent image2D u_colorState;    // premultiplied, transmittance
layout(binding = 1, rgba32i) uniform coherent iimage2D u_positionState; // brick; level and status

layout(std430, binding = 0) readonly buffer PageTable
{
  uint b_pageTable[]; // directory entries, then page blocks; three words each
};
layout(std430, binding = 1) coherent buffer FeedbackBuffer
{
  uint b_feedback[];
};
layout(std430, binding = 2) readonly buffer SlotTable
{
  vec4 b_slots[]; // offset (float pair) and scale of the voxels of a slot
};
