#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""What it would change if bakes took base colour (1 - metalness) as diffuse albedo, as glTF has it, in place of base colour:
the light that is reflected at least once, traced with both. A figure of docs/notes/gloss.md.

    python3 tests/measure/metal_albedo.py FOLDER LEVEL.glb CAMERA LIGHTS [PATHS]

Of levels without textures of metalness. FOLDER is for files.
"""
import pathlib
import subprocess
import sys

import glb
import numpy

import pictures

RELUME = pathlib.Path(__file__).resolve().parents[2] / "build/release/tools/cli/relume"


def darken_metals(source, target):
    """The level with glTF's diffuse albedo as base colour; returns its metals."""
    (gltf, binary), metals = glb.read(source), []
    for material in gltf["materials"]:
        rough = material.setdefault("pbrMetallicRoughness", {})
        if "metallicRoughnessTexture" in rough:
            sys.exit(f"{source}: material {material.get('name')} has its metalness in a texture")
        metalness = rough.get("metallicFactor", 1.0)
        if metalness > 0:
            metals.append(f"{material.get('name')} {metalness:g}")
        color = rough.get("baseColorFactor", [1.0, 1.0, 1.0, 1.0])
        rough["baseColorFactor"] = [c * (1 - metalness) for c in color[:3]] + color[3:]
    glb.write(target, gltf, binary)
    return metals


def main():
    if len(sys.argv) < 5:
        sys.exit(__doc__)
    folder, level, camera, lights = pathlib.Path(sys.argv[1]), sys.argv[2], sys.argv[3], sys.argv[4]
    folder.mkdir(parents=True, exist_ok=True)
    darker = folder / "darker.glb"
    metals = darken_metals(level, darker)
    images = []
    for name, scene in (("base", level), ("darker", darker)):
        image = folder / f"{name}.exr"
        subprocess.run([RELUME, "reference", scene, "--camera", camera, "--lights", lights, "--size", "160x90", "--spp",
                        sys.argv[5] if len(sys.argv) > 5 else "64", "-o", image, "--progress", "none"], check=True,
                       stdout=subprocess.DEVNULL)
        images.append(pictures.read_exr(image))
    # Where the surface itself is no metal: its own albedo is divided out of both.
    kept = numpy.abs(pictures.rgb(images[0], "DiffCol") - pictures.rgb(images[1], "DiffCol")).max(axis=2) < 1e-3
    base, dark = (pictures.rgb(image, "DiffInd") for image in images)
    error, energy = pictures.error_of(dark, base, kept)
    print(f"{pathlib.Path(level).name}, {camera}, {lights}: {len(metals)} metals ({', '.join(metals)}); {100 * kept.mean():.0f} % of the "
          f"picture is none; there reflected light is {energy:.3f} of what bakes have, RMSE {error:.1f} %")


main()
