// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "ConversionLog.h"
#include "FileContents.h"
#include "TestPyramidSupport.h"

#include <fstream>

namespace teravox::testing
{
namespace
{

VoxelReader::Description SomeVolume()
{
  VoxelReader::Description volume;
  volume.Dimensions = { 100, 90, 83 };
  volume.Type = ScalarType::UInt16;
  volume.Spacing = { 0.5, 1, 2 };
  return volume;
}

/// Smooth with noise; an eighth of it is the fill value.
void Generate(ArrayVoxelReader& reader)
{
  std::mt19937 random(3);
  reader.Generate(
    [&](std::size_t i)
    {
      return i % 100 < 50 && i / 100 % 90 < 45 ? 0.0
                                               : static_cast<double>(i / 40 % 900 + random() % 4);
    });
}

PyramidWriterOptions Options(PyramidCompression compression)
{
  PyramidWriterOptions options;
  options.BrickSize = 16;
  options.Compression = compression;
  options.MemoryLimit = std::uint64_t{ 14 } << 20; // several blocks
  options.Resume = true;
  options.Source = "memory";
  return options;
}

/// Lets a conversion go on until it has reported `calls` times.
Result<PyramidWriterReport> WriteUntil(
  const std::string& file, VoxelReader& reader, PyramidWriterOptions options, int calls)
{
  int count = 0;
  options.Progress = [&](std::uint64_t, std::uint64_t) { return ++count <= calls; };
  return PyramidWriter::Write(file, reader, options);
}

std::vector<std::string> FilesEnding(const TemporaryFolder& folder, const std::string& end)
{
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder.Path()))
  {
    const std::string name = entry.path().string();
    if (name.size() > end.size() && name.substr(name.size() - end.size()) == end)
    {
      names.push_back(name);
    }
  }
  std::sort(names.begin(), names.end());
  return names;
}

class PyramidResume : public ::testing::Test
{
protected:
  PyramidResume()
    : Reader(SomeVolume())
  {
    Generate(this->Reader);
  }
  std::string WriteUndisturbed(const PyramidWriterOptions& options)
  {
    const auto report = PyramidWriter::Write(this->Folder.File("whole.h5"), this->Reader, options);
    EXPECT_TRUE(report.Ok()) << report.GetStatus().Message();
    this->Chunks = report.Value().ChunksWritten;
    std::string contents = ContentsOf(this->Folder.File("whole.h5"));
    std::filesystem::remove(this->Folder.File("whole.h5"));
    EXPECT_EQ(this->Folder.Count(), 0u);
    return contents;
  }

  ArrayVoxelReader Reader;
  TemporaryFolder Folder;
  std::uint64_t Chunks = 0;
};

TEST_F(PyramidResume, StoppedAnywhereTheFileIsTheSameByteByByte)
{
  for (const PyramidCompression compression :
    { PyramidCompression::None, PyramidCompression::Deflate, PyramidCompression::LZ4 })
  {
    const PyramidWriterOptions options = Options(compression);
    const std::string whole = this->WriteUndisturbed(options);
    const std::string file = this->Folder.File("out.h5");
    std::uint64_t saved = 0;
    int stops = 0;
    for (int calls = 2;; calls = calls * 3 / 2 + 3)
    {
      const auto report = WriteUntil(file, this->Reader, options, calls);
      if (report.Ok())
      {
        EXPECT_EQ(report.Value().ChunksWritten, this->Chunks);
        saved = report.Value().ChunksSaved;
        break;
      }
      ++stops;
      ASSERT_EQ(report.GetStatus().Code(), StatusCode::Cancelled) << report.GetStatus().Message();
      EXPECT_FALSE(std::filesystem::exists(file));
      EXPECT_EQ(
        FilesEnding(this->Folder, ".part").size(), FilesEnding(this->Folder, ".log").size());
      EXPECT_LE(FilesEnding(this->Folder, ".part").size(), 2u);
      ASSERT_LT(stops, 1000);
    }
    EXPECT_GT(stops, 5);
    EXPECT_GT(saved, this->Chunks / 2);
    EXPECT_TRUE(ContentsOf(file) == whole);
    std::filesystem::remove(file);
    EXPECT_EQ(this->Folder.Count(), 0u);
  }
}

