#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# build.sh SOURCE BUILD: the npm package by CMake's preset `wasm`, in the folder BUILD. Exits with 77 where emscripten is missing.
set -euo pipefail
command -v emcc >/dev/null || { echo "emcc is missing (Debian: emscripten): skipped"; exit 77; }
cmake -S "$1" -B "$2" --preset wasm
cmake --build "$2" --parallel "$(nproc)"
