#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# What a CI does with bakes: bake what is out of date, validate it, and compare it with the last accepted one.
#
#   samples/ci/check_bakes.sh LEVELS ACCEPTED OUT
#
#   LEVELS    folder with *.glb and *.gltf; none is no error. Options of a level are in <level>.options.json beside it,
#             over the preset
#   ACCEPTED  folder with the bakes of the last release, <level>.relume; a level without one is only baked and validated,
#             a bake without a level is named. Empty before the first run
#   OUT       folder for new bakes, reports and pages; another one than ACCEPTED
#
# Environment: RELUME (the program), PRESET, MAX_RMSE, MAX_CACHE_CHANGE and MAX_RECEIVER_CHANGE (bounds of `relume
# compare`), IGNORE.
# Exit status: 0 all well; 1 wrong call, ACCEPTED is missing, two levels of one name; 7 light of some level changed beyond
# the bounds; else that of the command that failed.
set -euo pipefail

levels="${1:?usage: check_bakes.sh LEVELS ACCEPTED OUT}"
accepted="${2:?usage: check_bakes.sh LEVELS ACCEPTED OUT}"
out="${3:?usage: check_bakes.sh LEVELS ACCEPTED OUT}"
relume="${RELUME:-relume}"
preset="${PRESET:-high}"
bounds=(--max-rmse "${MAX_RMSE:-0.05}" --max-cache-change "${MAX_CACHE_CHANGE:-1}"
  --max-receiver-change "${MAX_RECEIVER_CHANGE:-0.5}")
if [ -n "${IGNORE:-}" ]; then bounds+=(--ignore "$IGNORE"); fi

if [ ! -d "$levels" ]; then
  echo "check_bakes.sh: LEVELS: a folder expected, \"$levels\" is none" >&2
  exit 1
fi
if [ ! -d "$accepted" ]; then
  echo "check_bakes.sh: ACCEPTED: a folder expected, \"$accepted\" is none: an empty one is the first run (mkdir)" >&2
  exit 1
fi
shopt -s nullglob
found=("$levels"/*.glb "$levels"/*.gltf)
if [ ${#found[@]} -eq 0 ]; then
  echo "no levels (*.glb, *.gltf) in $levels"
fi

mkdir -p "$out"
if [ "$out" -ef "$accepted" ]; then
  echo "check_bakes.sh: OUT: another folder than ACCEPTED expected: new bakes would be written over the accepted ones" >&2
  exit 1
fi
result=0
declare -A seen
for level in "${found[@]}"; do
  file="$(basename "$level")"
  name="${file%.*}"
  if [ -n "${seen[$name]:-}" ]; then
    echo "check_bakes.sh: ${seen[$name]} and $file would both be baked to $name.relume: rename one" >&2
    exit 1
  fi
  seen[$name]="$file"
  bake="$out/$name.relume"
  old="$accepted/$name.relume"

  # What is no bake, such as a pointer of Git LFS, is named before anything is made of it.
  if [ -f "$old" ]; then
    status=0
    "$relume" validate "$old" >"$out/$name.txt" || status=$?
    if [ "$status" -ne 0 ]; then
      cat "$out/$name.txt"
      echo "check_bakes.sh: the accepted bake $old cannot be used: fetch it (git lfs pull), or accept a new one" >&2
      exit "$status"
    fi
  fi
  # An accepted bake that is up to date with its scene and the options saves the work.
  if [ -f "$old" ] && [ ! -f "$bake" ]; then
    cp "$old" "$bake.part"
    mv "$bake.part" "$bake"
  fi
  options=()
  if [ -f "$levels/$name.options.json" ]; then options=(--options "$levels/$name.options.json"); fi
  "$relume" bake "$level" -o "$bake" --preset "$preset" "${options[@]}" --report "$out/$name.json" --progress plain
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
for old in "$accepted"/*.relume; do
  name="$(basename "$old" .relume)"
  if [ -z "${seen[$name]:-}" ]; then
    echo "no level for the accepted bake $old: not compared; where its level is gone for good, remove it"
  fi
done
exit "$result"
