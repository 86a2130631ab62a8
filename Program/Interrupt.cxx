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

// Paths; written before the handler is there.
std::array<std::array<char, 4096>, 2> Unfinished{};

extern "C" void OnInterrupt(int number)
{
  if (Interrupted.exchange(true))
  {
    for (const auto& path : Unfinished)
    {
      ::unlink(path.data()); // one of the few calls that a handler may make
    }
    std::signal(number, SIG_DFL);
    ::raise(number);
  }
}

} // namespace

void CatchInterrupts(const std::string& unfinished, const std::string& log)
{
  const std::array<const std::string*, 2> paths{ &unfinished, &log };
  for (std::size_t i = 0; i < paths.size(); ++i)
  {
    if (paths.at(i)->size() < Unfinished.at(i).size())
    {
      std::copy(paths.at(i)->begin(), paths.at(i)->end(), Unfinished.at(i).begin());
    }
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
