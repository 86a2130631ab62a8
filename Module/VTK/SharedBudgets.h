// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <limits>
#include <map>
#include <mutex>

namespace teravox
{

/// The mappers of this process that hold memory for what they draw: budgets that nobody set are one
/// for all of them, divided by what each can use (DivideBudget()).
/// Thread: any.
class SharedBudgets
{
public:
  /// Bytes that a mapper can use; unknown until it has drawn.
  struct Needs
  {
    static constexpr std::uint64_t Unknown = std::numeric_limits<std::uint64_t>::max();
    std::uint64_t GPU = Unknown;
    std::uint64_t Host = Unknown;
  };

  /// With unknown needs, if it isn't there yet.
  void Add(const void* mapper);
  void Remove(const void* mapper);
  /// Of a mapper that was added; others have none.
  void SetNeeds(const void* mapper, const Needs& needs);
  /// What a mapper, added or not, has of `total` bytes.
  std::uint64_t ShareOf(const void* mapper, std::uint64_t total, std::uint64_t Needs::*kind) const;

  static SharedBudgets& All();

private:
  mutable std::mutex Lock;
  std::map<const void*, Needs> Mappers;
};

} // namespace teravox
