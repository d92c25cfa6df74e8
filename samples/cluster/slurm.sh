#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Bake a level on a Slurm cluster: a job that plans, an array job of shards, a job that merges them.
#
#   samples/cluster/slurm.sh LEVEL.glb LEVEL.relume SHARDS [OPTION OF relume bake ...]
#
# The level and the folder LEVEL.relume.shards, which is made, are on storage that all nodes share. Returns when the bake is
# there, or with the status of the job that failed. Run again, it makes what is missing: shards that are there stay.
#
# RELUME is the program, if `relume` is not on the nodes' PATH; RELUME_CPUS the processors of a shard (1). What Slurm itself
# is to be told stands in variables that sbatch reads: SBATCH_PARTITION, SBATCH_ACCOUNT, SBATCH_TIMELIMIT, ...
set -euo pipefail
if [ $# -lt 3 ]; then
  sed -n '3,12s/^# \{0,1\}//p' "$0" >&2
  exit 1
fi
if [[ ! $3 =~ ^[1-9][0-9]{0,6}$ ]]; then
  echo "slurm.sh: SHARDS: a whole number of 1..1000000 expected, \"$3\" found" >&2
  exit 1
fi
level=$(realpath "$1")
bake=$(realpath --canonicalize-missing "$2")
shards=$3
shift 3
job=$(realpath "$(dirname "$0")/slurm_job.sh")
folder=$bake.shards
mkdir -p "$folder"
rm -f "$folder"/*.log  # of a run before

# --requeue: a job whose node dies, or that is preempted, starts again on another one.
submit() {
  local name=$1 log=$2
  shift 2
  sbatch --parsable --requeue --open-mode=append --job-name="relume-$name" --output="$folder/$log.log" \
    --cpus-per-task="${RELUME_CPUS:-1}" "$@"
}
plan=$(submit plan plan "$job" plan "$level" "$bake" "$shards" "$@")
array=$(submit shard shard-%a --array="1-$shards" --dependency="afterok:${plan%%;*}" --kill-on-invalid-dep=yes \
  "$job" shard "$level" "$bake" "$shards")
echo "plan: job ${plan%%;*}; $shards shards: job ${array%%;*}; logs: $folder/*.log"
# Wait for the last job. It is cancelled when a shard fails: then it has no log, and Slurm calls it well ended.
status=0
submit merge merge --dependency="afterok:${array%%;*}" --kill-on-invalid-dep=yes --wait \
  "$job" merge "$level" "$bake" "$shards" >/dev/null || status=$?
if [ "$status" = 0 ] && [ -f "$folder/merge.log" ]; then
  tail -n 1 "$folder/merge.log"
  exit 0
fi
echo "not baked; the logs say why:" >&2
grep -H "error" "$folder"/*.log >&2 || ls "$folder"/*.log >&2
exit "$((status > 0 ? status : 4))"
