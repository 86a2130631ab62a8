// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "ConversionLog.h"

#include "PyramidFormat.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <fstream>
#include <libdeflate.h>
#include <string_view>
#include <sys/file.h>
#include <system_error>
#include <tuple>
#include <unistd.h>

namespace teravox
{

namespace
{
constexpr std::string_view PartEnding = ".part";
constexpr std::string_view LogEnding = ".log";
constexpr std::string_view LogMagic = "teravox log 1\n";
constexpr std::uint32_t RecordMagic = 0x6b6e6863; // "chnk"
constexpr std::size_t LargestTask = std::size_t{ 1 } << 16;

/// As it lies in the log, little-endian.
struct Record
{
  std::uint32_t Magic = RecordMagic;
  std::int32_t Level = 0;
  std::array<std::int64_t, 3> Index{};
  std::uint64_t Address = 0;
  std::uint64_t Size = 0;
  std::uint32_t FilterMask = 0;
  std::uint32_t Checksum = 0;
  std::uint32_t Reserved = 0;
  std::uint32_t OwnChecksum = 0; // of all that is before
};
static_assert(sizeof(Record) == 64, "no gaps");

std::uint32_t OwnChecksum(const Record& record)
{
  return ChecksumOf(
    reinterpret_cast<const std::byte*>(&record), sizeof(Record) - sizeof(record.OwnChecksum));
}

auto Order(const LoggedChunk& c)
{
  return std::make_tuple(c.Level, c.Index[2], c.Index[1], c.Index[0]);
}

bool OrderedBefore(const LoggedChunk& a, const LoggedChunk& b)
{
  return Order(a) < Order(b);
}

bool WriteAll(int file, const void* data, std::size_t size)
{
  const auto* from = static_cast<const char*>(data);
  while (size > 0)
  {
    const ssize_t n = ::write(file, from, size);
    if (n < 0 && errno == EINTR)
    {
      continue;
    }
    if (n <= 0)
    {
      return false;
    }
    from += n;
    size -= static_cast<std::size_t>(n);
  }
  return true;
}

/// The task of a log and its chunks, as far as they are whole; an empty task: it isn't a log.
std::string ReadLog(const std::string& name, std::vector<LoggedChunk>& chunks)
{
  std::ifstream in(name, std::ios::binary);
  std::string magic(LogMagic.size(), '\0');
  std::uint32_t size = 0;
  std::uint32_t checksum = 0;
  in.read(magic.data(), static_cast<std::streamsize>(magic.size()));
  in.read(reinterpret_cast<char*>(&size), sizeof(size));
  in.read(reinterpret_cast<char*>(&checksum), sizeof(checksum));
  if (!in || magic != LogMagic || size == 0 || size > LargestTask)
  {
    return "";
  }
  std::string task(size, '\0');
  in.read(task.data(), size);
  if (!in || checksum != ChecksumOf(reinterpret_cast<const std::byte*>(task.data()), task.size()))
  {
    return "";
  }
  Record record;
  while (in.read(reinterpret_cast<char*>(&record), sizeof(record)))
  {
    if (record.Magic != RecordMagic || record.OwnChecksum != OwnChecksum(record))
    {
      break; // what follows can't be found
    }
    chunks.push_back({ record.Level, { record.Index[0], record.Index[1], record.Index[2] },
      record.Address, record.Size, record.FilterMask, record.Checksum, 0 });
  }
  return task;
}

/// "123" or "123-4" between name and ending; the number, 0 if it is kept; nothing for other names.
bool IsPartOf(
  const std::string& name, const std::string& begin, std::string_view end, pid_t& process)
{
  if (name.size() <= begin.size() + end.size() || name.compare(0, begin.size(), begin) != 0 ||
    name.compare(name.size() - end.size(), end.size(), end) != 0)
  {
    return false;
  }
  std::string digits = name.substr(begin.size(), name.size() - begin.size() - end.size());
  const std::size_t dash = digits.find('-');
  if (dash != std::string::npos)
  {
    process = 0;
    digits.erase(dash, 1);
  }
  constexpr std::size_t longest = 9;
  if (digits.empty() || digits.find_first_not_of("0123456789") != std::string::npos ||
    (dash == std::string::npos && digits.size() > longest) || dash == 0)
  {
    return false;
  }
  process = dash == std::string::npos ? static_cast<pid_t>(std::stol(digits)) : 0;
  return true;
}

bool Lives(pid_t process)
{
  return process > 0 && (::kill(process, 0) == 0 || errno != ESRCH);
}
} // namespace

std::uint32_t ChecksumOf(const std::byte* data, std::size_t size)
{
  return libdeflate_crc32(0, data, size);
}

std::string unfinished::PartName(const std::string& fileName)
{
  return fileName + "." + std::to_string(::getpid()) + std::string(PartEnding);
}

std::string unfinished::LogName(const std::string& partName)
{
  return partName.substr(0, partName.size() - PartEnding.size()) + std::string(LogEnding);
}

unfinished::Part::~Part()
{
  ::close(this->Descriptor_);
}

void unfinished::Part::Remove() const
{
  ::unlink(this->Name_.c_str());
  ::unlink(LogName(this->Name_).c_str());
}

std::vector<std::unique_ptr<unfinished::Part>> unfinished::Find(const std::string& fileName)
{
  namespace fs = std::filesystem;
  std::vector<std::unique_ptr<Part>> parts;
  const fs::path path(fileName);
  const std::string begin = path.filename().string() + ".";
  const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error))
  {
    pid_t process = 0;
    const std::string name = entry->path().filename().string();
    if (IsPartOf(name, begin, LogEnding, process) && !Lives(process))
    {
      // Of one that was killed when its file had just got its name.
      const std::string log = entry->path().string();
      const std::string part =
        log.substr(0, log.size() - LogEnding.size()) + std::string(PartEnding);
      if (::access(part.c_str(), F_OK) != 0)
      {
        ::unlink(log.c_str());
      }
    }
    // The process has ended, and nobody on another machine that shares the folder holds the lock.
    if (!IsPartOf(name, begin, PartEnding, process) || Lives(process))
    {
      continue;
    }
    const int fd = ::open(entry->path().c_str(), O_RDWR | O_CLOEXEC | O_NOFOLLOW);
    if (fd < 0)
    {
      continue;
    }
    if (::flock(fd, LOCK_EX | LOCK_NB) != 0)
    {
      ::close(fd);
      continue;
    }
    parts.push_back(std::make_unique<Part>(entry->path().string(), fd));
  }
  return parts;
}

