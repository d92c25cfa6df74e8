#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The evaluation of PIC (Jendersie et al. 2016, Section 5) once more, with its figures beside ours: docs/notes/pic.md.

    python3 tests/measure/pic_evaluation.py FOLDER [fig7|fig8|fig9|fig10|fig11|table2|table3|table4]...

Runs build/release/tools/cli/relume on Sponza and its references in RELUME_SHARED_DIR, and on samples/area_lights.
Prints tables; FOLDER gets the bakes, which are made once, and the pictures, pic_fig7.jpg to pic_fig10.jpg.
"""
import json
import os
import pathlib
import subprocess
import sys

import numpy

import pictures

ROOT = pathlib.Path(__file__).resolve().parents[2]
RELUME = ROOT / "build/release/tools/cli/relume"
SHARED = pathlib.Path(os.environ.get("RELUME_SHARED_DIR", ""))
SPONZA, STARS = SHARED / "scenes/sponza/sponza.glb", ROOT / "samples/area_lights/stars.glb"
FOLDER = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else None
SIZE = "240x135"


def relume(*words):
    """What it printed."""
    command = [str(RELUME), *map(str, words), "--progress", "none"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        sys.exit(f"{' '.join(command)}:\n{done.stdout}{done.stderr}")
    return done.stdout


def bake(name, *options, level=SPONZA, preset="paper"):
    """A bake at PIC's settings: n_C 10585 asked for, n_S 128k, n_L 254 for every cache."""
    path = FOLDER / f"{name}.relume"
    if not path.exists():
        relume("bake", level, "-o", path, "--preset", preset, *options)
    return path


# The paper's cuts: the largest transfer is refined, children weigh by area.
PAPER_CUTS = ("--cut-key", "transfer", "--pull", "area")


def draw(name, level, *options):
    image = FOLDER / f"{name}.exr"
    relume("render", level, "--samples", 2, "-o", image, *options)
    return pictures.rgb(pictures.read_exr(image))


def trace(name, level, *options):
    """A reference, traced once."""
    image = FOLDER / f"{name}.exr"
    if not image.exists():
        relume("reference", level, "-o", image, *options)
    return pictures.read_exr(image)


def bench(path, bands, threads=1, backend="cpu", repeat=60):
    """Milliseconds of each pass, the least of some frames, for machines that do other work as well; MiB of each buffer."""
    report = json.loads(relume("bench", "--bake", path, "--relight-bands", bands, "--threads", threads, "--backend", backend,
                               "--repeat", repeat, "--json"))
    run = report["settings"][0]["relight"][0]
    return ({p: t["minMs"] for p, t in run["passes"].items()}, {b: n / 2 ** 20 for b, n in run["bufferBytes"].items()},
            report["settings"][0]["sizes"])


def row(*cells):
    print("| " + " | ".join(f"{c:.3g}" if isinstance(c, float) else str(c) for c in cells) + " |")


def head(title, *cells):
    print(f"\n### {title}\n")
    row(*cells)
    print("|---|" + "---:|" * (len(cells) - 1))


def less_noise(picture, truth, image, layers, mask):
    """pictures.error_of() without the truth's own noise, of which half the difference of two halves tells; energy."""
    error, energy = pictures.error_of(picture, truth, mask)
    noise = sum((pictures.rgb(image, layer)[mask].astype(float) ** 2).mean() for layer in layers)
    return max(error ** 2 - (100 / truth[mask].mean()) ** 2 * noise, 0) ** 0.5, energy


def stops_of(picture):
    """The exposure that makes the mean middle grey."""
    return numpy.log2(0.18 / picture.mean())


def luma(picture):
    return picture @ numpy.array([0.25, 0.5, 0.25])


def same(bands):
    return f"Y{bands}Co{bands}Cg{bands}"


