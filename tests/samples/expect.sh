# SPDX-License-Identifier: MIT
# Sourced by tests of samples, in a folder of their own.

expect() { # STATUS WORDS COMMAND...: the command exits with STATUS and says WORDS
  local status=$1 words=$2 rc=0
  shift 2
  "$@" 2>log.txt >/dev/null || rc=$?
  [ "$rc" -eq "$status" ] && grep -q "$words" log.txt || { echo "$*: exit $rc, expected $status and '$words':"; cat log.txt; exit 1; }
}
