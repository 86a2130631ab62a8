// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "HDF5Levels.h"

#include "PreviewLevels.h"

#include <algorithm>
#include <utility>

namespace teravox
{

namespace
{
std::string Text(const Int3& v)
{
  return std::to_string(v[0]) + " x " + std::to_string(v[1]) + " x " + std::to_string(v[2]);
}
} // namespace

Status HDF5Levels::Open(
  std::shared_ptr<HDF5File> file, VolumeDescription& d, int brickSize, std::uint64_t previewsFrom)
{
  this->File = std::move(file);
  if (d.Levels.empty() || d.Levels.front().Paths.empty())
  {
    return { StatusCode::Corrupt,
      "The file '" + this->File->Name() + "' is damaged: it has no levels." };
  }
  Status status = this->OpenLevels(d);
  if (status.Ok())
  {
    status = this->AddPreviews(d, brickSize, previewsFrom);
  }
  return status.Ok() ? this->MakeLayout(d, brickSize) : status;
}

Status HDF5Levels::OpenLevel(const VolumeDescription& d, const LevelDescription& level)
{
  std::vector<std::shared_ptr<HDF5Dataset>> parts;
  Int3 size = level.Size;
  for (const std::string& path : level.Paths)
  {
    Result<std::shared_ptr<HDF5Dataset>> opened = HDF5Dataset::Open(this->File, path, d.View);
    if (!opened.Ok())
    {
      return opened.GetStatus();
    }
    parts.push_back(std::move(opened.Value()));
    const HDF5Dataset& part = *parts.back();
    const HDF5Dataset& first = this->Datasets.empty() ? *parts.front() : *this->Datasets[0][0];
    if (part.Type() != first.Type() || part.Components() != first.Components())
    {
      return { StatusCode::Corrupt,
        "The " + part.Name() + " has another type or number of components than " +
          (this->Datasets.empty() ? "the other channels." : "level 0.") };
    }
    const auto components = static_cast<std::size_t>(part.Components()) * level.Paths.size();
    if (components > 4)
    {
      return { StatusCode::Unsupported,
        "The " + part.Name() + " has " + std::to_string(components) +
          " components; at most 4 are possible." };
    }
    if (size[0] == 0)
    {
      size = part.Dimensions();
    }
    for (std::size_t a = 0; a < 3 && !d.Boxes; ++a)
    {
      if (part.Dimensions()[a] < size[a])
      {
        return { StatusCode::Corrupt,
          "The " + part.Name() + " has " + Text(part.Dimensions()) +
            " voxels, fewer than what is said of it, " + Text(size) + "." };
      }
    }
  }
  this->Datasets.push_back(std::move(parts));
  this->Sizes.push_back(size);
  return {};
}

Status HDF5Levels::DropLevel(VolumeDescription& d, std::size_t level, const std::string& reason)
{
  const std::string text = "Level " + std::to_string(level) + " of the " +
    this->Datasets.back().front()->Name() + " " + reason;
  if (d.ExactLevels)
  {
    return { StatusCode::Corrupt, text + "." };
  }
  d.Seen.push_back(text + ": it is left out.");
  this->Datasets.pop_back();
  this->Sizes.pop_back();
  return {};
}

// Levels that don't fit are left out or an error, depending on the format.
Status HDF5Levels::OpenLevels(VolumeDescription& d)
{
  std::vector<LevelDescription> fitting;
  for (std::size_t l = 0; l < d.Levels.size(); ++l)
  {
    const LevelDescription& level = d.Levels[l];
    Status status = this->OpenLevel(d, level);
    if (!status.Ok())
    {
      return status;
    }
    std::string reason;
    for (std::size_t a = 0; a < 3 && l > 0; ++a)
    {
      const std::int64_t before = fitting.back().Factor[a];
      const std::int64_t f = level.Factor[a];
      if (f < before || f % before != 0)
      {
        reason = "is coarser by " + Text(level.Factor) +
          ", which isn't a multiple of what the level before is";
        break;
      }
      const std::int64_t asked = CeilDiv(this->Sizes[0][a], f);
      const std::int64_t has = this->Sizes.back()[a];
      if (d.ExactLevels ? has != asked : has + 1 < asked)
      {
        reason = "has " + Text(this->Sizes.back()) + " voxels, but as a level coarser by " +
          Text(level.Factor) + " it must have " + std::to_string(asked) + " along " + "xyz"[a];
        break;
      }
    }
    status = reason.empty() ? Status() : this->DropLevel(d, l, reason);
    if (!status.Ok())
    {
      return status;
    }
    if (reason.empty())
    {
      fitting.push_back(level);
    }
  }
  d.Levels = std::move(fitting);
  return {};
}

// Coarser levels for a large volume that has none.
Status HDF5Levels::AddPreviews(VolumeDescription& d, int brickSize, std::uint64_t previewsFrom)
{
  const Int3 size = this->Sizes.front(); // a copy: levels are added below
  const double voxels =
    static_cast<double>(size[0]) * static_cast<double>(size[1]) * static_cast<double>(size[2]);
  if (this->Datasets.size() > 1 || !d.StatisticsPath.empty() || d.Boxes ||
    previewsFrom == previews::Never || voxels < static_cast<double>(previewsFrom))
  {
    return {};
  }
  // A copy: OpenLevel() adds to the vector.
  const std::vector<std::shared_ptr<HDF5Dataset>> finest = this->Datasets.front();
  const HDF5Dataset& first = *finest.front();
  const HDF5View view = d.View;
  Status status;
  for (const previews::Level& preview : previews::Plan(size, d.Spacing, brickSize,
         first.HasChunks() ? first.ChunkSize() : Int3{}, first.VoxelBytes()))
  {
    LevelDescription level = d.Levels.front();
    level.Factor = preview.Factor;
    level.Preview = true;
    if (first.HasChunks())
    {
      this->Datasets.push_back(finest);
      this->Sizes.push_back(size);
    }
    else
    {
      d.View.Box = preview.Box;
      status = this->OpenLevel(d, level);
      d.View = view;
      if (!status.Ok())
      {
        return status;
      }
    }
    for (std::size_t a = 0; a < 3; ++a)
    {
      this->Sizes.back()[a] = CeilDiv(this->Sizes.back()[a], preview.Factor[a]);
    }
    d.Levels.push_back(std::move(level));
  }
  if (d.Levels.size() > 1)
  {
    d.Seen.push_back("Its " + std::to_string(d.Levels.size() - 1) +
      " coarser levels are previews, made of a few voxels of each group while they are read; "
      "'teravox convert' makes true ones in a file beside it.");
  }
  return {};
}

Status HDF5Levels::MakeLayout(VolumeDescription& d, int brickSize)
{
  std::vector<Int3> factors;
  for (const LevelDescription& level : d.Levels)
  {
    factors.push_back(level.Factor);
  }
  const std::string& name = this->Datasets.front().front()->Name();
  Result<PyramidLayout> layout =
    PyramidLayout::Make(this->Sizes.front(), brickSize, std::move(factors));
  if (!layout.Ok())
  {
    return { layout.GetStatus().Code(),
      "The " + name + " can't be used: " + layout.GetStatus().Message() };
  }
  for (std::size_t l = 0; l < this->Sizes.size(); ++l)
  {
    const Int3& asked = layout.Value().Dimensions(static_cast<int>(l));
    for (std::size_t a = 0; a < 3; ++a)
    {
      this->Sizes[l][a] = std::min(this->Sizes[l][a], asked[a]);
    }
    if (this->Sizes[l] != asked)
    {
      d.Seen.push_back("Level " + std::to_string(l) + " has " + Text(this->Sizes[l]) +
        " voxels of " + Text(asked) + " that would cover level 0: the last ones are repeated.");
    }
  }
  this->Layout_ = std::move(layout.Value());
  return {};
}

} // namespace teravox
