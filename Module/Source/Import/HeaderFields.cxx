// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "HeaderFields.h"

#include "HeaderText.h"
#include "InflateStream.h"

namespace teravox::headers
{

namespace
{
/// Whether a file begins as gzip's do. Errors: as Begin().
Result<bool> IsGzip(const std::string& fileName)
{
  const auto begin = Begin(fileName, 2);
  return begin.Ok() ? Result<bool>(begin.Value() == "\x1f\x8b") : Result<bool>(begin.GetStatus());
}
} // namespace

Result<std::string> DecodedBegin(const std::string& fileName, std::size_t least, std::size_t most)
{
  const auto compressed = IsGzip(fileName);
  if (!compressed.Ok())
  {
    return compressed.GetStatus();
  }
  if (!compressed.Value())
  {
    return Begin(fileName, most);
  }
  auto stream = InflateStream::Open(fileName, 0);
  if (!stream.Ok())
  {
    return stream.GetStatus();
  }
  std::string bytes(most, '\0');
  const Status status = stream.Value()->Read(0, least, bytes.data());
  // A small volume may end before the largest header would.
  static_cast<void>(
    stream.Value()->Read(static_cast<std::int64_t>(least), most - least, bytes.data() + least));
  return status.Ok() ? Result<std::string>(bytes) : Result<std::string>(status);
}

Result<RawVolume> VoxelsIn(const std::string& fileName, std::int64_t before, RawVolume raw)
{
  const auto compressed = IsGzip(fileName);
  if (!compressed.Ok())
  {
    return compressed.GetStatus();
  }
  raw.Files = { fileName };
  raw.Compressed = compressed.Value();
  (raw.Compressed ? raw.Before : raw.Offset) = before;
  return raw;
}

Status NoTimePoint(const std::string& fileName, std::int64_t times, int timePoint)
{
  return { StatusCode::InvalidArgument,
    "'" + fileName + "' has " + std::to_string(times) +
      " time points, counted from 0; there is no " + std::to_string(timePoint) + "." };
}

} // namespace teravox::headers
