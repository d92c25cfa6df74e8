#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Make a small file that is costly to bake by its shape: the table of docs/notes/scale.md ("Small files").

    tests/bench/make_costly_level.py KIND OUTPUT.gltf [--count N]

KIND     what it is                                                               count
fan      triangles around one vertex, a disc                                      100000
star     triangles that share one edge                                            3000
soup     random triangles of 0.5 m in a cube of 10 m, each with its own corners   30000
layers   coplanar squares of 10 m, two triangles each                             1000
nested   coplanar squares in one another, up to 10 m                              1500
copies   instances of one triangle in one place, by nodes                         20000
crowd    instances of a sphere of 480 triangles in a cube, by EXT_mesh_gpu_instancing  2000
field    instances of a triangle of 1 m on a plain, turned, by EXT_mesh_gpu_instancing  65536
rocks    instances of a rock of 1,000 triangles on a plain, turned, by the same        100000

A camera looks at it from aside. The same bytes on every run.
"""
import argparse
import base64
import json
import math
import random
import struct

COUNTS = {"fan": 100000, "star": 3000, "soup": 30000, "layers": 1000, "nested": 1500, "copies": 20000, "crowd": 2000,
          "field": 65536, "rocks": 100000}


def fan(count):
    rim = [(5 * math.cos(2 * math.pi * i / count), 0.0, -5 * math.sin(2 * math.pi * i / count)) for i in range(count)]
    return [(0.0, 0.0, 0.0)] + rim, [k for i in range(count) for k in (0, 1 + i, 1 + (i + 1) % count)]


def star(count):
    rim = [(3 * math.cos(2 * math.pi * i / count), 0.0, 3 * math.sin(2 * math.pi * i / count)) for i in range(count)]
    return [(0.0, -2.0, 0.0), (0.0, 2.0, 0.0)] + rim, [k for i in range(count) for k in (0, 1, 2 + i)]


def soup(count):
    draw = random.Random(1)
    corners = []
    for _ in range(count):
        at = [draw.uniform(-5, 5) for _ in range(3)]
        corners += [tuple(x + draw.uniform(-0.25, 0.25) for x in at) for _ in range(3)]
    return corners, list(range(3 * count))


def layers(count):
    square = [(-5.0, 0.0, 5.0), (5.0, 0.0, 5.0), (5.0, 0.0, -5.0), (-5.0, 0.0, -5.0)]
    return square * count, [4 * i + k for i in range(count) for k in (0, 1, 2, 0, 2, 3)]


def nested(count):
    half = [5.0 * (i + 1) / count for i in range(count)]
    corners = [p for h in half for p in ((-h, 0.0, h), (h, 0.0, h), (h, 0.0, -h), (-h, 0.0, -h))]
    return corners, [4 * i + k for i in range(count) for k in (0, 1, 2, 0, 2, 3)]


def triangle():
    return [(-1.0, 0.0, 1.0), (1.0, 0.0, 1.0), (0.0, 0.0, -1.0)], [0, 1, 2]


def sphere(rings=16, sides=16, radius=0.2):
    corners = [(radius * math.sin(math.pi * r / rings) * math.cos(2 * math.pi * s / sides),
                radius * math.cos(math.pi * r / rings),
                -radius * math.sin(math.pi * r / rings) * math.sin(2 * math.pi * s / sides))
               for r in range(rings + 1) for s in range(sides)]
    index = []
    for r in range(rings):
        for s in range(sides):
            a, b = r * sides + s, r * sides + (s + 1) % sides
            c, d = a + sides, b + sides
            if r < rings - 1:
                index += [a, c, d]
            if r > 0:
                index += [a, d, b]
    return corners, index


def rock(rings=21, sides=25):
    """A sphere of 1 m with dents."""
    draw = random.Random(2)
    corners, index = sphere(rings, sides, 0.5)
    return [tuple(x * draw.uniform(0.8, 1.0) for x in c) for c in corners], index


class Level:
    def __init__(self, corners, index):
        self.data = b""
        self.gltf = {"asset": {"version": "2.0", "generator": "make_costly_level"}, "scene": 0,
                     "scenes": [{"nodes": [0]}], "bufferViews": [], "accessors": [],
                     "cameras": [{"type": "perspective", "perspective": {"yfov": 0.9, "znear": 0.1}}],
                     "nodes": [{"name": "camera", "camera": 0, "translation": [0, 12, 12],
                                "rotation": [-math.sin(math.pi / 8), 0, 0, math.cos(math.pi / 8)]}]}
        flat = [x for c in corners for x in c]
        position = self.accessor(struct.pack(f"<{len(flat)}f", *flat), 5126, "VEC3", len(corners))
        self.gltf["accessors"][position]["min"] = [min(flat[k::3]) for k in range(3)]
        self.gltf["accessors"][position]["max"] = [max(flat[k::3]) for k in range(3)]
        indices = self.accessor(struct.pack(f"<{len(index)}I", *index), 5125, "SCALAR", len(index))
        self.gltf["meshes"] = [{"primitives": [{"attributes": {"POSITION": position}, "indices": indices}]}]

    def accessor(self, data, component, kind, count):
        self.gltf["bufferViews"].append({"buffer": 0, "byteOffset": len(self.data), "byteLength": len(data)})
        self.gltf["accessors"].append({"bufferView": len(self.gltf["bufferViews"]) - 1, "componentType": component,
                                       "type": kind, "count": count})
        self.data += data
        return len(self.gltf["accessors"]) - 1

    def crowd(self, name, **attributes):
        """A node of many instances. attributes: for each its three or four numbers, one after another."""
        self.gltf["extensionsUsed"] = self.gltf["extensionsRequired"] = ["EXT_mesh_gpu_instancing"]
        sizes = {"TRANSLATION": 3, "ROTATION": 4}
        accessors = {key: self.accessor(struct.pack(f"<{len(x)}f", *x), 5126, f"VEC{sizes[key]}", len(x) // sizes[key])
                     for key, x in attributes.items()}
        self.node({"name": name, "mesh": 0, "extensions": {"EXT_mesh_gpu_instancing": {"attributes": accessors}}})

    def node(self, node):
        self.gltf["scenes"][0]["nodes"].append(len(self.gltf["nodes"]))
        self.gltf["nodes"].append(node)

    def write(self, path):
        uri = "data:application/octet-stream;base64," + base64.b64encode(self.data).decode()
        self.gltf["buffers"] = [{"byteLength": len(self.data), "uri": uri}]
        with open(path, "w") as file:
            json.dump(self.gltf, file)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("kind", choices=COUNTS)
    parser.add_argument("output")
    parser.add_argument("--count", type=int)
    o = parser.parse_args()
    count = o.count or COUNTS[o.kind]
    shapes = {"fan": fan, "star": star, "soup": soup, "layers": layers, "nested": nested}
    if o.kind in shapes:
        level = Level(*shapes[o.kind](count))
        level.node({"name": o.kind, "mesh": 0})
    elif o.kind == "copies":
        level = Level(*triangle())
        for i in range(count):
            level.node({"name": f"copy {i}", "mesh": 0})
    elif o.kind == "crowd":
        draw = random.Random(1)
        level = Level(*sphere())
        level.crowd("crowd", TRANSLATION=[draw.uniform(-5, 5) for _ in range(3 * count)])
    else:
        draw = random.Random(1)
        level = Level(*(triangle() if o.kind == "field" else rock()))
        along = math.ceil(math.sqrt(count))
        places, turns = [], []
        for i in range(count):
            places += [2.0 * (i % along - 0.5 * along), 0.0, 2.0 * (i // along - 0.5 * along)]
            angle = draw.uniform(0.0, math.pi)
            turns += [0.0, math.sin(angle), 0.0, math.cos(angle)]
        level.crowd(o.kind, TRANSLATION=places, ROTATION=turns)
    level.write(o.output)


if __name__ == "__main__":
    main()
