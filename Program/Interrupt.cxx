// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "Interrupt.h"

#include <atomic>
#include <csignal>

namespace teravox::program
{
namespace
{

std::atomic<bool> Interrupted{ false };
static_assert(std::atomic<bool>::is_always_lock_free, "set in a signal handler");

extern "C" void OnInterrupt(int number)
{
  Interrupted.store(true);
  std::signal(number, SIG_DFL);
}

} // namespace

void CatchInterrupts()
{
  std::signal(SIGINT, OnInterrupt);
  std::signal(SIGTERM, OnInterrupt);
}

bool WasInterrupted()
{
  return Interrupted.load();
}

} // namespace teravox::program
