#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Remake all pictures of README.md and docs/guide, from the levels in samples/ and with the programs in build/release.
#   docs/guide/pictures/make.sh [NAME...]      some of them; all without a name
set -euo pipefail
cd "$(dirname "$0")/../../.."
tools=$PWD/build/release/tools
relume=$tools/cli/relume
here=docs/guide/pictures
rooms=samples/level/two_rooms.glb cabin=samples/blender/cabin.glb
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
wanted=("$@")

# bake NAME LEVEL [OPTIONS]: once, when a picture asks for it. picture NAME BAKE LEVEL [OPTIONS] of relume render.
declare -A options=(
  [rooms]="$rooms --preset high" [rooms_draft]="$rooms --preset draft"
  [cabin]="$cabin --preset medium" [cabin_draft]="$cabin --preset draft"
  [few]="$cabin --preset draft --surfels 1000 --lightmap-caches 8000"
)
bake() {
  # shellcheck disable=SC2086
  [ -f "$scratch/$1.relume" ] || "$relume" bake ${options[$1]} -o "$scratch/$1.relume" --progress none
}
is_wanted() { [ ${#wanted[@]} -eq 0 ] || [[ " ${wanted[*]} " == *" $1 "* ]]; }
picture() {
  local name=$1 from=$2
  shift 2
  is_wanted "$name" || return 0
  bake "$from"
  "$relume" render "${options[$from]%% *}" --bake "$scratch/$from.relume" --size 384x216 --samples 3 --progress none "$@" -o "$here/$name.png"
  [ "$(stat -c %s "$here/$name.png")" -le 153600 ] || { echo "$name.png: more than 150 KiB" >&2; exit 1; }
}
day=(--lights sun --sky 1,1.3,2)

# README, getting started: direct light only | with indirect light
picture day rooms --camera cam_living "${day[@]}" --exposure 0.2 --aov unbounced,full --side-by-side
picture evening rooms --camera cam_living --lights lamp --exposure 0 --aov unbounced,full --side-by-side
if is_wanted caches; then
  bake rooms_draft
  "$tools/view/relume-view" "$rooms" --bake "$scratch/rooms_draft.relume" --camera cam_hall --lights spot,emissive --size 384x216 \
    --overlay caches --headless 1 -o "$scratch/frames"
  cp "$scratch/frames/frame_0000.png" "$here/caches.png"
fi
# The viewer: its window with a spot that is selected; its views and overlays
view="$tools/view/relume-view"
if is_wanted viewer; then
  bake rooms
  echo '[{"type": "spot", "name": "reading light", "position": [2.9, 1.7, 1.6], "direction": [0.2, -1, -0.3],
    "color": [1, 0.75, 0.5], "intensity": 40, "innerConeAngle": 0.5, "outerConeAngle": 0.7}]' >"$scratch/reading.json"
  (cd "$scratch" && python3 "$OLDPWD/$here/window.py" "$OLDPWD/$here/viewer.png" 720x405 \
    "mousemove 412 123 click 1; sleep 6; mousemove 600 400; sleep 8" "$view" "$OLDPWD/$rooms" --bake rooms.relume --camera cam_living \
    --lights lamp --lights-file reading.json --exposure 0.5)
fi
# Without a bake: an object that is picked and lifted, and what the passes cost
if is_wanted viewer_live; then
  python3 "$here/window.py" "$here/viewer_live.png" 720x405 \
    "mousemove 100 206 click 1; sleep 3; mousemove 400 372 click 1; sleep 3; mousemove 378 318 mousedown 1; sleep 1; mousemove 378 268; sleep 1;
    mouseup 1; sleep 2; mousemove 100 160 click 1; sleep 1; mousemove 100 45 click 1; sleep 4; mousemove 600 395; sleep 12" \
    "$view" "$rooms" --camera cam_living --lights lamp --exposure 0.5
fi
if is_wanted viewer_overlays; then
  bake rooms_draft
  shots=()
  for show in "links clusters" "links caches" "direct links" "texels"; do
    # shellcheck disable=SC2086
    set -- $show
    "$view" "$rooms" --bake "$scratch/rooms_draft.relume" --camera cam_living --size 352x198 --view "$1" ${2:+--overlay "$2"} \
      --headless 8 -o "$scratch/overlay${2:-$1}" >"$scratch/overlays.log"
    shots+=("$scratch/overlay${2:-$1}/frame_0007.png")
  done
  python3 samples/strip.py 2 "$here/viewer_overlays.png" "${shots[@]}"
fi
# Rendering: emitters that a frame drives
if is_wanted area_lights; then
  samples/area_lights/film.sh "$scratch/film" high 192x120 >"$scratch/film.log"
  cp "$scratch/film/strip.png" "$here/area_lights.png"
fi
# Rendering: a day
if is_wanted sky; then
  samples/day/film.sh "$scratch/day" high 128x80 >"$scratch/day.log"
  cp "$scratch/day/strip.png" "$here/sky.png"
fi
# Embedding: a renderer to copy
if is_wanted embed; then
  cp samples/level/two_rooms.glb "$scratch/embed.glb"
  "$relume" bake "$scratch/embed.glb" -o "$scratch/embed.relume" --export-glb "$scratch/embed_game.glb" --progress none
  xvfb-run -a "$tools/../samples/04_embed/embed" "$scratch/embed_game.glb" "$scratch/embed.relume" "$scratch/embed.png" 70
  python3 - samples "$scratch/embed.png" "$here/embed.png" <<'PYTHON'
import sys
sys.path.insert(0, sys.argv[1])
sys.dont_write_bytecode = True
from strip import read_png, write_png
width, height, rows = read_png(sys.argv[2])  # halved
mean = lambda x, y, c: (rows[y][3 * x + c] + rows[y][3 * x + 3 + c] + rows[y + 1][3 * x + c] + rows[y + 1][3 * x + 3 + c]) // 4
write_png(sys.argv[3], width // 2, height // 2,
          bytes(mean(x, y, c) for y in range(0, height, 2) for x in range(0, width, 2) for c in range(3)))
PYTHON
fi
# In Vulkan: the sample without a window
if is_wanted vulkan; then
  cp samples/level/two_rooms.glb "$scratch/vulkan.glb"
  "$relume" bake "$scratch/vulkan.glb" -o "$scratch/vulkan.relume" --preset draft --export-glb "$scratch/vulkan_game.glb" --progress none
  "$tools/../samples/06_vulkan_headless/vulkan_headless" "$scratch/vulkan_game.glb" "$scratch/vulkan.relume" "$here/vulkan.png"
fi
# In engines: OGRE
if is_wanted ogre; then
  cp samples/level/two_rooms.glb "$scratch/ogre.glb"
  "$relume" bake "$scratch/ogre.glb" -o "$scratch/ogre.relume" --export-glb "$scratch/ogre_game.glb" --progress none
  xvfb-run -a "$tools/../samples/07_ogre/ogre_level" "$scratch/ogre_game.glb" "$scratch/ogre.relume" --screenshot "$scratch/ogre.png" --frames 76
  python3 samples/strip.py 1 "$here/ogre.png" "$scratch/ogre.png"
fi
# In engines: Godot 3
if is_wanted godot; then
  cp samples/level/two_rooms.glb "$scratch/godot.glb"
  "$relume" bake "$scratch/godot.glb" -o "$scratch/godot.relume" --export-glb "$scratch/godot_game.glb" --progress none
  RELIGHT_SERVER=$tools/../samples/08_godot/relight_server xvfb-run -a samples/08_godot/play.sh "$scratch/godot_game.glb" \
    "$scratch/godot.relume" --screenshot="$scratch/godot.png" --frames=46
  python3 samples/strip.py 1 "$here/godot.png" "$scratch/godot.png"
fi
# A level from Blender
picture cabin_west cabin --camera cam_west --lights sun,lamp --sky 1,1.3,2
picture cabin_east cabin --camera cam_east --lights spot,emissive --aov unbounced,full --side-by-side
# Troubleshooting: what one sees, and the same place mended
globe=(--eye 6.6,1.5,2.6 --target 7,0.9,0.75 --fov 40 --lights emissive,spot --aov indirect --exposure -0.5)
picture seam rooms_draft "${globe[@]}"
picture seam_mended rooms "${globe[@]}"
picture blotches few --camera cam_west "${day[@]}" --exposure 1.2 --aov indirect
picture blotches_mended cabin --camera cam_west "${day[@]}" --exposure 1.2 --aov indirect
picture outside cabin_draft --eye 1,1.8,5 --target 3.4,1.2,0 --fov 60 --lights lamp --exposure 1
picture too_bright cabin_draft --camera cam_east --lights spot,emissive --light-unit radiometric --exposure 0
