// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "BrickKey.h"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <random>
#include <unordered_map>
#include <vector>

namespace teravox
{

/// The wish for one brick or page block. PageLevel 0 is a brick; PageLevel k >= 1 is the page block
/// under that page entry: the PageBlockEdge^3 ranges of page level k-1 from Key.{X,Y,Z} *
/// PageBlockEdge.
struct LoadRequest
{
  BrickKey Key;
  double Priority = 0; ///< larger = sooner; ties by the order of the keys
};

/// Hands out wishes, the most urgent first, each key once.
///
///   Replace --> queued --Pop--> in flight --Finish--> gone
///
/// A new set of wishes replaces those that weren't handed out; a key in flight isn't queued again.
/// Thread: one at a time; the owner locks.
class RequestQueue
{
public:
  /// What Pop() hands out. The ticket tells two flights of one key apart.
  struct Flight
  {
    LoadRequest Request;
    std::uint64_t Ticket = 0;
  };

  /// Of several wishes for one key the most urgent counts. NaN is the least urgent priority.
  void Replace(std::vector<LoadRequest> wishes);
  std::optional<Flight> Pop();
  /// The key may be wished for again. Does nothing if the flight was forgotten.
  void Finish(const Flight& flight);
  /// Whether the flight is still wanted: not forgotten by RemoveVolume().
  bool IsInFlight(const Flight& flight) const;
  /// Puts a flight back, as urgent as it was, unless it was forgotten.
  void PutBack(const Flight& flight);
  /// Drops what is queued for a volume and forgets its flights.
  void RemoveVolume(std::uint32_t volume);
  /// Drops what is queued.
  void Clear() { this->Queued_.clear(); }

  std::size_t Queued() const { return this->Queued_.size(); }
  std::size_t InFlight() const { return this->Flights.size(); }
  /// The wishes in the order in which Pop() will hand them out; for tests.
  std::vector<LoadRequest> Wishes() const;

  /// Hands wishes out in a random order that depends on the seed: for tests of what must not depend
  /// on the order of arrival.
  void Shuffle(std::uint64_t seed) { this->Random.emplace(seed); }

private:
  std::vector<LoadRequest> Queued_; // the most urgent last
  std::unordered_map<BrickKey, std::uint64_t, BrickKeyHash> Flights;
  std::uint64_t LastTicket = 0;
  std::optional<std::mt19937_64> Random;
};

} // namespace teravox
