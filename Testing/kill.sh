#!/usr/bin/env bash
# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
#
# Kills a conversion at random moments and lets it go on, again and again:
#
#   kill.sh <program teravox> [kills, default 100] [arguments of convert, instead of a formula]
#
# What is proven: no file is ever there under its name that isn't complete, and what becomes of all the
# kills is, byte by byte, what one undisturbed conversion writes. TestProgramResume does so a few times.
set -euo pipefail

[ $# -ge 1 ] || { echo "kill.sh: the program is needed." >&2; exit 2; }
program=$1
kills=${2:-100}
shift $(($# > 1 ? 2 : 1))
input=("$@")
[ ${#input[@]} -gt 0 ] || input=(formula:marschner-lobb --dimensions 192 192 192 --type u16)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# As it is, not a function: the process of a function that runs in the background is another one.
command_for() {
  command=("$program" convert "${input[0]}" "$1" "${input[@]:1}" --brick 32 --memory 64M
    --compression deflate --level 9 --quiet --resume)
}

start=$(date +%s%N)
command_for "$work/whole.h5"
"${command[@]}"
length=$((($(date +%s%N) - start) / 1000000))
echo "One conversion takes $length ms."

RANDOM=1
killed=0
completed=0
most=0
command_for "$work/out.h5"
while [ "$killed" -lt "$kills" ]; do
  "${command[@]}" &
  process=$!
  moment=$(((RANDOM * 32768 + RANDOM) % length))
  sleep "$((moment / 1000)).$(printf '%03d' $((moment % 1000)))"
  kill -KILL "$process" 2>/dev/null || true
  status=0
  wait "$process" 2>/dev/null || status=$?
  case $status in
    0) ;; # it was faster
    137) killed=$((killed + 1)) ;;
    *) echo "kill.sh: the conversion failed." >&2; exit 1 ;;
  esac
  if [ -e "$work/out.h5" ]; then
    cmp "$work/whole.h5" "$work/out.h5" || { echo "kill.sh: it differs." >&2; exit 1; }
    completed=$((completed + 1))
    rm "$work/out.h5"
  fi
  size=$(du -sm "$work" | cut -f 1)
  most=$((size > most ? size : most))
done
"${command[@]}"
cmp "$work/whole.h5" "$work/out.h5" || { echo "kill.sh: it differs." >&2; exit 1; }
[ "$(find "$work" -type f | wc -l)" -eq 2 ] || { echo "kill.sh: something is left." >&2; exit 1; }
echo "$killed kills, $((completed + 1)) files, all the same; at most $most MiB on disk, $(du -sm "$work/whole.h5" | cut -f 1) of them the file to compare with."
