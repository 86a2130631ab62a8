// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "VolumeVerifier.h"

#include "Downsampling.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

namespace teravox
{

namespace
{
constexpr std::size_t MostFindings = 100;

/// A box of one level as doubles, components interleaved, with the voxels around it repeated at the
/// volume's faces.
struct Box
{
  Int3 Low{};
  Int3 Size{};
  int Components = 1;
  std::vector<double> Values;

  double At(const Int3& p, int c) const
  {
    std::size_t index = 0;
    for (std::size_t a = 3; a-- > 0;)
    {
      const std::int64_t i = std::clamp<std::int64_t>(p[a] - this->Low[a], 0, this->Size[a] - 1);
      index = index * static_cast<std::size_t>(this->Size[a]) + static_cast<std::size_t>(i);
    }
    return this
      ->Values[index * static_cast<std::size_t>(this->Components) + static_cast<std::size_t>(c)];
  }
};

/// The guesses at what a level is, the first one being what it should be.
enum Guess : std::size_t
{
  Average,
  Decimated,
  Padded, // averages in which what lies outside counts as zero
  FirstShift,
  Guesses = FirstShift + 6
};

const std::array<const char*, Guesses> GuessTexts = { "",
  "it holds every n-th voxel, and not their averages",
  "its outermost voxels are averages with zeros (dark borders)",
  "it is moved by one voxel towards lower x", "it is moved by one voxel towards higher x",
  "it is moved by one voxel towards lower y", "it is moved by one voxel towards higher y",
  "it is moved by one voxel towards lower z", "it is moved by one voxel towards higher z" };

struct LevelResult
{
  std::uint64_t Voxels = 0;
  std::uint64_t Wrong = 0;
  std::uint64_t WrongAtFaces = 0; // of them, in groups that are cut off
  double Largest = 0;
  std::array<double, Guesses> Error{};
};

class Verifier
{
public:
  Verifier(
    HDF5BrickSource& source, VerifyReport& report, const std::function<bool(double)>& progress)
    : Source(source)
    , Report(report)
    , Progress(progress)
  {
  }

  Status Run()
  {
    const PyramidLayout& layout = this->Source.Info().Layout;
    const auto total = static_cast<double>(layout.TotalBricks());
    for (int level = 0; level < layout.NumberOfLevels(); ++level)
    {
      LevelResult result;
      const Int3& n = layout.Bricks(level);
      for (std::int64_t i = 0; i < n[0] * n[1] * n[2]; ++i)
      {
        if (this->Progress && !this->Progress(static_cast<double>(this->Report.Bricks) / total))
        {
          return { StatusCode::Cancelled, "Verifying was stopped." };
        }
        const Int3 index{ i % n[0], i / n[0] % n[1], i / (n[0] * n[1]) };
        this->CheckBrick(level, index, result);
      }
      this->Conclude(level, result);
    }
    return {};
  }

private:
  void Find(const std::string& text)
  {
    if (this->Report.Findings.size() < MostFindings)
    {
      this->Report.Findings.push_back(text);
    }
  }

  /// The inner voxels of a brick into a box.
  bool Copy(int level, const Int3& index, Box& box)
  {
    const auto brick = this->Source.ReadBrick(BrickKey::Of(level, index));
    if (!brick.Ok())
    {
      return false;
    }
    const PyramidLayout& layout = this->Source.Info().Layout;
    const std::int64_t edge = layout.BrickSize();
    const std::int64_t stored = layout.StoredSize();
    Int3 low{};
    Int3 high{};
    for (std::size_t a = 0; a < 3; ++a)
    {
      low[a] = std::max(index[a] * edge, box.Low[a]);
      high[a] =
        std::min({ index[a] * edge + edge, layout.Dimensions(level)[a], box.Low[a] + box.Size[a] });
    }
    DispatchScalarType(brick.Value()->Type,
      [&](auto example)
      {
        using T = decltype(example);
        const auto* from = reinterpret_cast<const T*>(brick.Value()->Voxels.data());
        for (std::int64_t z = low[2]; z < high[2]; ++z)
        {
          for (std::int64_t y = low[1]; y < high[1]; ++y)
          {
            for (std::int64_t x = low[0]; x < high[0]; ++x)
            {
              const std::int64_t at =
                ((z - index[2] * edge + BrickBorder) * stored + y - index[1] * edge + BrickBorder) *
                  stored +
                x - index[0] * edge + BrickBorder;
              const std::int64_t to =
                ((z - box.Low[2]) * box.Size[1] + y - box.Low[1]) * box.Size[0] + x - box.Low[0];
              for (int c = 0; c < box.Components; ++c)
              {
                box.Values[static_cast<std::size_t>(to * box.Components + c)] =
                  static_cast<double>(from[at * box.Components + c]);
              }
            }
          }
        }
      });
    return true;
  }

