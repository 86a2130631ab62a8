// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "SingleFormats.h"

#include "FormatText.h"
#include "PlainFormat.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace teravox
{

namespace
{
using namespace formats;

constexpr std::size_t LongestAxis = std::size_t{ 1 } << 24;

std::string Child(const std::string& group, const std::string& name)
{
  return group == "/" ? "/" + name : group + "/" + name;
}

/// First position and step of an axis that has the positions of all its voxels. Nothing if it
/// isn't there, runs backwards or has steps that differ by more than a hundredth.
struct Axis
{
  double First = 0;
  double Step = 1;
};

std::optional<Axis> ReadAxis(const HDF5File& file, const std::string& path, std::int64_t size)
{
  const auto positions = file.DatasetNumbers(path, LongestAxis);
  if (!positions || positions->size() != static_cast<std::size_t>(size) || size < 2)
  {
    return std::nullopt;
  }
  const double step =
    (positions->back() - positions->front()) / static_cast<double>(positions->size() - 1);
  if (!std::isfinite(step) || !(step > 0) || !std::isfinite(positions->front()))
  {
    return std::nullopt;
  }
  for (std::size_t i = 1; i < positions->size(); ++i)
  {
    if (!(std::abs((*positions)[i] - (*positions)[i - 1] - step) <= 0.01 * step))
    {
      return std::nullopt;
    }
  }
  return Axis{ positions->front(), step };
}

// --- EMD

std::optional<std::string> FindEmd(const HDF5File& file)
{
  for (const std::string& top : file.Children("/", 256))
  {
    for (const std::string& name : file.Children("/" + top, 256))
    {
      const std::string group = "/" + top + "/" + name;
      const auto type = file.Integers(group, "emd_group_type");
      if (type && !type->empty() && (*type)[0] == 1 && file.DatasetShape(group + "/data"))
      {
        return group;
      }
    }
  }
  return std::nullopt;
}

std::optional<std::string> RecogniseEmd(const HDF5File& file, const std::string& path)
{
  const auto group = path.empty() ? FindEmd(file) : std::nullopt;
  return group
    ? std::optional<std::string>("the attribute emd_group_type of '" + *group + "', and its data")
    : std::nullopt;
}

Result<VolumeDescription> DescribeEmd(const HDF5File& file, const VolumeRequest& request)
{
  const std::string group = FindEmd(file).value_or("/");
  const auto shape = file.DatasetShape(group + "/data");
  Result<VolumeDescription> described = DescribeDataset(file, group + "/data", request);
  if (!described.Ok() || !shape || shape->size() != 3)
  {
    return described;
  }
  VolumeDescription& d = described.Value();
  d.Seen.clear();
  d.View = HDF5View();
  d.View.Automatic = false;
  d.View.Spatial = { 0, 1, 2 };
  d.ArrayName = file.Text(group + "/data", "name").value_or(group.substr(group.rfind('/') + 1));
  d.Channels.front().Name = d.ArrayName;
  std::string known;
  for (std::size_t a = 0; a < 3; ++a)
  {
    const std::string dim = group + "/dim" + std::to_string(a + 1);
    if (const auto axis = ReadAxis(file, dim, (*shape)[a]))
    {
      d.Spacing[a] = axis->Step;
      d.Origin[a] = axis->First;
      d.Unit = file.Text(dim, "units").value_or(d.Unit);
      known += "xyz"[a];
    }
  }
  d.Seen.push_back("dim1, dim2, dim3 are x, y, z; " +
    (known.size() == 3 ? "voxels of " + Text(d.Spacing) + " " + d.Unit + "."
                       : "positions are known along '" + known + "', elsewhere edges are 1."));
  d.Seen.push_back("One level, no pyramid.");
  return described;
}

// --- Data Exchange

const std::string ExchangeData = "/exchange/data";

std::optional<std::string> RecogniseExchange(const HDF5File& file, const std::string& path)
{
  const auto shape = path.empty() ? file.DatasetShape(ExchangeData) : std::nullopt;
  return shape && shape->size() >= 3
    ? std::optional<std::string>("the dataset '" + ExchangeData + "'")
    : std::nullopt;
}

Result<VolumeDescription> DescribeExchange(const HDF5File& file, const VolumeRequest& request)
{
  Result<VolumeDescription> described = DescribeDataset(file, ExchangeData, request);
  if (described.Ok() && file.Has("/exchange/theta"))
  {
    described.Value().Seen.push_back(
      "There are angles ('/exchange/theta'): the slices may be projections, not a volume.");
  }
  return described;
}

// --- NeXus

/// The child of a group that `default` names, else the first of that class.
std::optional<std::string> NexusChild(
  const HDF5File& file, const std::string& group, const std::string& kind)
{
  const auto name = file.Text(group, "default");
  if (name && !name->empty() && name->find('/') == std::string::npos &&
    file.IsGroup(Child(group, *name)))
  {
    return Child(group, *name);
  }
  for (const std::string& child : file.Children(group, 1024))
  {
    if (file.Text(Child(group, child), "NX_class").value_or("") == kind)
    {
      return Child(group, child);
    }
  }
  return std::nullopt;
}

std::optional<std::string> FindNexusData(const HDF5File& file)
{
  const auto entry = NexusChild(file, "/", "NXentry");
  const auto data = entry ? NexusChild(file, *entry, "NXdata") : std::nullopt;
  return data && file.Text(*data, "NX_class").value_or("") == "NXdata" ? data : std::nullopt;
}

/// The dataset to be shown: the group's attribute signal, else `data`, else the one that has
/// signal=1.
std::optional<std::string> NexusSignal(const HDF5File& file, const std::string& data)
{
  const std::string name = file.Text(data, "signal").value_or("data");
  if (name.find('/') == std::string::npos && file.DatasetShape(Child(data, name)))
  {
    return Child(data, name);
  }
  for (const std::string& child : file.Children(data, 1024))
  {
    if (file.HasAttribute(Child(data, child), "signal"))
    {
      return Child(data, child);
    }
  }
  return std::nullopt;
}

std::optional<std::string> RecogniseNexus(const HDF5File& file, const std::string& path)
{
  const auto data = path.empty() ? FindNexusData(file) : std::nullopt;
  const auto signal = data ? NexusSignal(file, *data) : std::nullopt;
  return signal ? std::optional<std::string>("the NXdata '" + *data + "' and its signal '" +
                    signal->substr(signal->rfind('/') + 1) + "'")
                : std::nullopt;
}

Result<VolumeDescription> DescribeNexus(const HDF5File& file, const VolumeRequest& request)
{
  const std::string data = FindNexusData(file).value_or("/");
  const std::string path = NexusSignal(file, data).value_or("/");
  Result<VolumeDescription> described = DescribeDataset(file, path, request);
  const auto shape = file.DatasetShape(path);
  const auto axes = file.Texts(data, "axes");
  if (!described.Ok() || !shape || !axes || axes->size() != shape->size())
  {
    return described;
  }
  VolumeDescription& d = described.Value();
  std::string known;
  for (std::size_t a = 0; a < 3; ++a)
  {
    const int axis = d.View.Spatial[a];
    const std::string name = axis < 0 ? "." : (*axes)[static_cast<std::size_t>(axis)];
    const auto positions = name == "." || name.find('/') != std::string::npos
      ? std::nullopt
      : ReadAxis(file, Child(data, name), (*shape)[static_cast<std::size_t>(axis)]);
    if (positions)
    {
      d.Spacing[a] = positions->Step;
      d.Origin[a] = positions->First;
      d.Unit = file.Text(Child(data, name), "units").value_or(d.Unit);
      known += "xyz"[a];
    }
  }
  d.Seen.push_back("Even positions are known along '" + known + "'; elsewhere edges are 1.");
  return described;
}
} // namespace

const VolumeFormat EMDFormat{ "EMD", &RecogniseEmd, &DescribeEmd };
const VolumeFormat DataExchangeFormat{ "Data Exchange", &RecogniseExchange, &DescribeExchange };
const VolumeFormat NeXusFormat{ "NeXus", &RecogniseNexus, &DescribeNexus };

} // namespace teravox
