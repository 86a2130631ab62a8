# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
# shellcheck shell=bash
#
# What the tests of Debian packages share; sourced. `name` is the script's, `build` the build folder,
# `source` the sources, `work` an empty folder. `root` is where packages get installed.
root=$work/root

fail() {
  echo "$name: $*" >&2
  exit 1
}

make_debs() { # make_debs <packages>...: makes them, and sees that apt can install them
  echo "== Packages"
  (cd "$work" && cpack -G DEB --config "$build/CPackConfig.cmake" -B "$work/made" >"$work/cpack.log" 2>&1) ||
    { cat "$work/cpack.log"; fail "cpack failed"; }
  debs=("$work"/made/*.deb)
  names=()
  local deb
  for deb in "${debs[@]}"; do
    names+=("$(dpkg-deb --field "$deb" Package)")
    echo "$(dpkg-deb --field "$deb" Package) $(du -h --apparent-size "$deb" | cut -f 1): $(dpkg-deb --field "$deb" Depends)"
  done
  [ "${names[*]}" = "$*" ] || fail "the packages are ${names[*]}"
  echo "== apt: the dependencies can be had"
  apt-get --simulate --no-install-recommends install "${debs[@]}" >"$work/apt.log" 2>&1 ||
    { cat "$work/apt.log"; fail "apt can't install them"; }
}

depends() { # depends <package> <words>...: each one is in its dependencies
  local fields word
  fields=$(dpkg-deb --field "$work"/made/"$1"_*.deb Depends)
  for word in "${@:2}"; do
    [[ $fields == *"$word"* ]] || fail "$1 doesn't depend on $word"
  done
}

files_of_root() { (cd "$root" && find . -path ./var/lib/dpkg -prune -o -print | sort); }

# Dependencies are those of the machine, of which the new database knows nothing.
dpkg_in_root() {
  dpkg --root="$root" --log="$work/dpkg.log" --force-depends --force-not-root \
    --force-script-chrootless "$@" >"$work/dpkg.out" 2>&1 || { cat "$work/dpkg.out"; return 1; }
}

install_debs() {
  echo "== Installing into an empty root"
  mkdir -p "$root/var/lib/dpkg/"{info,updates,triggers}
  : >"$root/var/lib/dpkg/status"
  : >"$root/var/lib/dpkg/available"
  mkdir -p "$root/var/log"
  files_of_root >"$work/before"
  dpkg_in_root --install "${debs[@]}" || fail "dpkg can't install them"
  local package twice
  for package in "${names[@]}"; do
    [ "$(dpkg-query --admindir="$root/var/lib/dpkg" -W -f '${db:Status-Abbrev}' "$package")" = "ii " ] ||
      fail "$package isn't installed"
    [ -s "$root/usr/share/doc/$package/copyright" ] || fail "$package has no copyright file"
  done
  twice=$(for deb in "${debs[@]}"; do dpkg-deb --fsys-tarfile "$deb" | tar -t | grep -v '/$'; done | sort | uniq -d)
  [ -z "$twice" ] || fail "several packages have $twice"
  if grep -rl --binary-files=text -e "$build" -e "$source" "$root/usr" >"$work/traces"; then
    cat "$work/traces"
    fail "these know where they were built"
  fi
}

remove_debs() {
  echo "== Removing"
  dpkg_in_root --purge "${names[@]}" || fail "dpkg can't remove them"
  files_of_root >"$work/after"
  diff "$work/before" "$work/after" || fail "removing leaves these"
}
