#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Make samples/area_lights/stars.glb: a room lit by nothing but area lights, after Fig. 7 of the paper that Relume
follows (PIC): four asterisks and a ring on the ceiling, each an emitter with a material of its own, and a dark screen
on the far wall, which is marked as drivable. Film film.sh turns them on and off. The same bytes on every run; needs
nothing but Python.

    samples/area_lights/make_level.py [OUTPUT.glb]
"""
import math
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "level"))
from make_level import Glb, Mesh, ball, look_along, rotated, tube  # noqa: E402

WIDTH, DEPTH, HEIGHT = 5.0, 4.0, 2.6  # [m] x, z, y of the room
EMITTERS_AT = HEIGHT - 0.02           # [m] they hang a little below the ceiling
STARS = {"star_red": ((1.0, 0.9), (1.0, 0.25, 0.15)), "star_green": ((4.0, 0.9), (0.3, 1.0, 0.25)),
         "star_blue": ((1.0, 3.1), (0.2, 0.4, 1.0)), "star_yellow": ((4.0, 3.1), (1.0, 0.8, 0.2))}
RING = ((2.5, 2.0), (1.0, 0.95, 0.9))
STRENGTH = 14.0  # [W/m²/sr]

MATERIALS = {
    "white": (0.75, 0.75, 0.72), "grey": (0.45, 0.45, 0.48), "warm": (0.7, 0.4, 0.3), "cool": (0.3, 0.45, 0.65),
    "frame": (0.1, 0.1, 0.1), "screen": (0.05, 0.05, 0.05),
}


def polygon(mesh, corners):
    """A convex polygon that faces down; corners (x, z) clockwise seen from below."""
    first = len(mesh.position)
    mesh.position += [(x, EMITTERS_AT, z) for x, z in corners]
    mesh.normal += [(0.0, -1.0, 0.0)] * len(corners)
    mesh.uv += [(0.0, 0.0)] * len(corners)
    for i in range(1, len(corners) - 1):
        mesh.index += [first, first + i, first + i + 1]


def asterisk(material, at, width=0.09, reach=0.36):
    """Six arms around a hexagon whose sides are as long as the arms are wide."""
    mesh = Mesh(material)

    def point(angle, along, across):
        c, s = math.cos(angle), math.sin(angle)
        return (at[0] + c * along - s * across, at[1] + s * along + c * across)

    inner = 0.5 * math.sqrt(3.0) * width
    polygon(mesh, [point(math.pi / 6 + i * math.pi / 3, width, 0.0) for i in range(6)])
    for i in range(6):
        angle = i * math.pi / 3
        polygon(mesh, [point(angle, inner, -width / 2), point(angle, reach, -width / 2),
                       point(angle, reach, width / 2), point(angle, inner, width / 2)])
    return mesh


def ring(material, at, inner=0.42, outer=0.55, segments=24):
    mesh = Mesh(material)

    def point(i, radius):
        angle = 2.0 * math.pi * i / segments
        return (at[0] + radius * math.cos(angle), at[1] + radius * math.sin(angle))

    for i in range(segments):
        polygon(mesh, [point(i, inner), point(i, outer), point(i + 1, outer), point(i + 1, inner)])
    return mesh


def meshes():
    """Name and mesh of every part."""
    shell = {
        "floor": Mesh("white"), "ceiling": Mesh("white"), "back": Mesh("white"), "front": Mesh("white"),
        "left": Mesh("warm"), "right": Mesh("cool"),
    }
    w, h, d = WIDTH, HEIGHT, DEPTH
    shell["floor"].quad([(0, 0, 0), (0, 0, d), (w, 0, d), (w, 0, 0)], (0.0, 1.0, 0.0))
    shell["ceiling"].quad([(0, h, 0), (w, h, 0), (w, h, d), (0, h, d)], (0.0, -1.0, 0.0))
    shell["back"].quad([(0, 0, 0), (w, 0, 0), (w, h, 0), (0, h, 0)], (0.0, 0.0, 1.0))
    shell["front"].quad([(w, 0, d), (0, 0, d), (0, h, d), (w, h, d)], (0.0, 0.0, -1.0))
    shell["left"].quad([(0, 0, d), (0, 0, 0), (0, h, 0), (0, h, d)], (1.0, 0.0, 0.0))
    shell["right"].quad([(w, 0, 0), (w, 0, d), (w, h, d), (w, h, 0)], (-1.0, 0.0, 0.0))
    parts = list(shell.items())

    table = Mesh("grey").box((-0.7, 0.68, -0.4), (0.7, 0.74, 0.4))
    for x in (-0.62, 0.56):
        for z in (-0.34, 0.28):
            table.box((x, 0.0, z), (x + 0.06, 0.68, z + 0.06), skip=("+y", "-y"))
    parts.append(("table", rotated(table, 0.35, (2.5, 0.0, 2.1))))
    parts.append(("block", rotated(Mesh("white").box((-0.3, 0.0, -0.3), (0.3, 1.1, 0.3), skip=("-y",)), 0.5,
                                   (0.95, 0.0, 1.2))))
    parts.append(("pillar", rotated(tube("white", 0.16, 0.0, 1.5, 24, top=True), 0.0, (4.05, 0.0, 1.3))))
    globe = ball("white", 0.2, 12, 24)
    globe.position = [(x + 2.45, y + 0.94, z + 2.1) for x, y, z in globe.position]
    parts.append(("globe", globe))

    for name, (at, _) in STARS.items():
        parts.append((name, asterisk(name, at)))
    parts.append(("ring", ring("ring", RING[0])))

    parts.append(("frame", Mesh("frame").box((1.55, 0.85, 0.0), (3.45, 1.95, 0.04), skip=("-z",))))
    screen = Mesh("screen")
    screen.quad([(1.6, 0.9, 0.05), (3.4, 0.9, 0.05), (3.4, 1.9, 0.05), (1.6, 1.9, 0.05)], (0.0, 0.0, 1.0),
                [(0.0, 1.0), (1.0, 1.0), (1.0, 0.0), (0.0, 0.0)])
    parts.append(("screen", screen))
    return parts


def materials():
    entries = []
    for name, color in MATERIALS.items():
        entries.append({"name": name, "pbrMetallicRoughness": {"baseColorFactor": [*color, 1.0], "metallicFactor": 0.0,
                                                               "roughnessFactor": 0.9}})
        if name == "screen":
            entries[-1]["extras"] = {"relume": {"drivable": True}}
    for name, (_, color) in [*STARS.items(), ("ring", RING)]:
        entries.append({"name": name, "emissiveFactor": list(color),
                        "pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.5, 0.5, 1.0], "metallicFactor": 0.0,
                                                 "roughnessFactor": 0.9},
                        "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": STRENGTH}}})
    return entries


def build():
    glb, nodes, entries = Glb(), [], []
    listed = materials()
    index = {material["name"]: i for i, material in enumerate(listed)}
    for name, mesh in meshes():
        attributes = {"POSITION": glb.floats(mesh.position, bounds=True), "NORMAL": glb.floats(mesh.normal)}
        if name == "screen":
            attributes["TEXCOORD_0"] = glb.floats(mesh.uv)
        entries.append({"name": name, "primitives": [{"attributes": attributes, "indices": glb.indices(mesh.index),
                                                      "material": index[mesh.material]}]})
        nodes.append({"name": name, "mesh": len(entries) - 1})
    cameras = [{"name": "cam", "type": "perspective", "perspective": {"yfov": 1.15, "znear": 0.02, "zfar": 100.0}}]
    at, toward = (2.75, 1.4, 3.9), (2.4, 1.2, 0.6)
    nodes.append({"name": "cam", "camera": 0, "translation": list(at),
                  "rotation": look_along([b - a for a, b in zip(at, toward)])})
    nodes.append({"name": "play", "translation": [WIDTH / 2, HEIGHT / 2, DEPTH / 2],
                  "extras": {"relume": {"volume": [WIDTH - 0.2, HEIGHT - 0.2, DEPTH - 0.2]}}})
    return glb.bytes({
        "asset": {"version": "2.0", "generator": "samples/area_lights/make_level.py"},
        "extensionsUsed": ["KHR_materials_emissive_strength"],
        "scene": 0, "scenes": [{"name": "stars", "nodes": list(range(len(nodes)))}],
        "nodes": nodes, "meshes": entries, "cameras": cameras, "materials": listed,
    })


if __name__ == "__main__":
    output = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else pathlib.Path(__file__).with_name("stars.glb")
    output.write_bytes(build())
    print(f"{output}: {output.stat().st_size} bytes")
