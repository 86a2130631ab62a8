// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "TestFormatsSupport.h"

namespace teravox::testing
{
namespace
{

constexpr Int3 Size{ 101, 53, 21 };

TEST(FormatsImaris, EveryLevelTimePointAndChannelIsWhatWasWritten)
{
  TERAVOX_FORMAT_FILES(files, "imaris");
  for (int time = 0; time < 3; ++time)
  {
    for (int channel = 0; channel < 2; ++channel)
    {
      const auto source = OpenFormat(files->File("small.ims"), FormatOptions(channel, time));
      ASSERT_TRUE(source);
      const VolumeInfo& info = source->Info();
      EXPECT_EQ(source->BytesRead(), 0u);
      EXPECT_EQ(info.Type, ScalarType::UInt16);
      ASSERT_EQ(info.Layout.NumberOfLevels(), 4);
      EXPECT_EQ(info.Layout.Dimensions(0), Size);
      // 101 x 53 x 21, 50 x 26 x 10, 25 x 13 x 5, 12 x 6 x 2: floored, where factors ask for more.
      EXPECT_EQ(info.Layout.Factor(3), (Int3{ 8, 8, 8 }));
      for (int level = 0; level < 4; ++level)
      {
        ExpectLevelIs(*source, level, { Size[0] >> level, Size[1] >> level, Size[2] >> level },
          files->Array("small." + std::to_string(time) + "." + std::to_string(channel) + "." +
            std::to_string(level)),
          2);
      }
    }
  }
}

TEST(FormatsImaris, GeometryColoursAndHistograms)
{
  TERAVOX_FORMAT_FILES(files, "imaris");
  const auto source = OpenFormat(files->File("small.ims"), FormatOptions(1, 2));
  ASSERT_TRUE(source);
  const VolumeInfo& info = source->Info();
  // Extents lie on the borders of voxels, an origin in the centre of one.
  const Double3 spacing{ 0.25, 0.25, 1.5 };
  const Double3 origin{ 10.125, -4.875, 100.75 };
  for (std::size_t a = 0; a < 3; ++a)
  {
    EXPECT_NEAR(info.Spacing[a], spacing[a], 1e-9);
    EXPECT_NEAR(info.Origin[a], origin[a], 1e-9);
  }
  EXPECT_EQ(info.ArrayName, "Membrane");
  ASSERT_TRUE(source->Channel());
  const ChannelDescription& hint = *source->Channel();
  EXPECT_EQ(hint.Display, (ValueRange{ 1001, 40001 }));
  ASSERT_TRUE(hint.Color.has_value());
  EXPECT_EQ(*hint.Color, (Double3{ 0, 1, 0 }));
  const std::vector<std::byte> voxels = files->Array("small.2.1.0");
  ValueRange range = ValueRange::Void();
  for (std::size_t i = 0; i < voxels.size() / 2; ++i)
  {
    range.Include(ValueAt(voxels.data(), ScalarType::UInt16, i));
  }
  // A foreign range is a hint and no more: what is skipped and drawn doesn't depend on it.
  EXPECT_EQ(info.Range, ValueRange::Unknown());
  EXPECT_EQ(hint.Range, range);
  ASSERT_EQ(hint.Histogram.size(), 256u);
  double sum = 0;
  for (const double n : hint.Histogram)
  {
    sum += n;
  }
  EXPECT_EQ(sum, static_cast<double>(Size[0] * Size[1] * Size[2]));
  const VolumeDescription& d = source->Description();
  EXPECT_EQ(d.Format, "Imaris");
  EXPECT_EQ(d.Unit, "um");
  EXPECT_EQ(d.Times.size(), 3u);
  ASSERT_EQ(d.Channels.size(), 2u);
  EXPECT_EQ(d.Channels[0].Name, "Nuclei");
  EXPECT_EQ(*d.Channels[0].Color, (Double3{ 1, 0, 0.5 }));
  EXPECT_NE(SeenBy(*source).find("ImarisDataSet"), std::string::npos) << SeenBy(*source);
}

TEST(FormatsImaris, AllChannelsAreComponents)
{
  TERAVOX_FORMAT_FILES(files, "imaris");
  const auto source =
    OpenFormat(files->File("small.ims"), FormatOptions(VolumeRequest::AllChannels, 1));
  ASSERT_TRUE(source);
  EXPECT_EQ(source->Info().Components, 2);
  for (int level = 0; level < 4; ++level)
  {
    const auto name = [&](int c)
    { return "small.1." + std::to_string(c) + "." + std::to_string(level); };
    const std::vector<std::byte> a = files->Array(name(0));
    const std::vector<std::byte> b = files->Array(name(1));
    std::vector<std::byte> both(a.size() * 2);
    for (std::size_t v = 0; v < a.size() / 2; ++v)
    {
      std::memcpy(both.data() + 4 * v, a.data() + 2 * v, 2);
      std::memcpy(both.data() + 4 * v + 2, b.data() + 2 * v, 2);
    }
    ExpectLevelIs(
      *source, level, { Size[0] >> level, Size[1] >> level, Size[2] >> level }, both, 4);
  }
}

TEST(FormatsImaris, AFileWithoutSizesIsReadByItsDatasets)
{
  TERAVOX_FORMAT_FILES(files, "imaris");
  const auto source = OpenFormat(files->File("minimal.ims"));
  ASSERT_TRUE(source);
  ExpectLevelIs(*source, 0, { 32, 16, 8 }, files->Array("minimal"), 1);
  EXPECT_FALSE(source->Info().Range.IsKnown());
  EXPECT_NE(SeenBy(*source).find("No extents"), std::string::npos) << SeenBy(*source);
}

TEST(FormatsImaris, ContradictionsAreNamed)
{
  TERAVOX_FORMAT_FILES(files, "imaris");
  const auto fails = [&](const std::string& name, StatusCode code, const std::string& text)
  { ExpectOpenFails(files->File(name + ".ims"), FormatOptions(), code, text); };
  fails("too_large", StatusCode::Corrupt, "100000");
  fails("other_sizes", StatusCode::Corrupt, "1009");
  fails("negative_extent", StatusCode::Corrupt, "extents");
  fails("no_data", StatusCode::NotFound, "ResolutionLevel 1/TimePoint 0/Channel 0/Data");
  fails("no_level", StatusCode::Corrupt, "ResolutionLevel 1' is missing");
  fails("loop", StatusCode::NotFound, "Channel 0/Data");
  ExpectOpenFails(files->File("small.ims"), FormatOptions(2), StatusCode::InvalidArgument,
    "2 channels, counted from 0; there is no channel 2");
  ExpectOpenFails(files->File("small.ims"), FormatOptions(0, 3), StatusCode::InvalidArgument,
    "3 time points, counted from 0; there is no time point 3");
  ExpectOpenFails(
    files->File("small.ims"), FormatOptions(-2), StatusCode::InvalidArgument, "no channel -2");
  // A time point that isn't there doesn't count.
  const auto source = OpenFormat(files->File("no_times.ims"), FormatOptions(0, 1));
  ASSERT_TRUE(source);
  EXPECT_EQ(source->Description().Times, (std::vector<double>{ 1, 2 }));
  ExpectLevelIs(*source, 0, Size, files->Array("small.2.0.0"), 2);
  // The size is the image's where the level says nothing that can be.
  const auto other = OpenFormat(files->File("no_number.ims"));
  ASSERT_TRUE(other);
  EXPECT_EQ(other->Info().Layout.Dimensions(0), Size);
}

} // namespace
} // namespace teravox::testing
