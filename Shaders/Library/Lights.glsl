// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Light from any number of directions and places, as VTK 9.1 does it where there is more than one
// headlight, in view space. A habit of it is put right: highlights are those of all lights, for a
// view along the ray (VTK: of the last directional one, or for a view from the other side).

#if TERAVOX_LIGHTS
layout(std430, binding = 4) readonly buffer Lights
{
  vec4 b_lights[]; // see Module/Core/LightSetup.h
};

// The ray in the space of the lights.
struct RayLight
{
  vec3 origin;
  vec3 direction;
  vec3 view; // along the ray, a unit vector
};

vec3 LightRow(int first, vec2 pixel)
{
  precise vec3 v = b_lights[first].xyz + pixel.x * b_lights[first + 1].xyz +
    pixel.y * b_lights[first + 2].xyz;
  return v;
}

RayLight LightOf(Ray ray, float begin, vec2 pixel)
{
  RayLight light;
  light.origin = LightRow(0, pixel);
  light.direction = LightRow(3, pixel);
  light.view = normalize(light.direction);
  return light;
}

// How much of a positional light arrives at a place to which it shines along `direction`.
float Attenuation(int at, vec3 direction, float distance_)
{
  vec3 falling = b_lights[at + 4].xyz;
  float arriving = 1.0 / (falling.x + distance_ * (falling.y + distance_ * falling.z));
  float edge = b_lights[at + 2].w;
  float cosine = dot(direction, b_lights[at + 2].xyz);
  float spot = cosine >= edge && cosine > 0.0 ? pow(cosine, b_lights[at + 1].w) : 0.0;
  return edge > -1.5 ? arriving * spot : arriving;
}

float Facing(float cosine)
{
  return u_lightDiffuse.w != 0.0 ? abs(cosine) : max(cosine, 0.0);
}

// `material`: as material.
Light LightOn(vec4 material, vec3 normal, RayLight ray, float t)
{
  Light light;
  light.diffuse = vec3(0.0);
  light.specular = vec3(0.0);
  int count = int(b_lights[LIGHTS_BEGIN - 1u].w);
  vec3 place = ray.origin + t * ray.direction;
  for (int i = 0; i < count; ++i)
  {
    int at = int(LIGHTS_BEGIN) + i * int(LIGHT_VECTORS);
    bool positional = b_lights[at].w != 0.0;
    vec3 from = place - b_lights[at + 3].xyz;
    float distance_ = length(from);
    vec3 direction =
      positional ? (distance_ > 0.0 ? from / distance_ : vec3(0.0)) : b_lights[at + 2].xyz;
    float arriving = positional ? Attenuation(at, direction, distance_) : 1.0;
    light.diffuse += b_lights[at].rgb * (arriving * Facing(dot(normal, direction)));
    vec3 half_ = direction + ray.view;
    float size = length(half_);
    float shine = size > 0.0 ? Facing(dot(normal, half_ / size)) : 0.0;
    light.specular +=
      b_lights[at + 1].rgb * (arriving * (shine > 0.0 ? pow(shine, material.w) : 0.0));
  }
  light.diffuse *= material.y;
  light.specular = light.specular * material.z + material.x * b_lights[LIGHTS_BEGIN - 1u].rgb;
  return light;
}
#endif
