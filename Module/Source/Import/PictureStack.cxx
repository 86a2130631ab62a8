// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "PictureStack.h"

#include "PictureFile.h"
#include "SliceVoxelReader.h"

#include <algorithm>
#include <utility>

namespace teravox
{

namespace
{
class Reader : public SliceVoxelReader
{
public:
  Reader(Description volume, const PictureFile::Header& all, std::vector<std::string> files)
    : SliceVoxelReader(std::move(volume))
    , All(all)
    , Files(std::move(files))
  {
  }
  std::uint64_t DecoderBytes() const override { return this->All.DecoderBytes; }

protected:
  Status ReadSlice(std::int64_t z, std::byte* out) override
  {
    const std::string& name = this->Files.at(static_cast<std::size_t>(z));
    const auto file = PictureFile::Open(name);
    if (!file.Ok())
    {
      return file.GetStatus();
    }
    const PictureFile::Header& header = file.Value()->GetHeader();
    if (!(header == this->All) || header.DecoderBytes > this->All.DecoderBytes)
    {
      return { StatusCode::InvalidArgument,
        "'" + name + "' isn't the picture any more that it was when the volume was opened." };
    }
    return file.Value()->Read(out);
  }

private:
  PictureFile::Header All; // of the first one, but the most memory of any
  std::vector<std::string> Files;
};
} // namespace

bool PictureStack::IsPicture(const std::string& fileName)
{
  return PictureFile::FormatOf(fileName) != PictureFile::Format::None;
}

Result<std::shared_ptr<VoxelReader>> PictureStack::Open(const Request& request)
{
  if (request.Files.empty())
  {
    return Status(StatusCode::InvalidArgument, "There are no picture files.");
  }
  PictureFile::Header all;
  for (const std::string& name : request.Files)
  {
    const auto file = PictureFile::Open(name);
    if (!file.Ok())
    {
      return file.GetStatus();
    }
    const PictureFile::Header& header = file.Value()->GetHeader();
    if (all.Of == PictureFile::Format::None)
    {
      all = header;
    }
    if (header.Of != all.Of)
    {
      return Status(StatusCode::InvalidArgument,
        "'" + request.Files.front() + "' and '" + name +
          "' are of two formats; choose those of one by a pattern of their names.");
    }
    const Status status = CheckAlike(name, header, all);
    if (!status.Ok())
    {
      return status;
    }
    all.DecoderBytes = std::max(all.DecoderBytes, header.DecoderBytes);
  }
  auto volume =
    DescribeStack(request.Files.front(), all, static_cast<std::int64_t>(request.Files.size()));
  if (!volume.Ok())
  {
    return volume.GetStatus();
  }
  volume.Value().Spacing = { all.Spacing[0], all.Spacing[1], all.Spacing[0] };
  const auto reader = std::make_shared<Reader>(volume.Value(), all, request.Files);
  reader->SetCacheLimit(request.CacheBytes);
  return std::shared_ptr<VoxelReader>(reader);
}

} // namespace teravox
