// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "OMEDescription.h"

#include "Formats/FormatText.h"
#include "HeaderText.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <optional>
#include <pugixml.hpp>

namespace teravox
{

namespace
{
using headers::Corrupt;

constexpr std::int64_t MostPlanes = 1 << 20;
constexpr std::int64_t MostSteps = 1 << 23; // through all lists of pages

/// Elements may have a prefix, "OME:Pixels".
bool IsCalled(const pugi::xml_node& node, const char* name)
{
  const char* colon = std::strchr(node.name(), ':');
  return std::strcmp(colon == nullptr ? node.name() : colon + 1, name) == 0;
}

pugi::xml_node Child(const pugi::xml_node& parent, const char* name)
{
  return parent.find_child([name](const pugi::xml_node& node) { return IsCalled(node, name); });
}

/// A whole number of at least `least`; `otherwise` if there is no such attribute.
std::optional<std::int64_t> Number(
  const pugi::xml_node& node, const char* name, std::int64_t least, std::int64_t otherwise)
{
  const pugi::xml_attribute attribute = node.attribute(name);
  const auto number = attribute ? formats::ParseIndex(attribute.value(), INT32_MAX)
                                : std::optional<std::int64_t>(otherwise);
  return number && *number >= least ? number : std::nullopt;
}

/// Metres of the units that OME knows by these names; micrometres without one.
std::optional<double> MetresOf(const std::string& unit)
{
  static const std::map<std::string, double> units{ { "", 1e-6 }, { "\xc2\xb5m", 1e-6 },
    { "\xce\xbcm", 1e-6 }, { "um", 1e-6 }, { "nm", 1e-9 }, { "pm", 1e-12 }, { "mm", 1e-3 },
    { "cm", 1e-2 }, { "m", 1.0 }, { "\xc3\x85", 1e-10 }, { "in", 0.0254 } };
  const auto found = units.find(unit);
  return found == units.end() ? std::nullopt : std::optional<double>(found->second);
}

Double3 SpacingOf(const pugi::xml_node& pixels)
{
  Double3 spacing{ 1, 1, 1 };
  std::optional<double> first;
  for (std::size_t a = 0; a < 3; ++a)
  {
    const std::string name = std::string("PhysicalSize") + "XYZ"[a];
    const auto size = formats::ParseNumbers(pixels.attribute(name.c_str()).value(), 1);
    if (!size || size->size() != 1 || !((*size)[0] > 0.0) || !std::isfinite((*size)[0]))
    {
      continue;
    }
    const auto unit = MetresOf(pixels.attribute((name + "Unit").c_str()).value());
    first = first ? first : unit;
    spacing.at(a) = (*size)[0] * (unit && first ? *unit / *first : 1.0);
  }
  return spacing;
}

/// Planes of an image in the order of its DimensionOrder.
struct Order
{
  std::array<std::int64_t, 3> Size{}; // Z, C, T
  std::array<std::size_t, 3> Axis{};  // which of them changes fastest, then, then

