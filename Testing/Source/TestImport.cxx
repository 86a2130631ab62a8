// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "AllocationFaults.h"
#include "Import/DICOMSeries.h"
#include "Import/FileList.h"
#include "Import/ImageVolume.h"
#include "Import/RawVolume.h"
#include "Import/SLCVolume.h"
#include "Import/SliceVoxelReader.h"
#include "Import/TIFFStack.h"
#include "ProcessMemory.h"
#include "TestImportSupport.h"

#include <algorithm>
#include <filesystem>
#include <functional>
#include <limits>
#include <random>
#include <sys/stat.h>

namespace teravox::testing
{
namespace
{

using Reader = std::shared_ptr<VoxelReader>;

Result<Reader> OpenRaw(const Result<RawVolume>& volume)
{
  return volume.Ok() ? RawVolume::Open(volume.Value(), 1 << 20)
                     : Result<Reader>(volume.GetStatus());
}

Result<Reader> OpenImage(const std::string& name)
{
  if (EndsWith(name, ".mha") || EndsWith(name, ".mhd"))
  {
    return OpenRaw(ReadMetaImageHeader(name));
  }
  if (EndsWith(name, ".nrrd") || EndsWith(name, ".nhdr"))
  {
    return OpenRaw(ReadNRRDHeader(name));
  }
  if (EndsWith(name, ".vtk"))
  {
    return OpenRaw(ReadLegacyVTKHeader(name));
  }
  if (EndsWith(name, ".nii") || EndsWith(name, ".nii.gz") || EndsWith(name, ".hdr"))
  {
    return OpenRaw(ReadNIfTIHeader(name, 0));
  }
  if (EndsWith(name, ".slc"))
  {
    return OpenSLC(name, std::uint64_t{ 1 } << 20);
  }
  for (const char* end :
    { ".mrc", ".mrcs", ".map", ".ccp4", ".rec", ".st", ".ali", ".mrc.gz", ".map.gz" })
  {
    if (EndsWith(name, end))
    {
      return OpenRaw(ReadMRCHeader(name, 0));
    }
  }
  const std::vector<std::string> files = IsPattern(name) ? FilesLike(name)
    : std::filesystem::is_directory(name)                ? FilesIn(name)
                                                         : std::vector<std::string>{ name };
  if (std::any_of(files.begin(), files.end(), &DICOMSeries::IsDICOM))
  {
    DICOMSeries::Request request;
    request.Files = files;
    return DICOMSeries::Open(request);
  }
  TIFFStack::Request request;
  std::copy_if(files.begin(), files.end(), std::back_inserter(request.Files),
    [](const std::string& file) { return EndsWith(file, ".tif"); });
  std::vector<std::string> others;
  return TIFFStack::Open(request, others);
}

TEST(Import, EveryFormatGivesItsVoxelsAndTheirPlace)
{
  TERAVOX_FORMAT_FILES(files, "images");
  const std::vector<Listed> all = ListOf(*files);
  ASSERT_GT(all.size(), 95u);
  std::mt19937 random(5);
  for (const Listed& one : all)
  {
    SCOPED_TRACE(one.Name);
    const auto opened = OpenImage(files->File(one.Name));
    ASSERT_TRUE(opened.Ok()) << opened.GetStatus().Message();
    ExpectIsListed(*opened.Value(), one, *files, random);
  }
}

TEST(Import, WhatCantBeReadIsNamed)
{
  TERAVOX_FORMAT_FILES(files, "images");
  const auto expect = [&](const char* name, StatusCode code, const char* text)
  {
    SCOPED_TRACE(name);
    const auto opened = OpenImage(files->File(name));
    Status status = opened.GetStatus();
    if (opened.Ok())
    {
      const VoxelReader::Description d = opened.Value()->Describe();
      std::vector<std::byte> all(static_cast<std::size_t>(d.Dimensions[0] * d.Dimensions[1] *
                                   d.Dimensions[2] * d.Components) *
        SizeOf(d.Type));
      status = opened.Value()->ReadBox({ 0, 0, 0 }, d.Dimensions, all.data());
    }
    EXPECT_EQ(status.Code(), code) << status.Message();
    EXPECT_NE(status.Message().find(text), std::string::npos) << status.Message();
    EXPECT_NE(status.Message().find(files->Folder.Path()), std::string::npos) << status.Message();
  };
  expect("gap", StatusCode::Unsupported, "evenly spaced");
  expect("cut.slc", StatusCode::Corrupt, "is cut off");
  expect("cut_coded.slc", StatusCode::Corrupt, "is cut off");
  expect("bits.slc", StatusCode::Unsupported, "other than 8 bits");
  expect("kind.slc", StatusCode::Unsupported, "another compression");
  expect("flat.slc", StatusCode::Corrupt, "a spacing that isn't above 0");
  expect("deep.slc", StatusCode::Corrupt, "is cut off");
  expect("wide.slc", StatusCode::Corrupt, "runs aren't those of a slice");
  expect("text.slc", StatusCode::Corrupt, "text.slc");
  expect("two", StatusCode::InvalidArgument, "1.2.1 (2 slices)");
  expect("cut", StatusCode::Corrupt, "0.dcm' is cut off");
  expect("packed.dcm", StatusCode::Unsupported, "1.2.840.10008.1.2.4.");
  expect("sizes", StatusCode::InvalidArgument, "2.tif' has a picture of another size");
  expect("cut.tif", StatusCode::Corrupt, "cut.tif");
  expect("cut.mha", StatusCode::Corrupt, "too short");
  expect("cut.nii.gz", StatusCode::Corrupt, "cut off");
  expect("long.mha", StatusCode::Unsupported, "MET_LONG");
  expect("text.nrrd", StatusCode::Unsupported, "bzip2");
  expect("cut.vtk", StatusCode::Corrupt, "too short");
  expect("word.vtk", StatusCode::Corrupt, "no number");
  expect("large.vtk", StatusCode::Corrupt, "no number that i16 holds");
  expect("vectors.vtk", StatusCode::Unsupported, "other arrays than scalars");
  expect("absent.mha", StatusCode::NotFound, "absent.mha");
  expect("absent.tif", StatusCode::NotFound, "absent.tif");
  expect("cut.mrc", StatusCode::Corrupt, "too short");
  expect("short.mrc", StatusCode::Corrupt, "fewer than 1024");
  expect("cut.map.gz", StatusCode::Corrupt, "cut off");
  expect("four.mrc", StatusCode::Unsupported, "mode 101, 4 bits");
  expect("complex.mrc", StatusCode::Unsupported, "mode 4, complex");
  expect("negative.mrc", StatusCode::Corrupt, "extended header of -5 bytes");
  expect("axes.mrc", StatusCode::Corrupt, "along axes 1, 2 and 2");
  expect("flat.mrc", StatusCode::Corrupt, "angles 90.000000, 90.000000 and 180");
  expect("text.mrc", StatusCode::Corrupt, "isn't an MRC file");
  expect("apart.ome.tif", StatusCode::NotFound, "has slice 0 in 'first.ome.tif'");
  expect("lost.ome.tif", StatusCode::Corrupt, "second.ome.tif");
  expect("short.ome.tif", StatusCode::Corrupt, "no page 4, where its OME-XML says slice 4");
  expect("axes.ome.tif", StatusCode::Corrupt, "DimensionOrder");
  expect("broken.ome.tif", StatusCode::Corrupt, "OME-XML that is damaged");
  expect("empty.ome.tif", StatusCode::NotFound, "absent.companion.ome");
  expect(
    "damaged.ome.tif", StatusCode::Corrupt, "damaged.companion.ome' has OME-XML that is damaged");
  const auto volume = ReadMRCHeader(files->File("volumes.mrcs"), 3);
  EXPECT_EQ(volume.GetStatus().Code(), StatusCode::InvalidArgument);
  const auto time = ReadNIfTIHeader(files->File("series.nii"), 2);
  EXPECT_EQ(time.GetStatus().Code(), StatusCode::InvalidArgument);
}

/// Headers that claim what can't be, or name what isn't a file, are errors with a reason: nothing
/// is computed or allocated with their numbers, and nothing waits.
TEST(Import, ClaimsOfHeadersAreChecked)
{
  TERAVOX_FORMAT_FILES(files, "images");
  const TemporaryFolder folder;
  const auto expect =
    [&](const std::string& name, const std::string& content, StatusCode code, const char* text)
  {
    SCOPED_TRACE(name + ": " + text);
    std::ofstream(folder.File(name), std::ios::binary) << content;
    ImageVolume::Request request;
    request.Name = folder.File(name);
    request.Memory = 16 << 20;
    const auto opened = ImageVolume::Open(request);
    EXPECT_EQ(opened.GetStatus().Code(), code) << opened.GetStatus().Message();
    EXPECT_NE(opened.GetStatus().Message().find(text), std::string::npos)
      << opened.GetStatus().Message();
  };
  const auto changed = [&](const char* name, const std::string& from, const std::string& to)
  {
    std::ifstream in(files->File(name), std::ios::binary);
    std::string whole((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
    const std::size_t at = whole.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return whole.replace(at, from.size(), to);
  };
  const auto meta = [&](const std::string& from, const std::string& to)
  { return changed("local_u2.mha", from, to); };
  const std::string list = meta("= LOCAL", "= LIST");
  expect(
    "list.mhd", list.substr(0, list.find("LIST") + 5), StatusCode::InvalidArgument, "can't be");
  for (const char* channels : { "0", "5", "1e300", "nan" })
  {
    expect("channels.mha", meta("OfChannels = 1", std::string("OfChannels = ") + channels),
      StatusCode::Unsupported, channels);
  }
  expect(
    "skip.mha", meta("NDims = 3", "NDims = 3\nHeaderSize = 1e300"), StatusCode::Corrupt, "1e300");
  expect(
    "place.mha", meta("Offset = 10.0", "Offset = nan"), StatusCode::Corrupt, "without a place");
  expect(
    "size.mha", meta("DimSize = 23", "DimSize = 2147483647"), StatusCode::Corrupt, "too short");
  expect("colours.nrrd", changed("colours.nrrd", "sizes: 4", "sizes: -1e99"),
    StatusCode::Unsupported, "4 axes");
  std::string first = changed("plain_u2.nii", "n+1", "n+1");
  first.replace(108, 4, "\xff\xff\xff\xff"); // NaN; found by FuzzImport
  expect("nan.nii", first, StatusCode::Corrupt, "begin nowhere");
  // Of NIfTI 2 the place of the voxels is a 64-bit number, here in a compressed stream.
  std::string second(544, '\0');
  const auto put = [&second](std::size_t at, auto value)
  { std::memcpy(second.data() + at, &value, sizeof(value)); };
  put(0, std::int32_t{ 540 });
  put(12, std::int16_t{ 2 });
  for (std::size_t i = 0; i < 4; ++i)
  {
    put(16 + 8 * i, std::int64_t{ i == 0 ? 3 : 4 });
    put(104 + 8 * i, 1.0);
  }
  put(168, std::numeric_limits<std::int64_t>::max());
  std::ofstream(folder.File("pair.hdr"), std::ios::binary) << second;
  expect("pair.img", "\x1f\x8b", StatusCode::InvalidArgument, "can't be");
  std::string sizes = changed("no_ending", "MAP ", "MAP ");
  sizes.replace(0, 4, "\xff\xff\xff\x7f");
  expect("size.mrc", sizes, StatusCode::Corrupt, "too short");
  sizes.replace(4, 8, "\xff\xff\xff\x7f\xff\xff\xff\x7f");
  expect("sizes.mrc", sizes, StatusCode::Corrupt, "more voxels than a file can have");
  // Bytes of a picture whose sizes have 31 bits each don't fit into 64 bits.
  std::string picture = changed("pages_f4.tif", "II", "II");
  const std::string width("\x00\x01\x04\x00\x01\x00\x00\x00\x2f\x00\x00\x00", 12);
  const std::string height("\x01\x01\x04\x00\x01\x00\x00\x00\x21\x00\x00\x00", 12);
  const std::string rows("\x16\x01\x04\x00\x01\x00\x00\x00\x05\x00\x00\x00", 12);
  for (const std::string& tag : { width, height, rows })
  {
    const std::size_t at = picture.find(tag);
    ASSERT_NE(at, std::string::npos);
    picture.replace(at + 8, 4, "\xff\xff\xff\x7f");
  }
  expect("size.tif", picture, StatusCode::Corrupt, "size.tif");
}

/// Each allocation of opening an image may fail: an error, and the next time it is opened. Not that
/// of listing a folder, which libstdc++ doesn't survive.
TEST(Import, AllocationsOfOpeningMayFail)
{
  TERAVOX_FORMAT_FILES(files, "images");
  for (const char* name : { "local_u2.mha", "pattern.mhd", "gzip.nrrd", "sform.nii.gz",
         "text_u1.vtk", "packed.mrc.gz", "imagej.tif", "ct/0.dcm" })
  {
    SCOPED_TRACE(name);
    ImageVolume::Request request;
    request.Name = files->File(name);
    std::int64_t failures = 0;
    bool met = true;
    for (std::int64_t n = 0; met; n += 1 + n / 50)
    {
      test::FailAllocationAfter(n);
      const auto opened = ImageVolume::Open(request);
      met = test::EndAllocationFault();
      ASSERT_TRUE(met || opened.Ok()) << opened.GetStatus().Message();
      failures += opened.Ok() ? 0 : 1;
    }
    EXPECT_GT(failures, 5);
  }
}

TEST(Import, NothingIsReadFromPipes)
{
  const TemporaryFolder folder;
  const std::string header = "ObjectType = Image\nNDims = 3\nDimSize = 2 2 2\n"
                             "ElementType = MET_UCHAR\nElementDataFile = pipe.mha\n";
  for (const char* name : { "pipe.mha", "pipe.nii", "pipe.nrrd", "pipe.vtk", "pipe.mrc", "pipe.tif",
         "pipe.dcm", "pipe.png", "pipe.jpg" })
  {
    ASSERT_EQ(::mkfifo(folder.File(name).c_str(), 0600), 0);
    ImageVolume::Request request;
    request.Name = folder.File(name);
    EXPECT_FALSE(ImageVolume::Open(request).Ok()) << name;
  }
  for (const char* kind : { "", "CompressedData = True\n", "BinaryData = False\n" })
  {
    std::ofstream(folder.File("image.mhd"), std::ios::binary) << kind + header;
    ImageVolume::Request request;
    request.Name = folder.File("image.mhd");
    const Status status = ImageVolume::Open(request).GetStatus();
    EXPECT_NE(status.Message().find("pipe.mha' is no regular file"), std::string::npos)
      << status.Message();
  }
}

TEST(Import, ChannelsTimesAndSeriesAreChosen)
{
  TERAVOX_FORMAT_FILES(files, "images");
  TIFFStack::Request request;
  request.Files = { files->File("imagej.tif") };
  request.Channel = 1;
  request.TimePoint = 1;
  std::vector<std::string> others;
  const auto stack = TIFFStack::Open(request, others);
  ASSERT_TRUE(stack.Ok()) << stack.GetStatus().Message();
  const std::vector<std::byte> pages = files->Array("stack");
  const std::size_t page = std::size_t{ 47 } * 33 * 2;
  std::vector<std::byte> read(page);
  ASSERT_TRUE(stack.Value()->ReadBox({ 0, 0, 2 }, { 47, 33, 1 }, read.data()).Ok());
  EXPECT_EQ(std::memcmp(read.data(), pages.data() + 11 * page, page), 0);
  request.Channel = 2;
  EXPECT_EQ(TIFFStack::Open(request, others).GetStatus().Code(), StatusCode::InvalidArgument);
  request.Files = { files->File("pages.ome.tif") };
  const auto listed = TIFFStack::Open(request, others);
  ASSERT_TRUE(listed.Ok()) << listed.GetStatus().Message();
  ASSERT_TRUE(listed.Value()->ReadBox({ 0, 0, 3 }, { 47, 33, 1 }, read.data()).Ok());
  EXPECT_EQ(std::memcmp(read.data(), files->Array("pages_2_1").data() + 3 * page, page), 0);
  request.Channel = 3;
  EXPECT_EQ(TIFFStack::Open(request, others).GetStatus().Code(), StatusCode::InvalidArgument);
  EXPECT_TRUE(others.empty());

  // Slices in two files, by the XML of either, and by a companion's.
  request.Channel = 2;
  for (const char* name :
    { "first.part.ome.tif", "second.part.ome.tif", "first.only.ome.tif", "second.only.ome.tif" })
  {
    request.Files = { files->File(name) };
    const auto parts = TIFFStack::Open(request, others);
    ASSERT_TRUE(parts.Ok()) << parts.GetStatus().Message();
    EXPECT_EQ(others.size(), std::string(name).find("only") == std::string::npos ? 1u : 2u);
    for (std::int64_t z = 0; z < 4; ++z)
    {
      ASSERT_TRUE(parts.Value()->ReadBox({ 0, 0, z }, { 47, 33, 1 }, read.data()).Ok());
      EXPECT_EQ(std::memcmp(read.data(),
                  files->Array("pages_2_1").data() + static_cast<std::size_t>(z) * page, page),
        0)
        << name << ", " << z;
    }
  }

  DICOMSeries::Request series;
  series.Files = FilesIn(files->File("two"));
  series.Series = "1.2.0";
  const auto chosen = DICOMSeries::Open(series);
  ASSERT_TRUE(chosen.Ok()) << chosen.GetStatus().Message();
  EXPECT_EQ(chosen.Value()->Describe().Dimensions[2], 2);
  EXPECT_NEAR(chosen.Value()->Describe().Spacing[2], 4, 1e-6);

  const auto second = OpenRaw(ReadMRCHeader(files->File("volumes.mrcs"), 1));
  ASSERT_TRUE(second.Ok());
  ASSERT_TRUE(second.Value()->ReadBox({ 0, 0, 0 }, { 23, 17, 1 }, read.data()).Ok());
  const std::vector<std::byte> volumes = files->Array("no_ending");
  EXPECT_EQ(std::memcmp(read.data(), volumes.data() + 3 * 23 * 17 * 2, 23 * 17 * 2), 0);
  EXPECT_TRUE(ImageVolume::IsImage(files->File("no_ending")));

  const auto later = OpenRaw(ReadNIfTIHeader(files->File("series.nii"), 1));
  ASSERT_TRUE(later.Ok());
  EXPECT_EQ(later.Value()->Describe().Dimensions[2], 9);
}

TEST(Import, SlicesAreReadOnceWhileTheyFit)
{
  TERAVOX_FORMAT_FILES(files, "images");
  for (const bool fit : { true, false })
  {
    const auto opened = OpenImage(files->File("stack"));
    ASSERT_TRUE(opened.Ok());
    auto* slices = dynamic_cast<SliceVoxelReader*>(opened.Value().get());
    ASSERT_NE(slices, nullptr);
    slices->SetCacheLimit(fit ? 12 * slices->SliceBytes() : 0);
    std::vector<std::byte> box(std::size_t{ 8 } * 8 * 12 * 2);
    for (std::int64_t x = 0; x < 40; x += 8)
    {
      ASSERT_TRUE(slices->ReadBox({ x, 0, 0 }, { 8, 8, 12 }, box.data()).Ok());
    }
    EXPECT_EQ(slices->SlicesRead(), fit ? 12u : 60u);
  }
}

/// Of text, legacy VTK and palettes, too, only pieces are in memory, not the volume.
TEST(Import, ReadersHoldLessThanAQuarterOfTheVolume)
{
  TERAVOX_FORMAT_FILES(files, "images");
  for (const char* name :
    { "held.vtk", "held_binary.vtk", "held.nrrd", "held.mrc.gz", "held_palette.tif" })
  {
    SCOPED_TRACE(name);
    const std::vector<std::byte> truth =
      files->Array(EndsWith(name, ".tif") ? "held_grey" : "held");
    const std::uint64_t before = test::AllocatedBytes();
    const auto opened = OpenImage(files->File(name));
    ASSERT_TRUE(opened.Ok()) << opened.GetStatus().Message();
    auto* slices = dynamic_cast<SliceVoxelReader*>(opened.Value().get());
    if (slices != nullptr)
    {
      slices->SetCacheLimit(2 * slices->SliceBytes());
    }
    const VoxelReader::Description d = opened.Value()->Describe();
    const std::size_t slice = truth.size() / static_cast<std::size_t>(d.Dimensions[2]);
    std::vector<std::byte> slab(2 * slice);
    std::uint64_t most = 0;
    for (std::int64_t z = 0; z < d.Dimensions[2]; z += 2)
    {
      const Status status =
        opened.Value()->ReadBox({ 0, 0, z }, { d.Dimensions[0], d.Dimensions[1], 2 }, slab.data());
      ASSERT_TRUE(status.Ok()) << status.Message();
      ASSERT_EQ(
        std::memcmp(slab.data(), truth.data() + static_cast<std::size_t>(z) * slice, slab.size()),
        0)
        << z;
      most = std::max(most, test::AllocatedBytes());
    }
    EXPECT_LT(most - std::min(most, before), truth.size() / 4 + slab.size());
    if (slices != nullptr)
    {
      EXPECT_EQ(slices->SlicesRead(), static_cast<std::uint64_t>(d.Dimensions[2]));
    }
  }
}

TEST(Import, NamesAreInNaturalOrder)
{
  const TemporaryFolder folder;
  for (const char* name : { "a10.tif", "a9.tif", "a09b.tif", "b1.tif", "a100.tif", ".a1.tif" })
  {
    std::ofstream(folder.File(name)) << "x";
  }
  const auto names = [&](const std::vector<std::string>& files)
  {
    std::string all;
    for (const std::string& file : files)
    {
      all += file.substr(folder.Path().size() + 1) + " ";
    }
    return all;
  };
  EXPECT_EQ(names(FilesIn(folder.Path())), "a9.tif a09b.tif a10.tif a100.tif b1.tif ");
  EXPECT_EQ(names(FilesLike(folder.File("a%d.tif"))), "a9.tif a10.tif a100.tif ");
  EXPECT_EQ(names(FilesLike(folder.File("a%02d.tif"))), "a10.tif a100.tif ");
  EXPECT_EQ(names(FilesLike(folder.File("a1*.tif"))), "a10.tif a100.tif ");
  EXPECT_EQ(names(FilesLike(folder.File("*1*.tif"))), "a10.tif a100.tif b1.tif ");
  EXPECT_EQ(names(FilesLike(folder.File("a%d%d.tif"))), "a10.tif a100.tif ");
  EXPECT_EQ(names(FilesLike(folder.File("%d.tif"))), "");
  EXPECT_EQ(names(FilesLike(folder.File("*%dx"))), "");
  EXPECT_FALSE(IsPattern(folder.File("a9.tif")));
  // Once took longer than anybody waits.
  const std::string longName(200, 'a');
  std::ofstream(folder.File(longName)) << "x";
  std::string stars;
  for (int i = 0; i < 100; ++i)
  {
    stars += "*a";
  }
  EXPECT_EQ(names(FilesLike(folder.File(stars + "b"))), "");
  EXPECT_EQ(names(FilesLike(folder.File(stars))), longName + " ");
}

/// Damaged headers and voxels end in an error or in as many voxels as the header says.
TEST(Import, MutatedFilesAreErrorsOrVolumes)
{
  TERAVOX_FORMAT_FILES(files, "images");
  const TemporaryFolder folder;
  std::mt19937 random(6);
  for (const char* name :
    { "local_u2.mha", "packed.mha", "raw.nrrd", "gzip.nrrd", "qform.nii", "sform.nii.gz",
      "text_f4.vtk", "binary_i2.vtk", "mode_f2_big.mrc", "packed.map.gz", "palette_4_65535_0.tif",
      "pages_u1.tif", "pages_i1.tif", "pages.ome.tif", "imagej.tif", "ct/0.dcm", "ct/5.dcm" })
  {
    SCOPED_TRACE(name);
    std::ifstream in(files->File(name), std::ios::binary);
    const std::string whole((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
    const std::string copy =
      folder.File(std::string(name).substr(std::string(name).find_last_of('/') + 1));
    int refused = 0;
    for (int trial = 0; trial < 150; ++trial)
    {
      std::string bytes = whole;
      const std::size_t within =
        trial % 3 == 0 ? bytes.size() : std::min<std::size_t>(700, bytes.size());
      for (int i = 0; i < (trial % 2 == 0 ? 1 : 6); ++i)
      {
        // TIFF has its directories at the end.
        const std::size_t at = random() % within;
        bytes[trial % 4 == 1 ? bytes.size() - 1 - at : at] = static_cast<char>(random());
      }
      if (trial % 7 == 0)
      {
        bytes.resize(random() % bytes.size());
      }
      std::ofstream(copy, std::ios::binary) << bytes;
      const auto opened = OpenImage(copy);
      const Status status = opened.Ok() ? LastSlice(*opened.Value()) : opened.GetStatus();
      refused += status.Ok() ? 0 : 1;
      EXPECT_TRUE(status.Ok() || !status.Message().empty());
    }
    EXPECT_GT(refused, 5);
  }
}

} // namespace
} // namespace teravox::testing
