#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Remake the fixtures of the current format version. Only when that version has not been released yet, or for a new
# version: fixtures of released versions are kept and loaded (or refused by name) forever.
#   tests/golden/remake.sh BUILD_FOLDER
set -euo pipefail
cd "$(dirname "$0")/../.."
build="${1:?usage: tests/golden/remake.sh BUILD_FOLDER}"
cmake --build "$build" --target make_fixture
"$build/tests/golden/make_fixture" tests/golden
ls -l tests/golden/*.relume
