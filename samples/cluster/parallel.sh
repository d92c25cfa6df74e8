#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Bake a level in shards with GNU parallel, on this machine or on several that share a folder.
#
#   samples/cluster/parallel.sh LEVEL.glb LEVEL.relume SHARDS [OPTION OF relume bake ...]
#
# HOSTS is a file of machines, as `parallel --sshloginfile` reads it ("4/name" for four shards at a time); without it all
# shards are made here. JOBS is how many at a time on each (all cores), RELUME the program. A shard that fails is tried three
# times. Run again, it makes what is missing.
set -euo pipefail
if [ $# -lt 3 ]; then
  sed -n '3,9s/^# \{0,1\}//p' "$0" >&2
  exit 1
fi
if [[ ! $3 =~ ^[1-9][0-9]{0,6}$ ]]; then
  echo "parallel.sh: SHARDS: a whole number of 1..1000000 expected, \"$3\" found" >&2
  exit 1
fi
level=$(realpath "$1")
bake=$(realpath --canonicalize-missing "$2")
shards=$3
shift 3
relume=${RELUME:-relume}
folder=$bake.shards
mkdir -p "$folder"

"$relume" bake "$level" --plan "$folder/plan.relume" --progress none "$@"
# One command a line: in a command of its own arguments parallel would replace {}, {.}, {#} of paths as well.
for ((i = 1; i <= shards; i++)); do
  printf '%q ' "$relume" bake "$level" --plan "$folder/plan.relume" --shard "$i/$shards" -o "$folder/shard-$i.relume" \
    --threads 1 --progress none
  echo
done | parallel --will-cite --halt soon,fail=1 --retries 3 ${JOBS:+--jobs "$JOBS"} ${HOSTS:+--sshloginfile "$HOSTS"}
parts=()
for ((i = 1; i <= shards; i++)); do parts+=("$folder/shard-$i.relume"); done
"$relume" merge "$folder/plan.relume" "${parts[@]}" -o "$bake" --progress none
