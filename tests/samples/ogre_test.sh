#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# samples/07_ogre on a screen that nobody sees: its light is that of `relume render`, what moves is lit and casts shadows,
# wrong input is refused. Exits with 77 where there is no Xvfb or no OpenGL for OGRE.
#   ogre_test.sh RELUME OGRE_LEVEL SOURCE FOLDER      FOLDER: of this test alone, made anew
set -euo pipefail
relume=$1 ogre=$2 source=$3 folder=$4
source "$source/tests/samples/expect.sh"
begin_on_screen "$folder"
bake_two_rooms "$source" "$relume"
game() { "$ogre" game.glb level.relume "$@" >log.txt 2>&1; }

rc=0
game --screenshot indirect.png --frames 12 --show indirect --still || rc=$?
[ "$rc" -ne 5 ] || { cat log.txt; echo "skipped"; exit 77; }
[ "$rc" -eq 0 ] || { cat log.txt; exit 1; }
game --screenshot first.png --frames 1 --show indirect --still
game --screenshot direct.png --frames 2 --show direct --still
game --screenshot moving.png --frames 6 --show indirect
game --screenshot later.png --frames 12 --show indirect
game --frames 2
"$relume" render level.glb --bake level.relume --lights sun,lamp,emissive --aov indirect,direct --exposure 0 --size 640x360 \
  --samples 1 -o truth.png --progress none >/dev/null
"$relume" diff indirect.png truth.indirect.png --json >indirect.json
"$relume" diff first.png truth.indirect.png --json >first.json
"$relume" diff direct.png truth.direct.png --json >direct.json
"$relume" diff moving.png indirect.png --json >moving.json
"$relume" diff moving.png later.png --json >step.json
python3 - <<'PYTHON'
import json

read = lambda name: json.load(open(name + ".json"))
indirect, first, direct, moving, step = read("indirect"), read("first"), read("direct"), read("moving"), read("step")
assert abs(indirect["energy"] - 1) < 0.01 and indirect["relativeRmse"] < 0.03, indirect
assert first["energy"] < 0.1, first  # light is a frame behind
assert abs(direct["energy"] - 1) < 0.01 and direct["flip"] < 0.04, direct  # edges of shadows are texels wide
assert moving["relativeRmse"] > 0.05 and abs(moving["energy"] - 1) < 0.1, moving  # what moves is lit as the room is
assert step["relativeRmse"] > 0.05, step
PYTHON

# A bake without a grid is drawn, and what is missing is said
"$relume" bake level.glb -o no_grid.relume --preset draft --grid-caches 0 --progress none 2>/dev/null
"$ogre" game.glb no_grid.relume --screenshot no_grid.png --frames 1 >log.txt 2>&1
grep -q "no_grid.relume: no grid" log.txt

cp "$source/samples/blender/cabin.glb" cabin.glb
"$relume" bake cabin.glb -o cabin.relume --preset draft --progress none 2>/dev/null
head -c 300000 level.relume >cut.relume
head -c 3000 game.glb >cut.glb
expect 1 "usage: ogre_level" "$ogre" game.glb
expect 1 "usage: ogre_level" "$ogre" game.glb level.relume --frames 0
expect 1 "usage: ogre_level" "$ogre" game.glb level.relume --show shadows
expect 3 "no light map" "$ogre" level.glb level.relume --screenshot out.png
expect 3 "is not the bake" "$ogre" game.glb cabin.relume --screenshot out.png
expect 3 "cut.relume" "$ogre" game.glb cut.relume --screenshot out.png
expect 2 "nothing.relume" "$ogre" game.glb nothing.relume --screenshot out.png
expect 2 "nothing.glb" "$ogre" nothing.glb level.relume --screenshot out.png
expect 2 "cut.glb" "$ogre" cut.glb level.relume --screenshot out.png
expect 2 "could not be written" "$ogre" game.glb level.relume --screenshot /no/such/folder/out.png --frames 1
expect 5 "OGRE: " env -u DISPLAY "$ogre" game.glb level.relume --screenshot out.png
[ ! -e out.png ]
cd ..
rm -rf "$folder"
