// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "HDF5Lock.h"

#include <array>
#include <cstring>

namespace teravox
{

namespace
{
thread_local std::uint64_t Failures = 0;
// The library calls back what must not throw: no text that needs memory.
thread_local std::array<char, 512> LastFailure{};

// The library's driver says so, with errno.
herr_t NoteReadFailure(hid_t stack, void*)
{
  const auto first = [](unsigned n, const H5E_error2_t* error, void*) -> herr_t
  {
    constexpr const char* text = "file read failed";
    if (n == 0 && error->desc != nullptr && std::strstr(error->desc, text) != nullptr)
    {
      ++Failures;
      std::strncpy(LastFailure.data(), error->desc, LastFailure.size() - 1);
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

const char* HDF5Lock::LastReadFailure()
{
  return LastFailure.data();
}

std::string HDF5Lock::TakeError() const
{
  const char* description = nullptr; // the library's, until it is cleared
  const auto first = [](unsigned, const H5E_error2_t* error, void* out) -> herr_t
  {
    const char*& message = *static_cast<const char**>(out);
    if (message == nullptr && error->desc != nullptr && *error->desc != 0)
    {
      message = error->desc;
    }
    return 0;
  };
  H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, first, &description);
  std::string text = description != nullptr ? description : "no reason given";
  H5Eclear2(H5E_DEFAULT);
  return text;
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
