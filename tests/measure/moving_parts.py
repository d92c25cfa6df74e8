#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""What moving parts do to a bake's light: two_rooms with its toy or with a small lamp, the Cornell box with a ball, against path tracing.

    python3 tests/measure/moving_parts.py FOLDER [SPP]

Without: `relume render` draws the part, lit and casting the lamps' shadows, but no link knows of it. With: --dynamic
solid. Reference: the part blocks and reflects all light. The indirect shadow is where the reference's light over links
changes by more than 2 % when the part is taken out of it (means over 7 x 7 pixels); the part's own pixels count nowhere.
"Of the change alone": the same of the difference that the part makes, without the error that the bake has anyway. Prints the squared error of indirect light inside and outside of it, and the milliseconds of the cache pass.
Writes FOLDER/moving.jpg: without | with | reference | difference of with and reference, ten times. Runs
build/release/tools/cli/relume, or the program that RELUME names; the Cornell box is RELUME_SHARED_DIR's.
"""
import json
import math
import os
import pathlib
import subprocess
import sys

import glb
import numpy
import pictures

ROOT = pathlib.Path(__file__).resolve().parents[2]
RELUME = pathlib.Path(os.environ.get("RELUME", ROOT / "build/release/tools/cli/relume"))
SHARED = pathlib.Path(os.environ.get("RELUME_SHARED_DIR", ""))
SIZE = 320, 180
BALL = (-0.45, 0.28, 0.55), 0.22  # of the Cornell box: centre, radius [m]
TOY = (3.9, 0.14, 1.3), 0.14
LAMP = (2.0, 1.4, 2.0), 0.06  # of two_rooms
LAMP_RADIANCE = 40  # [W/m²/sr]
CLOSE = "--eye", "4.55,0.8,2.2", "--target", "3.9,0.1,1.2", "--fov", "45"
# level, part, view, lights, exposure of the picture [stops]
VIEWS = (
    ("cornell", BALL, ("--camera", "cam_front"), "emissive", 1.0),
    ("cornell", BALL, ("--camera", "cam_front"), "spot", 2.0),
    ("two_rooms", TOY, CLOSE, "sun", 2.0),
    ("two_rooms", TOY, CLOSE, "lamp", 2.0),
    ("two_rooms_lamp", LAMP, ("--camera", "cam_living", "--emission", "panel=0,0,0"), "emissive", 3.0),
)


def run(*words):
    made = subprocess.run([RELUME, *map(str, words)], capture_output=True, text=True, check=False)
    if made.returncode != 0:
        sys.exit(f"{' '.join(map(str, words))}: {made.stderr}")
    return made.stdout


def add_ball(source, target, centre, radius, albedo, radiance=0):
    """A copy of a .glb with a dynamic sphere of 32 x 16 quads, which emits some radiance [W/m²/sr]."""
    level, binary = glb.read(source)
    around, up = 32, 16
    points, triangles = [], []
    for j in range(up + 1):
        for i in range(around + 1):
            a, b = 2 * math.pi * i / around, math.pi * j / up
            points.append((radius * math.sin(b) * math.cos(a), radius * math.cos(b), radius * math.sin(b) * math.sin(a)))
    for j in range(up):
        for i in range(around):
            k = j * (around + 1) + i
            triangles += [(k, k + 1, k + around + 1), (k + 1, k + around + 2, k + around + 1)]
    binary = glb.add_mesh(level, binary, points, triangles, albedo, name="ball", translation=list(centre),
                          extras={"relume": {"bake": "dynamic"}})
    if radiance > 0:
        level["materials"][-1] |= {"emissiveFactor": [1, 1, 1],
                                   "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": radiance}}}
        level.setdefault("extensionsUsed", []).append("KHR_materials_emissive_strength")
    glb.write(target, level, binary)


def render(level, bake, view, lights, out, dynamic):
    """Layers of a view, and milliseconds by pass."""
    words = ("render", level, "--bake", bake, *view, "--lights", lights, "--size", f"{SIZE[0]}x{SIZE[1]}", "--samples", 2,
             "--dynamic", dynamic, "--aov", "indirect,full,position", "--force", "--progress", "none", "--json", "-o", out)
    report = json.loads(run(*words))
    layers = {name: pictures.rgb(pictures.read_exr(out.with_suffix(f".{name}.exr")))
              for name in ("indirect", "full", "position")}
    return layers, report["passMs"]


def trace(level, view, lights, out, dynamic, spp):
    if not out.is_file():
        run("reference", level, *view, "--lights", lights, "--size", f"{SIZE[0]}x{SIZE[1]}", "--spp", spp, "--dynamic",
            dynamic, "--progress", "none", "-o", out)
    return pictures.read_exr(out)


def indirect_of(image, lights):
    """What arrives over links, and its noise. Light of emitters does so as well."""
    layers = ("DiffInd", "DiffDir") if lights == "emissive" else ("DiffInd",)
    return (sum(pictures.rgb(image, layer) for layer in layers),
            numpy.sqrt(sum(pictures.rgb(image, layer + "Err") ** 2 for layer in layers)))


def smooth(image, radius=3):
    """Mean over a square about each pixel."""
    padded = numpy.pad(image.astype(float), ((radius, radius), (radius, radius), (0, 0)), "edge")
    side = 2 * radius + 1
    sums = sum(padded[y:y + image.shape[0], x:x + image.shape[1]] for y in range(side) for x in range(side))
    return sums / side ** 2


def main():
    if len(sys.argv) not in (2, 3):
        sys.exit(__doc__)
    folder, spp = pathlib.Path(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 1024
    folder.mkdir(parents=True, exist_ok=True)
    levels = {"two_rooms": ROOT / "samples/level/two_rooms.glb", "two_rooms_lamp": folder / "two_rooms_lamp.glb"}
    add_ball(levels["two_rooms"], levels["two_rooms_lamp"], *LAMP, (0.5, 0.5, 0.5), LAMP_RADIANCE)
    if (SHARED / "scenes/cornell/cornell.glb").is_file():
        levels["cornell"] = folder / "cornell_ball.glb"
        add_ball(SHARED / "scenes/cornell/cornell.glb", levels["cornell"], *BALL, (0.15, 0.35, 0.75))
    rows = []
    print("| view | pixels | squared error inside: without, with | falls by % | of the change alone, % | outside: without, with | "
          "caches, ms: without, with | parts' own light, ms |\n|---|---:|---:|---:|---:|---:|---:|---:|")
    for name, (centre, radius), view, lights, stops in VIEWS:
        if name not in levels:
            continue
        level, bake, stem = levels[name], folder / f"{name}.relume", folder / f"{name}_{lights}"
        if not bake.is_file():
            run("bake", level, "-o", bake, "--preset", "high", "--progress", "none")
        truth_file = trace(level, view, lights, pathlib.Path(f"{stem}.solid.exr"), "solid", spp)
        apart, _ = indirect_of(trace(level, view, lights, pathlib.Path(f"{stem}.apart.exr"), "receivers", spp), lights)
        truth, noise = indirect_of(truth_file, lights)
        drawn = {}
        for dynamic in ("receivers", "solid"):
            layers, ms = render(level, bake, view, lights, pathlib.Path(f"{stem}.{dynamic}.exr"), dynamic)
            for _ in range(4):  # the least of five
                again = render(level, bake, view, lights, pathlib.Path(f"{stem}.{dynamic}.exr"), dynamic)[1]
                ms = {key: min(value, again[key]) for key, value in ms.items()}
            drawn[dynamic] = layers, ms
        place = drawn["solid"][0]["position"]
        seen = pictures.rgb(truth_file, "DiffCol").sum(axis=2) > 0
        # The part and the pixels on its outline
        own = numpy.linalg.norm(place - centre, axis=2) < 1.05 * radius
        own = smooth(own[:, :, None], 1)[:, :, 0] > 0
        changed = numpy.abs(smooth(truth - apart)).sum(axis=2)
        inside = seen & ~own & (changed > 0.02 * smooth(apart).sum(axis=2))
        outside = seen & ~own & ~inside

        def error(picture, mask):
            """Mean squared difference from the truth, less what its noise adds."""
            if not mask.any():
                return 0.0
            return max(float(((picture - truth) ** 2)[mask].mean() - (noise ** 2)[mask].mean()), 0.0)

        def change_error():
            """Of the change that the part makes, squared, over that change squared; means over squares of both."""
            made = smooth(drawn["solid"][0]["indirect"] - drawn["receivers"][0]["indirect"])[inside]
            true = smooth(truth - apart)[inside]
            return 100 * (1 - ((made - true) ** 2).mean() / (true ** 2).mean())

        before, after = (drawn[d][0]["indirect"] for d in ("receivers", "solid"))
        inner, outer = [error(p, inside) for p in (before, after)], [error(p, outside) for p in (before, after)]
        ms = [drawn[d][1]["caches"] for d in ("receivers", "solid")]
        print(f"| `{name}`, {lights} | {inside.sum()} | {inner[0]:.3g}, {inner[1]:.3g} | {100 * (1 - inner[1] / inner[0]):.1f} | {change_error():.1f} | "
              f"{outer[0]:.3g}, {outer[1]:.3g} | {ms[0]:.2f}, {ms[1]:.2f} | {drawn['solid'][1]['moving parts']:.2f} |", flush=True)
        rows.append([pictures.to_srgb(p, stops) for p in (before, after, truth, 10 * numpy.abs(smooth(after - truth, 1)))])
    pictures.montage(folder / "moving.jpg", rows)


main()
