// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// What a ray that others may be interpolated from notes beside its colour: whether it came by cells
// in which other rays may see what it didn't.

struct WatchState
{
  float Light = 1;       // transmittance where the brick begins
  float Voxel = 0;       // its length along the ray, world units
  float End = -FarAway;  // depth at which the last cell that may be visible ends
  float Least = FarAway; // range of the cells one behind the other that end there, in nodes
  float Largest = -FarAway;
  bool Seen = true; // something of them
  float Missed = 0; // most light that such cells of which nothing was seen may add or take away
};
