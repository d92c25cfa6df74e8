#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# What a CI does with bakes: bake what is out of date, validate it, and compare it with the last accepted one.
#
#   samples/ci/check_bakes.sh LEVELS ACCEPTED OUT
#
#   LEVELS    folder with *.glb
#   ACCEPTED  folder with the bakes of the last release, <level>.relume; a level without one is only baked and validated
#   OUT       folder for new bakes, reports and pages
#
# Environment: RELUME (the program), PRESET, MAX_RMSE and MAX_CACHE_CHANGE (bounds of `relume compare`), IGNORE.
# Exit status: 0 all well; 7 light of some level changed beyond the bounds; else that of the command that failed.
set -euo pipefail

levels="${1:?usage: check_bakes.sh LEVELS ACCEPTED OUT}"
accepted="${2:?usage: check_bakes.sh LEVELS ACCEPTED OUT}"
out="${3:?usage: check_bakes.sh LEVELS ACCEPTED OUT}"
relume="${RELUME:-relume}"
preset="${PRESET:-high}"
bounds=(--max-rmse "${MAX_RMSE:-0.05}" --max-cache-change "${MAX_CACHE_CHANGE:-1}")
if [ -n "${IGNORE:-}" ]; then bounds+=(--ignore "$IGNORE"); fi

mkdir -p "$out"
result=0
for level in "$levels"/*.glb; do
  name="$(basename "$level" .glb)"
  bake="$out/$name.relume"
  old="$accepted/$name.relume"

  # An accepted bake that is up to date with its scene and the options saves the work.
  if [ -f "$old" ] && [ ! -f "$bake" ]; then cp "$old" "$bake"; fi
  "$relume" bake "$level" -o "$bake" --preset "$preset" --report "$out/$name.json" --progress plain
  "$relume" validate "$bake"
  if [ ! -f "$old" ]; then
    echo "$name: no accepted bake to compare with"
    continue
  fi

  status=0
  "$relume" compare "$old" "$bake" "${bounds[@]}" --html "$out/$name.html" --report-b "$out/$name.json" \
    --progress none >"$out/$name.txt" || status=$?
  cat "$out/$name.txt"
  case "$status" in
    0) ;;
    7) echo "$name: light changed beyond the bounds, see $out/$name.html"; result=7 ;;
    *) exit "$status" ;;
  esac
done
exit "$result"
