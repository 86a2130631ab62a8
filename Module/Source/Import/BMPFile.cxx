// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "HeaderFields.h"
#include "Palette.h"
#include "PictureFile.h"

#include <vector>

namespace teravox
{

namespace
{
constexpr std::size_t FileHeader = 14;
constexpr std::uint32_t OldHeader = 12;      // BITMAPCOREHEADER
constexpr std::uint32_t UsualHeader = 40;    // BITMAPINFOHEADER
constexpr std::uint32_t LargestHeader = 124; // BITMAPV5HEADER
constexpr std::uint32_t HeaderWithAlpha = 56;

/// Windows bitmaps (BITMAPINFOHEADER and its like of the Windows API), not compressed: numbers of a
/// palette of 1, 4 or 8 bits, colours of 24 or 32. What X-ray tomographs write as slices are such
/// with a grey palette, which are one value per pixel.
class BMPFile : public PictureFile
{
public:
  BMPFile(const std::string& fileName, Stream file)
    : PictureFile(fileName, std::move(file))
  {
  }

protected:
  bool ReadHeader() override;
  bool ReadRows(std::byte* out) override;

private:
  bool TakeSizes(const headers::Fields& head, std::uint32_t size);
  bool TakeColors(const headers::Fields& head, std::uint32_t size);
  bool TakePalette(std::uint32_t colors, std::uint64_t at, std::size_t entry);
  bool PutRow(const std::vector<std::uint8_t>& raw, std::byte* row);

