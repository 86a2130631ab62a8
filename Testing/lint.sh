#!/usr/bin/env bash
# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
#
# Checks of the sources that need no test program:
#
#   lint.sh [build folder]    with a configured build folder, clang-tidy runs as well, on all
#                             sources or on those whose path matches TERAVOX_TIDY
#
# Prints each finding; the exit code is 0 only if there is none.
set -uo pipefail
cd "$(dirname "$0")/.." || exit 1
build=${1:-}

failures=0
finding() {
  echo "lint: $*"
  failures=$((failures + 1))
}

if ! git rev-parse --is-inside-work-tree >/dev/null 2>&1; then
  echo "lint: not a git checkout; nothing can be listed." >&2
  exit 1
fi
mapfile -t files < <(git ls-files --cached --others --exclude-standard)
existing=()
for file in "${files[@]}"; do
  [ -f "$file" ] && existing+=("$file")
done
mapfile -t sources < <(printf '%s\n' "${existing[@]}" | grep -E '\.(cxx|h)$')

# Format.
clang-format-14 --dry-run -Werror "${sources[@]}" || finding "clang-format 14 would change these"

# Licence lines near the top of each source, script and list file.
mapfile -t licensed < <(printf '%s\n' "${existing[@]}" |
  grep -E '(\.(cxx|h|glsl|vert|frag|comp|py|sh|cmake)|CMakeLists\.txt|^\.ci/run)$')
for file in "${licensed[@]}"; do
  head -5 "$file" | grep -q 'SPDX-FileCopyrightText: Teravox contributors' &&
    head -5 "$file" | grep -q 'SPDX-License-Identifier: BSD-3-Clause' ||
    finding "$file lacks the two SPDX lines"
done

# Nothing that exists on one machine only. (Written in pieces, lest this file find itself.)
machine_paths='(^|[^A-Za-z0-9_.])/(work|ho''me|ro''ot|Users)/[A-Za-z]|/tmp/bui''ld'
text=()
for file in "${existing[@]}"; do
  grep -Iq . "$file" && text+=("$file")
done
if grep -nE "$machine_paths" "${text[@]}"; then
  finding "paths of one machine"
fi

# Plain ASCII in code; white space.
mapfile -t code < <(printf '%s\n' "${existing[@]}" |
  grep -E '(\.(cxx|h|glsl|vert|frag|comp|py|sh|cmake)|CMakeLists\.txt)$')
if LC_ALL=C grep -nP '[^\x00-\x7F]' "${code[@]}"; then
  finding "characters outside ASCII"
fi
if ! git diff --check "$(git hash-object -t tree /dev/null)" -- . ':!*.png'; then
  finding "white-space errors"
fi

# Test data stay small: large volumes are generated.
bytes=$(find Testing/Data -type f -printf '%s\n' | awk '{ sum += $1 } END { print sum + 0 }')
if [ "$bytes" -ge $((8 * 1024 * 1024)) ]; then
  finding "Testing/Data has $bytes bytes; the limit is 8 MiB"
fi

# Shell scripts parse.
while IFS= read -r file; do
  bash -n "$file" || finding "$file doesn't parse"
done < <(printf '%s\n' "${existing[@]}" | grep -E '\.sh$|^\.ci/run$')

# clang-tidy on every file that the build compiles.
if [ -n "$build" ] && [ -f "$build/compile_commands.json" ]; then
  mapfile -t compiled < <(printf '%s\n' "${sources[@]}" |
    grep -E '\.cxx$' | grep -E "${TERAVOX_TIDY:-.}" | while IFS= read -r file; do
    grep -qF "\"$PWD/$file\"" "$build/compile_commands.json" && echo "$file"
  done)
  echo "lint: clang-tidy on ${#compiled[@]} files"
  printf '%s\n' "${compiled[@]}" |
    xargs -P "$(nproc)" -n 2 clang-tidy-14 -p "$build" --quiet \
      --extra-arg=-Wno-unknown-warning-option 2>/dev/null || finding "clang-tidy 14"
fi

if [ "$failures" -gt 0 ]; then
  echo "lint: $failures kinds of findings"
  exit 1
fi
echo "lint: clean"