def figure7():
    path = bake("stars", level=STARS)
    lights = {"star_red": "14,3.5,2.1", "star_green": "4.2,14,3.5", "star_blue": "2.8,5.6,14", "star_yellow": "14,11,2.8",
              "ring": "9,8.6,8.1"}
    head("Fig. 7: area lights", "on", "RMSE of light that arrives %", "energy")
    shown = []
    for on in ("star_red", "star_red,star_green,star_blue,star_yellow", "ring"):
        emissions = [w for name in on.split(",") for w in ("--emission", f"{name}={lights[name]}")]
        options = ("--lights", "none", "--size", "240x150", *emissions)
        truth = trace("stars_" + on.replace(",", "_"), STARS, "--spp", 96, *options)
        full = draw("stars_full", STARS, "--bake", path, "--aov", "full", *options)
        links = draw("stars_links", STARS, "--bake", path, "--aov", "indirect", *options)
        # All of it is light over links; what emits is left out, for it is drawn as it is.
        mask = (pictures.rgb(truth, "Emit").max(axis=2) == 0) & (pictures.rgb(truth, "DiffCol").min(axis=2) > 0.02)
        arrived = pictures.rgb(truth, "DiffDir") + pictures.rgb(truth, "DiffInd")
        row(on.replace("star_", "").replace(",", ", "), *less_noise(links, arrived, truth, ("DiffIndErr", "DiffDirErr"), mask))
        shown.append([pictures.to_srgb(p, 1) for p in (full, pictures.rgb(truth))])
    pictures.montage(FOLDER / "pic_fig7.jpg", [list(column) for column in zip(*shown)])


def figure8():
    # An exponent n about the half vector is n / 4 about the reflected direction, which turns twice as far.
    view = ("--camera", "cam_arcade", "--lights", "torch", "--size", SIZE, "--exponent", 30 / 4)
    truth = trace("fig8", SPONZA, "--spp", 96, *view)
    wanted = pictures.rgb(truth, "GlossInd") + pictures.rgb(truth, "GlossDir")
    path = bake("oct6")
    mask = truth["Depth.Z"] > 0
    head("Fig. 8: glossy reflections, exponent 30", "bands", "RMSE %", "energy", "caches ms", "all passes ms", "MiB")
    stops = stops_of(wanted)
    shown = [pictures.to_srgb(wanted, stops)]
    for name in [same(b) for b in range(2, 9)] + ["Y6Co3Cg3", "Y8Co4Cg4"]:
        drawn = draw("fig8_" + name, SPONZA, "--bake", path, "--bands", name, "--aov", "glossy", *view)
        passes, buffers, _ = bench(path, name)
        row(name, *less_noise(drawn, wanted, truth, ("GlossIndErr", "GlossDirErr"), mask), passes["caches"], passes["frame"], sum(buffers.values()))
        if name in (same(2), same(4), same(8), "Y8Co4Cg4"):
            shown.append(pictures.to_srgb(drawn, stops))
    pictures.montage(FOLDER / "pic_fig8.jpg", [shown[:3], shown[3:] + [pictures.to_srgb(abs(drawn - wanted), stops)]])


def figure9a():
    # Caches of texels that lie behind other geometry are black; the paper: "back-face culling during the ray-cast" mends it.
    reference = pictures.read_exr(SHARED / "references/sponza/cam_atrium__sun.exr")
    truth, mask = pictures.rgb(reference, "DiffInd"), pictures.rgb(reference, "DiffCol").min(axis=2) > 0.02
    lit = mask & (luma(truth) > 0.25 * luma(truth)[mask].mean())
    anywhere, culled = FOLDER / "anywhere.json", FOLDER / "culled.json"
    anywhere.write_text('{"playSpace": {"mode": "all"}, "caches": {"maxBackFaceShare": 1}}')
    culled.write_text('{"playSpace": {"mode": "all"}}')
    bakes = {"of all surfaces, wherever they lie": bake("anywhere", "--options", anywhere),
             "and moved or dropped by the back faces they see": bake("culled", "--options", culled),
             "ours: of what can be seen, moved likewise": bake("oct6")}
    head("Fig. 9 (a): misplaced caches", "caches", "RMSE %", "energy", "pixels with less than a quarter of their light %")
    shown = [pictures.to_srgb(truth, stops_of(truth[mask]))]
    for name, path in bakes.items():
        drawn = draw("fig9a_drawn", SPONZA, "--bake", path, "--camera", "cam_atrium", "--lights", "sun", "--size", "320x180",
                     "--aov", "indirect")
        dark = lit & (luma(drawn) < 0.25 * luma(truth))
        row(name, *less_noise(drawn, truth, reference, ("DiffIndErr",), mask), 100 * dark.sum() / mask.sum())
        shown.append(pictures.to_srgb(drawn, stops_of(truth[mask])))
    pictures.montage(FOLDER / "pic_fig9a.jpg", [shown[:2], shown[2:]])


