// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <thread>
#include <utility>

namespace teravox
{

/// Seconds that whoever closes a volume waits for the reads that are under way.
constexpr double PatienceAtTheEnd = 3;

/// Destroys an object whose destructor waits for reads that are under way: BrickLoader, ReadAhead,
/// DirectoryReader. A disk that doesn't answer may let them wait for ever, so after `seconds` the
/// object is left to a thread that nobody waits for; it ends there when the read does.
/// Requires: T::EndWithin(seconds) begins nothing more and tells whether all reads have ended; the
/// object owns or shares all that it uses.
template <typename T>
void EndOrLeave(std::unique_ptr<T> object, double seconds = PatienceAtTheEnd)
{
  if (object && !object->EndWithin(seconds))
  {
    std::thread([](const std::unique_ptr<T>&) {}, std::move(object)).detach();
  }
}

} // namespace teravox
