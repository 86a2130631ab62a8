# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
# Installs the build folder BUILD into PREFIX, then builds EXAMPLE against what was installed and
# runs the installed program.
function (run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if (NOT result EQUAL 0)
    message(FATAL_ERROR "${ARGN} failed:\n${output}")
  endif ()
endfunction ()

file(REMOVE_RECURSE "${PREFIX}" "${EXAMPLE_BUILD}")
run("${CMAKE_COMMAND}" --install "${BUILD}" --prefix "${PREFIX}")
run("${CMAKE_COMMAND}" -S "${EXAMPLE}" -B "${EXAMPLE_BUILD}" -G "${GENERATOR}"
  "-DCMAKE_PREFIX_PATH=${PREFIX}" -DCMAKE_BUILD_TYPE=Release)
run("${CMAKE_COMMAND}" --build "${EXAMPLE_BUILD}")
run("${PREFIX}/bin/teravox" --version)
