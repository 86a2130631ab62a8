// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "TexelFormat.h"

#include <sstream>

namespace teravox
{

std::string FilterProbe::ToString() const
{
  std::string text;
  const auto add = [&text](bool exact, const char* name)
  {
    if (exact)
    {
      text += (text.empty() ? "" : ",") + std::string(name);
    }
  };
  add(this->R8, "r8");
  add(this->R16, "r16");
  add(this->R32F, "r32f");
  return text.empty() ? "none" : text;
}

std::optional<FilterProbe> FilterProbe::FromString(const std::string& text)
{
  FilterProbe probe;
  if (text == "none")
  {
    return probe;
  }
  std::istringstream words(text);
  int found = 0;
  for (std::string word; std::getline(words, word, ','); ++found)
  {
    bool* const exact = word == "r8" ? &probe.R8
      : word == "r16"                ? &probe.R16
      : word == "r32f"               ? &probe.R32F
                                     : nullptr;
    if (exact == nullptr)
    {
      return std::nullopt;
    }
    *exact = true;
  }
  return found > 0 ? std::optional<FilterProbe>(probe) : std::nullopt;
}

TexelFormat TexelFormat::Choose(ScalarType type, const FilterProbe& probe)
{
  switch (type)
  {
    case ScalarType::UInt8:
    case ScalarType::Int8:
      return { probe.R8 || !probe.R16 ? 1u : 2u, probe.R8 || probe.R16, false };
    case ScalarType::UInt16:
    case ScalarType::Int16:
      return { 2, probe.R16, false };
    case ScalarType::Float32:
      return { 4, probe.R32F, false };
    case ScalarType::UInt32:
    case ScalarType::Int32:
    case ScalarType::Float64:
    default:
      return { 4, probe.R32F, true };
  }
}

} // namespace teravox
