#!/usr/bin/env bash
# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
#
# Makes the Debian packages of a build folder and uses them as their users would:
#
#   packages.sh <build folder>
#
# What is proven: dpkg installs the packages into an empty root with a database of its own, apt says
# that their dependencies can be had, no file of them knows the build folder, two packages never have
# the same file; the program draws the demo, the Python package the pictures of its page, and the C++ example is built,
# all from that root; purging leaves nothing. What isn't: the libraries that the packages depend on
# are those of this machine, no file system of its own hides them. Needs a display.
set -euo pipefail

[ $# -eq 1 ] || { echo "packages.sh: one argument is needed, a build folder." >&2; exit 2; }
build=$(cd "$1" && pwd)
source=$(cd "$(dirname "$0")/.." && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
name=packages.sh
. "$source/Testing/debs.sh"

make_debs libteravox-dev libteravox python3-teravox teravox
depends libteravox libvtk9.1 libhdf5 liblz4 liblzf libzstd libblosc libaec libdeflate libpugixml libtiff libpng libjpeg
depends libteravox-dev libteravox libvtk9-dev
depends python3-teravox libteravox python3-vtk9 python3-numpy
depends teravox libteravox libvtk9.1
install_debs

# From here on nothing of this shell's environment leads anywhere else.
python_path=$root/usr/lib/python3/dist-packages
installed() {
  env -i HOME="$work" PATH="$root/usr/bin:/usr/bin:/bin" DISPLAY="${DISPLAY:-}" ${XAUTHORITY:+XAUTHORITY="$XAUTHORITY"} \
    PYTHONPATH="$python_path" "$@"
}
library=$(echo "$root"/usr/lib/libvtkRenderingOutOfCore.so.?)
uses_root() { # uses_root <file>: it loads the root's library
  local loads
  loads=$(installed ldd "$1" | grep libvtkRenderingOutOfCore) # all of it is read: no broken pipe
  [[ $loads == *"=> $root/"* ]] || fail "$1 doesn't load $library: $loads"
}

echo "== The program and the demo"
uses_root "$root/usr/bin/teravox"
installed teravox --version
installed TERAVOX_PROGRAM="$root/usr/bin/teravox" bash "$source/Examples/demo.sh" "$work/demo" >"$work/demo.log" 2>&1 ||
  { tail -20 "$work/demo.log"; fail "the demo failed"; }
pictures=("$work"/demo/*.png)
[ "${#pictures[@]}" -eq 5 ] || fail "the demo drew ${#pictures[@]} pictures instead of 5"

echo "== Python"
uses_root "$python_path"/teravox/_callback.*.so
uses_root "$python_path"/teravox/vtkRenderingOutOfCore.so
installed /usr/bin/python3 -c "
import teravox
assert teravox.__file__.startswith('$root'), teravox.__file__"
for page in python getting-started; do
  installed /usr/bin/python3 "$source/Testing/Docs/run_page.py" "$source/docs/$page.md" >"$work/page.log" 2>&1 ||
    { tail -20 "$work/page.log"; fail "docs/$page.md failed"; }
done

echo "== The C++ example"
installed cmake -S "$source/Examples/Cxx/RenderPyramid" -B "$work/example" -G Ninja \
  -DCMAKE_BUILD_TYPE=Release -DCMAKE_PREFIX_PATH="$root/usr" >"$work/example.log" 2>&1 &&
  installed cmake --build "$work/example" >>"$work/example.log" 2>&1 ||
  { tail -20 "$work/example.log"; fail "the example can't be built"; }
uses_root "$work/example/RenderPyramid"

remove_debs
echo "packages.sh: passed"
