// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "PictureFile.h"

#include <csetjmp>
#include <jerror.h>
#include <jpeglib.h>

namespace teravox
{

namespace
{
/// By libjpeg, with its defaults, as VTK has it. Warnings of damaged data are errors.
class JPEGFile : public PictureFile
{
public:
  JPEGFile(const std::string& fileName, Stream file)
    : PictureFile(fileName, std::move(file))
  {
  }
  JPEGFile(const JPEGFile&) = delete;
  JPEGFile& operator=(const JPEGFile&) = delete;
  ~JPEGFile() override { jpeg_destroy_decompress(&this->Decoder); }

protected:
  bool ReadHeader() override;
  bool ReadRows(std::byte* out) override;

private:
  static JPEGFile& Self(j_common_ptr decoder)
  {
    return *static_cast<JPEGFile*>(decoder->client_data);
  }
  static JPEGFile& Self(j_decompress_ptr decoder)
  {
    return *static_cast<JPEGFile*>(decoder->client_data);
  }
  [[noreturn]] void Fail(const char* text, bool refused = false)
  {
    std::snprintf(this->Error.data(), this->Error.size(), "%s", text);
    this->Refused = refused;
    std::longjmp(this->Jump, 1);
  }
  static void OnError(j_common_ptr decoder);
  static void OnMessage(j_common_ptr decoder, int level);
  static void OnProgress(j_common_ptr decoder);
  static boolean OnFill(j_decompress_ptr decoder);
  static void OnSkip(j_decompress_ptr decoder, long count);
  void Prepare();
  void TakeHeader();