def figure9():
    figure9a()
    # (b) a small spotlight on the floor of the lower arcade; (c) its light, reflected once, seen from the upper floor.
    spot = FOLDER / "spot.json"
    camera = json.loads((SHARED / "references/sponza/cam_arcade__torch.json").read_text())["camera_to_world_gltf"]
    eye, back = [r[3] for r in camera], [r[2] for r in camera]
    at = [eye[0] - 3 * back[0], eye[1] + 0.5, eye[2] - 3 * back[2]]
    spot.write_text(json.dumps([{"type": "spot", "name": "small", "position": at, "direction": [0, -1, 0], "intensity": 100,
                                 "innerConeAngle": 0.15, "outerConeAngle": 0.25}]))
    light = ("--lights", "none", "--lights-file", spot, "--size", "160x90")
    plain = FOLDER / "plain_metric.json"  # the paper's metric of clusters
    plain.write_text('{"clustering": {"outlookWeight": 0}}')
    # Caches that read every surfel their rays hit have no noise of cuts, nor light of clusters that they do not see.
    leaves = bake("leaves", "--links", 2048, "--max-links", 2048)
    bakes = {"the paper's cuts": bake("cone_plain", "--link-kind", "cone", "--options", plain, *PAPER_CUTS),
             "ours, the same n_L": bake("oct6"), "no cuts": leaves}
    floor = draw("fig9b", SPONZA, "--bake", leaves, "--camera", "cam_arcade", "--aov", "bounced", *light)
    dark = {c: trace("fig9c_" + c, SPONZA, "--camera", c, "--spp", 512, "--bounces", 1, *light) for c in ("cam_balcony", "cam_arcade")}
    lit = pictures.rgb(dark["cam_arcade"], "DiffInd").mean()
    black = (dark["cam_balcony"]["Depth.Z"] > 0) & (pictures.rgb(dark["cam_balcony"], "DiffInd").max(axis=2) == 0)
    head("Fig. 9: noise of cuts and bleeding", "bake", "(b) RMSE to no cuts %", "(b) of it finer than 5 pixels %",
         "(c) light where there is none, of the arcade's mean")
    stops = 0.18 / lit * 0.5
    shown = [[], []]
    for name, path in bakes.items():
        drawn = draw("fig9b_drawn", SPONZA, "--bake", path, "--camera", "cam_arcade", "--aov", "bounced", *light)
        # Noise of cuts is what the error has beyond its mean over 5 x 5 pixels.
        error = luma(drawn - floor)
        padded = numpy.pad(error, 2, mode="edge")
        blurred = sum(padded[y:y + error.shape[0], x:x + error.shape[1]] for y in range(5) for x in range(5)) / 25
        mean = luma(floor).mean()
        once = draw("fig9c_drawn", SPONZA, "--bake", path, "--camera", "cam_balcony", "--bounces", 1, "--aov", "bounced", *light)
        row(name, *(f"{100 * (e ** 2).mean() ** 0.5 / mean:.1f}" for e in (error, error - blurred)), f"{once[black].mean() / lit:.1e}")
        shown[0].append(pictures.to_srgb(drawn * stops))
        shown[1].append(pictures.to_srgb(once * stops * 4096))
    print(f"\n{100 * black.mean():.0f} % of the upper corridor's view get no light that is reflected once.")
    pictures.montage(FOLDER / "pic_fig9.jpg", shown)


