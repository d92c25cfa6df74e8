#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""What a store saves a bake, by edit: times by stage, caches traced, bytes of the store.

    store.py --relume FILE --level FILE.glb [--preset high] [--node NAME] [--material NAME] [--threads 2] [--store DIR|URL]

The level is baked without a store and into an empty one; then again, with another colour of a material, with half the links, and
with a node moved by 0.3 m, each with the store that the first has filled and without one, and the bytes compared. Seconds are the
clock's and, behind them, of processors, which other work of the machine does not stretch.
"""
import argparse
import json
import pathlib
import resource
import shutil
import struct
import subprocess
import tempfile
import time


def edited(level, change, output):
    """A .glb whose JSON was changed."""
    data = level.read_bytes()
    size = struct.unpack_from("<I", data, 12)[0]
    document = json.loads(data[20:20 + size])
    change(document)
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    rest = data[20 + size:]
    output.write_bytes(struct.pack("<III", 0x46546C67, 2, 20 + len(text) + len(rest)) + struct.pack("<II", len(text), 0x4E4F534A) +
                       text + rest)
    return output


def named(entries, name, what):
    for entry in entries:
        if name is None or entry.get("name") == name:
            return entry
    raise SystemExit(f"the level has no {what} \"{name}\"")


def recolour(name):
    def change(document):
        material = named(document["materials"], name, "material")
        material.setdefault("pbrMetallicRoughness", {})["baseColorFactor"] = [0.5, 0.4, 0.3, 1.0]
    return change


def move(name):
    def change(document):
        drawn = [node for node in document["nodes"] if "mesh" in node and "matrix" not in node]
        node = named(drawn, name, "node")
        node["translation"] = [a + b for a, b in zip(node.get("translation", [0.0, 0.0, 0.0]), (0.3, 0.0, 0.2))]
    return change


class Bakes:
    def __init__(self, arguments, folder):
        self.arguments, self.folder = arguments, folder

    def run(self, level, store, *more):
        output, report = self.folder / "bake.relume", self.folder / "report.json"
        command = [self.arguments.relume, "bake", level, "-o", output, "--force", "--preset", self.arguments.preset, "--threads",
                   self.arguments.threads, "--report", report, "--progress", "none", *more]
        if store:
            command += ["--store", store, "--store-stats"]
        before, begin = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
        said = subprocess.run([str(each) for each in command], check=True, capture_output=True, text=True).stdout
        clock = time.monotonic() - begin
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        stages, traced = {}, 0.0
        for stage in json.loads(report.read_text())["stages"]:
            stages[stage["stage"]] = stages.get(stage["stage"], 0.0) + stage["seconds"]
            traced += stage["figures"].get("caches_traced", 0.0)
        print("    " + ", ".join(f"{name} {seconds:.2f}" for name, seconds in stages.items() if seconds >= 0.005))
        if store:
            print("    " + said.splitlines()[-1])
        return output.read_bytes(), clock, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, traced


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--relume", required=True)
    parser.add_argument("--level", type=pathlib.Path, required=True)
    parser.add_argument("--preset", default="high")
    parser.add_argument("--node")
    parser.add_argument("--material")
    parser.add_argument("--threads", default="2")
    parser.add_argument("--store")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="relume_store_") as temporary:
        folder = pathlib.Path(temporary)
        store = arguments.store or folder / "store"
        bakes = Bakes(arguments, folder)
        level = folder / "level.glb"
        shutil.copy(arguments.level, level)
        colour = edited(arguments.level, recolour(arguments.material), folder / "colour.glb")
        moved = edited(arguments.level, move(arguments.node), folder / "moved.glb")
        half = ["--links", "64"]
        rows = [("into an empty store", level, []), ("the same again", level, []), ("another colour", colour, []),
                ("64 links", level, half), ("a node moved", moved, [])]
        for name, scene, options in rows:
            print(f"{name}: without a store, then with it")
            plain, clock, processors, _ = bakes.run(scene, None, *options)
            data, stored_clock, stored_processors, traced = bakes.run(scene, store, *options)
            same = "the same bytes" if data == plain else "OTHER BYTES"
            print(f"  {clock:.1f} ({processors:.1f}) s -> {stored_clock:.1f} ({stored_processors:.1f}) s, "
                  f"{100 * stored_processors / processors:.0f} % of processors' time, {traced:.0f} caches traced, {same}")


if __name__ == "__main__":
    main()
