// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "TextNumbers.h"

#include "HeaderText.h"

#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <type_traits>
#include <unistd.h>
#include <utility>

namespace teravox
{

namespace
{
constexpr std::size_t PieceBytes = std::size_t{ 1 } << 18;
constexpr std::size_t LongestWord = 1024;

bool Separates(char c)
{
  return c == ' ' || c == ',' || (c >= '\t' && c <= '\r');
}

template <typename T>
bool Parse(const char* begin, const char* end, T& value)
{
  const auto [stop, error] = std::from_chars(begin, end, value);
  return stop == end && error == std::errc();
}

template <typename T>
bool ToElement(const std::string& word, std::byte* out)
{
  const char* begin = word.data();
  const char* end = begin + word.size();
  begin += word.size() > 1 && word[0] == '+' && word[1] != '-' ? 1 : 0;
  T value{};
  bool good = false;
  if constexpr (std::is_floating_point_v<T>)
  {
    good = Parse(begin, end, value);
    double wider = 0;
    if (!good && std::is_same_v<T, float> && Parse(begin, end, wider))
    {
      // Too small or too large for it, which printed doubles may be.
      constexpr auto most = static_cast<double>(std::numeric_limits<T>::max());
      value = std::abs(wider) > most
        ? std::copysign(std::numeric_limits<T>::infinity(), static_cast<T>(wider > 0 ? 1 : -1))
        : static_cast<T>(wider);
      good = true;
    }
  }
  else
  {
    std::int64_t wider = 0;
    good = Parse(begin, end, wider) && wider >= std::numeric_limits<T>::min() &&
      wider <= std::numeric_limits<T>::max();
    value = good ? static_cast<T>(wider) : value;
  }
  if (good && out != nullptr)
  {
    std::memcpy(out, &value, sizeof(value));
  }
  return good;
}

bool ToElement(ScalarType type, const std::string& word, std::byte* out)
{
  return DispatchScalarType(
    type, [&](auto element) { return ToElement<decltype(element)>(word, out); });
}
} // namespace

TextNumbers::TextNumbers(std::string fileName)
  : Name(std::move(fileName))
{
}

TextNumbers::~TextNumbers()
{
  if (this->File >= 0)
  {
    ::close(this->File);
  }
}

Result<std::unique_ptr<TextNumbers>> TextNumbers::Open(const std::string& fileName)
{
  std::unique_ptr<TextNumbers> numbers(new TextNumbers(fileName));
  const auto file = headers::OpenRegular(fileName);
  if (!file.Ok())
  {
    return file.GetStatus();
  }
  numbers->File = file.Value();
  return numbers;
}

void TextNumbers::GoTo(std::int64_t position)
{
  const std::int64_t at = position - this->Begin;
  if (at >= 0 && at <= static_cast<std::int64_t>(this->Buffer.size()))
  {
    this->At = static_cast<std::size_t>(at);
    return;
  }
  this->Buffer.clear();
  this->Begin = position;
  this->At = 0;
}

Status TextNumbers::Fill()
{
  this->Begin = this->Position();
  this->At = 0;
  this->Buffer.resize(PieceBytes);
  ssize_t n = -1;
  do
  {
    n = ::pread(this->File, this->Buffer.data(), PieceBytes, static_cast<off_t>(this->Begin));
  } while (n < 0 && errno == EINTR);
  this->Buffer.resize(n < 0 ? 0 : static_cast<std::size_t>(n));
  return n < 0 ? Status(StatusCode::InputOutput,
                   "'" + this->Name + "' can't be read: " + std::strerror(errno) + ".")
               : Status();
}

Status TextNumbers::NextWord(std::string& word)
{
  word.clear();
  while (true)
  {
    if (this->At == this->Buffer.size())
    {
      const Status status = this->Fill();
      if (!status.Ok() || this->Buffer.empty())
      {
        return status;
      }
    }
    const char c = this->Buffer[this->At];
    if (Separates(c) ? !word.empty() : word.size() == LongestWord)
    {
      return {};
    }
    ++this->At;
    if (!Separates(c))
    {
      word += c;
    }
  }
}

Status TextNumbers::Read(ScalarType type, std::size_t count, std::byte* out)
{
  const std::size_t step = SizeOf(type);
  std::string word;
  for (std::size_t i = 0; i < count; ++i)
  {
    const Status status = this->NextWord(word);
    if (!status.Ok())
    {
      return status;
    }
    if (word.empty())
    {
      return { StatusCode::Corrupt,
        "'" + this->Name + "' is too short: it ends where " + std::to_string(count - i) +
          " more numbers should be." };
    }
    if (!ToElement(type, word, out == nullptr ? nullptr : out + i * step))
    {
      return { StatusCode::Corrupt,
        "'" + this->Name + "' is damaged: before byte " + std::to_string(this->Position()) +
          " there is no number that " + ToString(type) + " holds." };
    }
  }
  return {};
}

} // namespace teravox
