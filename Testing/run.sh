#!/usr/bin/env bash
# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
#
# Installs what is missing, builds, and runs all tests:
#
#   run.sh            packages, checks of the sources, the ParaView plugin, sanitizer builds of the
#                     tests without OpenGL, all tests
#   run.sh --quick    all tests only
#
# Build folders lie in build/ (TERAVOX_BUILD_DIR changes that). Ends with CTest's summary of all
# tests; the exit code is 0 only if every stage passed.
set -euo pipefail

root=$(cd "$(dirname "$0")/.." && pwd)
build=${TERAVOX_BUILD_DIR:-$root/build}
jobs=$(nproc)
quick=no
case "${1:-}" in
  "") ;;
  --quick) quick=yes ;;
  *)
    echo "run.sh: unknown option '$1'; there is only --quick." >&2
    exit 2
    ;;
esac

failed=()
stage() { # stage <name> <command>...: runs on after a failure, and remembers it
  local name=$1 start=$SECONDS
  shift
  echo "== $name"
  if "$@"; then
    echo "== $name: passed in $((SECONDS - start)) s"
  else
    echo "== $name: FAILED after $((SECONDS - start)) s"
    failed+=("$name")
  fi
}

configure() { # configure <folder> <options>...
  local folder=$1
  shift
  cmake -S "$root" -B "$folder" -G Ninja -DPython3_EXECUTABLE=/usr/bin/python3 "$@" \
    >"$folder.configure.log" 2>&1 || { tail -40 "$folder.configure.log"; return 1; }
}

# Without address-space randomisation where that is allowed: ThreadSanitizer of GCC 12 gives up on
# kernels with more random bits than it knows.
fixed_addresses() {
  if setarch "$(uname -m)" -R true 2>/dev/null; then
    setarch "$(uname -m)" -R "$@"
  else
    "$@"
  fi
}

run_tests() { # run_tests <ctest command>...: lines of tests that start and pass are left out
  "$@" -j "$jobs" --output-on-failure --no-tests=error --timeout 900 |
    { grep -v -e ' Passed ' -e '^ *Start ' || true; }
}

# sanitized_tests <sanitizers> <folder> <AVX2> <labels> <tests to leave out> <targets>...
sanitized_tests() {
  local sanitizers=$1 folder=$2 avx2=$3 labels=$4 without=$5
  shift 5
  configure "$folder" -DTERAVOX_AVX2="$avx2" -DCMAKE_BUILD_TYPE=RelWithDebInfo -DCMAKE_CXX_FLAGS_RELWITHDEBINFO="-O1 -g1" \
    -DTERAVOX_BUILD_VTK=OFF -DTERAVOX_SANITIZE="$sanitizers" -DTERAVOX_WARNINGS_AS_ERRORS=OFF &&
    cmake --build "$folder" -j "$jobs" --target "$@" -- --quiet &&
    (cd "$folder" && run_tests fixed_addresses ctest -L "$labels" -E "$without")
}

mkdir -p "$build"
bash "$root/Examples/install-dependencies.sh" test

release_build() {
  configure "$build/release" -DCMAKE_BUILD_TYPE=Release &&
    cmake --build "$build/release" -j "$jobs" -- --quiet
}
stage "Release build" release_build
if [ "${#failed[@]}" -gt 0 ]; then
  exit 1
fi

if [ "$quick" = no ]; then
  stage "Packages" xvfb-run -a -s "-screen 0 1280x1024x24 -noreset" \
    bash "$root/Testing/packages.sh" "$build/release"
  # clang-tidy on all sources takes longer than everything else together: here on Core only, the rest
  # by hand (Testing/lint.sh build/release).
  TERAVOX_TIDY='^Module/Core/' stage "Checks of the sources" \
    bash "$root/Testing/lint.sh" "$build/release"
  export ASAN_OPTIONS=detect_leaks=1:strict_string_checks=1
  export UBSAN_OPTIONS=halt_on_error=1:print_stacktrace=1
  # A race stops the test; OpenMP's own runtime isn't instrumented, hence one thread for it.
  export TSAN_OPTIONS=halt_on_error=1:second_deadlock_stack=1
  stage "ParaView plugin" env TERAVOX_JOBS="$jobs" bash "$root/Testing/plugin.sh" "$build/paraview"
  # Some tests take fewer steps in these builds: Testing/Support/Effort.h.
  stage "Address and undefined-behaviour sanitizers" \
    sanitized_tests address,undefined "$build/asan" ON "^(core|fuzz|native|source|truth)$" '^$' \
    FuzzChunk FuzzFile FuzzImport FuzzXml TestCore TestFormats TestNative TestPyramids TestSource TestTruth \
    WritePyramidSamples
  # Kernels for AVX2 share data between threads just as the others do, and take minutes to compile.
  # What is left out has one thread.
  single='AtlasPlan|BlockSplit|BrickKey|BrickTexels|Components|Downsampling|Formula|PageTable|PageTableWalk'
  single="$single|PyramidLayout|RequestQueue|Residency|TexelFormat|TransferPlane|TransferTable|Types|MixedRays"
  # Of the kernels, which OpenMP runs, all but the one that the standard library's threads run.
  single="$single|NativeEdges|NativeGradient|NativeLabels|NativeMask|NativePlane|NativeRandom"
  OMP_NUM_THREADS=1 stage "Thread sanitizer" \
    sanitized_tests thread "$build/tsan" OFF "^(core|native|source)$" \
    "^(Layouts/)?($single)\.|^NativeSameBits\.([^T]|T[^h])" \
    TestCore TestNative TestPyramids TestSource WritePyramidSamples
fi

all_tests() {
  cd "$build/release" &&
    run_tests xvfb-run -a -s "-screen 0 1280x1024x24 -noreset" ctest -LE bench
}
stage "All tests" all_tests

if [ "${#failed[@]}" -gt 0 ]; then
  printf '== FAILED: %s\n' "${failed[@]}"
  exit 1
fi
