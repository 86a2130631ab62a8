// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "TIFFStack.h"

#include "Formats/FormatText.h"
#include "HeaderText.h"
#include "OMEDescription.h"
#include "Picture.h"
#include "SliceVoxelReader.h"

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <cstring>
#include <tiffio.h>
#include <utility>

namespace teravox
{

namespace
{
using headers::Corrupt;
using headers::Unsupported;

struct Closer
{
  void operator()(TIFF* file) const { TIFFClose(file); }
};
using File = std::unique_ptr<TIFF, Closer>;

/// What libtiff had to say; it prints otherwise. Thread: each its own.
std::string& LastError()
{
  thread_local std::string text;
  return text;
}

void KeepError(const char*, const char* format, va_list arguments)
{
  std::array<char, 512> text{};
  std::vsnprintf(text.data(), text.size(), format, arguments);
  LastError() = text.data();
}

File OpenFile(const std::string& name)
{
  static const bool quiet = []
  {
    TIFFSetErrorHandler(&KeepError);
    TIFFSetWarningHandler(nullptr);
    return true;
  }();
  static_cast<void>(quiet);
  LastError().clear();
  return File(TIFFOpen(name.c_str(), "rm"));
}

Status Damaged(const std::string& name)
{
  return Corrupt(name, "can't be read: " + (LastError().empty() ? "it is damaged" : LastError()));
}

/// How the rows of a picture lie, too, and what its pixels mean.
struct Page : Picture
{
  bool Flipped = false;
  unsigned IndexBits = 0;            // of pixels that are indices into a palette; 0: they aren't
  std::vector<std::uint8_t> Palette; // its colours, as many values each as the voxels have
};

std::optional<ScalarType> TypeOf(unsigned bits, unsigned format)
{
  const bool real = format == SAMPLEFORMAT_IEEEFP;
  const bool with = format == SAMPLEFORMAT_INT;
  if (format > SAMPLEFORMAT_VOID)
  {
    return std::nullopt;
  }
  switch (bits)
  {
    case 8:
      return real ? std::nullopt
                  : std::optional<ScalarType>(with ? ScalarType::Int8 : ScalarType::UInt8);
    case 16:
      return real ? std::nullopt
                  : std::optional<ScalarType>(with ? ScalarType::Int16 : ScalarType::UInt16);
    case 32:
      return real ? ScalarType::Float32 : with ? ScalarType::Int32 : ScalarType::UInt32;
    case 64:
      return real ? std::optional<ScalarType>(ScalarType::Float64) : std::nullopt;
    default:
      return std::nullopt;
  }
}

/// Colours of a palette are 16-bit numbers; some programs write 8-bit ones, as libtiff knows, too.
/// Voxels are grey (one value) if `components` is 1 or, when it is 0, if all colours are.
Status TakePalette(
  TIFF* file, const std::string& name, unsigned bits, unsigned samples, int components, Page& page)
{
  std::array<std::uint16_t*, 3> colours{};
  if (samples != 1 || (bits != 1 && bits != 2 && bits != 4 && bits != 8 && bits != 16))
  {
    return Unsupported(name,
      "has a palette for " + std::to_string(samples) + " samples of " + std::to_string(bits) +
        " bits; one of 1, 2, 4, 8 or 16 is read");
  }
  if (TIFFGetField(file, TIFFTAG_COLORMAP, colours.data(), &colours[1], &colours[2]) == 0)
  {
    return Corrupt(name, "has pixels of a palette, but no palette");
  }
  const std::size_t count = std::size_t{ 1 } << bits;
  bool grey = true;
  std::uint16_t most = 0;
  for (std::size_t i = 0; i < count; ++i)
  {
    grey = grey && colours[0][i] == colours[1][i] && colours[0][i] == colours[2][i];
    most = std::max({ most, colours[0][i], colours[1][i], colours[2][i] });
  }
  page.Type = ScalarType::UInt8;
  page.Components = components != 0 && grey ? components : grey ? 1 : 3;
  page.IndexBits = bits;
  const unsigned shift = most > 255 ? 8 : 0;
  for (std::size_t i = 0; i < count; ++i)
  {
    for (int c = 0; c < page.Components; ++c)
    {
      page.Palette.push_back(
        static_cast<std::uint8_t>(colours.at(static_cast<std::size_t>(c))[i] >> shift));
    }
  }
  return {};
}

/// A row of indices to colours.
void MapRow(const Page& page, const std::byte* row, std::size_t count, std::byte* out)
{
  const auto components = static_cast<std::size_t>(page.Components);
  for (std::size_t x = 0; x < count; ++x, out += components)
  {
    std::uint16_t index = 0;
    if (page.IndexBits == 16)
    {
      std::memcpy(&index, row + 2 * x, 2); // in the machine's order, by libtiff
    }
    else
    {
      const std::size_t bit = x * page.IndexBits; // the first pixel in the highest bits
      index = static_cast<std::uint16_t>(
        (std::to_integer<unsigned>(row[bit / 8]) >> (8 - page.IndexBits - bit % 8)) &
        ((1U << page.IndexBits) - 1));
    }
    std::memcpy(out, page.Palette.data() + index * components, components);
  }
}

/// `components` of the palettes of grey colours; 0: as they are.
Result<Page> Inspect(TIFF* file, const std::string& name, int components)
{
  Page page;
  std::uint16_t samples = 1;
  std::uint16_t bits = 1;
  std::uint16_t format = SAMPLEFORMAT_UINT;
  std::uint16_t planes = PLANARCONFIG_CONTIG;
  std::uint16_t orientation = ORIENTATION_TOPLEFT;
  std::uint16_t meaning = PHOTOMETRIC_MINISBLACK;
  if (TIFFGetField(file, TIFFTAG_IMAGEWIDTH, &page.Width) == 0 ||
    TIFFGetField(file, TIFFTAG_IMAGELENGTH, &page.Height) == 0 || page.Width == 0 ||
    page.Height == 0 || page.Width > 0x7fffffffU || page.Height > 0x7fffffffU)
  {
    return Damaged(name);
  }
  TIFFGetFieldDefaulted(file, TIFFTAG_SAMPLESPERPIXEL, &samples);
  TIFFGetFieldDefaulted(file, TIFFTAG_BITSPERSAMPLE, &bits);
  TIFFGetFieldDefaulted(file, TIFFTAG_SAMPLEFORMAT, &format);
  TIFFGetFieldDefaulted(file, TIFFTAG_PLANARCONFIG, &planes);
  TIFFGetFieldDefaulted(file, TIFFTAG_ORIENTATION, &orientation);
  TIFFGetField(file, TIFFTAG_PHOTOMETRIC, &meaning);
  const bool palette = meaning == PHOTOMETRIC_PALETTE;
  if (orientation != ORIENTATION_TOPLEFT && orientation != ORIENTATION_BOTLEFT)
  {
    return Unsupported(name, "is a mirrored or turned picture");
  }
  page.Flipped = orientation == ORIENTATION_BOTLEFT;
  if (palette)
  {
    const Status status = TakePalette(file, name, bits, samples, components, page);
    return status.Ok() ? Result<Page>(page) : Result<Page>(status);
  }
  const auto type = TypeOf(bits, format);
  if (!type)
  {
    return Unsupported(
      name, "has samples of " + std::to_string(bits) + " bits of a kind that isn't read");
  }
  if (samples < 1 || samples > 4 || (samples > 1 && planes != PLANARCONFIG_CONTIG))
  {
    return Unsupported(name,
      "has " + std::to_string(samples) + " samples per pixel; 1 to 4 beside each other are read");
  }
  if (meaning == PHOTOMETRIC_YCBCR)
  {
    return Unsupported(name, "has colours of luminance and differences");
  }
  page.Type = *type;
  page.Components = samples;
  return page;
}

/// What ImageJ writes into the description: "images=12\nslices=4\n...".
struct ImageJ
{
  bool Is = false;
  std::map<std::string, std::string> Fields;

