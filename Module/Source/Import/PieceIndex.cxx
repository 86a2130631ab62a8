// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "PieceIndex.h"

#include "Formats/FormatText.h"
#include "HeaderText.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <pugixml.hpp>
#include <sys/stat.h>

namespace teravox
{

namespace
{
using headers::Corrupt;
using Extent = PieceIndex::Extent;

constexpr std::size_t LargestIndex = std::size_t{ 64 } << 20;

/// Comparisons of boxes for one request: more would take seconds. A million pieces side by side, or
/// ten thousand that are in each other's way, need fewer.
constexpr std::int64_t MostComparisons = std::int64_t{ 1 } << 28;

/// A number of names for people.
constexpr std::size_t MostNames = 20;

std::string Text(const Extent& extent)
{
  std::string text;
  for (const int n : extent)
  {
    text += (text.empty() ? "" : " ") + std::to_string(n);
  }
  return text;
}

template <std::size_t N>
bool TakeNumbers(const pugi::xml_attribute& attribute, std::array<double, N>& numbers)
{
  if (!attribute)
  {
    return true;
  }
  const auto found = formats::ParseNumbers(attribute.value(), N);
  const bool good = found && found->size() == N &&
    std::all_of(found->begin(), found->end(), [](double v) { return std::isfinite(v); });
  if (good)
  {
    std::copy(found->begin(), found->end(), numbers.begin());
  }
  return good;
}

/// Six whole numbers, none of the axes empty.
bool TakeExtent(const pugi::xml_attribute& attribute, Extent& extent)
{
  std::array<double, 6> numbers{};
  constexpr double most = 1 << 30;
  bool good = attribute && TakeNumbers(attribute, numbers);
  for (std::size_t i = 0; i < 6 && good; ++i)
  {
    good = std::abs(numbers.at(i)) <= most && numbers.at(i) == std::floor(numbers.at(i));
    extent.at(i) = good ? static_cast<int>(numbers.at(i)) : 0;
  }
  return good && extent[0] <= extent[1] && extent[2] <= extent[3] && extent[4] <= extent[5];
}

std::optional<ScalarType> TypeOf(const std::string& name)
{
  static const std::map<std::string, ScalarType> types{ { "Int8", ScalarType::Int8 },
    { "UInt8", ScalarType::UInt8 }, { "Int16", ScalarType::Int16 },
    { "UInt16", ScalarType::UInt16 }, { "Int32", ScalarType::Int32 },
    { "UInt32", ScalarType::UInt32 }, { "Float32", ScalarType::Float32 },
    { "Float64", ScalarType::Float64 } };
  const auto found = types.find(name);
  return found == types.end() ? std::nullopt : std::optional<ScalarType>(found->second);
}

void TakeArrays(const pugi::xml_node& data, bool cells, PieceIndex& index)
{
  for (const pugi::xml_node& node : data.children("PDataArray"))
  {
    PieceIndex::Array array;
    array.Name = node.attribute("Name").value();
    array.TypeName = node.attribute("type").value();
    array.Type = TypeOf(array.TypeName);
    array.Components = node.attribute("NumberOfComponents").as_int(1);
    array.Cells = cells;
    index.Arrays.push_back(array);
  }
  (cells ? index.CellScalars : index.PointScalars) = data.attribute("Scalars").value();
}

bool Intersect(const Extent& a, const Extent& b, Extent& both)
{
  bool any = true;
  for (std::size_t i = 0; i < 6; i += 2)
  {
    both.at(i) = std::max(a.at(i), b.at(i));
    both.at(i + 1) = std::min(a.at(i + 1), b.at(i + 1));
    any = any && both.at(i) <= both.at(i + 1);
  }
  return any;
}

/// What is left of a box without a part of it: up to six boxes.
void Subtract(Extent box, const Extent& part, std::vector<Extent>& left)
{
  for (std::size_t i = 6; i >= 2; i -= 2)
  {
    if (box.at(i - 2) < part.at(i - 2))
    {
      left.push_back(box);
      left.back().at(i - 1) = part.at(i - 2) - 1;
      box.at(i - 2) = part.at(i - 2);
    }
    if (box.at(i - 1) > part.at(i - 1))
    {
      left.push_back(box);
      left.back().at(i - 2) = part.at(i - 1) + 1;
      box.at(i - 1) = part.at(i - 1);
    }
  }
}

Status TakePieces(const std::string& fileName, const pugi::xml_node& image, PieceIndex& index)
{
  for (const pugi::xml_node& node : image.children("Piece"))
  {
    PieceIndex::Piece piece;
    const std::string source = node.attribute("Source").value();
    if (source.empty() || !TakeExtent(node.attribute("Extent"), piece.Points))
    {
      return Corrupt(fileName,
        "is damaged: piece " + std::to_string(index.Pieces.size()) + " has no Source or no Extent");
    }
    piece.File = headers::Beside(fileName, source);
    struct stat info = {};
    if (::stat(piece.File.c_str(), &info) != 0 || !S_ISREG(info.st_mode))
    {
      std::string text = "'" + fileName;
      text += "' has the piece '" + source + "', but there is no such file.";
      return { StatusCode::NotFound, text };
    }
    index.Pieces.push_back(std::move(piece));
  }
  return index.Pieces.empty() ? Corrupt(fileName, "has no pieces") : Status();
}
} // namespace

Result<PieceIndex> PieceIndex::Read(const std::string& fileName)
{
  const auto content = headers::Begin(fileName, LargestIndex);
  if (!content.Ok())
  {
    return content.GetStatus();
  }
  pugi::xml_document document;
  const pugi::xml_parse_result parsed =
    document.load_buffer(content.Value().data(), content.Value().size());
  const pugi::xml_node image = document.child("VTKFile").child("PImageData");
  if (!parsed || !image)
  {
    return Corrupt(fileName, "isn't a parallel VTK image (.pvti), or it is damaged");
  }
  PieceIndex index;
  bool good = TakeExtent(image.attribute("WholeExtent"), index.Whole) &&
    TakeNumbers(image.attribute("Origin"), index.Origin) &&
    TakeNumbers(image.attribute("Spacing"), index.Spacing) &&
    TakeNumbers(image.attribute("Direction"), index.Direction) && formats::IsSpacing(index.Spacing);
  for (std::size_t i = 0; i < 6; i += 2)
  {
    good = good &&
      static_cast<double>(index.Whole.at(i + 1)) - index.Whole.at(i) <
        static_cast<double>(std::numeric_limits<int>::max());
  }
  if (!good)
  {
    return Corrupt(
      fileName, "is damaged: its WholeExtent, Origin, Spacing or Direction can't be understood");
  }
  TakeArrays(image.child("PPointData"), false, index);
  TakeArrays(image.child("PCellData"), true, index);
  const Status status = TakePieces(fileName, image, index);
  return status.Ok() ? Result<PieceIndex>(std::move(index)) : Result<PieceIndex>(status);
}

Result<PieceIndex::Array> PieceIndex::Choose(
  const std::string& fileName, const std::string& name) const
{
  const auto find = [this](const std::string& wanted, int cells)
  {
    return std::find_if(this->Arrays.begin(), this->Arrays.end(),
      [&](const Array& array)
      { return array.Name == wanted && (cells < 0 || array.Cells == (cells != 0)); });
  };
  auto found = this->Arrays.end();
  if (!name.empty())
  {
    found = find(name, -1);
  }
  else if (found = find(this->PointScalars, 0); found == this->Arrays.end())
  {
    found = find(this->CellScalars, 1);
    found = found == this->Arrays.end() && this->Arrays.size() == 1 ? this->Arrays.begin() : found;
  }
  if (found == this->Arrays.end())
  {
    std::string names;
    for (std::size_t i = 0; i < std::min(MostNames, this->Arrays.size()); ++i)
    {
      names += (i > 0 ? ", \"" : "\"") + this->Arrays[i].Name + "\"";
    }
    return Status(StatusCode::NotFound,
      "'" + fileName + "' has no " + (name.empty() ? "active scalars" : "array \"" + name + "\"") +
        (names.empty() ? ", and no arrays." : ", but " + names + "."));
  }
  if (!found->Type || found->Components < 1 || found->Components > 4)
  {
    return headers::Unsupported(fileName,
      "has the array \"" + found->Name + "\" of " + std::to_string(found->Components) +
        " components of the type " + found->TypeName +
        "; voxels have 1 to 4 of 8 to 32 bits, or floats");
  }
  return *found;
}

PieceIndex::Extent PieceIndex::IndicesOf(const Extent& points, bool cells) const
{
  Extent indices = points;
  for (std::size_t i = 0; i < 6 && cells; i += 2)
  {
    indices.at(i + 1) -= this->Whole.at(i) < this->Whole.at(i + 1) ? 1 : 0;
  }
  return indices;
}

Result<std::vector<PieceIndex::Part>> PieceIndex::PartsOf(
  const std::string& fileName, const Extent& indices, bool cells) const
{
  std::vector<Part> parts;
  std::vector<Extent> left{ indices };
  std::int64_t comparisons = 0;
  for (std::size_t p = 0; p < this->Pieces.size() && !left.empty(); ++p)
  {
    const Extent has = this->IndicesOf(this->Pieces[p].Points, cells);
    Part part;
    part.Piece = p;
    std::vector<Extent> rest;
    comparisons += static_cast<std::int64_t>(left.size());
    if (comparisons > MostComparisons)
    {
      return headers::Unsupported(fileName, "has too many pieces that overlap");
    }
    for (const Extent& box : left)
    {
      Extent both{};
      if (!Intersect(box, has, both))
      {
        rest.push_back(box);
        continue;
      }
      Subtract(box, both, rest);
      for (std::size_t i = 0; i < 6; ++i)
      {
        const int now = both.at(i);
        const int before = part.Boxes.empty() ? now : part.Indices.at(i);
        part.Indices.at(i) = i % 2 == 0 ? std::min(before, now) : std::max(before, now);
      }
      part.Boxes.push_back(both);
    }
    left = std::move(rest);
    if (!part.Boxes.empty())
    {
      parts.push_back(std::move(part));
    }
  }
  if (!left.empty())
  {
    return Corrupt(fileName,
      std::string("has no piece with the ") + (cells ? "cells" : "points") + " of the extent " +
        Text(left.front()));
  }
  return parts;
}

} // namespace teravox
