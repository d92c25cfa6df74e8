#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Install what is missing, build, bake the sample level, and relight it under three light setups without a window.
# Works from a fresh clone on a bare Debian 12, as root or with sudo. One picture a setup, from left to right:
# direct light only | with indirect light | indirect light only.
#   samples/demo.sh            pictures go to out/demo
#   samples/demo.sh DIR        pictures go to DIR
set -euo pipefail
output="${1:+$(realpath -m -- "$1")}"  # of the caller's folder, which this leaves
cd "$(dirname "$0")/.."
source tools/packages.sh

output="${output:-out/demo}"
mkdir -p "$output"

install_packages packages.txt
echo "== Building"
cmake --preset release >"$output/build.log"  # the settings of tests/run.sh, which builds in the same folder
end_if_configure_only
cmake --build build/release --parallel "$(nproc)" --target relume >>"$output/build.log" ||
  { tail -n 40 "$output/build.log" >&2; exit 1; }
relume=build/release/tools/cli/relume
level=samples/level/two_rooms.glb
bake="$output/two_rooms.relume"

echo "== Baking $level"
"$relume" bake "$level" -o "$bake" --preset medium

# relight NAME CAMERA EXPOSURE LIGHTS [OPTIONS]: draw one setup. OpenGL when EGL has it (a software rasteriser will do),
# else the CPU.
relight() {
  local name=$1 camera=$2 exposure=$3 lights=$4
  shift 4
  local arguments=("$level" --bake "$bake" --camera "$camera" --lights "$lights" --exposure "$exposure" "$@"
    --aov unbounced,full,bounced --side-by-side --size 640x360 --samples 2 --shadow-size 4096 --progress none -o "$output/$name.png")
  echo
  echo "== $name: $lights from $camera"
  "$relume" render "${arguments[@]}" --backend gl || {
    [ $? -eq 5 ] || return 1
    echo "No OpenGL here: drawing on the CPU."
    "$relume" render "${arguments[@]}" --backend cpu
  }
}
relight day cam_living -0.8 sun --sky 1.2,1.6,2.4
relight evening cam_living 0 lamp
relight panel cam_hall -0.5 emissive,spot

echo
echo "Pictures (direct light only | with indirect light | indirect light only):"
for name in day evening panel; do echo "  $(realpath "$output")/$name.png"; done
