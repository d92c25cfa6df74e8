#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# samples/08_godot on a screen that nobody sees: its light is that of `relume render`, what moves is lit and casts shadows,
# wrong input is refused, a server that dies is missed. Exits with 77 where there is no Xvfb, no Godot or no OpenGL ES 3.0.
#   godot_test.sh RELUME RELIGHT_SERVER SOURCE FOLDER      FOLDER: of this test alone, made anew
set -euo pipefail
relume=$1 source=$3 folder=$4
export RELIGHT_SERVER=$2 HOME=$folder XDG_DATA_HOME=$folder XDG_CONFIG_HOME=$folder XDG_CACHE_HOME=$folder
godot=$(command -v godot3-runner || command -v godot3 || true)
[ -n "$godot" ] || { echo "Godot 3 is missing: skipped"; exit 77; }
project=$source/samples/08_godot
source "$source/tests/samples/expect.sh"
begin_on_screen "$folder"
bake_two_rooms "$source" "$relume"
game() { "$project/play.sh" game.glb level.relume "$@" >log.txt 2>&1; }

rc=0
game --screenshot=indirect.png --frames=12 --show=indirect --still || rc=$?
grep -q "OpenGL ES 3.0 Renderer" log.txt || { cat log.txt; echo "skipped"; exit 77; }
[ "$rc" -eq 0 ] || { cat log.txt; exit 1; }
! grep "SCRIPT ERROR\|SHADER ERROR" log.txt
game --screenshot=direct.png --frames=1 --show=direct --still
game --screenshot=moving.png --frames=10 --show=indirect
"$relume" render level.glb --bake level.relume --lights sun,lamp,emissive --aov indirect,direct --exposure 0 --size 640x360 \
  --samples 1 -o truth.png --progress none >/dev/null
"$relume" diff indirect.png truth.indirect.png --json >indirect.json
"$relume" diff direct.png truth.direct.png --json >direct.json
"$relume" diff moving.png indirect.png --json >moving.json
python3 - <<'PYTHON'
import json

read = lambda name: json.load(open(name + ".json"))
indirect, direct, moving = read("indirect"), read("direct"), read("moving")
assert abs(indirect["energy"] - 1) < 0.02 and indirect["relativeRmse"] < 0.05, indirect
assert abs(direct["energy"] - 1) < 0.03 and direct["flip"] < 0.06, direct  # Godot's shadows are soft and biased
assert moving["relativeRmse"] > 0.05 and abs(moving["energy"] - 1) < 0.1, moving  # what moves is lit as the room is
PYTHON

# What a node mirrors, bends or scales, and which camera is taken
python3 "$source/tests/samples/odd_level.py" level.glb odd.glb
"$relume" bake odd.glb -o odd.relume --preset draft --export-glb odd_game.glb --progress none 2>/dev/null
"$project/play.sh" odd_game.glb odd.relume --screenshot=odd.png --frames=12 --show=indirect --still >log.txt 2>&1
! grep "SCRIPT ERROR" log.txt
"$relume" render odd.glb --bake odd.relume --camera cam_living --lights sun,lamp,emissive --aov indirect --exposure 0 \
  --size 640x360 --samples 1 -o odd_truth.png --progress none >/dev/null
"$relume" diff odd.png odd_truth.png --max-rmse 0.05

sed 's/\("sceneHash": *"\)./\1-/' game.glb >other.glb
python3 - "$source/tests/measure" <<'PYTHON'
import sys

sys.path.insert(0, sys.argv[1])
import glb

level, binary = glb.read("game.glb")
glb.write("draco.glb", {**level, "extensionsRequired": ["KHR_draco_mesh_compression"]}, binary)
PYTHON
head -c 300000 level.relume >cut.relume
head -c 3000 game.glb >cut.glb
play() { "$project/play.sh" "$@" 2>&1 >out.txt | tee -a out.txt >&2; }
expect 1 "usage: relight_server" "$RELIGHT_SERVER"
expect 1 "usage: play.sh" "$project/play.sh" game.glb
expect 1 "usage: --level" play game.glb level.relume --frame=3
expect 3 "cut.relume" play game.glb cut.relume --screenshot=out.png
expect 2 "nothing.relume" play game.glb nothing.relume --screenshot=out.png
expect 3 "is not the one" play other.glb level.relume --screenshot=out.png --frames=1
expect 3 "no light map" play level.glb level.relume --screenshot=out.png --frames=1
expect 3 "no whole binary glTF" play cut.glb level.relume --screenshot=out.png --frames=1
expect 5 "requires the extension KHR_draco_mesh_compression" play draco.glb level.relume --screenshot=out.png --frames=1
expect 2 "nothing.glb cannot be read" play nothing.glb level.relume --screenshot=out.png --frames=1
expect 2 "could not be written" play game.glb level.relume --screenshot=/no/such/folder/out.png --frames=1
expect 5 "OpenGL ES 3.0 is needed" play game.glb level.relume --screenshot=out.png --frames=1 --video-driver GLES2
expect 4 "no relight_server" "$godot" --path "$project" --level="$PWD/game.glb" --port=1

# A bake without a grid is served, and what is missing is said
"$relume" bake level.glb -o no_grid.relume --preset draft --grid-caches 0 --progress none 2>/dev/null
"$RELIGHT_SERVER" no_grid.relume >unused_port.txt 2>log.txt &
server=$!
until [ -s unused_port.txt ]; do sleep 0.1; done
kill "$server"
grep -q "no_grid.relume: no grid" log.txt

# A server that dies while the game runs
"$RELIGHT_SERVER" level.relume >port.txt &
server=$!
until [ -s port.txt ]; do sleep 0.1; done
(sleep 2; kill -KILL "$server") &
expect 4 "relight_server is gone" "$godot" --path "$project" --audio-driver Dummy --level="$PWD/game.glb" --port="$(cat port.txt)" --frames=100000
[ ! -e out.png ]
cd ..
rm -rf "$folder"
