#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# A film of samples/area_lights/stars.glb, frame by frame and without a window, after Fig. 7 of PIC: four asterisks and a
# ring that turn on and off, then a screen that plays alone. The level is baked once; what changes is --emission, which
# is MaterialEmission of the runtime. Writes frame_NN.png and strip.png, all frames in rows of four.
#   samples/area_lights/film.sh [DIR [PRESET [SIZE]]]      out/area_lights, high, 320x200
set -euo pipefail
# Paths are those of the caller's folder, which this leaves; a name without a slash is found as commands are.
output="${1:+$(realpath -m -- "$1")}" relume="${RELUME:-build/release/tools/cli/relume}"
[[ ${RELUME:-} != */* ]] || relume="$(realpath -m -- "$RELUME")"
cd "$(dirname "$0")/../.."
output="${output:-out/area_lights}" preset="${2:-high}" size="${3:-320x200}"
level=samples/area_lights/stars.glb
mkdir -p "$output"
"$relume" bake "$level" -o "$output/stars.relume" --preset "$preset" --progress none

# What shines in each frame.
frames=(star_red star_red,star_green star_red,star_green,star_blue star_red,star_green,star_blue,star_yellow
  ring star_blue,ring screen screen)
red=14,3.5,2.1 green=4.2,14,3.5 blue=2.8,5.6,14 yellow=14,11,2.8 ring=9,8.6,8.1
pictures=()
for i in "${!frames[@]}"; do
  picture="$output/frame_$(printf %02d "$i").png"
  emissions=()
  for name in ${frames[$i]//,/ }; do
    case $name in
      screen)
        python3 samples/area_lights/draw_signs.py screen "$i" "${#frames[@]}" "$output/screen_$i.png"
        emissions+=(--emission "screen=$output/screen_$i.png") ;;
      ring) emissions+=(--emission "ring=$ring") ;;
      *) color=${name#star_} && emissions+=(--emission "$name=${!color}") ;;
    esac
  done
  # A PNG ends at 1 W/m²/sr: the screen is exposed three stops longer.
  exposure=0.3
  [ "${frames[$i]}" != screen ] || exposure=3.3
  "$relume" render "$level" --bake "$output/stars.relume" --lights none "${emissions[@]}" --exposure "$exposure" \
    --size "$size" --samples 3 --progress none -o "$picture" --aov full
  pictures+=("$picture")
done
python3 samples/strip.py 4 "$output/strip.png" "${pictures[@]}"
echo "wrote $output/strip.png"
