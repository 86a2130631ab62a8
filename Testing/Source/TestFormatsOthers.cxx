// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "TestFormatsSupport.h"

#include <cmath>

namespace teravox::testing
{
namespace
{

constexpr Int3 Small{ 13, 11, 9 };

/// All levels of an N5 volume; level l is in the array NAME.l.
void ExpectLevels(HDF5BrickSource& source, const FormatFiles& files, const std::string& name,
  const Int3& size, bool ceil = false)
{
  const std::vector<Int3> factors{ { 1, 1, 1 }, { 2, 2, 1 }, { 4, 4, 2 } };
  ASSERT_EQ(source.Info().Layout.NumberOfLevels(), 3);
  for (int level = 0; level < 3; ++level)
  {
    const Int3& f = factors[static_cast<std::size_t>(level)];
    EXPECT_EQ(source.Info().Layout.Factor(level), f);
    Int3 has{};
    for (std::size_t a = 0; a < 3; ++a)
    {
      has[a] = ceil ? CeilDiv(size[a], f[a]) : size[a] / f[a];
    }
    ExpectLevelIs(source, level, has, files.Array(name + "." + std::to_string(level)),
      SizeOf(source.Info().Type));
  }
}

TEST(FormatsN5, MultiscaleGroupsByAttributesNamesAndTexts)
{
  TERAVOX_FORMAT_FILES(files, "n5");
  const Int3 size{ 45, 38, 17 };
  const auto plain = OpenFormat(files->File("plain.h5"));
  ASSERT_TRUE(plain);
  EXPECT_EQ(plain->Info().Spacing, (Double3{ 4, 4, 40 }));
  EXPECT_EQ(plain->Info().Origin, (Double3{ 1, 2, 3 }));
  ExpectLevels(*plain, *files, "plain", size, true);
  const auto names = OpenFormat(files->File("names.h5"));
  ASSERT_TRUE(names);
  ExpectLevels(*names, *files, "names", size);
  EXPECT_NE(SeenBy(*names).find("'/a/b' has the children s0"), std::string::npos);
  const auto json = OpenFormat(files->File("json.h5"));
  ASSERT_TRUE(json);
  EXPECT_EQ(json->Info().Spacing, (Double3{ 2, 3, 5 }));
  ExpectLevels(*json, *files, "json", size);
  const auto byPath = OpenFormat(files->File("plain.h5"), FormatOptions(0, 0, "volumes/raw"));
  ASSERT_TRUE(byPath);
  EXPECT_EQ(byPath->Info().Layout.NumberOfLevels(), 3);
}

TEST(FormatsN5, PainteraSaysWhatIsLabels)
{
  TERAVOX_FORMAT_FILES(files, "n5");
  const auto source = OpenFormat(files->File("paintera.h5"));
  ASSERT_TRUE(source);
  EXPECT_TRUE(source->Info().Labels);
  EXPECT_EQ(source->Info().ArrayName, "segmentation");
  EXPECT_EQ(source->Info().Spacing, (Double3{ 1, 1, 10 }));
  ExpectLevels(*source, *files, "paintera", { 45, 38, 17 });
  ExpectOpenFails(
    files->File("multiset.h5"), FormatOptions(), StatusCode::Unsupported, "multisets");
}

TEST(FormatsN5, IntegersOf64BitsAreReadWhereTheyFit)
{
  TERAVOX_FORMAT_FILES(files, "n5");
  const std::string file = files->File("wide.h5");
  for (const auto& [name, array] :
    std::vector<std::pair<std::string, std::string>>{ { "labels", "labels" },
      { "turned", "labels" }, { "signed", "signed" }, { "scaled", "signed" } })
  {
    SCOPED_TRACE(name);
    const auto source = OpenFormat(file, FormatOptions(0, 0, name));
    ASSERT_TRUE(source);
    EXPECT_EQ(source->Info().Type, array == "labels" ? ScalarType::UInt32 : ScalarType::Int32);
    ExpectLevelIs(*source, 0, { 21, 20, 17 }, files->Array("wide." + array), 4);
  }
  // One that doesn't fit is an error of its chunk, and no other number.
  const auto beyond = OpenFormat(file, FormatOptions(0, 0, "beyond"));
  ASSERT_TRUE(beyond);
  EXPECT_TRUE(beyond->ReadBrick(BrickKey::Of(0, { 0, 0, 0 })).Ok());
  const Status status = beyond->ReadBrick(BrickKey::Of(0, { 1, 1, 1 })).GetStatus();
  EXPECT_EQ(status.Code(), StatusCode::Unsupported);
  EXPECT_NE(status.Message().find("4294967296"), std::string::npos) << status.Message();
  ExpectOpenFails(file, FormatOptions(0, 0, "fill"), StatusCode::Unsupported, "fill value");
}

TEST(FormatsN5, SetupsAndTimePoints)
{
  TERAVOX_FORMAT_FILES(files, "n5");
  for (int t = 0; t < 2; ++t)
  {
    for (int s = 0; s < 2; ++s)
    {
      const auto source = OpenFormat(files->File("views.h5"), FormatOptions(s, t));
      ASSERT_TRUE(source);
      EXPECT_EQ(source->Info().Spacing, (Double3{ 0.5, 0.5, 1.0 + s }));
      EXPECT_EQ(source->Description().Times, (std::vector<double>{ 0, 3 }));
      ExpectLevels(
        *source, *files, "views." + std::to_string(3 * t) + "." + std::to_string(s), { 30, 20, 9 });
    }
  }
  ExpectOpenFails(
    files->File("views.h5"), FormatOptions(2), StatusCode::InvalidArgument, "no channel 2");
}

TEST(FormatsN5, LevelsByFractionsAreLeftOutAndSaidToBe)
{
  TERAVOX_FORMAT_FILES(files, "n5");
  const auto source = OpenFormat(files->File("fraction.h5"));
  ASSERT_TRUE(source);
  EXPECT_EQ(source->Info().Layout.NumberOfLevels(), 1);
  EXPECT_NE(SeenBy(*source).find("left out"), std::string::npos) << SeenBy(*source);
}

TEST(FormatsVTKHDF, ArraysComponentsAndCells)
{
  TERAVOX_FORMAT_FILES(files, "vtkhdf");
  const auto density = OpenFormat(files->File("static.vtkhdf"));
  ASSERT_TRUE(density);
  EXPECT_EQ(density->Info().ArrayName, "density");
  ExpectLevelIs(*density, 0, Small, files->Array("density"), 4);
  const auto velocity = OpenFormat(files->File("static.vtkhdf"), FormatOptions(1));
  ASSERT_TRUE(velocity);
  EXPECT_EQ(velocity->Info().Components, 3);
  ExpectLevelIs(*velocity, 0, Small, files->Array("velocity"), 12);
  const auto nine = OpenFormat(files->File("nine.vtkhdf"), FormatOptions(7));
  ASSERT_TRUE(nine);
  ExpectLevelIs(*nine, 0, Small, files->Array("nine"), 2);
  const auto cells = OpenFormat(files->File("cells.vtkhdf"));
  ASSERT_TRUE(cells);
  EXPECT_TRUE(cells->Info().CellData);
  EXPECT_EQ(cells->Info().Origin, (Double3{ 1.25, 2.5, 4 }));
  ExpectLevelIs(*cells, 0, { 12, 10, 8 }, files->Array("cells"), 2);
  const auto flat = OpenFormat(files->File("flat.vtkhdf"));
  ASSERT_TRUE(flat);
  EXPECT_EQ(flat->Info().Origin, (Double3{ 1, 2, 11 }));
  ExpectLevelIs(*flat, 0, { 13, 11, 1 }, files->Array("flat"), 1);
}

TEST(FormatsVTKHDF, StepsAreTime)
{
  TERAVOX_FORMAT_FILES(files, "vtkhdf");
  for (const char* name : { "moving", "chunks_of_steps" })
  {
    for (int t = 0; t < 3; ++t)
    {
      const auto source =
        OpenFormat(files->File(name + std::string(".vtkhdf")), FormatOptions(0, t));
      ASSERT_TRUE(source);
      EXPECT_EQ(source->Description().Times, (std::vector<double>{ 0.5, 1, 4 }));
      ExpectLevelIs(
        *source, 0, Small, files->Array(name + std::string(".") + std::to_string(t)), 2);
    }
    // An array that doesn't change.
    const auto still = OpenFormat(files->File(name + std::string(".vtkhdf")), FormatOptions(1, 2));
    ASSERT_TRUE(still);
    ExpectLevelIs(*still, 0, Small, files->Array(name + std::string(".0")), 2);
  }
}

TEST(FormatsVTKHDF, StepsOfAnyNumberOfComponents)
{
  TERAVOX_FORMAT_FILES(files, "vtkhdf");
  const auto nine = OpenFormat(files->File("nine_moving.vtkhdf"), FormatOptions(7, 1));
  ASSERT_TRUE(nine);
  EXPECT_EQ(nine->Description().Channels.size(), 9u);
  ExpectLevelIs(*nine, 0, Small, files->Array("nine_moving"), 4);
  const auto three = OpenFormat(files->File("three_moving.vtkhdf"), FormatOptions(0, 1));
  ASSERT_TRUE(three);
  EXPECT_EQ(three->Info().Components, 3);
  ExpectLevelIs(*three, 0, Small, files->Array("three_moving"), 3);
}

TEST(FormatsVTKHDF, ContradictionsAreNamed)
{
  TERAVOX_FORMAT_FILES(files, "vtkhdf");
  const auto fails = [&](const char* name, StatusCode code, const char* text, int time = 0)
  { ExpectOpenFails(files->File(name), FormatOptions(0, time), code, text); };
  fails("wrong_size.vtkhdf", StatusCode::Corrupt, "(9, 11, 13)");
  fails("bad_extent.vtkhdf", StatusCode::Corrupt, "WholeExtent");
  fails("grid.vtkhdf", StatusCode::Unsupported, "UnstructuredGrid");
  fails("moving.vtkhdf", StatusCode::InvalidArgument, "3 time points", 3);
}

TEST(FormatsSingle, AxesAndGeometryOfEveryLayout)
{
  TERAVOX_FORMAT_FILES(files, "single");
  const std::vector<std::byte> a = files->Array("a");
  const auto emd = OpenFormat(files->File("emd.emd"));
  ASSERT_TRUE(emd);
  EXPECT_EQ(emd->Info().Spacing, (Double3{ 0.5, 0.25, 2 }));
  EXPECT_EQ(emd->Info().Origin, (Double3{ 10, 20, 30 }));
  EXPECT_EQ(emd->Description().Unit, "[n_m]");
  ExpectLevelIs(*emd, 0, Small, a, 2);
  const auto exchange = OpenFormat(files->File("exchange.h5"));
  ASSERT_TRUE(exchange);
  EXPECT_EQ(exchange->Description().Format, "Data Exchange");
  EXPECT_NE(SeenBy(*exchange).find("projections"), std::string::npos);
  ExpectLevelIs(*exchange, 0, Small, a, 2);
  const auto nexus = OpenFormat(files->File("nexus.nxs"));
  ASSERT_TRUE(nexus);
  EXPECT_EQ(nexus->Description().Format, "NeXus");
  EXPECT_EQ(nexus->Info().Spacing, (Double3{ 1, 1, 1.5 }));
  EXPECT_EQ(nexus->Info().Origin, (Double3{ 0, 0, 5 }));
  ExpectLevelIs(*nexus, 0, Small, a, 2);
  const auto ilastik = OpenFormat(files->File("ilastik.h5"), FormatOptions(0, 0, "exported_data"));
  ASSERT_TRUE(ilastik);
  EXPECT_EQ(ilastik->Info().Components, 2);
  ExpectLevelIs(*ilastik, 0, Small, files->Array("ilastik"), 4);
}

TEST(FormatsSingle, MINCSaysWhereItsAxesLie)
{
  TERAVOX_FORMAT_FILES(files, "single");
  for (const char* name : { "minc.mnc", "turned.mnc", "times.mnc", "vectors.mnc" })
  {
    SCOPED_TRACE(name);
    const bool vectors = std::string(name) == "vectors.mnc";
    const bool times = std::string(name) == "times.mnc";
    const auto minc = OpenFormat(files->File(name), FormatOptions(0, times ? 1 : 0));
    ASSERT_TRUE(minc);
    const VolumeInfo& info = minc->Info();
    EXPECT_EQ(minc->Description().Format, "MINC 2");
    EXPECT_EQ(info.Spacing, (Double3{ 0.5, 0.75, 2 }));
    const double c = std::cos(0.3);
    const double s = std::sin(0.3);
    const std::array<double, 9> direction{ c, -s, 0, s, c, 0, 0, 0, -1 };
    const Double3 origin{ -10 * c + 20 * s, -10 * s - 20 * c, 30 };
    for (std::size_t i = 0; i < 9; ++i)
    {
      EXPECT_NEAR(info.Direction.at(i), direction.at(i), 1e-12);
      EXPECT_NEAR(info.Origin.at(i % 3), origin.at(i % 3), 1e-12);
    }
    EXPECT_EQ(info.Components, vectors ? 3 : 1);
    ExpectLevelIs(*minc, 0, Small, files->Array(vectors ? "vectors" : "a"), vectors ? 6 : 2);
    EXPECT_EQ(minc->Description().Times,
      times ? (std::vector<double>{ 1, 1.25 }) : std::vector<double>{ 0 });
    EXPECT_NE(SeenBy(*minc).find(
                std::string(name) == "turned.mnc" ? "differ between slices" : "0.000000 to 100.0"),
      std::string::npos);
  }
  ExpectOpenFails(files->File("first.mnc"), FormatOptions(), StatusCode::Corrupt, "mincconvert -2");
  ExpectOpenFails(files->File("twice.mnc"), FormatOptions(), StatusCode::Corrupt, "twice");
  ExpectOpenFails(files->File("other.mnc"), FormatOptions(), StatusCode::Unsupported, "frequency");
  ExpectOpenFails(
    files->File("times.mnc"), FormatOptions(0, 2), StatusCode::InvalidArgument, "time");
}

TEST(FormatsSingle, DatasetsOfThreeToFiveAxesByPath)
{
  TERAVOX_FORMAT_FILES(files, "single");
  const std::string many = files->File("many.h5");
  const auto open = [&](const char* path, int channel = 0, int time = 0)
  { return OpenFormat(many, FormatOptions(channel, time, path)); };
  const auto time = open("time", 0, 2);
  ASSERT_TRUE(time);
  ExpectLevelIs(*time, 0, Small, files->Array("time.2"), 2);
  const auto five = open("/five", 2, 1);
  ASSERT_TRUE(five);
  EXPECT_EQ(five->Description().Channels.size(), 3u);
  ExpectLevelIs(*five, 0, Small, files->Array("five.1.2"), 2);
  const auto all = OpenFormat(many, FormatOptions(VolumeRequest::AllChannels, 0, "five"));
  ASSERT_TRUE(all);
  EXPECT_EQ(all->Info().Components, 3);
  ExpectLevelIs(*all, 0, Small, files->Array("rgb"), 6);
  const auto rgb = open("rgb");
  ASSERT_TRUE(rgb);
  ExpectLevelIs(*rgb, 0, Small, files->Array("rgb"), 6);
  const auto labelled = open("labelled");
  ASSERT_TRUE(labelled);
  EXPECT_EQ(labelled->Info().Spacing, (Double3{ 1, 2, 3 }));
  ExpectLevelIs(*labelled, 0, Small, files->Array("a"), 2);
  const auto boolean = open("boolean");
  ASSERT_TRUE(boolean);
  ExpectLevelIs(*boolean, 0, Small, files->Array("boolean"), 1);
  const auto tags = open("bad_tags");
  ASSERT_TRUE(tags);
  ExpectLevelIs(*tags, 0, Small, files->Array("a"), 2);
  ExpectOpenFails(many, FormatOptions(0, 3, "time"), StatusCode::InvalidArgument, "3 time points");
  ExpectOpenFails(many, FormatOptions(), StatusCode::NotFound, "'/deep/er/still'");
  const auto one = OpenFormat(files->File("one.h5"));
  ASSERT_TRUE(one);
  EXPECT_NE(SeenBy(*one).find("only one"), std::string::npos) << SeenBy(*one);
  ExpectLevelIs(*one, 0, Small, files->Array("a"), 2);
}

TEST(FormatsSingle, MoreThanTwoToTheThirtyThreeVoxels)
{
  TERAVOX_FORMAT_FILES(files, "single");
  HDF5OpenOptions options;
  const auto source = OpenFormat(files->File("large.h5"), options);
  ASSERT_TRUE(source);
  EXPECT_EQ(source->Info().Layout.Dimensions(0), (Int3{ 2100, 2000, 2500 }));
  const auto at = [&](std::uint32_t x, std::uint32_t y, std::uint32_t z)
  {
    const auto brick = source->ReadBrick(BrickKey::Of(0, { x, y, z }));
    EXPECT_TRUE(brick.Ok());
    return std::to_integer<int>(
      brick.Value()->Voxels[static_cast<std::size_t>(((40 * 68) + 20) * 68 + 20)]);
  };
  EXPECT_EQ(at(32, 30, 38), 7); // voxel 2066 x 1938 x 2470: index 10^10
  EXPECT_EQ(at(31, 30, 38), 0);
  EXPECT_EQ(at(32, 30, 37), 0);
  EXPECT_EQ(
    source->ReadRanges(BrickKey::Of(0, { 5, 5, 5 }), { 1, 1, 1 }).Value()[0], (ValueRange{ 0, 0 }));
}

} // namespace
} // namespace teravox::testing
