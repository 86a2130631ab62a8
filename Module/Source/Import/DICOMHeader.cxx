// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "DICOMHeader.h"

#include "Formats/FormatText.h"
#include "HeaderText.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>

namespace teravox
{

namespace
{
using headers::Corrupt;
using headers::Unsupported;

constexpr std::size_t Preamble = 132; // 128 bytes and "DICM"
constexpr std::uint32_t Undefined = 0xffffffffU;
constexpr std::uint32_t PixelData = 0x7fe00010U;

constexpr std::uint32_t ItemEnd = 0xfffee00dU;
constexpr std::uint32_t SequenceEnd = 0xfffee0ddU;

struct Element
{
  std::uint32_t Tag = 0;
  std::uint32_t Length = 0;
  std::size_t Start = 0; // of its value
  bool Sequence = false;
};

/// Walks over elements in the first bytes of a file, little-endian.
class Walker
{
public:
  explicit Walker(const std::string& bytes)
    : Bytes(bytes)
  {
  }

  /// The next element; false at the end of the bytes.
  bool Next(bool explicitTypes, Element& element)
  {
    if (this->Bytes.size() - this->At < 8)
    {
      return false;
    }
    element = {};
    element.Tag = this->Number(this->At, 2) << 16 | this->Number(this->At + 2, 2);
    this->At += 4;
    if (!explicitTypes || element.Tag >> 16 == 0xfffeU)
    {
      element.Length = this->Number(this->At, 4);
      this->At += 4;
    }
    else
    {
      const std::string type = this->Bytes.substr(this->At, 2);
      static const std::array<const char*, 12> wide{ "OB", "OD", "OF", "OL", "OV", "OW", "SQ", "SV",
        "UC", "UN", "UR", "UT" };
      element.Sequence = type == "SQ";
      if (std::any_of(wide.begin(), wide.end(), [&](const char* w) { return type == w; }))
      {
        if (this->Bytes.size() - this->At < 8)
        {
          return false;
        }
        element.Length = this->Number(this->At + 4, 4);
        this->At += 8;
      }
      else
      {
        element.Length = this->Number(this->At + 2, 2);
        this->At += 4;
      }
    }
    element.Start = this->At;
    return true;
  }

  /// To the element's end; that of an undefined length is found. False: beyond the bytes.
  bool Skip(const Element& element, bool explicitTypes)
  {
    if (element.Length != Undefined)
    {
      this->At += std::min<std::size_t>(element.Length, this->Bytes.size() - this->At);
      return element.Length <= this->Bytes.size() - element.Start;
    }
    // Items and sequences in it, of either kind of length, until as many have ended as begun.
    std::size_t depth = 1;
    Element inner;
    while (depth > 0 && this->Next(explicitTypes, inner))
    {
      if (inner.Tag == ItemEnd || inner.Tag == SequenceEnd)
      {
        --depth;
      }
      else if (inner.Length == Undefined)
      {
        ++depth;
      }
      else if (inner.Length > this->Bytes.size() - inner.Start)
      {
        return false;
      }
      else
      {
        this->At += inner.Length;
      }
    }
    return depth == 0;
  }

  std::uint32_t Number(std::size_t at, std::size_t bytes) const
  {
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < bytes && at + i < this->Bytes.size(); ++i)
    {
      value |= static_cast<std::uint32_t>(static_cast<unsigned char>(this->Bytes[at + i]))
        << (8 * i);
    }
    return value;
  }

  std::string Text(const Element& element) const
  {
    constexpr std::size_t most = 4096;
    const std::string text =
      this->Bytes.substr(element.Start, std::min<std::size_t>(element.Length, most));
    return headers::Trimmed(text.substr(0, text.find('\0')));
  }

