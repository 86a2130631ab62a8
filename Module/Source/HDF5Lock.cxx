// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "HDF5Lock.h"

#include <cstring>

namespace teravox
{

namespace
{
thread_local std::uint64_t Failures = 0;
thread_local std::string LastFailure;

// The library's driver says so, with errno.
herr_t NoteReadFailure(hid_t stack, void*)
{
  const auto first = [](unsigned n, const H5E_error2_t* error, void*) -> herr_t
  {
    constexpr const char* text = "file read failed";
    if (n == 0 && error->desc != nullptr && std::strstr(error->desc, text) != nullptr)
    {
      ++Failures;
      LastFailure = error->desc;
    }
    return 0;
  };
  return H5Ewalk2(stack, H5E_WALK_UPWARD, first, nullptr);
}
} // namespace

std::mutex& HDF5Lock::Mutex()
{
  static std::mutex mutex;
  return mutex;
}

HDF5Lock::HDF5Lock()
  : Guard(Mutex())
{
  H5Eget_auto2(H5E_DEFAULT, &this->Function, &this->Data);
  H5Eset_auto2(H5E_DEFAULT, &NoteReadFailure, nullptr);
}

HDF5Lock::~HDF5Lock()
{
  H5Eset_auto2(H5E_DEFAULT, this->Function, this->Data);
}

std::uint64_t HDF5Lock::ReadFailures()
{
  return Failures;
}

const std::string& HDF5Lock::LastReadFailure()
{
  return LastFailure;
}

std::string HDF5Lock::TakeError() const
{
  std::string text;
  const auto first = [](unsigned, const H5E_error2_t* error, void* out) -> herr_t
  {
    auto& message = *static_cast<std::string*>(out);
    if (message.empty() && error->desc != nullptr)
    {
      message = error->desc;
    }
    return 0;
  };
  H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, first, &text);
  H5Eclear2(H5E_DEFAULT);
  return text.empty() ? "no reason given" : text;
}

bool HDF5Lock::TakeUnallocated() const
{
  bool unallocated = false;
  const auto first = [](unsigned n, const H5E_error2_t* error, void* out) -> herr_t
  {
    if (n == 0)
    {
      *static_cast<bool*>(out) = error->maj_num == H5E_DATASET && error->desc != nullptr &&
        std::strcmp(error->desc, "chunk storage is not allocated") == 0;
    }
    return 0;
  };
  H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, first, &unallocated);
  if (unallocated)
  {
    H5Eclear2(H5E_DEFAULT);
  }
  return unallocated;
}

} // namespace teravox
