#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# formats/ and runtime/ pass the checks of .clang-tidy. Slow (minutes): part of tests/run.sh --long, not of the default
# suite. Configures build/tidy, whose compile commands have each file; exits with 77 where clang-tidy 14 is missing.
#   tests/tidy.sh [FILE.cpp ...]
set -euo pipefail
cd "$(dirname "$0")/.."
tidy=$(command -v clang-tidy-14 || command -v clang-tidy || true)
case "$("${tidy:-false}" --version 2>/dev/null || true)" in
  *"version 14."*) ;;
  *) echo "clang-tidy 14 is missing: skipped"; exit 77 ;;
esac
cmake --preset release -B build/tidy -DRELUME_FILE_BY_FILE=ON -DRELUME_BUILD_TESTS=OFF -DRELUME_BUILD_SAMPLES=OFF -DRELUME_BUILD_BAKE=OFF >/dev/null

files=("$@")
if [ "${#files[@]}" -eq 0 ]; then
  # What is not compiled here (no_gl_backend.cpp where OpenGL is) has no compile command.
  while IFS= read -r file; do
    if grep -qF "/$file\"" build/tidy/compile_commands.json; then files+=("$file"); fi
  done < <(find formats runtime -name '*.cpp' | sort)
fi
[ "${#files[@]}" -gt 0 ] || { echo "clang-tidy: no file of formats/ or runtime/ has a compile command in build/tidy" >&2; exit 1; }
# The commands are g++'s; clang does not know every warning they name, nor how g++ is to keep its memory.
printf '%s\0' "${files[@]}" |
  xargs -0 -n 1 -P "$(nproc)" "$tidy" -p build/tidy --quiet --extra-arg=-Wno-unknown-warning-option --extra-arg=-Qunused-arguments 2>/dev/null
echo "clang-tidy: ${#files[@]} files are clean"
