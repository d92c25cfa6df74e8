#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Draw what the screen of samples/area_lights shows in a frame of film.sh, as a PNG: an asterisk that turns, and bars
that run from left to right. Needs nothing but Python.

    draw_signs.py screen FRAME FRAMES OUTPUT.png
"""
import math
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
from strip import write_png  # noqa: E402

WIDTH, HEIGHT = 72, 40  # [pixels]


def screen(frame, frames, path):
    turn = 2.0 * math.pi * frame / frames
    pixels = bytearray()
    for y in range(HEIGHT):
        for x in range(WIDTH):
            u, v = (x + 0.5) / HEIGHT, (y + 0.5) / HEIGHT  # equal steps along both axes
            color = (6, 8, 20)
            dx, dy = u - 0.45, v - 0.5
            radius, angle = math.hypot(dx, dy), math.atan2(dy, dx) + turn
            across = radius * abs(math.sin((angle + math.pi / 6) % (math.pi / 3) - math.pi / 6))
            if radius < 0.38 and across < 0.055:
                color = (255, 120, 40)
            if u > 0.95 and (u - 0.95 - 0.85 * frame / frames) % 0.28 < 0.12:
                color = (60, 170, 255)
            pixels += bytes(color)
    write_png(path, WIDTH, HEIGHT, bytes(pixels))


if __name__ == "__main__":
    if sys.argv[1:2] == ["screen"] and len(sys.argv) == 5:
        screen(int(sys.argv[2]), int(sys.argv[3]), sys.argv[4])
    else:
        sys.exit(__doc__)
