#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""A sky and its sun at an hour of a day, as an equirectangular Radiance HDR file for --sky-map and a list of lights for
--lights-file. The sun rises at 6 in the east (+X), is 40 degrees high in the south (-Z) at noon, and sets at 18.
Colours and brightness are made up to look like a clear day; the air that sunlight crosses reddens it (Kasten and
Young 1989). Needs nothing but Python.

    make_sky.py HOUR OUTPUT.hdr OUTPUT.json
"""
import json
import math
import pathlib
import sys

WIDTH, HEIGHT = 128, 64
HIGHEST = math.radians(40.0)
DEPTH = (0.08, 0.16, 0.32)  # of the air overhead, in red, green and blue
SUN, HAZE = 14.0, 1.4  # [W/m²] of the sun overhead without air, [W/m²/sr] of the sky around it


def sun_at(hour):
    """Unit vector toward the sun."""
    turn = (hour - 6.0) / 12.0 * math.pi
    height = math.sin(turn) * HIGHEST
    return (math.cos(turn) * math.cos(height), math.sin(height), -math.sin(turn) * math.cos(height))


def through_air(height):
    """Share of the sun's light that is left at a height above the horizon [rad]; none below it."""
    degrees = math.degrees(height)
    if degrees < -1.0:
        return (0.0, 0.0, 0.0)
    mass = 1.0 / (math.sin(max(height, 0.0)) + 0.50572 * (max(degrees, 0.0) + 6.07995) ** -1.6364)
    dusk = min(1.0, 1.0 + degrees)  # half of it is below the horizon
    return tuple(dusk * math.exp(-d * mass) for d in DEPTH)


def radiance(direction, sun):
    """Of the sky without the sun's disc."""
    height = math.asin(sun[1])
    light = through_air(height)
    day = 1.0 / (1.0 + math.exp(-math.degrees(height) / 4.0))  # twilight on both sides of the horizon
    if direction[1] < 0.0:
        return tuple(0.01 + 0.25 * day * c for c in (0.5, 0.45, 0.4))
    angle = math.acos(max(-1.0, min(1.0, sum(a * b for a, b in zip(direction, sun)))))
    low = (1.0 - direction[1]) ** 4  # near the horizon
    glow = math.exp(-3.0 * angle) + low * math.exp(-1.2 * angle)
    blue = (0.22 + 0.5 * low, 0.42 + 0.45 * low, 1.0)
    night = (0.006, 0.009, 0.02)
    # At dusk the glow is the light that went through most air.
    warm = light if height > 0.0 else tuple(day * math.exp(-8.0 * d) for d in DEPTH)
    return tuple(n + 0.9 * day * day * b + HAZE * day * glow * w for n, b, w in zip(night, blue, warm))


def rgbe(color):
    """Radiance's shared exponent."""
    brightest = max(color)
    if brightest < 1e-32:
        return bytes(4)
    fraction, exponent = math.frexp(brightest)
    scale = fraction * 256.0 / brightest
    return bytes(min(255, int(c * scale)) for c in color) + bytes([exponent + 128])


def main(hour, picture, lights):
    sun = sun_at(hour)
    texels = bytearray()
    for y in range(HEIGHT):
        polar = math.pi * (y + 0.5) / HEIGHT
        for x in range(WIDTH):  # the middle of a row is -Z, columns turn toward +X
            azimuth = 2.0 * math.pi * ((x + 0.5) / WIDTH - 0.5)
            texels += rgbe(radiance((math.sin(polar) * math.sin(azimuth), math.cos(polar),
                                     -math.sin(polar) * math.cos(azimuth)), sun))
    header = f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {HEIGHT} +X {WIDTH}\n"
    pathlib.Path(picture).write_bytes(header.encode() + bytes(texels))
    light = through_air(math.asin(sun[1]))
    listed = []
    if max(light) > 0.0:
        listed.append({"type": "directional", "name": "sun", "direction": [-c for c in sun],
                       "color": [round(c / max(light), 4) for c in light], "intensity": round(SUN * max(light), 4)})
    pathlib.Path(lights).write_text(json.dumps(listed) + "\n")


if __name__ == "__main__":
    if len(sys.argv) != 4:
        sys.exit(__doc__)
    main(float(sys.argv[1]), sys.argv[2], sys.argv[3])
