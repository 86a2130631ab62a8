// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Phong shading as VTK 9.1 does it for one light at the camera, with two habits of it put right:
// the central difference spans one voxel of the level on each side (VTK: n / (n - 1) voxels), and
// normals are turned by the image's direction matrix.

#if TERAVOX_SHADE
struct Light
{
  vec3 diffuse;  // factor of the colour, ambient included
  vec3 specular; // added to the colour
};

#include "Library/Lights.glsl"
#if !TERAVOX_LIGHTS
// What the light is like along a ray: towards it.
struct RayLight
{
  vec3 towards;
};

// Unit vector from where the ray begins in the volume to the eye, in dataset space (world without
// the prop's matrix). In parallel projection VTK's headlight is still at the camera's position.
RayLight LightOf(Ray ray, float begin, vec2 pixel)
{
  vec3 v = u_eye.xyz - (ray.origin + begin * ray.direction);
  return RayLight(normalize(
    vec3(dot(u_dataset[0].xyz, v), dot(u_dataset[1].xyz, v), dot(u_dataset[2].xyz, v))));
}

// `material`: as u_material.
Light LightOn(vec4 material, vec3 normal, RayLight ray, float t)
{
  Light light;
  light.diffuse = vec3(material.x);
  light.specular = vec3(0.0);
  if (normal != vec3(0.0))
  {
    float cosine = dot(normal, ray.towards);
    cosine = u_lightDiffuse.w != 0.0 ? abs(cosine) : max(cosine, 0.0);
    light.diffuse += u_lightDiffuse.rgb * (material.y * cosine);
    light.specular =
      u_lightSpecular.rgb * (material.z * (cosine > 0.0 ? pow(cosine, material.w) : 0.0));
  }
  return light;
}

#endif

Light LightFrom(vec3 normal, RayLight ray, float t)
{
  return LightOn(u_material, normal, ray, t);
}

// A unit vector in the space of the lights, or 0 where there is no direction. `gradient`: central
// difference per axis, in voxels of level 0.
vec3 NormalOf(vec3 gradient)
{
  vec3 g = vec3(
    dot(u_normal[0].xyz, gradient), dot(u_normal[1].xyz, gradient), dot(u_normal[2].xyz, gradient));
  // Squares of faint gradients would vanish.
  float largest = max(abs(g.x), max(abs(g.y), abs(g.z)));
  g *= largest < 1.0e-15 ? 1.0e24 : 1.0;
  float magnitude = length(g);
  // Neither beside voxels without a value nor beside infinite ones.
  return magnitude > 0.0 && magnitude < 3.0e38 ? g / magnitude : vec3(0.0);
}

// At a depth of a ray.
Light Shade(vec3 gradient, RayLight ray, float t)
{
  return LightFrom(NormalOf(gradient), ray, t);
}

// As VTK, the lit colour is clamped before it is weighted with the opacity.
vec3 LitColor(vec3 color, Light light)
{
  return clamp(color * light.diffuse + light.specular, 0.0, 1.0);
}
#endif