  std::int64_t Number(const char* name) const
  {
    const auto found = this->Fields.find(name);
    constexpr std::int64_t most = 1 << 30;
    return found == this->Fields.end()
      ? 1
      : std::max<std::int64_t>(1, formats::ParseIndex(found->second, most).value_or(1));
  }
};

std::string DescriptionOf(TIFF* file)
{
  char* text = nullptr;
  return TIFFGetField(file, TIFFTAG_IMAGEDESCRIPTION, &text) == 0 || text == nullptr ? "" : text;
}

ImageJ ImageJOf(std::string rest)
{
  ImageJ found;
  found.Is = rest.rfind("ImageJ=", 0) == 0;
  while (found.Is && !rest.empty())
  {
    const std::string line = rest.substr(0, rest.find('\n'));
    const std::size_t equals = line.find('=');
    if (equals != std::string::npos)
    {
      found.Fields[line.substr(0, equals)] = headers::Trimmed(line.substr(equals + 1));
    }
    rest.erase(0, line.size() + 1);
  }
  return found;
}

Double3 SpacingOf(TIFF* file, const ImageJ& description)
{
  Double3 spacing{ 1, 1, 1 };
  std::uint16_t unit = RESUNIT_INCH;
  TIFFGetFieldDefaulted(file, TIFFTAG_RESOLUTIONUNIT, &unit);
  float perUnit = 0;
  const double length = unit == RESUNIT_INCH ? 25.4
    : unit == RESUNIT_CENTIMETER             ? 10.0
    : description.Is                         ? 1.0
                                             : 0.0;
  const std::array<std::uint32_t, 2> tags{ TIFFTAG_XRESOLUTION, TIFFTAG_YRESOLUTION };
  for (std::size_t a = 0; a < 2; ++a)
  {
    if (length > 0.0 && TIFFGetField(file, tags.at(a), &perUnit) != 0 && perUnit > 0.0F &&
      std::isfinite(perUnit))
    {
      spacing.at(a) = length / static_cast<double>(perUnit);
    }
  }
  spacing[2] = spacing[0];
  const auto between = description.Fields.find("spacing");
  if (between != description.Fields.end())
  {
    const auto number = formats::ParseNumbers(between->second, 1);
    const bool good = number && number->size() == 1 && (*number)[0] > 0.0;
    spacing[2] = good && std::isfinite((*number)[0]) ? (*number)[0] : spacing[2];
  }
  return spacing;
}

class Reader : public SliceVoxelReader
{
public:
  /// `slices`: file and page of each.
  Reader(Description volume, Page page, std::vector<std::string> files,
    std::vector<std::pair<std::size_t, std::uint32_t>> slices)
    : SliceVoxelReader(std::move(volume))
    , All(std::move(page))
    , Files(std::move(files))
    , Slices(std::move(slices))
  {
  }

protected:
  Status ReadSlice(std::int64_t z, std::byte* out) override
  {
    const auto [file, number] = this->Slices.at(static_cast<std::size_t>(z));
    const std::string& name = this->Files[file];
    if (!this->Now || this->NowFile != file)
    {
      this->Now = OpenFile(name);
      this->NowFile = file;
    }
    if (!this->Now || !this->GoTo(static_cast<tdir_t>(number)))
    {
      return Damaged(name);
    }
    const auto page = Inspect(this->Now.get(), name, this->All.Components);
    if (!page.Ok())
    {
      return page.GetStatus();
    }
    Status status = CheckAlike(name, page.Value(), this->All);
    if (!status.Ok())
    {
      return status;
    }
    status = TIFFIsTiled(this->Now.get()) != 0 ? this->ReadTiles(name, page.Value(), out)
                                               : this->ReadStrips(name, page.Value(), out);
    return status;
  }

private:
  // libtiff finds a page from the first one on; the next one is at hand.
  bool GoTo(tdir_t number)
  {
    const tdir_t now = TIFFCurrentDirectory(this->Now.get());
    return now == number ||
      (now + 1 == number ? TIFFReadDirectory(this->Now.get())
                         : TIFFSetDirectory(this->Now.get(), number)) != 0;
  }
  std::size_t RowBytes() const { return this->VoxelBytes() * this->All.Width; }
  // Bytes of as many pixels in the file.
  std::size_t FileBytes(const Page& page, std::size_t pixels) const
  {
    return page.IndexBits > 0 ? (pixels * page.IndexBits + 7) / 8 : this->VoxelBytes() * pixels;
  }
  std::byte* Row(const Page& page, std::uint32_t y, std::byte* out) const
  {
    return out + this->RowBytes() * (page.Flipped ? page.Height - 1 - y : y);
  }

