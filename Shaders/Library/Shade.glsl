// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Phong shading as VTK 9.1 does it for one light at the camera.

struct Light
{
  float diffuse;  // factor of the colour, ambient included
  float specular; // added, times opacity
};

// `gradient`: central difference per axis in voxel steps of level 0; `towardsViewer`: unit vector in
// world space.
Light Shade(vec3 gradient, vec3 towardsViewer)
{
  vec3 g = vec3(dot(u_normal[0].xyz, gradient), dot(u_normal[1].xyz, gradient),
    dot(u_normal[2].xyz, gradient));
  float magnitude = length(g);
  Light light;
  light.diffuse = u_material.x;
  light.specular = 0.0;
  if (magnitude > 0.0)
  {
    // Light and viewer coincide, so that the half vector is the direction to the viewer.
    float cosine = abs(dot(g / magnitude, towardsViewer));
    light.diffuse += u_material.y * cosine;
    light.specular = u_material.z * (cosine > 0.0 ? pow(cosine, u_material.w) : 0.0);
  }
  return light;
}
