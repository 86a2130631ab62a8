// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "Residency.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace teravox::test
{

/// A volume of which only layout and ranges exist; what a brick contains follows from its key.
struct SimulatedVolume
{
  PyramidLayout Layout;
  unsigned EmptyShare = 0;  ///< bricks per 16 whose range is below VisibleFrom
  unsigned SingleShare = 0; ///< bricks per 16 of one value
  std::set<BrickKey> Failing;
  std::set<BrickKey> FailingBlocks;
  bool KnowsRegions = true; ///< exact ranges of regions; else one that fits all bricks

  static constexpr double VisibleFrom = 100;

  bool Inside(const BrickKey& key) const
  {
    const Int3 n = this->Layout.Pages(key.Level, key.PageLevel);
    return key.X < n[0] && key.Y < n[1] && key.Z < n[2];
  }

  ValueRange BrickRange(const BrickKey& key) const
  {
    const std::uint64_t kind = BrickKeyHash()(key) / 7 % 16;
    if (kind < this->EmptyShare)
    {
      return { 1, 50 };
    }
    if (kind < this->EmptyShare + this->SingleShare)
    {
      return { 150, 150 };
    }
    return { 10, 200 };
  }

  ValueRange Range(const BrickKey& key) const
  {
    if (!this->Inside(key))
    {
      return ValueRange::Void();
    }
    if (key.PageLevel == 0)
    {
      return this->BrickRange(key);
    }
    if (!this->KnowsRegions)
    {
      return { 1, 200 };
    }
    ValueRange range = ValueRange::Void();
    for (const BrickKey& child : Children(key))
    {
      range.Include(this->Range(child));
    }
    return range;
  }

  static std::vector<BrickKey> Children(const BrickKey& key)
  {
    std::vector<BrickKey> children;
    for (std::uint32_t i = 0; i < PageTable::EntriesPerBlock; ++i)
    {
      BrickKey child = key;
      child.PageLevel = static_cast<std::uint8_t>(key.PageLevel - 1);
      child.X = key.X * PageBlockEdge + i % PageBlockEdge;
      child.Y = key.Y * PageBlockEdge + i / PageBlockEdge % PageBlockEdge;
      child.Z = key.Z * PageBlockEdge + i / PageBlockEdge / PageBlockEdge;
      children.push_back(child);
    }
    return children;
  }

  void FillDirectory(PageTable& table) const
  {
    for (int l = 0; l < this->Layout.NumberOfLevels(); ++l)
    {
      const int depth = this->Layout.PageDepth(l);
      const Int3 n = this->Layout.Pages(l, depth);
      std::vector<ValueRange> ranges;
      BrickKey key;
      key.Level = static_cast<std::uint8_t>(l);
      key.PageLevel = static_cast<std::uint8_t>(depth);
      for (key.Z = 0; key.Z < n[2]; ++key.Z)
      {
        for (key.Y = 0; key.Y < n[1]; ++key.Y)
        {
          for (key.X = 0; key.X < n[0]; ++key.X)
          {
            ranges.push_back(this->Range(key));
          }
        }
      }
      table.SetDirectoryRanges(l, ranges);
    }
  }
};

/// A camera in corner coordinates of level 0: where rays begin, and the depth of each level.
struct SimulatedCamera
{
  ViewOrder Order;
  std::vector<Double3> Origins;    ///< one per ray; for a perspective camera all are the eye
  std::vector<Double3> Directions; ///< one per ray, not normalised
  double FirstLevelDepth = 1e30;   ///< level l >= 1 begins at this times 2^(l-1)
  double End = 1e30;               ///< depth at which all rays end
};

/// The bricks of one ray, front to back, in double precision: the sequence that any residency has
/// to let the ray see.
inline std::vector<BrickKey> BricksAlong(const PyramidLayout& layout, const SimulatedCamera& camera,
  const Double3& origin, const Double3& direction)
{
  std::vector<BrickKey> bricks;
  double begin = 0;
  double end = camera.End;
  for (std::size_t a = 0; a < 3; ++a)
  {
    const double first = (0 - origin[a]) / direction[a];
    const double second = (static_cast<double>(layout.Dimensions(0)[a]) - origin[a]) / direction[a];
    begin = std::max(begin, std::min(first, second));
    end = std::min(end, std::max(first, second));
  }
  const auto levelEnd = [&](int level)
  {
    return level + 1 < layout.NumberOfLevels() ? camera.FirstLevelDepth * std::ldexp(1.0, level)
                                               : 1e30;
  };
  const auto brickAt = [&](int level, double t)
  {
    // A little further, so that a point on a face belongs to the brick that the ray enters.
    Int3 at{};
    for (std::size_t a = 0; a < 3; ++a)
    {
      const double edge = static_cast<double>(layout.BrickSize() * layout.Factor(level)[a]);
      const double p = origin[a] + t * direction[a] + (direction[a] > 0 ? 1e-9 : -1e-9);
      at[a] = std::clamp<std::int64_t>(
        static_cast<std::int64_t>(std::floor(p / edge)), 0, layout.Bricks(level)[a] - 1);
    }
    return at;
  };
  int level = 0;
  while (begin >= levelEnd(level))
  {
    ++level;
  }
  Int3 at = brickAt(level, begin);
  while (begin < end)
  {
    BrickKey key;
    key.Level = static_cast<std::uint8_t>(level);
    key.X = static_cast<std::uint32_t>(at[0]);
    key.Y = static_cast<std::uint32_t>(at[1]);
    key.Z = static_cast<std::uint32_t>(at[2]);
    bricks.push_back(key);
    Double3 exits{};
    for (std::size_t a = 0; a < 3; ++a)
    {
      const double edge = static_cast<double>(layout.BrickSize() * layout.Factor(level)[a]);
      const double face = static_cast<double>(at[a] + (direction[a] > 0 ? 1 : 0)) * edge;
      exits[a] = (face - origin[a]) / direction[a];
    }
    const double leave = std::min({ exits[0], exits[1], exits[2] });
    if (levelEnd(level) <= leave)
    {
      begin = std::max(begin, levelEnd(level));
      ++level;
      at = brickAt(level, begin);
      continue;
    }
    begin = std::max(begin, leave);
    bool outside = false;
    for (std::size_t a = 0; a < 3; ++a)
    {
      at[a] += exits[a] <= leave ? (direction[a] > 0 ? 1 : -1) : 0;
      outside = outside || at[a] < 0 || at[a] >= layout.Bricks(level)[a];
    }
    if (outside)
    {
      break;
    }
  }
  return bricks;
}

/// Carries wishes out after random delays and in random orders, within a host budget. It keeps
/// nothing: what the residency drops has to be read again.
class SimulatedLoader
{
public:
  SimulatedLoader(const SimulatedVolume& volume, std::uint64_t seed, int threads, double chance)
    : Volume(volume)
    , Random(seed)
    , Threads(static_cast<std::size_t>(threads))
    , Chance(chance)
  {
  }

  std::size_t MostItems = std::numeric_limits<std::size_t>::max(); ///< in flight and held
  std::map<BrickKey, int> Reads;

  /// `held` are the bricks and page blocks that the residency holds.
  std::vector<LoadResult> Advance(std::vector<LoadRequest> wishes, std::size_t held)
  {
    std::stable_sort(wishes.begin(), wishes.end(),
      [](const LoadRequest& a, const LoadRequest& b) { return a.Priority > b.Priority; });
    for (const LoadRequest& wish : wishes)
    {
      const bool known =
        std::find(this->InFlight.begin(), this->InFlight.end(), wish.Key) != this->InFlight.end();
      const bool room = held + this->InFlight.size() < this->MostItems;
      if (!known && room && this->InFlight.size() < this->Threads)
      {
        this->InFlight.push_back(wish.Key);
      }
    }
    std::shuffle(this->InFlight.begin(), this->InFlight.end(), this->Random);
    std::vector<LoadResult> finished;
    std::vector<BrickKey> remaining;
    for (const BrickKey& key : this->InFlight)
    {
      if (static_cast<double>(this->Random() % 1000) < 1000 * this->Chance)
      {
        finished.push_back(this->Read(key));
      }
      else
      {
        remaining.push_back(key);
      }
    }
    this->InFlight = std::move(remaining);
    return finished;
  }

private:
  LoadResult Read(const BrickKey& key)
  {
    ++this->Reads[key];
    LoadResult result;
    result.Key = key;
    if (key.PageLevel == 0)
    {
      if (this->Volume.Failing.count(key) != 0)
      {
        result.Outcome = Status(StatusCode::Corrupt, key.ToString() + " doesn't decode.");
        return result;
      }
      const auto brick = std::make_shared<Brick>();
      brick->Voxels.resize(sizeof(BrickKey)); // anything of a known size
      result.Brick = brick;
      return result;
    }
    if (this->Volume.FailingBlocks.count(key) != 0)
    {
      result.Outcome = Status(StatusCode::InputOutput, key.ToString() + " can't be read.");
      return result;
    }
    std::vector<ValueRange> ranges;
    for (const BrickKey& child : SimulatedVolume::Children(key))
    {
      ranges.push_back(this->Volume.Range(child));
    }
    result.Ranges = std::make_shared<const std::vector<ValueRange>>(std::move(ranges));
    return result;
  }

  const SimulatedVolume& Volume;
  std::mt19937_64 Random;
  std::size_t Threads;
  double Chance;
  std::vector<BrickKey> InFlight;
};

struct SimulationSettings
{
  std::uint32_t Slots = 2;
  std::uint32_t PageBlocks = 0; ///< 0: the least, one chain
  std::uint64_t Seed = 1;
  int LoaderThreads = 3;
  double FinishChance = 0.5;         ///< of each read, per step
  std::size_t MostOnHost = 1u << 30; ///< bricks and page blocks
  std::size_t MostRequests = 4096;   ///< entries of the request table; what is beyond is lost
  std::size_t LimitUploads = ~std::size_t{ 0 };
  std::uint64_t ViewError = 0; ///< modulo 3: the boxes of bricks in view are right, all, too few
  int StepsPerPass = 64;       ///< bricks that a ray may pass before its pass is long enough
  std::uint64_t MostSteps = 30000;
};

/// What happened until all rays had ended.
struct SimulationResult
{
  std::string Error;                          ///< empty if everything held
  std::vector<std::vector<BrickKey>> Visited; ///< bricks that added something, per ray
  std::vector<std::string> Plans;             ///< each step's plan, as text
  std::map<BrickKey, int> Reads;
  std::vector<LoadResult> Failures;
  std::uint64_t Steps = 0;
  std::uint64_t Passes = 0;
  std::uint64_t Uploads = 0;
  std::uint64_t Evictions = 0;
  std::uint64_t BlockEvictions = 0;
  std::uint64_t EntriesUploaded = 0;
  std::uint64_t Requests = 0;
  std::size_t MostHeld = 0; ///< bricks and page blocks without a place

  std::set<BrickKey> WorkingSet() const
  {
    std::set<BrickKey> set;
    for (const auto& ray : this->Visited)
    {
      set.insert(ray.begin(), ray.end());
    }
    return set;
  }
  std::uint64_t BrickReads() const
  {
    std::uint64_t reads = 0;
    for (const auto& read : this->Reads)
    {
      reads += read.first.PageLevel == 0 ? static_cast<std::uint64_t>(read.second) : 0;
    }
    return reads;
  }
};

/// The converging renderer without a picture: rays walk through the copy of the page table that the
/// GPU would hold, stop at the first missing brick, and go on when it has come.
class SimulatedRenderer
{
public:
  SimulatedRenderer(const SimulatedVolume& volume, const SimulatedCamera& camera,
    const SimulationSettings& settings)
    : Volume(volume)
    , Settings(settings)
    , Table(volume.Layout,
        settings.PageBlocks != 0 ? settings.PageBlocks
                                 : static_cast<std::uint32_t>(volume.Layout.PageDepth()))
    , Manager(Table, settings.Slots)
    , Loader(volume, settings.Seed, settings.LoaderThreads, settings.FinishChance)
    , Random(settings.Seed + 1)
    , Gpu(Table.Entries().size())
    , Atlas(settings.Slots)
  {
    volume.FillDirectory(this->Table);
    this->Loader.MostItems = settings.MostOnHost;
    this->Manager.SetHostLimit({ settings.MostOnHost, 1, 1 });
    this->SetCamera(camera);
  }

  /// A new picture with what is resident.
  void SetCamera(const SimulatedCamera& camera)
  {
    this->Order = camera.Order;
    this->Rays.clear();
    this->Result = {};
    for (std::size_t r = 0; r < camera.Origins.size(); ++r)
    {
      this->Rays.push_back(
        { BricksAlong(this->Volume.Layout, camera, camera.Origins[r], camera.Directions[r]) });
    }
    this->SetBricksInView();
    this->Result.Visited.resize(this->Rays.size());
  }

  const std::vector<BrickKey>& BricksOfRay(std::size_t ray) const { return this->Rays[ray].Bricks; }
  Residency& GetResidency() { return this->Manager; }
  PageTable& GetTable() { return this->Table; }

  SimulationResult Run()
  {
    Feedback feedback;
    bool ended = false;
    bool waiting = false;
    std::vector<LoadRequest> wishes;
    for (; !ended && this->Result.Error.empty(); ++this->Result.Steps)
    {
      if (this->Result.Steps == this->Settings.MostSteps)
      {
        this->Result.Error = "The rays don't come to their ends.";
        break;
      }
      std::vector<LoadResult> finished =
        this->Loader.Advance(std::move(wishes), this->Manager.HeldBytes());
      FramePlan plan =
        this->Manager.Step(feedback, std::move(finished), this->Order, this->Settings.LimitUploads);
      const bool changed = this->Carry(plan);
      wishes = std::move(plan.Requests);
      // Nothing new for the rays: the same pass again would report the same.
      if (!waiting || changed)
      {
        feedback = {};
        ended = this->Pass(feedback, waiting);
      }
    }
    this->Result.Reads = this->Loader.Reads;
    this->Result.Evictions = this->Manager.NumberOfEvictions();
    this->Result.BlockEvictions = this->Manager.NumberOfBlockEvictions();
    return std::move(this->Result);
  }

private:
  struct Ray
  {
    std::vector<BrickKey> Bricks;
    std::size_t At = 0;
  };
  enum class Found
  {
    Empty,
    Single,
    Mapped,
    Missing,
    Failed
  };

  void Complain(const std::string& error)
  {
    if (this->Result.Error.empty())
    {
      this->Result.Error = "step " + std::to_string(this->Result.Steps) + ": " + error;
    }
  }

  // The bricks that the rays meet; or, as an error, all or half of them: that may cost entries or
  // passes, but changes nothing else.
  void SetBricksInView()
  {
    const auto levels = static_cast<std::size_t>(this->Volume.Layout.NumberOfLevels());
    this->Order.InView.assign(levels, { { 0, 0, 0 }, { 0, 0, 0 } });
    for (const Ray& ray : this->Rays)
    {
      for (const BrickKey& brick : ray.Bricks)
      {
        BrickBox& box = this->Order.InView[brick.Level];
        const Int3 at{ brick.X, brick.Y, brick.Z };
        const bool first = box.High[0] == 0;
        for (std::size_t a = 0; a < 3; ++a)
        {
          box.Low[a] = first ? at[a] : std::min(box.Low[a], at[a]);
          box.High[a] = std::max(box.High[a], at[a] + 1);
        }
      }
    }
    if (this->Settings.ViewError % 3 == 1)
    {
      this->Order.InView.clear();
    }
    else if (this->Settings.ViewError % 3 == 2)
    {
      for (BrickBox& box : this->Order.InView)
      {
        box.Low[0] = (box.Low[0] + box.High[0]) / 2;
      }
    }
  }

  bool Carry(const FramePlan& plan)
  {
    std::string text;
    std::set<std::uint32_t> slots;
    for (const FramePlan::Upload& upload : plan.Uploads)
    {
      if (!slots.insert(upload.Slot).second)
      {
        this->Complain("two bricks go to slot " + std::to_string(upload.Slot));
      }
      if (!upload.Data)
      {
        this->Complain("an upload has no voxels");
      }
      this->Atlas[upload.Slot] = upload.Key;
      text += "u" + std::to_string(upload.Slot) + " " + upload.Key.ToString() + ";";
    }
    for (const FramePlan::Upload& upload : plan.Uploads)
    {
      // Whatever was mapped in this step is there for the pass that follows.
      const auto entry = this->Table.Entry(upload.Key);
      if (entry && entry->Word != PageEntry::Pack(PageEntry::Mapped, upload.Slot))
      {
        this->Complain(upload.Key.ToString() + " was evicted in the step that mapped it");
      }
      if (!this->Manager.IsResident(upload.Key))
      {
        this->Complain(upload.Key.ToString() + " isn't resident after its upload");
      }
    }
    std::set<BrickKey> requested;
    for (const LoadRequest& request : plan.Requests)
    {
      text += "r " + request.Key.ToString() + "/" + std::to_string(request.Key.PageLevel) + ";";
      if (!requested.insert(request.Key).second)
      {
        this->Complain(request.Key.ToString() + " is requested twice");
      }
      this->CheckRequest(request.Key);
    }
    for (const LoadResult& failure : plan.Failures)
    {
      text += "f " + failure.Key.ToString() + ";";
      this->Result.Failures.push_back(failure);
    }
    if (const std::string broken = this->Manager.CheckInvariants(); !broken.empty())
    {
      this->Complain(broken);
    }
    if (plan.Uploads.size() > this->Settings.LimitUploads)
    {
      this->Complain("more uploads than allowed");
    }
    if (this->Manager.HeldBytes() + plan.Requests.size() > this->Settings.MostOnHost)
    {
      this->Complain("more is held and asked for than the host may hold");
    }
    this->Result.MostHeld = std::max<std::size_t>(this->Result.MostHeld, this->Manager.HeldBytes());
    this->Result.Plans.push_back(std::move(text));
    this->Result.Uploads += plan.Uploads.size();
    this->Result.Requests += plan.Requests.size();
    return this->UploadTable() || !plan.Uploads.empty();
  }

  void CheckRequest(const BrickKey& key)
  {
    if (!this->Volume.Inside(key))
    {
      this->Complain(key.ToString() + " lies outside of the volume");
    }
    if (key.PageLevel > 0)
    {
      return;
    }
    const ValueRange range = this->Volume.BrickRange(key);
    const bool rangesKnown = this->Volume.FailingBlocks.count(PageTable::ParentBlock(key)) == 0;
    if (rangesKnown && (range.IsSingle() || range.Max < SimulatedVolume::VisibleFrom))
    {
      this->Complain(key.ToString() + " needs no voxels and is requested");
    }
  }

  bool UploadTable()
  {
    const std::vector<PageTable::Change> changes = this->Table.TakeChanges();
    for (const PageTable::Change& change : changes)
    {
      std::copy_n(this->Table.Entries().begin() + static_cast<std::ptrdiff_t>(change.First),
        change.Count, this->Gpu.begin() + static_cast<std::ptrdiff_t>(change.First));
      this->Result.EntriesUploaded += change.Count;
    }
    return !changes.empty();
  }

  // Address translation as the marcher does it, on its copy of the table.
  Found Translate(const BrickKey& brick, Feedback& feedback, std::uint32_t& slot)
  {
    const PyramidLayout& layout = this->Volume.Layout;
    const int depth = layout.PageDepth(brick.Level);
    const Int3 n = layout.Pages(brick.Level, depth);
    std::vector<BrickKey> way{ brick };
    while (way.back().PageLevel < depth)
    {
      way.push_back(PageTable::ParentBlock(way.back()));
    }
    auto at = static_cast<std::size_t>(layout.DirectoryBase(brick.Level) + way.back().X +
      n[0] * (way.back().Y + n[1] * std::int64_t{ way.back().Z }));
    for (int k = depth; k >= 0; --k)
    {
      const PageEntry entry = this->Gpu[at];
      if (entry.GetState() == PageEntry::Single)
      {
        return Found::Single;
      }
      if (entry.Low > entry.High || static_cast<double>(entry.High) < SimulatedVolume::VisibleFrom)
      {
        return Found::Empty;
      }
      if (entry.GetState() != PageEntry::Mapped)
      {
        return entry.GetState() == PageEntry::Failed ? Found::Failed : Found::Missing;
      }
      slot = entry.Slot();
      if (k == 0)
      {
        feedback.UsedSlots.push_back(slot);
        if (!this->Atlas[slot] || *this->Atlas[slot] != brick)
        {
          this->Complain("slot " + std::to_string(slot) + " doesn't hold " + brick.ToString());
        }
        return Found::Mapped;
      }
      feedback.UsedBlocks.push_back(slot);
      const BrickKey& child = way[static_cast<std::size_t>(k - 1)];
      const std::uint32_t inBlock = child.X % PageBlockEdge +
        PageBlockEdge * (child.Y % PageBlockEdge + PageBlockEdge * (child.Z % PageBlockEdge));
      at = this->Table.BlockOffset(slot) + inBlock;
    }
    return Found::Missing;
  }

  // False if the ray has to wait. `drawn` is what adds to the picture, if anything does.
  bool Resolve(
    const BrickKey& brick, Feedback& feedback, std::optional<BrickKey>& drawn, BrickKey& wanted)
  {
    std::uint32_t slot = 0;
    const Found found = this->Translate(brick, feedback, slot);
    wanted = brick;
    if (found == Found::Mapped || found == Found::Single)
    {
      drawn = brick;
    }
    if (found != Found::Failed)
    {
      return found != Found::Missing;
    }
    const PyramidLayout& layout = this->Volume.Layout;
    for (int l = brick.Level + 1; l < layout.NumberOfLevels(); ++l)
    {
      BrickKey coarse = brick;
      coarse.Level = static_cast<std::uint8_t>(l);
      const auto over = [&](std::uint32_t index, std::size_t a) {
        return static_cast<std::uint32_t>(
          index * layout.Factor(brick.Level)[a] / layout.Factor(l)[a]);
      };
      coarse.X = over(brick.X, 0);
      coarse.Y = over(brick.Y, 1);
      coarse.Z = over(brick.Z, 2);
      const Found at = this->Translate(coarse, feedback, slot);
      if (at == Found::Missing)
      {
        wanted = coarse;
        return false;
      }
      if (at != Found::Failed)
      {
        drawn = at == Found::Empty ? std::nullopt : std::optional<BrickKey>(coarse);
        return true;
      }
    }
    return true;
  }

  bool Pass(Feedback& feedback, bool& waiting)
  {
    ++this->Result.Passes;
    std::map<BrickKey, std::uint32_t> missed;
    bool ended = true;
    bool unfinished = false;
    for (std::size_t r = 0; r < this->Rays.size(); ++r)
    {
      Ray& ray = this->Rays[r];
      for (int steps = 0; ray.At < ray.Bricks.size(); ++ray.At)
      {
        if (steps++ == this->Settings.StepsPerPass)
        {
          unfinished = true;
          break;
        }
        std::optional<BrickKey> drawn;
        BrickKey wanted;
        if (!this->Resolve(ray.Bricks[ray.At], feedback, drawn, wanted))
        {
          // A full request table loses wishes; the ray waits all the same.
          if (missed.count(wanted) != 0 || missed.size() < this->Settings.MostRequests)
          {
            missed[wanted] += 255;
          }
          break;
        }
        if (drawn)
        {
          this->Result.Visited[r].push_back(*drawn);
        }
      }
      ended = ended && ray.At == ray.Bricks.size();
    }
    for (const auto& miss : missed)
    {
      feedback.Missed.push_back({ miss.first, miss.second });
    }
    // The order of the request table depends on a hash.
    std::shuffle(feedback.Missed.begin(), feedback.Missed.end(), this->Random);
    const auto unique = [](std::vector<std::uint32_t>& slots)
    {
      std::sort(slots.begin(), slots.end());
      slots.erase(std::unique(slots.begin(), slots.end()), slots.end());
    };
    unique(feedback.UsedSlots);
    unique(feedback.UsedBlocks);
    waiting = !missed.empty() && !unfinished;
    return ended;
  }

  const SimulatedVolume& Volume;
  SimulationSettings Settings;
  ViewOrder Order;
  PageTable Table;
  Residency Manager;
  SimulatedLoader Loader;
  std::mt19937_64 Random;
  std::vector<PageEntry> Gpu;
  std::vector<std::optional<BrickKey>> Atlas;
  std::vector<Ray> Rays;
  SimulationResult Result;
};

} // namespace teravox::test