void unfinished::Keep(const std::string& partName)
{
  const std::string stem = partName.substr(0, partName.size() - PartEnding.size());
  for (int i = 1; i < 1000; ++i)
  {
    const std::string kept = stem + "-" + std::to_string(i) + std::string(PartEnding);
    if (::access(kept.c_str(), F_OK) != 0)
    {
      // The part first, which is still locked: a log without one is taken for what is left of an
      // end.
      if (std::rename(partName.c_str(), kept.c_str()) == 0)
      {
        static_cast<void>(std::rename(LogName(partName).c_str(), LogName(kept).c_str()));
      }
      return;
    }
  }
}

ConversionLog::~ConversionLog()
{
  if (this->File >= 0)
  {
    ::close(this->File);
  }
}

void ConversionLog::Create(const std::string& name, const std::string& task)
{
  this->File = ::open(name.c_str(), O_CREAT | O_TRUNC | O_WRONLY | O_CLOEXEC, 0666);
  const auto size = static_cast<std::uint32_t>(task.size());
  const std::uint32_t checksum =
    ChecksumOf(reinterpret_cast<const std::byte*>(task.data()), task.size());
  if (this->File >= 0 &&
    (task.size() > LargestTask || !WriteAll(this->File, LogMagic.data(), LogMagic.size()) ||
      !WriteAll(this->File, &size, sizeof(size)) ||
      !WriteAll(this->File, &checksum, sizeof(checksum)) ||
      !WriteAll(this->File, task.data(), task.size())))
  {
    ::close(this->File);
    this->File = -1;
  }
}

void ConversionLog::Add(const LoggedChunk& chunk)
{
  if (this->File < 0)
  {
    return;
  }
  Record record;
  record.Level = chunk.Level;
  record.Index = { chunk.Index[0], chunk.Index[1], chunk.Index[2] };
  record.Address = chunk.Address;
  record.Size = chunk.Size;
  record.FilterMask = chunk.FilterMask;
  record.Checksum = chunk.Checksum;
  record.OwnChecksum = OwnChecksum(record);
  if (!WriteAll(this->File, &record, sizeof(record)))
  {
    ::close(this->File);
    this->File = -1;
    return;
  }
  ++this->Chunks;
}

