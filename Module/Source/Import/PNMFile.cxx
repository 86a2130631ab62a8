// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "PictureFile.h"

#include <cstring>
#include <utility>

namespace teravox
{

namespace
{
constexpr std::uint32_t MostPixels = 0x7fffffff; // along an axis
constexpr std::uint32_t MostValue = 65535;

/// Portable greymaps and pixmaps (netpbm's pgm(5), ppm(5)), as numbers or as text. Values are what
/// the file says, whatever its largest one is.
class PNMFile : public PictureFile
{
public:
  PNMFile(const std::string& fileName, Stream file)
    : PictureFile(fileName, std::move(file))
  {
  }

protected:
  bool ReadHeader() override;
  bool ReadRows(std::byte* out) override;

private:
  bool TakeNumber(std::uint32_t largest, std::uint32_t& number);
  bool ReadTextRow(std::byte* row);

  std::uint32_t Largest = 0; // value
  bool Text = false;
  int After = 0; // the character behind the last number
};

/// A decimal number, whose end is a character that isn't of it: that one is taken, too.
bool PNMFile::TakeNumber(std::uint32_t largest, std::uint32_t& number)
{
  int c = this->Next();
  bool comment = false;
  while (c == ' ' || (c >= '\t' && c <= '\r') || c == '#' || (comment && c != EOF))
  {
    comment = c == '#' || (comment && c != '\n');
    c = this->Next();
  }
  if (c == EOF)
  {
    return false; // Next() has said why
  }
  if (c < '0' || c > '9')
  {
    return this->Fail("there is something else where a number should be");
  }
  std::uint64_t value = 0;
  for (; c >= '0' && c <= '9'; c = this->Next())
  {
    value = 10 * value + static_cast<std::uint64_t>(c - '0');
    if (value > largest)
    {
      return this->Fail("a number in it is too large");
    }
  }
  this->After = c;
  this->Error[0] = '\0';
  number = static_cast<std::uint32_t>(value);
  return true;
}

bool PNMFile::ReadHeader()
{
  std::array<char, 2> kind{};
  if (this->Take(kind.data(), kind.size()) < kind.size())
  {
    return false;
  }
  if (kind[1] == '1' || kind[1] == '4')
  {
    return this->Fail("is a map of single bits (PBM); greymaps and pixmaps are read", true);
  }
  this->Text = kind[1] == '2' || kind[1] == '3';
  if (!this->TakeNumber(MostPixels, this->Head.Width) ||
    !this->TakeNumber(MostPixels, this->Head.Height) || !this->TakeNumber(MostValue, this->Largest))
  {
    return false;
  }
  if (this->Head.Width == 0 || this->Head.Height == 0 || this->Largest == 0)
  {
    return this->Fail("its size or its largest value is 0");
  }
  // One character ends the header; some programs write two.
  if (!this->Text && this->After == '\r')
  {
    this->SkipIf('\n');
  }
  this->Head.Type = this->Largest > 255 ? ScalarType::UInt16 : ScalarType::UInt8;
  this->Head.Components = kind[1] == '3' || kind[1] == '6' ? 3 : 1;
  this->Head.DecoderBytes = BufferBytes;
  // A value of a text takes a digit and a character between it and the next one.
  const std::uint64_t values = std::uint64_t{ this->Head.Width } *
    static_cast<unsigned>(this->Head.Components) * this->Head.Height;
  const std::uint64_t least =
    this->Text ? 2 * values - 1 : values * static_cast<std::uint64_t>(SizeOf(this->Head.Type));
  return this->BytesLeft() >= least || this->Fail("it is cut off");
}

bool PNMFile::ReadTextRow(std::byte* row)
{
  const std::size_t values = this->RowBytes() / static_cast<std::size_t>(SizeOf(this->Head.Type));
  for (std::size_t i = 0; i < values; ++i)
  {
    std::uint32_t value = 0;
    if (!this->TakeNumber(this->Largest, value))
    {
      return false;
    }
    if (this->Head.Type == ScalarType::UInt16)
    {
      const auto wide = static_cast<std::uint16_t>(value);
      std::memcpy(row + 2 * i, &wide, sizeof(wide));
    }
    else
    {
      row[i] = static_cast<std::byte>(value);
    }
  }
  return true;
}

bool PNMFile::ReadRows(std::byte* out)
{
  for (std::size_t y = 0; y < this->Head.Height; ++y)
  {
    std::byte* row = this->Row(y, out);
    if (this->Text)
    {
      if (!this->ReadTextRow(row))
      {
        return false;
      }
      continue;
    }
    if (this->Take(row, this->RowBytes()) < this->RowBytes())
    {
      return false;
    }
    if (this->Head.Type == ScalarType::UInt16)
    {
      for (std::size_t i = 0; i + 1 < this->RowBytes(); i += 2)
      {
        std::swap(row[i], row[i + 1]);
      }
    }
  }
  return true;
}

} // namespace

std::unique_ptr<PictureFile> PictureFile::OfPNM(const std::string& fileName, Stream file)
{
  return std::make_unique<PNMFile>(fileName, std::move(file));
}

} // namespace teravox
