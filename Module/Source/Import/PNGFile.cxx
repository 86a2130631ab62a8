// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "PictureFile.h"

#include <csetjmp>
#include <png.h>

namespace teravox
{

namespace
{
/// By libpng. Palettes become colours, pixels of less than 8 bits have 8, a transparent colour
/// becomes an alpha component, interlaced pictures are whole ones; nothing is done to gamma.
class PNGFile : public PictureFile
{
public:
  PNGFile(const std::string& fileName, Stream file)
    : PictureFile(fileName, std::move(file))
    , Decoder(png_create_read_struct(PNG_LIBPNG_VER_STRING, this, &OnError, &OnWarning))
  {
  }
  PNGFile(const PNGFile&) = delete;
  PNGFile& operator=(const PNGFile&) = delete;
  ~PNGFile() override { png_destroy_read_struct(&this->Decoder, &this->Info, nullptr); }

protected:
  bool ReadHeader() override;
  bool ReadRows(std::byte* out) override;

private:
  static void OnError(png_structp decoder, png_const_charp text)
  {
    auto* self = static_cast<PNGFile*>(png_get_error_ptr(decoder));
    if (self->Error[0] == '\0')
    {
      std::snprintf(self->Error.data(), self->Error.size(), "%s", text);
    }
    png_longjmp(decoder, 1);
  }
  static void OnWarning(png_structp, png_const_charp) {}
  static void OnRead(png_structp decoder, png_bytep to, std::size_t size)
  {
    auto* self = static_cast<PNGFile*>(png_get_io_ptr(decoder));
    if (self->Take(to, size) < size)
    {
      png_error(decoder, ""); // its text is Take()'s
    }
  }
  void TakeHeader();

  png_structp Decoder;
  png_infop Info = nullptr;
};

bool PNGFile::ReadHeader()
{
  if (this->Decoder == nullptr)
  {
    std::snprintf(this->Error.data(), this->Error.size(), "there is no memory for it");
    return false;
  }
  if (setjmp(png_jmpbuf(this->Decoder)) != 0)
  {
    return false;
  }
  this->Info = png_create_info_struct(this->Decoder);
  if (this->Info == nullptr)
  {
    png_error(this->Decoder, "there is no memory for it");
  }
  png_set_read_fn(this->Decoder, this, &OnRead);
  png_set_user_limits(this->Decoder, PNG_UINT_31_MAX, PNG_UINT_31_MAX);
  // A wrong checksum is an error anywhere; what isn't wanted is skipped, whatever its size.
  png_set_crc_action(this->Decoder, PNG_CRC_ERROR_QUIT, PNG_CRC_ERROR_QUIT);
  png_set_keep_unknown_chunks(this->Decoder, PNG_HANDLE_CHUNK_NEVER, nullptr, -1);
  constexpr std::array<png_byte, 5> density{ 'p', 'H', 'Y', 's', 0 };
  png_set_keep_unknown_chunks(this->Decoder, PNG_HANDLE_CHUNK_AS_DEFAULT, density.data(), 1);
  png_read_info(this->Decoder, this->Info);
  this->TakeHeader();
  return true;
}

void PNGFile::TakeHeader()
{
  this->Head.Width = png_get_image_width(this->Decoder, this->Info);
  this->Head.Height = png_get_image_height(this->Decoder, this->Info);
  const bool wide = png_get_bit_depth(this->Decoder, this->Info) == 16;
  this->Head.Type = wide ? ScalarType::UInt16 : ScalarType::UInt8;
  const unsigned kind = png_get_color_type(this->Decoder, this->Info);
  const bool transparent = (kind & PNG_COLOR_MASK_ALPHA) != 0 ||
    png_get_valid(this->Decoder, this->Info, PNG_INFO_tRNS) != 0;
  this->Head.Components =
    ((kind & PNG_COLOR_MASK_COLOR) != 0 ? 3 : 1) + static_cast<int>(transparent);
  png_uint_32 x = 0;
  png_uint_32 y = 0;
  int unit = PNG_RESOLUTION_UNKNOWN;
  if (png_get_pHYs(this->Decoder, this->Info, &x, &y, &unit) != 0 && unit == PNG_RESOLUTION_METER &&
    x > 0 && y > 0)
  {
    this->Head.Spacing = { 1000.0 / x, 1000.0 / y };
  }
  // Two rows of at most four 16-bit samples a pixel, the window of inflate, and what else there is.
  constexpr std::uint64_t others = std::uint64_t{ 1 } << 17;
  this->Head.DecoderBytes = std::uint64_t{ 16 } * this->Head.Width + others;
}

bool PNGFile::ReadRows(std::byte* out)
{
  if (setjmp(png_jmpbuf(this->Decoder)) != 0)
  {
    return false;
  }
  png_set_expand(this->Decoder);
#if defined(__BYTE_ORDER__) && __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__
  png_set_swap(this->Decoder);
#endif
  const int passes = png_set_interlace_handling(this->Decoder);
  png_read_update_info(this->Decoder, this->Info);
  if (png_get_rowbytes(this->Decoder, this->Info) != this->RowBytes())
  {
    png_error(this->Decoder, "its header contradicts itself");
  }
  for (int pass = 0; pass < passes; ++pass)
  {
    for (std::size_t y = 0; y < this->Head.Height; ++y)
    {
      png_read_row(this->Decoder, reinterpret_cast<png_bytep>(this->Row(y, out)), nullptr);
    }
  }
  png_read_end(this->Decoder, nullptr);
  return true;
}

} // namespace

std::unique_ptr<PictureFile> PictureFile::OfPNG(const std::string& fileName, Stream file)
{
  return std::make_unique<PNGFile>(fileName, std::move(file));
}

} // namespace teravox
