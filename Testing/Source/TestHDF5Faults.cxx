// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// Disks and memory that fail, at every place where they can: docs/faults.md.
#include "AllocationFaults.h"
#include "BrickLoader.h"
#include "DiskFaults.h"
#include "Import/ImageVolume.h"
#include "TestPyramidSupport.h"

#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <fstream>
#include <map>
#include <mutex>
#include <optional>
#include <sys/wait.h>
#include <thread>

#ifdef __SANITIZE_ADDRESS__
#include <sanitizer/lsan_interface.h>
#endif

namespace teravox::testing
{
namespace
{

// Blocks of its free lists (H5O_protect: H5FL_blk_malloc) that libhdf5 1.10.8 had in hand when a
// read of metadata failed it doesn't release; at the end it says "infinite loop closing library".
#ifdef __SANITIZE_ADDRESS__
using LibraryMayLeak = __lsan::ScopedDisabler;
#else
struct LibraryMayLeak
{
  LibraryMayLeak() {} // NOLINT: not trivial, else it is an unused variable
};
#endif

using test::BeginDiskFaults;
using test::DiskOperationsMet;
using test::DiskOperationsStalled;
using test::DiskRule;
using test::EndDiskFaults;

constexpr int BrickEdge = 16;

/// A pyramid of a few bricks and chunks per level.
std::string WritePyramid(const TemporaryFolder& folder, const std::string& name,
  PyramidCompression compression, unsigned seed = 7)
{
  ArrayVoxelReader reader(Describe({ 40, 30, 20 }, ScalarType::UInt16));
  reader.GenerateMixed(seed);
  PyramidWriterOptions options;
  options.BrickSize = BrickEdge;
  options.Compression = compression;
  const std::string file = folder.File(name);
  const auto report = PyramidWriter::Write(file, reader, options);
  EXPECT_TRUE(report.Ok()) << report.GetStatus().Message();
  return file;
}

std::vector<BrickKey> AllBricks(const BrickSource& source)
{
  std::vector<BrickKey> keys;
  const PyramidLayout& layout = source.Info().Layout;
  for (int l = 0; l < layout.NumberOfLevels(); ++l)
  {
    const Int3 n = layout.Bricks(l);
    for (std::int64_t i = 0; i < n[0] * n[1] * n[2]; ++i)
    {
      keys.push_back(BrickKey::Of(l, { i % n[0], i / n[0] % n[1], i / n[0] / n[1] }));
    }
  }
  return keys;
}

/// All that a source can be asked for; what failed is left out, with its message.
struct Content
{
  std::map<std::string, std::vector<std::byte>> Bricks;
  std::map<std::string, std::vector<ValueRange>> Ranges;
  std::vector<std::string> Errors;
};

Content ReadAll(BrickSource& source)
{
  Content content;
  for (const BrickKey& key : AllBricks(source))
  {
    const auto brick = source.ReadBrick(key);
    const auto ranges = source.ReadRanges(key, { 1, 1, 1 });
    if (brick.Ok())
    {
      content.Bricks[key.ToString()] = brick.Value()->Voxels;
    }
    if (ranges.Ok())
    {
      content.Ranges[key.ToString()] = ranges.Value();
    }
    for (const Status& status : { brick.GetStatus(), ranges.GetStatus() })
    {
      if (!status.Ok())
      {
        content.Errors.push_back(status.Message());
      }
    }
  }
  return content;
}

/// What could be read is right, bit for bit; what couldn't is explained.
void ExpectPartOf(const Content& content, const Content& whole, const std::string& file)
{
  for (const auto& [key, voxels] : content.Bricks)
  {
    ASSERT_TRUE(voxels == whole.Bricks.at(key)) << key;
  }
  for (const auto& [key, ranges] : content.Ranges)
  {
    const ValueRange& truth = whole.Ranges.at(key).front();
    const bool isWider = !ranges.front().IsKnown() ||
      (ranges.front().Min <= truth.Min && ranges.front().Max >= truth.Max);
    ASSERT_TRUE(isWider) << key << ": " << ranges.front().Min << "..." << ranges.front().Max
                         << " instead of " << truth.Min << "..." << truth.Max;
  }
  for (const std::string& error : content.Errors)
  {
    ASSERT_NE(error.find(file), std::string::npos) << error;
  }
}

bool IsWhole(const Content& content, const Content& whole)
{
  return content.Bricks == whole.Bricks && content.Ranges == whole.Ranges;
}

Result<std::shared_ptr<HDF5BrickSource>> Open(const std::string& file)
{
  HDF5OpenOptions options;
  options.BrickSize = BrickEdge;
  options.MemoryBudget = 16 << 20;
  return HDF5BrickSource::Open(file, options);
}

struct Faultless
{
  ~Faultless() { EndDiskFaults(); }
};

// The n-th read of the file fails or is short, for every n: what is delivered all the same is
// right, and the same source delivers everything when the fault has passed.
TEST(HDF5Faults, EveryReadMayFailOnce)
{
  const LibraryMayLeak mayLeak;
  const Faultless faultless;
  const TemporaryFolder folder;
  for (const PyramidCompression compression :
    { PyramidCompression::None, PyramidCompression::Deflate })
  {
    const std::string file = WritePyramid(folder, "read.h5", compression);
    const Content whole = ReadAll(*Open(file).Value());
    ASSERT_TRUE(whole.Errors.empty());
    for (const DiskRule::Fault kind : { DiskRule::Fault::Error, DiskRule::Fault::Short })
    {
      std::int64_t failed = 0;
      std::int64_t n = 0;
      for (bool met = true; met; ++n)
      {
        SCOPED_TRACE("read " + std::to_string(n));
        DiskRule rule;
        rule.File = "read.h5";
        rule.Kind = kind;
        rule.Errno = EIO;
        rule.Skip = n;
        rule.Count = 1;
        BeginDiskFaults(rule);
        const auto source = Open(file);
        std::optional<Content> content;
        if (source.Ok())
        {
          content = ReadAll(*source.Value());
        }
        met = DiskOperationsMet() > n;
        EndDiskFaults();
        if (!content)
        {
          ++failed;
          EXPECT_EQ(kind, DiskRule::Fault::Error);
          EXPECT_NE(source.GetStatus().Message().find(file), std::string::npos);
          EXPECT_TRUE(Open(file).Ok());
          continue;
        }
        failed += content->Errors.empty() ? 0 : 1;
        ASSERT_NO_FATAL_FAILURE(ExpectPartOf(*content, whole, file));
        EXPECT_TRUE(kind == DiskRule::Fault::Error || IsWhole(*content, whole));
        EXPECT_TRUE(IsWhole(ReadAll(*source.Value()), whole));
      }
      EXPECT_GT(n, 20);
      // Reads whose failure nobody notices are those that the library tries without need.
      EXPECT_GT(failed, kind == DiskRule::Fault::Error ? n / 2 : -1);
    }
  }
}

TEST(HDF5Faults, ReadsOfImagesMayFail)
{
  const Faultless faultless;
  const TemporaryFolder folder;
  const std::string header = "NDims = 3\nDimSize = 8 8 8\nElementType = MET_UCHAR\n";
  std::string voxels;
  std::string text;
  for (int i = 0; i < 512; ++i)
  {
    voxels += static_cast<char>(i * i % 251);
    text += std::to_string(i * i % 251) + " ";
  }
  std::ofstream(folder.File("plain.mha"), std::ios::binary) << header << "ElementDataFile = LOCAL\n"
                                                            << voxels;
  std::ofstream(folder.File("text.mha"), std::ios::binary)
    << header << "BinaryData = False\nElementDataFile = LOCAL\n"
    << text;
  for (const char* name : { "plain.mha", "text.mha" })
  {
    std::int64_t n = 0;
    for (bool met = true; met; ++n)
    {
      SCOPED_TRACE(name + std::string(", read ") + std::to_string(n));
      DiskRule rule;
      rule.File = name;
      rule.Errno = EIO;
      rule.Skip = n;
      rule.Count = 1;
      BeginDiskFaults(rule);
      ImageVolume::Request request;
      request.Name = folder.File(name);
      const auto image = ImageVolume::Open(request);
      std::string read(voxels.size(), '\0');
      const auto readAll = [&] {
        return image.Value().Reader->ReadBox({ 0, 0, 0 }, { 8, 8, 8 }, read.data());
      };
      const Status status = image.Ok() ? readAll() : image.GetStatus();
      met = DiskOperationsMet() > n;
      EndDiskFaults();
      ASSERT_EQ(status.Ok(), !met) << status.Message();
      EXPECT_TRUE(status.Ok() || status.Message().find(request.Name) != std::string::npos);
      EXPECT_TRUE(!image.Ok() || (readAll().Ok() && read == voxels));
    }
    EXPECT_GT(n, 2);
  }
}

TEST(HDF5Faults, AFileThatCannotBeOpenedIsNamed)
{
  const Faultless faultless;
  const TemporaryFolder folder;
  const std::string file = WritePyramid(folder, "open.h5", PyramidCompression::LZ4);
  for (const int error : { EIO, EMFILE, EACCES, ESTALE })
  {
    DiskRule rule;
    rule.File = "open.h5";
    rule.Operations = DiskRule::Open;
    rule.Errno = error;
    BeginDiskFaults(rule);
    const auto source = Open(file);
    EndDiskFaults();
    ASSERT_FALSE(source.Ok());
    EXPECT_NE(source.GetStatus().Message().find("open.h5"), std::string::npos);
    EXPECT_TRUE(Open(file).Ok());
  }
}

// What the file has lost isn't drawn as zeros; when it is whole again, so is what is read.
TEST(HDF5Faults, TruncatedWhileOpen)
{
  const TemporaryFolder folder;
  for (const PyramidCompression compression : { PyramidCompression::None, PyramidCompression::LZ4 })
  {
    const std::string file = WritePyramid(folder, "cut.h5", compression);
    const Content whole = ReadAll(*Open(file).Value());
    const auto size = std::filesystem::file_size(file);
    std::ifstream in(file, std::ios::binary);
    const std::string bytes((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
    for (int part = 0; part < 8; ++part)
    {
      {
        const auto source = Open(file);
        ASSERT_TRUE(source.Ok());
        std::filesystem::resize_file(file, size * static_cast<unsigned>(part) / 8);
        const Content cut = ReadAll(*source.Value());
        EXPECT_FALSE(cut.Errors.empty());
        ASSERT_NO_FATAL_FAILURE(ExpectPartOf(cut, whole, file)) << part << "/8";
        std::ofstream(file, std::ios::binary) << bytes; // the same inode
        const Content mended = ReadAll(*source.Value());
        // What the library has taken in of its own structures meanwhile may stay damaged, and is
        // shared by all that have the file open.
        ASSERT_NO_FATAL_FAILURE(ExpectPartOf(mended, whole, file)) << part << "/8";
      }
      EXPECT_TRUE(IsWhole(ReadAll(*Open(file).Value()), whole));
    }
  }
}

TEST(HDF5Faults, ReplacedWhileOpen)
{
  const TemporaryFolder folder;
  const std::string file = WritePyramid(folder, "one.h5", PyramidCompression::LZ4, 1);
  const std::string other = WritePyramid(folder, "two.h5", PyramidCompression::LZ4, 2);
  const Content one = ReadAll(*Open(file).Value());
  const Content two = ReadAll(*Open(other).Value());
  ASSERT_FALSE(IsWhole(one, two));
  const auto source = Open(file);
  ASSERT_TRUE(source.Ok());
  std::filesystem::rename(other, file);
  EXPECT_TRUE(IsWhole(ReadAll(*source.Value()), one)) << "what was opened is still there";
  EXPECT_TRUE(IsWhole(ReadAll(*Open(file).Value()), two));
}

TEST(HDF5Faults, AStallIsWaitedForAndAlters)
{
  const Faultless faultless;
  const TemporaryFolder folder;
  const std::string file = WritePyramid(folder, "stall.h5", PyramidCompression::LZ4);
  const Content whole = ReadAll(*Open(file).Value());
  const auto source = Open(file);
  DiskRule rule;
  rule.File = "stall.h5";
  rule.Kind = DiskRule::Fault::Stall;
  rule.Milliseconds = 2000;
  rule.Skip = 3;
  rule.Count = 1;
  BeginDiskFaults(rule);
  EXPECT_TRUE(IsWhole(ReadAll(*source.Value()), whole));
  EXPECT_GT(DiskOperationsMet(), 4);
}

// Each write, then each fsync: an error that names the file, and nothing is left of it.
TEST(HDF5Faults, EveryWriteMayFail)
{
  const Faultless faultless;
  const TemporaryFolder folder;
  ArrayVoxelReader reader(Describe({ 40, 30, 20 }, ScalarType::UInt16));
  reader.GenerateMixed(7);
  PyramidWriterOptions options;
  options.BrickSize = BrickEdge;
  const std::string file = folder.File("write.h5");
  for (const int operation : { int{ DiskRule::Write }, int{ DiskRule::Sync } })
  {
    std::int64_t n = 0;
    for (bool met = true; met; ++n)
    {
      SCOPED_TRACE("operation " + std::to_string(n));
      DiskRule rule;
      rule.File = "write.h5";
      rule.Operations = operation;
      rule.Errno = operation == DiskRule::Write ? ENOSPC : EIO;
      rule.Skip = n;
      BeginDiskFaults(rule);
      const auto report = PyramidWriter::Write(file, reader, options);
      met = DiskOperationsMet() > n;
      EndDiskFaults();
      ASSERT_EQ(report.Ok(), !met);
      if (met)
      {
        EXPECT_NE(report.GetStatus().Message().find("write.h5"), std::string::npos);
        EXPECT_EQ(folder.Count(), 0u);
      }
    }
    EXPECT_GT(n, 1);
    EXPECT_EQ(folder.Count(), 1u);
    EXPECT_TRUE(Open(file).Ok());
    std::filesystem::remove(file);
  }
}

// The n-th allocation fails, for every n: of opening, and of each brick and range.
TEST(HDF5Faults, EveryAllocationMayFail)
{
  const TemporaryFolder folder;
  for (const PyramidCompression compression :
    { PyramidCompression::Deflate, PyramidCompression::LZ4 })
  {
    const std::string file = WritePyramid(folder, "memory.h5", compression);
    const Content whole = ReadAll(*Open(file).Value());
    std::int64_t n = 0;
    for (bool met = true; met; ++n)
    {
      test::FailAllocationAfter(n);
      const auto source = Open(file);
      met = test::EndAllocationFault();
      ASSERT_TRUE(met || source.Ok());
      ASSERT_TRUE(source.Ok() || source.GetStatus().Code() == StatusCode::ResourceExhausted)
        << "allocation " << n << ": " << source.GetStatus().Message();
    }
    EXPECT_GT(n, 100);
    std::int64_t failures = 0;
    for (const BrickKey& key : { BrickKey::Of(0, { 1, 1, 0 }), BrickKey::Of(1, { 0, 0, 0 }) })
    {
      for (const bool ranges : { false, true })
      {
        bool met = true;
        for (n = 0; met; ++n)
        {
          SCOPED_TRACE(key.ToString() + ", allocation " + std::to_string(n));
          const auto source = Open(file).Value();
          test::FailAllocationAfter(n);
          const Status status = ranges ? source->ReadRanges(key, { 1, 1, 1 }).GetStatus()
                                       : source->ReadBrick(key).GetStatus();
          met = test::EndAllocationFault();
          failures += status.Ok() ? 0 : 1;
          ASSERT_TRUE(met || status.Ok());
          ASSERT_TRUE(status.Ok() || status.Code() == StatusCode::ResourceExhausted)
            << status.Message();
          ASSERT_TRUE(IsWhole(ReadAll(*source), whole));
        }
      }
    }
    EXPECT_GT(failures, 20);
  }
}

// The loader's threads have no memory now and then, for whatever they need it: all bricks arrive as
// long as they are asked for.
TEST(HDF5Faults, TheLoaderSurvivesWithoutMemory)
{
  const TemporaryFolder folder;
  const std::string file = WritePyramid(folder, "loader.h5", PyramidCompression::Deflate);
  const std::shared_ptr<BrickSource> source = Open(file).Value();
  const Content whole = ReadAll(*source);
  for (const std::uint64_t period : { 2, 7, 50 })
  {
    const auto cache = std::make_shared<BrickCache>(16 << 20);
    BrickLoader loader(cache, 3);
    loader.SetSource(0, source);
    std::map<std::string, std::vector<std::byte>> arrived;
    const auto ask = [&]
    {
      std::vector<LoadRequest> wishes;
      for (const BrickKey& key : AllBricks(*source))
      {
        if (arrived.count(key.ToString()) == 0)
        {
          wishes.push_back({ key, 1 });
        }
      }
      loader.Request(wishes);
      loader.WaitFinished(1);
      for (const LoadResult& result : loader.TakeFinished())
      {
        if (result.Outcome.Ok())
        {
          arrived[result.Key.ToString()] = result.Brick->Voxels;
        }
        else
        {
          EXPECT_EQ(result.Outcome.Code(), StatusCode::ResourceExhausted)
            << result.Outcome.Message();
        }
      }
    };
    test::FailAllocationsOfOthers(period);
    for (int i = 0; i < 10; ++i)
    {
      ask();
    }
    test::FailAllocationsOfOthers(0);
    for (int i = 0; i < 1000 && arrived.size() < whole.Bricks.size(); ++i)
    {
      ask();
    }
    EXPECT_TRUE(arrived == whole.Bricks) << "every allocation in " << period << " failed";
    EXPECT_EQ(cache->GetCounters().BytesReserved, 0u);
  }
}

} // namespace
} // namespace teravox::testing