def figure10():
    truth = pictures.read_exr(SHARED / "references/sponza/cam_arcade__torch.exr")
    wanted, mask = pictures.rgb(truth, "DiffInd"), pictures.rgb(truth, "DiffCol").min(axis=2) > 0.02
    counts, links = (16, 32, 64, 128), (32, 64, 128, 254)
    head("Fig. 10: surfels and links: RMSE %, ms of the caches", "n_L", *[f"n_S {c}k" for c in counts])
    surfels, shown = [], []
    for n in links:
        cells, pictures_row = [], []
        for count in counts:
            path = bake(f"s{count}_l{n}", "--surfels", 1024 * count, "--links", n, "--max-links", n)
            drawn = draw("fig10", SPONZA, "--bake", path, "--camera", "cam_arcade", "--lights", "torch", "--aov", "bounced",
                         "--size", "320x180", "--bands", same(4))
            passes, _, _ = bench(path, same(4))
            cells.append(f"{less_noise(drawn, wanted, truth, ('DiffIndErr',), mask)[0]:.1f}, {passes['caches']:.2f}")
            pictures_row.append(pictures.to_srgb(drawn[::2, ::2], stops_of(wanted)))
            if n == links[-1]:
                surfels.append(f"{passes['surfels']:.2f} + {passes['pull']:.2f}")
        row(n, *cells)
        shown.append(pictures_row)
    row("surfels + pull, ms", *surfels)
    pictures.montage(FOLDER / "pic_fig10.jpg", shown, 75)


def figure11():
    cone, oct6 = bake("cone", "--link-kind", "cone"), bake("oct6")
    head("Fig. 11: bands, ms of the caches' pass", "l", "SH links", "MiB of links", "cone links", "MiB", "oct6 links", "MiB")
    for bands in range(2, 9):
        sh = bake(f"sh{bands}", "--link-kind", "sh", "--link-bands", bands, "--luma-bands", bands, "--chroma-bands", bands)
        cells = []
        for path in (sh, cone, oct6):
            passes, buffers, _ = bench(path, same(bands))
            cells += [passes["caches"], buffers["links"]]
        sh.unlink()
        row(bands, *cells)


def table2():
    settings = {"1": (bake("oct6"), same(4)), "2": (bake("s32_l128", "--surfels", 32768, "--links", 128, "--max-links", 128), same(3))}
    head("Table 2: ms a frame, Sponza", "setting, where", "surfel lighting", "pull", "cache lighting", "all three")
    for number, (path, bands) in settings.items():
        for backend, threads in (("cpu", 1), ("cpu", 2), ("gl", 2)):
            passes, _, _ = bench(path, bands, threads, backend)
            row(f"{number}, {backend}" + (f", {threads} threads" if backend == "cpu" else ""), passes["surfels"], passes["pull"],
                passes["caches"], passes["frame"])


def table3():
    path = bake("oct6")
    head("Table 3: ms of the caches' pass, one thread", "CoCg \\ Y", *[f"{y}" for y in range(2, 9)])
    for c in range(2, 9):
        row(c, *[("–" if c > y else bench(path, f"Y{y}Co{c}Cg{c}")[0]["caches"]) for y in range(2, 9)])


def table4():
    head("Table 4: MiB at setting 1", "bake", "surfels", "hierarchy, radiosity", "links", "caches", "indices", "bounce, emission", "all", "links, caches")
    for name, path in (("oct6", bake("oct6")), ("cone", bake("cone", "--link-kind", "cone")), ("preset high", bake("high", preset="high"))):
        _, b, sizes = bench(path, same(4), repeat=2)
        row(name, b["surfels"], b["hierarchy"] + b["radiosity"], b["links"], b["caches"], b["index"], b["bounce"] + b.get("emission", 0.0),
            sum(b.values()), f"{sizes['links']}, {sizes['caches']}")


def main():
    steps = {"fig7": figure7, "fig8": figure8, "fig9": figure9, "fig10": figure10, "fig11": figure11, "table2": table2,
             "table3": table3, "table4": table4}
    if FOLDER is None or any(word not in steps for word in sys.argv[2:]):
        sys.exit(__doc__)
    if not SPONZA.exists():
        sys.exit("RELUME_SHARED_DIR: expected a folder with scenes/sponza/sponza.glb")
    FOLDER.mkdir(parents=True, exist_ok=True)
    for word in sys.argv[2:] or steps:
        steps[word]()
        sys.stdout.flush()


main()
