#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# samples/06_vulkan_headless: its indirect light is that of `relume render`, wrong input is refused. Exits with 77 where
# there is no Vulkan device.
#   vulkan_test.sh RELUME VULKAN_HEADLESS SOURCE FOLDER      FOLDER: of this test alone, made anew
set -euo pipefail
relume=$1 headless=$2 source=$3 folder=$4
rm -rf "$folder"
mkdir -p "$folder"
cd "$folder"
cp "$source/samples/level/two_rooms.glb" level.glb
"$relume" bake level.glb -o level.relume --preset draft --export-glb game.glb --progress none 2>/dev/null
source "$source/tests/samples/expect.sh"

rc=0
"$headless" game.glb level.relume indirect.png 12 indirect 2>log.txt || rc=$?
[ "$rc" -ne 5 ] || { cat log.txt; echo "skipped"; exit 77; }
[ "$rc" -eq 0 ] || { cat log.txt; exit 1; }
"$headless" game.glb level.relume one.png 1 indirect
"$headless" game.glb level.relume all.png 4
"$relume" render level.glb --bake level.relume --lights sun,lamp,emissive --aov indirect --exposure 0 --size 480x270 \
  --samples 1 --bands Y3Co1Cg1 -o truth.png --progress none >/dev/null
"$relume" diff indirect.png truth.png --json >indirect.json
"$relume" diff one.png truth.png --json >one.json
"$relume" diff all.png truth.png --json >all.json
python3 - <<'PYTHON'
import json

read = lambda name: json.load(open(name + ".json"))
indirect, one, everything = read("indirect"), read("one"), read("all")
assert abs(indirect["energy"] - 1) < 0.005 and indirect["relativeRmse"] < 0.01 and indirect["flip"] < 0.015, indirect
assert one["energy"] < 0.9, one  # later frames bounce
assert everything["relativeRmse"] > 0.1, everything
PYTHON

# What a node mirrors, bends or scales, and which camera is taken
python3 "$source/tests/samples/odd_level.py" level.glb odd.glb
"$relume" bake odd.glb -o odd.relume --preset draft --export-glb odd_game.glb --progress none 2>/dev/null
"$headless" odd_game.glb odd.relume odd.png 12 indirect
"$relume" render odd.glb --bake odd.relume --camera cam_living --lights sun,lamp,emissive --aov indirect --exposure 0 \
  --size 480x270 --samples 1 --bands Y3Co1Cg1 -o odd_truth.png --progress none >/dev/null
"$relume" diff odd.png odd_truth.png --max-rmse 0.01
rc=0
"$relume" diff indirect.png odd_truth.png --max-rmse 0.05 >/dev/null || rc=$?
[ "$rc" -eq 7 ] || { echo "the targets change nothing that is seen"; exit 1; }

# A bake without a grid is drawn, and what is missing is said
"$relume" bake level.glb -o no_grid.relume --preset draft --grid-caches 0 --progress none 2>/dev/null
"$headless" game.glb no_grid.relume no_grid.png 1 2>log.txt
grep -q "no_grid.relume: no grid" log.txt

"$relume" bake level.glb -o irradiance.relume --preset draft --link-kind irradiance --progress none 2>/dev/null
cp "$source/samples/blender/cabin.glb" cabin.glb
"$relume" bake cabin.glb -o cabin.relume --preset draft --progress none 2>/dev/null
head -c 300000 level.relume >cut.relume
expect 1 "usage: vulkan_headless" "$headless" game.glb level.relume
expect 1 "usage: vulkan_headless" "$headless" game.glb level.relume out.png 0
expect 1 "irradiance links" "$headless" game.glb irradiance.relume out.png 1
expect 3 "cut.relume" "$headless" game.glb cut.relume out.png 1
expect 3 "is not the bake" "$headless" game.glb cabin.relume out.png 1
expect 2 "could not be written" "$headless" game.glb level.relume /no/such/folder/out.png 1
expect 2 "nothing.glb" "$headless" nothing.glb level.relume out.png 1
expect 5 "no Vulkan" env VK_ICD_FILENAMES=/no/driver.json VK_DRIVER_FILES=/no/driver.json "$headless" game.glb level.relume out.png 1
[ ! -e out.png ]
cd ..
rm -rf "$folder"