  Status ReadStrips(const std::string& name, const Page& page, std::byte* out)
  {
    const std::size_t bytes = this->FileBytes(page, page.Width);
    if (static_cast<std::size_t>(TIFFScanlineSize64(this->Now.get())) != bytes)
    {
      return Damaged(name);
    }
    this->Tile.resize(page.IndexBits > 0 ? bytes : 0);
    for (std::uint32_t y = 0; y < page.Height; ++y)
    {
      std::byte* row = this->Row(page, y, out);
      if (TIFFReadScanline(this->Now.get(), page.IndexBits > 0 ? this->Tile.data() : row, y, 0) < 0)
      {
        return Damaged(name);
      }
      if (page.IndexBits > 0)
      {
        MapRow(page, this->Tile.data(), page.Width, row);
      }
    }
    return {};
  }

  Status ReadTiles(const std::string& name, const Page& page, std::byte* out)
  {
    std::uint32_t width = 0;
    std::uint32_t height = 0;
    constexpr std::uint64_t largest = std::uint64_t{ 1 } << 30;
    const std::uint64_t size = TIFFTileSize64(this->Now.get());
    if (TIFFGetField(this->Now.get(), TIFFTAG_TILEWIDTH, &width) == 0 ||
      TIFFGetField(this->Now.get(), TIFFTAG_TILELENGTH, &height) == 0 || width == 0 ||
      height == 0 || size > largest || size / height < this->FileBytes(page, width))
    {
      return Damaged(name);
    }
    this->Tile.resize(static_cast<std::size_t>(size));
    for (std::uint32_t y = 0; y < page.Height; y += std::min(height, page.Height - y))
    {
      for (std::uint32_t x = 0; x < page.Width; x += std::min(width, page.Width - x))
      {
        if (TIFFReadTile(this->Now.get(), this->Tile.data(), x, y, 0, 0) < 0)
        {
          return Damaged(name);
        }
        for (std::uint32_t row = 0; row < std::min(height, page.Height - y); ++row)
        {
          const std::size_t count = std::min(width, page.Width - x);
          const std::byte* from = this->Tile.data() + this->FileBytes(page, width) * row;
          std::byte* to = this->Row(page, y + row, out) + this->VoxelBytes() * x;
          if (page.IndexBits > 0)
          {
            MapRow(page, from, count, to);
          }
          else
          {
            std::memcpy(to, from, this->VoxelBytes() * count);
          }
        }
      }
    }
    return {};
  }

