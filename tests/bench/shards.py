#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Times of a bake in shards: what is done once, what every shard does again, and what is divided between them.

    shards.py --relume FILE --level FILE [--preset high] [--counts 1,2,4] [--cores 2] [--repeat 3] [--nodes 10,100,1000]

Every shard is a process of one thread; as many run at a time as there are cores. Printed are the stages of the plan, of one
shard and of the merge, the least of the repeats each; the time of the whole by number of shards; and what that makes on paper
of nodes with a core each, a shard a node, in seconds of processors: plan + what a shard repeats + what is divided / nodes +
merge. The bytes
are compared with a plain bake's each time.
"""
import argparse
import concurrent.futures
import filecmp
import json
import pathlib
import resource
import subprocess
import tempfile
import time


def run(*command):
    """Seconds by the clock, and of processors."""
    before, begin = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
    subprocess.run([str(each) for each in command], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.monotonic() - begin, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def stages(report):
    found = {}
    for stage in json.loads(report.read_text())["stages"]:
        found[stage["stage"]] = stage["seconds"]
    return found


def least(tables):
    return {name: min(table[name] for table in tables) for name in tables[0]}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--relume", required=True)
    parser.add_argument("--level", required=True)
    parser.add_argument("--preset", default="high")
    parser.add_argument("--counts", default="1,2,4")
    parser.add_argument("--cores", type=int, default=2)
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--nodes", default="10,100,1000")
    arguments = parser.parse_args()
    level = [arguments.relume, "bake", arguments.level]
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        plan, report = folder / "plan.relume", folder / "report.json"

        def timed(*command):
            """The least wall and processor seconds, and the least of each stage."""
            times, tables = [], []
            for _ in range(arguments.repeat):
                times.append(run(*command, "--report", report, "--force"))
                table = stages(report)
                table["whole process"] = times[-1][0]
                tables.append(table)
            return min(times), least(tables)

        def show(title, table):
            print(f"\n{title}")
            for stage, seconds in table.items():
                if seconds >= 0.001:
                    print(f"  {stage:16} {seconds:8.3f} s")

        preset = ["--preset", arguments.preset]
        (wall, plain_cpu), table = timed(*level, "-o", folder / "plain.relume", *preset, "--threads", arguments.cores)
        show(f"plain bake, {arguments.cores} threads: {wall:.2f} s, {plain_cpu:.2f} s of processors", table)
        (plan_wall, plan_cpu), plan_stages = timed(*level, "--plan", plan, *preset, "--threads", arguments.cores)
        show(f"plan, {arguments.cores} threads: {plan_cpu:.2f} s of processors, {plan.stat().st_size / 2**20:.1f} MiB", plan_stages)
        shard_stages = None
        rows = []
        for count in [int(each) for each in arguments.counts.split(",")]:
            parts = [folder / f"shard-{i}.relume" for i in range(1, count + 1)]

            def trace(i, count=count, parts=parts):
                run(*level, "--plan", plan, "--shard", f"{i}/{count}", "-o", parts[i - 1], "--threads", 1, "--force",
                    "--report", folder / f"report-{i}.json")

            walls, cpus = [], []
            for _ in range(arguments.repeat):
                before, begin = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
                with concurrent.futures.ThreadPoolExecutor(arguments.cores) as pool:
                    list(pool.map(trace, range(1, count + 1)))
                walls.append(time.monotonic() - begin)
                after = resource.getrusage(resource.RUSAGE_CHILDREN)
                cpus.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
                if count == 1:
                    shard_stages = least([each for each in [shard_stages, stages(folder / "report-1.json")] if each])
            (merge_wall, merge_cpu), merge_stages = timed(arguments.relume, "merge", plan, *parts, "-o", folder / "merged.relume")
            if not filecmp.cmp(folder / "merged.relume", folder / "plain.relume", shallow=False):
                raise SystemExit(f"{count} shards give other bytes")
            size = sum(part.stat().st_size for part in parts)
            rows.append((count, min(walls), min(cpus), size, merge_wall))
        show("all caches as one shard, 1 thread", {**shard_stages, "whole process": rows[0][1]})
        show(f"merge of {rows[-1][0]}", merge_stages)
        print(f"\n| shards | plan | shards, {arguments.cores} at a time | of processors | merge | together | MiB of shards |")
        print("|---:|---:|---:|---:|---:|---:|---:|")
        for count, wall, cpu, size, merge_wall in rows:
            print(f"| {count} | {plan_wall:.2f} s | {wall:.2f} s | {cpu:.2f} s | {merge_wall:.2f} s | "
                  f"{plan_wall + wall + merge_wall:.2f} s | {size / 2**20:.1f} |")
        # On paper, in seconds of processors, which other loads change little: n shards take n times what each repeats, and
        # what is divided once.
        first, last = rows[0], rows[-1]
        repeated = (last[2] - first[2]) / (last[0] - first[0])
        divided = first[2] - first[0] * repeated
        print(f"\nseconds of processors: plain {plain_cpu:.2f}; plan {plan_cpu:.2f}; a shard repeats {repeated:.2f}; divided "
              f"{divided:.2f}; merge {merge_cpu:.2f}")
        print("| nodes of a core | plan | a shard repeats | its links | merge | together | times faster than one |")
        print("|---:|---:|---:|---:|---:|---:|---:|")
        for nodes in [*(int(each) for each in arguments.nodes.split(",")), None]:
            links = divided / nodes if nodes else 0.0
            together = plan_cpu + repeated + links + merge_cpu
            print(f"| {nodes or 'no end'} | {plan_cpu:.2f} s | {repeated:.2f} s | {links:.3f} s | {merge_cpu:.2f} s | "
                  f"{together:.2f} s | {plain_cpu / together:.2f} |")


if __name__ == "__main__":
    main()
