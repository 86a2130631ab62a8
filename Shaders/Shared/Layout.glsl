// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Numbers and address arithmetic that both the C++ and the GLSL compiler read. Pure functions of
// uint; no samplers, no uniforms. C++ includes it through Module/Core/SharedLayout.h.

// States of a page entry, in the two upper bits of its first word.
const uint PAGE_UNMAPPED = 0u;
const uint PAGE_MAPPED = 1u;
const uint PAGE_FAILED = 2u;
const uint PAGE_SINGLE = 3u;
const uint PAGE_SLOT_MASK = 0x3fffffffu;

// log2 of the entries of a page block along each axis, and the entries of a block.
const uint PAGE_SHIFT = 3u;
const uint PAGE_BLOCK_ENTRIES = 512u;

const uint MAXIMUM_LEVELS = 32u;
const uint MAXIMUM_ISO_VALUES = 256u;
const uint MAXIMUM_CLIPPED_PLANES = 16u;

// The feedback buffer: header, request table, one stamp per atlas slot, one per page block, one
// flag per tile of the picture.
const uint FEEDBACK_WAITING = 0u;      // a ray waits for a brick
const uint FEEDBACK_UNFINISHED = 1u;   // a ray stopped because its pass was long enough
const uint FEEDBACK_OVERFLOW = 2u;     // a request found no place in the table
const uint FEEDBACK_FALLBACK = 3u;     // a coarser ancestor was drawn for a missing or failed brick
// Of variants that count: cells or samples of the field looked at; of them those whose opacity and
// colour were computed, and those that contributed; places where gradients were computed; bricks,
// and empty regions that were left at once.
const uint FEEDBACK_SAMPLES = 4u;
const uint FEEDBACK_CONTRIBUTING = 5u;
const uint FEEDBACK_EVALUATED = 6u;
const uint FEEDBACK_GRADIENTS = 7u;
const uint FEEDBACK_VISITS = 8u;
const uint FEEDBACK_HEADER_WORDS = 16u;
const uint REQUEST_ENTRIES = 4096u;
const uint REQUEST_WORDS = 6u; // tag, x, y, z, level, weight
const uint REQUEST_PROBES = 8u;
const uint FEEDBACK_STAMPS = FEEDBACK_HEADER_WORDS + REQUEST_ENTRIES * REQUEST_WORDS;

const uint TILE_SIZE = 32u;

// The table of lights: vectors before the first light, and per light.
const uint LIGHTS_BEGIN = 7u;
const uint LIGHT_VECTORS = 5u;

// Cropping: a bit that says that there is any, and one for each of the 27 regions that is kept.
const uint CROP_ON = 0x80000000u;
const uint CROP_REGIONS = 0x07ffffffu;
// Stretches of a ray in regions that are kept: six planes cut it into seven.
const uint CROP_INTERVALS = 4u;

// Edge of a cell, in voxels: the unit in which emptiness inside a brick is known.
const uint CELL_EDGE = 4u;

uint PageState(uint word)
{
  return word >> 30u;
}

uint PageSlot(uint word)
{
  return word & PAGE_SLOT_MASK;
}

// Index of a brick or region inside its page block.
uint IndexInBlock(uint x, uint y, uint z)
{
  return (x & 7u) + ((y & 7u) << 3u) + ((z & 7u) << 6u);
}

// Entries of a page level along one axis: bricks / 8^pageLevel, rounded up.
uint PagesAlong(uint bricks, uint pageLevel)
{
  uint shift = PAGE_SHIFT * pageLevel;
  return shift > 30u ? 1u : ((bricks - 1u) >> shift) + 1u;
}

// A hash of a request's key that is never 0; 0 marks a free entry of the request table.
uint RequestTag(uint x, uint y, uint z, uint level)
{
  uint h = x * 0x9E3779B1u;
  h = (h ^ (h >> 15u)) + y * 0x85EBCA77u;
  h = (h ^ (h >> 13u)) + z * 0xC2B2AE3Du;
  h = (h ^ (h >> 16u)) + level * 0x27D4EB2Fu;
  h = h ^ (h >> 15u);
  return h == 0u ? 1u : h;
}
