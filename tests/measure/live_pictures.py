#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Sponza in the sun and by its torch, side by side: direct light alone | CRC as printed | live light | PIC | path traced.

    python3 tests/measure/live_pictures.py FOLDER

Writes FOLDER/live_row.jpg, the picture of docs/notes/live.md, and prints the error of each picture's indirect light
against the Cycles references in RELUME_SHARED_DIR. Runs build/release/tools/cli/relume, or the program that RELUME names.
"""
import os
import pathlib
import subprocess
import sys

import numpy
import pictures

ROOT = pathlib.Path(__file__).resolve().parents[2]
RELUME = pathlib.Path(os.environ.get("RELUME", ROOT / "build/release/tools/cli/relume"))
SHARED = pathlib.Path(os.environ.get("RELUME_SHARED_DIR", ""))
LEVEL = SHARED / "scenes/sponza/sponza.glb"
VIEWS = (("cam_atrium", "sun", 2.0), ("cam_arcade", "torch", 1.0))  # camera, light, exposure [stops]
LIVE = ("--live",)
RSM = ("--live", "--live-transport", "rsm", "--bands", "Y3Co3Cg3", "--rsm-frames", "32")


def run(*words):
    made = subprocess.run([RELUME, *map(str, words)], capture_output=True, text=True, check=False)
    if made.returncode != 0:
        sys.exit(f"{' '.join(map(str, words))}: {made.stderr}")


def draw(folder, camera, light, size, *how):
    """Layers `full` and `indirect` of a view."""
    run("render", LEVEL, "--camera", camera, "--lights", light, "--size", f"{size[0]}x{size[1]}", "--samples", 2, "--aov",
        "full,indirect", "--force", "--progress", "none", "-o", folder / "out.exr", *how)
    return [pictures.rgb(pictures.read_exr(folder / f"out.{layer}.exr")) for layer in ("full", "indirect")]


def main():
    if len(sys.argv) != 2 or not LEVEL.is_file():
        sys.exit(__doc__)
    folder = pathlib.Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    bake = folder / "sponza.relume"
    if not bake.is_file():
        run("bake", LEVEL, "-o", bake, "--preset", "medium", "--progress", "none")
    rows = []
    print("| view | picture | relative RMSE % | energy |\n|---|---|---:|---:|")
    for camera, light, stops in VIEWS:
        truth = pictures.read_exr(SHARED / "references/sponza" / f"{camera}__{light}.exr")
        reference = pictures.rgb(truth, "DiffInd")
        size = reference.shape[1], reference.shape[0]
        seen = numpy.abs(pictures.rgb(truth, "DiffCol")).sum(axis=2) > 0
        row = []
        for name, how in (("CRC as printed", RSM), ("live", LIVE), ("PIC, medium", ("--bake", bake))):
            full, indirect = draw(folder, camera, light, size, *how)
            row.append(full)
            error, energy = pictures.error_of(indirect, reference, seen)
            print(f"| `{camera}__{light}` | {name} | {error:.1f} | {energy:.3f} |", flush=True)
        albedo = pictures.rgb(truth, "DiffCol")
        direct = albedo * pictures.rgb(truth, "DiffDir")
        row = [direct, *row, albedo * (pictures.rgb(truth, "DiffDir") + reference)]
        rows.append([pictures.to_srgb(picture, stops) for picture in row])
    pictures.montage(folder / "live_row.jpg", rows)


main()
