// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// The mask that lies behind the voxels of a slot, in texels of the same type: 0 where nothing is
// drawn; with a label mask else whose tables count, with a binary one 1.
#if TERAVOX_MASK

// Behind all components.
#if TERAVOX_COMPONENTS
const int BEFORE_MASK = TERAVOX_COMPONENTS;
#else
const int BEFORE_MASK = 1;
#endif

// The mask's value that a texel holds.
int MaskValue(float texel)
{
  return int(texel * u_value.x + 0.5);
}

int MaskAt(BrickView view, ivec3 voxel)
{
  voxel.z += BEFORE_MASK * int(u_atlas.w);
  return MaskValue(Voxel(view, voxel));
}

// Least and largest value in a cell of CELL_EDGE^3 voxels, with those that are interpolated with
// them.
ivec2 MaskRange(BrickView view, ivec3 cell)
{
  cell.z += BEFORE_MASK * CellsAlong();
  vec2 range = CellRange(view, cell);
  return ivec2(MaskValue(range.x), MaskValue(range.y));
}

// From now on the tables of a value of the mask count.
void SelectTables(int value)
{
#if TERAVOX_LABELS
  g_label = value;
#endif
}

// The same for all that lies in such a cell.
void SelectTablesOf(BrickView view, ivec3 cell)
{
#if TERAVOX_LABELS
  ivec2 range = MaskRange(view, cell);
  g_label = range.x == range.y ? range.x : 0;
#endif
}
#endif
