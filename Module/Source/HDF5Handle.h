// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <hdf5.h>
#include <utility>

namespace teravox
{

/// Owns one HDF5 identifier of any kind.
/// Thread: create, reset and destroy only while an HDF5Lock is held.
class HDF5Handle
{
public:
  HDF5Handle() = default;
  explicit HDF5Handle(hid_t id)
    : Id(id)
  {
  }
  ~HDF5Handle() { this->Reset(); }
  HDF5Handle(const HDF5Handle&) = delete;
  HDF5Handle& operator=(const HDF5Handle&) = delete;
  HDF5Handle(HDF5Handle&& other) noexcept
    : Id(std::exchange(other.Id, H5I_INVALID_HID))
  {
  }
  HDF5Handle& operator=(HDF5Handle&& other) noexcept
  {
    if (this != &other)
    {
      this->Reset();
      this->Id = std::exchange(other.Id, H5I_INVALID_HID);
    }
    return *this;
  }

  bool Valid() const { return this->Id >= 0; }
  hid_t Get() const { return this->Id; }
  /// False if the library couldn't close it, for instance because the disk is full.
  bool Reset()
  {
    const hid_t id = std::exchange(this->Id, H5I_INVALID_HID);
    if (id < 0)
    {
      return true;
    }
    return H5Iget_type(id) == H5I_FILE ? H5Fclose(id) >= 0 : H5Idec_ref(id) >= 0;
  }

private:
  hid_t Id = H5I_INVALID_HID;
};

} // namespace teravox
