#!/usr/bin/env bash
# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
#
# From nothing to pictures: installs what is missing, builds in Release, converts a brain MRI into a
# pyramid and draws it, then draws 1.29e12 voxels of it and a formula of 2^30 voxels per axis.
#
#   demo.sh [folder for the pictures]      default: build/demo
#
# TERAVOX_BUILD_DIR changes the build folder (default build/release). TERAVOX_PROGRAM is a program that
# is there already: nothing is installed or built then.
set -euo pipefail

root=$(cd "$(dirname "$0")/.." && pwd)
build=${TERAVOX_BUILD_DIR:-$root/build/release}
out=${1:-$root/build/demo}
mkdir -p "$out"
[ -n "${TERAVOX_PROGRAM:-}" ] || mkdir -p "$build"
out=$(cd "$out" && pwd)

teravox=${TERAVOX_PROGRAM:-}
if [ -z "$teravox" ]; then
  bash "$root/Examples/install-dependencies.sh" demo

  echo "== Building"
  cmake -S "$root" -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=Release \
    -DPython3_EXECUTABLE=/usr/bin/python3 \
    -DTERAVOX_BUILD_TESTING="$([ -e "$build/CTestTestfile.cmake" ] && echo ON || echo OFF)" \
    >"$out/configure.log" 2>&1 || { tail -40 "$out/configure.log"; exit 1; }
  cmake --build "$build" -j "$(nproc)" --target teravox -- --quiet
  teravox=$build/bin/teravox
fi

# Draws without a screen where there is none.
draw() {
  if [ -n "${DISPLAY:-}" ]; then
    "$teravox" render "$@"
  else
    xvfb-run -a -s "-screen 0 1280x1024x24 -noreset" "$teravox" render "$@"
  fi
}

volume=/usr/share/mricron/templates/ch2better.nii.gz
echo "== A brain: converted to a pyramid, and drawn"
if [ -r "$volume" ]; then
  "$teravox" convert "$volume" "$out/brain.h5"
else
  echo "mricron-data isn't installed: a generated volume takes the place of the brain."
  "$teravox" convert formula:marschner-lobb "$out/brain.h5" --dimensions 301 370 316
fi
"$teravox" info "$out/brain.h5"
draw "$out/brain.h5" "$out/brain.png" --stats "$out/brain.json"

echo
echo "== 32 x 32 x 32 brains: 10240 x 12288 x 10240 voxels with 256 MiB on the GPU, 512 MiB here"
repeated=("$out/brain.h5" --repeat 32 32 32 --pitch 320 384 320
  --gpu-memory 256M --host-memory 512M)
draw "${repeated[@]}" "$out/brains-outside.png" --stats "$out/brains-outside.json"
draw "${repeated[@]}" "$out/brains-inside.png" --stats "$out/brains-inside.json" \
  --camera 0.5 0.4844 0.5156 0.53 0.75 0.53 0 0 1 --view-angle 60

echo
echo "== A sponge of 2^30 voxels per axis: no file at all"
sponge=(formula:sponge --dimensions 1073741824 1073741824 1073741824
  --gpu-memory 256M --host-memory 512M)
draw "${sponge[@]}" "$out/sponge-far.png" --stats "$out/sponge-far.json"
draw "${sponge[@]}" "$out/sponge-near.png" --stats "$out/sponge-near.json" \
  --camera 0.5003 -0.0009 0.5004 0.5001 0.0 0.5001 0 0 1 --view-angle 60

echo
echo "The pictures are in $out"
