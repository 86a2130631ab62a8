// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "Interrupt.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <csignal>
#include <unistd.h>

namespace teravox::program
{
namespace
{

std::atomic<bool> Interrupted{ false };
static_assert(std::atomic<bool>::is_always_lock_free, "set in a signal handler");

std::array<char, 4096> Unfinished{}; // a path; written before the handler is there

extern "C" void OnInterrupt(int number)
{
  if (Interrupted.exchange(true))
  {
    ::unlink(Unfinished.data()); // one of the few calls that a handler may make
    std::signal(number, SIG_DFL);
    ::raise(number);
  }
}

} // namespace

void CatchInterrupts(const std::string& unfinished)
{
  if (unfinished.size() < Unfinished.size())
  {
    std::copy(unfinished.begin(), unfinished.end(), Unfinished.begin());
  }
  for (const int number : { SIGINT, SIGTERM, SIGHUP })
  {
    struct sigaction action = {};
    action.sa_handler = OnInterrupt;
    action.sa_flags = SA_RESTART;
    ::sigaction(number, &action, nullptr);
  }
}

bool WasInterrupted()
{
  return Interrupted.load();
}

} // namespace teravox::program
