#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Gloss of materials against the path tracer, ball by ball: the tables and the picture of docs/notes/gloss.md.

    python3 tests/measure/gloss_row.py FOLDER [PATHS [SIZE]]        100 480x300

Runs build/release/tools/cli/relume on the level of make_gloss_row.py; FOLDER is for files, row.jpg among them.
"""
import pathlib
import subprocess
import sys

import numpy

import pictures

ROOT = pathlib.Path(__file__).resolve().parents[2]
RELUME = ROOT / "build/release/tools/cli/relume"
ROUGHNESS, METALNESS, RADIUS = [0.0, 0.2, 0.4, 0.6, 0.8, 1.0], [1.0, 0.5, 0.0], 0.32  # of make_gloss_row.py


def relume(*words):
    done = subprocess.run([RELUME, *map(str, words), "--progress", "none"], capture_output=True, text=True, check=False)
    if done.returncode:
        sys.exit(f"relume {' '.join(map(str, words))}:\n{done.stdout}{done.stderr}")


def main():
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    folder = pathlib.Path(sys.argv[1])
    paths, size = (sys.argv[2:] + ["100", "480x300"][len(sys.argv) - 2:])[:2]
    folder.mkdir(parents=True, exist_ok=True)
    level, bake = folder / "gloss_row.glb", folder / "gloss_row.relume"
    subprocess.run([sys.executable, ROOT / "tests/measure/make_gloss_row.py", level], check=True)
    relume("bake", level, "-o", bake, "--preset", "high")
    relume("reference", level, "--gloss", "--size", size, "--spp", paths, "-o", folder / "truth.exr")
    truth = pictures.read_exr(folder / "truth.exr")
    position = numpy.stack([truth["Position." + c] for c in "XYZ"], axis=2)
    noise = numpy.sqrt(sum(pictures.rgb(truth, layer) ** 2 for layer in ("GlossIndErr", "GlossDirErr")))

    shown = []
    for backend in ("cpu", "gl"):
        image = folder / f"{backend}.exr"
        relume("render", level, "--bake", bake, "--gloss", "--backend", backend, "--size", size, "-o", image)
        drawn = pictures.rgb(pictures.read_exr(image))
        shown.append(drawn)
        print(f"\n{backend}: RMSE % of the ball's mean, less the truth's noise; energy\n")
        print("| metalness | " + " | ".join(f"roughness {r:g}" for r in ROUGHNESS) + " |\n|---:|" + "---|" * 6)
        for row, metalness in enumerate(METALNESS):
            cells = []
            for column in range(len(ROUGHNESS)):
                centre = numpy.array([-2.1 + 0.84 * column, 2.35 - 0.85 * row, -0.7])
                ball = numpy.linalg.norm(position - centre, axis=2) < 1.01 * RADIUS
                error, energy = pictures.error_of(drawn, pictures.rgb(truth), ball)
                own = 100 * numpy.sqrt((noise[ball] ** 2).mean()) / pictures.rgb(truth)[ball].mean()
                cells.append(f"{max(error ** 2 - own ** 2, 0) ** 0.5:.1f}, {energy:.3f}")
            print(f"| {metalness:g} | " + " | ".join(cells) + " |")
    pictures.montage(folder / "row.jpg", [[pictures.to_srgb(p, -1)] for p in (shown[0], pictures.rgb(truth), shown[1])])


main()
