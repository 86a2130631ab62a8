// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "CornersReader.h"
#include "TestPyramidSupport.h"

#include <atomic>
#include <cstdlib>
#include <fstream>
#include <thread>

namespace teravox::testing
{

namespace
{
constexpr Int3 SmallVolume{ 13, 11, 9 };

Status OpenStatus(const std::string& file, const std::string& dataset = std::string())
{
  HDF5OpenOptions options;
  options.DatasetPath = dataset;
  return HDF5BrickSource::Open(file, options).GetStatus();
}

// Expects a failure whose message names the file and holds the text.
void ExpectFailure(
  const Status& status, StatusCode code, const std::string& file, const std::string& text)
{
  EXPECT_EQ(status.Code(), code) << status.Message();
  EXPECT_NE(status.Message().find(file), std::string::npos) << status.Message();
  EXPECT_NE(status.Message().find(text), std::string::npos) << status.Message();
}

std::string WriteMixed(const TemporaryFolder& folder, const Int3& dimensions,
  PyramidCompression compression, ArrayVoxelReader& reader)
{
  static_cast<void>(dimensions);
  reader.GenerateMixed(17);
  PyramidWriterOptions options;
  options.BrickSize = 16;
  options.Compression = compression;
  const std::string file = folder.File("volume.h5");
  const auto report = PyramidWriter::Write(file, reader, options);
  EXPECT_TRUE(report.Ok()) << report.GetStatus().Message();
  return file;
}
} // namespace

/// Files made by h5py.
class HDF5ForeignFiles : public ::testing::Test
{
protected:
  static void SetUpTestSuite()
  {
#ifdef TERAVOX_PYTHON
    Folder = new TemporaryFolder();
    const std::string command = std::string("'") + TERAVOX_PYTHON + "' '" + TERAVOX_TEST_SCRIPTS +
      "/make_hdf5_files.py' '" + Folder->Path() + "'";
    Made = std::system(command.c_str()) == 0; // NOLINT(cert-env33-c)
#endif
  }
  static void TearDownTestSuite()
  {
    delete Folder;
    Folder = nullptr;
  }
  void SetUp() override
  {
    if (!Made)
    {
      GTEST_SKIP() << "Python with h5py is needed to make the files";
    }
  }
  static std::string File(const std::string& name)
  {
    return Folder->File(name + ".h5");
  }

