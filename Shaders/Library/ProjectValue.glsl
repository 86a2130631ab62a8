// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Blend modes other than composite: what they make of a part of the ray with one value.
#if !TERAVOX_COMPONENTS

#if TERAVOX_BLEND == BLEND_ISOSURFACE || TERAVOX_BLEND == BLEND_SLICE
Place PlaceWith(vec3 gradient, float t)
{
  Place place;
  place.u = 0.0;
#if TERAVOX_SHADE
  place.gradient =
    Gradient(vec4(gradient.x, 0.0, 0.0, 0.0), vec4(gradient.y, 0.0, 0.0, 0.0), vec4(gradient.z, 0.0, 0.0, 0.0));
  place.perVoxel = vec3(1.0);
  place.begin = t;
  place.extent = 0.0;
#endif
  return place;
}
#endif

#if TERAVOX_BLEND == BLEND_SLICE
// What a slice shows of a value.
void TakeSlice(inout State state, float node, Place place)
{
  if (!g_any)
  {
    Accumulate(
      state, min(SampleTransfer(node).s, 1.0), ColorAt(state, place, TransferColor(node)));
    g_any = true;
  }
}
#endif

// A part of the ray with one value. `gradient`: in data per voxel of level 0.
void TakeValue(inout State state, Ray ray, float node, vec3 gradient, float t0, float t1)
{
#if TERAVOX_BLEND == BLEND_MAXIMUM
  TakeExtreme(state, ExtremeOf(node));
#elif TERAVOX_BLEND == BLEND_MINIMUM
  TakeExtreme(state, ExtremeOf(-node));
#elif TERAVOX_BLEND == BLEND_ISOSURFACE
  JumpTo(state, node, PlaceWith(gradient, t0));
#elif TERAVOX_BLEND == BLEND_SLICE
  TakeSlice(state, node, PlaceWith(gradient, t0));
#else
  AddSum(SumBetween(TheSumRule(), node, node) * ((t1 - t0) * ray.world));
#endif
}

// `value`: a float pair.
void ProjectConstant(inout State state, Ray ray, vec2 value, int level, float t0, float t1)
{
  state.steps += 1u;
  if (t1 > t0)
  {
    float node = TransferPosition(value.x, value.y);
    TakeValue(state, ray, node, PlainDifference(value, level), t0, t1);
  }
}
#endif
