// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "Blend.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <mpi.h>

namespace
{
constexpr std::size_t Channels = 4;

/// Pixels, the upper ends exclusive.
struct Rectangle
{
  int Left = 0;
  int Bottom = 0;
  int Right = 0;
  int Top = 0;

  int Floats() const
  {
    return static_cast<int>(Channels) * (this->Right - this->Left) * (this->Top - this->Bottom);
  }
};

struct Strips
{
  int Width;
  int Height;
  int Count;

  int Begin(int strip) const
  {
    return static_cast<int>(static_cast<std::int64_t>(this->Height) * strip / this->Count);
  }
  int End(int strip) const { return this->Begin(strip + 1); }
};

// What isn't transparent in the rows of a strip.
Rectangle FilledPart(const std::vector<float>& picture, int width, int bottom, int top)
{
  Rectangle filled{ width, top, 0, bottom };
  for (int y = bottom; y < top && !picture.empty(); ++y)
  {
    for (int x = 0; x < width; ++x)
    {
      const std::size_t pixel =
        static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
      if (picture[Channels * pixel + 3] > 0)
      {
        filled = { std::min(filled.Left, x), std::min(filled.Bottom, y),
          std::max(filled.Right, x + 1), std::max(filled.Top, y + 1) };
      }
    }
  }
  return filled.Left < filled.Right ? filled : Rectangle{};
}

void AppendPixels(
  const std::vector<float>& picture, int width, const Rectangle& part, std::vector<float>& to)
{
  for (int y = part.Bottom; y < part.Top; ++y)
  {
    const auto row =
      static_cast<std::ptrdiff_t>(Channels) * (static_cast<std::ptrdiff_t>(y) * width + part.Left);
    to.insert(to.end(), picture.begin() + row,
      picture.begin() + row + static_cast<std::ptrdiff_t>(Channels) * (part.Right - part.Left));
  }
}

// Puts pixels behind what a strip has so far.
void BlendBehind(
  std::vector<float>& strip, int width, int bottom, const Rectangle& part, const float* pixels)
{
  for (int y = part.Bottom; y < part.Top; ++y)
  {
    for (int x = part.Left; x < part.Right; ++x)
    {
      float* pixel = &strip[Channels *
        (static_cast<std::size_t>(y - bottom) * static_cast<std::size_t>(width) +
          static_cast<std::size_t>(x))];
      const float left = 1 - pixel[3];
      for (std::size_t c = 0; c < Channels; ++c)
      {
        pixel[c] += left * *pixels++;
      }
    }
  }
}

std::vector<int> OffsetsOf(const std::vector<int>& counts)
{
  std::vector<int> offsets(counts.size(), 0);
  for (std::size_t i = 1; i < counts.size(); ++i)
  {
    offsets[i] = offsets[i - 1] + counts[i - 1];
  }
  return offsets;
}
} // namespace

std::vector<float> BlendOnRankZero(const std::vector<float>& picture, int width, int height,
  const std::vector<int>& order, std::uint64_t& sent)
{
  int rank = 0;
  int ranks = 1;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  MPI_Comm_size(MPI_COMM_WORLD, &ranks);
  const Strips strips{ width, height, ranks };
  const auto count = static_cast<std::size_t>(ranks);

  // Which rectangles go where, then their pixels.
  std::vector<Rectangle> mine(count);
  std::vector<Rectangle> theirs(count);
  std::vector<int> sendCounts(count);
  std::vector<float> out;
  for (int r = 0; r < ranks; ++r)
  {
    const auto i = static_cast<std::size_t>(r);
    mine[i] = FilledPart(picture, width, strips.Begin(r), strips.End(r));
    sendCounts[i] = mine[i].Floats();
    AppendPixels(picture, width, mine[i], out);
  }
  sent = sizeof(float) *
    (out.size() - static_cast<std::size_t>(sendCounts[static_cast<std::size_t>(rank)]));
  MPI_Alltoall(mine.data(), 4, MPI_INT, theirs.data(), 4, MPI_INT, MPI_COMM_WORLD);
  std::vector<int> receiveCounts(count);
  std::transform(theirs.begin(), theirs.end(), receiveCounts.begin(),
    [](const Rectangle& part) { return part.Floats(); });
  const std::vector<int> sendOffsets = OffsetsOf(sendCounts);
  const std::vector<int> receiveOffsets = OffsetsOf(receiveCounts);
  std::vector<float> in(static_cast<std::size_t>(receiveOffsets.back() + receiveCounts.back()));
  MPI_Alltoallv(out.data(), sendCounts.data(), sendOffsets.data(), MPI_FLOAT, in.data(),
    receiveCounts.data(), receiveOffsets.data(), MPI_FLOAT, MPI_COMM_WORLD);

  const auto rowFloats = Channels * static_cast<std::size_t>(width);
  std::vector<float> strip(
    rowFloats * static_cast<std::size_t>(strips.End(rank) - strips.Begin(rank)), 0.0f);
  for (const int from : order)
  {
    const auto i = static_cast<std::size_t>(from);
    BlendBehind(strip, width, strips.Begin(rank), theirs[i], in.data() + receiveOffsets[i]);
  }

  std::vector<int> stripCounts(count);
  for (int r = 0; r < ranks; ++r)
  {
    stripCounts[static_cast<std::size_t>(r)] =
      static_cast<int>(rowFloats) * (strips.End(r) - strips.Begin(r));
  }
  const std::vector<int> stripOffsets = OffsetsOf(stripCounts);
  std::vector<float> whole(rank == 0 ? rowFloats * static_cast<std::size_t>(height) : 0);
  MPI_Gatherv(strip.data(), static_cast<int>(strip.size()), MPI_FLOAT, whole.data(),
    stripCounts.data(), stripOffsets.data(), MPI_FLOAT, 0, MPI_COMM_WORLD);
  sent += rank == 0 ? 0 : sizeof(float) * strip.size();
  return whole;
}
