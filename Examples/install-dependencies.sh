#!/usr/bin/env bash
# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
#
# Installs the Debian packages that Teravox needs; the only place that lists them.
#
#   install-dependencies.sh [build|demo|test]      default: test
#
#   build   compiler, libraries
#   demo    build, and an X server without a screen, Mesa's software renderer, the brain and head volumes
#   test    demo, and what tests and checks use
#
# What is installed already is skipped, so that a second run needs neither network nor root.
# Exit code 0: all is there, except perhaps the packages listed as optional, which are named.
set -euo pipefail

build=(
  g++ cmake ninja-build pkg-config ccache
  libvtk9-dev python3-vtk9 python3-dev
  libhdf5-dev libdeflate-dev liblz4-dev liblzf-dev libzstd-dev libblosc-dev libaec-dev libtiff-dev zlib1g-dev
  libpng-dev libjpeg-dev
  nlohmann-json3-dev libpugixml-dev
  libcli11-dev libfmt-dev)
demo=(xvfb xauth libgl1-mesa-dri)
optional=(mricron-data invesalius-examples)
test=(
  git libgtest-dev glslang-tools clang-format-14 clang-tidy-14
  python3-h5py python3-numpy python3-dask python3-tqdm python3-zarr python3-numcodecs
  hdf5-filter-plugin hdf5-filter-plugin-blosc-serial f3d libopenmpi-dev openmpi-bin xdotool)

case "${1:-test}" in
  build) wanted=("${build[@]}") optional=() ;;
  demo) wanted=("${build[@]}" "${demo[@]}") ;;
  test) wanted=("${build[@]}" "${demo[@]}" "${test[@]}") ;;
  *)
    echo "install-dependencies.sh: '$1' is none of build, demo, test." >&2
    exit 2
    ;;
esac

installed() {
  [ "$(dpkg-query -W -f '${db:Status-Abbrev}' "$1" 2>/dev/null)" = "ii " ]
}

missing_of() {
  local package
  for package in "$@"; do
    installed "$package" || echo "$package"
  done
}

as_root() {
  if [ "$(id -u)" -eq 0 ]; then
    env DEBIAN_FRONTEND=noninteractive "$@"
  else
    sudo env DEBIAN_FRONTEND=noninteractive "$@"
  fi
}

updated=no
apt_install() {
  if [ "$updated" = no ]; then
    as_root apt-get update -qq
    updated=yes
  fi
  as_root apt-get install -y -qq --no-install-recommends "$@"
}

if ! command -v dpkg-query >/dev/null; then
  echo "install-dependencies.sh: this isn't Debian; install by hand: ${wanted[*]}" >&2
  exit 1
fi

mapfile -t missing < <(missing_of "${wanted[@]}")
if [ "${#missing[@]}" -gt 0 ]; then
  echo "Installing ${missing[*]}"
  apt_install "${missing[@]}"
fi

mapfile -t missing < <(missing_of ${optional[@]+"${optional[@]}"})
for package in "${missing[@]}"; do
  if ! apt_install "$package"; then
    echo "The optional package $package can't be installed; what needs it does without." >&2
  fi
done
