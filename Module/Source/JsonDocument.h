// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace teravox
{

/// What a JSON text says. The library's own value needs memory when it is destroyed, and ends the
/// program where there is none; this one is taken apart first, leaf by leaf, which needs none.
/// Thread: as a value.
class JsonDocument
{
public:
  /// Null: there is no text.
  JsonDocument() = default;
  /// Discarded (json::is_discarded) if the text isn't JSON. Lists and objects more than 64 deep are
  /// left out.
  explicit JsonDocument(const std::string& text);
  ~JsonDocument();
  JsonDocument(const JsonDocument&) = delete;
  JsonDocument& operator=(const JsonDocument&) = delete;
  JsonDocument(JsonDocument&& other) noexcept;
  JsonDocument& operator=(JsonDocument&& other) noexcept;

  const nlohmann::json& Root() const { return this->Value; }

private:
  nlohmann::json Value;
};

} // namespace teravox
