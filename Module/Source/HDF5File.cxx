// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "HDF5File.h"

#include "HDF5Lock.h"
#include "Import/HeaderText.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <exception>
#include <limits>
#include <sys/stat.h>
#include <unistd.h>
#include <utility>

namespace teravox
{

namespace
{
// Requires: HDF5Lock held. An attribute is small; more than this isn't ours.
constexpr hsize_t LargestAttribute = 1 << 16;
constexpr std::size_t LargestText = 1 << 24;

/// What an absolute path leads to.
struct Found
{
  bool Exists = false;
  std::string MissingFile; // of a link to another file
};

bool IsRegularFile(const std::string& name)
{
  struct stat info = {};
  return ::stat(name.c_str(), &info) == 0 && S_ISREG(info.st_mode);
}

// Requires: HDF5Lock held. The library opens whatever an external link names, and would wait for a
// pipe.
std::string MissingTarget(hid_t file, const std::string& link, const H5L_info_t& info)
{
  std::vector<char> value(std::min<std::size_t>(info.u.val_size, LargestAttribute));
  unsigned flags = 0;
  const char* target = nullptr;
  const char* object = nullptr;
  if (value.empty() ||
    H5Lget_val(file, link.c_str(), value.data(), value.size(), H5P_DEFAULT) < 0 ||
    H5Lunpack_elink_val(value.data(), value.size(), &flags, &target, &object) < 0)
  {
    return "?";
  }
  const std::string name = target;
  if (name.empty())
  {
    return "?";
  }
  std::vector<char> own(4096);
  const ssize_t length = H5Fget_name(file, own.data(), own.size());
  std::string folder =
    length > 0 && static_cast<std::size_t>(length) < own.size() ? own.data() : std::string();
  folder.resize(folder.rfind('/') == std::string::npos ? 0 : folder.rfind('/') + 1);
  // In the order of the library, which also looks beside the file for the last part of the name.
  const std::string last =
    name.substr(name.rfind('/') == std::string::npos ? 0 : name.rfind('/') + 1);
  const bool absolute = name[0] == '/';
  for (const std::string& candidate : { absolute ? name : folder + name, name, folder + last })
  {
    struct stat any = {};
    if (::stat(candidate.c_str(), &any) == 0)
    {
      return IsRegularFile(candidate) ? std::string() : candidate;
    }
  }
  return name;
}

// Requires: HDF5Lock held.
Found FindObject(hid_t file, const std::string& path)
{
  Found found;
  if (path.empty() || path[0] != '/' || path.size() > LargestAttribute)
  {
    return found;
  }
  for (std::size_t i = path.find('/', 1);; i = path.find('/', i + 1))
  {
    const std::string part = path.substr(0, i);
    H5L_info_t info = {};
    if (part.size() > 1)
    {
      if (H5Lexists(file, part.c_str(), H5P_DEFAULT) <= 0 ||
        H5Lget_info(file, part.c_str(), &info, H5P_DEFAULT) < 0)
      {
        return found;
      }
      if (info.type == H5L_TYPE_EXTERNAL)
      {
        found.MissingFile = MissingTarget(file, part, info);
        if (!found.MissingFile.empty())
        {
          return found;
        }
      }
    }
    if (i == std::string::npos)
    {
      break;
    }
  }
  found.Exists = H5Oexists_by_name(file, path.c_str(), H5P_DEFAULT) > 0;
  return found;
}

// Requires: HDF5Lock held.
bool HasObject(hid_t file, const std::string& path)
{
  return FindObject(file, path).Exists;
}

// Requires: HDF5Lock held.
HDF5Handle OpenDataset(hid_t file, const std::string& path)
{
  H5O_info_t info = {};
  if (!HasObject(file, path) ||
    H5Oget_info_by_name2(file, path.c_str(), &info, H5O_INFO_BASIC, H5P_DEFAULT) < 0 ||
    info.type != H5O_TYPE_DATASET)
  {
    return {};
  }
  return HDF5Handle(H5Dopen2(file, path.c_str(), H5P_DEFAULT));
}

// Requires: HDF5Lock held. Reads `count` strings, through `read` into memory of a given type.
template <typename Read>
std::optional<std::vector<std::string>> ReadStrings(
  hid_t type, hid_t space, std::size_t count, const Read& read)
{
  std::vector<std::string> texts;
  if (H5Tis_variable_str(type) > 0)
  {
    std::vector<char*> values(count, nullptr);
    const HDF5Handle memory(H5Tcopy(H5T_C_S1));
    H5Tset_size(memory.Get(), H5T_VARIABLE);
    H5Tset_cset(memory.Get(), H5Tget_cset(type));
    if (!read(memory.Get(), static_cast<void*>(values.data())))
    {
      return std::nullopt;
    }
    for (const char* value : values)
    {
      texts.emplace_back(value == nullptr ? "" : value);
    }
    H5Dvlen_reclaim(memory.Get(), space, H5P_DEFAULT, static_cast<void*>(values.data()));
    return texts;
  }
  const std::size_t size = H5Tget_size(type);
  if (size == 0 || size > LargestText || count > LargestText / size)
  {
    return std::nullopt;
  }
  std::string all(count * size, '\0');
  if (!read(type, static_cast<void*>(all.data())))
  {
    return std::nullopt;
  }
  for (std::size_t i = 0; i < count; ++i)
  {
    const std::string text = all.substr(i * size, size);
    texts.push_back(text.substr(0, text.find('\0')));
  }
  return texts;
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
  // Booleans are enumerations.
  if ((kind != H5T_INTEGER && kind != H5T_FLOAT && kind != H5T_ENUM) || n < 0 ||
    static_cast<hsize_t>(n) > LargestAttribute)
  {
    return std::nullopt;
  }
  std::vector<T> values(static_cast<std::size_t>(n));
  if (n > 0 && H5Aread(attribute.Get(), memoryType, values.data()) < 0)
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
  if (!S_ISREG(info.st_mode) && !S_ISDIR(info.st_mode))
  {
    return Status(StatusCode::InputOutput, "'" + fileName + "' isn't a regular file.");
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
      const auto begin = headers::Begin(fileName, 3);
      const bool isNetCDF = begin.Ok() && begin.Value() == "CDF";
      return Status(StatusCode::Corrupt,
        "The file " + quoted +
          (isNetCDF ? " isn't an HDF5 file, but classic NetCDF: 'nccopy -k nc4', or of MINC 1 "
                      "'mincconvert -2', makes HDF5 of it."
                    : " isn't an HDF5 file."));
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

std::string HDF5File::MissingFile(const std::string& path) const
{
  const HDF5Lock lock;
  return FindObject(this->Id(), path).MissingFile;
}

bool HDF5File::IsGroup(const std::string& path) const
{
  const HDF5Lock lock;
  H5O_info_t info = {};
  return HasObject(this->Id(), path) &&
    H5Oget_info_by_name2(this->Id(), path.c_str(), &info, H5O_INFO_BASIC, H5P_DEFAULT) >= 0 &&
    info.type == H5O_TYPE_GROUP;
}

std::uint64_t HDF5File::ObjectAddress(const std::string& path) const
{
  const HDF5Lock lock;
  H5O_info_t info = {};
  if (!HasObject(this->Id(), path) ||
    H5Oget_info_by_name2(this->Id(), path.c_str(), &info, H5O_INFO_BASIC, H5P_DEFAULT) < 0)
  {
    return 0;
  }
  // Addresses of other files may be the same numbers; the file's own number tells them apart.
  return info.addr * 64 + info.fileno % 64 + 1;
}

std::optional<std::vector<std::int64_t>> HDF5File::DatasetShape(const std::string& path) const
{
  const HDF5Lock lock;
  const HDF5Handle dataset = OpenDataset(this->Id(), path);
  if (!dataset.Valid())
  {
    return std::nullopt;
  }
  const HDF5Handle space(H5Dget_space(dataset.Get()));
  std::array<hsize_t, H5S_MAX_RANK> size{};
  const int rank = H5Sget_simple_extent_dims(space.Get(), size.data(), nullptr);
  std::vector<std::int64_t> shape;
  for (int a = 0; a < rank; ++a)
  {
    constexpr hsize_t most = std::numeric_limits<std::int64_t>::max();
    shape.push_back(
      static_cast<std::int64_t>(std::min(size.at(static_cast<std::size_t>(a)), most)));
  }
  return shape;
}

std::string HDF5File::DatasetType(const std::string& path) const
{
  const HDF5Lock lock;
  const HDF5Handle dataset = OpenDataset(this->Id(), path);
  const HDF5Handle type(dataset.Valid() ? H5Dget_type(dataset.Get()) : H5I_INVALID_HID);
  const H5T_class_t kind = type.Valid() ? H5Tget_class(type.Get()) : H5T_NO_CLASS;
  if (kind != H5T_INTEGER && kind != H5T_FLOAT)
  {
    return {};
  }
  const bool isSigned = kind == H5T_INTEGER && H5Tget_sign(type.Get()) == H5T_SGN_2;
  return (kind == H5T_FLOAT ? "f"
             : isSigned     ? "i"
                            : "u") +
    std::to_string(8 * H5Tget_size(type.Get()));
}

std::optional<std::vector<double>> HDF5File::DatasetNumbers(
  const std::string& path, std::size_t limit) const
{
  const HDF5Lock lock;
  const HDF5Handle dataset = OpenDataset(this->Id(), path);
  if (!dataset.Valid())
  {
    return std::nullopt;
  }
  const HDF5Handle type(H5Dget_type(dataset.Get()));
  const HDF5Handle space(H5Dget_space(dataset.Get()));
  const H5T_class_t kind = H5Tget_class(type.Get());
  const hssize_t n = H5Sget_simple_extent_npoints(space.Get());
  if ((kind != H5T_INTEGER && kind != H5T_FLOAT) || n < 0 || static_cast<hsize_t>(n) > limit)
  {
    return std::nullopt;
  }
  std::vector<double> values(static_cast<std::size_t>(n));
  if (n > 0 &&
    H5Dread(dataset.Get(), H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) < 0)
  {
    return std::nullopt;
  }
  return values;
}

std::optional<std::string> HDF5File::DatasetText(const std::string& path) const
{
  const HDF5Lock lock;
  const HDF5Handle dataset = OpenDataset(this->Id(), path);
  if (!dataset.Valid())
  {
    return std::nullopt;
  }
  const HDF5Handle type(H5Dget_type(dataset.Get()));
  const HDF5Handle space(H5Dget_space(dataset.Get()));
  if (H5Tget_class(type.Get()) != H5T_STRING || H5Sget_simple_extent_npoints(space.Get()) != 1)
  {
    return std::nullopt;
  }
  const auto texts = ReadStrings(type.Get(), space.Get(), 1,
    [&](hid_t memory, void* to)
    { return H5Dread(dataset.Get(), memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, to) >= 0; });
  return texts ? std::optional<std::string>(texts->front()) : std::nullopt;
}

std::vector<std::string> HDF5File::Children(const std::string& path, std::size_t limit) const
{
  struct State
  {
    std::vector<std::string> Names;
    std::size_t Limit = 0;
    std::exception_ptr Error;
  } state;
  state.Limit = limit;
  const HDF5Lock lock;
  if (limit == 0 || !HasObject(this->Id(), path))
  {
    return {};
  }
  const HDF5Handle group(H5Gopen2(this->Id(), path.c_str(), H5P_DEFAULT));
  if (!group.Valid())
  {
    return {};
  }
  const auto take = [](hid_t, const char* name, const H5L_info_t*, void* data) -> herr_t
  {
    State& s = *static_cast<State*>(data);
    try
    {
      s.Names.emplace_back(name);
    }
    catch (...)
    {
      s.Error = std::current_exception(); // not through the library, which would stay locked
      return -1;
    }
    return s.Names.size() < s.Limit ? 0 : 1;
  };
  hsize_t next = 0;
  H5Literate(group.Get(), H5_INDEX_NAME, H5_ITER_INC, &next, take, &state);
  if (state.Error)
  {
    std::rethrow_exception(state.Error);
  }
  return state.Names;
}

bool HDF5File::HasAttribute(const std::string& path, const std::string& attribute) const
{
  const HDF5Lock lock;
  return OpenAttribute(this->Id(), path, attribute).Valid();
}

std::optional<std::vector<std::string>> HDF5File::Texts(
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
  const hssize_t n = H5Sget_simple_extent_npoints(space.Get());
  if (H5Tget_class(type.Get()) != H5T_STRING || n < 1 || static_cast<hsize_t>(n) > LargestAttribute)
  {
    return std::nullopt;
  }
  return ReadStrings(type.Get(), space.Get(), static_cast<std::size_t>(n),
    [&](hid_t memory, void* to) { return H5Aread(id.Get(), memory, to) >= 0; });
}

std::optional<std::string> HDF5File::Text(
  const std::string& path, const std::string& attribute) const
{
  const auto texts = this->Texts(path, attribute);
  if (!texts)
  {
    return std::nullopt;
  }
  std::string whole;
  for (const std::string& text : *texts)
  {
    if (texts->size() > 1 && text.size() > 1)
    {
      return std::nullopt;
    }
    whole += text;
  }
  return whole;
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
