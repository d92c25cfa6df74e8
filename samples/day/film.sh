#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# A day from before dawn into the night, frame by frame and without a window: the sample level is baked once, and each frame
# has another sky (--sky-map) and sun (--lights-file); the lamp goes on at dusk. In a game the same is
# LightSetup::skyPatches and lights, every frame. Writes frame_NN.png and strip.png, all frames in rows of four.
#   samples/day/film.sh [DIR [PRESET [SIZE [HOURS]]]]     out/day, high, 320x200, "5.5 6.2 7 8 9.5 11 12.5 14 16 17.2 18.1 20"
set -euo pipefail
# Paths are those of the caller's folder, which this leaves; a name without a slash is found as commands are.
output="${1:+$(realpath -m -- "$1")}" relume="${RELUME:-build/release/tools/cli/relume}"
[[ ${RELUME:-} != */* ]] || relume="$(realpath -m -- "$RELUME")"
cd "$(dirname "$0")/../.."
output="${output:-out/day}" preset="${2:-high}" size="${3:-320x200}"
read -ra hours <<<"${4:-5.5 6.2 7 8 9.5 11 12.5 14 16 17.2 18.1 20}"
level=samples/level/two_rooms.glb
mkdir -p "$output"
"$relume" bake "$level" -o "$output/level.relume" --preset "$preset" --progress none

pictures=()
for i in "${!hours[@]}"; do
  hour=${hours[$i]}
  name="$(printf %02d "$i")"
  python3 samples/day/make_sky.py "$hour" "$output/sky_$name.hdr" "$output/sun_$name.json"
  # An eye adapts: half a stop by the lamp, one and a half in the light of noon, more toward dawn and dusk.
  lamp=none
  exposure=$(awk "BEGIN { d = ($hour - 12) / 6; printf \"%.2f\", 1.5 + 1.5 * d * d }")
  if awk "BEGIN { exit !($hour < 5.8 || $hour > 18) }"; then lamp=lamp exposure=0.5; fi
  "$relume" render "$level" --bake "$output/level.relume" --camera cam_living --lights "$lamp" \
    --lights-file "$output/sun_$name.json" --sky-map "$output/sky_$name.hdr" --exposure "$exposure" \
    --size "$size" --samples 3 --progress none --aov full -o "$output/frame_$name.png"
  pictures+=("$output/frame_$name.png")
done
python3 samples/strip.py 4 "$output/strip.png" "${pictures[@]}"
echo "wrote $output/strip.png"
