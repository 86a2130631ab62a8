// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace teravox
{

/// What a host wants to do around waiting. A thread that waits for others may hold something that
/// those need: Python's interpreter lock, when bricks are read by Python code. `Begin` gives it up
/// and returns what `End` needs to take it back, on the same thread; both may be null.
struct WaitHooks
{
  void* (*Begin)() = nullptr;
  void (*End)(void* state) = nullptr;
};

/// Sets the hooks of the process. Thread: any; scopes that are open end with the hooks that they
/// began with. The functions must stay callable for the life of the process.
void SetWaitHooks(const WaitHooks& hooks);

/// Open while the thread does nothing but wait for other threads. Requires: no lock is held that
/// End's owner could want, and nothing but waiting is done meanwhile.
class WaitScope
{
public:
  WaitScope();
  ~WaitScope();
  WaitScope(const WaitScope&) = delete;
  WaitScope& operator=(const WaitScope&) = delete;
  WaitScope(WaitScope&&) = delete;
  WaitScope& operator=(WaitScope&&) = delete;

private:
  void (*End)(void*) = nullptr;
  void* State = nullptr;
};

} // namespace teravox
