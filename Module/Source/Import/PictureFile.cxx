// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "PictureFile.h"

#include "HeaderText.h"

#include <cerrno>
#include <cstring>
#include <unistd.h>

namespace teravox
{

namespace
{
constexpr std::size_t SignatureBytes = 8;

PictureFile::Format FormatOfBytes(const std::array<unsigned char, SignatureBytes>& begin)
{
  constexpr std::array<unsigned char, SignatureBytes> png{ 0x89, 'P', 'N', 'G', '\r', '\n', 0x1a,
    '\n' };
  return begin == png                                          ? PictureFile::Format::PNG
    : begin[0] == 0xff && begin[1] == 0xd8 && begin[2] == 0xff ? PictureFile::Format::JPEG
                                                               : PictureFile::Format::None;
}
} // namespace

PictureFile::Format PictureFile::FormatOf(const std::string& fileName)
{
  const auto begin = headers::Begin(fileName, SignatureBytes);
  std::array<unsigned char, SignatureBytes> bytes{};
  if (begin.Ok())
  {
    std::memcpy(bytes.data(), begin.Value().data(), begin.Value().size());
  }
  return FormatOfBytes(bytes);
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
  std::array<unsigned char, SignatureBytes> begin{};
  const bool whole = std::fread(begin.data(), 1, begin.size(), file.get()) == begin.size();
  std::rewind(file.get());
  const Format format = whole ? FormatOfBytes(begin) : Format::None;
  if (format == Format::None)
  {
    return headers::Corrupt(fileName, "is no PNG or JPEG file");
  }
  auto picture =
    format == Format::PNG ? OfPNG(fileName, std::move(file)) : OfJPEG(fileName, std::move(file));
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
    const bool failed = std::ferror(this->File.get()) != 0;
    std::snprintf(this->Error.data(), this->Error.size(), "%s",
      failed ? std::strerror(errno) : "it is cut off");
  }
  return taken;
}

} // namespace teravox
