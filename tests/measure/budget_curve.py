#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""What bakes of a budget take, and how wrong they say they are: the tables of docs/notes/budgets.md.

    python3 tests/measure/budget_curve.py FOLDER SHARED [LEVEL...]        sponza house cornell pandora

Bakes each level with build/release/tools/cli/relume for budgets of 1.5 to 50 MiB and 0.5 to 4 ms, and for three errors; FOLDER is for the files,
SHARED has scenes/. Prints what was reckoned, what a relighter holds and takes (the least of 100 frames by one thread), and the certified error.
"""
import json
import pathlib
import subprocess
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
RELUME = ROOT / "build/release/tools/cli/relume"
BUDGETS = [("--budget-mb", v) for v in (1.5, 4, 9, 20, 50)] + [("--budget-ms", v) for v in (0.5, 1, 2, 4)] + [("--max-error", v) for v in (0.3, 0.2, 0.15)]


def row(folder, scene, flag, value):
    bake = folder / "level.relume"
    begin = time.monotonic()
    made = subprocess.run([RELUME, "bake", scene, "-o", bake, flag, str(value), "--force", "--progress", "plain"], capture_output=True, text=True)
    seconds = time.monotonic() - begin
    if made.returncode:
        return f"| `{flag} {value}` | {made.stderr.strip().splitlines()[-1]} | | | | | | | {seconds:.1f} |"
    trials = max(made.stderr.count(": certified error"), 1)
    info = json.loads(subprocess.run([RELUME, "info", "--json", bake], capture_output=True, text=True, check=True).stdout)
    bench = subprocess.run([RELUME, "bench", "--bake", bake, "--repeat", "100", "--threads", "1", "--backend", "cpu", "--json", "--progress", "none"],
                           capture_output=True, text=True, check=True).stdout
    setting = json.loads(bench)["settings"][0]
    sizes, relit = setting["sizes"], setting["relight"][0]
    held = sum(relit["bufferBytes"].values()) / 2**20
    return (f"| `{flag} {value}` | {sizes['surfels']} | {sizes['caches']} | {sizes['links']} | {setting['reckoned']['memoryMiB']:.2f} / {held:.2f} | "
            f"{setting['reckoned']['frameMs']:.2f} / {relit['passes']['frame']['minMs']:.2f} | {100 * info['certificate']['error']:.1f} | "
            f"{trials} | {seconds:.1f} |")


def main():
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    folder, shared = (pathlib.Path(word).resolve() for word in sys.argv[1:3])
    folder.mkdir(parents=True, exist_ok=True)
    for level in sys.argv[3:] or ["sponza", "house", "cornell", "pandora"]:
        print(f"\n{level}\n\n| budget | surfels | caches | links | MiB, reckoned / held | ms, reckoned / measured | certified, % | bakes | s |")
        print("|---|---:|---:|---:|---:|---:|---:|---:|---:|")
        for flag, value in BUDGETS:
            print(row(folder, shared / "scenes" / level / f"{level}.glb", flag, value), flush=True)


if __name__ == "__main__":
    main()