  /// Reads [low, high) cut at the level's faces.
  bool Read(int level, Int3 low, Int3 high, Box& box)
  {
    const PyramidLayout& layout = this->Source.Info().Layout;
    Int3 first{};
    Int3 last{};
    for (std::size_t a = 0; a < 3; ++a)
    {
      low[a] = std::clamp<std::int64_t>(low[a], 0, layout.Dimensions(level)[a] - 1);
      high[a] = std::clamp<std::int64_t>(high[a], low[a] + 1, layout.Dimensions(level)[a]);
      first[a] = low[a] / layout.BrickSize();
      last[a] = CeilDiv(high[a], layout.BrickSize());
      box.Size[a] = high[a] - low[a];
    }
    box.Low = low;
    box.Components = this->Source.Info().Components;
    box.Values.assign(
      static_cast<std::size_t>(box.Size[0] * box.Size[1] * box.Size[2] * box.Components), 0.0);
    bool good = true;
    for (std::int64_t z = first[2]; z < last[2]; ++z)
    {
      for (std::int64_t y = first[1]; y < last[1]; ++y)
      {
        for (std::int64_t x = first[0]; x < last[0]; ++x)
        {
          good = good && this->Copy(level, { x, y, z }, box);
        }
      }
    }
    return good;
  }

  void CheckBrick(int level, const Int3& index, LevelResult& result)
  {
    ++this->Report.Bricks;
    const BrickKey key = BrickKey::Of(level, index);
    const auto brick = this->Source.ReadBrick(key);
    if (!brick.Ok())
    {
      ++this->Report.UnreadableBricks;
      this->Find(brick.GetStatus().Message());
      return;
    }
    this->CheckRange(key, *brick.Value());
    if (level > 0)
    {
      this->CheckContent(level, index, result);
    }
  }

  void CheckRange(const BrickKey& key, const Brick& brick)
  {
    const auto ranges = this->Source.ReadRanges(key, { 1, 1, 1 });
    if (!ranges.Ok())
    {
      ++this->Report.WrongRanges;
      this->Find(ranges.GetStatus().Message());
      return;
    }
    ValueRange truth = ValueRange::Void();
    DispatchScalarType(brick.Type,
      [&](auto example)
      {
        using T = decltype(example);
        for (std::size_t at = 0; at + sizeof(T) <= brick.Voxels.size(); at += sizeof(T))
        {
          std::memcpy(&example, brick.Voxels.data() + at, sizeof(T));
          truth.Include(static_cast<double>(example));
        }
      });
    const ValueRange& said = ranges.Value().front();
    if (!said.Contains(truth))
    {
      ++this->Report.WrongRanges;
      this->Find("The range of " + key.ToString() + " is said to be " + std::to_string(said.Min) +
        " to " + std::to_string(said.Max) + ", but there are voxels from " +
        std::to_string(truth.Min) + " to " + std::to_string(truth.Max) + ".");
    }
  }

  void CheckContent(int level, const Int3& index, LevelResult& result)
  {
    const PyramidLayout& layout = this->Source.Info().Layout;
    Int3 group{};
    Int3 low{};
    Int3 high{};
    Int3 fineLow{};
    Int3 fineHigh{};
    for (std::size_t a = 0; a < 3; ++a)
    {
      group[a] = layout.Factor(level)[a] / layout.Factor(level - 1)[a];
      low[a] = index[a] * layout.BrickSize();
      high[a] = std::min(low[a] + layout.BrickSize(), this->Source.StoredSize(level)[a]);
      // One voxel more on each side, for the guesses that it was moved.
      fineLow[a] = (low[a] - 1) * group[a];
      fineHigh[a] = (high[a] + 1) * group[a];
    }
    Box coarse;
    Box fine;
    if (!this->Read(level, low, high, coarse) || !this->Read(level - 1, fineLow, fineHigh, fine))
    {
      return; // reported where the brick is looked at
    }
    Int3 p{};
    for (p[2] = low[2]; p[2] < high[2]; ++p[2])
    {
      for (p[1] = low[1]; p[1] < high[1]; ++p[1])
      {
        for (p[0] = low[0]; p[0] < high[0]; ++p[0])
        {
          for (int c = 0; c < coarse.Components; ++c)
          {
            this->CheckVoxel(level, p, c, group, coarse, fine, result);
          }
        }
      }
    }
  }

