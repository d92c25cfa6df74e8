#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Install what is missing, build, and run all tests. Works from a fresh clone on a bare Debian 12, as root or with sudo.
#   tests/run.sh            the default suite (under 15 minutes on 2 cores)
#   tests/run.sh --long     and the long runs: full accuracy, full conformance, a million surfels
set -euo pipefail
cd "$(dirname "$0")/.."
source samples/common/setup.sh

export RELUME_LONG_TESTS=0
for argument in "$@"; do
  case "$argument" in
    --long) export RELUME_LONG_TESTS=1 ;;
    *) echo "tests/run.sh: unknown argument '$argument' (known: --long)" >&2; exit 1 ;;
  esac
done

install_packages packages.txt
cmake --preset release
cmake --build build/release --parallel "$(nproc)"
ctest --test-dir build/release --output-on-failure --no-tests=error
