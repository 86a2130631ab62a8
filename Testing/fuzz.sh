#!/usr/bin/env bash
# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
#
# Mutated files of every format, chunks and XML under clang's address and undefined-behaviour
# sanitizers.
#
#   fuzz.sh [number of new inputs per target, default 100000] [target...]
#
# Builds in build/fuzz (TERAVOX_BUILD_DIR changes build/). What it finds lies in build/fuzz/found. The
# exit code is 0 if nothing was found but crashes and hangs of the HDF5 library itself, which are counted.
set -euo pipefail
root=$(cd "$(dirname "$0")/.." && pwd)
build=${TERAVOX_BUILD_DIR:-$root/build}/fuzz
runs=${1:-100000}
shift || true
targets=("$@")
[ $# -gt 0 ] || targets=(FuzzXml FuzzChunk FuzzImport FuzzFile)
python=${PYTHON:-/usr/bin/python3}

clang=$(command -v clang++-14 || command -v clang++) || {
  echo "fuzz.sh: clang++ is needed (Debian: clang-14)." >&2
  exit 2
}
mkdir -p "$build" "$build/found"
cmake -S "$root" -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=RelWithDebInfo \
  -DCMAKE_CXX_COMPILER="$clang" -DCMAKE_C_COMPILER="${clang/++/}" \
  -DCMAKE_CXX_FLAGS_RELWITHDEBINFO="-O1 -g -fsanitize=fuzzer-no-link" \
  -DPython3_EXECUTABLE="$python" -DTERAVOX_BUILD_VTK=OFF -DTERAVOX_BUILD_TESTING=OFF \
  -DTERAVOX_BUILD_FUZZ=ON -DTERAVOX_SANITIZE=address,undefined -DTERAVOX_WARNINGS_AS_ERRORS=OFF \
  >"$build.configure.log" 2>&1 || { tail -30 "$build.configure.log"; exit 1; }
cmake --build "$build" -j "$(nproc)" --target "${targets[@]}" -- --quiet

seeds=$build/seeds
"$python" -B "$root/Testing/Fuzz/make_seeds.py" "$seeds"

export ASAN_OPTIONS=detect_leaks=1:allocator_may_return_null=1:detect_odr_violation=0
export UBSAN_OPTIONS=halt_on_error=1:print_stacktrace=1
known_per_start=150
failed=0
for target in "${targets[@]}"; do
  corpus=$build/corpus/$target
  mkdir -p "$corpus"
  binary=$(find "$build" -name "$target" -type f | head -1)
  left=$runs
  excused=0
  seed=1
  start=$SECONDS
  while [ "$left" -gt 0 ]; do
    log=$build/$target.log
    result=0
    # Others at each start: all of them take longer to run than what is new until the HDF5 library
    # crashes.
    rm -rf "$build/start" "$build/new"
    mkdir "$build/start" "$build/new"
    find "$corpus" "$seeds/$target" -type f | LC_ALL=C sort | shuf -n "$known_per_start" --random-source=<(yes "$seed" 2>/dev/null) |
      xargs -d '\n' cp -t "$build/start"
    "$binary" -runs="$((left + known_per_start))" -seed="$seed" \
      -timeout=20 -rss_limit_mb=2048 -malloc_limit_mb=1024 -max_len=300000 -print_final_stats=1 \
      -artifact_prefix="$build/found/$target-" "$build/new" "$build/start" >"$log" 2>&1 || result=$?
    find "$build/new" -type f -exec mv -t "$corpus" {} +
    done_now=$(sed -n 's/^stat::number_of_executed_units: *//p' "$log" | tail -1)
    [ -n "$done_now" ] || done_now=$(grep -oE '^#[0-9]+' "$log" | tail -1 | tr -d '#')
    # What is known from before is run again by each start, and isn't counted.
    known=$(sed -n 's/^#\([0-9]*\)[[:space:]]*INITED.*/\1/p' "$log" | tail -1)
    new=$((${done_now:-0} - ${known:-${done_now:-0}}))
    left=$((left - (new > 0 ? new : 1)))
    seed=$((seed + 1))
    [ "$result" -ne 0 ] || break
    # The innermost frame outside of the C library and of the sanitizers tells whose fault it is; of a
    # leak, who asked for the memory.
    frame=$(grep -E '^ *#[0-9]+ ' "$log" | grep -vE 'libc\.so|in fuzzer::|__asan|__interceptor|__sanitizer|in _*(mem|str|malloc|calloc|realloc|free)|\(BuildId.*libasan' |
      head -1 || true)
    # Time-outs are of the wall clock: on a busy machine an input may only have waited for its turn.
    # Of a pyramid of 25 levels each reads thousands of entries of the index: slow here, no hang.
    slow=$(sed -n 's/.*Test unit written to \(.*-timeout-.*\)/\1/p' "$log" | tail -1)
    if [ -n "$slow" ] && (ulimit -t 60; "$binary" -timeout=300 "$slow") >>"$log" 2>&1; then
      echo "== $target: $slow took no 60 s of a processor when it ran again"
    elif echo "$frame" | grep -q libhdf5; then
      excused=$((excused + 1))
      # Else each run to come would begin, and end, with what had been new about it.
      unit=$(sed -n 's/.*Test unit written to .*-\([0-9a-f]*\)$/\1/p' "$log" | tail -1)
      rm -f "$corpus/${unit:-none}"
    else
      echo "== $target: FOUND after $((runs - left)) inputs; see $log and $build/found"
      tail -40 "$log"
      cp "$log" "$build/found/$target.log"
      failed=1
      break
    fi
  done
  echo "== $target: $((runs - (left > 0 ? left : 0))) inputs in $((SECONDS - start)) s, $excused crashes or hangs of the HDF5 library"
done
exit "$failed"
