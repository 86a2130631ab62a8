// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "Downsampling.h"
#include "TestPyramidSupport.h"

#include <cmath>
#include <csignal>
#include <fstream>
#include <limits>
#include <stdexcept>
#include <sys/resource.h>
#include <utility>

namespace teravox::testing
{

namespace
{
constexpr std::array<PyramidCompression, 3> Compressions = { PyramidCompression::None,
  PyramidCompression::Deflate, PyramidCompression::LZ4 };

PyramidWriterOptions SmallBricks(PyramidCompression compression)
{
  PyramidWriterOptions options;
  options.BrickSize = 16;
  options.Compression = compression;
  return options;
}

std::vector<std::byte> FileBytes(const std::string& name)
{
  std::ifstream in(name, std::ios::binary);
  std::vector<std::byte> bytes(std::filesystem::file_size(name));
  in.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  return bytes;
}

// All values that the region's bricks can show, borders included, lie in its range.
void ExpectRangesHold(HDF5BrickSource& source)
{
  const VolumeInfo& info = source.Info();
  for (int l = 0; l < info.Layout.NumberOfLevels(); ++l)
  {
    const std::vector<std::byte> level = ReadLevel(source, l);
    const Int3 d = info.Layout.Dimensions(l);
    for (int page = 0; page <= info.Layout.PageDepth(); ++page)
    {
      const Int3 pages = info.Layout.Pages(l, page);
      BrickKey key;
      key.Level = static_cast<std::uint8_t>(l);
      key.PageLevel = static_cast<std::uint8_t>(page);
      const Int3 count{ pages[0] + 1, pages[1] + 1, pages[2] + 1 };
      const auto ranges = source.ReadRanges(key, count);
      ASSERT_TRUE(ranges.Ok()) << ranges.GetStatus().Message();
      std::int64_t size = info.Layout.BrickSize();
      for (int k = 0; k < page; ++k)
      {
        size *= PageBlockEdge;
      }
      for (std::int64_t i = 0; i < count[0] * count[1] * count[2]; ++i)
      {
        const Int3 r{ i % count[0], i / count[0] % count[1], i / (count[0] * count[1]) };
        const ValueRange& range = ranges.Value()[static_cast<std::size_t>(i)];
        ValueRange truth = ValueRange::Void();
        if (r[0] < pages[0] && r[1] < pages[1] && r[2] < pages[2])
        {
          for (std::int64_t z = std::max<std::int64_t>(0, r[2] * size - 2);
               z < std::min(d[2], (r[2] + 1) * size + 2); ++z)
          {
            for (std::int64_t y = std::max<std::int64_t>(0, r[1] * size - 2);
                 y < std::min(d[1], (r[1] + 1) * size + 2); ++y)
            {
              for (std::int64_t x = std::max<std::int64_t>(0, r[0] * size - 2) * info.Components;
                   x < std::min(d[0], (r[0] + 1) * size + 2) * info.Components; ++x)
              {
                truth.Include(ValueAt(level.data(), info.Type,
                  static_cast<std::size_t>((z * d[1] + y) * d[0] * info.Components + x)));
              }
            }
          }
          EXPECT_TRUE(range.IsVoid() || range.IsKnown());
        }
        else
        {
          EXPECT_TRUE(range.IsVoid());
        }
        EXPECT_TRUE(range.Contains(truth))
          << "level " << l << " page level " << page << " region " << i << ": " << range.Min << ".."
          << range.Max << " must hold " << truth.Min << ".." << truth.Max;
      }
    }
  }
}
} // namespace

class PyramidRoundTrip : public ::testing::TestWithParam<std::tuple<ScalarType, int>>
{
};

TEST_P(PyramidRoundTrip, KeepsVoxelsLevelsAndRanges)
{
  const ScalarType type = std::get<0>(GetParam());
  const int components = std::get<1>(GetParam());
  const TemporaryFolder folder;
  for (const PyramidCompression compression : Compressions)
  {
    for (const Int3& dimensions : { Int3{ 37, 50, 21 }, Int3{ 1, 70, 33 }, Int3{ 65, 1, 1 },
           Int3{ 1, 1, 1 }, Int3{ 16, 16, 16 } })
    {
      ArrayVoxelReader reader(Describe(dimensions, type, components));
      reader.GenerateMixed(7);
      const std::string file = folder.File("volume.h5");
      const auto report = PyramidWriter::Write(file, reader, SmallBricks(compression));
      ASSERT_TRUE(report.Ok()) << report.GetStatus().Message();
      // Render bricks smaller than, equal to, larger than and incommensurable with the chunks.
      for (const int brickSize : { 8, 16, 23, 64 })
      {
        const auto source = OpenSource(file, brickSize);
        ASSERT_TRUE(source);
        EXPECT_EQ(source->Info().Type, type);
        EXPECT_EQ(source->Info().Components, components);
        EXPECT_EQ(source->Info().Layout.Dimensions(0), dimensions);
        EXPECT_EQ(ReadLevel(*source, 0), reader.Voxels);
      }
      const auto source = OpenSource(file, 16);
      std::vector<std::byte> fine = reader.Voxels;
      for (int l = 1; l < source->Info().Layout.NumberOfLevels(); ++l)
      {
        const PyramidLayout& layout = source->Info().Layout;
        Int3 ratio{};
        for (std::size_t a = 0; a < 3; ++a)
        {
          ratio[a] = layout.Factor(l)[a] / layout.Factor(l - 1)[a];
        }
        const Int3 size = layout.Dimensions(l);
        std::vector<std::byte> coarse(static_cast<std::size_t>(size[0] * size[1] * size[2]) *
          SizeOf(type) * static_cast<std::size_t>(components));
        DownsampleDense(type, fine.data(), layout.Dimensions(l - 1), components, ratio,
          Downsampling::Average, coarse.data());
        EXPECT_EQ(ReadLevel(*source, l), coarse) << "level " << l;
        fine = coarse;
      }
      ExpectRangesHold(*source);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Types, PyramidRoundTrip,
  ::testing::Combine(::testing::ValuesIn(AllScalarTypes), ::testing::Values(1, 3)),
  [](const auto& test)
  {
    return std::string(ToString(std::get<0>(test.param))) + "x" +
      std::to_string(std::get<1>(test.param));
  });

TEST(PyramidWriter, BricksEqualNaiveReadingWithClampedBorders)
{
  const TemporaryFolder folder;
  ArrayVoxelReader reader(Describe({ 75, 41, 30 }, ScalarType::Int16));
  reader.GenerateMixed(3);
  const std::string file = folder.File("volume.h5");
  ASSERT_TRUE(PyramidWriter::Write(file, reader, SmallBricks(PyramidCompression::LZ4)).Ok());
  for (const int brickSize : { 2, 16, 20, 100 })
  {
    const auto source = OpenSource(file, brickSize);
    const PyramidLayout& layout = source->Info().Layout;
    for (int l = 0; l < layout.NumberOfLevels(); ++l)
    {
      const std::vector<std::byte> level = ReadLevel(*source, l);
      const Int3 n = layout.Bricks(l);
      std::mt19937 random(11);
      for (int i = 0; i < 20; ++i)
      {
        BrickKey key;
        key.Level = static_cast<std::uint8_t>(l);
        key.X = static_cast<std::uint32_t>(random() % static_cast<unsigned>(n[0]));
        key.Y = static_cast<std::uint32_t>(random() % static_cast<unsigned>(n[1]));
        key.Z = static_cast<std::uint32_t>(random() % static_cast<unsigned>(n[2]));
        const auto brick = source->ReadBrick(key);
        ASSERT_TRUE(brick.Ok()) << brick.GetStatus().Message();
        ExpectBrickEquals(source->Info(), key, *brick.Value(), level);
      }
    }
  }
}

TEST(PyramidWriter, SmallMemoryGivesTheSameVoxelsAndHoldsTheLimit)
{
  const TemporaryFolder folder;
  ArrayVoxelReader reader(Describe({ 300, 70, 150 }, ScalarType::UInt16));
  reader.GenerateMixed(5);
  PyramidWriterOptions options = SmallBricks(PyramidCompression::Deflate);
  const auto large = PyramidWriter::Write(folder.File("large.h5"), reader, options);
  ASSERT_TRUE(large.Ok()) << large.GetStatus().Message();
  options.MemoryLimit = 12 << 20;
  const auto small = PyramidWriter::Write(folder.File("small.h5"), reader, options);
  ASSERT_TRUE(small.Ok()) << small.GetStatus().Message();
  EXPECT_LE(small.Value().PeakMemory, options.MemoryLimit);
  EXPECT_LT(small.Value().PeakMemory, large.Value().PeakMemory);
  EXPECT_EQ(small.Value().VoxelsRead, large.Value().VoxelsRead);
  EXPECT_EQ(small.Value().ChunksWritten, large.Value().ChunksWritten);
  const auto a = OpenSource(folder.File("large.h5"), 16);
  const auto b = OpenSource(folder.File("small.h5"), 16);
  for (int l = 0; l < a->Info().Layout.NumberOfLevels(); ++l)
  {
    EXPECT_EQ(ReadLevel(*a, l), ReadLevel(*b, l)) << "level " << l;
  }
  EXPECT_EQ(a->Info().Histogram, b->Info().Histogram);
  ExpectRangesHold(*b);
  options.MemoryLimit = 1000;
  const auto none = PyramidWriter::Write(folder.File("none.h5"), reader, options);
  EXPECT_EQ(none.GetStatus().Code(), StatusCode::ResourceExhausted);
  EXPECT_NE(none.GetStatus().Message().find("1000 bytes"), std::string::npos)
    << none.GetStatus().Message();
}

TEST(PyramidWriter, IsDeterministic)
{
  const TemporaryFolder folder;
  ArrayVoxelReader reader(Describe({ 90, 80, 70 }, ScalarType::UInt8));
  reader.GenerateMixed(9);
  const PyramidWriterOptions options = SmallBricks(PyramidCompression::LZ4);
  ASSERT_TRUE(PyramidWriter::Write(folder.File("a.h5"), reader, options).Ok());
  ASSERT_TRUE(PyramidWriter::Write(folder.File("b.h5"), reader, options).Ok());
  const std::vector<std::byte> a = FileBytes(folder.File("a.h5"));
  const std::vector<std::byte> b = FileBytes(folder.File("b.h5"));
  EXPECT_TRUE(a == b);
}

// Blocks of several slabs, the last one thin, and an error in each of the reads.
TEST(PyramidWriter, SlabBySlabGivesTheSameFile)
{
  const TemporaryFolder folder;
  for (const ScalarType type : { ScalarType::UInt8, ScalarType::Float32 })
  {
    ArrayVoxelReader reader(Describe({ 260, 250, 203 }, type));
    reader.GenerateMixed(9);
    PyramidWriterOptions options;
    options.BrickSize = 32;
    int reads = 0;
    reader.BeforeRead = [&reads]
    {
      ++reads;
      return Status();
    };
    ASSERT_TRUE(PyramidWriter::Write(folder.File("a.h5"), reader, options).Ok());
    const int blocks = std::exchange(reads, 0);
    reader.Slabs = true;
    ASSERT_TRUE(PyramidWriter::Write(folder.File("b.h5"), reader, options).Ok());
    EXPECT_GT(reads, blocks);
    EXPECT_TRUE(FileBytes(folder.File("a.h5")) == FileBytes(folder.File("b.h5")));
    for (int fails = 0; fails < reads; ++fails)
    {
      int left = fails;
      reader.BeforeRead = [&left]
      { return left-- == 0 ? Status(StatusCode::Corrupt, "The slice is broken.") : Status(); };
      const auto report = PyramidWriter::Write(folder.File("c.h5"), reader, options);
      EXPECT_EQ(report.GetStatus().Message(), "The slice is broken.") << fails;
      EXPECT_EQ(folder.Count(), 2U);
    }
  }
}

TEST(PyramidWriter, KeepsGeometryAndNames)
{
  const TemporaryFolder folder;
  for (const bool cells : { false, true })
  {
    VoxelReader::Description d = Describe({ 20, 30, 40 }, ScalarType::Float32);
    d.CellData = cells;
    d.Spacing = { 0.5, 2, 3.25 };
    d.Origin = { 10, -20, 30.5 };
    d.Direction = { 0, -1, 0, 1, 0, 0, 0, 0, 1 };
    d.ExtentStart = { 5, -7, 0 };
    d.ArrayName = "density of/cells";
    ArrayVoxelReader reader(d);
    reader.GenerateMixed(1);
    PyramidWriterOptions options = SmallBricks(PyramidCompression::Deflate);
    options.Downsampling = PyramidDownsampling::Mode;
    ASSERT_TRUE(PyramidWriter::Write(folder.File("g.h5"), reader, options).Ok());
    const auto source = OpenSource(folder.File("g.h5"));
    const VolumeInfo& info = source->Info();
    EXPECT_EQ(info.CellData, cells);
    EXPECT_TRUE(info.Labels);
    EXPECT_EQ(info.ArrayName, "density of_cells");
    EXPECT_EQ(info.ExtentStart, d.ExtentStart);
    EXPECT_EQ(info.Spacing, d.Spacing);
    EXPECT_EQ(info.Direction, d.Direction);
    for (std::size_t a = 0; a < 3; ++a)
    {
      EXPECT_NEAR(info.Origin[a], d.Origin[a], 1e-12);
    }
    EXPECT_NE(info.Name.find(folder.File("g.h5")), std::string::npos);
  }
}

TEST(PyramidWriter, HistogramAndRangeAreThoseOfLevelZero)
{
  const TemporaryFolder folder;
  for (const ScalarType type : AllScalarTypes)
  {
    ArrayVoxelReader reader(Describe({ 60, 40, 33 }, type));
    reader.GenerateMixed(13);
    PyramidWriterOptions options = SmallBricks(PyramidCompression::LZ4);
    options.MemoryLimit = 16 << 20;
    ASSERT_TRUE(PyramidWriter::Write(folder.File("h.h5"), reader, options).Ok());
    const auto source = OpenSource(folder.File("h.h5"));
    const VolumeInfo& info = source->Info();
    ValueRange range = ValueRange::Void();
    for (std::size_t i = 0; i < reader.Count(); ++i)
    {
      range.Include(ValueAt(reader.Voxels.data(), type, i));
    }
    EXPECT_EQ(info.Range, range);
    ASSERT_EQ(info.Histogram.size(), 256u);
    std::vector<double> truth(256, 0);
    for (std::size_t i = 0; i < reader.Count(); ++i)
    {
      const double v = ValueAt(reader.Voxels.data(), type, i);
      const double bin = (v - range.Min) * 256 / (range.Max - range.Min);
      truth[static_cast<std::size_t>(std::min(bin, 255.0))] += 1;
    }
    if (SizeOf(type) <= 2)
    {
      EXPECT_EQ(info.Histogram, truth);
      continue;
    }
    // A value moves by 1/32768 of the range at most, so into a neighbouring bin.
    double sum = 0;
    double moved = 0;
    for (std::size_t i = 0; i < 256; ++i)
    {
      sum += info.Histogram[i];
      moved += std::abs(info.Histogram[i] - truth[i]);
    }
    EXPECT_EQ(sum, static_cast<double>(reader.Count()));
    EXPECT_LE(moved, 2.0 * static_cast<double>(reader.Count()));
  }
}

TEST(PyramidWriter, LeavesNaNOut)
{
  const TemporaryFolder folder;
  for (const ScalarType type : { ScalarType::Float32, ScalarType::Float64 })
  {
    ArrayVoxelReader reader(Describe({ 48, 32, 32 }, type));
    // One half NaN entirely, the other with NaN in every third voxel.
    reader.Generate(
      [](std::size_t i)
      {
        const std::size_t x = i % 48;
        return x < 32 || i % 3 == 0 ? std::nan("") : 5.0 + static_cast<double>(x);
      });
    ASSERT_TRUE(
      PyramidWriter::Write(folder.File("n.h5"), reader, SmallBricks(PyramidCompression::Deflate))
        .Ok());
    const auto source = OpenSource(folder.File("n.h5"), 16);
    EXPECT_EQ(source->Info().Range, (ValueRange{ 37, 52 }));
    const auto ranges = source->ReadRanges(BrickKey(), { 3, 2, 2 });
    ASSERT_TRUE(ranges.Ok());
    EXPECT_TRUE(ranges.Value()[0].IsVoid());
    EXPECT_TRUE(ranges.Value()[1].Contains({ 37, 38 })); // its border reaches the values
    EXPECT_EQ(ranges.Value()[2], (ValueRange{ 37, 52 }));
    const std::vector<std::byte> level1 = ReadLevel(*source, 1);
    EXPECT_TRUE(std::isnan(ValueAt(level1.data(), type, 0)));
    EXPECT_FALSE(std::isnan(ValueAt(level1.data(), type, 20)));
    ExpectRangesHold(*source);
  }
}

// As of arrays in memory: one value beside NaN isn't a single one, within a cell or between two.
TEST(PyramidWriter, OneValueBesideNaNIsNotSingle)
{
  const TemporaryFolder folder;
  for (const std::size_t first : { 5, 8, 32 })
  {
    ArrayVoxelReader reader(Describe({ 48, 32, 32 }, ScalarType::Float32));
    reader.Generate([first](std::size_t i) { return i % 48 >= first ? std::nan("") : 5.0; });
    ASSERT_TRUE(
      PyramidWriter::Write(folder.File("s.h5"), reader, SmallBricks(PyramidCompression::Deflate))
        .Ok());
    const auto source = OpenSource(folder.File("s.h5"), 16);
    const auto ranges = source->ReadRanges(BrickKey(), { 3, 2, 2 });
    ASSERT_TRUE(ranges.Ok());
    const std::size_t b = (first - 1) / 16;
    EXPECT_FALSE(ranges.Value()[b].IsSingle()) << first;
    EXPECT_TRUE(ranges.Value()[b].Contains({ 5, 5 })) << first;
    EXPECT_TRUE(b == 0 || ranges.Value()[0] == (ValueRange{ 5, 5 })) << first;
    ExpectRangesHold(*source);
  }
}

TEST(PyramidWriter, RefusesBadInputWithAReason)
{
  const TemporaryFolder folder;
  const auto message = [&](VoxelReader::Description d, PyramidWriterOptions options)
  {
    ArrayVoxelReader reader(Describe({ 4, 4, 4 }, d.Type));
    reader.Volume = d;
    const auto report = PyramidWriter::Write(folder.File("bad.h5"), reader, options);
    EXPECT_EQ(report.GetStatus().Code(), StatusCode::InvalidArgument);
    EXPECT_EQ(folder.Count(), 0u);
    return report.GetStatus().Message();
  };
  VoxelReader::Description d = Describe({ 4, 4, 4 }, ScalarType::UInt8);
  d.Spacing = { 1, -1, 1 };
  EXPECT_NE(message(d, {}).find("spacing"), std::string::npos);
  d = Describe({ 4, 4, 4 }, ScalarType::UInt8);
  d.Direction = { 1, 0, 0, 1, 0, 0, 0, 0, 1 };
  EXPECT_NE(message(d, {}).find("singular"), std::string::npos);
  EXPECT_NE(
    message(Describe({ 4, 0, 4 }, ScalarType::UInt8), {}).find("4 x 0 x 4"), std::string::npos);
  EXPECT_NE(
    message(Describe({ 4, std::int64_t{ 1 } << 31, 4 }, ScalarType::UInt8), {}).find("2^31"),
    std::string::npos);
  d = Describe({ 4, 4, 4 }, ScalarType::UInt8, 5);
  EXPECT_NE(message(d, {}).find("5 components"), std::string::npos);
  d = Describe({ 4, 4, 4 }, ScalarType::UInt8);
  d.FillValue = 300;
  EXPECT_NE(message(d, {}).find("fill value"), std::string::npos);
  PyramidWriterOptions options;
  options.BrickSize = 20;
  EXPECT_NE(message(Describe({ 4, 4, 4 }, ScalarType::UInt8), options).find("multiple of 8"),
    std::string::npos);
}

TEST(PyramidWriter, ErrorCancelAndExceptionLeaveNothing)
{
  const TemporaryFolder folder;
  ArrayVoxelReader reader(Describe({ 64, 64, 64 }, ScalarType::UInt8));
  reader.GenerateMixed(2);
  PyramidWriterOptions options = SmallBricks(PyramidCompression::LZ4);
  options.MemoryLimit = 12 << 20;
  reader.BeforeRead = [] { return Status(StatusCode::Corrupt, "The slice is broken."); };
  auto report = PyramidWriter::Write(folder.File("x.h5"), reader, options);
  EXPECT_EQ(report.GetStatus().Message(), "The slice is broken.");
  EXPECT_EQ(folder.Count(), 0u);

  reader.BeforeRead = []() -> Status { throw std::runtime_error("boom"); };
  report = PyramidWriter::Write(folder.File("x.h5"), reader, options);
  EXPECT_NE(report.GetStatus().Message().find("boom"), std::string::npos);
  EXPECT_EQ(folder.Count(), 0u);

  reader.BeforeRead = nullptr;
  std::uint64_t last = 0;
  options.Progress = [&](std::uint64_t done, std::uint64_t total)
  {
    EXPECT_GE(done, last);
    EXPECT_EQ(total, 64u * 64 * 64);
    last = done;
    return done < total / 2;
  };
  report = PyramidWriter::Write(folder.File("x.h5"), reader, options);
  EXPECT_EQ(report.GetStatus().Code(), StatusCode::Cancelled);
  EXPECT_EQ(folder.Count(), 0u);

  // The file that was there before stays as it is.
  options.Progress = nullptr;
  ASSERT_TRUE(PyramidWriter::Write(folder.File("x.h5"), reader, options).Ok());
  reader.BeforeRead = [] { return Status(StatusCode::Corrupt, "The slice is broken."); };
  EXPECT_FALSE(PyramidWriter::Write(folder.File("x.h5"), reader, options).Ok());
  EXPECT_EQ(folder.Count(), 1u);
  EXPECT_TRUE(OpenSource(folder.File("x.h5")));
}

TEST(PyramidWriter, ProgressEndsAtTheTotal)
{
  const TemporaryFolder folder;
  ArrayVoxelReader reader(Describe({ 100, 64, 30 }, ScalarType::UInt16));
  reader.GenerateMixed(2);
  for (const std::uint64_t limit : { std::uint64_t{ 12 } << 20, std::uint64_t{ 1 } << 30 })
  {
    PyramidWriterOptions options = SmallBricks(PyramidCompression::LZ4);
    options.MemoryLimit = limit;
    std::uint64_t last = 0;
    int calls = 0;
    options.Progress = [&](std::uint64_t done, std::uint64_t)
    {
      last = done;
      ++calls;
      return true;
    };
    ASSERT_TRUE(PyramidWriter::Write(folder.File("p.h5"), reader, options).Ok());
    EXPECT_EQ(last, reader.Voxels.size());
    EXPECT_GT(calls, 5);
  }
}

TEST(PyramidWriter, UnwritablePlacesAreNamed)
{
  const TemporaryFolder folder;
  ArrayVoxelReader reader(Describe({ 8, 8, 8 }, ScalarType::UInt8));
  auto report = PyramidWriter::Write(folder.File("no/such/x.h5"), reader, {});
  EXPECT_EQ(report.GetStatus().Code(), StatusCode::InputOutput);
  EXPECT_NE(report.GetStatus().Message().find("No such file or directory"), std::string::npos)
    << report.GetStatus().Message();
  report = PyramidWriter::Write(folder.Path(), reader, {});
  EXPECT_EQ(report.GetStatus().Code(), StatusCode::InputOutput);
  report = PyramidWriter::Write("/proc/x.h5", reader, {});
  EXPECT_EQ(report.GetStatus().Code(), StatusCode::InputOutput);
}

namespace
{
// Runs in a process of its own, because limits can't be raised again.
void WriteWithFileSizeLimit(const std::string& file, PyramidCompression compression, rlim_t limit)
{
  ::signal(SIGXFSZ, SIG_IGN);
  const rlimit bound{ limit, limit };
  ::setrlimit(RLIMIT_FSIZE, &bound);
  ArrayVoxelReader reader(Describe({ 100, 100, 50 }, ScalarType::UInt16));
  std::mt19937 random(1);
  reader.Generate([&](std::size_t) { return static_cast<double>(random() % 65536); });
  const auto report = PyramidWriter::Write(file, reader, SmallBricks(compression));
  const std::string message = report.GetStatus().Message();
  const bool right = report.GetStatus().Code() == StatusCode::InputOutput &&
    message.find(file) != std::string::npos && message.find("too large") != std::string::npos;
  std::fprintf(stderr, "%s\n", message.c_str());
  std::exit(right ? 0 : 1); // the libraries' own clean-up must not fail either
}
} // namespace

// The limit of a file's size stands for a full disk: writes beyond it fail as they would there.
TEST(PyramidWriterDeathTest, FullDiskIsAClearError)
{
  ::testing::FLAGS_gtest_death_test_style = "threadsafe"; // fork alone would break OpenMP
  const std::string file = ::testing::TempDir() + "teravox-full.h5";
  for (const PyramidCompression compression : Compressions)
  {
    for (const rlim_t limit : { rlim_t{ 1000 }, rlim_t{ 3000 }, rlim_t{ 20000 }, rlim_t{ 150000 } })
    {
      EXPECT_EXIT(
        WriteWithFileSizeLimit(file, compression, limit), ::testing::ExitedWithCode(0), "too large")
        << "limit " << limit;
      for (const auto& entry : std::filesystem::directory_iterator(::testing::TempDir()))
      {
        EXPECT_EQ(entry.path().string().find("teravox-full.h5"), std::string::npos);
      }
    }
  }
}

} // namespace teravox::testing
