#!/usr/bin/env bash
# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
#
# Builds the plugin for ParaView and runs its tests:
#
#   plugin.sh [build folder]      default: build/paraview
#
# Debian's packages of ParaView can't be installed beside those of VTK. They are downloaded, unpacked
# into the build folder and used from there; what they depend on is installed. A second run downloads
# and installs nothing. Needs no display: it starts one.
set -euo pipefail

root=$(cd "$(dirname "$0")/.." && pwd)
build=${1:-$root/build/paraview}
mkdir -p "$build/packages"
build=$(cd "$build" && pwd)
jobs=${TERAVOX_JOBS:-$(nproc)}
prefix=$build/prefix

as_root() {
  if [ "$(id -u)" -eq 0 ]; then
    env DEBIAN_FRONTEND=noninteractive "$@"
  else
    sudo env DEBIAN_FRONTEND=noninteractive "$@"
  fi
}

bash "$root/Examples/install-dependencies.sh" test

if [ ! -e "$build/packages/done" ]; then
  echo "== ParaView"
  as_root apt-get update -qq
  (cd "$build/packages" && apt-get -o APT::Sandbox::User=root download -qq paraview paraview-dev python3-paraview)
  depends=$(dpkg-deb --field "$build"/packages/paraview_*.deb Depends)
  as_root apt-get satisfy -y -qq --no-install-recommends "$depends" >"$build/packages/apt.log" 2>&1 ||
    { tail -20 "$build/packages/apt.log"; exit 1; }
  # What its CMake package looks for, and mpirun.
  as_root apt-get install -y -qq --no-install-recommends openmpi-bin libopenmpi-dev \
    qtbase5-dev qttools5-dev libqt5svg5-dev libqt5opengl5-dev >>"$build/packages/apt.log" 2>&1 ||
    { tail -20 "$build/packages/apt.log"; exit 1; }
  rm -rf "$prefix"
  for package in "$build"/packages/*.deb; do
    dpkg-deb --extract "$package" "$prefix"
    rm "$package"
  done
  touch "$build/packages/done"
fi
config=$(dirname "$(find "$prefix" -name paraview-config.cmake | head -1)")
[ -d "$config" ] || { echo "plugin.sh: there is no ParaView in $prefix." >&2; exit 1; }

echo "== Building the plugin"
cmake -S "$root" -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=Release -DPython3_EXECUTABLE=/usr/bin/python3 \
  -DTERAVOX_BUILD_PARAVIEW_PLUGIN=ON -DParaView_DIR="$config" >"$build/configure.log" 2>&1 ||
  { tail -40 "$build/configure.log"; exit 1; }
cmake --build "$build" -j "$jobs" -- --quiet

echo "== Testing the plugin"
xvfb-run -a -s "-screen 0 1280x1024x24 -noreset" \
  ctest --test-dir "$build" -j "$jobs" -L paraview --output-on-failure --no-tests=error
