// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Defaults of all features, so that each file also parses alone. ShaderLibrary puts the chosen
// values before this file.
#ifndef TERAVOX_NEAREST
#define TERAVOX_NEAREST 0 // nearest interpolation: one segment per voxel
#endif
#ifndef TERAVOX_FIXED_STEP
#define TERAVOX_FIXED_STEP 0 // steps of a given length; else as long as the error allows
#endif
#ifndef TERAVOX_BUFFER_ATLAS
#define TERAVOX_BUFFER_ATLAS 0 // the atlas is a buffer texture; else a 3-D texture
#endif
#ifndef TERAVOX_FLOAT_DATA
#define TERAVOX_FLOAT_DATA 1 // voxels may be NaN
#endif
#ifndef TERAVOX_SLOT_TABLE
#define TERAVOX_SLOT_TABLE 0 // voxels are stored relative to their brick
#endif
#ifndef TERAVOX_SHADE
#define TERAVOX_SHADE 0 // Phong
#endif
#ifndef TERAVOX_LIGHTS
#define TERAVOX_LIGHTS 0 // other lights than one headlight
#endif
#ifndef TERAVOX_GRADIENT_OPACITY
#define TERAVOX_GRADIENT_OPACITY 0 // extinction times a function of the gradient's magnitude
#endif
#ifndef TERAVOX_PLANE
#define TERAVOX_PLANE                                                                              \
  0 // instead of that: opacity and colour over value and gradient, or over two
    // components, which are dependent ones then
#endif
#ifndef TERAVOX_INTERACTIVE
#define TERAVOX_INTERACTIVE 0 // draw the finest resident ancestor of a missing brick; else wait
#endif
#ifndef TERAVOX_COUNT
#define TERAVOX_COUNT 0 // count samples
#endif
#ifndef TERAVOX_SHOW_LEVEL
#define TERAVOX_SHOW_LEVEL 0 // picture of the level of the first contribution
#endif
#ifndef TERAVOX_ESTIMATE
#define TERAVOX_ESTIMATE 0 // estimate the error of each pixel
#endif
#ifndef TERAVOX_FIRST_HIT
#define TERAVOX_FIRST_HIT 0 // keep where a ray's opacity becomes what is looked for
#endif
#ifndef TERAVOX_SUBSTITUTE
#define TERAVOX_SUBSTITUTE 1 // some bricks can't be read: draw their finest readable ancestor
#endif
#ifndef TERAVOX_OPAQUE_DEPTH
#define TERAVOX_OPAQUE_DEPTH 1 // rays end at opaque geometry
#endif
#ifndef TERAVOX_BLEND
#define TERAVOX_BLEND 0 // what a ray makes of the field; 0: composite blending
#endif
#ifndef TERAVOX_COMPONENTS
#define TERAVOX_COMPONENTS 0 // of a voxel, 2 to 4; 0: one
#endif
#ifndef TERAVOX_MASK
#define TERAVOX_MASK 0 // slots hold a mask behind the voxels; of one component
#endif
#ifndef TERAVOX_CLIPPED_GRADIENT
#define TERAVOX_CLIPPED_GRADIENT 0 // gradients find a value of its own behind clipping planes
#endif
#ifndef TERAVOX_LABELS
#define TERAVOX_LABELS 0 // it tells which of many tables count; composite blending
#endif
#ifndef TERAVOX_DEPENDENT
#define TERAVOX_DEPENDENT 0 // the last of them has the opacity, the others the colour; or a plane
#endif
#define COMPONENTS_RGBA 4 // of dependent ones: red, green, blue, opacity; of two: colour, opacity
#define BLEND_MAXIMUM 1
#define BLEND_MINIMUM 2
#define BLEND_AVERAGE 3
#define BLEND_ADDITIVE 4
#define BLEND_ISOSURFACE 5
#define BLEND_SLICE 6
