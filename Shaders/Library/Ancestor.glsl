// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// What is drawn in the place of a brick that isn't there.

#if TERAVOX_INTERACTIVE || TERAVOX_SUBSTITUTE
// The finest ancestor that can be drawn instead: resident (interactive), or readable (a failed
// brick: requested, and waited for when converging). Returns false if the ray has to wait.
bool FindAncestor(
  inout Found found, int level, uvec3 brick, float weight, out int drawnLevel, out uvec3 drawnBrick)
{
  bool failed = found.kind == FOUND_FAILED;
  drawnLevel = level;
  drawnBrick = brick;
  uvec3 fine = brick * u_levelFactor[level].xyz;
  bool wait = false;
  bool reached = false;
  for (int l = level + 1; l < int(u_levels.x); ++l)
  {
    if (wait || reached)
    {
      break;
    }
    uvec3 coarse = fine / u_levelFactor[l].xyz;
    Found at = Translate(LoadLevel(l), coarse);
    if (at.kind == FOUND_MAPPED || at.kind == FOUND_SINGLE || at.kind == FOUND_EMPTY)
    {
      found = at;
      found.region = 0;
      drawnLevel = l;
      drawnBrick = coarse;
      reached = true;
    }
    else if (failed && at.kind == FOUND_MISSING)
    {
      Request(l, coarse, weight);
#if !TERAVOX_INTERACTIVE
      wait = true;
#endif
    }
  }
  if (!wait)
  {
    b_feedback[FEEDBACK_FALLBACK] = 1u;
    if (!reached)
    {
      found.kind = FOUND_EMPTY;
      found.region = 0;
    }
  }
  return !wait;
}
#endif
