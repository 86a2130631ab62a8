#!/usr/bin/env bash
# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
#
# Writes the text of each shader and variant and compiles it:
#
#   compile-all.sh <program WriteShaders> <folder for the texts>
#
# The exit code is 77 if there is no glslangValidator.
set -uo pipefail
writer=$1
folder=$2

if ! command -v glslangValidator >/dev/null; then
  echo "SKIPPED: glslangValidator isn't installed (Debian: glslang-tools)."
  exit 77
fi
rm -rf "$folder"
mkdir -p "$folder" || exit 1
"$writer" "$folder" || exit 1

# The check itself has to be able to fail.
printf '#version 430 core\nvoid main() { undeclared = 1; }\n' >"$folder/Broken.frag"
if glslangValidator "$folder/Broken.frag" >/dev/null; then
  echo "glslangValidator accepts a broken shader."
  exit 1
fi
rm "$folder/Broken.frag"

count=$(find "$folder" -type f | wc -l)
if [ "$count" -lt 20 ]; then
  echo "Only $count shaders were written."
  exit 1
fi
log="$folder/errors.txt"
if ! find "$folder" -type f \( -name '*.frag' -o -name '*.vert' -o -name '*.comp' \) -print0 |
  sort -z | xargs -0 -n 32 -P "$(nproc)" glslangValidator >"$log" 2>&1; then
  grep -B3 -A6 -E 'ERROR|error' "$log" | head -100
  exit 1
fi
echo "$count shaders compile"
