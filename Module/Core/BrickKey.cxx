// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "BrickKey.h"

#include "PyramidLayout.h"

#include <tuple>

namespace teravox
{

BrickKey BrickKey::FirstChild() const
{
  BrickKey first = *this;
  first.PageLevel = static_cast<std::uint8_t>(this->PageLevel - 1);
  first.X *= PageBlockEdge;
  first.Y *= PageBlockEdge;
  first.Z *= PageBlockEdge;
  return first;
}

bool BrickKey::operator<(const BrickKey& o) const
{
  const auto tie = [](const BrickKey& k)
  { return std::tie(k.Volume, k.Time, k.Component, k.Level, k.PageLevel, k.Z, k.Y, k.X); };
  return tie(*this) < tie(o);
}

std::string BrickKey::ToString() const
{
  std::string text = "level " + std::to_string(this->Level) +
    (this->PageLevel == 0 ? ", brick ("
                          : ", page level " + std::to_string(this->PageLevel) + " (") +
    std::to_string(this->X) + ", " + std::to_string(this->Y) + ", " + std::to_string(this->Z) + ")";
  if (this->Time != 0)
  {
    text += ", time step " + std::to_string(this->Time);
  }
  if (this->Component != 0)
  {
    text += ", component " + std::to_string(this->Component);
  }
  if (this->Volume != 0)
  {
    text += ", volume " + std::to_string(this->Volume);
  }
  return text;
}

} // namespace teravox
