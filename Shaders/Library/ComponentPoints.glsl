// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// What components do together at a place of a ray: emission and extinction are those of
// Module/Core/Components.h.
#if TERAVOX_COMPONENTS
// Less isn't divided by: its inverse would be infinite.
const float LEAST_KAPPA = 1.0e-37;

// Positions of the components in nodes of their tables, and where emitters have a value (1, else 0).
struct Values
{
  float node[TERAVOX_COMPONENTS];
  float has[EMITTERS];
#if TERAVOX_SHADE
  vec3 normal[EMITTERS];
#endif
#if TERAVOX_GRADIENT_OPACITY
  vec3 difference[EMITTERS]; // central, per axis in voxels of level 0
#endif
};

struct Point
{
  Sample s[EMITTERS];
  float left[EMITTERS]; // what their gradients leave of the extinction
#if TERAVOX_GRADIENT_OPACITY
  SampledGradient gradient[EMITTERS];
#endif
  vec3 own[EMITTERS]; // their colours, lit
  float kappa;        // extinction
  vec3 light;         // emission
};

// The extinction that components have together.
float TogetherOf(float s[EMITTERS])
{
#if TERAVOX_DEPENDENT
  return s[0];
#else
  precise float total = 0.0;
  for (int e = 0; e < EMITTERS; ++e)
  {
    total += s[e] * WeightOf(e);
  }
  total = max(total, LEAST_KAPPA);
  precise float kappa = 0.0;
  for (int e = 0; e < EMITTERS; ++e)
  {
    kappa += s[e] * (s[e] / total);
  }
  return kappa;
#endif
}

#if TERAVOX_SHADE || TERAVOX_GRADIENT_OPACITY
// From an emitter's central difference per axis in voxels of level 0.
void SetDifference(inout Values v, int emitter, vec3 difference)
{
#if TERAVOX_SHADE
  v.normal[emitter] = NormalOf(difference);
#endif
#if TERAVOX_GRADIENT_OPACITY
  v.difference[emitter] = difference;
#endif
}
#endif

Point FindPoint(Values v, State state, float t)
{
  Point p;
  precise vec3 light = vec3(0.0);
  for (int e = 0; e < EMITTERS; ++e)
  {
    int c = FIRST_EMITTER + e;
    p.s[e] = SamplePart(c, v.node[c]);
#if TERAVOX_PLANE
    PlaneSample there = SamplePlane(v.node[0], max(v.node[1], 0.0));
    p.s[e].s = p.s[e].s > 0.0 ? there.s : 0.0;
#endif
    p.s[e].s *= v.has[e];
    p.left[e] = p.s[e].s;
#if TERAVOX_GRADIENT_OPACITY
    p.gradient[e] = SampleGradient(u_componentGradient[c], v.difference[e]);
    p.left[e] *= p.gradient[e].opacity;
#endif
#if TERAVOX_PLANE
    vec3 color = there.color;
#elif TERAVOX_DEPENDENT && TERAVOX_COMPONENTS == COMPONENTS_RGBA
    vec3 color = clamp(vec3(v.node[0], v.node[1], v.node[2]), 0.0, 1.0);
#elif TERAVOX_DEPENDENT
    vec3 color = PartColor(0, v.node[0]);
#else
    vec3 color = PartColor(c, v.node[c]);
#endif
#if TERAVOX_SHADE
    color = LitColor(color, LightOn(u_componentMaterial[c], v.normal[e], state.light, t));
#endif
    p.own[e] = color;
    light += (p.left[e] * WeightOf(c)) * color;
  }
  p.kappa = TogetherOf(p.left);
  p.light = light;
  return p;
}

// A segment in which nothing changes.
void TakeUniform(inout State state, Point p, float length_)
{
  precise float depth = p.kappa * length_;
  float inverse = p.kappa > LEAST_KAPPA ? 1.0 / p.kappa : 0.0;
  Accumulate(state, OpacityOf(depth), p.light * inverse);
  COUNT(samples, true);
  COUNT(evaluated, depth > 0.0);
  COUNT(contributing, depth > 0.0);
}

// One whose components all have one value.
void IntegrateConstant(inout State state, Ray ray, vec2 value, int level, float t0, float t1)
{
  Values v;
  for (int c = 0; c < TERAVOX_COMPONENTS; ++c)
  {
    v.node[c] = PartPosition(c, value.x, value.y);
  }
  for (int e = 0; e < EMITTERS; ++e)
  {
    v.has[e] = WeightOf(FIRST_EMITTER + e) > 0.0 ? 1.0 : 0.0;
#if TERAVOX_SHADE || TERAVOX_GRADIENT_OPACITY
    SetDifference(v, e, PlainDifference(value, level));
#endif
  }
  TakeUniform(state, FindPoint(v, state, mix(t0, t1, 0.5)), max(t1 - t0, 0.0) * ray.world);
  state.steps += 1u;
}
#endif
