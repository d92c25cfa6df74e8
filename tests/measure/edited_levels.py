#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Levels that were edited since they were baked: the old bake, live light alone, both blended, the level baked again.

    python3 tests/measure/edited_levels.py FOLDER [SPP]

Each level is baked at preset high, parts of it are moved or taken away, and the edited level is drawn by `relume render
--edited-from` and held against `relume reference` of it. Prints the squared error of indirect light where the edit
counts: the pixels that differ from the old bake's. Writes FOLDER/edits.jpg: old
bake | blended | baked again | reference. Runs build/release/tools/cli/relume, or the program that RELUME names; levels but
two_rooms are RELUME_SHARED_DIR's.
"""
import json
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
# Boxes that are added to two_rooms before it is baked: corners [m], albedo.
BOXES = {"two_rooms_door": ("door", (5.05, 0.0, 1.2), (5.15, 2.1, 2.2), (0.6, 0.45, 0.3)),
         "two_rooms_partition": ("partition", (3.0, 0.0, 0.0), (3.12, 2.7, 2.4), (0.7, 0.7, 0.65))}
# name, level, edit of its nodes (None: taken away; else moved by so many metres), view, lights, stops of the picture
VIEWS = (
    ("door", "two_rooms_door", {"door": None}, ("--camera", "cam_hall"), "lamp", 4.0),
    ("partition", "two_rooms_partition", {"partition": (-1.6, 0, 0)}, ("--camera", "cam_living"), "lamp", 1.0),
    ("partition_sun", "two_rooms_partition", {"partition": (-1.6, 0, 0)}, ("--camera", "cam_living"), "sun", 2.0),
    ("sofa", "two_rooms", {"sofa": (1.2, 0, 0.6)}, ("--camera", "cam_living"), "sun", 2.0),
    ("box", "cornell", {"tallBox": (0.5, 0, 0.5)}, ("--camera", "cam_front"), "emissive", 0.0),
    ("box_gone", "cornell", {"tallBox": None}, ("--camera", "cam_front"), "spot", 2.0),
    ("curtains", "sponza", {"Curtain.002": None, "Curtain2.003": None}, ("--camera", "cam_balcony"), "sun", 3.0),
)


def run(*words):
    made = subprocess.run([RELUME, *map(str, words)], capture_output=True, text=True, check=False)
    if made.returncode != 0:
        sys.exit(f"{' '.join(map(str, words))}: {made.stderr}")
    return made.stdout


def edit(source, target, changes):
    """A copy of a .glb whose nodes stand elsewhere or are gone."""
    level, binary = glb.read(source)
    for node in level["nodes"]:
        if node.get("name") not in changes:
            continue
        by = changes[node["name"]]
        if by is None:
            del node["mesh"]
        else:
            assert "matrix" not in node
            node["translation"] = [a + b for a, b in zip(node.get("translation", (0, 0, 0)), by)]
    glb.write(target, level, binary)


def add_box(source, target, name, low, high, albedo):
    """A copy of a .glb with a box."""
    level, binary = glb.read(source)
    corners = [[(low, high)[i >> k & 1][k] for k in range(3)] for i in range(8)]
    faces = ((0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6))
    triangles = [t for a, b, c, d in faces for t in ((a, b, c), (a, c, d))]
    glb.write(target, level, glb.add_mesh(level, binary, corners, triangles, albedo, name=name))


def source_of(level, folder):
    """The file of a level, None where it is not here."""
    two_rooms = ROOT / "samples/level/two_rooms.glb"
    if level not in BOXES:
        file = two_rooms if level == "two_rooms" else SHARED / f"scenes/{level}/{level}.glb"
        return file if file.is_file() else None
    file = folder / f"{level}.glb"
    add_box(two_rooms, file, *BOXES[level])
    return file


def indirect_of(image, lights):
    layers = ("DiffInd", "DiffDir") if lights == "emissive" else ("DiffInd",)
    return (sum(pictures.rgb(image, layer) for layer in layers),
            numpy.sqrt(sum(pictures.rgb(image, layer + "Err") ** 2 for layer in layers)))


def render(level, view, lights, out, *more):
    words = ("render", level, *view, "--lights", lights, "--size", f"{SIZE[0]}x{SIZE[1]}", "--samples", 2, "--aov",
             "indirect,full,position", "--force", "--progress", "none", "--json", "-o", out, *more)
    report = json.loads(run(*words))
    return {name: pictures.rgb(pictures.read_exr(out.with_suffix(f".{name}.exr"))) for name in ("indirect", "full", "position")}, report


def main():
    if len(sys.argv) not in (2, 3):
        sys.exit(__doc__)
    folder, spp = pathlib.Path(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 256
    folder.mkdir(parents=True, exist_ok=True)
    rows = []
    print("| edit | pixels it counts at | old bake | live light alone | blended | falls by % | baked again | "
          "live, ms a frame | live, MiB |\n|---|---:|---:|---:|---:|---:|---:|---:|---:|")
    for name, level, changes, view, lights, stops in VIEWS:
        source = source_of(level, folder)
        if source is None:
            continue
        edited, old, new = folder / f"{name}.glb", folder / f"{level}.relume", folder / f"{name}.relume"
        edit(source, edited, changes)
        for scene, bake in ((source, old), (edited, new)):
            if not bake.is_file():
                run("bake", scene, "-o", bake, "--preset", "high", "--progress", "none")
        truth_file = folder / f"{name}.truth.exr"
        if not truth_file.is_file():
            run("reference", edited, *view, "--lights", lights, "--size", f"{SIZE[0]}x{SIZE[1]}", "--spp", spp, "--progress",
                "none", "-o", truth_file)
        image = pictures.read_exr(truth_file)
        truth, noise = indirect_of(image, lights)
        seen = pictures.rgb(image, "DiffCol").sum(axis=2) > 0
        drawn, reports = {}, {}
        for kind, more in (("old", ("--bake", old, "--allow-stale")), ("live", ("--live",)),
                           ("blended", ("--bake", old, "--edited-from", source)), ("again", ("--bake", new))):
            drawn[kind], reports[kind] = render(edited, view, lights, folder / f"{name}.{kind}.exr", *more)
        counts = seen & (drawn["blended"]["indirect"] != drawn["old"]["indirect"]).any(axis=2)
        error = {kind: float(((layers["indirect"] - truth) ** 2 - noise ** 2)[counts].mean()) for kind, layers in drawn.items()}
        passes, held = reports["blended"]["passMs"], reports["blended"]["bufferBytes"]
        ms = sum(passes.get(each, 0.0) for each in ("direct", "bounce", "gather"))
        mib = sum(size for each, size in held.items() if ":" in each) / 2 ** 20
        print(f"| {name} | {100 * counts.sum() / seen.sum():.0f} % | {error['old']:.2e} | {error['live']:.2e} | {error['blended']:.2e} | "
              f"{100 * (1 - error['blended'] / error['old']):.1f} | {error['again']:.2e} | {ms:.0f} | {mib:.0f} |", flush=True)
        if name in ("door", "partition", "box"):
            rows.append([pictures.to_srgb(drawn[kind]["indirect"], stops) for kind in ("old", "blended", "again")] +
                        [pictures.to_srgb(truth, stops)])
    if rows:
        pictures.montage(folder / "edits.jpg", rows)


main()
