// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "BigDataViewerXml.h"

#include "FormatText.h"

#include <cmath>
#include <cstddef>
#include <fstream>
#include <iterator>
#include <pugixml.hpp>
#include <sys/stat.h>
#include <vector>

namespace teravox
{

namespace
{
using namespace formats;
using Affine = BigDataViewerXml::Affine;

constexpr std::int64_t LargestXml = std::int64_t{ 64 } << 20;

bool IsRegular(const std::string& name, std::int64_t& size)
{
  struct stat info = {};
  const bool is = ::stat(name.c_str(), &info) == 0 && S_ISREG(info.st_mode);
  size = is ? static_cast<std::int64_t>(info.st_size) : 0;
  return is;
}

Affine Times(const Affine& a, const Affine& b)
{
  Affine c{};
  for (std::size_t r = 0; r < 3; ++r)
  {
    for (std::size_t k = 0; k < 4; ++k)
    {
      c[4 * r + k] = k == 3 ? a[4 * r + 3] : 0.0;
      for (std::size_t i = 0; i < 3; ++i)
      {
        c[4 * r + k] += a[4 * r + i] * b[4 * i + k];
      }
    }
  }
  return c;
}

std::string Joined(const std::string& folder, const std::string& name)
{
  return name.empty()      ? folder
    : name.front() == '/'  ? name
    : folder.empty()       ? name
    : folder.back() == '/' ? folder + name
                           : folder + "/" + name;
}

std::optional<Double3> Three(const char* text)
{
  const auto numbers = ParseNumbers(text, 3);
  return numbers && numbers->size() == 3
    ? std::optional<Double3>(Double3{ (*numbers)[0], (*numbers)[1], (*numbers)[2] })
    : std::nullopt;
}

Status Damaged(const std::string& fileName, const std::string& what)
{
  return { StatusCode::Corrupt, "The XML file '" + fileName + "' is damaged: " + what + "." };
}

Status ReadSetups(
  const std::string& fileName, const pugi::xml_node& sequence, BigDataViewerXml& xml)
{
  for (const pugi::xml_node& node : sequence.child("ViewSetups").children("ViewSetup"))
  {
    const auto id = ParseIndex(node.child("id").text().get(), INT32_MAX);
    if (!id)
    {
      return Damaged(fileName, "a ViewSetup has no id");
    }
    BigDataViewerXml::Setup setup;
    setup.Name = node.child("name").text().get();
    const pugi::xml_node voxel = node.child("voxelSize");
    if (voxel)
    {
      setup.VoxelSize = Three(voxel.child("size").text().get());
      setup.Unit = voxel.child("unit").text().get();
      if (!setup.VoxelSize || !IsSpacing(*setup.VoxelSize))
      {
        return Damaged(fileName,
          "the voxelSize of set-up " + std::to_string(*id) + " isn't three numbers above zero");
      }
    }
    xml.Setups[*id] = std::move(setup);
  }
  return {};
}

Status ReadRegistrations(
  const std::string& fileName, const pugi::xml_node& registrations, BigDataViewerXml& xml)
{
  for (const pugi::xml_node& node : registrations.children("ViewRegistration"))
  {
    const auto time = ParseIndex(node.attribute("timepoint").value(), INT32_MAX);
    const auto setup = ParseIndex(node.attribute("setup").value(), INT32_MAX);
    if (!time || !setup)
    {
      return Damaged(fileName, "a ViewRegistration has no time point or set-up");
    }
    Affine whole{ 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0 };
    for (const pugi::xml_node& transform : node.children("ViewTransform"))
    {
      const auto numbers = ParseNumbers(transform.child("affine").text().get(), 12);
      if (!numbers || numbers->size() != 12)
      {
        return Damaged(fileName,
          "a transform of time point " + std::to_string(*time) + ", set-up " +
            std::to_string(*setup) + " isn't an affine of 12 numbers");
      }
      Affine one{};
      std::copy(numbers->begin(), numbers->end(), one.begin());
      whole = Times(whole, one);
    }
    for (const double n : whole)
    {
      if (!std::isfinite(n))
      {
        return Damaged(fileName, "a transform isn't finite");
      }
    }
    xml.Registrations[{ *time, *setup }] = whole;
  }
  return {};
}
} // namespace

bool BigDataViewerXml::IsXml(const std::string& fileName)
{
  std::int64_t size = 0;
  if (!IsRegular(fileName, size))
  {
    return false;
  }
  std::ifstream in(fileName, std::ios::binary);
  std::string start(64, '\0');
  in.read(start.data(), static_cast<std::streamsize>(start.size()));
  start.resize(static_cast<std::size_t>(in.gcount()));
  const std::size_t first = start.find_first_not_of("\xef\xbb\xbf \t\r\n");
  return first != std::string::npos && start[first] == '<';
}

Result<BigDataViewerXml> BigDataViewerXml::Read(const std::string& fileName)
{
  std::int64_t size = 0;
  if (!IsRegular(fileName, size))
  {
    return Status(StatusCode::NotFound, "The XML file '" + fileName + "' isn't a regular file.");
  }
  if (size > LargestXml)
  {
    return Status(StatusCode::ResourceExhausted,
      "The XML file '" + fileName + "' has " + std::to_string(size) +
        " bytes; at most 64 MiB are read.");
  }
  std::ifstream in(fileName, std::ios::binary);
  const std::string text((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  if (!in.good() && !in.eof())
  {
    return Status(StatusCode::InputOutput, "The XML file '" + fileName + "' can't be read.");
  }
  pugi::xml_document document;
  const pugi::xml_parse_result parsed = document.load_buffer(text.data(), text.size());
  if (!parsed)
  {
    return Damaged(fileName,
      std::string("at byte ") + std::to_string(parsed.offset) + ", " + parsed.description());
  }
  const pugi::xml_node root = document.child("SpimData");
  const pugi::xml_node sequence = root.child("SequenceDescription");
  const pugi::xml_node loader = sequence.child("ImageLoader");
  if (!loader)
  {
    return Status(StatusCode::Unsupported,
      "The XML file '" + fileName +
        "' isn't one of BigDataViewer: it has no SpimData with an ImageLoader.");
  }
  const std::string format = loader.attribute("format").value();
  const std::string name = loader.child("hdf5").text().get();
  if (format != "bdv.hdf5" || name.empty())
  {
    return Status(StatusCode::Unsupported,
      "The images of the XML file '" + fileName + "' are of the format '" + format +
        "'; only bdv.hdf5 is read.");
  }
  BigDataViewerXml xml;
  const std::size_t slash = fileName.rfind('/');
  const std::string folder = slash == std::string::npos ? "" : fileName.substr(0, slash + 1);
  xml.HDF5File = Joined(Joined(folder, root.child("BasePath").text().get()), name);
  Status status = ReadSetups(fileName, sequence, xml);
  if (status.Ok())
  {
    status = ReadRegistrations(fileName, root.child("ViewRegistrations"), xml);
  }
  if (!status.Ok())
  {
    return status;
  }
  return xml;
}

} // namespace teravox
