// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// One segment per voxel, with several components.
void TakeVoxel(
  inout State state, Ray ray, BrickView view, int level, ivec3 voxel, float t0, float t1)
{
#if TERAVOX_MASK
  if (MaskAt(view, voxel) == 0)
  {
    COUNT(samples, true);
    return;
  }
#endif
  Values v;
  float texels[TERAVOX_COMPONENTS];
  bool all_ = true;
  for (int c = 0; c < TERAVOX_COMPONENTS; ++c)
  {
    texels[c] = Voxel(PartOf(view, c), voxel);
    v.node[c] = PartNode(view, c, texels[c]);
#if TERAVOX_FLOAT_DATA
    all_ = all_ && !isnan(texels[c]);
    v.node[c] = isnan(texels[c]) ? 0.0 : v.node[c];
#endif
  }
  for (int e = 0; e < EMITTERS; ++e)
  {
    int c = FIRST_EMITTER + e;
    bool has = WeightOf(c) > 0.0;
#if TERAVOX_FLOAT_DATA && TERAVOX_DEPENDENT
    has = has && all_;
#elif TERAVOX_FLOAT_DATA
    has = has && !isnan(texels[c]);
#endif
    v.has[e] = has ? 1.0 : 0.0;
#if TERAVOX_SHADE || TERAVOX_GRADIENT_OPACITY
    SetDifference(v, e, CentralDifference(PartOf(view, c), voxel) / vec3(u_levelFactor[level].xyz));
    COUNT(gradients, has);
#endif
  }
  TakeUniform(state, FindPoint(v, state, mix(t0, t1, 0.5)), (t1 - t0) * ray.world);
}
