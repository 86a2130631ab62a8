// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "HDF5File.h"

#include "HDF5Lock.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <sys/stat.h>
#include <unistd.h>
#include <utility>

namespace teravox
{

namespace
{
// Requires: HDF5Lock held. An attribute is small; more than this isn't ours.
constexpr hsize_t LargestAttribute = 1 << 16;

// Requires: HDF5Lock held.
bool HasObject(hid_t file, const std::string& path)
{
  for (std::size_t i = path.find('/', 1);; i = path.find('/', i + 1))
  {
    const std::string part = path.substr(0, i);
    if (part.size() > 1 && H5Lexists(file, part.c_str(), H5P_DEFAULT) <= 0)
    {
      return false;
    }
    if (i == std::string::npos)
    {
      break;
    }
  }
  return H5Oexists_by_name(file, path.c_str(), H5P_DEFAULT) > 0;
}

// Requires: HDF5Lock held.
HDF5Handle OpenAttribute(hid_t file, const std::string& path, const std::string& name)
{
  if (!HasObject(file, path) ||
    H5Aexists_by_name(file, path.c_str(), name.c_str(), H5P_DEFAULT) <= 0)
  {
    return {};
  }
  return HDF5Handle(H5Aopen_by_name(file, path.c_str(), name.c_str(), H5P_DEFAULT, H5P_DEFAULT));
}

template <typename T>
std::optional<std::vector<T>> ReadNumbers(
  hid_t file, const std::string& path, const std::string& name, hid_t memoryType)
{
  const HDF5Lock lock;
  const HDF5Handle attribute = OpenAttribute(file, path, name);
  if (!attribute.Valid())
  {
    return std::nullopt;
  }
  const HDF5Handle type(H5Aget_type(attribute.Get()));
  const HDF5Handle space(H5Aget_space(attribute.Get()));
  const H5T_class_t kind = H5Tget_class(type.Get());
  const hssize_t n = H5Sget_simple_extent_npoints(space.Get());
  if ((kind != H5T_INTEGER && kind != H5T_FLOAT) || n < 0 ||
    static_cast<hsize_t>(n) > LargestAttribute)
  {
    return std::nullopt;
  }
  std::vector<T> values(static_cast<std::size_t>(n));
  if (H5Aread(attribute.Get(), memoryType, values.data()) < 0)
  {
    return std::nullopt;
  }
  return values;
}
} // namespace

HDF5File::HDF5File(HDF5Handle id, std::string name)
  : Handle(std::move(id))
  , Name_(std::move(name))
{
}

HDF5File::~HDF5File()
{
  const HDF5Lock lock;
  this->Handle.Reset();
}

Result<std::shared_ptr<HDF5File>> HDF5File::Open(const std::string& fileName)
{
  const std::string quoted = "'" + fileName + "'";
  struct stat info = {};
  if (::stat(fileName.c_str(), &info) != 0)
  {
    const int error = errno;
    return error == ENOENT || error == ENOTDIR
      ? Status(StatusCode::NotFound, "The file " + quoted + " doesn't exist.")
      : Status(StatusCode::InputOutput,
          "The file " + quoted + " can't be opened: " + std::strerror(error) + ".");
  }
  if (S_ISDIR(info.st_mode))
  {
    return Status(StatusCode::InputOutput, "'" + fileName + "' is a folder, not an HDF5 file.");
  }
  if (::access(fileName.c_str(), R_OK) != 0)
  {
    return Status(StatusCode::InputOutput,
      "The file " + quoted + " can't be read: " + std::strerror(errno) + ".");
  }
  HDF5Handle id;
  std::string cause;
  {
    const HDF5Lock lock;
    if (H5Fis_hdf5(fileName.c_str()) <= 0)
    {
      lock.TakeError();
      return Status(StatusCode::Corrupt, "The file " + quoted + " isn't an HDF5 file.");
    }
    const HDF5Handle access(H5Pcreate(H5P_FILE_ACCESS));
    H5Pset_fapl_sec2(access.Get());
    // Some file systems have no locks; a reader needs none. The second attempt is for a file that
    // this process has open already with the default setting.
    H5Pset_file_locking(access.Get(), false, true);
    id = HDF5Handle(H5Fopen(fileName.c_str(), H5F_ACC_RDONLY, access.Get()));
    if (!id.Valid())
    {
      cause = lock.TakeError();
      id = HDF5Handle(H5Fopen(fileName.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT));
      lock.TakeError();
    }
  }
  if (!id.Valid())
  {
    return Status(StatusCode::Corrupt,
      "The HDF5 file " + quoted + " can't be opened, it is damaged or incomplete: " + cause + ".");
  }
  return std::make_shared<HDF5File>(std::move(id), fileName);
}

bool HDF5File::Has(const std::string& path) const
{
  const HDF5Lock lock;
  return HasObject(this->Id(), path);
}

std::vector<std::string> HDF5File::Children(const std::string& path, std::size_t limit) const
{
  std::vector<std::string> names;
  const HDF5Lock lock;
  if (!HasObject(this->Id(), path))
  {
    return names;
  }
  const HDF5Handle group(H5Gopen2(this->Id(), path.c_str(), H5P_DEFAULT));
  H5G_info_t info = {};
  if (!group.Valid() || H5Gget_info(group.Get(), &info) < 0)
  {
    return names;
  }
  for (hsize_t i = 0; i < info.nlinks && names.size() < limit; ++i)
  {
    const ssize_t length =
      H5Lget_name_by_idx(group.Get(), ".", H5_INDEX_NAME, H5_ITER_INC, i, nullptr, 0, H5P_DEFAULT);
    if (length > 0)
    {
      std::string name(static_cast<std::size_t>(length), '\0');
      H5Lget_name_by_idx(
        group.Get(), ".", H5_INDEX_NAME, H5_ITER_INC, i, name.data(), name.size() + 1, H5P_DEFAULT);
      names.push_back(name);
    }
  }
  return names;
}

std::optional<std::string> HDF5File::Text(
  const std::string& path, const std::string& attribute) const
{
  const HDF5Lock lock;
  const HDF5Handle id = OpenAttribute(this->Id(), path, attribute);
  if (!id.Valid())
  {
    return std::nullopt;
  }
  const HDF5Handle type(H5Aget_type(id.Get()));
  const HDF5Handle space(H5Aget_space(id.Get()));
  if (H5Tget_class(type.Get()) != H5T_STRING || H5Sget_simple_extent_npoints(space.Get()) != 1)
  {
    return std::nullopt;
  }
  if (H5Tis_variable_str(type.Get()) > 0)
  {
    char* text = nullptr;
    const HDF5Handle memory(H5Tcopy(H5T_C_S1));
    H5Tset_size(memory.Get(), H5T_VARIABLE);
    H5Tset_cset(memory.Get(), H5Tget_cset(type.Get()));
    if (H5Aread(id.Get(), memory.Get(), static_cast<void*>(&text)) < 0 || text == nullptr)
    {
      return std::nullopt;
    }
    std::string value = text;
    H5free_memory(text);
    return value;
  }
  const std::size_t size = H5Tget_size(type.Get());
  if (size > LargestAttribute)
  {
    return std::nullopt;
  }
  std::string value(size, '\0');
  if (H5Aread(id.Get(), type.Get(), value.data()) < 0)
  {
    return std::nullopt;
  }
  value.resize(std::min(value.size(), value.find('\0')));
  return value;
}

std::optional<std::vector<double>> HDF5File::Numbers(
  const std::string& path, const std::string& attribute) const
{
  return ReadNumbers<double>(this->Id(), path, attribute, H5T_NATIVE_DOUBLE);
}

std::optional<std::vector<std::int64_t>> HDF5File::Integers(
  const std::string& path, const std::string& attribute) const
{
  return ReadNumbers<std::int64_t>(this->Id(), path, attribute, H5T_NATIVE_INT64);
}

} // namespace teravox
