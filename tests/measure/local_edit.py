#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""What moving one node changes of a bake: the table of docs/notes/compare.md, "What an edit changes".

    python3 tests/measure/local_edit.py RELUME LEVEL.glb NODE X,Y,Z FOLDER [PRESET]                                        high

Bakes the level and the same with the node moved by so many metres of its parent's axes, and prints the share of surfels and caches
whose places and normals are the same bits in both, and what `relume compare` says of light.
"""
import json
import pathlib
import subprocess
import sys

import numpy

sys.path.insert(0, str(pathlib.Path(__file__).parent))
import bake_chunks
import glb


def moved(level, node, by, output):
    document, binary = glb.read(level)
    found = [each for each in document["nodes"] if each.get("name") == node]
    if len(found) != 1 or "matrix" in found[0]:
        raise SystemExit(f"{level}: expected one node \"{node}\" with a translation, found {len(found)}")
    found[0]["translation"] = [a + b for a, b in zip(found[0].get("translation", [0.0, 0.0, 0.0]), by)]
    glb.write(output, document, binary)


def places(path, kind):
    """Bits of place and normal of each surfel or cache."""
    arrays = bake_chunks.read(path)
    return [row.tobytes() for row in numpy.hstack([arrays[f"{kind}.position"], arrays[f"{kind}.normal"]])]


def main():
    relume, level, node, by, folder = sys.argv[1:6]
    preset = sys.argv[6] if len(sys.argv) > 6 else "high"
    folder = pathlib.Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    other = folder / "moved.glb"
    moved(level, node, [float(each) for each in by.split(",")], other)
    bakes = [folder / "before.relume", folder / "after.relume"]
    for scene, bake in zip((level, other), bakes):
        subprocess.run([relume, "bake", scene, "--preset", preset, "-o", bake, "--force", "--progress", "none"], check=True,
                       stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
    for kind in ("surfel", "cache"):
        before, after = places(bakes[0], kind), set(places(bakes[1], kind))
        print(f"{kind}s of the same bits: {100 * sum(each in after for each in before) / len(before):.1f} % of {len(before)}")
    said = subprocess.run([relume, "compare", *bakes, "--scene", other, "--json"], check=True, stdout=subprocess.PIPE,
                          stderr=subprocess.DEVNULL, text=True).stdout
    report = json.loads(said)
    arrays = report["arrays"]
    print("light map:", *arrays["caches"]["lightmap"]["a"], "->", *arrays["caches"]["lightmap"]["b"])
    print("certified error: {a:.3f} -> {b:.3f}".format(**arrays["certifiedError"]))
    for each in report["light"]["lightings"]:
        print(f"{each['name']}: RMSE {100 * each['rmse']:.2f} %, change of 95 % {100 * each['change']['p95']:.2f} %")


if __name__ == "__main__":
    main()