  jpeg_decompress_struct Decoder{};
  jpeg_error_mgr Errors{};
  jpeg_progress_mgr Progress{};
  jpeg_source_mgr Source{};
  std::jmp_buf Jump{};
  std::array<JOCTET, 16384> Buffer{};
};

void JPEGFile::OnError(j_common_ptr decoder)
{
  std::array<char, JMSG_LENGTH_MAX> text{};
  decoder->err->format_message(decoder, text.data());
  std::size_t length = std::char_traits<char>::length(text.data());
  while (length > 0 && text.at(length - 1) == '.')
  {
    text.at(--length) = '\0';
  }
  JPEGFile& self = Self(decoder);
  switch (decoder->err->msg_code)
  {
    case JERR_BAD_PRECISION:
      self.Fail("has samples of other than 8 bits", true);
    case JERR_SOF_UNSUPPORTED:
    case JERR_ARITH_NOTIMPL:
      self.Fail("is a JPEG file that libjpeg doesn't decode (lossless or the like)", true);
    default:
      self.Fail(text.data());
  }
}

void JPEGFile::OnMessage(j_common_ptr decoder, int level)
{
  const int code = decoder->err->msg_code;
  // These say nothing of the pixels.
  if (level < 0 && code != JWRN_EXTRANEOUS_DATA && code != JWRN_ADOBE_XFORM &&
    code != JWRN_JFIF_MAJOR)
  {
    OnError(decoder);
  }
}

/// A small file with very many scans keeps a decoder busy for hours.
void JPEGFile::OnProgress(j_common_ptr decoder)
{
  constexpr int most = 1000;
  JPEGFile& self = Self(decoder);
  if (self.Decoder.input_scan_number > most)
  {
    self.Fail("it has more than 1000 scans");
  }
}

boolean JPEGFile::OnFill(j_decompress_ptr decoder)
{
  JPEGFile& self = Self(decoder);
  const std::size_t taken = self.Take(self.Buffer.data(), self.Buffer.size());
  if (taken == 0)
  {
    std::longjmp(self.Jump, 1); // Take() has said why
  }
  self.Error[0] = '\0';
  self.Source.next_input_byte = self.Buffer.data();
  self.Source.bytes_in_buffer = taken;
  return TRUE;
}

void JPEGFile::OnSkip(j_decompress_ptr decoder, long count)
{
  JPEGFile& self = Self(decoder);
  while (count > static_cast<long>(self.Source.bytes_in_buffer))
  {
    count -= static_cast<long>(self.Source.bytes_in_buffer);
    OnFill(decoder);
  }
  if (count > 0)
  {
    self.Source.next_input_byte += count;
    self.Source.bytes_in_buffer -= static_cast<std::size_t>(count);
  }
}

void JPEGFile::Prepare()
{
  this->Decoder.err = jpeg_std_error(&this->Errors);
  this->Decoder.client_data = this;
  this->Errors.error_exit = &OnError;
  this->Errors.emit_message = &OnMessage;
  jpeg_create_decompress(&this->Decoder); // leaves these two as they are
  this->Source.init_source = [](j_decompress_ptr) {};
  this->Source.term_source = [](j_decompress_ptr) {};
  this->Source.fill_input_buffer = &OnFill;
  this->Source.skip_input_data = &OnSkip;
  this->Source.resync_to_restart = &jpeg_resync_to_restart;
  this->Decoder.src = &this->Source;
  this->Progress.progress_monitor = &OnProgress;
  this->Decoder.progress = &this->Progress;
}

bool JPEGFile::ReadHeader()
{
  if (setjmp(this->Jump) != 0)
  {
    return false;
  }
  this->Prepare();
  jpeg_read_header(&this->Decoder, TRUE);
  this->TakeHeader();
  return true;
}

void JPEGFile::TakeHeader()
{
  const jpeg_decompress_struct& d = this->Decoder;
  if (d.jpeg_color_space == JCS_CMYK || d.jpeg_color_space == JCS_YCCK || d.num_components == 4)
  {
    this->Fail("has the colours of printers, CMYK; grey and RGB are read", true);
  }
  const bool grey = d.num_components == 1 && d.out_color_space == JCS_GRAYSCALE;
  if (!grey && (d.num_components != 3 || d.out_color_space != JCS_RGB))
  {
    this->Fail("has neither one component nor three", true);
  }
  this->Head.Width = d.image_width;
  this->Head.Height = d.image_height;
  this->Head.Components = grey ? 1 : 3;
  const double length = d.density_unit == 1 ? 25.4 : d.density_unit == 2 ? 10.0 : 0.0;
  if (length > 0.0 && d.X_density > 0 && d.Y_density > 0)
  {
    this->Head.Spacing = { length / d.X_density, length / d.Y_density };
  }
  // Rows of blocks in all stages, and of pictures that come in several scans all coefficients.
  constexpr std::uint64_t others = std::uint64_t{ 1 } << 17;
  constexpr std::uint64_t stages = 64;
  this->Head.DecoderBytes =
    others + stages * static_cast<std::uint64_t>(d.num_components) * this->Head.Width;
  const bool several = jpeg_has_multiple_scans(&this->Decoder) != 0;
  for (int c = 0; several && c < d.num_components; ++c)
  {
    const auto padded = [](JDIMENSION blocks, int factor)
    { return static_cast<std::uint64_t>(blocks) + static_cast<std::uint64_t>(factor); };
    const jpeg_component_info& info = d.comp_info[c];
    this->Head.DecoderBytes += padded(info.width_in_blocks, info.h_samp_factor) *
      padded(info.height_in_blocks, info.v_samp_factor) * sizeof(JBLOCK);
  }
}

bool JPEGFile::ReadRows(std::byte* out)
{
  if (setjmp(this->Jump) != 0)
  {
    return false;
  }
  jpeg_start_decompress(&this->Decoder);
  if (this->Decoder.output_width != this->Head.Width ||
    this->Decoder.output_height != this->Head.Height ||
    this->Decoder.output_components != this->Head.Components)
  {
    this->Fail("its header contradicts itself");
  }
  while (this->Decoder.output_scanline < this->Head.Height)
  {
    auto* row = reinterpret_cast<JSAMPROW>(this->Row(this->Decoder.output_scanline, out));
    jpeg_read_scanlines(&this->Decoder, &row, 1);
  }
  jpeg_finish_decompress(&this->Decoder);
  return true;
}

} // namespace

std::unique_ptr<PictureFile> PictureFile::OfJPEG(const std::string& fileName, Stream file)
{
  return std::make_unique<JPEGFile>(fileName, std::move(file));
}

} // namespace teravox