  std::size_t At = Preamble;

private:
  const std::string& Bytes;
};

/// Numbers between backslashes; as many as wanted, or nothing.
template <std::size_t N>
bool TakeNumbers(std::string text, std::array<double, N>& numbers)
{
  std::replace(text.begin(), text.end(), '\\', ' ');
  const auto found = formats::ParseNumbers(text, 64);
  if (!found || found->size() < N ||
    !std::all_of(found->begin(), found->end(), [](double v) { return std::isfinite(v); }))
  {
    return false;
  }
  std::copy_n(found->begin(), N, numbers.begin());
  return true;
}

struct Reading
{
  DICOMHeader Header;
  std::uint32_t Frames = 1;
  std::uint32_t Planes = 0;
  bool Pixels = false;
};

void Take(const Walker& walker, const Element& e, Reading& r)
{
  DICOMHeader& h = r.Header;
  std::array<double, 1> one{};
  const auto number = [&] { return walker.Number(e.Start, 2); };
  const auto text = [&] { return walker.Text(e); };
  switch (e.Tag)
  {
    case 0x0020000eU:
      h.Series = text();
      break;
    case 0x00180050U: // thickness, unless there is a spacing
      h.SliceSpacing =
        TakeNumbers(text(), one) && one[0] > 0 && h.SliceSpacing == 1 ? one[0] : h.SliceSpacing;
      break;
    case 0x00180088U:
      h.SliceSpacing = TakeNumbers(text(), one) && one[0] > 0 ? one[0] : h.SliceSpacing;
      break;
    case 0x00200032U:
      TakeNumbers(text(), h.Position);
      break;
    case 0x00200037U:
      TakeNumbers(text(), h.Orientation);
      break;
    case 0x00280002U:
      h.Samples = static_cast<int>(number());
      break;
    case 0x00280006U:
      r.Planes = number();
      break;
    case 0x00280008U:
      r.Frames = TakeNumbers(text(), one) && one[0] >= 1 && one[0] < 1e9
        ? static_cast<std::uint32_t>(one[0])
        : 1;
      break;
    case 0x00280010U:
      h.Rows = number();
      break;
    case 0x00280011U:
      h.Columns = number();
      break;
    case 0x00280030U:
      TakeNumbers(text(), h.PixelSpacing);
      break;
    case 0x00280100U:
      h.BitsAllocated = static_cast<int>(number());
      break;
    case 0x00280101U:
      h.BitsStored = static_cast<int>(number());
      break;
    case 0x00280103U:
      h.Signed = number() == 1;
      break;
    case 0x00281052U:
      h.Intercept = TakeNumbers(text(), one) ? one[0] : 0;
      break;
    case 0x00281053U:
      h.Slope = TakeNumbers(text(), one) && one[0] != 0 ? one[0] : 1;
      break;
    default:
      break;
  }
}

/// Group 2, always with types: the syntax of all the rest.
std::string SyntaxOf(Walker& walker)
{
  std::string syntax = "1.2.840.10008.1.2";
  Element element;
  std::size_t before = walker.At;
  while (walker.Next(true, element) && element.Tag >> 16 == 2)
  {
    if (element.Tag == 0x00020010U)
    {
      syntax = walker.Text(element);
    }
    walker.Skip(element, true);
    before = walker.At;
  }
  walker.At = before;
  return syntax;
}

Status Check(const std::string& name, const Reading& r)
{
  const DICOMHeader& h = r.Header;
  if (!r.Pixels || h.Rows < 1 || h.Columns < 1)
  {
    return Corrupt(name, "has no picture, or its header is damaged");
  }
  if ((h.BitsAllocated != 8 && h.BitsAllocated != 16 && h.BitsAllocated != 32) ||
    h.BitsStored < 1 || h.BitsStored > h.BitsAllocated)
  {
    return Unsupported(name, "has pixels of " + std::to_string(h.BitsAllocated) + " bits");
  }
  if (r.Frames > 1)
  {
    return Unsupported(name, "has " + std::to_string(r.Frames) + " frames; one per file is read");
  }
  if (h.Samples < 1 || h.Samples > 4 || (h.Samples > 1 && r.Planes != 0))
  {
    return Unsupported(
      name, "has " + std::to_string(h.Samples) + " samples per pixel, or in planes");
  }
  if (!(h.PixelSpacing[0] > 0.0) || !(h.PixelSpacing[1] > 0.0))
  {
    return Corrupt(name, "has pixels without an extent");
  }
  return {};
}
} // namespace

Result<DICOMHeader> DICOMHeader::Read(const std::string& fileName)
{
  // Most headers are short; a long one has icons or private data.
  std::error_code error;
  const auto size = std::filesystem::file_size(fileName, error);
  Reading r;
  for (std::size_t bytes = std::size_t{ 1 } << 14;; bytes *= 16)
  {
    const auto begin = headers::Begin(fileName, bytes);
    if (!begin.Ok())
    {
      return begin.GetStatus();
    }
    if (begin.Value().size() < Preamble || begin.Value().compare(Preamble - 4, 4, "DICM") != 0)
    {
      return Corrupt(fileName, "isn't a DICOM file");
    }
    r = {};
    Walker walker(begin.Value());
    const std::string syntax = SyntaxOf(walker);
    const bool explicitTypes = syntax == "1.2.840.10008.1.2.1";
    if (!explicitTypes && syntax != "1.2.840.10008.1.2")
    {
      return Unsupported(fileName,
        "is compressed or big-endian (transfer syntax " + syntax +
          "); dcmdjpeg, dcmdjpls or gdcmconv --raw make it readable");
    }
    Element element;
    bool all = true;
    while (all && !r.Pixels && walker.Next(explicitTypes, element))
    {
      r.Pixels = element.Tag == PixelData;
      r.Header.PixelOffset = static_cast<std::int64_t>(element.Start);
      if (!r.Pixels)
      {
        all = walker.Skip(element, explicitTypes);
        if (all)
        {
          Take(walker, element, r);
        }
      }
    }
    constexpr std::size_t most = std::size_t{ 1 } << 26;
    if (r.Pixels || begin.Value().size() < bytes || bytes >= most)
    {
      break;
    }
  }
  if (r.Header.BitsStored == 0)
  {
    r.Header.BitsStored = r.Header.BitsAllocated;
  }
  Status status = Check(fileName, r);
  const std::int64_t wanted =
    r.Header.Rows * r.Header.Columns * r.Header.Samples * (r.Header.BitsAllocated / 8);
  if (status.Ok() && (error || static_cast<std::int64_t>(size) - r.Header.PixelOffset < wanted))
  {
    status =
      Corrupt(fileName, "is cut off: its picture takes " + std::to_string(wanted) + " bytes");
  }
  return status.Ok() ? Result<DICOMHeader>(r.Header) : Result<DICOMHeader>(status);
}

} // namespace teravox
