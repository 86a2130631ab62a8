// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "Sidecar.h"

#include "HDF5File.h"
#include "HDF5Lock.h"
#include "PyramidFormat.h"

#include <array>
#include <cstdint>
#include <sys/stat.h>
#include <utility>

namespace teravox::sidecar
{

namespace
{
constexpr std::int64_t NanosecondsPerSecond = 1000000000;

/// What tells one version and one volume of a file from another.
struct Identity
{
  std::int64_t Size = 0;
  std::int64_t Time = 0;
  std::string Path;
  std::int64_t Channel = 0;
  std::int64_t TimePoint = 0;

  static std::optional<Identity> Of(const std::string& fileName, const VolumeRequest& request)
  {
    struct stat info = {};
    if (::stat(fileName.c_str(), &info) != 0)
    {
      return std::nullopt;
    }
    Identity identity;
    identity.Size = static_cast<std::int64_t>(info.st_size);
    identity.Time = static_cast<std::int64_t>(info.st_mtim.tv_sec) * NanosecondsPerSecond +
      static_cast<std::int64_t>(info.st_mtim.tv_nsec);
    const std::size_t first = request.Path.find_first_not_of('/');
    identity.Path = first == std::string::npos ? std::string() : request.Path.substr(first);
    identity.Channel = request.Channel;
    identity.TimePoint = request.TimePoint;
    return identity;
  }
};

// Requires: HDF5Lock held.
bool WriteNumber(hid_t group, const char* name, std::int64_t value)
{
  const HDF5Handle space(H5Screate(H5S_SCALAR));
  const HDF5Handle attribute(
    H5Acreate2(group, name, H5T_STD_I64LE, space.Get(), H5P_DEFAULT, H5P_DEFAULT));
  return attribute.Valid() && H5Awrite(attribute.Get(), H5T_NATIVE_INT64, &value) >= 0;
}

// Requires: HDF5Lock held.
bool WriteText(hid_t group, const char* name, const std::string& text)
{
  const HDF5Handle space(H5Screate(H5S_SCALAR));
  const HDF5Handle type(H5Tcopy(H5T_C_S1));
  H5Tset_size(type.Get(), text.size() + 1);
  const HDF5Handle attribute(
    H5Acreate2(group, name, type.Get(), space.Get(), H5P_DEFAULT, H5P_DEFAULT));
  return attribute.Valid() && H5Awrite(attribute.Get(), type.Get(), text.c_str()) >= 0;
}
} // namespace

std::string NameFor(const std::string& fileName)
{
  return fileName + ".teravox.h5";
}

Status Mark(
  const std::string& pyramidName, const std::string& fileName, const VolumeRequest& request)
{
  const auto identity = Identity::Of(fileName, request);
  if (!identity)
  {
    return { StatusCode::NotFound, "The file '" + fileName + "' isn't there any more." };
  }
  const HDF5Lock lock;
  HDF5Handle file(H5Fopen(pyramidName.c_str(), H5F_ACC_RDWR, H5P_DEFAULT));
  HDF5Handle group(file.Valid() ? H5Gopen2(file.Get(), PyramidFormat::PyramidGroup, H5P_DEFAULT)
                                : H5I_INVALID_HID);
  const bool written = group.Valid() && WriteNumber(group.Get(), "SourceSize", identity->Size) &&
    WriteNumber(group.Get(), "SourceTime", identity->Time) &&
    WriteText(group.Get(), "SourcePath", identity->Path) &&
    WriteNumber(group.Get(), "SourceChannel", identity->Channel) &&
    WriteNumber(group.Get(), "SourceTimePoint", identity->TimePoint);
  const bool closed = group.Reset() && file.Reset();
  if (!written || !closed)
  {
    return { StatusCode::InputOutput,
      "The file '" + pyramidName + "' can't be written: " + lock.TakeError() + "." };
  }
  return {};
}

std::optional<OpenedVolume> Find(
  const std::string& fileName, const VolumeRequest& request, std::string& note)
{
  const std::string name = NameFor(fileName);
  struct stat info = {};
  if (::stat(name.c_str(), &info) != 0 || !S_ISREG(info.st_mode))
  {
    return std::nullopt;
  }
  const auto identity = Identity::Of(fileName, request);
  Result<std::shared_ptr<HDF5File>> file = HDF5File::Open(name);
  if (!file.Ok() || !identity)
  {
    note = "The sidecar '" + name + "' can't be opened.";
    return std::nullopt;
  }
  const std::string group = PyramidFormat::PyramidGroup;
  const auto is = [&](const char* attribute, std::int64_t value)
  {
    const auto numbers = file.Value()->Integers(group, attribute);
    return numbers && numbers->size() == 1 && (*numbers)[0] == value;
  };
  if (!is("SourceSize", identity->Size) || !is("SourceTime", identity->Time))
  {
    note = "The sidecar '" + name + "' is of another version of this file, and isn't used.";
    return std::nullopt;
  }
  if (!is("SourceChannel", identity->Channel) || !is("SourceTimePoint", identity->TimePoint) ||
    file.Value()->Text(group, "SourcePath") != identity->Path)
  {
    note = "The sidecar '" + name + "' is of another volume of this file.";
    return std::nullopt;
  }
  Result<VolumeDescription> description = DescribeVolume(*file.Value(), VolumeRequest());
  if (!description.Ok())
  {
    note = "The sidecar isn't used. " + description.GetStatus().Message();
    return std::nullopt;
  }
  return OpenedVolume{ std::move(file.Value()), std::move(description.Value()) };
}

} // namespace teravox::sidecar
