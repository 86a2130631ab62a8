// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "JsonDocument.h"

#include <utility>

namespace teravox
{

namespace
{
using nlohmann::json;

constexpr int Deepest = 64;

/// Leaves nothing in it that its destructor would have to make room for.
void TakeApart(json& value) noexcept
{
  if (value.is_structured())
  {
    for (json& child : value)
    {
      TakeApart(child);
    }
    value.clear();
  }
}
} // namespace

JsonDocument::JsonDocument(const std::string& text)
{
  // What is made of a text that turns out to be damaged would be destroyed by the library.
  if (!json::accept(text))
  {
    this->Value = json(json::value_t::discarded);
    return;
  }
  const auto keep = [](int depth, json::parse_event_t event, const json&)
  {
    return depth < Deepest ||
      (event != json::parse_event_t::array_start && event != json::parse_event_t::object_start);
  };
  this->Value = json::parse(text, keep, false);
}

JsonDocument::~JsonDocument()
{
  TakeApart(this->Value);
}

JsonDocument::JsonDocument(JsonDocument&& other) noexcept
  : Value(std::move(other.Value))
{
}

JsonDocument& JsonDocument::operator=(JsonDocument&& other) noexcept
{
  this->Value.swap(other.Value);
  return *this;
}

} // namespace teravox
