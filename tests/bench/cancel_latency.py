#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""How long `relume bake` goes on after it is asked to stop: the table of docs/PERFORMANCE.md.

Bakes once to learn how long it takes, then again and again, each time with SIGINT at another moment, evenly spread over
the bake. Prints the seconds from the signal until the process is gone and the last stage it told of.

    tests/bench/cancel_latency.py RELUME SCENE [--preset high] [--moments 20]
"""
import argparse
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import time


def start(o, out):
    command = [o.relume, "bake", o.scene, "-o", str(out), "--force", "--preset", o.preset]
    return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)


def last_stage(text):
    found = re.findall(r"^relume: ([a-z :]+?): (?:\d+ %|done)", text, re.M)
    return found[-1] if found else "start"


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("relume")
    parser.add_argument("scene")
    parser.add_argument("--preset", default="high")
    parser.add_argument("--moments", type=int, default=20)
    o = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        out = pathlib.Path(folder) / "bake.relume"
        begin = time.monotonic()
        _, text = start(o, out).communicate()
        whole = time.monotonic() - begin
        print(f"{o.preset}: {whole:.1f} s, uninterrupted")
        out.unlink(missing_ok=True)
        worst = 0.0
        for i in range(o.moments):
            at = whole * (i + 0.5) / o.moments
            process = start(o, out)
            try:
                _, text = process.communicate(timeout=at)
            except subprocess.TimeoutExpired:
                asked = time.monotonic()
                process.send_signal(signal.SIGINT)
                _, text = process.communicate()
                latency = time.monotonic() - asked
                worst = max(worst, latency)
                print(f"{at:8.2f} s  {latency:6.3f} s  {last_stage(text)}", flush=True)
                if out.exists():
                    sys.exit("a cancelled bake left its file")
        print(f"worst: {worst:.3f} s")


if __name__ == "__main__":
    main()
