// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// What a ray keeps of the field in a projection mode (any blend mode but composite), beside colour
// and transmittance (Shaders/Library/Projection.glsl).

#if TERAVOX_COMPONENTS
struct ProjectionState
{
  float Extreme[MostComponents]; // of each component, as that of one
  float Sum[MostComponents];
  float Length[MostComponents];
  std::int32_t Side; // of nothing: isosurfaces are of one component
};
#else
struct ProjectionState
{
  bool Any = false;         // value that counts has been met
  float Extreme = -FarAway; // in nodes; with the other sign for minima, so that more is better
  float Sum = 0;            // of the table's values times lengths
  float Length = 0;         // of the ray where values count, world units
  std::int32_t Side = -1;   // how many iso values the field isn't below; -1: not known
};
#endif
