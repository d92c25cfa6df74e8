#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Writes small glTF files that ask for much: few bytes that stand for many triangles, instances or texels, and
topology in which every triangle has every other for a neighbour.

  make_levels.py FOLDER [NAME...]   writes FOLDER/NAME.gltf or .glb for each name; all of them without one
"""

import json
import math
import random
import struct
import sys
import zlib
from pathlib import Path


class Glb:
    """A level in one file: buffer views are appended, numbers are packed little-endian."""

    def __init__(self):
        self.data = bytearray()
        self.json = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": []}], "nodes": [], "meshes": [],
                     "accessors": [], "bufferViews": []}

    def view(self, content):
        self.data += b"\0" * (-len(self.data) % 4)
        self.json["bufferViews"].append({"buffer": 0, "byteOffset": len(self.data), "byteLength": len(content)})
        self.data += content
        return len(self.json["bufferViews"]) - 1

    def accessor(self, kind, component, values):
        width = {"SCALAR": 1, "VEC2": 2, "VEC3": 3}[kind]
        code = {5126: "f", 5125: "I"}[component]
        flat = [x for v in values for x in (v if width > 1 else (v,))]
        out = {"bufferView": self.view(struct.pack("<%d%s" % (len(flat), code), *flat)), "componentType": component,
               "count": len(values), "type": kind}
        if kind == "VEC3":
            out["min"] = [min(v[k] for v in values) for k in range(3)]
            out["max"] = [max(v[k] for v in values) for k in range(3)]
        self.json["accessors"].append(out)
        return len(self.json["accessors"]) - 1

    def mesh(self, positions, triangles, **more):
        primitive = {"attributes": {"POSITION": self.accessor("VEC3", 5126, positions)},
                     "indices": self.accessor("SCALAR", 5125, [i for t in triangles for i in t])}
        primitive.update(more)
        self.json["meshes"].append({"primitives": [primitive]})
        return len(self.json["meshes"]) - 1

    def node(self, **values):
        self.json["nodes"].append(values)
        self.json["scenes"][0]["nodes"].append(len(self.json["nodes"]) - 1)

    def write(self, path):
        self.data += b"\0" * (-len(self.data) % 4)
        self.json["buffers"] = [{"byteLength": len(self.data)}]
        text = json.dumps(self.json, separators=(",", ":")).encode()
        text += b" " * (-len(text) % 4)
        with open(path, "wb") as f:
            f.write(struct.pack("<4sII", b"glTF", 2, 20 + len(text) + 8 + len(self.data)))
            f.write(struct.pack("<I4s", len(text), b"JSON") + text)
            f.write(struct.pack("<I4s", len(self.data), b"BIN\0") + self.data)


TRIANGLE = ([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)])


def coincident_instances(folder):
    """20,000 nodes that place one triangle at one spot."""
    level = Glb()
    mesh = level.mesh(*TRIANGLE)
    for _ in range(20000):
        level.node(mesh=mesh)
    level.write(folder / "coincident_instances.glb")


def one_extension(folder):
    """65,536 instances of one triangle in one extension, whose accessor has no data: all at the origin."""
    level = Glb()
    mesh = level.mesh(*TRIANGLE)
    level.json["accessors"].append({"componentType": 5126, "count": 65536, "type": "VEC3"})
    level.json["extensionsUsed"] = ["EXT_mesh_gpu_instancing"]
    level.node(mesh=mesh, extensions={"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 1 + 1}}})
    level.write(folder / "one_extension.glb")


def shared_primitive(folder):
    """20,000 nodes in a lattice that share one primitive of 12 triangles."""
    level = Glb()
    corners = [(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1)]
    quads = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    mesh = level.mesh(corners, [t for q in quads for t in ((q[0], q[1], q[2]), (q[0], q[2], q[3]))])
    for i in range(20000):
        level.node(mesh=mesh, translation=[2 * (i % 27), 2 * (i // 27 % 27), 2 * (i // 729)])
    level.write(folder / "shared_primitive.glb")


def fan(folder):
    """100,000 triangles around one vertex, a gentle cone."""
    level, n = Glb(), 100000
    ring = [(math.cos(2 * math.pi * i / n), 0.2, math.sin(2 * math.pi * i / n)) for i in range(n)]
    level.node(mesh=level.mesh([(0, 0, 0)] + ring, [(0, 1 + (i + 1) % n, 1 + i) for i in range(n)]))
    level.write(folder / "fan.glb")


def star(folder):
    """3,000 triangles of 3 m by 4 m on one edge."""
    level, n = Glb(), 3000
    ring = [(3 * math.cos(2 * math.pi * i / n), 0, 3 * math.sin(2 * math.pi * i / n)) for i in range(n)]
    level.node(mesh=level.mesh([(0, -2, 0), (0, 2, 0)] + ring, [(0, 1, 2 + i) for i in range(n)]))
    level.json["cameras"] = [{"type": "perspective", "perspective": {"yfov": 1, "znear": 0.1}}]
    level.node(camera=0, translation=[0, 2, 12])
    level.write(folder / "star.glb")


def needle(folder):
    """A triangle of 1 m by 100 km."""
    level = Glb()
    level.node(mesh=level.mesh([(0, 0, 0), (1, 0, 0), (1, 100000, 0)], [(0, 1, 2)]))
    level.write(folder / "needle.glb")


def strip(folder):
    """A strip of 1 m by 100 km, whose diagonal turns halfway, beside a play volume of 2 x 4 x 6 m."""
    level, length = Glb(), 100000
    level.node(mesh=level.mesh([(0, length, 1), (1, 0, 0), (1, length, 1), (0, 1, 0)], [(0, 1, 2), (0, 2, 3)]))
    level.node(extras={"relume": {"volume": [2, 4, 6]}})
    level.write(folder / "strip.glb")


def fence(folder):
    """A ground of 40 x 40 m and a fence of two faces, 800 m long and 1 m high, 5 cm apart."""
    level = Glb()
    level.node(mesh=level.mesh([(-20, 0, 20), (20, 0, 20), (20, 0, -20), (-20, 0, -20)], [(0, 1, 2), (0, 2, 3)]))
    front = [(-400, 0, 0), (400, 0, 0), (400, 1, 0), (-400, 1, 0)]
    back = [(x, y, -0.05) for x, y, _ in front]
    level.node(mesh=level.mesh(front + back, [(0, 1, 2), (0, 2, 3), (4, 6, 5), (4, 7, 6)]))
    level.json["cameras"] = [{"type": "perspective", "perspective": {"yfov": 1, "znear": 0.1}}]
    level.node(camera=0, translation=[0, 2, 12])
    level.write(folder / "fence.glb")


def sheet(folder):
    """A quarter of a square metre, 4 micrometres out of the plane of two axes, with a triangle for each side."""
    level = Glb()
    corners = [(0, 0, 0), (0, 1, 0), (0.25, 0, 4e-6)]
    level.node(mesh=level.mesh(corners, [(0, 1, 2), (0, 2, 1)]))
    level.write(folder / "sheet.glb")


def soup(folder):
    """30,000 random triangles that pierce one another."""
    level, rng, n = Glb(), random.Random(1), 30000
    points = [(rng.uniform(-1, 1), rng.uniform(-1, 1), rng.uniform(-1, 1)) for _ in range(3 * n)]
    level.node(mesh=level.mesh(points, [(3 * i, 3 * i + 1, 3 * i + 2) for i in range(n)]))
    level.write(folder / "soup.glb")


def teapots(folder, count=2000):
    """2,000 instances of a lathed pot of 2,400 triangles in a plane, by one extension."""
    level = Glb()
    around, along = 60, 20
    points = [((0.6 + 0.4 * math.sin(3 * j / along)) * math.cos(2 * math.pi * i / around), j / along,
               (0.6 + 0.4 * math.sin(3 * j / along)) * math.sin(2 * math.pi * i / around))
              for j in range(along + 1) for i in range(around)]
    faces = []
    for j in range(along):
        for i in range(around):
            a, b = j * around + i, j * around + (i + 1) % around
            faces += [(a, a + around, b), (b, a + around, b + around)]
    mesh = level.mesh(points, faces)
    level.json["extensionsUsed"] = ["EXT_mesh_gpu_instancing"]
    places = level.accessor("VEC3", 5126, [(3 * (i % 45), 0, 3 * (i // 45)) for i in range(count)])
    level.node(mesh=mesh, extensions={"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": places}}})
    level.write(folder / "teapots.glb")


def layers(folder):
    """1,000 coplanar triangles, each a little larger than the one before: no two the same, all in one plane."""
    level, n = Glb(), 1000
    points, faces = [], []
    for i in range(n):
        size = 1 + i / n
        points += [(0, 0, 0), (size, 0, 0), (0, size, 0)]
        faces.append((3 * i, 3 * i + 1, 3 * i + 2))
    level.node(mesh=level.mesh(points, faces))
    level.write(folder / "layers.glb")


def layer_nodes(folder):
    """1,000 nodes with a quad each, all in one plane and of one size."""
    level = Glb()
    mesh = level.mesh([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], [(0, 1, 2), (0, 2, 3)])
    for _ in range(1000):
        level.node(mesh=mesh)
    level.write(folder / "layer_nodes.glb")


def png_of_bits(side):
    """A PNG of one bit a pixel, all black."""
    def chunk(kind, content):
        return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))
    row = b"\0" + b"\0" * ((side + 7) // 8)
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", side, side, 1, 0, 0, 0, 0)) +
            chunk(b"IDAT", zlib.compress(row * side, 9)) + chunk(b"IEND", b""))


def big_image(folder, side=11000):
    """A triangle with a texture of 11,000 x 11,000 texels in 15 kB."""
    level = Glb()
    image = level.view(png_of_bits(side))
    level.json["images"] = [{"bufferView": image, "mimeType": "image/png"}]
    level.json["textures"] = [{"source": 0}]
    level.json["materials"] = [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]
    mesh = level.mesh(*TRIANGLE, material=0)
    primitive = level.json["meshes"][mesh]["primitives"][0]
    primitive["attributes"]["TEXCOORD_0"] = level.accessor("VEC2", 5126, [(0, 0), (1, 0), (0, 1)])
    level.node(mesh=mesh)
    level.write(folder / "big_image.glb")


LEVELS = {f.__name__: f for f in (coincident_instances, one_extension, shared_primitive, fan, star, needle, strip, sheet, fence, soup,
                                  teapots, layers, layer_nodes, big_image)}

if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    target = Path(sys.argv[1])
    target.mkdir(parents=True, exist_ok=True)
    for name in sys.argv[2:] or LEVELS:
        LEVELS[name](target)
