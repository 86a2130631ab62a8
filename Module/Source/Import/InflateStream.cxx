// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "InflateStream.h"

#include "HeaderText.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <limits>
#include <new>
#include <unistd.h>
#include <vector>
#include <zlib.h>

namespace teravox
{

namespace
{
constexpr std::size_t BufferSize = std::size_t{ 1 } << 18;
constexpr int EitherHeader = 15 + 32; // the largest window; zlib's or gzip's header
} // namespace

struct InflateStream::Decoder
{
  Decoder()
    : Buffer(BufferSize)
  {
    if (inflateInit2(&this->Stream, EitherHeader) != Z_OK)
    {
      throw std::bad_alloc();
    }
  }
  ~Decoder() { inflateEnd(&this->Stream); }
  Decoder(const Decoder&) = delete;
  Decoder& operator=(const Decoder&) = delete;
  Decoder(Decoder&&) = delete;
  Decoder& operator=(Decoder&&) = delete;

  z_stream Stream{};
  std::vector<unsigned char> Buffer;
  bool Ended = false; // a member has; another one may follow
};

InflateStream::InflateStream(std::string fileName, std::int64_t offset)
  : Name(std::move(fileName))
  , Offset(offset)
{
}

InflateStream::~InflateStream()
{
  if (this->File >= 0)
  {
    ::close(this->File);
  }
}

Result<std::unique_ptr<InflateStream>> InflateStream::Open(
  const std::string& fileName, std::int64_t offset)
{
  std::unique_ptr<InflateStream> stream(new InflateStream(fileName, offset));
  const auto file = headers::OpenRegular(fileName);
  if (!file.Ok())
  {
    return file.GetStatus();
  }
  stream->File = file.Value();
  const Status status = stream->Start();
  return status.Ok() ? Result<std::unique_ptr<InflateStream>>(std::move(stream))
                     : Result<std::unique_ptr<InflateStream>>(status);
}

Status InflateStream::Start()
{
  this->State = std::make_unique<Decoder>();
  this->Position = 0;
  if (::lseek(this->File, this->Offset, SEEK_SET) < 0)
  {
    return { StatusCode::InputOutput,
      "'" + this->Name + "' can't be read: " + std::strerror(errno) + "." };
  }
  return {};
}

Status InflateStream::Decode(std::size_t size, std::byte* out)
{
  std::array<std::byte, 1 << 15> away{};
  z_stream& stream = this->State->Stream;
  while (size > 0)
  {
    if (stream.avail_in == 0)
    {
      const ssize_t n = ::read(this->File, this->State->Buffer.data(), BufferSize);
      if (n < 0 && errno == EINTR)
      {
        continue;
      }
      if (n < 0)
      {
        return { StatusCode::InputOutput,
          "'" + this->Name + "' can't be read: " + std::strerror(errno) + "." };
      }
      if (n == 0)
      {
        return { StatusCode::Corrupt,
          "'" + this->Name + "' is cut off: what it holds ends after " +
            std::to_string(this->Position) + " bytes." };
      }
      stream.next_in = this->State->Buffer.data();
      stream.avail_in = static_cast<unsigned>(n);
    }
    if (this->State->Ended)
    {
      inflateReset(&stream);
      this->State->Ended = false;
    }
    const std::size_t room =
      std::min<std::size_t>(size, out != nullptr ? std::size_t{ 1 } << 30 : away.size());
    stream.next_out = reinterpret_cast<unsigned char*>(out != nullptr ? out : away.data());
    stream.avail_out = static_cast<unsigned>(room);
    const int result = inflate(&stream, Z_NO_FLUSH);
    if (result != Z_OK && result != Z_STREAM_END && result != Z_BUF_ERROR)
    {
      return { StatusCode::Corrupt,
        "'" + this->Name + "' is damaged: its compressed data don't decode after " +
          std::to_string(this->Position) + " bytes." };
    }
    this->State->Ended = result == Z_STREAM_END;
    const std::size_t done = room - stream.avail_out;
    this->Position += static_cast<std::int64_t>(done);
    size -= done;
    out += out != nullptr ? done : 0;
  }
  return {};
}

Status InflateStream::Read(std::int64_t position, std::size_t size, void* out)
{
  Status status = position < this->Position ? this->Start() : Status();
  if (status.Ok())
  {
    status = this->Decode(static_cast<std::size_t>(position - this->Position), nullptr);
  }
  return status.Ok() ? this->Decode(size, static_cast<std::byte*>(out)) : status;
}

} // namespace teravox
