// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "TestFormatsSupport.h"

namespace teravox::testing
{
namespace
{

TEST(FormatsNGFF, LevelsAndTheirPlace)
{
  TERAVOX_FORMAT_FILES(files, "ngff");
  const auto source = OpenFormat(files->File("plain.h5"));
  ASSERT_TRUE(source);
  EXPECT_EQ(source->Description().Format, "OME-NGFF") << SeenBy(*source);
  const VolumeInfo& info = source->Info();
  ASSERT_EQ(info.Layout.NumberOfLevels(), 3);
  EXPECT_EQ(info.Layout.Factor(2), (Int3{ 4, 4, 2 }));
  EXPECT_EQ(info.Spacing, (Double3{ 0.25, 0.5, 2 }));
  EXPECT_EQ(info.Origin, (Double3{ 3, 2, 1 }));
  EXPECT_EQ(source->Description().Unit, "micrometer");
  ExpectLevelIs(*source, 0, { 44, 36, 18 }, files->Array("plain.0"), 2);
  ExpectLevelIs(*source, 1, { 22, 18, 18 }, files->Array("plain.1"), 2);
  ExpectLevelIs(*source, 2, { 11, 9, 9 }, files->Array("plain.2"), 2);
}

TEST(FormatsNGFF, ChannelsAndTimePoints)
{
  TERAVOX_FORMAT_FILES(files, "ngff");
  for (const char* name : { "five.h5", "wrapped.h5" })
  {
    SCOPED_TRACE(name);
    const auto source = OpenFormat(files->File(name), FormatOptions(1, 1));
    ASSERT_TRUE(source);
    const VolumeDescription& d = source->Description();
    ASSERT_EQ(d.Channels.size(), 2u);
    EXPECT_EQ(d.Times.size(), 2u);
    EXPECT_EQ(d.Channels[0].Name, "DAPI");
    EXPECT_EQ(d.Channels[1].Color, (Double3{ 0, 1, 0 }));
    EXPECT_EQ(d.Channels[0].Display, (ValueRange{ 100, 900 }));
    for (int level = 0; level < 3; ++level)
    {
      const Int3 sizes[] = { { 44, 36, 18 }, { 22, 18, 18 }, { 11, 9, 9 } };
      ExpectLevelIs(*source, level, sizes[level], files->Array("five." + std::to_string(level)), 1);
    }
    ExpectOpenFails(
      files->File(name), FormatOptions(2, 0), StatusCode::InvalidArgument, "no channel 2");
    const auto all = OpenFormat(files->File(name), FormatOptions(VolumeRequest::AllChannels, 0));
    ASSERT_TRUE(all);
    EXPECT_EQ(all->Info().Components, 2);
  }
}

TEST(FormatsNGFF, OldAndOddOnes)
{
  TERAVOX_FORMAT_FILES(files, "ngff");
  const auto old = OpenFormat(files->File("old.h5"));
  ASSERT_TRUE(old);
  ASSERT_EQ(old->Info().Layout.NumberOfLevels(), 3);
  EXPECT_EQ(old->Info().Layout.Factor(1), (Int3{ 2, 2, 1 }));
  ExpectLevelIs(*old, 1, { 22, 18, 18 }, files->Array("plain.1"), 2);
  const auto odd = OpenFormat(files->File("odd.h5"));
  ASSERT_TRUE(odd);
  EXPECT_EQ(odd->Info().Layout.NumberOfLevels(), 2);
  EXPECT_NE(SeenBy(*odd).find("lie elsewhere"), std::string::npos) << SeenBy(*odd);
  EXPECT_NE(SeenBy(*odd).find("whole numbers"), std::string::npos) << SeenBy(*odd);
}

TEST(FormatsNGFF, WhatDoesntFitIsNamed)
{
  TERAVOX_FORMAT_FILES(files, "ngff");
  const auto expect = [&](const char* name, const char* text)
  { ExpectOpenFails(files->File(name), FormatOptions(), StatusCode::Corrupt, text); };
  expect("missing.h5", "'/nowhere' isn't a dataset");
  expect("short.h5", "'/scale0' don't fit");
  expect("axis.h5", "'?yx'");
}

} // namespace
} // namespace teravox::testing
