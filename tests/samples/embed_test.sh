#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# samples/04_embed on a screen that nobody sees: its light is that of `relume render`, its character walks, wrong input
# is refused. Exits with 77 where there is no Xvfb or no OpenGL 4.5.
#   embed_test.sh RELUME EMBED SOURCE FOLDER      FOLDER: of this test alone, made anew
set -euo pipefail
relume=$1 embed=$2 source=$3 folder=$4
source "$source/tests/samples/expect.sh"
begin_on_screen "$folder"
lines=$(cat "$source"/samples/04_embed/* | wc -l)
[ "$lines" -lt 600 ] || { echo "a sample to copy has under 600 lines, this one $lines"; exit 1; }
bake_two_rooms "$source" "$relume"
game() { "$embed" game.glb level.relume "$@" 2>log.txt; }

rc=0
game indirect.png 12 indirect still || rc=$?
[ "$rc" -ne 5 ] || { cat log.txt; echo "skipped"; exit 77; }
[ "$rc" -eq 0 ] || { cat log.txt; exit 1; }
game direct.png 2 direct still
game walk.png 12
game walk2.png 24
game still.png 12 all still
"$relume" render level.glb --bake level.relume --lights sun,lamp,emissive --aov indirect,direct --exposure 0 --size 960x540 \
  --samples 1 -o truth.png --progress none >/dev/null

# Edges of shadow maps are texels wide, so that direct light differs there.
"$relume" diff indirect.png truth.indirect.png --json >indirect.json
"$relume" diff direct.png truth.direct.png --json >direct.json
"$relume" diff walk.png still.png --json >walk.json
"$relume" diff walk.png walk2.png --json >step.json
python3 - <<'PYTHON'
import json

read = lambda name: json.load(open(name + ".json"))
indirect, direct, walk, step = read("indirect"), read("direct"), read("walk"), read("step")
assert abs(indirect["energy"] - 1) < 0.01 and indirect["relativeRmse"] < 0.03, indirect
assert abs(direct["energy"] - 1) < 0.01 and direct["flip"] < 0.04, direct
assert walk["relativeRmse"] > 0.05 and step["relativeRmse"] > 0.05, (walk, step)
PYTHON

# A bake without a grid is drawn, and what is missing is said
"$relume" bake level.glb -o no_grid.relume --preset draft --grid-caches 0 --progress none 2>/dev/null
"$embed" game.glb no_grid.relume no_grid.png 1 2>log.txt
grep -q "no_grid.relume: no grid" log.txt

cp "$source/samples/blender/cabin.glb" cabin.glb
"$relume" bake cabin.glb -o cabin.relume --preset draft --progress none
expect 1 "usage: embed" "$embed" game.glb level.relume out.png 0
expect 3 "no light map" "$embed" level.glb level.relume out.png 1
expect 3 "is not the bake" "$embed" game.glb cabin.relume out.png 1
expect 2 "could not be written" "$embed" game.glb level.relume /no/such/folder/out.png 1
expect 2 "nothing.glb" "$embed" nothing.glb level.relume out.png 1
head -c 3000 game.glb >cut.glb
expect 2 "cut.glb" "$embed" cut.glb level.relume out.png 1
cd ..
rm -rf "$folder"
