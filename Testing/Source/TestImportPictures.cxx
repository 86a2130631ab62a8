// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "AllocationFaults.h"
#include "Import/ImageVolume.h"
#include "Import/SliceVoxelReader.h"
#include "ProcessMemory.h"
#include "TestImportSupport.h"

#include <filesystem>

namespace teravox::testing
{
namespace
{

Result<ImageVolume> OpenPictures(
  const std::string& name, std::uint64_t memory = std::uint64_t{ 16 } << 20)
{
  ImageVolume::Request request;
  request.Name = name;
  request.Memory = memory;
  return ImageVolume::Open(request);
}

std::string ContentOf(const std::string& name)
{
  std::ifstream in(name, std::ios::binary);
  return { std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>() };
}

/// One slice after another, of which eight are kept. Each allocation of opening may fail.
void ExpectSlicesAreHeld(const FormatFiles& files)
{
  const std::vector<std::byte> truth = files.Array("held");
  const std::uint64_t before = test::AllocatedBytes();
  const std::size_t slice = truth.size() / 48;
  const auto opened = OpenPictures(files.File("held"), 32 * slice);
  ASSERT_TRUE(opened.Ok()) << opened.GetStatus().Message();
  EXPECT_LE(opened.Value().ReaderBytes, 16 * slice);
  std::vector<std::byte> box(slice);
  std::uint64_t most = 0;
  for (std::int64_t z = 0; z < 48; ++z)
  {
    const Status status = opened.Value().Reader->ReadBox({ 0, 0, z }, { 128, 128, 1 }, box.data());
    ASSERT_TRUE(status.Ok()) << status.Message();
    ASSERT_EQ(std::memcmp(box.data(), truth.data() + static_cast<std::size_t>(z) * slice, slice), 0)
      << z;
    most = std::max(most, test::AllocatedBytes());
  }
  EXPECT_LT(most - std::min(most, before), 16 * slice);
  const auto* slices = dynamic_cast<const SliceVoxelReader*>(opened.Value().Reader.get());
  ASSERT_NE(slices, nullptr);
  EXPECT_EQ(slices->SlicesRead(), 48u);
  for (const char* name : { "called.jpg", "jpeg_grey/s0.jpg" })
  {
    SCOPED_TRACE(name);
    ImageVolume::Request request;
    request.Name = files.File(name);
    int failures = 0;
    bool met = true;
    for (std::int64_t n = 0; met; ++n)
    {
      test::FailAllocationAfter(n);
      const auto again = ImageVolume::Open(request);
      met = test::EndAllocationFault();
      ASSERT_TRUE(met || again.Ok()) << again.GetStatus().Message();
      failures += again.Ok() ? 0 : 1;
    }
    EXPECT_GT(failures, 5);
  }
}

TEST(ImportPictures, EveryKindGivesItsVoxelsInLittleMemory)
{
  TERAVOX_FORMAT_FILES(files, "pictures");
  const std::vector<Listed> all = ListOf(*files);
  ASSERT_GT(all.size(), 50u);
  std::mt19937 random(15);
  for (const Listed& one : all)
  {
    SCOPED_TRACE(one.Name);
    ASSERT_TRUE(ImageVolume::IsImage(files->File(one.Name)));
    const auto opened = OpenPictures(files->File(one.Name));
    ASSERT_TRUE(opened.Ok()) << opened.GetStatus().Message();
    EXPECT_EQ(opened.Value().Files.size(), static_cast<std::size_t>(one.Numbers[3]));
    ExpectIsListed(*opened.Value().Reader, one, *files, random);
  }
  ExpectSlicesAreHeld(*files);
}

TEST(ImportPictures, WhatCantBeReadIsNamedAndNothingIsPrinted)
{
  TERAVOX_FORMAT_FILES(files, "pictures");
  ::testing::internal::CaptureStderr();
  const auto expect = [&](const char* name, StatusCode code, const char* text)
  {
    SCOPED_TRACE(name);
    const auto opened = OpenPictures(files->File(name));
    const Status status = opened.Ok() ? LastSlice(*opened.Value().Reader) : opened.GetStatus();
    EXPECT_EQ(status.Code(), code) << status.Message();
    EXPECT_NE(status.Message().find(text), std::string::npos) << status.Message();
    EXPECT_NE(status.Message().find(files->Folder.Path()), std::string::npos) << status.Message();
  };
  expect("png_sizes", StatusCode::InvalidArgument, "2.png' has a picture of another size or type");
  expect("png_types", StatusCode::InvalidArgument, "2.png' has a picture of another size or type");
  expect("both", StatusCode::InvalidArgument, "are of two formats");
  expect("slices", StatusCode::Corrupt, "b_095.jpg' is no PNG, JPEG, PNM");
  expect("empty.png", StatusCode::Corrupt, "is no PNG, JPEG, PNM, BMP or TGA file");
  expect("text.jpg", StatusCode::Corrupt, "is no PNG, JPEG, PNM, BMP or TGA file");
  expect("absent.png", StatusCode::NotFound, "absent.png");
  expect("cut.png", StatusCode::Corrupt, "it is cut off");
  expect("end.png", StatusCode::Corrupt, "it is cut off");
  expect("checksum.png", StatusCode::Corrupt, "can't be read");
  expect("cut.jpg", StatusCode::Corrupt, "it is cut off");
  expect("end.jpg", StatusCode::Corrupt, "it is cut off");
  expect("cmyk.jpg", StatusCode::Unsupported, "CMYK");
  expect("two.jpg", StatusCode::Unsupported, "neither one component nor three");
  expect("bits.jpg", StatusCode::Unsupported, "other than 8 bits");
  expect("lossless.jpg", StatusCode::Unsupported, "lossless");
  expect("scans.jpg", StatusCode::Corrupt, "more than 1000 scans");
  expect("cut.pgm", StatusCode::Corrupt, "it is cut off");
  expect("letters.pgm", StatusCode::Corrupt, "something else where a number should be");
  expect("above.pgm", StatusCode::Corrupt, "a number in it is too large");
  expect("short.pgm", StatusCode::Corrupt, "it is cut off");
  expect("nothing.ppm", StatusCode::Corrupt, "is 0");
  expect("bits.pnm", StatusCode::Unsupported, "map of single bits");
  expect("huge.pgm", StatusCode::Corrupt, "it is cut off");
  expect("larger.pgm", StatusCode::Corrupt, "a number in it is too large");
  expect("cut.bmp", StatusCode::Corrupt, "it is cut off");
  expect("head.bmp", StatusCode::Corrupt, "it is cut off");
  expect("runs.bmp", StatusCode::Unsupported, "save it without compression");
  expect("pixels_16.bmp", StatusCode::Unsupported, "pixels of 16 bits");
  expect("few.bmp", StatusCode::Corrupt, "a colour that its palette doesn't have");
  expect("many.bmp", StatusCode::Corrupt, "its header contradicts itself");
  expect("order.bmp", StatusCode::Unsupported, "an unusual order");
  expect("tall.bmp", StatusCode::Corrupt, "a size that can't be");
  expect("both_grey", StatusCode::InvalidArgument, "2.bmp' has a picture of another size or type");
  expect("cut.tga", StatusCode::Corrupt, "it is cut off");
  expect("head.tga", StatusCode::Corrupt, "it is cut off");
  expect("pixels_16.tga", StatusCode::Unsupported, "is no TGA file of grey");
  expect("few.tga", StatusCode::Corrupt, "a colour that its palette doesn't have");
  expect("below.tga", StatusCode::Corrupt, "a colour that its palette doesn't have");
  expect("text.tga", StatusCode::Corrupt, "is no PNG, JPEG, PNM, BMP or TGA file");
  // Nothing is allocated with the numbers of a header.
  expect("largest.png", StatusCode::Corrupt, "a size that can't be");
  expect("large.png", StatusCode::ResourceExhausted, "A slice of");
  // Eight million bytes of coefficients beside four of the slice.
  expect("coefficients.jpg", StatusCode::ResourceExhausted, "A slice of");
  // A file that was replaced after opening.
  const auto opened = OpenPictures(files->File("png_rgb_8"));
  ASSERT_TRUE(opened.Ok());
  std::filesystem::copy_file(files->File("one.PNG"), files->File("png_rgb_8/s1.png"),
    std::filesystem::copy_options::overwrite_existing);
  const Status changed = LastSlice(*opened.Value().Reader);
  EXPECT_EQ(changed.Code(), StatusCode::InvalidArgument);
  EXPECT_NE(changed.Message().find("s1.png' isn't the picture any more"), std::string::npos);
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
}

/// Of a PNG file every byte has a checksum: each damage is an error, and no error is a leak.
TEST(ImportPictures, DamagedFilesAreErrorsOrVolumes)
{
  TERAVOX_FORMAT_FILES(files, "pictures");
  const TemporaryFolder folder;
  std::mt19937 random(16);
  std::uint64_t before = 0;
  for (const char* name : { "png_rgb_16/s0.png", "png_palette_4_clear_interlaced/s1.png",
         "slices/a_095.png", "jpeg_grey/s0.jpg", "jpeg_rgb/s0.JPEG", "jpeg_rgb_progressive/s0.jpg",
         "pnm_text/s0.pgm", "pnm_wide/s1.pgm", "bmp_few/s0.bmp", "bmp_rgba/s2.bmp",
         "tga_rgba_0/s0.tga", "tga_palette_first_1/s1.TGA" })
  {
    SCOPED_TRACE(name);
    const std::string whole = ContentOf(files->File(name));
    const bool png = EndsWith(name, "png");
    const std::string copy =
      folder.File("copy" + std::string(name).substr(std::string(name).rfind('.')));
    int refused = 0;
    constexpr int trials = 50;
    for (int trial = 0; trial < trials; ++trial)
    {
      std::string bytes = whole;
      if (trial % 2 == 0)
      {
        bytes.resize(random() % bytes.size());
      }
      else
      {
        char& byte = bytes.at(random() % (trial % 4 == 1 ? bytes.size() : 60));
        byte = static_cast<char>(byte ^ (1 << random() % 8));
      }
      std::ofstream(copy, std::ios::binary) << bytes;
      const auto opened = OpenPictures(copy);
      const Status status = opened.Ok() ? LastSlice(*opened.Value().Reader) : opened.GetStatus();
      EXPECT_TRUE(status.Ok() || !status.Message().empty());
      refused += status.Ok() ? 0 : 1;
      before = trial == trials / 2 ? test::AllocatedBytes() : before;
    }
    // A part of a file without checksums is an error still.
    EXPECT_GE(refused, png ? trials : trials / 2);
    // A decoder has more than these.
    EXPECT_LT(test::AllocatedBytes(), before + 4000);
  }
}

} // namespace
} // namespace teravox::testing
