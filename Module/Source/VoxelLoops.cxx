// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "VoxelLoops.h"

namespace teravox
{

namespace loops_baseline
{
template <typename T>
struct Loops
{
  static const VoxelLoops<T>& Get();
};
}
#if TERAVOX_HAS_AVX2_LOOPS
namespace loops_avx2
{
template <typename T>
struct Loops
{
  static const VoxelLoops<T>& Get();
};
}
#endif

template <typename T>
const VoxelLoops<T>& VoxelLoops<T>::Get()
{
#if TERAVOX_HAS_AVX2_LOOPS
  if (__builtin_cpu_supports("avx2") != 0)
  {
    return loops_avx2::Loops<T>::Get();
  }
#endif
  return loops_baseline::Loops<T>::Get();
}

template struct VoxelLoops<std::uint8_t>;
template struct VoxelLoops<std::int8_t>;
template struct VoxelLoops<std::uint16_t>;
template struct VoxelLoops<std::int16_t>;
template struct VoxelLoops<std::uint32_t>;
template struct VoxelLoops<std::int32_t>;
template struct VoxelLoops<float>;
template struct VoxelLoops<double>;

} // namespace teravox
