// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "HDF5OutputDriver.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <iterator>
#include <limits>
#include <new>
#include <sys/types.h>
#include <unistd.h>

namespace teravox
{

namespace
{
constexpr haddr_t WritebackStep = haddr_t{ 8 } << 20;

/// HDF5 sees the first member only.
struct OutputFile
{
  H5FD_t Base{};
  int Descriptor = -1;
  haddr_t EndOfAddresses = 0;
  haddr_t EndOfFile = 0;
  haddr_t Started = 0; // up to here the disk was told to begin
  HDF5OutputState* State = nullptr;
};

OutputFile& Of(H5FD_t* file)
{
  return *reinterpret_cast<OutputFile*>(file);
}

const OutputFile& Of(const H5FD_t* file)
{
  return *reinterpret_cast<const OutputFile*>(file);
}

H5FD_t* OpenFile(const char* name, unsigned flags, hid_t access, haddr_t)
{
  const auto* state = static_cast<HDF5OutputState* const*>(H5Pget_driver_info(access));
  if (state == nullptr || (flags & H5F_ACC_RDWR) == 0)
  {
    return nullptr;
  }
  const int truncate = (flags & H5F_ACC_TRUNC) != 0 ? O_TRUNC : 0;
  const int create = (flags & H5F_ACC_CREAT) != 0 ? O_CREAT : 0;
  auto* file = new (std::nothrow) OutputFile();
  if (file == nullptr)
  {
    return nullptr;
  }
  file->State = *state;
  file->Descriptor = ::open(name, O_RDWR | O_CLOEXEC | truncate | create, 0666);
  const off_t size = file->Descriptor < 0 ? -1 : ::lseek(file->Descriptor, 0, SEEK_END);
  if (size < 0)
  {
    delete file;
    return nullptr;
  }
  file->EndOfFile = static_cast<haddr_t>(size);
  return &file->Base;
}

herr_t CloseFile(H5FD_t* base)
{
  OutputFile* file = &Of(base);
  if (::close(file->Descriptor) != 0 && file->State->Error == 0)
  {
    file->State->Error = errno;
  }
  delete file;
  return 0;
}

int CompareFiles(const H5FD_t* a, const H5FD_t* b)
{
  return Of(a).Descriptor - Of(b).Descriptor;
}

herr_t QueryFeatures(const H5FD_t*, unsigned long* flags)
{
  *flags = H5FD_FEAT_AGGREGATE_METADATA | H5FD_FEAT_ACCUMULATE_METADATA | H5FD_FEAT_DATA_SIEVE |
    H5FD_FEAT_AGGREGATE_SMALLDATA;
  return 0;
}

haddr_t GetEndOfAddresses(const H5FD_t* file, H5FD_mem_t)
{
  return Of(file).EndOfAddresses;
}

herr_t SetEndOfAddresses(H5FD_t* file, H5FD_mem_t, haddr_t address)
{
  Of(file).EndOfAddresses = address;
  return 0;
}

haddr_t GetEndOfFile(const H5FD_t* file, H5FD_mem_t)
{
  return Of(file).EndOfFile;
}

herr_t ReadFile(H5FD_t* base, H5FD_mem_t, hid_t, haddr_t address, std::size_t size, void* buffer)
{
  const OutputFile& file = Of(base);
  auto* to = static_cast<char*>(buffer);
  while (size > 0)
  {
    const ssize_t n = ::pread(file.Descriptor, to, size, static_cast<off_t>(address));
    if (n < 0 && errno == EINTR)
    {
      continue;
    }
    if (n < 0)
    {
      return -1;
    }
    if (n == 0)
    {
      std::memset(to, 0, size); // beyond the end, as HDF5 expects
      return 0;
    }
    to += n;
    address += static_cast<haddr_t>(n);
    size -= static_cast<std::size_t>(n);
  }
  return 0;
}

/// Lets the disk begin with what is complete, while the next chunks are compressed: the fsync at
/// the end would otherwise find all of the file still to be written.
void StartWriteback(OutputFile& file)
{
#ifdef SYNC_FILE_RANGE_WRITE
  if (file.EndOfFile >= file.Started + WritebackStep && file.State->Error == 0)
  {
    // A hint: what it can't do, fsync does.
    static_cast<void>(::sync_file_range(file.Descriptor, static_cast<off_t>(file.Started),
      static_cast<off_t>(file.EndOfFile - file.Started), SYNC_FILE_RANGE_WRITE));
    file.Started = file.EndOfFile;
  }
#else
  static_cast<void>(file);
#endif
}

herr_t WriteFile(
  H5FD_t* base, H5FD_mem_t kind, hid_t, haddr_t address, std::size_t size, const void* buffer)
{
  OutputFile& file = Of(base);
  if (kind == H5FD_MEM_DRAW)
  {
    file.State->RawAddress = address;
    file.State->RawSize = size;
  }
  const haddr_t end = address + size;
  const auto* from = static_cast<const char*>(buffer);
  while (size > 0 && file.State->Error == 0 && !file.State->Discard)
  {
    const ssize_t n = ::pwrite(file.Descriptor, from, size, static_cast<off_t>(address));
    if (n < 0 && errno == EINTR)
    {
      continue;
    }
    if (n <= 0)
    {
      file.State->Error = n < 0 ? errno : ENOSPC;
      break;
    }
    from += n;
    address += static_cast<haddr_t>(n);
    size -= static_cast<std::size_t>(n);
  }
  file.EndOfFile = std::max(file.EndOfFile, end);
  StartWriteback(file);
  return 0;
}

herr_t TruncateFile(H5FD_t* base, hid_t, hbool_t)
{
  OutputFile& file = Of(base);
  if (file.EndOfAddresses != file.EndOfFile && file.State->Error == 0 && !file.State->Discard &&
    ::ftruncate(file.Descriptor, static_cast<off_t>(file.EndOfAddresses)) != 0)
  {
    file.State->Error = errno;
  }
  file.EndOfFile = file.EndOfAddresses;
  return 0;
}

hid_t Driver()
{
  static const hid_t id = []
  {
    H5FD_class_t driver{};
    driver.name = "teravox-output";
    driver.maxaddr = static_cast<haddr_t>(std::numeric_limits<off_t>::max());
    driver.fc_degree = H5F_CLOSE_WEAK;
    driver.fapl_size = sizeof(HDF5OutputState*); // NOLINT(bugprone-sizeof-expression): a pointer
    driver.open = OpenFile;
    driver.close = CloseFile;
    driver.cmp = CompareFiles;
    driver.query = QueryFeatures;
    driver.get_eoa = GetEndOfAddresses;
    driver.set_eoa = SetEndOfAddresses;
    driver.get_eof = GetEndOfFile;
    driver.read = ReadFile;
    driver.write = WriteFile;
    driver.truncate = TruncateFile;
    const H5FD_mem_t map[H5FD_MEM_NTYPES] = H5FD_FLMAP_DICHOTOMY;
    std::copy(std::begin(map), std::end(map), std::begin(driver.fl_map));
    // The library copies the class on newer versions and keeps the pointer on older ones.
    static H5FD_class_t kept{};
    kept = driver;
    return H5FDregister(&kept);
  }();
  return id;
}
} // namespace

HDF5Handle HDF5OutputDriver::MakeAccess(HDF5OutputState& state)
{
  HDF5Handle access(H5Pcreate(H5P_FILE_ACCESS));
  HDF5OutputState* const pointer = &state;
  if (!access.Valid() || Driver() < 0 || H5Pset_driver(access.Get(), Driver(), &pointer) < 0)
  {
    access.Reset();
  }
  return access;
}

} // namespace teravox
