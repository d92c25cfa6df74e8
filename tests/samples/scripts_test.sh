#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# samples/demo.sh and tests/run.sh in one clone, in either order and twice, up to the configured build: the tests are there
# after each, also where an earlier version of the demo has left them out.
#   scripts_test.sh SOURCE FOLDER      FOLDER: of this test alone, made anew
set -euo pipefail
source=$1 folder=$2
git -C "$source" rev-parse --git-dir >/dev/null 2>&1 || { echo "not a git checkout: nothing to clone"; exit 77; }
rm -rf "$folder"
mkdir -p "$folder/clone" "$folder/bin"

# The working tree as it is; no package is installed by a test.
(cd "$source" && git ls-files -z --cached --others --exclude-standard | while IFS= read -r -d '' file; do
  [ ! -f "$file" ] || printf '%s\0' "$file"
done | xargs -0 cp --parents -t "$folder/clone")
printf '#!/bin/sh\necho "install ok installed"\n' >"$folder/bin/dpkg-query"
chmod +x "$folder/bin/dpkg-query"
export PATH="$folder/bin:$PATH" RELUME_CONFIGURE_ONLY=1
cd "$folder/clone"

expect_tests() {
  local count
  count=$(ctest --test-dir build/release -N | sed -n 's/^Total Tests: //p')
  [ "${count:-0}" -gt 20 ] || { echo "after $1: ${count:-no} tests"; exit 1; }
  echo "after $1: $count tests"
}
cmake --preset release -DRELUME_BUILD_TESTS=OFF -DRELUME_BUILD_SAMPLES=OFF >/dev/null
tests/run.sh --release >/dev/null
expect_tests "tests/run.sh on a build without tests"
rm -rf build
for round in 1 2; do
  (cd "$folder" && clone/samples/demo.sh pictures >/dev/null)
  [ -f "$folder/pictures/build.log" ] || { echo "samples/demo.sh: no folder \"pictures\" where it was called"; exit 1; }
  expect_tests "samples/demo.sh, round $round"
  tests/run.sh --release >/dev/null
  expect_tests "tests/run.sh, round $round"
done
rm -rf "$folder"
