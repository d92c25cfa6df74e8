#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Measure anew and write docs/PERFORMANCE.md. Needs a build (tests/run.sh) and some minutes of a quiet machine.
#   tests/bench/performance.sh SCENE.glb [BUILD_FOLDER]     the paper's level is Crytek Sponza
# RELUME_BENCH_BAKES: bakes of each setting [3]. RELUME_BENCH_NOTE: a sentence for the top of the page.
set -euo pipefail
cd "$(dirname "$0")/../.."
if [ $# -lt 1 ] || [ ! -f "$1" ]; then
  echo "usage: tests/bench/performance.sh SCENE.glb [BUILD_FOLDER]" >&2
  exit 1
fi
scene=$1
build=${2:-build/release}
page=docs/PERFORMANCE.md
bakes=${RELUME_BENCH_BAKES:-3}  # of each setting; the least counts
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

cmake --build "$build" --target relume bench_bake bench_link_error bench_ray_rate >&2

# 1. The paper's setting and ours, and how a bake grows
"$build/tools/cli/relume" bench "$scene" --preset paper,high,medium --bakes "$bakes" --repeat 50 --threads 1,2 --backend cpu,gl \
  --markdown "$work/page.md"
"$build/tools/cli/relume" bench "$scene" --preset draft --repeat 20 --threads 2,1 --backend cpu --curve \
  --markdown "$work/curves.md"

# 2. Four times the rays
"$build/tools/cli/relume" bench "$scene" --preset paper --rays 16384 --bakes "$bakes" --repeat 1 --threads 2 --backend cpu \
  --markdown "$work/rays.md"

# 3. Light without a bake
"$build/tools/cli/relume" bench "$scene" --live --backend cpu --bakes "$bakes" --repeat 20 --threads 1,2 --progress none --markdown "$work/live.md"

# 4. Stages one by one
RELUME_BENCH_SCENE=$scene "$build/tests/bench/bench_bake" --benchmark_min_time=0.2 --benchmark_format=csv \
  2> /dev/null > "$work/stages.csv"

# 5. Kinds of links: what each costs and errs by, against the SH of its own rays
for kind in sh cone; do
  "$build/tools/cli/relume" bake "$scene" -o "$work/$kind.relume" --preset paper --rays 1024 --link-kind "$kind" \
    --progress none > /dev/null 2>&1
done
"$build/tests/measure/bench_link_error" "$work/sh.relume" "$work/cone.relume" 3 > "$work/links.txt"

# 6. How fast rays from caches are
"$build/tests/bench/bench_ray_rate" "$scene" "$work/cone.relume" 16 > "$work/rates.txt"

# No GPU is measured here: what was found on one stands in the notes.
on_a_gpu="On a GPU, and with up to 16 threads: [OpenGL on hardware](notes/gpu.md#on-hardware). Bars there: live light without a bake in 2 ms a frame is met with one volume (0.50 ms of Sponza), missed by a tenth with two and by nine tenths with three ([cascades](notes/cascades.md#in-opengl)); cones at 1280 x 720 in 3 ms are met with one (1.9 to 2.4 ms), met or missed by a third with two, missed with three ([cones](notes/cones.md#several-volumes-on-hardware))."
{
  sed "s|^A frame is lit by|${RELUME_BENCH_NOTE:+$RELUME_BENCH_NOTE\\n\\n}$on_a_gpu\\n\\n&|" "$work/page.md"
  sed -n '/^## With the number of surfels/,$p' "$work/curves.md" | sed '1i\\'
  printf '\n## paper with 16384 rays a cache\n\n'
  sed -n '/^| stage/,/^Peak memory/p' "$work/rays.md"
  sed -n '/^## Light without a bake/,$p' "$work/live.md" | sed '1i\\'
  printf '\n## Rays from caches\n\n`bench_ray_rate`: millions of rays a second, hits and places on the triangles included, traced in packets\n'
  printf 'of 8 and as bundles, from %s (docs/notes/tracing.md).\n\n' "$(head -n 1 "$work/rates.txt")"
  grep '^|' "$work/rates.txt"
  printf '\n## Stages alone\n\nFrom `bench_bake` (google-benchmark), named stage/scene/n_S/n_C/n_L/l, on all cores.\n\n'
  printf '| stage | wall, ms | CPU, ms |\n|---|---:|---:|\n'
  sed -n '/^name,/,$p' "$work/stages.csv" | tail -n +2 |
    awk -F, '{ gsub(/"/, "", $1); sub(/\/process_time.*/, "", $1); printf "| %s | %.0f | %.0f |\n", $1, $3, $4 }'
  printf '\n## Kinds of links\n\n`bench_link_error` on this level, preset `paper` with K 1024: %s. Errors are against the SH\n' \
    "$(head -n 1 "$work/links.txt")"
  printf 'of the same rays; time is (4) light the caches, 4 bands of luma and chroma. docs/notes/links.md says what the columns mean.\n\n'
  grep '^|' "$work/links.txt"
} > "$work/all.md"
mv "$work/all.md" "$page"
echo "wrote $page"