  Palette Colors;
  unsigned Bits = 0; // per pixel
  bool FromAbove = false;
  std::uint32_t Offset = 0; // of the pixels
  std::uint64_t Stride = 0; // bytes of a row
};

bool BMPFile::TakeSizes(const headers::Fields& head, std::uint32_t size)
{
  std::int64_t width = 0;
  std::int64_t height = 0;
  if (size == OldHeader)
  {
    width = head.At<std::uint16_t>(4);
    height = head.At<std::uint16_t>(6);
    this->Bits = head.At<std::uint16_t>(10);
  }
  else
  {
    width = head.At<std::int32_t>(4);
    height = head.At<std::int32_t>(8);
    this->Bits = head.At<std::uint16_t>(14);
    for (std::size_t axis = 0; axis < 2; ++axis)
    {
      const auto perMeter = head.At<std::int32_t>(24 + 4 * axis);
      this->Head.Spacing.at(axis) = perMeter > 0 ? 1000.0 / perMeter : 1.0;
    }
    if (this->Head.Spacing[0] == 1.0 || this->Head.Spacing[1] == 1.0)
    {
      this->Head.Spacing = { 1, 1 };
    }
  }
  this->FromAbove = height < 0;
  height = height < 0 ? -height : height;
  if (width <= 0 || height == 0 || height > std::int64_t{ 0x7fffffff })
  {
    return this->Fail("it says a size that can't be");
  }
  this->Head.Width = static_cast<std::uint32_t>(width);
  this->Head.Height = static_cast<std::uint32_t>(height);
  return true;
}

/// How pixels are colours.
bool BMPFile::TakeColors(const headers::Fields& head, std::uint32_t size)
{
  const std::uint32_t compression = size == OldHeader ? 0 : head.At<std::uint32_t>(16);
  const bool masked = compression == 3 || compression == 6;
  if (this->Bits == 16 || (compression != 0 && !masked))
  {
    return this->Fail(this->Bits == 16 ? "has pixels of 16 bits; those of 1, 4, 8, 24, 32 are read"
                                       : "is a compressed bitmap; save it without compression",
      true);
  }
  if (this->Bits == 1 || this->Bits == 4 || this->Bits == 8)
  {
    const std::uint32_t said = size == OldHeader ? 0 : head.At<std::uint32_t>(32);
    const std::uint32_t all = std::uint32_t{ 1 } << this->Bits;
    if (masked || said > all)
    {
      return this->Fail("its header contradicts itself");
    }
    return this->TakePalette(said == 0 ? all : said, FileHeader + size, size == OldHeader ? 3 : 4);
  }
  if (this->Bits != 24 && this->Bits != 32)
  {
    return this->Fail("its header contradicts itself");
  }
  this->Head.Components = 3;
  if (masked)
  {
    // Behind a usual header, or in a larger one, at the same place.
    const bool alpha =
      size >= HeaderWithAlpha && head.At<std::uint32_t>(UsualHeader + 12) == 0xff000000U;
    this->Head.Components = alpha ? 4 : 3;
    if (this->Bits != 32 || head.At<std::uint32_t>(UsualHeader) != 0xff0000U ||
      head.At<std::uint32_t>(UsualHeader + 4) != 0xff00U ||
      head.At<std::uint32_t>(UsualHeader + 8) != 0xffU)
    {
      return this->Fail("has colours whose bits are in an unusual order", true);
    }
  }
  return true;
}

bool BMPFile::TakePalette(std::uint32_t colors, std::uint64_t at, std::size_t entry)
{
  if (!this->Seek(at))
  {
    return false;
  }
  this->Colors.Size = colors;
  for (std::size_t i = 0; i < colors; ++i)
  {
    std::array<std::uint8_t, 4> blue{}; // blue, green, red
    if (this->Take(blue.data(), entry) < entry)
    {
      return false;
    }
    this->Colors.Colors.at(i) = { blue[2], blue[1], blue[0], 255 };
  }
  this->Head.Components = this->Colors.Components();
  return true;
}

bool BMPFile::ReadHeader()
{
  std::string bytes(FileHeader + LargestHeader, '\0');
  const std::size_t taken = this->Take(bytes.data(), bytes.size());
  this->Error[0] = '\0';
  const headers::Fields file(bytes, false);
  const auto size = file.At<std::uint32_t>(FileHeader);
  this->Offset = file.At<std::uint32_t>(10);
  if (taken < FileHeader + size)
  {
    return this->Fail("it is cut off");
  }
  const headers::Fields head(bytes.substr(FileHeader), false);
  if (!this->TakeSizes(head, size) || !this->TakeColors(head, size))
  {
    return false;
  }
  this->Stride = (std::uint64_t{ this->Bits } * this->Head.Width + 31) / 32 * 4;
  this->Head.DecoderBytes = BufferBytes + this->Stride;
  if (this->Offset < FileHeader + size || !this->Seek(this->Offset))
  {
    return this->Fail("its header contradicts itself");
  }
  return this->BytesLeft() / this->Stride >= this->Head.Height || this->Fail("it is cut off");
}

bool BMPFile::PutRow(const std::vector<std::uint8_t>& raw, std::byte* row)
{
  const std::size_t width = this->Head.Width;
  if (this->Bits <= 8)
  {
    const auto components = static_cast<std::size_t>(this->Head.Components);
    const std::size_t perByte = 8 / this->Bits;
    for (std::size_t x = 0; x < width; ++x)
    {
      const std::size_t shift = (perByte - 1 - x % perByte) * this->Bits;
      const auto number =
        static_cast<std::uint8_t>(raw[x / perByte] >> shift & ((1U << this->Bits) - 1U));
      if (!this->Colors.Put(&number, 1, row + x * components))
      {
        return this->Fail("a pixel has a colour that its palette doesn't have");
      }
    }
    return true;
  }
  const std::size_t bytes = this->Bits / 8;
  for (std::size_t x = 0; x < width; ++x)
  {
    const std::uint8_t* blue = raw.data() + x * bytes;
    *row++ = std::byte{ blue[2] };
    *row++ = std::byte{ blue[1] };
    *row++ = std::byte{ blue[0] };
    if (this->Head.Components == 4)
    {
      *row++ = std::byte{ blue[3] };
    }
  }
  return true;
}

bool BMPFile::ReadRows(std::byte* out)
{
  if (!this->Seek(this->Offset))
  {
    return false;
  }
  std::vector<std::uint8_t> raw(this->Stride);
  for (std::size_t y = 0; y < this->Head.Height; ++y)
  {
    const std::size_t fromAbove = this->FromAbove ? y : this->Head.Height - 1 - y;
    if (this->Take(raw.data(), raw.size()) < raw.size() ||
      !this->PutRow(raw, this->Row(fromAbove, out)))
    {
      return false;
    }
  }
  return true;
}

} // namespace

std::unique_ptr<PictureFile> PictureFile::OfBMP(const std::string& fileName, Stream file)
{
  return std::make_unique<BMPFile>(fileName, std::move(file));
}

} // namespace teravox
