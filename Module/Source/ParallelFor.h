// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <exception>

namespace teravox
{

/// Calls f(0) ... f(count - 1) from OpenMP's threads. No exception may leave an OpenMP region: the
/// first one is caught, the calls that haven't begun are left out, and it is thrown again here.
template <typename F>
void ParallelFor(std::int64_t count, const F& f)
{
  std::exception_ptr failure;
  bool failed = false;
#pragma omp parallel for schedule(dynamic) if (count > 1)
  for (std::int64_t i = 0; i < count; ++i)
  {
    bool skip = false;
#pragma omp atomic read
    skip = failed;
    if (skip)
    {
      continue;
    }
    try
    {
      f(i);
    }
    catch (...)
    {
#pragma omp critical(TeravoxParallelFor)
      failure = std::current_exception();
#pragma omp atomic write
      failed = true;
    }
  }
  if (failure)
  {
    std::rethrow_exception(failure);
  }
}

} // namespace teravox
