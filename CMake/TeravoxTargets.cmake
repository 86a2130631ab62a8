# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause

# teravox_own_target(<target>): the flags of all targets that we write ourselves.
function (teravox_own_target target)
  target_compile_options(${target} PRIVATE
    -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wno-sign-conversion)
  # GCC 12 leaves the rounding out of two neighbouring double(float(v)) when it vectorises
  # straight-line code (-O2 and above): ranges and pairs of floats would be wrong in silence.
  if (CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    target_compile_options(${target} PUBLIC
      $<BUILD_INTERFACE:$<$<COMPILE_LANGUAGE:C,CXX>:-fno-tree-slp-vectorize>>)
  endif ()
  if (TERAVOX_WARNINGS_AS_ERRORS)
    target_compile_options(${target} PRIVATE -Werror)
  endif ()
  if (TERAVOX_SANITIZE)
    target_compile_options(${target} PUBLIC -fsanitize=${TERAVOX_SANITIZE} -fno-omit-frame-pointer)
    target_link_options(${target} PUBLIC -fsanitize=${TERAVOX_SANITIZE})
  endif ()
endfunction ()

# What nearly all tests include takes longer to read than most of them to compile. Compiler caches know
# such headers badly. Without it (TERAVOX_PRECOMPILE_TEST_HEADERS=OFF) each source must include all it uses.
if (CCACHE_PROGRAM)
  set(precompile_default OFF)
else ()
  set(precompile_default ON)
endif ()
option(TERAVOX_PRECOMPILE_TEST_HEADERS "Precompile headers of tests; by default where there is no ccache"
  ${precompile_default})

# teravox_add_gtest(<name> LABEL <label> [FILTER <tests>] [LIBS ...] SOURCES ...): one GoogleTest
# program, each test of it (that the filter names) a CTest test.
function (teravox_add_gtest name)
  cmake_parse_arguments(arg "" "LABEL;TIMEOUT;FILTER" "SOURCES;LIBS" ${ARGN})
  if (NOT arg_TIMEOUT)
    set(arg_TIMEOUT 300)
  endif ()
  set(filter)
  if (arg_FILTER)
    set(filter TEST_FILTER "${arg_FILTER}")
  endif ()
  add_executable(${name} ${arg_SOURCES})
  teravox_own_target(${name})
  # Tests compile quickly rather than run fast: what they call is compiled as ever.
  target_compile_options(${name} PRIVATE $<$<CONFIG:Release>:-O1>)
  if (TERAVOX_PRECOMPILE_TEST_HEADERS)
    target_precompile_headers(${name} PRIVATE <gtest/gtest.h>
      <algorithm> <array> <atomic> <cmath> <cstdint> <filesystem> <fstream> <functional> <map> <memory>
      <mutex> <random> <sstream> <string> <thread> <unordered_map> <unordered_set> <vector>)
  endif ()
  target_link_libraries(${name} PRIVATE ${arg_LIBS} GTest::gtest GTest::gtest_main)
  gtest_discover_tests(${name}
    DISCOVERY_MODE PRE_TEST
    DISCOVERY_TIMEOUT 120
    ${filter}
    PROPERTIES LABELS "${arg_LABEL}" TIMEOUT ${arg_TIMEOUT} SKIP_REGULAR_EXPRESSION "\\[  SKIPPED \\]")
endfunction ()
