// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "WaitScope.h"

#include <mutex>

namespace teravox
{

namespace
{
std::mutex HooksMutex;
WaitHooks Hooks;
} // namespace

void SetWaitHooks(const WaitHooks& hooks)
{
  const std::lock_guard<std::mutex> lock(HooksMutex);
  Hooks = hooks;
}

WaitScope::WaitScope()
{
  WaitHooks hooks;
  {
    const std::lock_guard<std::mutex> lock(HooksMutex);
    hooks = Hooks;
  }
  this->End = hooks.End;
  this->State = hooks.Begin != nullptr ? hooks.Begin() : nullptr;
}

WaitScope::~WaitScope()
{
  if (this->End != nullptr)
  {
    this->End(this->State);
  }
}

} // namespace teravox
