// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// The integral through one brick, interpolation cell after interpolation cell: between eight voxel
// centres the trilinear field along a ray is a cubic, known exactly from one fetch of the corners
// (Parker et al. 1998, section 4.2 use it for isosurfaces). It is cut where it turns and where a
// linear piece would miss more than the error allows; no ray is cut by what the cache holds. The
// result depends on the cell alone, so that empty cells can be leapt over.
#include "Library/CellWalk.glsl"
#include "Library/PlanePieces.glsl"
#if TERAVOX_BLEND
#include "Library/ProjectCells.glsl"
#elif TERAVOX_COMPONENTS
#include "Library/ComponentCells.glsl"
#else
#include "Library/Pieces.glsl"
#endif
#if TERAVOX_MASK
#include "Library/MaskCells.glsl"
#endif

void IntegrateBrick(inout State state, Ray ray, BrickView view, int level, float t0, float t1)
{
  CellWalk walk = BeginWalk(ray, view, t0, t1);
  for (int event = 0; event < 8192; ++event)
  {
    if (walk.t >= walk.end || state.transmittance <= u_step.z)
    {
      break;
    }
    VisitedCell visited = NextVisibleCell(walk, state, view);
    if (visited.visible)
    {
#if TERAVOX_MASK
      IntegrateMasked(state, ray, view, level, walk, visited);
#else
      IntegrateCell(state, ray, view, level, walk, visited);
#endif
    }
  }
}
