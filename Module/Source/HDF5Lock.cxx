// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "HDF5Lock.h"

#include <cstring>

namespace teravox
{

std::mutex& HDF5Lock::Mutex()
{
  static std::mutex mutex;
  return mutex;
}

HDF5Lock::HDF5Lock()
  : Guard(Mutex())
{
  H5Eget_auto2(H5E_DEFAULT, &this->Function, &this->Data);
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
}

HDF5Lock::~HDF5Lock()
{
  H5Eset_auto2(H5E_DEFAULT, this->Function, this->Data);
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
