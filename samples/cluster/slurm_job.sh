#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# One job of slurm.sh: slurm_job.sh plan|shard|merge LEVEL BAKE SHARDS [OPTION ...]
# Files are written under another name and renamed: what has its name is whole, however often a job is killed and run again.
set -euo pipefail
what=$1 level=$2 bake=$3 shards=$4
shift 4
relume=${RELUME:-relume}
folder=$bake.shards
limits=(--threads "${SLURM_CPUS_PER_TASK:-1}" --progress plain)
case $what in
  plan) "$relume" bake "$level" --plan "$folder/plan.relume" "${limits[@]}" "$@" ;;
  shard)
    "$relume" bake "$level" --plan "$folder/plan.relume" --shard "$SLURM_ARRAY_TASK_ID/$shards" \
      -o "$folder/shard-$SLURM_ARRAY_TASK_ID.relume" "${limits[@]}"
    ;;
  merge)
    parts=()
    for ((i = 1; i <= shards; i++)); do parts+=("$folder/shard-$i.relume"); done
    "$relume" merge "$folder/plan.relume" "${parts[@]}" -o "$bake" --progress plain
    ;;
esac
