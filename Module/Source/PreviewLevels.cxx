// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "PreviewLevels.h"

#include "Downsampling.h"
#include "HDF5Dataset.h"
#include "PyramidLayout.h"
#include "ScratchBytes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <type_traits>

namespace teravox::previews
{

namespace
{
constexpr double MostBytesPerBrick = 2147483648.0;
// A level may cost so many times what level 0 does: chunks that bricks share are read again.
constexpr double MostOfLevelZero = 2;
// Without chunks: slices and rows one by one from this factor on, since most are left out, and as
// long as a box may be.
constexpr std::int64_t SingleFromFactor = 16;
constexpr std::int64_t BoxEdge = 64;
constexpr std::int64_t LongestRow = 1 << 16;

/// A voxel of level 0 along one axis, and the voxel of the brick that it belongs to.
struct Sample
{
  std::int64_t Target = 0;
  std::int64_t Position = 0; // in its chunk
};

/// Samples along one axis that lie in one chunk.
struct Group
{
  std::int64_t Chunk = 0;
  std::vector<Sample> Samples;
};

std::vector<Group> GroupsAlong(const Request& r, std::size_t axis)
{
  const std::int64_t factor = r.Factor[axis];
  const std::int64_t voxels = CeilDiv(r.Dimensions[axis], factor);
  const std::int64_t edge = r.Dataset->ChunkSize()[axis];
  const std::int64_t first = r.Labels ? factor / 2 : (factor - 1) / 2;
  std::vector<Group> groups;
  for (std::int64_t i = 0; i < r.Stored; ++i)
  {
    const std::int64_t voxel = std::clamp<std::int64_t>(r.Start[axis] + i, 0, voxels - 1);
    // In the middle lies one voxel or two; one is counted twice.
    for (const std::int64_t offset : { first, factor / 2 })
    {
      const std::int64_t at = std::min(voxel * factor + offset, r.Dimensions[axis] - 1);
      if (groups.empty() || groups.back().Chunk != at / edge)
      {
        groups.push_back({ at / edge, {} });
      }
      groups.back().Samples.push_back({ i, at % edge });
      if (r.Labels)
      {
        break;
      }
    }
  }
  return groups;
}

/// Sums of a brick. Integers add up exactly; floats are added as eighths, which don't overflow, and
/// count those that aren't NaN.
template <typename T>
class Sums
{
public:
  using Number = downsampling::Sum<T>;

  Sums(std::size_t scalars, ScratchBytes& numbers, ScratchBytes& counts)
    : Scalars(scalars)
  {
    numbers.Bytes().assign(scalars * sizeof(Number), std::byte{ 0 });
    this->Numbers = reinterpret_cast<Number*>(numbers.Bytes().data());
    if (std::is_floating_point_v<T>)
    {
      counts.Bytes().assign(scalars, std::byte{ 0 });
      this->Counts = reinterpret_cast<std::uint8_t*>(counts.Bytes().data());
    }
  }

  void Add(std::size_t at, T value)
  {
    if constexpr (std::is_floating_point_v<T>)
    {
      if (!std::isnan(value))
      {
        this->Numbers[at] += 0.125 * static_cast<double>(value);
        ++this->Counts[at];
      }
    }
    else
    {
      this->Numbers[at] += static_cast<Number>(value);
    }
  }

