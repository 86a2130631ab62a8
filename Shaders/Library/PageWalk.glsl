// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Address translation: from a brick of a level through directory and page blocks to its slot.

const int FOUND_EMPTY = 0;   // the transfer function is 0 on the region of page level `region`
const int FOUND_SINGLE = 1;  // one value, (low, high) as a float pair
const int FOUND_MAPPED = 2;  // in atlas slot `slot`
const int FOUND_MISSING = 3; // the brick, or a page block on the way
const int FOUND_FAILED = 4;  // can't be read

// Whether a region without any value, or with values between two positions in nodes, makes no
// difference to the ray. Of several components: with data values between the two.
bool IsInvisible(bool none, float from, float to)
{
#if TERAVOX_BLEND && TERAVOX_COMPONENTS
  return none || SkipsValues(from, to);
#elif TERAVOX_BLEND
  return SkipsRange(none, from, to);
#elif TERAVOX_COMPONENTS
  return none || AreValuesEmpty(from, to);
#else
  return none || IsEmptyBetween(from, to);
#endif
}

struct Found
{
  int kind;
  uint slot;
  int region;
  float low;
  float high;
};

void Stamp(uint at)
{
  // Read first: a blind write from each fragment costs several times as much.
  if (b_feedback[at] != u_limits.y)
  {
    b_feedback[at] = u_limits.y;
  }
}

Found Nothing()
{
  Found found;
  found.kind = FOUND_MISSING;
  found.slot = 0u;
  found.region = 0;
  found.low = 0.0;
  found.high = 0.0;
  return found;
}

Found Translate(Level level, uvec3 brick)
{
  Found found = Nothing();
  int depth = int(level.depth);
  uint shift = PAGE_SHIFT * uint(depth);
  uvec3 page = brick >> shift;
  uint columns = PagesAlong(level.bricks.x, uint(depth));
  uint rows = PagesAlong(level.bricks.y, uint(depth));
  uint entry = level.base + page.x + columns * (page.y + rows * page.z);
  for (int k = depth; k >= 0; --k)
  {
    uvec3 words = texelFetch(u_pageTable, int(entry)).xyz;
    uint word = words.x;
    float low = uintBitsToFloat(words.y);
    float high = uintBitsToFloat(words.z);
    uint state = PageState(word);
    // A single value is a pair of floats, else these are the ends of the range.
    bool single = state == PAGE_SINGLE;
    float from = TransferPosition(low, single ? high : 0.0);
    float to = single ? from : TransferPosition(high, 0.0);
    bool none = !single && low > high; // no value at all
    if (u_switches.x != 0u && IsInvisible(none, from, to))
    {
      found.kind = FOUND_EMPTY;
      found.region = single ? 0 : k;
      break;
    }
    if (single)
    {
      found.kind = FOUND_SINGLE;
      found.low = low;
      found.high = high;
      break;
    }
    if (state == PAGE_FAILED)
    {
      found.kind = FOUND_FAILED;
      break;
    }
    if (state != PAGE_MAPPED)
    {
      break;
    }
    found.slot = PageSlot(word);
    if (k == 0)
    {
      found.kind = FOUND_MAPPED;
      Stamp(FEEDBACK_STAMPS + found.slot);
      break;
    }
    Stamp(u_limits.z + found.slot);
    uvec3 child = brick >> (PAGE_SHIFT * uint(k - 1));
    entry = u_levels.w + found.slot * PAGE_BLOCK_ENTRIES + IndexInBlock(child.x, child.y, child.z);
  }
  return found;
}

// Puts a brick into the request table: open addressing, claimed by compare-and-swap of a tag. Two
// keys with one tag lose one request for this pass only.
void Request(int level, uvec3 brick, float weight)
{
  uint tag = RequestTag(brick.x, brick.y, brick.z, uint(level));
  uint w = uint(weight * 255.0) + 1u;
  uint place = tag % REQUEST_ENTRIES;
  bool served = false;
  for (uint probe = 0u; probe < REQUEST_PROBES; ++probe)
  {
    uint at = FEEDBACK_HEADER_WORDS + ((place + probe) % REQUEST_ENTRIES) * REQUEST_WORDS;
    uint owner = b_feedback[at];
    if (owner == 0u)
    {
      owner = atomicCompSwap(b_feedback[at], 0u, tag);
      if (owner == 0u)
      {
        b_feedback[at + 1u] = brick.x;
        b_feedback[at + 2u] = brick.y;
        b_feedback[at + 3u] = brick.z;
        b_feedback[at + 4u] = uint(level) + 1u;
        owner = tag;
      }
    }
    if (owner == tag)
    {
      atomicAdd(b_feedback[at + 5u], w);
      served = true;
      break;
    }
  }
  if (!served)
  {
    b_feedback[FEEDBACK_OVERFLOW] = 1u;
  }
}
