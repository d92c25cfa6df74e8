#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""How long a command goes on after it is asked to stop: the table of docs/notes/scale.md.

Runs the command once to learn how long it takes, then again and again, each time with SIGINT at another moment, evenly
spread over the run. Prints the seconds from the signal until the process is gone and the stage it was in.

    tests/bench/cancel_latency.py [--moments 20] [--suffix .relume] RELUME bake SCENE --preset high
    tests/bench/cancel_latency.py --suffix .exr RELUME render SCENE --bake BAKE --size 1920x1080
"""
import argparse
import json
import pathlib
import signal
import subprocess
import sys
import tempfile
import time


def start(o, out):
    command = [o.relume, *o.command, "-o", str(out), "--force", "--progress", "json"]
    return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)


def last_stage(text):
    stage = "start"
    for line in text.splitlines():
        if line.startswith("{") and (event := json.loads(line)).get("event") == "progress":
            stage = f"{event['stage']} {100 * event['fraction']:.0f} %"
    return stage


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--moments", type=int, default=20)
    parser.add_argument("--suffix", default=".relume", help="of the file that the command writes")
    parser.add_argument("relume")
    parser.add_argument("command", nargs=argparse.REMAINDER, help="all but -o and --progress")
    o = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        out = pathlib.Path(folder) / ("out" + o.suffix)
        begin = time.monotonic()
        process = start(o, out)
        _, text = process.communicate()
        whole = time.monotonic() - begin
        if process.returncode != 0:
            sys.exit(f"exit {process.returncode}:\n{text}")
        print(f"{whole:.1f} s, uninterrupted")
        out.unlink(missing_ok=True)
        worst = 0.0
        for i in range(o.moments):
            at = whole * (i + 0.5) / o.moments
            process = start(o, out)
            try:
                process.communicate(timeout=at)
                out.unlink(missing_ok=True)
            except subprocess.TimeoutExpired:
                asked = time.monotonic()
                process.send_signal(signal.SIGINT)
                _, text = process.communicate()
                latency = time.monotonic() - asked
                worst = max(worst, latency)
                print(f"{at:8.2f} s  {latency:6.3f} s  {last_stage(text)}", flush=True)
                if process.returncode == 0:
                    out.unlink(missing_ok=True)  # it was done before it heard
                elif out.exists():
                    sys.exit("a cancelled run left its file")
        print(f"worst: {worst:.3f} s")


if __name__ == "__main__":
    main()
