// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "SharedBudgets.h"

#include "BudgetShares.h"

#include <algorithm>
#include <vector>

namespace teravox
{

void SharedBudgets::Add(const void* mapper)
{
  const std::lock_guard<std::mutex> guard(this->Lock);
  this->Mappers.emplace(mapper, Needs());
}

void SharedBudgets::Remove(const void* mapper)
{
  const std::lock_guard<std::mutex> guard(this->Lock);
  this->Mappers.erase(mapper);
}

void SharedBudgets::SetNeeds(const void* mapper, const Needs& needs)
{
  const std::lock_guard<std::mutex> guard(this->Lock);
  const auto found = this->Mappers.find(mapper);
  if (found != this->Mappers.end())
  {
    found->second = needs;
  }
}

std::uint64_t SharedBudgets::ShareOf(
  const void* mapper, std::uint64_t total, std::uint64_t Needs::*kind) const
{
  const std::lock_guard<std::mutex> guard(this->Lock);
  std::map<const void*, Needs> all = this->Mappers;
  const auto own = all.emplace(mapper, Needs()).first;
  std::vector<std::uint64_t> needs;
  needs.reserve(all.size());
  for (const auto& other : all)
  {
    needs.push_back(std::min(other.second.*kind, total));
  }
  return DivideBudget(total, needs)[static_cast<std::size_t>(std::distance(all.begin(), own))];
}

SharedBudgets& SharedBudgets::All()
{
  static SharedBudgets all;
  return all;
}

} // namespace teravox
