#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Where the bytes of a bake are: its chunks through gzip, as they are, packed, and packed for the web; docs/notes/packing.md.

    python3 tests/measure/chunk_sizes.py BAKE.relume

Runs build/release/tools/cli/relume. Prints a table in MB (10^6 bytes) of every chunk that has MIN of them in one of the three files, and
gzip's size of the whole file. Chunks are compressed each by itself.
"""
import gzip
import json
import pathlib
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
RELUME = ROOT / "build/release/tools/cli/relume"
MIN = 0.05  # [MB]


def relume(*words):
    return subprocess.run([RELUME, *words], capture_output=True, text=True, check=True).stdout


def zipped(data):
    return len(gzip.compress(data, 9)) * 1e-6


def sizes(path):
    """MB by chunk, and of the file."""
    data = pathlib.Path(path).read_bytes()
    chunks = json.loads(relume("info", "--json", path))["chunks"]
    return {c["name"]: zipped(data[c["offset"]:c["offset"] + c["bytes"]]) if c["bytes"] else 0.0 for c in chunks}, zipped(data)


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    files = [sys.argv[1]]
    with tempfile.TemporaryDirectory() as folder:
        for profile in ("lossless", "web"):
            files.append(f"{folder}/{profile}.relume")
            relume("pack", sys.argv[1], "-o", files[-1], "--profile", profile)
        tables, wholes = zip(*map(sizes, files))
    print("| | plain | packed | for the web |\n|---|---:|---:|---:|")
    row = lambda name, values: print(f"| {name} | " + " | ".join(f"{v:.3f}" for v in values) + " |")
    others = [0.0] * len(tables)
    for name in sorted(tables[0], key=lambda name: -tables[0][name]):
        values = [table.get(name, 0.0) for table in tables]
        if max(values) < MIN:
            others = [a + b for a, b in zip(others, values)]
        else:
            row(f"`{name}`", values)
    row("the others", others)
    row("the file", wholes)


main()
