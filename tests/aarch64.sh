#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# The runtime on 64-bit ARM: formats/, runtime/ and their tests, cross-compiled by Debian's g++-aarch64-linux-gnu and run by
# qemu-user. Minutes: part of tests/run.sh --long. Exits with 77 where either is missing.
set -euo pipefail
cd "$(dirname "$0")/.."
for program in aarch64-linux-gnu-g++ qemu-aarch64; do
  command -v "$program" >/dev/null || { echo "$program is missing: skipped"; exit 77; }
done
[ -d /usr/src/googletest ] || { echo "/usr/src/googletest (libgtest-dev) is missing: skipped"; exit 77; }
cmake --preset aarch64 -DRELUME_BUILD_TESTS=ON
cmake --build build/aarch64 --parallel "$(nproc)"
ctest --preset aarch64 --parallel "$(nproc)" --no-tests=error
