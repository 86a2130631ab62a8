// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "Picture.h"
#include "Status.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>
#include <utility>

namespace teravox
{

/// A PNG, JPEG, PNM, BMP or TGA file: its header has been read, its pixels can be. The libraries of
/// the first two report errors by jumps, which here pass frames without destructors only, and have
/// nothing to print.
/// Thread: one at a time.
class PictureFile
{
public:
  enum class Format
  {
    None,
    PNG,
    JPEG,
    PNM,
    BMP,
    TGA
  };

  struct Header : Picture
  {
    Format Of = Format::None;
    std::array<double, 2> Spacing{ 1, 1 }; ///< in mm where the file has a length, else 1
    std::uint64_t DecoderBytes = 0;        ///< of memory that Read() takes beside its output
  };

  /// By the first bytes, TGA by its name; None for what can't be read, too.
  static Format FormatOf(const std::string& fileName);

  /// Reads the header, and nothing into memory whose size it says. Errors: NotFound, InputOutput,
  /// Corrupt; Unsupported (no regular file; JPEG with other colours than grey and RGB, of other
  /// than 8 bits, or coded in an unusual way; PBM; BMP and TGA with pixels of 15 or 16 bits;
  /// compressed BMP).
  static Result<std::unique_ptr<PictureFile>> Open(const std::string& fileName);

  PictureFile(const PictureFile&) = delete;
  PictureFile& operator=(const PictureFile&) = delete;
  virtual ~PictureFile() = default;

  const Header& GetHeader() const { return this->Head; }

  /// All rows, the lowest one of the picture first, as in VTK's readers. Once only.
  /// Errors: Corrupt (damaged or cut off), InputOutput, Unsupported.
  Status Read(std::byte* out);

protected:
  struct Closer
  {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  using Stream = std::unique_ptr<std::FILE, Closer>;

  PictureFile(std::string fileName, Stream file)
    : Name(std::move(fileName))
    , File(std::move(file))
  {
  }
  /// What a library does: false after a jump, with Error set.
  virtual bool ReadHeader() = 0;
  virtual bool ReadRows(std::byte* out) = 0;

  /// Of Head, for the row of the picture that is the n-th one from above.
  std::size_t RowBytes() const;
  std::byte* Row(std::size_t fromAbove, std::byte* out) const;
  /// Like fread(); sets Error if there are no bytes left, or on an error of the system.
  std::size_t Take(void* to, std::size_t size);
  /// Like fgetc(), and so.
  int Next();
  /// Takes the next character if it is this one.
  void SkipIf(char wanted);
  /// To a byte of the file; false, with Error set, if it ends before.
  bool Seek(std::uint64_t to);
  std::uint64_t BytesLeft() const;
  /// Sets Error; false.
  bool Fail(const char* text, bool refused = false);
  static constexpr std::uint64_t BufferBytes = 8192; ///< of an open file

  Header Head;
  std::array<char, 256> Error{};
  bool Refused = false; // Error is about what isn't read here, not about damage

private:
  static std::unique_ptr<PictureFile> OfPNG(const std::string& fileName, Stream file);
  static std::unique_ptr<PictureFile> OfJPEG(const std::string& fileName, Stream file);
  static std::unique_ptr<PictureFile> OfPNM(const std::string& fileName, Stream file);
  static std::unique_ptr<PictureFile> OfBMP(const std::string& fileName, Stream file);
  static std::unique_ptr<PictureFile> OfTGA(const std::string& fileName, Stream file);
  Status Failure() const;

  std::string Name;
  Stream File;
};

} // namespace teravox
