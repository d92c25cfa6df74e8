#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# addon_test.sh TEST.py ADDON.zip RELUME WORK: the test in Blender, with a folder of scripts and settings of its own. Exits with 77 where
# Blender is missing.
set -euo pipefail
command -v blender >/dev/null || { echo "blender is missing (Debian: blender): skipped"; exit 77; }
rm -rf "$4"
mkdir -p "$4/scripts/addons" "$4/config" "$4/files"
export BLENDER_USER_SCRIPTS=$4/scripts BLENDER_USER_CONFIG=$4/config PYTHONDONTWRITEBYTECODE=1
export PATH=/usr/bin:$PATH  # Debian's Blender takes the first python3
blender -b --factory-startup --python "$(dirname "$0")/$1" -- "$2" "$3" "$4/files"
