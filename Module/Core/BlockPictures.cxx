// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "BlockPictures.h"

#include <algorithm>

namespace teravox
{

namespace
{
constexpr int StateChannels = 4;

bool IsExtreme(BlendKind blend)
{
  return blend == BlendKind::Maximum || blend == BlendKind::Minimum;
}

std::size_t TileCount(int width, int height)
{
  return static_cast<std::size_t>(OpacityTilesAlong(width)) *
    static_cast<std::size_t>(OpacityTilesAlong(height));
}

std::size_t TileOf(int x, int y, int width)
{
  return static_cast<std::size_t>(y / OpacityTileEdge) *
    static_cast<std::size_t>(OpacityTilesAlong(width)) +
    static_cast<std::size_t>(x / OpacityTileEdge);
}
} // namespace

std::vector<float> LeastOpacities(const std::vector<float>& colors, int width, int height)
{
  std::vector<float> least(TileCount(width, height), 1.0f);
  std::size_t pixel = 0;
  for (int y = 0; y < height; ++y)
  {
    for (int x = 0; x < width; ++x, ++pixel)
    {
      float& tile = least[TileOf(x, y, width)];
      tile = std::min(tile, colors[4 * pixel + 3]);
    }
  }
  return least;
}

std::vector<float> OpacityInFront(
  const std::vector<float>& ofAll, std::size_t tiles, const std::vector<int>& order, int block)
{
  std::vector<float> left(tiles, 1.0f);
  const auto here = std::find(order.begin(), order.end(), block);
  for (auto at = order.begin(); here != order.end() && at != here; ++at)
  {
    const float* theirs = &ofAll[static_cast<std::size_t>(*at) * tiles];
    for (std::size_t i = 0; i < tiles; ++i)
    {
      left[i] *= 1 - theirs[i];
    }
  }
  for (float& value : left)
  {
    value = 1 - value;
  }
  return left;
}

std::vector<std::uint8_t> HiddenPixels(const std::vector<float>& suspected,
  const std::vector<float>& confirmed, float share, int width, int height)
{
  const std::size_t tiles = TileCount(width, height);
  if (suspected.size() != tiles || (!confirmed.empty() && confirmed.size() != tiles))
  {
    return {};
  }
  std::vector<std::uint8_t> hiddenTiles(tiles);
  bool any = false;
  for (std::size_t i = 0; i < tiles; ++i)
  {
    const bool hidden =
      1 - suspected[i] <= share && (confirmed.empty() || 1 - confirmed[i] <= share);
    hiddenTiles[i] = hidden ? 1 : 0;
    any = any || hidden;
  }
  if (!any)
  {
    return {};
  }
  std::vector<std::uint8_t> pixels;
  pixels.reserve(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  for (int y = 0; y < height; ++y)
  {
    for (int x = 0; x < width; ++x)
    {
      pixels.push_back(hiddenTiles[TileOf(x, y, width)]);
    }
  }
  return pixels;
}

int GatheredChannels(BlendKind blend, int components)
{
  return components > 1 && blend == BlendKind::Average ? 2 * StateChannels : StateChannels;
}

void JoinRays(BlendKind blend, int components, const float* more, float* ray, bool dependent)
{
  if (dependent)
  {
    const auto last = static_cast<std::size_t>(components - 1);
    if (more[last] > ray[last])
    {
      std::copy_n(more, StateChannels, ray);
    }
    return;
  }
  if (components == 1)
  {
    if (IsExtreme(blend))
    {
      // Signed so that the larger one is the one that is looked for.
      if (more[1] != 0 && (ray[1] == 0 || more[0] > ray[0]))
      {
        std::copy_n(more, StateChannels, ray);
      }
      return;
    }
    if (more[1] != 0)
    {
      const bool had = ray[1] != 0;
      ray[0] = had ? ray[0] + more[0] : more[0];
      ray[2] = had ? ray[2] + more[2] : more[2];
      ray[1] = 1;
      ray[3] = 0;
    }
    return;
  }
  for (int c = 0; c < StateChannels; ++c)
  {
    const bool both = ray[c] > MarchParameters::NothingMet && more[c] > MarchParameters::NothingMet;
    ray[c] = both && !IsExtreme(blend) ? ray[c] + more[c] : std::max(ray[c], more[c]);
  }
  for (int c = StateChannels; c < GatheredChannels(blend, components); ++c)
  {
    ray[c] += more[c];
  }
}

} // namespace teravox
