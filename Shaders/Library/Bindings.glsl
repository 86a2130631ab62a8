// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Everything the marcher reads and writes, in one place.
//
// Spaces: positions along a ray are *view depths* t in world units. Points are in corner
// coordinates of level 0 (voxel i covers [i, i+1]) relative to the integer point u_anchor, so that
// accuracy depends neither on the size of the volume nor on the place in it.

layout(std140, binding = 0) uniform View
{
  vec4 u_rayOrigin[3]; // xyz: at pixel corner (0,0), change per pixel in x, in y; anchored voxels
  vec4 u_rayDirection[3]; // xyz: voxels per unit of view depth, likewise
  vec4 u_rayWorld[3];     // xyz: length in dataset space per unit of view depth, likewise
  uvec4 u_anchor;         // xyz: integer point of level 0
  uvec4 u_dimensions;     // xyz: voxels of level 0; w: brick size
  uvec4 u_levels; // x: number of levels, y: minimum, z: maximum level; w: entries of the directory
  uvec4 u_levelFactor[MAXIMUM_LEVELS]; // xyz: downsampling factors; w: base in the page directory
  uvec4 u_levelBricks[MAXIMUM_LEVELS]; // xyz: bricks along each axis; w: page depth
  vec4 u_levelStart[MAXIMUM_LEVELS];   // x: view depth where the level begins
  uvec4 u_atlas;                       // xyz: slots per axis; w: stored size of a brick
  vec4 u_value;     // x, y: data value = x * texel + (y + z); z: low part of the offset; w:
                    // transmittance at which a ray has met what is looked for
  vec4 u_transfer;  // x, y: lower end of the domain as a float pair; z: nodes per unit; w: nodes
  vec4 u_step;      // x: fixed step in world units (variant FIXED_STEP); error allowed to a piece:
                    // y: per opacity that it adds, w: to any; z: transmittance at which a ray ends
  uvec4 u_limits;   // x: steps per pass; y: stamp; z: index of the block stamps; w: of the tiles
  uvec4 u_switches; // x: skip empty regions; y: count samples per pixel; z: tiles along x; w: cropping
  vec4 u_material;  // ambient, diffuse, specular, specular power
  vec4 u_lightDiffuse;  // rgb; w: 1 if two-sided
  vec4 u_lightSpecular; // rgb; w: largest extinction of the transfer function
  vec4 u_normal[3];     // rows: central difference in voxels of level 0 -> dataset space, or with
                        // TERAVOX_LIGHTS -> view space
  vec4 u_dataset[3]; // rows: direction in voxels -> dataset space (world without the prop's matrix)
  vec4 u_eye;        // xyz: the camera's position, anchored voxels
  // Of blend modes other than composite. x: sign of the extreme, number of iso values; y: what a
  // position in nodes may be off by rounding; z: last node that differs, least node that counts; w:
  // largest node that counts, factor of sums.
  vec4 u_projection;
  vec4 u_isoValues[MAXIMUM_ISO_VALUES / 4u]; // nodes, ascending
  vec4 u_isoColors[MAXIMUM_ISO_VALUES];      // rgb, opacity
  vec4 u_crop[5]; // 0-2, rows: anchored voxels -> axes of the image; lower, upper planes along these
  // Of voxels with several components. x: number, 0 for one; y: 1 if they depend on each other.
  uvec4 u_components;
  vec4 u_componentTransfer[4]; // as u_transfer
  vec4 u_componentTable[4];    // x: first node; y: first interval; z: weight, 0 without an opacity;
                               // w: largest light per extinction
  vec4 u_componentMaterial[4]; // as u_material
  vec4 u_gradient; // xyz: nodes of the gradient table per central difference along an axis, in data
                   // per voxel of level 0; w: the last node
  // Of blend modes other than composite. x: what a position in nodes may be off by rounding; y: last
  // node that differs, least node that counts; z: largest node that counts; w: factor of sums.
  vec4 u_componentProjection[4];
  // Of a table over two components, or over value and gradient, whose rows u_gradient is in. x, y:
  // columns per node of the transfer table, column of its first; z: the last one; w: levels of
  // bounds. x: 1 / unit distance; y: largest extinction.
  vec4 u_plane[2];
  // Of voxels with several components. xyz: as u_gradient; w: first node.
  vec4 u_componentGradient[4];
  // What gradients find where planes cut away. x, y: data value as a float pair; w: number of planes.
  vec4 u_clipped;
  vec4 u_clippedPlanes[MAXIMUM_CLIPPED_PLANES]; // xyz . p + w is kept where it isn't negative
};

layout(binding = 0) uniform sampler3D u_atlasTexture;
layout(binding = 4) uniform sampler3D u_cells; // least and largest texel of each cell
layout(binding = 1) uniform samplerBuffer u_transferTable;   // integral (high, low), s_i, s_i+1
layout(binding = 5) uniform usamplerBuffer u_transferColors; // of each node and the next
layout(binding = 3) uniform usamplerBuffer
  u_occupied; // first interval from each node on that isn't zero
#if TERAVOX_GRADIENT_OPACITY
layout(binding = 9) uniform samplerBuffer u_gradientTable; // see GradientTable
#endif
#if TERAVOX_PLANE
layout(binding = 9) uniform samplerBuffer u_planeTable; // nodes, then bounds: see TransferPlane
#endif
layout(
  binding = 6) uniform usamplerBuffer u_pageTable; // directory, then page blocks: word, low, high
layout(binding = 2) uniform sampler2D
  u_intervals; // per pixel: interval of view depth; where a light at the eye is taken

// State of each ray: premultiplied colour, transmittance; brick, level and status. What the pass
// before left is read as a texture, which is faster on the CPU; each pixel only once, then written.
layout(binding = 7) uniform sampler2D u_colorBefore;
layout(binding = 8) uniform isampler2D u_positionBefore;
layout(binding = 0, rgba32f) uniform writeonly image2D u_colorState;
layout(binding = 1, rgba32i) uniform writeonly iimage2D u_positionState;
#if TERAVOX_ESTIMATE || TERAVOX_COUNT
layout(binding = 2, r32f) uniform image2D u_errorState; // or samples
#endif
#if TERAVOX_COMPONENTS && !TERAVOX_GRADIENT_OPACITY && !TERAVOX_PLANE
// Of averages of several components: where values count, world units, of each.
layout(binding = 9) uniform sampler2D u_lengthsBefore;
layout(binding = 4, rgba32f) uniform writeonly image2D u_lengthsState;
#endif
#if TERAVOX_FIRST_HIT
layout(binding = 3, rg32f) uniform writeonly image2D u_firstHit; // depth, level
#endif

layout(std430, binding = 1) coherent buffer FeedbackBuffer
{
  uint b_feedback[];
};
layout(std430, binding = 2) readonly buffer SlotTable
{
  vec4 b_slots[]; // offset (float pair) and scale of the voxels of a slot
};
