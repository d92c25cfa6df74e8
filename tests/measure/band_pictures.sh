#!/bin/sh
# SPDX-License-Identifier: MIT
# The table of docs/notes/bands.md that compares pictures lit with fewer chroma bands with uncompressed ones.
#   band_pictures.sh RELUME BENCH_PICTURE_ERROR SCENES WORK
# SCENES holds cornell/cornell.glb and so on; WORK gets bakes (kept for the next time) and pictures.
set -eu
relume=$1 error=$2 scenes=$3 work=$4
spots=$(dirname "$0")/red_green_spots.json
mkdir -p "$work"

# level, camera, exposure [stops], what is lit
table() {
  level=$1 camera=$2 exposure=$3
  shift 3
  [ -f "$work/$level.relume" ] ||
    "$relume" bake "$scenes/$level/$level.glb" -o "$work/$level.relume" --preset high --progress none >&2
  printf '\n%s, %s, %s, exposure %s:\n\n' "$level" "$camera" "$(echo "$*" | sed 's/--[a-z-]* //g; s|[^ ]*/||g')" "$exposure"
  printf '| bands | Lab RMSE | FLIP mean | FLIP p95 |\n|---|---:|---:|---:|\n'
  for luma in 2 3 4; do
    pictures= chroma=$luma
    while [ "$chroma" -ge 1 ]; do
      picture=$work/Y${luma}Co${chroma}Cg${chroma}.exr
      "$relume" render "$scenes/$level/$level.glb" --bake "$work/$level.relume" --camera "$camera" "$@" --size 320x180 \
        --samples 2 --bands "Y${luma}Co${chroma}Cg${chroma}" -o "$picture" --progress none >/dev/null 2>&1
      [ "$chroma" -eq "$luma" ] && reference=$picture || pictures="$pictures $picture"
      chroma=$((chroma - 1))
    done
    "$error" "$exposure" "$reference" $pictures
  done
  # What luma costs, against eight bands of all
  "$relume" render "$scenes/$level/$level.glb" --bake "$work/$level.relume" --camera "$camera" "$@" --size 320x180 \
    --samples 2 --bands Y8Co8Cg8 -o "$work/Y8Co8Cg8.exr" --progress none >/dev/null 2>&1
  printf '\n| against Y8Co8Cg8 | Lab RMSE | FLIP mean | FLIP p95 |\n|---|---:|---:|---:|\n'
  "$error" "$exposure" "$work/Y8Co8Cg8.exr" "$work/Y2Co2Cg2.exr" "$work/Y2Co1Cg1.exr" "$work/Y3Co1Cg1.exr" \
    "$work/Y3Co3Cg3.exr" "$work/Y4Co4Cg4.exr"
}

table cornell cam_front 1 --lights none --lights-file "$spots"
table cornell cam_corner 2 --lights none --lights-file "$spots" --aov indirect
table sponza cam_atrium 2 --lights sun
table sponza cam_arcade 2 --lights torch
table breakfast_room cam_main 1 --lights sun
