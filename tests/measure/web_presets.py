#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Candidates for preset web: bytes and error of levels of the accuracy suite; the table "Which preset" of docs/notes/packing.md.

    python3 tests/measure/web_presets.py FOLDER SHARED [LEVEL...]        sponza

Runs the programs of build/release; FOLDER is for their files, SHARED has scenes/ and references/ (tests/accuracy). A row has the MB
(10^6 bytes) of a candidate through relume pack --profile web and gzip, and t1 in percent of each of the level's views.
"""
import json
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = ROOT / "build/release"
RELUME, ACCURACY = BUILD / "tools/cli/relume", BUILD / "tests/accuracy/accuracy"
# Options beside preset medium, where they name no preset.
CANDIDATES = [
    ["--preset", "medium"],
    ["--link-kind", "irradiance", "--links-total", "1340000"],
    ["--link-kind", "irradiance", "--links-total", "1410000", "--lightmap-caches", "16384"],
    ["--links-total", "1130000", "--lightmap-caches", "9216"],
    ["--links-total", "1090000", "--lightmap-caches", "12288"],
    ["--links-total", "1010000", "--lightmap-caches", "16384"],
    ["--preset", "web"],
]


def run(*command, allowed=(0,)):
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False)
    if done.returncode not in allowed:
        sys.exit(f"{command}:\n{done.stdout}{done.stderr}")
    return done.stdout


def measure(folder, shared, level, scene, options):
    """MB, number of links, t1 of the views."""
    bake, report = folder / f"{level}.web.relume", folder / f"{level}.web.json"  # which accuracy --reuse takes
    preset = [] if "--preset" in options else ["--preset", "medium"]
    run(RELUME, "bake", scene, "-o", bake, "--report", report, "--force", "--progress", "none", *preset, *options)
    packed = json.loads(run(RELUME, "pack", bake, "-o", folder / "packed.relume", "--profile", "web", "--force", "--json"))
    said = run(ACCURACY, "--relume", RELUME, "--shared", shared, "--source", ROOT, "--work", folder, "--levels", level, "--settings", "web",
               "--reuse")
    errors = [float(row.split("|")[4]) for row in said.splitlines() if re.match(r"\| `[^`]+` \| (indirect|bounced) \|", row)]
    return packed["gzipBytes"] * 1e-6, json.loads(report.read_text())["links"], errors


def main():
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    folder, shared = (pathlib.Path(word).resolve() for word in sys.argv[1:3])
    folder.mkdir(parents=True, exist_ok=True)
    for level in sys.argv[3:] or ["sponza"]:
        shipped = ROOT / f"samples/level/{level}.glb"
        scene = shipped if shipped.exists() else shared / f"scenes/{level}/{level}.glb"
        print(f"\n{level}\n\n| options | links | MB | t1 |\n|---|---:|---:|---|", flush=True)
        for options in CANDIDATES:
            megabytes, links, errors = measure(folder, shared, level, scene, options)
            print(f"| `{' '.join(options)}` | {links * 1e-6:.2f} M | {megabytes:.2f} | {', '.join(f'{e:.1f}' for e in errors)} |", flush=True)


main()
