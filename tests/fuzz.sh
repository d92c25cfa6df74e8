#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Build the libFuzzer targets and run each for a while. Stops with an error at the first crash, hang or leak; the input
# that did it is kept in build/fuzz/findings.
#   tests/fuzz.sh                     a minute each
#   tests/fuzz.sh --minutes N [NAME]  N minutes each, or that target only (bake_file, gltf, options)
set -euo pipefail
cd "$(dirname "$0")/.."
minutes=1
names=(bake_file gltf options)
while [ $# -gt 0 ]; do
  case "$1" in
    --minutes) minutes="${2:?--minutes needs a number}"; shift 2 ;;
    bake_file|gltf|options) names=("$1"); shift ;;
    *) echo "tests/fuzz.sh: unknown argument '$1' (known: --minutes N, bake_file, gltf, options)" >&2; exit 1 ;;
  esac
done

cmake --preset fuzz
cmake --build build/fuzz --parallel "$(nproc)" --target "${names[@]/#/fuzz_}"

# Seeds: the fixtures (with the byte that asks for checksums to be made to fit), options, small scenes (also of RELUME_SHARED_DIR when
# it is set).
corpus=build/fuzz/corpus
mkdir -p "$corpus"/{bake_file,gltf,options} build/fuzz/findings
for fixture in tests/golden/*.relume; do
  { printf '\1'; cat "$fixture"; } > "$corpus/bake_file/$(basename "$fixture")"
done
cp tests/fuzz/seeds/*.json "$corpus/options/"
find samples tests/fuzz/seeds "${RELUME_SHARED_DIR:-/nonexistent}/scenes/conformance" -name '*.gl[bt]*' -size -64k -exec cp -t "$corpus/gltf" {} + 2>/dev/null || true

export UBSAN_OPTIONS=halt_on_error=1:print_stacktrace=1
for name in "${names[@]}"; do
  echo "== fuzz_$name, $minutes min"
  "build/fuzz/tests/fuzz/fuzz_$name" -max_total_time=$((minutes * 60)) -timeout=1 -rss_limit_mb=2048 -max_len=65536 \
    -artifact_prefix="build/fuzz/findings/$name-" -print_final_stats=1 "$corpus/$name"
done
