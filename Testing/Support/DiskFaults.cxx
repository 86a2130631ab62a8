// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "DiskFaults.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <fcntl.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace teravox::test
{

namespace
{
// Plain memory: these functions are called before and after everything else lives.
std::array<char, 1024> File{};
std::atomic<bool> Armed{ false };
int Operations = 0;
DiskRule::Fault Kind = DiskRule::Fault::Error;
int Errno = 0;
int Milliseconds = 0;
std::int64_t Skip = 0;
std::int64_t Count = -1;
std::atomic<std::int64_t> Met{ 0 };
std::atomic<int> Stalled{ 0 };

void Sleep(int milliseconds)
{
  const timespec time{ milliseconds / 1000, (milliseconds % 1000) * 1000000L };
  ::nanosleep(&time, nullptr);
}

bool IsMeant(int operation, const char* name)
{
  return Armed.load() && (Operations & operation) != 0 && std::strstr(name, File.data()) != nullptr;
}

/// Returns true if the operation is to fail as Kind says; stalls are over then.
bool Fails()
{
  const std::int64_t index = Met.fetch_add(1);
  if (index < Skip || (Count >= 0 && index >= Skip + Count))
  {
    return false;
  }
  if (Kind != DiskRule::Fault::Stall)
  {
    return true;
  }
  ++Stalled;
  for (int waited = 0; Armed.load() && (Milliseconds == 0 || waited < Milliseconds); ++waited)
  {
    Sleep(1);
  }
  --Stalled;
  return false;
}

bool FailsOnDescriptor(int operation, int descriptor)
{
  if (!Armed.load() || (Operations & operation) == 0)
  {
    return false;
  }
  const int before = errno;
  std::array<char, 64> link{};
  std::snprintf(link.data(), link.size(), "/proc/self/fd/%d", descriptor);
  std::array<char, 1024> name{};
  const ssize_t length = ::readlink(link.data(), name.data(), name.size() - 1);
  const bool fails = length > 0 && IsMeant(operation, name.data()) && Fails();
  errno = before;
  return fails;
}

/// How many bytes to transfer instead of `count`; below 0: none, it is an error.
ssize_t Transfer(int operation, int descriptor, std::size_t count)
{
  const auto all = static_cast<ssize_t>(count);
  if (count == 0 || !FailsOnDescriptor(operation, descriptor))
  {
    return all;
  }
  if (Kind == DiskRule::Fault::Short)
  {
    return std::max<ssize_t>(all / 2, 1);
  }
  errno = Errno;
  return -1;
}

int OpenFile(const char* name, int flags, mode_t mode)
{
  const int operation =
    (flags & O_ACCMODE) == O_RDONLY ? int{ DiskRule::Open } : int{ DiskRule::OpenToWrite };
  if (IsMeant(operation, name) && Fails())
  {
    errno = Errno;
    return -1;
  }
  return static_cast<int>(::syscall(SYS_openat, AT_FDCWD, name, flags, mode));
}

struct FromEnvironment
{
  FromEnvironment()
  {
    const char* text = std::getenv("TERAVOX_DISK_FAULT");
    DiskRule rule;
    std::array<char, 512> name{};
    long long skip = 0;
    long long count = 0;
    if (text != nullptr &&
      std::sscanf(text, "%511[^:]:%d:%d:%lld:%lld", name.data(), &rule.Operations, &rule.Errno,
        &skip, &count) == 5)
    {
      rule.File = name.data();
      rule.Skip = skip;
      rule.Count = count;
      BeginDiskFaults(rule);
    }
  }
} const fromEnvironment; // NOLINT: reads a variable, throws nothing
} // namespace

void BeginDiskFaults(const DiskRule& rule)
{
  EndDiskFaults();
  std::snprintf(File.data(), File.size(), "%s", rule.File.c_str());
  Operations = rule.Operations;
  Kind = rule.Kind;
  Errno = rule.Errno;
  Milliseconds = rule.Milliseconds;
  Skip = rule.Skip;
  Count = rule.Count;
  Met = 0;
  Armed = true;
}

void EndDiskFaults()
{
  Armed = false;
  while (Stalled.load() > 0)
  {
    Sleep(1);
  }
}

std::int64_t DiskOperationsMet()
{
  return Met.load();
}

int DiskOperationsStalled()
{
  return Stalled.load();
}

} // namespace teravox::test

using teravox::test::DiskRule;

// The C library's own functions, seen by all libraries of the process.
#define FOR_ALL __attribute__((visibility("default")))
// A structure has the name of the function flock.
#pragma GCC diagnostic ignored "-Wshadow"
extern "C"
{
  FOR_ALL ssize_t pread(int descriptor, void* to, std::size_t count, off_t offset)
  {
    const ssize_t n = teravox::test::Transfer(DiskRule::Read, descriptor, count);
    return n < 0 ? n : ::syscall(SYS_pread64, descriptor, to, n, offset);
  }

  FOR_ALL ssize_t read(int descriptor, void* to, std::size_t count)
  {
    const ssize_t n = teravox::test::Transfer(DiskRule::Read, descriptor, count);
    return n < 0 ? n : ::syscall(SYS_read, descriptor, to, n);
  }

  FOR_ALL ssize_t pwrite(int descriptor, const void* from, std::size_t count, off_t offset)
  {
    const ssize_t n = teravox::test::Transfer(DiskRule::Write, descriptor, count);
    return n < 0 ? n : ::syscall(SYS_pwrite64, descriptor, from, n, offset);
  }

  FOR_ALL ssize_t write(int descriptor, const void* from, std::size_t count)
  {
    const ssize_t n = teravox::test::Transfer(DiskRule::Write, descriptor, count);
    return n < 0 ? n : ::syscall(SYS_write, descriptor, from, n);
  }

  FOR_ALL int fsync(int descriptor)
  {
    if (teravox::test::FailsOnDescriptor(DiskRule::Sync, descriptor))
    {
      errno = teravox::test::Errno;
      return -1;
    }
    return static_cast<int>(::syscall(SYS_fsync, descriptor));
  }

  FOR_ALL int flock(int descriptor, int operation)
  {
    if (teravox::test::FailsOnDescriptor(DiskRule::Lock, descriptor))
    {
      errno = teravox::test::Errno;
      return -1;
    }
    return static_cast<int>(::syscall(SYS_flock, descriptor, operation));
  }

  FOR_ALL int open(const char* name, int flags, ...)
  {
    mode_t mode = 0;
    if ((flags & O_CREAT) != 0)
    {
      std::va_list list;
      va_start(list, flags);
      mode = va_arg(list, mode_t);
      va_end(list);
    }
    return teravox::test::OpenFile(name, flags, mode);
  }
}
