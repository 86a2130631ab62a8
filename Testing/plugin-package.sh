#!/usr/bin/env bash
# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
#
# Makes the Debian package of a build folder of the ParaView plugin and uses it as its users would:
#
#   plugin-package.sh <build folder> <pvpython>
#
# As packages.sh: the package is installed into an empty root, loaded from there by path and by name
# in a ParaView that lies elsewhere, draws a picture, and is removed without a trace. Needs a
# display, and the volumes of Plugin/Testing/make_volumes.py in TERAVOX_VOLUMES.
set -euo pipefail

[ $# -eq 2 ] || { echo "plugin-package.sh: a build folder and pvpython are needed." >&2; exit 2; }
build=$(cd "$1" && pwd)
pvpython=$2
source=$(cd "$(dirname "$0")/.." && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
name=plugin-package.sh
. "$source/Testing/debs.sh"

make_debs paraview-plugin-teravox
# What ParaView's own libraries ask for: no other version of it.
depends paraview-plugin-teravox "paraview (>= 5.11.0+dfsg)" "paraview (<< 5.11.0+dfsg.)" libhdf5 liblz4 liblzf \
  libzstd libblosc libaec libdeflate libpugixml
[[ $(dpkg-deb --field "$work"/made/*.deb Depends) != *libvtk9* ]] || fail "it wants VTK beside ParaView's"
install_debs

plugins=$root/usr/lib/paraview-5.11/plugins
loads() { # loads <how> <environment>...: the plugin loads, from the root, and a picture is drawn
  echo "== Loading it by $1"
  env -i HOME="$work" PATH=/usr/bin:/bin DISPLAY="${DISPLAY:-}" ${XAUTHORITY:+XAUTHORITY="$XAUTHORITY"} \
    PYTHONPATH="${PYTHONPATH:-}" TERAVOX_VOLUMES="$TERAVOX_VOLUMES" LP_NUM_THREADS=2 "${@:2}" \
    "$pvpython" "$source/Plugin/Testing/package_scene.py" "$plugins/" >"$work/load.log" 2>&1 ||
    { tail -20 "$work/load.log"; fail "it doesn't load by $1"; }
  grep -q "package_scene.py: passed" "$work/load.log" || { cat "$work/load.log"; fail "no picture by $1"; }
}
loads path TERAVOX_PLUGIN="$plugins/Teravox/Teravox.so"
loads name TERAVOX_PLUGIN=Teravox PV_PLUGIN_CONFIG_FILE="$plugins/teravox.plugins.xml"
remove_debs
echo "plugin-package.sh: passed"
