// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "VolumeDescription.h"

#include "BigDataViewerFormat.h"
#include "BigDataViewerXml.h"
#include "HDF5File.h"
#include "ImarisFormat.h"
#include "MINCFormat.h"
#include "N5Format.h"
#include "NGFFFormat.h"
#include "PlainFormat.h"
#include "PyramidFileFormat.h"
#include "Sidecar.h"
#include "SingleFormats.h"
#include "VTKHDFFormat.h"

#include <utility>

namespace teravox
{

namespace
{
const VolumeFormat* const AllFormats[] = { &PlainFormat, &PyramidFileFormat, &ImarisFormat,
  &BigDataViewerFormat, &VTKHDFFormat, &NGFFFormat, &N5Format, &EMDFormat, &DataExchangeFormat,
  &NeXusFormat, &MINCFormat };

std::string Quoted(const std::vector<std::string>& names)
{
  std::string text;
  for (const std::string& name : names)
  {
    text += (text.empty() ? "'" : ", '") + name + "'";
  }
  return text;
}
} // namespace

Result<VolumeDescription> DescribeVolume(const HDF5File& file, const VolumeRequest& request)
{
  for (const VolumeFormat* format : AllFormats)
  {
    const std::optional<std::string> why = format->Recognise(file, request.Path);
    if (!why)
    {
      continue;
    }
    Result<VolumeDescription> description = format->Describe(file, request);
    if (description.Ok())
    {
      VolumeDescription& d = description.Value();
      d.Format = format->Name;
      d.Seen.insert(d.Seen.begin(), "Taken as " + d.Format + ": " + *why + ".");
    }
    return description;
  }
  constexpr std::size_t most = 8;
  const std::vector<std::string> volumes = ListVolumes(file, most);
  if (volumes.size() == 1 && request.Path.empty())
  {
    Result<VolumeDescription> description = DescribeDataset(file, volumes.front(), request);
    if (description.Ok())
    {
      VolumeDescription& d = description.Value();
      d.Format = PlainFormat.Name;
      d.Seen.insert(d.Seen.begin(), "Taken as dataset: it is the only one with three axes.");
    }
    return description;
  }
  return Status(StatusCode::NotFound,
    "The HDF5 file '" + file.Name() + "' has no volume of a known layout" +
      (request.Path.empty() ? std::string() : " in the group '" + request.Path + "'") + ". " +
      (volumes.empty() ? "No dataset in it has three axes."
                       : "Datasets that can be named: " + Quoted(volumes) +
            (volumes.size() == most ? " and perhaps more." : ".")));
}

Result<OpenedVolume> OpenVolumeFile(const std::string& fileName, const VolumeRequest& request)
{
  VolumeRequest wish = request;
  std::string name = fileName;
  if (BigDataViewerXml::IsXml(fileName))
  {
    Result<BigDataViewerXml> xml = BigDataViewerXml::Read(fileName);
    if (!xml.Ok())
    {
      return xml.GetStatus();
    }
    name = xml.Value().HDF5File;
    wish.Companion = fileName;
  }
  Result<std::shared_ptr<HDF5File>> file = HDF5File::Open(name);
  if (!file.Ok())
  {
    return file.GetStatus();
  }
  Result<VolumeDescription> description = DescribeVolume(*file.Value(), wish);
  if (!description.Ok())
  {
    return description.GetStatus();
  }
  VolumeDescription& d = description.Value();
  if (d.Levels.size() == 1 && request.UseSidecar)
  {
    std::string note;
    std::optional<OpenedVolume> beside = sidecar::Find(name, request, note);
    if (beside)
    {
      VolumeDescription& levels = beside->Description;
      levels.Seen.insert(levels.Seen.begin(), d.Seen.begin(), d.Seen.end());
      levels.Seen.push_back(
        "The levels are those of the sidecar '" + sidecar::NameFor(name) + "'.");
      levels.Format = d.Format;
      levels.Channels = d.Channels;
      levels.Times = d.Times;
      levels.Unit = d.Unit;
      return std::move(*beside);
    }
    if (!note.empty())
    {
      d.Seen.push_back(note);
    }
  }
  return OpenedVolume{ std::move(file.Value()), std::move(d) };
}

} // namespace teravox
