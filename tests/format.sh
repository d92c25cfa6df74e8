#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# All C++ files are laid out as .clang-format says. Exits with 77 where the clang-format that decides, 14, is missing.
set -euo pipefail
cd "$(dirname "$0")/.."
format=$(command -v clang-format-14 || command -v clang-format || true)
case "$("${format:-false}" --version 2>/dev/null || true)" in
  *" 14."*) ;;
  *) echo "clang-format 14 is missing: skipped"; exit 77 ;;
esac
find bake bindings formats include runtime samples simd tests tools shaders -name build -prune -o \( -name '*.cpp' -o -name '*.c' -o -name '*.h' \) -print0 |
  xargs -0 "$format" --dry-run -Werror
