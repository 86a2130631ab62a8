// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Cropping: two planes along each axis of the image divide space into 27 regions, of which some are
// kept. A ray has up to CROP_INTERVALS stretches in those. Which is which follows from the ray and
// the stretch's number alone, so that it makes no difference where a pass was interrupted.

int IntervalCount()
{
  return u_switches.w == 0u ? 1 : int(CROP_INTERVALS);
}

// The least depth behind t at which one of three planes is met.
float NextOf(vec3 planes, float t, float end)
{
  return Minimum(mix(vec3(end), planes, greaterThan(planes, vec3(t))));
}

// The stretch of a ray's interval with this number, from its begin to its end; none where it ends
// before it begins. Regions that are kept and lie one behind the other are one stretch.
vec2 KeptInterval(Ray ray, vec2 hull, int number)
{
  vec2 kept = number == 0 ? hull : vec2(0.0, -3.0e38);
  if (u_switches.w != 0u)
  {
    precise vec3 o = vec3(dot(u_crop[0].xyz, ray.origin), dot(u_crop[1].xyz, ray.origin),
      dot(u_crop[2].xyz, ray.origin));
    precise vec3 d = vec3(dot(u_crop[0].xyz, ray.direction), dot(u_crop[1].xyz, ray.direction),
      dot(u_crop[2].xyz, ray.direction));
    float tiny = 1.0e-12 * max(abs(d.x), max(abs(d.y), abs(d.z)));
    d = mix(d, vec3(tiny), lessThan(abs(d), vec3(tiny)));
    precise vec3 lower = (u_crop[3].xyz - o) / d;
    precise vec3 upper = (u_crop[4].xyz - o) / d;
    bvec3 up = greaterThan(d, vec3(0.0));
    vec3 near = mix(upper, lower, up);
    vec3 far = mix(lower, upper, up);
    kept = vec2(0.0, -3.0e38);
    float t = hull.x;
    int count = 0;
    bool inside = false;
    for (int piece = 0; piece < 7; ++piece)
    {
      if (t >= hull.y)
      {
        break;
      }
      ivec3 passed = ivec3(lessThanEqual(near, vec3(t))) + ivec3(lessThanEqual(far, vec3(t)));
      ivec3 place = ivec3(mix(vec3(2 - passed), vec3(passed), up));
      int region = place.x + 3 * place.y + 9 * place.z;
      bool now = ((u_switches.w >> uint(region)) & 1u) != 0u;
      float next = min(NextOf(near, t, hull.y), NextOf(far, t, hull.y));
      count += now && !inside ? 1 : 0;
      if (now && count == number + 1)
      {
        kept = vec2(inside ? kept.x : t, next);
      }
      inside = now;
      t = next;
    }
  }
  return kept;
}