  static inline TemporaryFolder* Folder = nullptr;
  static inline bool Made = false;
};

TEST_F(HDF5ForeignFiles, ReadsEveryStorageAndFilter)
{
  for (const char* name :
    { "contiguous", "chunked", "gzip", "gzip_shuffle_fletcher", "big_endian", "big_endian_float",
      "scale_offset", "lzf", "one_chunk", "components", "split_components", "flat" })
  {
    SCOPED_TRACE(name);
    HDF5OpenOptions options;
    options.DatasetPath = "v";
    options.BrickSize = 5;
    const auto opened = HDF5BrickSource::Open(File(name), options);
    ASSERT_TRUE(opened.Ok()) << opened.GetStatus().Message();
    HDF5BrickSource& source = *opened.Value();
    const Int3 d = source.Info().Layout.Dimensions(0);
    const int components = source.Info().Components;
    EXPECT_EQ(d, (Int3{ 13, 11, std::string(name) == "flat" ? 1 : 9 }));
    const std::vector<std::byte> level = ReadLevel(source, 0);
    for (std::size_t i = 0; i < level.size() / SizeOf(source.Info().Type); ++i)
    {
      const auto voxel = static_cast<std::int64_t>(i) / components;
      const double truth = static_cast<double>(voxel % 13 + 10 * (voxel / 13 % 11) +
        100 * (voxel / 143) + static_cast<std::int64_t>(i) % components);
      ASSERT_EQ(ValueAt(level.data(), source.Info().Type, i), truth) << "value " << i;
    }
    EXPECT_GT(source.BytesRead(), 0u);
    const auto ranges = source.ReadRanges(BrickKey(), { 2, 1, 1 });
    ASSERT_TRUE(ranges.Ok());
    EXPECT_EQ(ranges.Value()[0], ValueRange::Unknown());
  }
}

TEST_F(HDF5ForeignFiles, ReadsTheImageOfAStockVTKHDFFile)
{
  const auto source = OpenSource(File("image"));
  ASSERT_TRUE(source);
  EXPECT_EQ(source->Info().Layout.Dimensions(0), SmallVolume);
  EXPECT_EQ(source->Info().Origin, (Double3{ 2.5, 2, 3 }));
  EXPECT_EQ(source->Info().ExtentStart, (Int3{ 3, 0, 0 }));
  EXPECT_EQ(source->Info().ArrayName, "v");
}

TEST_F(HDF5ForeignFiles, NamesWhatIsWrong)
{
  ExpectFailure(
    OpenStatus(File("compound"), "/v"), StatusCode::Unsupported, File("compound"), "compound");
  ExpectFailure(
    OpenStatus(File("string"), "/v"), StatusCode::Unsupported, File("string"), "string");
  ExpectFailure(
    OpenStatus(File("float16"), "/v"), StatusCode::Unsupported, File("float16"), "16 bits");
  ExpectFailure(OpenStatus(File("rank1"), "/v"), StatusCode::Unsupported, File("rank1"), "1 axes");
  ExpectFailure(OpenStatus(File("zero"), "/v"), StatusCode::Corrupt, File("zero"), "zero");
  ExpectFailure(OpenStatus(File("huge"), "/v"), StatusCode::Unsupported, File("huge"), "2^31");
  ExpectFailure(OpenStatus(File("unknown_filter"), "/v"), StatusCode::Unsupported,
    File("unknown_filter"), "32013 (ZFP) isn't installed; install");
  ExpectFailure(OpenStatus(File("empty")), StatusCode::NotFound, File("empty"), "no volume");
  ExpectFailure(OpenStatus(File("empty"), "/v"), StatusCode::NotFound, File("empty"), "'/v'");
  ExpectFailure(
    OpenStatus(File("empty"), "/nothing"), StatusCode::NotFound, File("empty"), "no volume");
  ExpectFailure(
    OpenStatus(File("empty"), "/a/b/c"), StatusCode::NotFound, File("empty"), "'/a/b/c'");
  ExpectFailure(
    OpenStatus(File("negative_spacing")), StatusCode::Corrupt, File("negative_spacing"), "spacing");
  ExpectFailure(OpenStatus(File("singular")), StatusCode::Corrupt, File("singular"), "singular");
  ExpectFailure(
    OpenStatus(File("unfinished")), StatusCode::Corrupt, File("unfinished"), "interrupted");
}

TEST_F(HDF5ForeignFiles, ChunkBeyondTheBudgetIsAnErrorWithNumbers)
{
  HDF5OpenOptions options;
  options.DatasetPath = "v";
  options.BrickSize = 5;
  options.MemoryBudget = 1000;
  const auto opened = HDF5BrickSource::Open(File("one_chunk"), options);
  ASSERT_TRUE(opened.Ok());
  auto brick = opened.Value()->ReadBrick(BrickKey());
  ExpectFailure(brick.GetStatus(), StatusCode::ResourceExhausted, File("one_chunk"), "1000 bytes");
  // When the fault has passed, the same brick can be read.
  opened.Value()->SetMemoryBudget(1 << 20);
  brick = opened.Value()->ReadBrick(BrickKey());
  EXPECT_TRUE(brick.Ok()) << brick.GetStatus().Message();
}

TEST(HDF5BrickSource, MissingAndForeignFilesAreNamed)
{
  const TemporaryFolder folder;
  ExpectFailure(OpenStatus(folder.File("no.h5")), StatusCode::NotFound, "no.h5", "doesn't exist");
  ExpectFailure(OpenStatus(folder.Path()), StatusCode::InputOutput, folder.Path(), "folder");
  std::ofstream(folder.File("text.h5")) << "This is not HDF5.";
  ExpectFailure(
    OpenStatus(folder.File("text.h5")), StatusCode::Corrupt, "text.h5", "isn't an HDF5");
  std::ofstream(folder.File("empty.h5")).flush();
  ExpectFailure(
    OpenStatus(folder.File("empty.h5")), StatusCode::Corrupt, "empty.h5", "isn't an HDF5");
}

TEST(HDF5BrickSource, TruncatedFilesFailWithoutCrashing)
{
  const TemporaryFolder folder;
  ArrayVoxelReader reader(Describe({ 50, 40, 30 }, ScalarType::UInt16));
  const std::string file = WriteMixed(folder, {}, PyramidCompression::LZ4, reader);
  const auto size = std::filesystem::file_size(file);
  for (const double part : { 0.0, 0.001, 0.01, 0.1, 0.3, 0.5, 0.9, 0.999 })
  {
    const std::string cut = folder.File("cut.h5");
    std::filesystem::copy_file(file, cut, std::filesystem::copy_options::overwrite_existing);
    std::filesystem::resize_file(
      cut, static_cast<std::uintmax_t>(part * static_cast<double>(size)));
    ExpectFailure(OpenStatus(cut), StatusCode::Corrupt, "cut.h5", "HDF5");
  }
}

// Whatever is overwritten: a status or right-sized bricks, never a crash.
TEST(HDF5BrickSource, DamagedFilesNeverCrash)
{
  const TemporaryFolder folder;
  ArrayVoxelReader reader(Describe({ 50, 40, 30 }, ScalarType::UInt16));
  for (const PyramidCompression compression :
    { PyramidCompression::LZ4, PyramidCompression::Deflate })
  {
    const std::string file = WriteMixed(folder, {}, compression, reader);
    std::ifstream in(file, std::ios::binary);
    const std::string whole((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
    std::mt19937 random(23);
    int failures = 0;
    for (int trial = 0; trial < 60; ++trial)
    {
      // The library's own metadata lie at the start; damage there is its own affair.
      std::string damaged = whole;
      const std::size_t at = damaged.size() / 2 + random() % (damaged.size() / 2 - 300);
      for (std::size_t i = 0; i < 200; ++i)
      {
        damaged[at + i] = static_cast<char>(random());
      }
      const std::string name = folder.File("damaged.h5");
      std::ofstream(name, std::ios::binary) << damaged;
      const auto opened = HDF5BrickSource::Open(name, HDF5OpenOptions());
      if (!opened.Ok())
      {
        ++failures;
        continue;
      }
      for (int l = 0; l < opened.Value()->Info().Layout.NumberOfLevels(); ++l)
      {
        BrickKey key;
        key.Level = static_cast<std::uint8_t>(l);
        const auto brick = opened.Value()->ReadBrick(key);
        if (!brick.Ok())
        {
          ++failures;
          EXPECT_NE(brick.GetStatus().Message().find("damaged.h5"), std::string::npos);
          EXPECT_NE(
            brick.GetStatus().Message().find("level " + std::to_string(l)), std::string::npos);
        }
        static_cast<void>(opened.Value()->ReadRanges(key, { 1, 1, 1 }));
      }
    }
    EXPECT_GT(failures, 3); // else nothing was tested
  }
}

TEST(HDF5BrickSource, RefusesKeysThatDontExist)
{
  const TemporaryFolder folder;
  ArrayVoxelReader reader(Describe({ 50, 40, 30 }, ScalarType::UInt16));
  const auto source = OpenSource(WriteMixed(folder, {}, PyramidCompression::LZ4, reader), 16);
  BrickKey key;
  key.X = 4;
  EXPECT_EQ(source->ReadBrick(key).GetStatus().Code(), StatusCode::InvalidArgument);
  key.X = 0;
  key.Level = 9;
  EXPECT_EQ(source->ReadBrick(key).GetStatus().Code(), StatusCode::InvalidArgument);
  key.Level = 0;
  key.Time = 1;
  EXPECT_EQ(source->ReadBrick(key).GetStatus().Code(), StatusCode::InvalidArgument);
  key.Time = 0;
  key.PageLevel = 1;
  EXPECT_EQ(source->ReadBrick(key).GetStatus().Code(), StatusCode::InvalidArgument);
  EXPECT_FALSE(source->ReadRanges(BrickKey(), { -1, 1, 1 }).Ok());
  key.X = key.Y = key.Z = 0xffffffffu;
  key.PageLevel = 15;
  const auto far = source->ReadRanges(key, { 1, 1, 1 });
  ASSERT_TRUE(far.Ok());
  EXPECT_TRUE(far.Value()[0].IsVoid());
}

TEST(HDF5BrickSource, ThreadsAndBudgetsChangeNoVoxel)
{
  const TemporaryFolder folder;
  ArrayVoxelReader reader(Describe({ 130, 90, 70 }, ScalarType::UInt16));
  const std::string file = WriteMixed(folder, {}, PyramidCompression::Deflate, reader);
  // The smallest budget has room for few chunks of 8 KiB, so that threads must wait for each other.
  for (const std::uint64_t budget : { std::uint64_t{ 40000 }, std::uint64_t{ 1 } << 28 })
  {
    const auto source = OpenSource(file, 24, budget);
    const Int3 n = source->Info().Layout.Bricks(0);
    std::vector<BrickKey> keys;
    for (int repeat = 0; repeat < 2; ++repeat)
    {
      for (std::int64_t i = 0; i < n[0] * n[1] * n[2]; ++i)
      {
        BrickKey key;
        key.X = static_cast<std::uint32_t>(i % n[0]);
        key.Y = static_cast<std::uint32_t>(i / n[0] % n[1]);
        key.Z = static_cast<std::uint32_t>(i / (n[0] * n[1]));
        keys.push_back(key);
      }
    }
    std::shuffle(keys.begin(), keys.end(), std::mt19937(5));
    std::vector<BrickPointer> bricks(keys.size());
    std::atomic<std::size_t> next{ 0 };
    std::atomic<std::uint64_t> most{ 0 };
    std::vector<std::thread> threads;
    for (int t = 0; t < 4; ++t)
    {
      threads.emplace_back(
        [&]
        {
          for (std::size_t i = next++; i < keys.size(); i = next++)
          {
            const auto brick = source->ReadBrick(keys[i]);
            bricks[i] = brick.Ok() ? brick.Value() : nullptr;
            const std::uint64_t used = source->MemoryUsed();
            for (std::uint64_t m = most; m < used && !most.compare_exchange_weak(m, used);)
            {
            }
          }
        });
    }
    for (std::thread& thread : threads)
    {
      thread.join();
    }
    EXPECT_LE(most, budget);
    for (std::size_t i = 0; i < keys.size(); ++i)
    {
      ASSERT_TRUE(bricks[i]) << keys[i].ToString();
      ExpectBrickEquals(source->Info(), keys[i], *bricks[i], reader.Voxels);
    }
    if (budget > 1000000)
    {
      // Each chunk was read once, though each is part of many bricks.
      EXPECT_LT(source->BytesRead(), std::filesystem::file_size(file));
    }
    source->SetMemoryBudget(0);
    EXPECT_EQ(source->MemoryUsed(), 0u);
  }
}

TEST(HDF5BrickSource, SparseTebibyteCostsNothing)
{
  // 1 TiB of u16 with data in two opposite corners only.
  const TemporaryFolder folder;
  test::CornersReader reader(Describe({ 8192, 8192, 8192 }, ScalarType::UInt16), 100,
    [](bool, std::int64_t x, std::int64_t y, std::int64_t z)
    { return static_cast<int>(1 + (x * 3 + y * 5 + z * 7) % 1000); });
  const std::string file = folder.File("sparse.h5");
  PyramidWriterOptions options;
  options.MemoryLimit = 128 << 20;
  const auto report = PyramidWriter::Write(file, reader, options);
  ASSERT_TRUE(report.Ok()) << report.GetStatus().Message();
  EXPECT_EQ(report.Value().VoxelBytes, std::uint64_t{ 1 } << 40);
  EXPECT_LT(report.Value().VoxelsRead, 64u << 20);
  EXPECT_LT(report.Value().FileBytes, 64u << 20);
  EXPECT_LE(report.Value().PeakMemory, options.MemoryLimit);

  const auto source = OpenSource(file);
  ASSERT_TRUE(source);
  const PyramidLayout& layout = source->Info().Layout;
  EXPECT_EQ(source->BytesRead(), 0u);
  EXPECT_EQ(source->MemoryUsed(), 0u);
  EXPECT_EQ(layout.Dimensions(0), (Int3{ 8192, 8192, 8192 }));
  EXPECT_EQ(source->Info().Range, (ValueRange{ 0, 1000 }));

  // Both corners, and the empty middle.
  for (const std::uint32_t at : { 0u, 127u, 64u })
  {
    BrickKey key;
    key.X = key.Y = key.Z = at;
    const auto brick = source->ReadBrick(key);
    ASSERT_TRUE(brick.Ok()) << brick.GetStatus().Message();
    const std::int64_t stored = layout.StoredSize();
    ValueRange truth = ValueRange::Void();
    for (std::int64_t i = 0; i < stored * stored * stored; ++i)
    {
      const auto p = [&](std::int64_t local)
      { return std::clamp<std::int64_t>(std::int64_t{ at } * 64 + local - 2, 0, 8191); };
      const int v = reader.ValueAt(p(i % stored), p(i / stored % stored), p(i / (stored * stored)));
      truth.Include(v);
      ASSERT_EQ(
        ValueAt(brick.Value()->Voxels.data(), ScalarType::UInt16, static_cast<std::size_t>(i)), v);
    }
    const auto ranges = source->ReadRanges(key, { 1, 1, 1 });
    ASSERT_TRUE(ranges.Ok());
    EXPECT_TRUE(ranges.Value()[0].Contains(truth));
    EXPECT_EQ(ranges.Value()[0].IsSingle(), at == 64);
  }
  const std::uint64_t before = source->BytesRead();
  EXPECT_LT(before, 8u << 20);
  // The regions of every page level of the empty middle are known to be empty without reading much.
  for (int page = 0; page <= layout.PageDepth(); ++page)
  {
    BrickKey key;
    key.PageLevel = static_cast<std::uint8_t>(page);
    const Int3 pages = layout.Pages(0, page);
    key.X = static_cast<std::uint32_t>(pages[0] / 2);
    const auto ranges = source->ReadRanges(key, { 1, 1, 1 });
    ASSERT_TRUE(ranges.Ok());
    if (pages[0] > 2)
    {
      EXPECT_EQ(ranges.Value()[0], (ValueRange{ 0, 0 }));
    }
  }
  EXPECT_LT(source->BytesRead() - before, 1u << 20);
  // The coarsest level shows both corners.
  const std::vector<std::byte> top = ReadLevel(*source, layout.NumberOfLevels() - 1);
  EXPECT_GT(ValueAt(top.data(), ScalarType::UInt16, 0), 0);
  EXPECT_GT(ValueAt(top.data(), ScalarType::UInt16, top.size() / 2 - 1), 0);
}

} // namespace teravox::testing