  std::int64_t Planes() const { return this->Size[0] * this->Size[1] * this->Size[2]; }
  std::int64_t Number(const std::array<std::int64_t, 3>& zct) const
  {
    return zct.at(this->Axis[0]) +
      this->Size.at(this->Axis[0]) *
      (zct.at(this->Axis[1]) + this->Size.at(this->Axis[1]) * zct.at(this->Axis[2]));
  }
  std::array<std::int64_t, 3> Plane(std::int64_t number) const
  {
    std::array<std::int64_t, 3> zct{};
    for (const std::size_t axis : this->Axis)
    {
      zct.at(axis) = number % this->Size.at(axis);
      number /= this->Size.at(axis);
    }
    return zct;
  }
};

Result<Order> OrderOf(const std::string& fileName, const pugi::xml_node& pixels, int samples)
{
  Order order;
  const auto z = Number(pixels, "SizeZ", 1, 1);
  const auto c = Number(pixels, "SizeC", 1, samples);
  const auto t = Number(pixels, "SizeT", 1, 1);
  const std::string text = pixels.attribute("DimensionOrder").as_string("XYZCT");
  bool good = z && c && t && text.size() == 5 && text.compare(0, 2, "XY") == 0;
  for (std::size_t i = 0; i < 3 && good; ++i)
  {
    const std::size_t axis = std::string("ZCT").find(text[2 + i]);
    good = axis != std::string::npos && text.find(text[2 + i]) == 2 + i;
    order.Axis.at(i) = good ? axis : 0;
  }
  if (good)
  {
    order.Size = { *z, *c % samples == 0 ? *c / samples : *c, *t };
    good = *z <= MostPlanes && *c <= MostPlanes && *t <= MostPlanes &&
      order.Size[0] * order.Size[1] <= MostPlanes && order.Planes() <= MostPlanes;
  }
  return good ? Result<Order>(order)
              : Result<Order>(Corrupt(fileName,
                  "has OME-XML that is damaged: its sizes or its DimensionOrder can't be"));
}

/// The pages that one list of them has for the slices that are wanted.
bool TakePages(const pugi::xml_node& list, const Order& order, std::int64_t channel,
  std::int64_t time, std::size_t file, std::int64_t& steps,
  std::vector<OMEDescription::Page>& pages)
{
  const auto page = Number(list, "IFD", 0, 0);
  const auto z = Number(list, "FirstZ", 0, 0);
  const auto c = Number(list, "FirstC", 0, 0);
  const auto t = Number(list, "FirstT", 0, 0);
  const auto count = Number(list, "PlaneCount", 0, list.attribute("IFD") ? 1 : order.Planes());
  if (!page || !z || !c || !t || !count || *z >= order.Size[0] || *c >= order.Size[1] ||
    *t >= order.Size[2])
  {
    return false;
  }
  const std::int64_t first = order.Number({ *z, *c, *t });
  const std::int64_t last = std::min(first + *count, order.Planes());
  steps += last - first + 1;
  for (std::int64_t n = first; n < last && steps <= MostSteps; ++n)
  {
    const auto plane = order.Plane(n);
    if (plane[1] == channel && plane[2] == time)
    {
      pages.at(static_cast<std::size_t>(plane[0])) = { file, *page + n - first };
    }
  }
  return steps <= MostSteps;
}

/// Names in the XML are of files beside it, whatever folder they were in once.
std::string LastPart(const std::string& path)
{
  return path.substr(path.find_last_of("/\\") + 1);
}

/// The file that a list of pages is of; empty where it doesn't say so.
std::string FileOf(const pugi::xml_node& list)
{
  return LastPart(Child(list, "UUID").attribute("FileName").value());
}

/// What the XML calls the file: its name, or another one that it had, if there are no others.
std::string OwnName(const std::string& fileName, const pugi::xml_node& pixels)
{
  std::string own = LastPart(fileName);
  std::string only;
  for (const pugi::xml_node& list : pixels.children())
  {
    const std::string file = FileOf(list);
    if (IsCalled(list, "TiffData") &&
      (file.empty() || file == own || (!only.empty() && file != only)))
    {
      return own;
    }
    only = IsCalled(list, "TiffData") ? file : only;
  }
  return only.empty() ? own : only;
}

/// Which files pages are of: number 0 is the file itself.
class FileNumbers
{
public:
  explicit FileNumbers(const std::string& own) { this->Numbers[own] = this->Numbers[""] = 0; }
  std::size_t Of(const std::string& name)
  {
    const auto [at, isNew] = this->Numbers.emplace(name, this->Names.size() + 1);
    if (isNew)
    {
      this->Names.push_back(name);
    }
    return at->second;
  }
  const std::string& Name(std::size_t number) const { return this->Names.at(number - 1); }

private:
  std::map<std::string, std::size_t> Numbers;
  std::vector<std::string> Names; // from number 1 on
};

/// Keeps the files that have pages which are wanted, and looks whether they are there.
Status TakeFiles(const std::string& fileName, const FileNumbers& numbers, OMEDescription& ome)
{
  ome.Files = { fileName };
  std::map<std::size_t, std::size_t> kept{ { 0, 0 } };
  for (std::size_t z = 0; z < ome.Pages.size(); ++z)
  {
    OMEDescription::Page& page = ome.Pages[z];
    const auto [at, isNew] = kept.emplace(page.File, ome.Files.size());
    if (isNew)
    {
      const std::string& name = numbers.Name(page.File);
      ome.Files.push_back(headers::Beside(fileName, name));
      const auto begin = headers::Begin(ome.Files.back(), 4);
      if (!begin.Ok())
      {
        std::string message = "'" + fileName + "' has slice ";
        message += std::to_string(z) + " in '";
        message += name + "': ";
        message += begin.GetStatus().Message();
        return { begin.GetStatus().Code(), message };
      }
    }
    page.File = at->second;
  }
  return {};
}

/// The XML of a file that has only the name of the one where it is.
Result<std::string> ReadCompanion(const std::string& fileName, const std::string& name)
{
  constexpr std::size_t most = std::size_t{ 256 } << 20;
  auto text = headers::Begin(name, most);
  if (!text.Ok())
  {
    return Status(text.GetStatus().Code(),
      "'" + fileName + "' is described in another file: " + text.GetStatus().Message());
  }
  return text;
}
} // namespace

bool OMEDescription::IsOME(const std::string& description)
{
  // Behind a declaration and a comment that warns of editing.
  const std::string begin = description.substr(0, 4096);
  return begin.compare(0, 1, "<") == 0 &&
    (begin.find("<OME") != std::string::npos || begin.find(":OME") != std::string::npos);
}

Result<OMEDescription> OMEDescription::Read(const std::string& fileName,
  const std::string& description, int samples, int channel, int timePoint)
{
  OMEDescription ome;
  pugi::xml_document document;
  pugi::xml_parse_result parsed = document.load_buffer(description.data(), description.size());
  if (const pugi::xml_node other = Child(Child(document, "OME"), "BinaryOnly"))
  {
    ome.Companion = headers::Beside(fileName, LastPart(other.attribute("MetadataFile").value()));
    const auto text = ReadCompanion(fileName, ome.Companion);
    if (!text.Ok())
    {
      return text.GetStatus();
    }
    parsed = document.load_buffer(text.Value().data(), text.Value().size());
  }
  const pugi::xml_node pixels = Child(Child(Child(document, "OME"), "Image"), "Pixels");
  if (!parsed || !pixels)
  {
    return Corrupt(ome.Companion.empty() ? fileName : ome.Companion,
      "has OME-XML that is damaged, or without Pixels");
  }
  const auto order = OrderOf(fileName, pixels, samples);
  if (!order.Ok())
  {
    return order.GetStatus();
  }
  ome.Channels = order.Value().Size[1];
  ome.Times = order.Value().Size[2];
  ome.Spacing = SpacingOf(pixels);
  if (channel < 0 || channel >= ome.Channels || timePoint < 0 || timePoint >= ome.Times)
  {
    return Status(StatusCode::InvalidArgument,
      "'" + fileName + "' has " + std::to_string(ome.Channels) + " channels and " +
        std::to_string(ome.Times) + " time points, counted from 0.");
  }
  ome.Pages.resize(static_cast<std::size_t>(order.Value().Size[0]));
  std::int64_t steps = 0;
  bool any = false;
  FileNumbers files(OwnName(fileName, pixels));
  for (const pugi::xml_node& list : pixels.children())
  {
    if (!IsCalled(list, "TiffData"))
    {
      continue;
    }
    any = true;
    if (!TakePages(
          list, order.Value(), channel, timePoint, files.Of(FileOf(list)), steps, ome.Pages))
    {
      return Corrupt(
        fileName, "has OME-XML that is damaged: a TiffData names planes that can't be");
    }
  }
  if (!any)
  {
    TakePages(pugi::xml_node(), order.Value(), channel, timePoint, 0, steps, ome.Pages);
  }
  const auto missing = std::find_if(
    ome.Pages.begin(), ome.Pages.end(), [](const Page& page) { return page.Number < 0; });
  if (missing != ome.Pages.end())
  {
    return Corrupt(
      fileName, "has no page for slice " + std::to_string(missing - ome.Pages.begin()));
  }
  const Status status = TakeFiles(fileName, files, ome);
  return status.Ok() ? Result<OMEDescription>(std::move(ome)) : Result<OMEDescription>(status);
}

} // namespace teravox
