// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "TestFormatsSupport.h"

namespace teravox::testing
{
namespace
{

TEST(FormatsBigDataViewer, EveryLevelTimePointAndSetupIsWhatWasWritten)
{
  TERAVOX_FORMAT_FILES(files, "bigdataviewer");
  const std::vector<Int3> sizes{ { 43, 37, 13 }, { 21, 18, 13 }, { 10, 9, 6 } };
  for (int time = 0; time < 2; ++time)
  {
    for (int setup = 0; setup < 2; ++setup)
    {
      const auto source = OpenFormat(files->File("legacy.h5"), FormatOptions(setup, time));
      ASSERT_TRUE(source);
      EXPECT_EQ(source->BytesRead(), 0u);
      // Signed in the file, and values above 32767.
      EXPECT_EQ(source->Info().Type, ScalarType::UInt16);
      ASSERT_EQ(source->Info().Layout.NumberOfLevels(), 3);
      EXPECT_EQ(source->Info().Layout.Factor(2), (Int3{ 4, 4, 2 }));
      for (int level = 0; level < 3; ++level)
      {
        ExpectLevelIs(*source, level, sizes[static_cast<std::size_t>(level)],
          files->Array("legacy." + std::to_string(time) + "." + std::to_string(setup) + "." +
            std::to_string(level)),
          2);
      }
    }
  }
}

TEST(FormatsBigDataViewer, GeometryIsThatOfTheXml)
{
  TERAVOX_FORMAT_FILES(files, "bigdataviewer");
  // Beside the file, and by its own name; a set-up with transforms, and one without.
  for (const char* name : { "legacy.h5", "legacy.xml", "elsewhere/moved.xml" })
  {
    SCOPED_TRACE(name);
    const auto turned = OpenFormat(files->File(name), FormatOptions(0, 1));
    ASSERT_TRUE(turned);
    const VolumeInfo& info = turned->Info();
    // Moved after it was turned by 90 degrees about z: (x, y) becomes (-y, x).
    EXPECT_EQ(info.Origin, (Double3{ 100, -20, 5 }));
    EXPECT_EQ(info.Spacing, (Double3{ 0.5, 0.5, 2 }));
    EXPECT_EQ(info.Direction, (std::array<double, 9>{ 0, -1, 0, 1, 0, 0, 0, 0, 1 }));
    EXPECT_EQ(info.ArrayName, "Left arm");
    const auto plain = OpenFormat(files->File(name), FormatOptions(1, 1));
    ASSERT_TRUE(plain);
    EXPECT_EQ(plain->Info().Spacing, (Double3{ 0.25, 0.5, 1.5 }));
    EXPECT_EQ(plain->Info().Origin, (Double3{ 0, 0, 0 }));
    EXPECT_EQ(plain->Description().Unit, "micrometer");
    EXPECT_EQ(plain->Description().Channels[0].Name, "Left arm");
  }
}

TEST(FormatsBigDataViewer, WithoutXmlAndWithBlocksLeftOut)
{
  TERAVOX_FORMAT_FILES(files, "bigdataviewer");
  const auto source = OpenFormat(files->File("pyflavour.h5"));
  ASSERT_TRUE(source);
  EXPECT_NE(SeenBy(*source).find("No XML file"), std::string::npos) << SeenBy(*source);
  EXPECT_EQ(source->Info().Type, ScalarType::UInt8);
  // What isn't stored is known to be empty, brick by brick and region by region, without reading.
  const auto ranges = source->ReadRanges(BrickKey(), source->Info().Layout.Bricks(0));
  ASSERT_TRUE(ranges.Ok());
  const Int3 bricks = source->Info().Layout.Bricks(0);
  for (std::int64_t i = 0; i < bricks[0] * bricks[1] * bricks[2]; ++i)
  {
    // Chunks of 8 end at 24, bricks of 16 have a border of 2.
    EXPECT_EQ(ranges.Value()[static_cast<std::size_t>(i)],
      i % bricks[0] == 2 ? (ValueRange{ 0, 0 }) : ValueRange::Unknown())
      << i;
  }
  BrickKey region;
  region.PageLevel = 1;
  EXPECT_EQ(source->ReadRanges(region, { 1, 1, 1 }).Value()[0], ValueRange::Unknown());
  EXPECT_EQ(source->BytesRead(), 0u);
  ExpectLevelIs(*source, 0, { 45, 48, 40 }, files->Array("pyflavour.0"), 1);
  ExpectLevelIs(*source, 1, { 23, 24, 20 }, files->Array("pyflavour.1"), 1);
}

TEST(FormatsBigDataViewer, TypesAreWhatTheFileSays)
{
  TERAVOX_FORMAT_FILES(files, "bigdataviewer");
  const auto source = OpenFormat(files->File("signed.h5"));
  ASSERT_TRUE(source);
  EXPECT_EQ(source->Info().Type, ScalarType::Int16);
  ExpectLevelIs(*source, 0, { 10, 8, 6 }, files->Array("signed"), 2);
  const auto wide = OpenFormat(files->File("wide.h5"));
  ASSERT_TRUE(wide);
  EXPECT_EQ(wide->Info().Type, ScalarType::UInt32);
  ExpectLevelIs(*wide, 0, { 10, 8, 6 }, files->Array("wide"), 4);
}

TEST(FormatsBigDataViewer, PartitionsAreFollowedAndAMissingOneIsNamed)
{
  TERAVOX_FORMAT_FILES(files, "bigdataviewer");
  const std::string file = files->File("parts.h5");
  const auto source = OpenFormat(file);
  ASSERT_TRUE(source);
  ExpectLevelIs(*source, 0, { 10, 8, 6 }, files->Array("parts"), 2);
  ExpectOpenFails(file, FormatOptions(0, 1), StatusCode::NotFound, "'parts-01-00.h5'");
  // A pipe would be waited for.
  ExpectOpenFails(file, FormatOptions(0, 2), StatusCode::NotFound, "pipe.h5");
}

TEST(FormatsBigDataViewer, DamagedXmlIsNamed)
{
  TERAVOX_FORMAT_FILES(files, "bigdataviewer");
  const auto fails = [&](const std::string& name, StatusCode code, const std::string& text)
  { ExpectOpenFails(files->File(name), FormatOptions(0, 1), code, text); };
  fails("singular.xml", StatusCode::Corrupt, "spacing");
  fails("words.xml", StatusCode::Corrupt, "12 numbers");
  fails("n5.xml", StatusCode::Unsupported, "bdv.n5");
  fails("cut.xml", StatusCode::Corrupt, "damaged");
  const Status lost = HDF5BrickSource::Open(files->File("lost.xml"), {}).GetStatus();
  EXPECT_EQ(lost.Code(), StatusCode::NotFound);
  EXPECT_NE(lost.Message().find("lost.h5"), std::string::npos) << lost.Message();
  ExpectOpenFails(
    files->File("legacy.h5"), FormatOptions(2), StatusCode::InvalidArgument, "2 channels");
}

TEST(FormatsBigDataViewer, ScaleOffsetOfEveryWidthIsDecodedHere)
{
  TERAVOX_FORMAT_FILES(files, "bigdataviewer");
  int read = 0;
  for (const char* type : { "u1", "i1", "u2", "i2", "beu2", "bei2", "u4", "i4", "bei4" })
  {
    for (const int bits : { 0, 1, 5, 8, 13, 16, 27, 32 })
    {
      const std::string name = std::string(type) + "." + std::to_string(bits);
      if (!std::filesystem::exists(files->File("scaleoffset." + name + ".bin")))
      {
        continue;
      }
      SCOPED_TRACE(name);
      const auto source = OpenFormat(files->File("scaleoffset.h5"), FormatOptions(0, 0, name));
      ASSERT_TRUE(source);
      ExpectLevelIs(*source, 0, { 13, 11, 9 }, files->Array("scaleoffset." + name),
        SizeOf(source->Info().Type));
      ++read;
    }
  }
  EXPECT_EQ(read, 2 * 4 + 4 * 6 + 3 * 8);
}

} // namespace
} // namespace teravox::testing