std::string ConversionLog::Task(
  const VoxelReader::Description& volume, const PyramidWriterOptions& options)
{
  std::string text = "input " + options.Source + "\nvoxels";
  const auto put = [&text](double number)
  {
    std::array<char, 40> digits{};
    std::snprintf(digits.data(), digits.size(), " %a", number); // exactly
    text += digits.data();
  };
  for (std::size_t a = 0; a < 3; ++a)
  {
    text +=
      " " + std::to_string(volume.Dimensions[a]) + " " + std::to_string(volume.ExtentStart[a]);
    put(volume.Spacing[a]);
    put(volume.Origin[a]);
  }
  std::for_each(volume.Direction.begin(), volume.Direction.end(), put);
  put(volume.FillValue);
  text += std::string(" ") + ToString(volume.Type) + " " + std::to_string(volume.Components) +
    (volume.CellData ? " cells " : " points ") + volume.ArrayName;
  text += "\nlayout " + std::to_string(PyramidFormat::Version) + " brick " +
    std::to_string(options.BrickSize) + " compression " +
    std::to_string(static_cast<int>(options.Compression)) + " level " +
    std::to_string(options.CompressionLevel) + " downsampling " +
    std::to_string(static_cast<int>(options.Downsampling)) + "\n";
  return text;
}

Result<std::unique_ptr<SavedChunks>> SavedChunks::Load(
  const std::string& fileName, const std::string& task)
{
  struct Loaded
  {
    std::unique_ptr<unfinished::Part> File;
    std::vector<LoggedChunk> Chunks;
  };
  std::vector<Loaded> all;
  bool others = false;
  for (std::unique_ptr<unfinished::Part>& part : unfinished::Find(fileName))
  {
    Loaded loaded;
    const std::string itsTask = ReadLog(unfinished::LogName(part->Name()), loaded.Chunks);
    if (itsTask.empty())
    {
      part->Remove(); // killed before it wrote anything down
      continue;
    }
    others = others || itsTask != task;
    loaded.File = std::move(part);
    std::sort(loaded.Chunks.begin(), loaded.Chunks.end(), OrderedBefore);
    all.push_back(std::move(loaded));
  }
  if (others)
  {
    return Status(StatusCode::InvalidArgument,
      "The conversion to '" + fileName +
        "' that was begun had another input, or other options; without --resume it is begun anew.");
  }
  std::sort(all.begin(), all.end(),
    [](const Loaded& a, const Loaded& b) { return a.Chunks.size() > b.Chunks.size(); });
  auto saved = std::make_unique<SavedChunks>();
  for (Loaded& loaded : all)
  {
    std::vector<LoggedChunk> both;
    both.reserve(saved->Chunks.size() + loaded.Chunks.size());
    const auto source = static_cast<std::uint32_t>(saved->Parts.size());
    for (LoggedChunk& chunk : loaded.Chunks)
    {
      chunk.Source = source;
    }
    std::set_union(saved->Chunks.begin(), saved->Chunks.end(), loaded.Chunks.begin(),
      loaded.Chunks.end(), std::back_inserter(both), OrderedBefore);
    if (both.size() == saved->Chunks.size())
    {
      loaded.File->Remove();
      continue;
    }
    saved->Chunks = std::move(both);
    saved->Parts.push_back(std::move(loaded.File));
  }
  return saved->Parts.empty() ? std::unique_ptr<SavedChunks>() : std::move(saved);
}

const LoggedChunk* SavedChunks::Find(int level, const Int3& index) const
{
  LoggedChunk wanted;
  wanted.Level = level;
  wanted.Index = index;
  const auto found =
    std::lower_bound(this->Chunks.begin(), this->Chunks.end(), wanted, OrderedBefore);
  return found == this->Chunks.end() || OrderedBefore(wanted, *found) ? nullptr : &*found;
}

bool SavedChunks::Read(const LoggedChunk& chunk, std::vector<std::byte>& bytes) const
{
  constexpr std::uint64_t largest = std::uint64_t{ 1 } << 31;
  if (chunk.Size > largest)
  {
    return false;
  }
  bytes.resize(static_cast<std::size_t>(chunk.Size));
  std::size_t done = 0;
  while (done < bytes.size())
  {
    const ssize_t n = ::pread(this->Parts[chunk.Source]->Descriptor(), bytes.data() + done,
      bytes.size() - done, static_cast<off_t>(chunk.Address + done));
    if (n < 0 && errno == EINTR)
    {
      continue;
    }
    if (n <= 0)
    {
      return false;
    }
    done += static_cast<std::size_t>(n);
  }
  return ChecksumOf(bytes.data(), bytes.size()) == chunk.Checksum;
}

void SavedChunks::Remove() const
{
  for (const auto& part : this->Parts)
  {
    part->Remove();
  }
}

} // namespace teravox
