#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# build.sh OUT [LEVEL.glb ...]: the page as static files in the folder OUT, with these levels or the sample level, baked, exported and packed.
# Needs `relume` (or RELUME), emscripten, and npm for three.js. PRESET is the bake's [web]; RELUME_NPM is a package built before.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd -P)
[ $# -ge 1 ] || { echo "Usage: build.sh OUT [LEVEL.glb ...]" >&2; exit 2; }
out=$1
shift
[ $# -gt 0 ] || set -- "$here/../level/two_rooms.glb"
relume=${RELUME:-relume} three=0.187.0 package=${RELUME_NPM:-$here/../../build/wasm/npm}
for program in "$relume" npm; do
  command -v "$program" >/dev/null || { echo "$program is missing" >&2; exit 1; }
done
declare -A seen
names=()
for level in "$@"; do
  [ -f "$level" ] || { echo "$level: there is no such level" >&2; exit 1; }
  name=$(basename "${level%.*}")
  [[ $name =~ ^[A-Za-z0-9._-]+$ ]] || { echo "$level: expected a name of letters, digits, '.', '_' and '-'" >&2; exit 1; }
  [ -z "${seen[$name]:-}" ] || { echo "${seen[$name]} and $level would both be the page's level $name: rename one" >&2; exit 1; }
  seen[$name]=$level
  names+=("\"$name\"")
done
if [ ! -f "$package/wasm/relume-simd.wasm" ]; then
  (cd "$here/../.." && cmake --preset wasm && cmake --build build/wasm)
fi

mkdir -p "$out/levels" "$out/three/build" "$out/three/examples/jsm/loaders" "$out/three/examples/jsm/utils" "$out/three/examples/jsm/controls"
cp "$here/index.html" "$here/main.js" "$out/"
rm -rf "$out/relume"
cp -r "$package" "$out/relume"
temporary=$(mktemp -d)
trap 'rm -rf "$temporary"' EXIT
npm install --silent --no-save --no-audit --no-fund --prefix "$temporary" "three@$three" >/dev/null
from=$temporary/node_modules/three
cp "$from/build/three.module.js" "$from/build/three.core.js" "$out/three/build/"
for file in loaders/GLTFLoader.js controls/OrbitControls.js utils/BufferGeometryUtils.js utils/SkeletonUtils.js; do
  cp "$from/examples/jsm/$file" "$out/three/examples/jsm/$file"
done

for level in "$@"; do
  name=$(basename "${level%.*}")
  "$relume" bake "$level" -o "$temporary/$name.relume" --preset "${PRESET:-web}" --export-glb "$out/levels/$name.glb"
  "$relume" pack "$temporary/$name.relume" -o "$out/levels/$name.relume.gz" --profile web
done
(IFS=,; echo "[${names[*]}]") >"$out/levels/levels.json"
echo "$out: serve it, as by: python3 -m http.server --directory $out"
