#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Light on two_rooms' pillar, between caches that look apart: figures and picture of docs/notes/lightmap.md.

    python3 tests/measure/look_apart.py FOLDER [OLDER_RELUME]

Light of the hall's emitters that was reflected once, by a bake of preset high against `relume reference`: the share of it on the pillar and on all
that the camera sees. Then the pillar from near by, all bounces: FOLDER/look_apart.jpg has reference | OLDER_RELUME's, where it is named |
found, and twice the relative error of what was found (grey: none, black: half of the light is missing). Both programs read the one bake.
Runs build/release/tools/cli/relume, or the program that RELUME names.
"""
import os
import pathlib
import subprocess
import sys

import numpy
import pictures

ROOT = pathlib.Path(__file__).resolve().parents[2]
RELUME = pathlib.Path(os.environ.get("RELUME", ROOT / "build/release/tools/cli/relume"))
LEVEL = ROOT / "samples/level/two_rooms.glb"
PILLAR, RADIUS = (5.75, 3.2), 0.2  # [m] x and z of its axis; what lies nearer is it
HALL = ("--camera", "cam_hall", "--size", "160x90")
NEAR = ("--eye", "6.7,1.5,3.75", "--target", "5.75,1.5,3.2", "--fov", "50", "--size", "200x200")


def run(program, *words):
    subprocess.run([program, *map(str, words), "--progress", "none"], check=True, stdout=subprocess.DEVNULL)


def main():
    if len(sys.argv) not in (2, 3):
        sys.exit(__doc__)
    folder = pathlib.Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    programs = [*map(pathlib.Path, sys.argv[2:]), RELUME]
    bake = folder / "two_rooms.relume"
    if not bake.is_file():
        run(RELUME, "bake", LEVEL, "-o", bake, "--preset", "high")

    def reference(view, name, bounces, spp):
        if not (folder / name).is_file():
            run(RELUME, "reference", LEVEL, *view, "--lights", "emissive", "--dynamic", "receivers", "--bounces", bounces, "--spp", spp,
                "-o", folder / name)
        return pictures.read_exr(folder / name)

    def render(program, view, *more):
        run(program, "render", LEVEL, "--bake", bake, *view, "--lights", "emissive", "--aov", "bounced", "-o", folder / "found.exr", "--force", *more)
        return pictures.rgb(pictures.read_exr(folder / "found.exr"))

    image = reference(HALL, "hall.exr", 1, 800)
    truth = pictures.rgb(image, "DiffInd")
    seen = sum(numpy.abs(image["Normal." + c]) for c in "XYZ") > 0.1
    pillar = seen & (numpy.hypot(image["Position.X"] - PILLAR[0], image["Position.Z"] - PILLAR[1]) < RADIUS)
    for program in programs:
        found = render(program, HALL, "--bounces", 2)
        print(f"{program}: {pictures.error_of(found, truth, pillar)[1]:.3f} of the light on the pillar, "
              f"{pictures.error_of(found, truth, seen)[1]:.3f} of all", flush=True)

    truth = pictures.rgb(reference(NEAR, "near.exr", 64, 1600), "DiffInd")[:, 30:158]
    drawn = [render(program, NEAR)[:, 30:158] for program in programs]
    stops = numpy.log2(0.8 / numpy.percentile(truth, 99))
    errors = [0.5 + 2 * (d - truth).mean(axis=2, keepdims=True) / truth.mean(axis=2, keepdims=True) for d in drawn]
    grey = [numpy.round(255 * numpy.clip(numpy.broadcast_to(e, truth.shape), 0, 1)).astype(numpy.uint8) for e in errors]
    pictures.montage(folder / "look_apart.jpg", [[*(pictures.to_srgb(p, stops) for p in (truth, *drawn)), *grey]], 90)


main()
