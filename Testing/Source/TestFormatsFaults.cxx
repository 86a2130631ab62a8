// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "AllocationFaults.h"
#include "Effort.h"
#include "TestFormatsSupport.h"

#include <algorithm>

namespace teravox::testing
{
namespace
{

struct Opened
{
  bool Met = false; ///< the allocation that fails
  Status Result;
};

Opened OpenWithoutMemory(const std::string& file, std::int64_t allocation)
{
  const HDF5OpenOptions options = FormatOptions();
  test::FailAllocationAfter(allocation);
  const auto source = HDF5BrickSource::Open(file, options);
  return { test::EndAllocationFault(), source.GetStatus() };
}

/// Some of the allocations of opening a file fail, one at a time: an error that says so, and the
/// next attempt is as any other.
void FailAllocations(const std::string& file)
{
  SCOPED_TRACE(file);
  std::int64_t count = 1; // allocations, at least
  while (OpenWithoutMemory(file, count).Met)
  {
    count *= 2;
  }
  const std::int64_t step = std::max<std::int64_t>(1, count / test::Effort(200, 40));
  std::int64_t failures = 0;
  for (std::int64_t n = 0; n < count; n += step)
  {
    const Opened opened = OpenWithoutMemory(file, n);
    ASSERT_TRUE(opened.Met || opened.Result.Ok()) << opened.Result.Message();
    ASSERT_TRUE(opened.Result.Ok() || opened.Result.Code() == StatusCode::ResourceExhausted)
      << "allocation " << n << ": " << opened.Result.Message();
    failures += opened.Result.Ok() ? 0 : 1;
  }
  EXPECT_GT(failures, 10);
  EXPECT_TRUE(OpenFormat(file));
}

TEST(FormatsFaults, AllocationsOfOpeningMayFail)
{
  TERAVOX_FORMAT_FILES(ngff, "ngff");
  FailAllocations(ngff->File("five.h5"));
  TERAVOX_FORMAT_FILES(n5, "n5");
  FailAllocations(n5->File("json.h5"));
  FailAllocations(n5->File("paintera.h5"));
  TERAVOX_FORMAT_FILES(imaris, "imaris");
  FailAllocations(imaris->File("small.ims"));
  TERAVOX_FORMAT_FILES(viewer, "bigdataviewer");
  FailAllocations(viewer->File("legacy.xml"));
  TERAVOX_FORMAT_FILES(amr, "amr");
  FailAllocations(amr->File("boxes.vtkhdf"));
  TERAVOX_FORMAT_FILES(vtkhdf, "vtkhdf");
  FailAllocations(vtkhdf->File("moving.vtkhdf"));
  TERAVOX_FORMAT_FILES(single, "single");
  for (const char* name : { "emd.emd", "nexus.nxs", "ilastik.h5", "exchange.h5" })
  {
    FailAllocations(single->File(name));
  }
}

} // namespace
} // namespace teravox::testing
