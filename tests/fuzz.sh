#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Build the libFuzzer targets (clang, ASan and UBSan) and run each for a while. Stops with an error at the first crash, leak,
# or input that costs more than a second of CPU time (a bake: ten); the input that did it is kept in build/fuzz/findings.
#   tests/fuzz.sh                        a minute each
#   tests/fuzz.sh --minutes N [NAME...]  N minutes each, or those targets only
#   tests/fuzz.sh --seconds N [NAME...]  N seconds, always from the same seed: a suite that passes passes again
# Targets: bake_file, runtime (a bake relit and read), gltf (a scene alone in its folder), gltf_files (beside a buffer and
# an image), bake (a scene baked), voxels (a level lit without a bake), options, side_files (lights, reports).
set -euo pipefail
cd "$(dirname "$0")/.."
seconds=60
seed=0  # of libFuzzer; 0 = another one each time
flags=()  # short runs: the build is most of their time
all=(bake_file runtime voxels gltf gltf_files bake options side_files)
names=()
known=" ${all[*]} "
while [ $# -gt 0 ]; do
  case "$1" in
    --minutes) seconds=$((60 * ${2:?--minutes needs a number})); shift 2 ;;
    --seconds) seconds="${2:?--seconds needs a number}"; seed=1; flags=(-DCMAKE_CXX_FLAGS_RELWITHDEBINFO="-O1 -DNDEBUG -gline-tables-only"); shift 2 ;;
    *)
      [[ $known == *" $1 "* ]] || { echo "tests/fuzz.sh: unknown argument '$1' (known: --minutes N, --seconds N,${known% })" >&2; exit 1; }
      names+=("$1"); shift ;;
  esac
done
[ ${#names[@]} -gt 0 ] || names=("${all[@]}")

cmake --preset fuzz -DRELUME_BUILD_SAMPLES=OFF "${flags[@]}"
cmake --build build/fuzz --parallel "$(nproc)" --target "${names[@]/#/fuzz_}"

# Seeds: tests/fuzz/seeds, the fixtures of all format versions, small scenes (of RELUME_SHARED_DIR when it is set).
seeds=build/fuzz/seeds corpus=build/fuzz/corpus findings=build/fuzz/findings
for name in "${names[@]}"; do
  mkdir -p "$seeds/$name" "$corpus/$name" "$findings"
  [ ! -d "tests/fuzz/seeds/$name" ] || cp tests/fuzz/seeds/"$name"/* "$seeds/$name/"
done
for name in bake_file runtime; do
  [ ! -d "$seeds/$name" ] || cp tests/golden/*.relume "$seeds/$name/"
done
[ ! -d "$seeds/bake" ] || cp tests/fuzz/seeds/gltf/* "$seeds/bake/"
if [ -d "$seeds/gltf" ] && [ -d "${RELUME_SHARED_DIR:-}/scenes/conformance" ]; then
  find "$RELUME_SHARED_DIR/scenes/conformance" -name '*.gl[bt]*' -size -8k -exec cp -f {} "$seeds/gltf/" \;
fi

export UBSAN_OPTIONS=print_stacktrace=1
export ASAN_OPTIONS=malloc_context_size=4:quarantine_size_mb=1  # half the time goes into stacks of allocations and cold memory otherwise
failed=0
for name in "${names[@]}"; do
  slow_s=1
  [ "$name" != bake ] || slow_s=10
  echo "== fuzz_$name, $seconds s"
  "build/fuzz/tests/fuzz/fuzz_$name" -seed="$seed" -max_total_time="$seconds" -timeout=60 -report_slow_units=$slow_s -rss_limit_mb=2048 \
    -max_len=8192 -entropic=0 -artifact_prefix="$findings/$name-" -print_final_stats=1 "$corpus/$name" "$seeds/$name"
  # What took longer by the clock must not have: again, by CPU time.
  for slow in "$findings/$name"-slow-unit-*; do
    [ -e "$slow" ] || continue
    if (ulimit -t $((2 * slow_s)) && "build/fuzz/tests/fuzz/fuzz_$name" "$slow" >/dev/null 2>&1); then rm "$slow"; else
      echo "fuzz_$name: slow: $slow" >&2
      failed=1
    fi
  done
done
exit "$failed"
