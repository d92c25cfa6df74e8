#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Table 1 and figures of CRC (Vardis et al. 2014) once more, with its numbers beside ours: docs/notes/crc.md.

    python3 tests/measure/crc_tables.py FOLDER [table1|lab|fig4|fig5|fig6|fig8|fig9|fig10|error]...

Runs build/release/tools/cli/relume, or the program that RELUME names, and bench_picture_error on the levels and
references in RELUME_SHARED_DIR. Prints tables; FOLDER gets the pictures, crc_fig4.jpg to crc_fig8.jpg.
"""
import json
import os
import pathlib
import resource
import subprocess
import sys

import glb
import pictures

ROOT = pathlib.Path(__file__).resolve().parents[2]
RELUME = pathlib.Path(os.environ.get("RELUME", ROOT / "build/release/tools/cli/relume"))
ERROR = ROOT / "build/release/tests/measure/bench_picture_error"
SHARED = pathlib.Path(os.environ.get("RELUME_SHARED_DIR", ""))
SPOTS = ROOT / "tests/measure/red_green_spots.json"
FOLDER = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else None
CPU_MS = 2000  # of the frames that are timed
FRAMES = 16  # of the pictures that are compared with each other
PASSES = ("occupancy", "first bounce", "next bounces", "blend", "resolve")

# Scene of the print, level, camera, lights, cells, samples, bounces, exposure [stops]; times of the print [ms]: all
# cells, occupied ones, Y3Co2Cg2, Y3Co1Cg1; its share of occupied cells [%] and RMSE in Lab [%].
ROWS = (
    ("Canyon", "gas_station", "cam_main", "sun", 16, 100, 1, 0, (2.24, 1.65, 1.52, 1.42), 24.13, 0.45),
    ("Barn", "breakfast_room", "cam_table", "lamp_a,lamp_b", 24, 200, 1, 1, (3.30, 3.12, 2.62, 2.61), 42.72, 0.25),
    ("Level1", "pandora", "cam_court", "sun,lamp", 24, 150, 2, 1, (4.33, 4.25, 3.61, 3.10), 49.65, 0.45),
    ("Temples", "sponza", "cam_atrium", "sun,torch", 32, 100, 2, 2, (2.88, 2.65, 2.10, 1.97), 72.67, 0.54),
)


def level_of(name):
    return SHARED / "scenes" / name / f"{name}.glb"


OF_FIG10 = (level_of("sponza"), "--camera", "cam_atrium", "--lights", "sun", "--rsm-samples", 100, "--bands", "Y3Co1Cg1")


def run(*words):
    command = [str(word) for word in words]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        sys.exit(f"{' '.join(command)}:\n{done.stdout}{done.stderr}")
    return done.stdout


def render(image, level, *options):
    """The report of a picture by reflective shadow maps; `level` is a path."""
    said = run(RELUME, "render", level, "--live", "--live-transport", "rsm", "-o", FOLDER / f"{image}.exr", "--force",
               "--json", "--progress", "none", *options)
    return json.loads(said)


def read(image):
    return pictures.rgb(pictures.read_exr(FOLDER / f"{image}.exr"))


def occupancy(report, textures):
    """Share of cells that are active [%]: numbers of the active ones, and four floats a texture of all."""
    sizes = report["bufferBytes"]
    return 100 * (sizes["active cells"] / 4) / (sizes["cell light"] / (16 * textures))


def timed(*options):
    """CPU ms of a frame on all threads but for receivers' reads, and the report.

    From the CPU time of a run with many frames less that of one with few: what else runs on the machine matters little."""
    def cpu(frames):
        before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
        report = render("timed", *options, "--size", "320x180", "--samples", 1, "--rsm-frames", frames, "--aov", "indirect")
        return 1000 * (resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before), report
    few, report = min((cpu(2) for _ in range(2)), key=lambda run: run[0])
    estimate = sum(report["passMs"][name] for name in PASSES)
    frames = int(min(max(CPU_MS / estimate, 4), 1000))
    return (cpu(2 + frames)[0] - few) / frames, report


def table1():
    print("| scene: print / ours | step | occupied % | CPU ms a frame | of all cells' | print |")
    print("|---|---|---:|---:|---:|---:|")
    for scene, level, camera, lights, cells, samples, bounces, _, printed, share, _ in ROWS:
        occupied = "depth" if bounces == 1 else "voxels"
        steps = (("all cells", "none", "Y3Co3Cg3", 7), ("occupancy", occupied, "Y3Co3Cg3", 7),
                 ("Y3Co2Cg2", occupied, "Y3Co2Cg2", 5), ("Y3Co1Cg1", occupied, "Y3Co1Cg1", 3))
        first = None
        for (step, mode, bands, textures), ms in zip(steps, printed):
            cpu, report = timed(level_of(level), "--camera", camera, "--lights", lights, "--live-cells", cells,
                                "--rsm-samples", samples, "--bounces", bounces, "--occupancy", mode, "--bands", bands)
            first = first or cpu
            print(f"| {scene} / `{level}` {lights}, r {cells} | {step} | {occupancy(report, textures):.1f} | "
                  f"{cpu:.1f} | {cpu / first:.2f} | {ms / printed[0]:.2f} |", flush=True)
        print(f"| | print: {share} % occupied | | | | |")


def views_by_bands(prefix, level, modes, *options):
    for bands in modes:
        render(f"{prefix}_{bands}", level, "--bands", bands, "--size", "320x180", "--samples", 2, "--rsm-frames", FRAMES,
               *options)


def errors(exposure, prefix, modes):
    """Rows of bench_picture_error against the first mode."""
    return run(ERROR, exposure, *(FOLDER / f"{prefix}_{bands}.exr" for bands in modes)).replace(f"{prefix}_", "")


def lab():
    print("| view | Y3Co2Cg2: Lab RMSE, pdiff % | Y3Co1Cg1: Lab RMSE, pdiff % | print, Y3Co1Cg1 % |\n|---|---:|---:|---:|")
    for _, level, camera, lights, cells, samples, bounces, stops, _, _, printed in ROWS:
        modes = ("Y3Co3Cg3", "Y3Co2Cg2", "Y3Co1Cg1")
        views_by_bands(f"lab_{level}", level_of(level), modes, "--camera", camera, "--lights", lights, "--live-cells",
                       cells, "--rsm-samples", samples, "--bounces", bounces, "--aov", "full")
        rows = errors(stops, f"lab_{level}", modes).splitlines()
        two, one = (f"{columns[2].strip()}, {columns[5].strip()}" for columns in (row.split("|") for row in rows))
        print(f"| `{level}/{camera}` {lights}, {stops:+d} stops | {two} | {one} | {printed} |", flush=True)


def fig4():
    modes = ("Y3Co3Cg3", "Y3Co2Cg2", "Y3Co1Cg1", "Y2Co2Cg2")
    views_by_bands("fig4", level_of("cornell"), modes, "--camera", "cam_front", "--lights", "none", "--lights-file", SPOTS,
                   "--bounces", 2)
    print("| bands | Lab RMSE | FLIP mean | FLIP p95 | pdiff % |\n|---|---:|---:|---:|---:|\n" + errors(1, "fig4", modes), end="")
    shown = [pictures.to_srgb(read(f"fig4_{bands}"), 1) for bands in modes]
    pictures.montage(FOLDER / "crc_fig4.jpg", [shown[:2], shown[2:]])


def camera_of(path, name):
    """Place and unit vector ahead of a camera that is a root node."""
    scene, binary = glb.read(path)
    floor = next(m for m in scene["materials"] if m["name"] == "Floor")["pbrMetallicRoughness"]
    floor.pop("baseColorTexture", None)
    floor["baseColorFactor"] = [*colour, 1]
    made = FOLDER / f"sponza_floor_{'_'.join(map(str, colour))}.glb"
    glb.write(made, scene, binary)
    return made


def fig8():
    shown, modes = [], ("Y3Co3Cg3", "Y3Co2Cg2", "Y3Co1Cg1")
    print("| floor | bands | Lab RMSE | FLIP mean | FLIP p95 | pdiff % |\n|---|---|---:|---:|---:|---:|")
    for name, colour in (("grey", (0.3, 0.3, 0.3)), ("sienna", (0.36, 0.08, 0.027))):
        level = with_floor(level_of("sponza"), colour)
        views_by_bands(f"fig8_{name}", level, modes, "--camera", "cam_atrium", "--lights", "sun", "--bounces", 2,
                       "--rsm-size", 512, "--rsm-samples", 400)
        for row in errors(2, f"fig8_{name}", modes).splitlines():
            print(f"| {name} {row}", flush=True)
        shown.append([pictures.to_srgb(read(f"fig8_{name}_{bands}"), 2) for bands in modes])
    pictures.montage(FOLDER / "crc_fig8.jpg", shown)


def fig9():
    modes = ("Y3Co3Cg3", "Y3Co1Cg1", "Y2Co2Cg2")
    for level, camera, light, stops in (("cornell", "cam_corner", "spot", 3), ("sponza", "cam_atrium", "sun", 3),
                                        ("breakfast_room", "cam_main", "sun", 1)):
        views_by_bands(f"fig9_{level}", level_of(level), modes, "--camera", camera, "--lights", light, "--bounces", 2,
                       "--aov", "indirect")
        for row in errors(stops, f"fig9_{level}", modes).splitlines():
            print(f"| `{level}/{camera}` {light} {row}", flush=True)


def fig10():
    print("| r | occupied % | one bounce: CPU ms a frame | two bounces |\n|---:|---:|---:|---:|")
    for cells in (8, 16, 24, 32):
        once, report = timed(*OF_FIG10, "--live-cells", cells, "--bounces", 1)
        twice, _ = timed(*OF_FIG10, "--live-cells", cells, "--bounces", 2)
        print(f"| {cells} | {occupancy(report, 3):.1f} | {once:.1f} | {twice:.1f} |", flush=True)


def error():
    """Of the specification's views: three bands of chroma, by samples and by exact visibility; t1 has docs/ACCURACY.md."""
    print("| view | sampled: relative RMSE %, energy | exact |\n|---|---:|---:|")
    for level, camera, light, bounces in (("cornell", "cam_corner", "spot", "1"), ("cornell", "cam_corner", "spot", ""),
                                          ("sponza", "cam_arcade", "torch", ""), ("sponza", "cam_atrium", "sun", ""),
                                          ("breakfast_room", "cam_main", "sun", ""), ("pandora", "cam_hall", "sun", ""),
                                          ("fortitude", "cam_street", "sun", "")):
        name = f"{camera}__{light}" + ("__1bounce" if bounces else "")
        truth, cells = SHARED / "references" / level / f"{name}.exr", []
        for visibility in ("sampled", "exact"):
            render("error", level_of(level), "--camera", camera, "--lights", light, "--aov", "indirect", "--bands",
                   "Y3Co3Cg3", "--live-visibility", visibility, "--bounces", bounces or "converged", "--size", "320x180",
                   "--rsm-frames", FRAMES)
            report = json.loads(run(RELUME, "diff", FOLDER / "error.exr", truth, "--layer", "DiffInd", "--json"))
            cells.append(f"{100 * report['relativeRmse']:.1f}, {report['energy']:.3f}")
        print(f"| `{level}/{name}` | " + " | ".join(cells) + " |", flush=True)


def main():
    parts = {f.__name__: f for f in (table1, lab, fig4, fig5, fig6, fig8, fig9, fig10, error)}
    wanted = sys.argv[2:] or list(parts)
    if FOLDER is None or not set(wanted) <= set(parts):
        sys.exit(__doc__)
    FOLDER.mkdir(parents=True, exist_ok=True)
    for name in wanted:
        print(f"\n{name}\n", flush=True)
        parts[name]()


main()
