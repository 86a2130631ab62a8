// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "TestPyramidSupport.h"

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <map>
#include <string>
#include <vector>

namespace teravox::testing
{

/// Files of a foreign layout, written once per script by h5py, and the arrays that it wrote.
class FormatFiles
{
public:
  /// Runs make_NAME.py; nothing if there is no Python with h5py.
  static const FormatFiles* Of(const std::string& name)
  {
    static std::map<std::string, std::unique_ptr<FormatFiles>> all;
    std::unique_ptr<FormatFiles>& files = all[name];
    if (!files)
    {
      files = std::make_unique<FormatFiles>();
#ifdef TERAVOX_PYTHON
      const std::string python = std::string("'") + TERAVOX_PYTHON + "' ";
      files->Python = std::system((python + "-c 'import h5py, numpy'").c_str()) == 0; // NOLINT
      const std::string command = "PYTHONDONTWRITEBYTECODE=1 " + python + "'" +
        TERAVOX_TEST_SCRIPTS + "/make_" + name + ".py' '" + files->Folder.Path() + "'";
      files->Made = files->Python && std::system(command.c_str()) == 0; // NOLINT
#endif
    }
    return files->Python ? files.get() : nullptr;
  }

  std::string File(const std::string& name) const
  {
    return this->Folder.File(name);
  }

  /// An array as keep() of format_files.py left it.
  std::vector<std::byte> Array(const std::string& name) const
  {
    std::ifstream in(this->Folder.File(name + ".bin"), std::ios::binary);
    EXPECT_TRUE(in) << name;
    const std::string text((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
    std::vector<std::byte> bytes(text.size());
    std::memcpy(bytes.data(), text.data(), text.size());
    return bytes;
  }

  TemporaryFolder Folder;
  bool Python = false;
  bool Made = false;
};

/// Skips a test without h5py, and fails it if the script does.
#define TERAVOX_FORMAT_FILES(variable, name)                                                       \
  const FormatFiles* const variable = FormatFiles::Of(name);                                       \
  if (variable == nullptr)                                                                         \
  {                                                                                                \
    GTEST_SKIP() << "Python with h5py is needed to make the files";                                \
  }                                                                                                \
  ASSERT_TRUE(variable->Made) << "make_" name ".py failed"

inline HDF5OpenOptions FormatOptions(
  int channel = 0, int time = 0, const std::string& path = std::string())
{
  HDF5OpenOptions options;
  options.DatasetPath = path;
  options.Channel = channel;
  options.TimePoint = time;
  options.BrickSize = 16;
  return options;
}

/// Opens a volume or fails the test.
inline std::shared_ptr<HDF5BrickSource> OpenFormat(
  const std::string& file, const HDF5OpenOptions& options = FormatOptions())
{
  auto source = HDF5BrickSource::Open(file, options);
  EXPECT_TRUE(source.Ok()) << source.GetStatus().Message();
  return source.Ok() ? source.Value() : nullptr;
}

/// Expects an error whose message names the file and holds the text.
inline void ExpectOpenFails(
  const std::string& file, const HDF5OpenOptions& options, StatusCode code, const std::string& text)
{
  const Status status = HDF5BrickSource::Open(file, options).GetStatus();
  EXPECT_EQ(status.Code(), code) << status.Message();
  EXPECT_NE(status.Message().find(file), std::string::npos) << status.Message();
  EXPECT_NE(status.Message().find(text), std::string::npos) << status.Message();
}

/// Compares all voxels of a level with those of an array of `size`, repeated at its end if it is
/// smaller than the level; and the bricks' borders.
inline void ExpectLevelIs(HDF5BrickSource& source, int level, const Int3& size,
  const std::vector<std::byte>& array, std::size_t voxelBytes)
{
  const VolumeInfo& info = source.Info();
  const Int3 d = info.Layout.Dimensions(level);
  ASSERT_EQ(SizeOf(info.Type) * static_cast<std::size_t>(info.Components), voxelBytes);
  ASSERT_EQ(array.size(), static_cast<std::size_t>(size[0] * size[1] * size[2]) * voxelBytes);
  std::vector<std::byte> whole(static_cast<std::size_t>(d[0] * d[1] * d[2]) * voxelBytes);
  for (std::int64_t i = 0; i < d[0] * d[1] * d[2]; ++i)
  {
    const std::int64_t x = std::min(i % d[0], size[0] - 1);
    const std::int64_t y = std::min(i / d[0] % d[1], size[1] - 1);
    const std::int64_t z = std::min(i / (d[0] * d[1]), size[2] - 1);
    std::memcpy(whole.data() + static_cast<std::size_t>(i) * voxelBytes,
      array.data() + static_cast<std::size_t>((z * size[1] + y) * size[0] + x) * voxelBytes,
      voxelBytes);
  }
  const Int3 bricks = info.Layout.Bricks(level);
  for (std::int64_t i = 0; i < bricks[0] * bricks[1] * bricks[2]; ++i)
  {
    const BrickKey key = BrickKey::Of(
      level, { i % bricks[0], i / bricks[0] % bricks[1], i / (bricks[0] * bricks[1]) });
    const auto brick = source.ReadBrick(key);
    ASSERT_TRUE(brick.Ok()) << brick.GetStatus().Message();
    ExpectBrickEquals(info, key, *brick.Value(), whole);
  }
}

/// All that was seen, as one text.
inline std::string SeenBy(const HDF5BrickSource& source)
{
  std::string text;
  for (const std::string& line : source.Description().Seen)
  {
    text += line + "\n";
  }
  return text;
}

} // namespace teravox::testing
