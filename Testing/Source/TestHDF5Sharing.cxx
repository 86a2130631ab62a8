// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// Files that others have open too, and media that can't be written or locked.
#include "DiskFaults.h"
#include "TestPyramidSupport.h"

#include <cerrno>
#include <fcntl.h>
#include <fstream>
#include <hdf5.h>
#include <sys/file.h>
#include <sys/wait.h>

namespace teravox::testing
{
namespace
{

using test::BeginDiskFaults;
using test::DiskRule;
using test::EndDiskFaults;

std::string WritePyramid(const TemporaryFolder& folder)
{
  ArrayVoxelReader reader(Describe({ 40, 30, 20 }, ScalarType::UInt16));
  reader.GenerateMixed(7);
  PyramidWriterOptions options;
  options.BrickSize = 16;
  const auto report = PyramidWriter::Write(folder.File("shared.h5"), reader, options);
  EXPECT_TRUE(report.Ok()) << report.GetStatus().Message();
  return folder.File("shared.h5");
}

/// Level 0 of a file that has just been opened; empty if that isn't possible.
std::vector<std::byte> LevelZero(const std::string& file)
{
  HDF5OpenOptions options;
  options.BrickSize = 16;
  const auto source = HDF5BrickSource::Open(file, options);
  return source.Ok() ? ReadLevel(*source.Value(), 0) : std::vector<std::byte>();
}

/// Another process. Ends with success if `work` returns true.
pid_t Start(const std::function<bool()>& work)
{
  const pid_t child = ::fork();
  if (child == 0)
  {
    ::alarm(120);
    ::_exit(work() ? 0 : 1);
  }
  return child;
}

bool Succeeded(pid_t child)
{
  int status = 0;
  ::waitpid(child, &status, 0);
  return WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

TEST(HDF5Sharing, TwoProcessesReadOneFile)
{
  const TemporaryFolder folder;
  const std::string file = WritePyramid(folder);
  const std::vector<std::byte> whole = LevelZero(file);
  ASSERT_FALSE(whole.empty());
  const auto readOften = [&]
  {
    bool right = true;
    for (int i = 0; i < 20; ++i)
    {
      right = right && LevelZero(file) == whole;
    }
    return right;
  };
  const pid_t other = Start(readOften);
  EXPECT_TRUE(readOften());
  EXPECT_TRUE(Succeeded(other));
}

// The other process holds HDF5's lock on the file, adds datasets, and takes them away.
TEST(HDF5Sharing, OneReadsWhileAnotherWritesElsewhere)
{
  const TemporaryFolder folder;
  const std::string file = WritePyramid(folder);
  const std::vector<std::byte> whole = LevelZero(file);
  const std::string go = folder.File("go");
  const std::string begun = folder.File("begun");
  const std::string over = folder.File("over");
  const pid_t writer = Start(
    [&]
    {
      // It begins when the file is open in the other process, of which it has inherited nothing.
      while (!std::filesystem::exists(go))
      {
        ::usleep(1000);
      }
      H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
      const hid_t id = H5Fopen(file.c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
      bool good = id >= 0;
      std::vector<int> values(10000, 7);
      for (int i = 0; good && (i < 3 || !std::filesystem::exists(over)); ++i)
      {
        const hsize_t size = values.size();
        const hid_t space = H5Screate_simple(1, &size, nullptr);
        const std::string name = "elsewhere" + std::to_string(i);
        const hid_t data =
          H5Dcreate2(id, name.c_str(), H5T_STD_I32LE, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
        good = data >= 0 &&
          H5Dwrite(data, H5T_NATIVE_INT, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) >= 0 &&
          H5Fflush(id, H5F_SCOPE_GLOBAL) >= 0;
        H5Dclose(data);
        H5Sclose(space);
        std::ofstream(begun).flush();
      }
      H5Fclose(id);
      return good;
    });
  const auto source = OpenSource(file, 16);
  ASSERT_TRUE(source);
  std::ofstream(go).flush();
  while (!std::filesystem::exists(begun) && ::waitpid(writer, nullptr, WNOHANG) == 0)
  {
    ::usleep(1000);
  }
  ASSERT_TRUE(std::filesystem::exists(begun)) << "nobody writes";
  for (int i = 0; i < 20; ++i)
  {
    EXPECT_TRUE(ReadLevel(*source, 0) == whole);
    source->SetMemoryBudget(0); // what was read is forgotten
    source->SetMemoryBudget(16 << 20);
    // Opened in the middle of a change it may be an error, but never other voxels.
    const std::vector<std::byte> again = LevelZero(file);
    EXPECT_TRUE(again.empty() || again == whole);
  }
  std::ofstream(over).flush();
  EXPECT_TRUE(Succeeded(writer));
  EXPECT_TRUE(LevelZero(file) == whole);
}

// Whoever locks the file, and however file systems answer to locks: reading asks for none, writing
// goes on without.
TEST(HDF5Sharing, LocksAreNotNeeded)
{
  const TemporaryFolder folder;
  const std::string file = WritePyramid(folder);
  const std::vector<std::byte> whole = LevelZero(file);
  const int locked = ::open(file.c_str(), O_RDWR);
  ASSERT_EQ(::flock(locked, LOCK_EX | LOCK_NB), 0);
  EXPECT_TRUE(LevelZero(file) == whole);
  ::close(locked);
  for (const int error : { ENOLCK, ENOSYS, EOPNOTSUPP })
  {
    DiskRule rule;
    rule.File = "shared.h5";
    rule.Operations = DiskRule::Lock;
    rule.Errno = error;
    BeginDiskFaults(rule);
    EXPECT_TRUE(LevelZero(file) == whole);
    EXPECT_EQ(test::DiskOperationsMet(), 0);
    WritePyramid(folder);
    EXPECT_GT(test::DiskOperationsMet(), 0);
    EndDiskFaults();
    EXPECT_TRUE(LevelZero(file) == whole);
    EXPECT_EQ(folder.Count(), 1u);
  }
}

TEST(HDF5Sharing, MediaThatCannotBeWritten)
{
  const TemporaryFolder folder;
  const std::string file = WritePyramid(folder);
  const std::vector<std::byte> whole = LevelZero(file);
  DiskRule rule;
  rule.File = folder.Path();
  rule.Operations = DiskRule::OpenToWrite;
  rule.Errno = EROFS;
  BeginDiskFaults(rule);
  EXPECT_TRUE(LevelZero(file) == whole);
  EXPECT_EQ(test::DiskOperationsMet(), 0) << "nothing is opened for writing";
  ArrayVoxelReader reader(Describe({ 40, 30, 20 }, ScalarType::UInt16));
  const auto report = PyramidWriter::Write(folder.File("new.h5"), reader, {});
  EndDiskFaults();
  ASSERT_FALSE(report.Ok());
  EXPECT_NE(report.GetStatus().Message().find("new.h5"), std::string::npos);
  EXPECT_NE(report.GetStatus().Message().find("Read-only"), std::string::npos)
    << report.GetStatus().Message();
  EXPECT_EQ(folder.Count(), 1u);
}

} // namespace
} // namespace teravox::testing
