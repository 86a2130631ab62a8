// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "HeaderFields.h"
#include "Palette.h"
#include "PictureFile.h"

#include <algorithm>

namespace teravox
{

namespace
{
constexpr std::size_t HeaderBytes = 18;

/// Truevision's TGA 2.0: grey of 8 bits, colours of 24 or 32, or numbers of a palette of such; also
/// as runs. Which corner comes first is what the file says.
class TGAFile : public PictureFile
{
public:
  TGAFile(const std::string& fileName, Stream file)
    : PictureFile(fileName, std::move(file))
  {
  }

protected:
  bool ReadHeader() override;
  bool ReadRows(std::byte* out) override;

private:
  bool TakeKind(const headers::Fields& head);
  bool TakePalette(const headers::Fields& head);
  bool TakePixels(std::size_t count, std::uint8_t* raw);
  bool PutPixel(const std::uint8_t* raw, std::byte* out);

  Palette Colors;
  std::size_t First = 0; // number of the palette
  bool Numbers = false;  // of the palette
  bool Runs = false;
  bool FromAbove = false;
  bool FromRight = false;
  std::size_t PixelBytes = 0;
  std::uint64_t Offset = 0; // of the pixels
  // The packet that pixels are taken from: of so many more; the same one, or each its own.
  std::size_t Left = 0;
  bool Same = false;
  std::array<std::uint8_t, 4> Pixel{};
};

/// What its pixels are.
bool TGAFile::TakeKind(const headers::Fields& head)
{
  const unsigned kind = head.At<std::uint8_t>(2);
  const unsigned bits = head.At<std::uint8_t>(16);
  const unsigned corner = head.At<std::uint8_t>(17);
  this->Runs = (kind & 8U) != 0;
  const unsigned what = kind & ~8U;
  this->Numbers = what == 1;
  this->FromRight = (corner & 16U) != 0;
  this->FromAbove = (corner & 32U) != 0;
  this->PixelBytes = bits / 8;
  const bool colors = what == 2 && (bits == 24 || bits == 32);
  if ((!colors && ((what != 1 && what != 3) || bits != 8)) || corner > 63)
  {
    return this->Fail(
      "is no TGA file of grey or palettes with 8 bits, or colours with 24 or 32", true);
  }
  // Bits that aren't alpha may be anything.
  this->Head.Components = what == 3 ? 1 : bits == 32 && (corner & 15U) != 0 ? 4 : 3;
  return true;
}

bool TGAFile::TakePalette(const headers::Fields& head)
{
  this->First = head.At<std::uint16_t>(3);
  this->Colors.Size = head.At<std::uint16_t>(5);
  const unsigned bits = head.At<std::uint8_t>(7);
  if (head.At<std::uint8_t>(1) != 1 || this->Colors.Size == 0 || this->Colors.Size > Palette::Most)
  {
    return this->Fail("its header contradicts itself");
  }
  if (bits != 24 && bits != 32)
  {
    return this->Fail("has a palette of other than 24 or 32 bits", true);
  }
  this->Colors.HasAlpha = bits == 32;
  for (std::size_t i = 0; i < this->Colors.Size; ++i)
  {
    std::array<std::uint8_t, 4> blue{}; // blue, green, red, alpha
    if (this->Take(blue.data(), bits / 8) < bits / 8)
    {
      return false;
    }
    this->Colors.Colors.at(i) = { blue[2], blue[1], blue[0], blue[3] };
  }
  this->Head.Components = this->Colors.Components();
  return true;
}

bool TGAFile::ReadHeader()
{
  std::string bytes(HeaderBytes, '\0');
  if (this->Take(bytes.data(), bytes.size()) < bytes.size())
  {
    return false;
  }
  const headers::Fields head(bytes, false);
  this->Head.Width = head.At<std::uint16_t>(12);
  this->Head.Height = head.At<std::uint16_t>(14);
  if (this->Head.Width == 0 || this->Head.Height == 0)
  {
    return this->Fail("it says a size that can't be");
  }
  const std::uint64_t palette = head.At<std::uint8_t>(1) == 0
    ? 0
    : std::uint64_t{ head.At<std::uint16_t>(5) } * ((head.At<std::uint8_t>(7) + 7U) / 8U);
  const std::uint64_t behind = HeaderBytes + head.At<std::uint8_t>(0);
  this->Offset = behind + palette;
  if (!this->TakeKind(head) || !this->Seek(behind) || (this->Numbers && !this->TakePalette(head)) ||
    !this->Seek(this->Offset))
  {
    return false;
  }
  this->Head.DecoderBytes = BufferBytes;
  // A run of 128 takes a byte and a pixel.
  const std::uint64_t pixels = std::uint64_t{ this->Head.Width } * this->Head.Height;
  const std::uint64_t least =
    this->Runs ? (pixels + 127) / 128 * (1 + this->PixelBytes) : pixels * this->PixelBytes;
  return this->BytesLeft() >= least || this->Fail("it is cut off");
}

/// The next pixels as they are in the file; packets may go on in the next row.
bool TGAFile::TakePixels(std::size_t count, std::uint8_t* raw)
{
  if (!this->Runs)
  {
    return this->Take(raw, count * this->PixelBytes) == count * this->PixelBytes;
  }
  for (; count > 0; --count, --this->Left, raw += this->PixelBytes)
  {
    const bool begins = this->Left == 0;
    if (begins)
    {
      std::uint8_t packet = 0;
      if (this->Take(&packet, 1) < 1)
      {
        return false;
      }
      this->Left = (packet & 127U) + 1U;
      this->Same = (packet & 128U) != 0;
    }
    if ((begins || !this->Same) &&
      this->Take(this->Pixel.data(), this->PixelBytes) < this->PixelBytes)
    {
      return false;
    }
    std::copy_n(this->Pixel.begin(), this->PixelBytes, raw);
  }
  return true;
}

bool TGAFile::PutPixel(const std::uint8_t* raw, std::byte* out)
{
  if (this->Numbers)
  {
    const auto number = static_cast<std::uint8_t>(*raw - this->First);
    return (*raw >= this->First && this->Colors.Put(&number, 1, out)) ||
      this->Fail("a pixel has a colour that its palette doesn't have");
  }
  const auto components = static_cast<std::size_t>(this->Head.Components);
  for (std::size_t c = 0; c < components; ++c)
  {
    // Blue, green, red, alpha.
    out[c] = std::byte{ raw[components >= 3 && c < 3 ? 2 - c : c] };
  }
  return true;
}

bool TGAFile::ReadRows(std::byte* out)
{
  if (!this->Seek(this->Offset))
  {
    return false;
  }
  const std::size_t width = this->Head.Width;
  const auto components = static_cast<std::size_t>(this->Head.Components);
  for (std::size_t y = 0; y < this->Head.Height; ++y)
  {
    std::byte* row = this->Row(this->FromAbove ? y : this->Head.Height - 1 - y, out);
    for (std::size_t x = 0; x < width; ++x)
    {
      std::array<std::uint8_t, 4> raw{};
      const std::size_t at = this->FromRight ? width - 1 - x : x;
      if (!this->TakePixels(1, raw.data()) || !this->PutPixel(raw.data(), row + at * components))
      {
        return false;
      }
    }
  }
  return true;
}

} // namespace

std::unique_ptr<PictureFile> PictureFile::OfTGA(const std::string& fileName, Stream file)
{
  return std::make_unique<TGAFile>(fileName, std::move(file));
}

} // namespace teravox
