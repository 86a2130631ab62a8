// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "PictureFile.h"

#include "HeaderText.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <sys/stat.h>
#include <unistd.h>

namespace teravox
{

namespace
{
constexpr std::size_t SignatureBytes = 18;
using Signature = std::array<unsigned char, SignatureBytes>; // what a file doesn't have is 0

/// A bitmap has the size of its header, which tells its kind, behind 14 bytes.
bool IsBMP(const Signature& begin)
{
  constexpr std::array<unsigned char, 7> sizes{ 12, 40, 52, 56, 64, 108, 124 };
  return begin[0] == 'B' && begin[1] == 'M' &&
    std::find(sizes.begin(), sizes.end(), begin[14]) != sizes.end() && begin[15] == 0 &&
    begin[16] == 0 && begin[17] == 0;
}

bool IsPNM(const Signature& begin)
{
  const unsigned char c = begin[2];
  return begin[0] == 'P' && begin[1] >= '1' && begin[1] <= '6' &&
    (c == ' ' || c == '\t' || c == '\n' || c == '\r' || c == '#');
}

PictureFile::Format FormatOfBytes(const std::string& fileName, const Signature& begin)
{
  constexpr std::array<unsigned char, 8> png{ 0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n' };
  // TGA has none that tell: kinds of palettes and pixels there are.
  const std::string name = headers::Lower(fileName);
  const unsigned kind = begin[2] & ~8U;
  const bool tga = name.size() > 4 && name.compare(name.size() - 4, 4, ".tga") == 0 &&
    begin[1] <= 1 && kind >= 1 && kind <= 3;
  return std::equal(png.begin(), png.end(), begin.begin())     ? PictureFile::Format::PNG
    : begin[0] == 0xff && begin[1] == 0xd8 && begin[2] == 0xff ? PictureFile::Format::JPEG
    : IsPNM(begin)                                             ? PictureFile::Format::PNM
    : IsBMP(begin)                                             ? PictureFile::Format::BMP
    : tga                                                      ? PictureFile::Format::TGA
                                                               : PictureFile::Format::None;
}
} // namespace

PictureFile::Format PictureFile::FormatOf(const std::string& fileName)
{
  const auto begin = headers::Begin(fileName, SignatureBytes);
  Signature bytes{};
  if (begin.Ok())
  {
    std::memcpy(bytes.data(), begin.Value().data(), begin.Value().size());
  }
  return FormatOfBytes(fileName, bytes);
}

Result<std::unique_ptr<PictureFile>> PictureFile::Open(const std::string& fileName)
{
  const auto descriptor = headers::OpenRegular(fileName);
  if (!descriptor.Ok())
  {
    return descriptor.GetStatus();
  }
  Stream file(::fdopen(descriptor.Value(), "rb"));
  if (!file)
  {
    const int error = errno;
    ::close(descriptor.Value());
    return Status(
      StatusCode::InputOutput, "'" + fileName + "' can't be opened: " + std::strerror(error) + ".");
  }
  Signature begin{};
  const std::size_t taken = std::fread(begin.data(), 1, begin.size(), file.get());
  std::rewind(file.get());
  const Format format = taken > 0 ? FormatOfBytes(fileName, begin) : Format::None;
  if (format == Format::None)
  {
    return headers::Corrupt(fileName, "is no PNG, JPEG, PNM, BMP or TGA file");
  }
  using Make = std::unique_ptr<PictureFile> (*)(const std::string&, Stream);
  constexpr std::array<Make, 5> makers{ &OfPNG, &OfJPEG, &OfPNM, &OfBMP, &OfTGA };
  auto picture = makers.at(static_cast<std::size_t>(format) - 1)(fileName, std::move(file));
  picture->Head.Of = format;
  if (!picture->ReadHeader())
  {
    return picture->Failure();
  }
  return picture;
}

Status PictureFile::Read(std::byte* out)
{
  return this->ReadRows(out) ? Status() : this->Failure();
}

Status PictureFile::Failure() const
{
  if (this->Refused)
  {
    return headers::Unsupported(this->Name, this->Error.data());
  }
  return { std::ferror(this->File.get()) != 0 ? StatusCode::InputOutput : StatusCode::Corrupt,
    "'" + this->Name + "' can't be read: " + this->Error.data() + "." };
}

std::size_t PictureFile::RowBytes() const
{
  return SizeOf(this->Head.Type) * static_cast<std::size_t>(this->Head.Components) *
    this->Head.Width;
}

std::byte* PictureFile::Row(std::size_t fromAbove, std::byte* out) const
{
  return out + this->RowBytes() * (this->Head.Height - 1 - fromAbove);
}

std::size_t PictureFile::Take(void* to, std::size_t size)
{
  const std::size_t taken = std::fread(to, 1, size, this->File.get());
  if (taken < size)
  {
    this->Fail(std::ferror(this->File.get()) != 0 ? std::strerror(errno) : "it is cut off");
  }
  return taken;
}

int PictureFile::Next()
{
  unsigned char c = 0;
  return this->Take(&c, 1) == 1 ? c : EOF;
}

void PictureFile::SkipIf(char wanted)
{
  const int c = std::fgetc(this->File.get());
  if (c != wanted && c != EOF)
  {
    std::ungetc(c, this->File.get());
  }
}

bool PictureFile::Seek(std::uint64_t to)
{
  std::rewind(this->File.get());
  if (to > this->BytesLeft())
  {
    return this->Fail("it is cut off");
  }
  return ::fseeko(this->File.get(), static_cast<off_t>(to), SEEK_SET) == 0 ||
    this->Fail(std::strerror(errno));
}

std::uint64_t PictureFile::BytesLeft() const
{
  struct stat info = {};
  const off_t at = ::ftello(this->File.get());
  return ::fstat(::fileno(this->File.get()), &info) == 0 && at >= 0 && info.st_size > at
    ? static_cast<std::uint64_t>(info.st_size - at)
    : 0;
}

bool PictureFile::Fail(const char* text, bool refused)
{
  std::snprintf(this->Error.data(), this->Error.size(), "%s", text);
  this->Refused = refused;
  return false;
}

} // namespace teravox