  /// `samples`: of each voxel.
  void Finish(std::int64_t samples, std::byte* out) const
  {
    for (std::size_t i = 0; i < this->Scalars; ++i)
    {
      T value{};
      if constexpr (std::is_floating_point_v<T>)
      {
        value = this->Counts[i] == 0 ? std::numeric_limits<T>::quiet_NaN()
                                     : static_cast<T>(this->Numbers[i] * (8.0 / this->Counts[i]));
      }
      else
      {
        value = static_cast<T>(downsampling::DivideRounded(this->Numbers[i], samples));
      }
      std::memcpy(out + i * sizeof(T), &value, sizeof(T));
    }
  }

private:
  std::size_t Scalars;
  Number* Numbers = nullptr;
  std::uint8_t* Counts = nullptr;
};

/// What a chunk has for the sums; one without voxels is the fill value.
template <typename T>
void AddChunk(
  const Request& r, const Chunk& chunk, const std::array<const Group*, 3>& groups, Sums<T>& sums)
{
  const Int3& size = r.Dataset->ChunkSize();
  const auto components = static_cast<std::size_t>(r.Dataset->Components());
  const bool filled = chunk.Voxels.empty();
  const std::byte* from = filled ? r.Dataset->Fill().data() : chunk.Voxels.data();
  for (const Sample& z : groups[2]->Samples)
  {
    for (const Sample& y : groups[1]->Samples)
    {
      const std::int64_t row = (z.Position * size[1] + y.Position) * size[0];
      const std::int64_t target = (z.Target * r.Stored + y.Target) * r.Stored;
      for (const Sample& x : groups[0]->Samples)
      {
        const std::size_t voxel = filled ? 0 : static_cast<std::size_t>(row + x.Position);
        const std::size_t at = static_cast<std::size_t>(target + x.Target) * components;
        for (std::size_t c = 0; c < components; ++c)
        {
          T value{};
          std::memcpy(&value, from + (voxel * components + c) * sizeof(T), sizeof(T));
          sums.Add(at + c, value);
        }
      }
    }
  }
}

template <typename T>
Status Gather(const Request& r, const std::function<Result<ChunkPointer>(const Int3& chunk)>& read,
  std::byte* voxels)
{
  const std::array<std::vector<Group>, 3> along{ GroupsAlong(r, 0), GroupsAlong(r, 1),
    GroupsAlong(r, 2) };
  thread_local ScratchBytes keptNumbers;
  thread_local ScratchBytes keptCounts;
  const auto scalars = static_cast<std::size_t>(r.Stored * r.Stored * r.Stored) *
    static_cast<std::size_t>(r.Dataset->Components());
  Sums<T> sums(scalars, keptNumbers, keptCounts);
  for (const Group& z : along[2])
  {
    for (const Group& y : along[1])
    {
      for (const Group& x : along[0])
      {
        const Result<ChunkPointer> chunk = read({ x.Chunk, y.Chunk, z.Chunk });
        if (!chunk.Ok())
        {
          return chunk.GetStatus();
        }
        AddChunk<T>(r, *chunk.Value(), { &x, &y, &z }, sums);
      }
    }
  }
  sums.Finish(r.Labels ? 1 : 8, voxels);
  keptNumbers.Trim();
  keptCounts.Trim();
  return {};
}
Int3 BoxFor(const Int3& factor, const Int3& dimensions)
{
  Int3 box{};
  for (const std::size_t a : { std::size_t{ 1 }, std::size_t{ 2 } })
  {
    box[a] = std::min(factor[a] >= SingleFromFactor ? 1 : BoxEdge, dimensions[a]);
  }
  box[0] = std::min(std::max(BoxEdge, LongestRow / (box[1] * box[2])), dimensions[0]);
  return box;
}
} // namespace

std::vector<Level> Plan(const Int3& dimensions, const Double3& spacing, int brickSize,
  const Int3& chunk, std::size_t voxelBytes)
{
  std::vector<Level> levels;
  for (const Int3& factor : PyramidLayout::DefaultFactors(dimensions, spacing, brickSize))
  {
    Level level;
    level.Factor = factor;
    level.Box = chunk[0] == 0 ? BoxFor(factor, dimensions) : chunk;
    double whole = static_cast<double>(voxelBytes); // of level 0, in whole boxes
    double brick = whole;
    double all = whole;
    for (std::size_t a = 0; a < 3; ++a)
    {
      // Boxes along the axis: of level 0, and those in which the samples of a brick lie.
      const std::int64_t edge = level.Box[a];
      const std::int64_t covers = brickSize * factor[a];
      const auto boxes = [&](std::int64_t voxels) {
        return static_cast<double>(std::min(CeilDiv(voxels, edge), 2 * CeilDiv(voxels, factor[a])));
      };
      const double of = boxes(std::min(covers, dimensions[a]));
      const std::int64_t bricks = dimensions[a] / covers;
      const double sum = static_cast<double>(bricks) * of + boxes(dimensions[a] % covers);
      whole *= static_cast<double>(CeilDiv(dimensions[a], edge) * edge);
      brick *= of * static_cast<double>(edge);
      all *= sum * static_cast<double>(edge);
    }
    if (factor != Int3{ 1, 1, 1 } && brick < MostBytesPerBrick && all <= MostOfLevelZero * whole)
    {
      levels.push_back(level);
    }
  }
  return levels;
}

Status GatherBrick(const Request& request,
  const std::function<Result<ChunkPointer>(const Int3& chunk)>& read, std::byte* voxels)
{
  Status status;
  DispatchScalarType(request.Dataset->Type(),
    [&](auto example) { status = Gather<decltype(example)>(request, read, voxels); });
  return status;
}

} // namespace teravox::previews
