#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# addon_test.sh ADDON.zip RELUME WORK: addon_test.py in Blender, with a folder of scripts and settings of its own. Exits with 77 where
# Blender is missing.
set -euo pipefail
command -v blender >/dev/null || { echo "blender is missing (Debian: blender): skipped"; exit 77; }
rm -rf "$3"
mkdir -p "$3/scripts/addons" "$3/config" "$3/files"
export BLENDER_USER_SCRIPTS=$3/scripts BLENDER_USER_CONFIG=$3/config
export PATH=/usr/bin:$PATH  # Debian's Blender takes the first python3
blender -b --factory-startup --python "$(dirname "$0")/addon_test.py" -- "$1" "$2" "$3/files"
