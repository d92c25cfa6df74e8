#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Build the libFuzzer targets (clang, ASan and UBSan) and run each for a while, as many at once as there are processors. Stops with
# an error at a crash, a leak, or an input that costs more CPU time than two loops of the shell that are timed beside it, together
# some two seconds (a bake: twenty loops), however fast the machine is; the input that did it is kept in build/fuzz/findings.
#   tests/fuzz.sh                        a minute each
#   tests/fuzz.sh --minutes N [NAME...]  N minutes each, or those targets only
#   tests/fuzz.sh --built DIR NAME...    what the build DIR has made, 10 seconds each and always from the same seed: a suite that
#                                        passes passes again; findings are in DIR/fuzz/findings
# Targets: bake_file, runtime (a bake relit and read), gltf (a scene alone in its folder), gltf_files (beside a buffer and
# an image), bake (a scene baked), voxels (a level lit without a bake), options, side_files (lights, reports).
set -euo pipefail
cd "$(dirname "$0")/.."
seconds=60
seed=0  # of libFuzzer; 0 = another one each time
built=
all=(bake_file runtime voxels gltf gltf_files bake options side_files)
names=()
known=" ${all[*]} "
while [ $# -gt 0 ]; do
  case "$1" in
    --minutes) seconds=$((60 * ${2:?--minutes needs a number})); shift 2 ;;
    --built) built="${2:?--built needs a folder}"; seconds=10; seed=1; shift 2 ;;
    *)
      [[ $known == *" $1 "* ]] || { echo "tests/fuzz.sh: unknown argument '$1' (known: --minutes N, --built DIR,${known% })" >&2; exit 1; }
      names+=("$1"); shift ;;
  esac
done
[ ${#names[@]} -gt 0 ] || names=("${all[@]}")

if [ -n "$built" ]; then
  programs=$built/tests/fuzz work=$built/fuzz
else
  cmake --preset fuzz -DRELUME_BUILD_SAMPLES=OFF
  cmake --build build/fuzz --parallel "$(nproc)" --target "${names[@]/#/fuzz_}"
  programs=build/fuzz/tests/fuzz work=build/fuzz
fi

# Seeds: tests/fuzz/seeds, the fixtures of all format versions, small scenes (of RELUME_SHARED_DIR when it is set).
seeds=$work/seeds corpus=$work/corpus findings=$work/findings
mkdir -p "$findings"
for name in "${names[@]}"; do
  [ -z "$built" ] || rm -rf "${corpus:?}/$name"
  mkdir -p "$seeds/$name" "$corpus/$name"
  [ ! -d "tests/fuzz/seeds/$name" ] || cp tests/fuzz/seeds/"$name"/* "$seeds/$name/"
  case "$name" in
    bake_file | runtime) cp tests/golden/*.relume "$seeds/$name/" ;;
    bake) cp tests/fuzz/seeds/gltf/* "$seeds/bake/" ;;
    gltf)
      if [ -d "${RELUME_SHARED_DIR:-}/scenes/conformance" ]; then
        find "$RELUME_SHARED_DIR/scenes/conformance" -name '*.gl[bt]*' -size -8k -exec cp -f {} "$seeds/gltf/" \;
      fi ;;
  esac
done

export UBSAN_OPTIONS=print_stacktrace=1
export ASAN_OPTIONS=malloc_context_size=4:quarantine_size_mb=1  # half the time goes into stacks of allocations and cold memory otherwise

# loop_ms: CPU time of a loop of the shell [ms], the measure of what an input may cost here and now.
loop_ms() {
  local time TIMEFORMAT=%3U
  time=$({ time for ((i = 0; i < 400000; ++i)); do :; done; } 2>&1)
  echo $((10#${time/[.,]/}))
}

# fuzz NAME: run one target; fails where it found something.
fuzz() {
  local name=$1 slow slow_s=1 loops=2 limit_s
  [ "$name" != bake ] || slow_s=10 loops=20
  "$programs/fuzz_$name" -seed="$seed" -max_total_time="$seconds" -timeout=600 -report_slow_units=$slow_s -rss_limit_mb=2048 \
    -max_len=8192 -entropic=0 -artifact_prefix="$findings/$name-" -print_final_stats=1 "$corpus/$name" "$seeds/$name" || return 1
  # What took long by the clock is run again: a slow or busy machine is no finding.
  for slow in "$findings/$name"-slow-unit-*; do
    [ -e "$slow" ] || continue
    limit_s=$(((loops * $(loop_ms) + 999) / 1000))
    if (ulimit -t "$limit_s" && "$programs/fuzz_$name" "$slow" >/dev/null 2>&1); then rm "$slow"; else
      echo "fuzz_$name: slow, over $limit_s s of CPU time: $slow" >&2
      return 1
    fi
  done
}

if [ ${#names[@]} -eq 1 ]; then fuzz "${names[0]}"; exit; fi
failed=0 running=0
for name in "${names[@]}"; do
  if [ "$running" -eq "$(nproc)" ]; then
    wait -n || failed=1
    running=$((running - 1))
  fi
  echo "== fuzz_$name, $seconds s: $work/$name.log"
  fuzz "$name" >"$work/$name.log" 2>&1 || { tail -n 40 "$work/$name.log" >&2; exit 1; } &
  running=$((running + 1))
done
while [ "$running" -gt 0 ]; do
  wait -n || failed=1
  running=$((running - 1))
done
exit "$failed"
