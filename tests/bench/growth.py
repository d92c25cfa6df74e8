#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""How a bake's time and memory grow with triangles, surfels and caches: the tables of docs/notes/scale.md ("Growth").

    growth.py --relume FILE --level FILE.glb [--copies 1,4,16,40] [--surfels 131072,1048576,10000000]
              [--caches 16384,131072,1000000] [--threads 2] [--cancel N] [--only triangles|surfels|caches]

Triangles: city blocks of the level (make_city.py), as instances and as geometry of their own, at preset `high`. Surfels and
caches: the level itself, everything else as in `high` (256 rays and 64 links a cache where caches grow). For each bake the
seconds of processors of every stage, the memory held after it, and the peak. An exponent stands where a stage takes a
second or more: d log(seconds) / d log(size) to the row above; above 1.1 the stage grows faster than the level.

With --cancel N each bake is run again and interrupted at N moments spread over it; printed is the longest time until it was
gone.
"""
import argparse
import json
import math
import pathlib
import random
import resource
import signal
import subprocess
import sys
import tempfile
import time

STAGES = ["import", "rays", "play space", "surfels", "hierarchy", "caches", "links", "certificate", "validate"]


def bake(command, report):
    """Seconds by the clock and of processors; stages' seconds of processors and memory; peak memory in MiB."""
    before, begin = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
    subprocess.run([str(each) for each in command], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    told = json.loads(report.read_text())
    seconds, memory = {}, {}
    for stage in told["stages"]:
        name = stage["stage"]
        seconds[name] = max(seconds.get(name, 0.0), stage["processorSeconds"])
        if "memory_mib" in stage["figures"]:
            memory[name] = stage["figures"]["memory_mib"]
    return {"clock": time.monotonic() - begin, "stages": seconds, "memory": memory, "peak": told["peakMemoryMiB"],
            "processors": after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, "told": told}


def cancel_latency(command, clock, moments):
    """The longest time from SIGINT until the process is gone, of so many moments of a bake that takes `clock` seconds."""
    draw, worst = random.Random(1), 0.0
    for i in range(moments):
        process = subprocess.Popen([str(each) for each in command], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        time.sleep(clock * (i + draw.random()) / moments)
        begin = time.monotonic()
        process.send_signal(signal.SIGINT)
        process.wait()
        worst = max(worst, time.monotonic() - begin)
    return worst


def table(title, sizes, rows):
    print(f"\n### {title}\n")
    print("| | " + " | ".join(sizes) + " |")
    print("|---|" + "---:|" * len(sizes))
    for name in STAGES:
        cells = []
        for i, row in enumerate(rows):
            seconds = row["stages"].get(name, 0.0)
            cell = f"{seconds:.1f} s"
            if i > 0 and rows[i - 1]["stages"].get(name, 0.0) >= 1.0:
                grown = math.log(seconds / rows[i - 1]["stages"][name]) / math.log(row["size"] / rows[i - 1]["size"])
                cell += f" ({grown:.2f})"
            if name in row["memory"]:
                cell += f", {row['memory'][name]:.0f} MiB"
            cells.append(cell)
        print(f"| {name} | " + " | ".join(cells) + " |")
    for name, value in (("processors", lambda r: f"{r['processors']:.0f} s"), ("clock", lambda r: f"{r['clock']:.0f} s"),
                        ("peak", lambda r: f"{r['peak']:.0f} MiB"), ("surfels", lambda r: r["told"]["surfels"]),
                        ("caches", lambda r: r["told"]["caches"]), ("links", lambda r: r["told"]["links"]),
                        ("gone after", lambda r: f"{r['gone']:.2f} s" if "gone" in r else "")):
        print(f"| {name} | " + " | ".join(str(value(row)) for row in rows) + " |")
    sys.stdout.flush()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--relume", required=True)
    parser.add_argument("--level", required=True)
    parser.add_argument("--copies", default="1,4,16,40")
    parser.add_argument("--surfels", default="131072,1048576,10000000")
    parser.add_argument("--caches", default="16384,131072,1000000")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--cancel", type=int, default=0)
    parser.add_argument("--only", choices=["triangles", "surfels", "caches"])
    o = parser.parse_args()
    city = pathlib.Path(__file__).parent / "make_city.py"

    def numbers(text):
        return [int(each) for each in text.split(",")]

    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)

        def measured(level, size, *options):
            report = folder / "report.json"
            command = [o.relume, "bake", level, "-o", folder / "bake.relume", "--force", "--report", report, "--threads",
                       o.threads, "--progress", "none", *options]
            row = bake(command, report)
            row["size"] = size
            if o.cancel:
                row["gone"] = cancel_latency(command, row["clock"], o.cancel)
            return row

        if o.only in (None, "triangles"):
            for kind, option in (("instances", []), ("geometry of its own", ["--unique"])):
                sizes, rows = [], []
                for copies in numbers(o.copies):
                    level = folder / "city.glb"
                    subprocess.run([sys.executable, city, o.level, level, "--copies", str(copies), *option], check=True)
                    rows.append(measured(level, copies))
                    triangles = next(s["figures"]["triangles"] for s in rows[-1]["told"]["stages"] if "triangles" in s["figures"])
                    sizes.append(f"{triangles / 1e6:.2f} M triangles")
                table(f"Triangles: {kind}", sizes, rows)
        for kind, counts, options in (
                ("surfels", numbers(o.surfels), lambda n: ["--surfels", n, *(["--link-kind", "cone"] if n > 524288 else [])]),
                ("caches", numbers(o.caches), lambda n: ["--lightmap-caches", n, "--rays", 256, "--links", 64])):
            if o.only in (None, kind):
                rows = [measured(o.level, count, *options(count)) for count in counts]
                table(kind.capitalize(), [f"{count:,}" for count in counts], rows)


if __name__ == "__main__":
    main()
