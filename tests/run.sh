#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Install what is missing, build, and run all tests. Works from a fresh clone on a bare Debian 12, as root or with sudo.
#   tests/run.sh            the release suite; the same under ASan and UBSan, with a short fuzzing; runtime
#                           and formats under TSan (docs/TRUST.md)
#   tests/run.sh --release  the release suite alone
#   tests/run.sh --long     all, with the long runs: full accuracy, full conformance, a million surfels; games outside, built from
#                           fetched sources and from packages; the browser's tests of three.js and of the sample page (three by
#                           npm), Blender's; programs that measure, clang-tidy; the packages on a bare Debian 12; the runtime on 64-bit ARM
set -euo pipefail
cd "$(dirname "$0")/.."
source tools/packages.sh

export RELUME_LONG_TESTS=0
sanitizers=1
long=0
for argument in "$@"; do
  case "$argument" in
    --long) export RELUME_LONG_TESTS=1; long=1 ;;
    --release) sanitizers=0 ;;
    *) echo "tests/run.sh: unknown argument '$argument' (known: --release, --long)" >&2; exit 1 ;;
  esac
done

# Two tests more than there are processors: some wait for a screen, a page or a scheduler.
at_once=$(($(nproc) + 2))
# Tests that measure at length what others walk as well; and those of bad input where the sanitizers see them
without=(--label-exclude '^long$')
if [ "$sanitizers" -eq 1 ]; then without=(--label-exclude '^(long|faults)$'); fi
if [ "$long" -eq 1 ]; then without=(); fi
step() { printf '== %s (%s s so far)\n' "$1" "$SECONDS"; }

install_packages packages.txt
if [ "$long" -eq 1 ]; then install_packages packages.txt long || echo "packages.txt: packages of the long run are missing" >&2; fi
install_packages packages.txt optional || echo "packages.txt: optional packages are missing, the tests that need them skip" >&2

step "release"
cmake --preset release -DRELUME_BUILD_TESTS=ON -DRELUME_BUILD_SAMPLES=ON -DRELUME_BUILD_BAKE=ON
end_if_configure_only
cmake --build build/release --parallel "$(nproc)"
ctest --preset release --parallel "$at_once" "${without[@]}" --no-tests=error
if [ "$long" -eq 1 ]; then
  step "benchmarks"
  cmake --build build/release --parallel "$(nproc)" --target relume_benchmarks
  step "clang-tidy"
  tests/tidy.sh || [ $? -eq 77 ]
  step "packages on a bare Debian 12"
  tests/packages_bare.sh || [ $? -eq 77 ]
  step "64-bit ARM"
  tests/aarch64.sh || [ $? -eq 77 ]
fi
[ "$sanitizers" -eq 1 ] || exit 0

# The long runs are of the release build; the sanitizers see the default suite, and without --long neither the tests that
# measure numbers nor those of the tools (labels `numbers` and `tools`).
export RELUME_LONG_TESTS=0
tests=(relume_tests)
if [ "$long" -eq 1 ]; then tests+=(relume_numbers); else without=(--label-exclude '^(numbers|tools)$'); fi
step "threads: TSan"
cmake --preset tsan -DRELUME_BUILD_TESTS=ON
cmake --build build/tsan --parallel "$(nproc)" --target "${tests[@]}"
ctest --preset tsan --parallel "$(nproc)" "${without[@]}" --no-tests=error

step "memory and undefined behaviour: ASan, UBSan"
cmake --preset dev -DRELUME_BUILD_TESTS=ON -DRELUME_BUILD_SAMPLES=OFF
cmake --build build/dev --parallel "$(nproc)" --target "${tests[@]}"
ctest --preset dev --parallel "$at_once" "${without[@]}" --no-tests=error

# The targets that import or bake levels need the whole baker built once more: they are of the long run; ten seconds of the
# others were tests above.
if [ "$long" -eq 1 ]; then
  step "fuzzing"
  tests/fuzz.sh --minutes 1
fi
step "done"
