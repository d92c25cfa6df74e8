#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Certified error beside measured error: the tables of docs/notes/certificate.md.

    python3 tests/measure/certificate_rank.py FOLDER SHARED [PRESET [SEED...]]        high 1 2 3

Bakes the levels of the accuracy suite with build/release/tools/cli/relume at each seed; FOLDER is for the files, SHARED has scenes/. Measured is
the mean of `rmse` in docs/ACCURACY.md over the views of a level under its suns, lamps and spots, all bounces. Prints for each level the two
errors, their ratio, and the share of the bake's time that its certificate took; then Spearman's rank correlation.
"""
import json
import pathlib
import re
import statistics
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
RELUME = ROOT / "build/release/tools/cli/relume"
STAGES = ("test rays", "certificate")


def measured(preset):
    """Mean rmse [%] of each level's views."""
    text = (ROOT / "docs/ACCURACY.md").read_text()
    table = text.split(f"## Preset `{preset}`\n")[1].split("\n## ")[0]
    rows = {}
    for level, light, rmse in re.findall(r"^\| `(\w+)/\w+?__(\S+)` \| indirect \| ([0-9.]+) \|", table, re.M):
        if "emissive" not in light and "1bounce" not in light:
            rows.setdefault(level, []).append(float(rmse))
    return {level: statistics.mean(values) for level, values in rows.items()}


def certified(folder, scene, preset, seed):
    """Certified error [%], share of the time [%]."""
    bake, report = folder / "level.relume", folder / "level.json"
    subprocess.run([RELUME, "bake", scene, "-o", bake, "--report", report, "--preset", preset, "--seed", seed, "--force", "--progress", "none"],
                   check=True, capture_output=True)
    stages = json.loads(report.read_text())["stages"]
    total = sum(stage["seconds"] for stage in stages if stage["stage"] not in ("mesh report", "check meshes"))  # those are within import
    info = json.loads(subprocess.run([RELUME, "info", "--json", bake], capture_output=True, text=True, check=True).stdout)
    return 100 * info["certificate"]["error"], 100 * sum(s["seconds"] for s in stages if s["stage"] in STAGES) / total


def ranks(values):
    order = sorted(range(len(values)), key=values.__getitem__)
    return [order.index(i) for i in range(len(values))]


def spearman(a, b):
    n = len(a)
    return 1 - 6 * sum((x - y) ** 2 for x, y in zip(ranks(a), ranks(b))) / (n * (n * n - 1))


def main():
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    folder, shared = (pathlib.Path(word).resolve() for word in sys.argv[1:3])
    folder.mkdir(parents=True, exist_ok=True)
    preset, seeds = (sys.argv[3:4] or ["high"])[0], sys.argv[4:] or ["1", "2", "3"]
    truth = measured(preset)
    found = {}
    print("| level | measured, % | " + " | ".join(f"certified, seed {seed}, %" for seed in seeds) + " | ratio | of the time, % |")
    print("|---|---:|" + "---:|" * (len(seeds) + 2))
    for level in sorted(truth, key=truth.get):
        shipped = ROOT / f"samples/level/{level}.glb"
        scene = shipped if shipped.exists() else shared / f"scenes/{level}/{level}.glb"
        runs = [certified(folder, scene, preset, seed) for seed in seeds]
        found[level] = [error for error, _ in runs]
        print(f"| `{level}` | {truth[level]:.1f} | " + " | ".join(f"{error:.1f}" for error in found[level]) +
              f" | {statistics.mean(found[level]) / truth[level]:.2f} | {statistics.mean(share for _, share in runs):.1f} |", flush=True)
    levels = list(found)
    for i, seed in enumerate(seeds):
        print(f"\nSpearman, seed {seed}: {spearman([found[l][i] for l in levels], [truth[l] for l in levels]):.2f}", end="")
    print(f"\nSpearman, mean of the seeds: {spearman([statistics.mean(found[l]) for l in levels], [truth[l] for l in levels]):.2f}")


main()
