#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Make a city block of a level: copies of all it has, cameras too, side by side on a square.

    tests/bench/make_city.py LEVEL.glb OUTPUT.glb --copies N [--unique]

The copies' nodes name the level's meshes; with --unique each copy has meshes of its own, as large as the level's in the
file as well. Materials and images are shared either way, and lights are the first copy's. Animations and skins are left
out. The same bytes on every run.
"""
import argparse
import copy
import itertools
import json
import math
import struct

IDENTITY = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]]


def times(a, b):
    return [[sum(a[row][k] * b[k][column] for k in range(4)) for column in range(4)] for row in range(4)]


def matrix(node):
    if "matrix" in node:
        return [[node["matrix"][4 * column + row] for column in range(4)] for row in range(4)]
    x, y, z, w = node.get("rotation", [0, 0, 0, 1])
    turn = [[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]]
    scale, place = node.get("scale", [1, 1, 1]), node.get("translation", [0, 0, 0])
    return [[turn[row][k] * scale[k] for k in range(3)] + [place[row]] for row in range(3)] + [[0.0, 0.0, 0.0, 1.0]]


def bounds(gltf):
    """Of all meshes in the scene, by the corners of their boxes."""
    low, high = [math.inf] * 3, [-math.inf] * 3

    def visit(index, above):
        node = gltf["nodes"][index]
        place = times(above, matrix(node))
        for primitive in gltf["meshes"][node["mesh"]]["primitives"] if "mesh" in node else []:
            box = gltf["accessors"][primitive["attributes"]["POSITION"]]
            for corner in itertools.product(*zip(box["min"], box["max"])):
                for k in range(3):
                    x = sum(place[k][m] * corner[m] for m in range(3)) + place[k][3]
                    low[k], high[k] = min(low[k], x), max(high[k], x)
        for child in node.get("children", []):
            visit(child, place)

    for root in gltf["scenes"][gltf.get("scene", 0)]["nodes"]:
        visit(root, IDENTITY)
    return low, high


def read_glb(path):
    with open(path, "rb") as file:
        data = file.read()
    length = struct.unpack_from("<I", data, 12)[0]
    binary = data[28 + length:28 + length + struct.unpack_from("<I", data, 20 + length)[0]]
    return json.loads(data[20:20 + length]), binary


def write_glb(path, gltf, parts):
    """`parts`: pieces of the binary chunk, each of a length that four divides."""
    text = json.dumps(gltf, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    size = sum(len(part) for part in parts)
    with open(path, "wb") as file:
        file.write(struct.pack("<4sIIII", b"glTF", 2, 28 + len(text) + size, len(text), 0x4E4F534A))
        file.write(text)
        file.write(struct.pack("<II", size, 0x004E4942))
        for part in parts:
            file.write(part)


def city(gltf, binary, copies, unique):
    """The level's JSON, grown; and the pieces of its binary chunk."""
    low, high = bounds(gltf)
    pitch_x, pitch_z = high[0] - low[0], high[2] - low[2]
    along = max(1, round(math.sqrt(copies * pitch_z / pitch_x)))  # as square as it gets
    for left_out in ("animations", "skins"):
        gltf.pop(left_out, None)
    nodes, roots = gltf["nodes"], gltf["scenes"][gltf.get("scene", 0)]["nodes"]
    level_nodes, level_roots = copy.deepcopy(nodes), list(roots)
    meshes, accessors, views = (copy.deepcopy(gltf[name]) for name in ("meshes", "accessors", "bufferViews"))
    binary += b"\0" * (-len(binary) % 4)
    parts = [binary]
    roots[:] = []
    for i in range(copies):
        nodes_before, meshes_before = len(nodes), len(gltf["meshes"])
        if i > 0:
            for node in copy.deepcopy(level_nodes):
                node.get("extensions", {}).pop("KHR_lights_punctual", None)
                node.pop("skin", None)
                if "children" in node:
                    node["children"] = [child + nodes_before for child in node["children"]]
                if unique and "mesh" in node:
                    node["mesh"] += meshes_before
                nodes.append(node)
        if i > 0 and unique:
            parts.append(binary)
            accessors_before, views_before = len(gltf["accessors"]), len(gltf["bufferViews"])
            for view in copy.deepcopy(views):
                view["byteOffset"] = view.get("byteOffset", 0) + i * len(binary)
                gltf["bufferViews"].append(view)
            for accessor in copy.deepcopy(accessors):
                accessor["bufferView"] += views_before
                gltf["accessors"].append(accessor)
            for mesh in copy.deepcopy(meshes):
                for primitive in mesh["primitives"]:
                    primitive["attributes"] = {name: k + accessors_before for name, k in primitive["attributes"].items()}
                    if "indices" in primitive:
                        primitive["indices"] += accessors_before
                gltf["meshes"].append(mesh)
        shift = nodes_before if i > 0 else 0
        roots.append(len(nodes))
        nodes.append({"name": f"copy {i}", "translation": [(i % along) * pitch_x, 0.0, (i // along) * pitch_z],
                      "children": [root + shift for root in level_roots]})
    gltf["buffers"] = [{"byteLength": len(binary) * len(parts)}]
    return gltf, parts


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("level")
    parser.add_argument("output")
    parser.add_argument("--copies", type=int, required=True)
    parser.add_argument("--unique", action="store_true")
    o = parser.parse_args()
    write_glb(o.output, *city(*read_glb(o.level), o.copies, o.unique))


if __name__ == "__main__":
    main()