TEST_F(PyramidResume, WhatIsThereIsNeitherReadNorCompressedAgain)
{
  const PyramidWriterOptions options = Options(PyramidCompression::LZ4);
  this->WriteUndisturbed(options);
  const std::string file = this->Folder.File("out.h5");
  int reads = 0;
  this->Reader.BeforeRead = [&]
  {
    ++reads;
    return Status();
  };
  // All voxels are stored, then it ends while statistics are made.
  const auto first = WriteUntil(file, this->Reader, options, 60);
  ASSERT_FALSE(first.Ok());
  const int all = reads;
  reads = 0;
  const auto second = WriteUntil(file, this->Reader, options, 1 << 30);
  ASSERT_TRUE(second.Ok()) << second.GetStatus().Message();
  EXPECT_LT(reads, all);
  EXPECT_GT(second.Value().ChunksSaved, 0u);
}

TEST_F(PyramidResume, DamagedRemainsAreMadeAgain)
{
  const PyramidWriterOptions options = Options(PyramidCompression::LZ4);
  const std::string whole = this->WriteUndisturbed(options);
  const std::string file = this->Folder.File("out.h5");
  std::mt19937 random(4);
  for (int trial = 0; trial < 6; ++trial)
  {
    ASSERT_FALSE(WriteUntil(file, this->Reader, options, 20 + 5 * trial).Ok());
    for (const char* end : { ".part", ".log" })
    {
      const std::vector<std::string> names = FilesEnding(this->Folder, end);
      ASSERT_EQ(names.size(), 1u);
      std::string bytes = ContentsOf(names[0]);
      ASSERT_GT(bytes.size(), 300u);
      // A log's head names the task; another one is another conversion, which isn't this test.
      const std::size_t first = trial % 3 == 0 ? 1 << 20 : 300;
      for (int i = 0; i < 20 && first < bytes.size(); ++i)
      {
        bytes[first + random() % (bytes.size() - first)] = static_cast<char>(random());
      }
      if (trial % 4 == 3)
      {
        bytes.resize(300 + random() % (bytes.size() - 300));
      }
      std::ofstream(names[0], std::ios::binary) << bytes;
    }
    const auto report = WriteUntil(file, this->Reader, options, 1 << 30);
    ASSERT_TRUE(report.Ok()) << report.GetStatus().Message();
    ASSERT_TRUE(ContentsOf(file) == whole) << trial;
    std::filesystem::remove(file);
    ASSERT_EQ(this->Folder.Count(), 0u);
  }
}

TEST_F(PyramidResume, AnotherTaskIsAnErrorAndLosesNothing)
{
  const PyramidWriterOptions options = Options(PyramidCompression::LZ4);
  const std::string file = this->Folder.File("out.h5");
  ASSERT_FALSE(WriteUntil(file, this->Reader, options, 20).Ok());
  const auto expectRefused = [&](const PyramidWriterOptions& other, VoxelReader& reader)
  {
    const auto report = PyramidWriter::Write(file, reader, other);
    EXPECT_EQ(report.GetStatus().Code(), StatusCode::InvalidArgument);
    EXPECT_NE(report.GetStatus().Message().find(file), std::string::npos);
    EXPECT_EQ(this->Folder.Count(), 2u);
  };
  PyramidWriterOptions other = options;
  other.Source = "another file";
  expectRefused(other, this->Reader);
  other = options;
  other.CompressionLevel = 2;
  expectRefused(other, this->Reader);
  VoxelReader::Description moved = SomeVolume();
  moved.Origin[1] = 1e-9;
  ArrayVoxelReader elsewhere(moved);
  expectRefused(options, elsewhere);
  // More memory is no other task.
  other = options;
  other.MemoryLimit *= 4;
  const auto report = PyramidWriter::Write(file, this->Reader, other);
  ASSERT_TRUE(report.Ok()) << report.GetStatus().Message();
  EXPECT_GT(report.Value().ChunksSaved, 0u);
  EXPECT_EQ(this->Folder.Count(), 1u);
}

TEST_F(PyramidResume, WithoutItNothingIsKept)
{
  PyramidWriterOptions options = Options(PyramidCompression::LZ4);
  const std::string file = this->Folder.File("out.h5");
  ASSERT_FALSE(WriteUntil(file, this->Reader, options, 20).Ok());
  EXPECT_EQ(this->Folder.Count(), 2u);
  options.Resume = false;
  EXPECT_FALSE(WriteUntil(file, this->Reader, options, 20).Ok());
  EXPECT_EQ(this->Folder.Count(), 0u);
  const auto report = PyramidWriter::Write(file, this->Reader, options);
  ASSERT_TRUE(report.Ok());
  EXPECT_EQ(report.Value().ChunksSaved, 0u);
  EXPECT_EQ(this->Folder.Count(), 1u);
}

} // namespace
} // namespace teravox::testing
