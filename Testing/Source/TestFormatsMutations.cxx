// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "Effort.h"
#include "TestFormatsSupport.h"

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <dlfcn.h>
#include <execinfo.h>
#include <hdf5.h>
#include <sys/resource.h>
#include <sys/wait.h>

#ifdef __SANITIZE_ADDRESS__
#include <sanitizer/common_interface_defs.h>
#endif

namespace teravox::testing
{
namespace
{

enum class End
{
  Good,
  Wrong,           // a brick of the wrong size, or an exception
  Crashed,         // a signal, the alarm's included
  CrashedInLibrary // an access to memory that the library itself made, or libc for it
};

constexpr int ExitOfLibrary = 77;

/// Of an access to memory that isn't there, or of what a sanitizer found: tells whose it was by the
/// innermost frame beyond libc and sanitizers.
void TellWhoseItWas(int)
{
  void* frames[40];
  const int count = ::backtrace(frames, 40);
  for (int i = 1; i < count; ++i) // 0 is this function
  {
    Dl_info info{};
    const std::string object = ::dladdr(frames[i], &info) != 0 ? info.dli_fname : "";
    if (object.find("libc.") == std::string::npos && object.find("libasan") == std::string::npos &&
      object.find("libubsan") == std::string::npos)
    {
      ::_exit(object.find("libhdf5") != std::string::npos ? ExitOfLibrary : 2);
    }
  }
  ::_exit(2);
}

/// Whatever ends the process by a violation tells whose it was.
void WatchForViolations()
{
  void* first[1];
  ::backtrace(first, 1); // loads what it needs
  std::signal(SIGSEGV, &TellWhoseItWas);
  std::signal(SIGBUS, &TellWhoseItWas);
#ifdef __SANITIZE_ADDRESS__
  __sanitizer_set_death_callback([] { TellWhoseItWas(0); });
#endif
}

/// At most 4 GiB of addresses, of which sanitizers need far more for their own.
void LimitAddresses()
{
#ifndef __SANITIZE_ADDRESS__
  rlimit limit{};
  ::getrlimit(RLIMIT_AS, &limit);
  limit.rlim_cur = rlim_t{ 4 } << 30;
  ::setrlimit(RLIMIT_AS, &limit);
#endif
}

/// Runs `work` in a process of its own, within these addresses and ten seconds.
template <typename Work>
End InChild(const Work& work)
{
  const pid_t child = ::fork();
  if (child == 0)
  {
    LimitAddresses();
    const rlimit none{ 0, 0 };
    ::setrlimit(RLIMIT_CORE, &none);
    ::alarm(10);
    WatchForViolations();
    bool good = false;
    try
    {
      good = work();
    }
    catch (...)
    {
      good = false;
    }
    ::_exit(good ? 0 : 1);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  const int code = WIFEXITED(status) ? WEXITSTATUS(status) : 2;
  return code == 0          ? End::Good
    : code == 1             ? End::Wrong
    : code == ExitOfLibrary ? End::CrashedInLibrary
                            : End::Crashed;
}

/// Opens the file and reads a brick and a range of each level; errors are as good as success.
bool OpenAndRead(const std::string& file)
{
  HDF5OpenOptions options;
  options.BrickSize = 16;
  options.MemoryBudget = 64 << 20;
  const auto source = HDF5BrickSource::Open(file, options);
  if (!source.Ok())
  {
    return !source.GetStatus().Message().empty();
  }
  const VolumeInfo& info = source.Value()->Info();
  const auto edge = static_cast<std::size_t>(info.Layout.StoredSize());
  for (int level = 0; level < info.Layout.NumberOfLevels(); ++level)
  {
    const BrickKey key = BrickKey::Of(level, { 0, 0, 0 });
    const auto brick = source.Value()->ReadBrick(key);
    const auto ranges = source.Value()->ReadRanges(key, { 1, 1, 1 });
    if ((brick.Ok() &&
          brick.Value()->Voxels.size() !=
            edge * edge * edge * SizeOf(info.Type) * static_cast<std::size_t>(info.Components)) ||
      (ranges.Ok() && ranges.Value().size() != 1))
    {
      return false;
    }
  }
  return true;
}

/// Absolute names of all objects of a good file.
std::vector<std::string> NamesOf(const std::string& file)
{
  std::vector<std::string> names;
  const hid_t id = H5Fopen(file.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  const auto take = [](hid_t, const char* name, const H5O_info_t*, void* data) -> herr_t
  {
    static_cast<std::vector<std::string>*>(data)->emplace_back(name);
    return 0;
  };
  H5Ovisit2(id, H5_INDEX_NAME, H5_ITER_INC, take, &names, H5O_INFO_BASIC);
  H5Fclose(id);
  return names;
}

/// What any program would do with the library alone: visit all objects that the good file has, look
/// at all attributes, read the start of all datasets.
bool VisitWithTheLibraryAlone(const std::string& file, const std::string& goodFile)
{
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  const std::vector<std::string> names = NamesOf(goodFile);
  const hid_t id = H5Fopen(file.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  if (id < 0)
  {
    return true;
  }
  const auto attribute = [](hid_t object, const char* name, const H5A_info_t*, void*) -> herr_t
  {
    const hid_t a = H5Aopen(object, name, H5P_DEFAULT);
    if (a < 0)
    {
      return 0;
    }
    const hid_t type = H5Aget_type(a);
    const hid_t space = H5Aget_space(a);
    const hssize_t n = H5Sget_simple_extent_npoints(space);
    const std::size_t size = H5Tget_size(type);
    if (n > 0 && n < 65536 && size < 65536)
    {
      std::vector<char> values(static_cast<std::size_t>(n) * size);
      H5Aread(a, type, values.data());
    }
    H5Sclose(space);
    H5Tclose(type);
    H5Aclose(a);
    return 0;
  };
  static herr_t (*visitAttribute)(hid_t, const char*, const H5A_info_t*, void*) = attribute;
  const auto object = [](hid_t root, const char* name, const H5O_info_t*, void*) -> herr_t
  {
    for (const char* wanted : { "default", "signal", "axes", "NX_class", "units" })
    {
      H5Aexists_by_name(root, name, wanted, H5P_DEFAULT);
    }
    const hid_t o = H5Oopen(root, name, H5P_DEFAULT);
    if (o < 0)
    {
      return 0;
    }
    H5Aiterate2(o, H5_INDEX_NAME, H5_ITER_INC, nullptr, visitAttribute, nullptr);
    if (H5Iget_type(o) == H5I_DATASET)
    {
      const hid_t space = H5Dget_space(o);
      hsize_t dims[H5S_MAX_RANK] = {};
      const int rank = H5Sget_simple_extent_dims(space, dims, nullptr);
      const hid_t plist = H5Dget_create_plist(o);
      hsize_t stored = 0;
      const hsize_t zero[H5S_MAX_RANK] = {};
      if (rank > 0 && H5Pget_layout(plist) == H5D_CHUNKED && H5Pget_nfilters(plist) > 0)
      {
        H5Dget_chunk_storage_size(o, zero, &stored);
        if (stored > 0 && stored < (1 << 24))
        {
          std::vector<char> raw(stored);
          std::uint32_t mask = 0;
          H5Dread_chunk(o, H5P_DEFAULT, zero, &mask, raw.data());
        }
      }
      if (rank > 0)
      {
        hsize_t one[H5S_MAX_RANK];
        std::fill_n(one, H5S_MAX_RANK, 1);
        H5Sselect_hyperslab(space, H5S_SELECT_SET, zero, nullptr, one, nullptr);
        const hid_t memory = H5Screate_simple(rank, one, nullptr);
        double value[64];
        H5Dread(o, H5T_NATIVE_DOUBLE, memory, space, H5P_DEFAULT, value);
        H5Sclose(memory);
      }
      H5Pclose(plist);
      H5Sclose(space);
    }
    H5Oclose(o);
    return 0;
  };
  for (const std::string& name : names)
  {
    object(id, name.c_str(), nullptr, nullptr);
  }
  H5Fclose(id);
  return true;
}

/// Flipped bytes and cut ends of one file. Crashes must be those of the library alone.
void Mutate(const std::string& file, unsigned seed, int trials)
{
  std::ifstream in(file, std::ios::binary);
  const std::string whole((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  ASSERT_GT(whole.size(), 100u) << file;
  ASSERT_EQ(InChild([&] { return OpenAndRead(file); }), End::Good);
  const TemporaryFolder folder;
  const std::string extension = file.substr(file.rfind('.'));
  const std::string name = folder.File("mutated" + extension);
  std::mt19937 random(seed);
  int excused = 0;
  trials = test::Effort(trials, trials / 4);
  for (int trial = 0; trial < trials; ++trial)
  {
    std::string bytes = whole;
    const int kind = trial % 4;
    // Metadata are mostly text, small numbers and addresses: one byte, a few, or a run of ones.
    const int flips = kind == 0 ? 1 : kind == 1 ? 8 : 40;
    for (int i = 0; i < flips; ++i)
    {
      const std::size_t at = random() % bytes.size();
      bytes[at] = static_cast<char>(kind == 2 ? 0xff : random() % 256);
    }
    if (kind == 3)
    {
      bytes.resize(random() % bytes.size());
    }
    std::ofstream(name, std::ios::binary) << bytes;
    const End end = InChild([&] { return OpenAndRead(name); });
    EXPECT_NE(end, End::Wrong) << file << ", seed " << seed << ", trial " << trial;
    excused += end == End::CrashedInLibrary ? 1 : 0;
    if (end == End::Crashed)
    {
      const End alone = InChild([&] { return VisitWithTheLibraryAlone(name, file); });
      excused += alone >= End::Crashed ? 1 : 0;
      EXPECT_GE(alone, End::Crashed)
        << file << ", seed " << seed << ", trial " << trial << " crashes here only";
    }
  }
  // Else nothing but the library was tested.
  EXPECT_LT(excused, trials / 4);
  ::testing::Test::RecordProperty("crashes_of_the_library", excused);
}

/// Of chunks without filters nothing but the index says how long they are in the file. Found by
/// fuzzing: H5Dread_chunk() takes that for the size of its caller's buffer.
TEST(FormatsMutations, AChunkThatSaysItIsLongerThanItIs)
{
  const TemporaryFolder folder;
  const std::string name = folder.File("long.h5");
  constexpr hsize_t edge = 16;
  std::vector<std::byte> voxels(edge * edge * edge);
  for (std::size_t i = 0; i < voxels.size(); ++i)
  {
    voxels[i] = static_cast<std::byte>(i * 7 % 251);
  }
  {
    const hsize_t size[3] = { edge, edge, edge };
    const hsize_t chunk[3] = { edge / 2, edge / 2, edge / 2 };
    const hid_t file = H5Fcreate(name.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
    const hid_t space = H5Screate_simple(3, size, nullptr);
    const hid_t creation = H5Pcreate(H5P_DATASET_CREATE);
    H5Pset_chunk(creation, 3, chunk);
    const hid_t set =
      H5Dcreate2(file, "v", H5T_NATIVE_UINT8, space, H5P_DEFAULT, creation, H5P_DEFAULT);
    ASSERT_GE(H5Dwrite(set, H5T_NATIVE_UINT8, H5S_ALL, H5S_ALL, H5P_DEFAULT, voxels.data()), 0);
    H5Dclose(set);
    H5Pclose(creation);
    H5Sclose(space);
    H5Fclose(file);
  }
  std::ifstream in(name, std::ios::binary);
  std::string bytes((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  in.close();
  // A node of a B-tree of chunks: signature, type 1, level, number of entries, two siblings; then
  // key after key, which begin with the chunk's size, each followed by an address.
  const std::size_t node = bytes.find(std::string("TREE\x01", 5));
  ASSERT_NE(node, std::string::npos);
  constexpr std::size_t header = 24;
  constexpr std::size_t entry = 4 + 4 + 4 * 8 + 8;
  for (std::size_t chunk = 0; chunk < 8; ++chunk)
  {
    std::uint32_t size = 0;
    std::memcpy(&size, &bytes[node + header + chunk * entry], sizeof size);
    ASSERT_EQ(size, edge * edge * edge / 8);
    size = 1 << 24;
    std::memcpy(&bytes[node + header + chunk * entry], &size, sizeof size);
  }
  bytes.resize(bytes.size() + (1 << 24), '\x5a');
  std::ofstream(name, std::ios::binary) << bytes;
  EXPECT_EQ(InChild(
              [&]
              {
                const auto source = OpenFormat(name, FormatOptions(0, 0, "v"));
                if (source)
                {
                  ExpectLevelIs(*source, 0, { edge, edge, edge }, voxels, 1);
                }
                return source && !::testing::Test::HasFailure();
              }),
    End::Good);
}

TEST(FormatsMutations, ImarisAndBigDataViewer)
{
  TERAVOX_FORMAT_FILES(imaris, "imaris");
  Mutate(imaris->File("minimal.ims"), 1, 80);
  TERAVOX_FORMAT_FILES(viewer, "bigdataviewer");
  Mutate(viewer->File("signed.h5"), 2, 80);
  Mutate(viewer->File("legacy.xml"), 3, 80);
}

TEST(FormatsMutations, N5AndVTKHDF)
{
  TERAVOX_FORMAT_FILES(n5, "n5");
  Mutate(n5->File("json.h5"), 4, 80);
  Mutate(n5->File("views.h5"), 5, 40);
  TERAVOX_FORMAT_FILES(ngff, "ngff");
  Mutate(ngff->File("five.h5"), 20, 60);
  TERAVOX_FORMAT_FILES(amr, "amr");
  Mutate(amr->File("packed.vtkhdf"), 13, 80);
  TERAVOX_FORMAT_FILES(vtkhdf, "vtkhdf");
  Mutate(vtkhdf->File("moving.vtkhdf"), 6, 80);
}

TEST(FormatsMutations, Filters)
{
  TERAVOX_FORMAT_FILES(filters, "filters");
  unsigned seed = 10;
  for (const char* name : { "szip_nn_u2", "lzf_f4", "blosc_u2", "zstd_u2", "bits_lz4_u2" })
  {
    Mutate(filters->File(std::string(name) + ".h5"), seed++, 40);
  }
}

TEST(FormatsMutations, SingleLevels)
{
  TERAVOX_FORMAT_FILES(single, "single");
  Mutate(single->File("emd.emd"), 7, 80);
  Mutate(single->File("nexus.nxs"), 8, 80);
  Mutate(single->File("ilastik.h5"), 9, 80);
}

} // namespace
} // namespace teravox::testing
