# SPDX-License-Identifier: MIT
"""Relume's bake beside Cycles' on the same light map: CPU seconds to equal error, and what the next change of a light costs.

    python3 tests/measure/beside_blender.py FOLDER LEVEL.glb LIGHT BOUNCES [LEVEL.glb LIGHT BOUNCES ...]

Runs the programs of build/release and Blender; FOLDER is for their files. Prints rows of docs/notes/beside_blender.md.
Cycles' error falls with the root of the samples and its seconds grow with them, so that both follow from one bake that is
fine enough; each of its rows is checked against that in the log.
"""
import pathlib
import re
import resource
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
RELUME, BENCH = ROOT / "build/release/tools/cli/relume", ROOT / "build/release/tests/measure/bench_lightmap_error"
SAMPLES, TRUTH = (16, 64, 256), 2048


def run(*command):
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False)
    if done.returncode:
        sys.exit(f"{command}:\n{done.stdout}{done.stderr}")
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return done.stdout, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def measure(folder, level, light, bounces):
    name = pathlib.Path(level).stem
    local, bake, game = folder / f"{name}.glb", folder / f"{name}.relume", folder / f"{name}_game.glb"
    local.unlink(missing_ok=True)
    local.symlink_to(pathlib.Path(level).resolve())
    _, bake_s = run(RELUME, "bake", local, "-o", bake, "--preset", "high", "--progress", "none", "--force")
    run(RELUME, "export", local, bake, "-o", game, "--force")
    prefix = folder / f"{name}_{light}"
    said, _ = run("blender", "-b", "--factory-startup", "--python-exit-code", "1", "--python", ROOT / "tests/measure/cycles_bake.py", "--", game, light, bounces,
                  prefix, TRUTH, TRUTH, *SAMPLES)
    seconds = [float(s) for s in re.findall(r"cycles_bake: \d+ samples ([\d.]+) s", said)]
    rows, _ = run(BENCH, local, bake, light, *[f"{prefix}_{i}.raw" for i in range(2 + len(SAMPLES))])
    print(rows, "CPU seconds of Cycles:", seconds, flush=True)
    relit = re.search(r"([\d.]+) ms the last", rows).group(1)
    errors = [(float(a), float(b)) for a, b in re.findall(r"^\| \S+ \| ([\d.]+) \| ([\d.]+) ", rows, re.M)]
    (ours, ours_t1), theirs = errors[0], errors[-1]
    per_sample = (seconds[1] - seconds[2]) / (TRUTH - SAMPLES[0])
    fixed = seconds[2] - SAMPLES[0] * per_sample
    equal = [fixed + per_sample * SAMPLES[-1] * (them / us) ** 2 for us, them in zip((ours, ours_t1), theirs)]
    return f"| {name}, {light} | {ours:.1f} | {ours_t1:.1f} | {bake_s:.0f} | {equal[0]:.0f} | {equal[1]:.0f} | {relit} |"


def main():
    if len(sys.argv) < 5 or len(sys.argv) % 3 != 2:
        sys.exit(__doc__)
    folder = pathlib.Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    table = [measure(folder, *sys.argv[i:i + 3]) for i in range(2, len(sys.argv), 3)]
    print("| | RMSE % | t1 % | Relume bakes, all lights, CPU s | Cycles to that RMSE, one light, CPU s | to that t1 | a frame of Relume, ms |")
    print("|---|---:|---:|---:|---:|---:|---:|")
    print("\n".join(table))


main()
