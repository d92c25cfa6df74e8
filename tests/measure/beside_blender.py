# SPDX-License-Identifier: MIT
"""Relume's bake beside Cycles' of the same light map: error of views, and CPU seconds.

    python3 tests/measure/beside_blender.py FOLDER LEVEL.glb LIGHT BOUNCES CAMERA=REFERENCE.exr...

Runs the programs of build/release and Blender; FOLDER is for their files. Prints the tables of docs/notes/beside_blender.md.
"""
import pathlib
import re
import resource
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
RELUME, BENCH = ROOT / "build/release/tools/cli/relume", ROOT / "build/release/tests/measure/bench_lightmap_error"
SAMPLES = (16, 64, 256, 1024, 4096)


def run(*command):
    """What it printed, and its CPU seconds."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False)
    if done.returncode:
        sys.exit(f"{command}:\n{done.stdout}{done.stderr}")
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return done.stdout, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main():
    if len(sys.argv) < 6 or any("=" not in view for view in sys.argv[5:]):
        sys.exit(__doc__)
    folder, level, light, bounces, *views = sys.argv[1:]
    folder = pathlib.Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    name = pathlib.Path(level).stem
    local, bake, game = folder / f"{name}.glb", folder / f"{name}.relume", folder / f"{name}_game.glb"
    local.unlink(missing_ok=True)
    local.symlink_to(pathlib.Path(level).resolve())
    _, seconds = run(RELUME, "bake", local, "-o", bake, "--preset", "high", "--progress", "none", "--force")
    run(RELUME, "export", local, bake, "-o", game, "--force")
    prefix = folder / f"{name}_{light}"
    said, _ = run("blender", "-b", "--factory-startup", "--python-exit-code", "1", "--python",
                  ROOT / "tests/measure/cycles_bake.py", "--", game, light, bounces, prefix, *SAMPLES)
    times = re.findall(r"cycles_bake: (\d+) samples ([\d.]+) s", said)
    print(f"{name}: Relume's bake, for all lights, {seconds:.1f} CPU s; Cycles', for {light}, "
          + ", ".join(f"{float(s):.1f} with {n} samples" for n, s in times), flush=True)
    for view in views:
        camera, reference = view.split("=", 1)
        rows, _ = run(BENCH, local, bake, camera, light, reference, *[f"{prefix}_{i}.raw" for i in range(len(SAMPLES))])
        for i, samples in enumerate(SAMPLES):
            rows = rows.replace(f"{prefix}_{i}.raw", f"Cycles, {samples}")
        print("\n" + rows, flush=True)


main()