  /// What voxel p of the coarser level is made of; NaN where there is nothing.
  double Expected(int level, const Int3& p, int c, const Int3& group, const Box& fine, bool padded)
  {
    const Int3& size = this->Source.Info().Layout.Dimensions(level - 1);
    this->Values.clear();
    double sum = 0;
    double count = 0;
    for (std::int64_t i = 0; i < group[0] * group[1] * group[2]; ++i)
    {
      const Int3 q{ p[0] * group[0] + i % group[0], p[1] * group[1] + i / group[0] % group[1],
        p[2] * group[2] + i / (group[0] * group[1]) };
      const bool inside =
        q[0] >= 0 && q[1] >= 0 && q[2] >= 0 && q[0] < size[0] && q[1] < size[1] && q[2] < size[2];
      const double v = inside ? fine.At(q, c) : 0.0;
      if ((inside || padded) && v == v)
      {
        sum += v;
        count += 1;
        this->Values.push_back(v);
      }
    }
    return this->Source.Info().Labels && !padded ? downsampling::Mode(this->Values) : sum / count;
  }

  void CheckVoxel(int level, const Int3& p, int c, const Int3& group, const Box& coarse,
    const Box& fine, LevelResult& result)
  {
    const PyramidLayout& layout = this->Source.Info().Layout;
    const double has = coarse.At(p, c);
    const double wants = this->Expected(level, p, c, group, fine, false);
    const bool none = has != has && wants != wants;
    const double difference = none ? 0.0 : std::abs(has - wants);
    const double allowed = IsFloat(this->Source.Info().Type)
      ? 1e-5 * std::max(std::abs(has), std::abs(wants))
      : this->Source.Info().Labels ? 0.0
                                   : 1.0;
    ++result.Voxels;
    bool cut = false;
    for (std::size_t a = 0; a < 3; ++a)
    {
      cut = cut || (p[a] + 1) * group[a] > layout.Dimensions(level - 1)[a];
    }
    if (!(difference <= allowed))
    {
      ++result.Wrong;
      result.WrongAtFaces += cut ? 1 : 0;
      result.Largest = std::max(result.Largest, difference);
    }
    const auto add = [&](std::size_t guess, double value)
    { result.Error[guess] += std::isfinite(value - has) ? std::abs(value - has) : 0.0; };
    add(Average, wants);
    add(Decimated, fine.At({ p[0] * group[0], p[1] * group[1], p[2] * group[2] }, c));
    add(Padded, cut ? this->Expected(level, p, c, group, fine, true) : wants);
    for (std::size_t s = 0; s < 6; ++s)
    {
      Int3 q = p;
      // Moved towards lower indices: it holds what belongs to the next voxel.
      q[s / 2] += s % 2 == 0 ? 1 : -1;
      const bool there = q[s / 2] >= 0 && q[s / 2] < layout.Dimensions(level)[s / 2];
      add(FirstShift + s, there ? this->Expected(level, q, c, group, fine, false) : has);
    }
  }

  void Conclude(int level, const LevelResult& result)
  {
    if (result.Wrong == 0)
    {
      return;
    }
    std::string text = "Level " + std::to_string(level) + " of the " + this->Source.Info().Name +
      " isn't level " + std::to_string(level - 1) +
      " made coarser: " + std::to_string(result.Wrong) + " of " + std::to_string(result.Voxels) +
      " values differ, by up to " + std::to_string(result.Largest);
    const auto best = std::min_element(result.Error.begin(), result.Error.end());
    const auto guess = static_cast<std::size_t>(best - result.Error.begin());
    // A guess must explain most of it.
    if (guess != Average && *best < 0.1 * result.Error[Average])
    {
      text += std::string("; ") + GuessTexts.at(guess);
    }
    else if (result.WrongAtFaces == result.Wrong)
    {
      text += "; all of them at the outermost groups, which aren't whole";
    }
    this->Find(text + ".");
  }

  HDF5BrickSource& Source;
  VerifyReport& Report;
  const std::function<bool(double)>& Progress;
  std::vector<double> Values;
};
} // namespace

Status VerifyVolume(
  HDF5BrickSource& source, VerifyReport& report, const std::function<bool(double)>& progress)
{
  return Verifier(source, report, progress).Run();
}

} // namespace teravox
