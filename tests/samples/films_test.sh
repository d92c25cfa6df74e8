#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# The films of samples/ at a few pixels: each frame is lit, no two are the same, and the strip holds them all. Paths are
# those of the folder that the films are called in.
#   films_test.sh RELUME SOURCE FOLDER      FOLDER: of this test alone, made anew
set -euo pipefail
source=$2 folder=$3
rm -rf "$folder"
mkdir -p "$folder"
cd "$folder"
RELUME=$(realpath --relative-to=. "$1")
export RELUME
export PYTHONDONTWRITEBYTECODE=1
"$source/samples/day/film.sh" day draft 48x30 "6.5 12 17 20" >/dev/null
"$source/samples/area_lights/film.sh" lights draft 48x30 >/dev/null
python3 - "$source/samples" "$folder" <<'PYTHON'
import pathlib
import sys

sys.path.insert(0, sys.argv[1])
from strip import read_png

for film, count in (("day", 4), ("lights", 8)):
    frames = sorted(pathlib.Path(sys.argv[2], film).glob("frame_*.png"))
    assert len(frames) == count, f"{film}: {len(frames)} frames"
    pictures = [read_png(frame) for frame in frames]
    seen = set()
    for frame, (width, height, rows) in zip(frames, pictures):
        pixels = b"".join(rows)
        mean = sum(pixels) / len(pixels)
        assert (width, height) == (48, 30) and 8 < mean < 230, f"{frame}: {width} x {height}, mean {mean}"
        assert pixels not in seen, f"{frame} is one of the others"
        seen.add(pixels)
    width, height, rows = read_png(pathlib.Path(sys.argv[2], film, "strip.png"))
    assert (width, height) == (4 * 48, 30 * ((count + 3) // 4)), f"{film}: strip of {width} x {height}"
    assert rows[0][:3 * 48] == pictures[0][2][0] and rows[-1][-3 * 48:] == pictures[-1][2][-1]
PYTHON
cd ..
rm -rf "$folder"
