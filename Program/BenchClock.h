// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <chrono>
#include <ctime>
#include <vector>

namespace teravox::program
{

/// Wall time, and processor time of all threads of this process, since it was made.
class BenchClock
{
public:
  double Seconds() const
  {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - this->Start).count();
  }
  double CPUSeconds() const { return ProcessSeconds() - this->StartCPU; }

private:
  static double ProcessSeconds()
  {
    timespec time{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
  }

  std::chrono::steady_clock::time_point Start = std::chrono::steady_clock::now();
  double StartCPU = ProcessSeconds();
};

/// Requires: there is at least one number.
inline double MedianOf(std::vector<double> numbers)
{
  std::sort(numbers.begin(), numbers.end());
  return numbers[numbers.size() / 2];
}

} // namespace teravox::program