  Page All;
  std::vector<std::string> Files;
  std::vector<std::pair<std::size_t, std::uint32_t>> Slices;
  File Now;
  std::size_t NowFile = 0;
  std::vector<std::byte> Tile; // or a row of a palette's indices
};

/// Pages of one file that aren't thumbnails of others.
Result<std::vector<std::pair<std::size_t, std::uint32_t>>> PagesOf(
  TIFF* file, const std::string& name)
{
  std::vector<std::pair<std::size_t, std::uint32_t>> pages;
  std::uint32_t number = 0;
  do
  {
    std::uint32_t kind = 0;
    TIFFGetFieldDefaulted(file, TIFFTAG_SUBFILETYPE, &kind);
    if ((kind & (FILETYPE_REDUCEDIMAGE | FILETYPE_MASK)) == 0)
    {
      pages.emplace_back(0, number);
    }
    ++number;
    constexpr std::uint32_t most = 65535; // libtiff's own of a file
    if (number > most)
    {
      return Unsupported(name, "has more than 65535 pages");
    }
    LastError().clear();
  } while (TIFFReadDirectory(file) != 0);
  // At the end there is nothing to complain about.
  return !LastError().empty() || pages.empty()
    ? Result<std::vector<std::pair<std::size_t, std::uint32_t>>>(Damaged(name))
    : Result<std::vector<std::pair<std::size_t, std::uint32_t>>>(pages);
}

/// ImageJ sorts pages by channel, slice, time; the channel changes fastest.
Status Choose(const std::string& name, const ImageJ& description, const TIFFStack::Request& request,
  std::vector<std::pair<std::size_t, std::uint32_t>>& pages)
{
  const std::int64_t channels = description.Number("channels");
  const std::int64_t times = description.Number("frames");
  const auto count = static_cast<std::int64_t>(pages.size());
  if (channels * times <= 1 || channels * times > count || count % (channels * times) != 0)
  {
    return {};
  }
  if (request.Channel < 0 || request.Channel >= channels || request.TimePoint < 0 ||
    request.TimePoint >= times)
  {
    return { StatusCode::InvalidArgument,
      "'" + name + "' has " + std::to_string(channels) + " channels and " + std::to_string(times) +
        " time points, counted from 0." };
  }
  const std::int64_t slices = count / (channels * times);
  std::vector<std::pair<std::size_t, std::uint32_t>> chosen;
  for (std::int64_t z = 0; z < slices; ++z)
  {
    chosen.push_back(pages.at(
      static_cast<std::size_t>((request.TimePoint * slices + z) * channels + request.Channel)));
  }
  pages = std::move(chosen);
  return {};
}

/// The same by OME-XML, which says where each page belongs. `files`: become all that there are.
Status Choose(const OMEDescription& ome, std::vector<std::string>& files,
  std::vector<std::pair<std::size_t, std::uint32_t>>& pages)
{
  std::vector<std::pair<std::size_t, std::uint32_t>> chosen;
  for (const OMEDescription::Page& page : ome.Pages)
  {
    // Those of a file are in their order; of other files reading tells.
    const std::pair<std::size_t, std::uint32_t> wanted{ page.File,
      static_cast<std::uint32_t>(page.Number) };
    if (page.File == 0 && !std::binary_search(pages.begin(), pages.end(), wanted))
    {
      return Corrupt(ome.Files.front(),
        "has no page " + std::to_string(page.Number) + ", where its OME-XML says slice " +
          std::to_string(chosen.size()) + " is");
    }
    chosen.push_back(wanted);
  }
  files = ome.Files;
  pages = std::move(chosen);
  return {};
}
} // namespace

Result<std::shared_ptr<VoxelReader>> TIFFStack::Open(
  const Request& request, std::vector<std::string>& others)
{
  others.clear();
  if (request.Files.empty())
  {
    return Status(StatusCode::InvalidArgument, "There are no TIFF files.");
  }
  const std::string& name = request.Files.front();
  const auto begin = headers::Begin(name, 4); // for the system's own words
  if (!begin.Ok())
  {
    return begin.GetStatus();
  }
  const File file = OpenFile(name);
  if (!file)
  {
    return Damaged(name);
  }
  const auto page = Inspect(file.get(), name, 0);
  if (!page.Ok())
  {
    return page.GetStatus();
  }
  auto described = DescribeStack(name, page.Value(), 0);
  if (!described.Ok())
  {
    return described.GetStatus();
  }
  // Directories that are read later overwrite it.
  const std::string text = DescriptionOf(file.get());
  const ImageJ description = ImageJOf(text);
  VoxelReader::Description& volume = described.Value();
  volume.Spacing = SpacingOf(file.get(), description);
  std::vector<std::pair<std::size_t, std::uint32_t>> slices;
  std::vector<std::string> files = request.Files;
  if (files.size() == 1)
  {
    auto pages = PagesOf(file.get(), name);
    Status status = pages.GetStatus();
    if (pages.Ok() && OMEDescription::IsOME(text))
    {
      const auto ome = OMEDescription::Read(
        name, text, page.Value().Components, request.Channel, request.TimePoint);
      status = ome.Ok() ? Choose(ome.Value(), files, pages.Value()) : ome.GetStatus();
      volume.Spacing = ome.Ok() ? ome.Value().Spacing : volume.Spacing;
      others.assign(files.begin() + 1, files.end());
      if (ome.Ok() && !ome.Value().Companion.empty())
      {
        others.push_back(ome.Value().Companion);
      }
    }
    else if (pages.Ok())
    {
      status = Choose(name, description, request, pages.Value());
    }
    if (!status.Ok())
    {
      return status;
    }
    slices = pages.Value();
  }
  else
  {
    for (std::size_t i = 0; i < request.Files.size(); ++i)
    {
      slices.emplace_back(i, 0);
    }
  }
  volume.Dimensions[2] = static_cast<std::int64_t>(slices.size());
  const auto reader =
    std::make_shared<Reader>(volume, page.Value(), std::move(files), std::move(slices));
  reader->SetCacheLimit(request.CacheBytes);
  return std::shared_ptr<VoxelReader>(reader);
}

} // namespace teravox
