#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Write the level of docs/notes/gloss.md's last picture: 18 balls in a room, roughness 0 to 1 from left to right, metalness
1, 0.5 and 0 from top to bottom; a floor with a normal map, and roughness in a texture.

    make_gloss_row.py gloss_row.glb
    relume bake gloss_row.glb -o gloss_row.relume --preset high
    relume render gloss_row.glb --bake gloss_row.relume --gloss --size 720x450 -o row.exr
    relume reference gloss_row.glb --gloss --size 720x450 --spp 256 -o truth.exr
    relume diff row.exr truth.exr -o error.png
"""
import json
import math
import struct
import sys
import zlib

ROUGHNESS = [0.0, 0.2, 0.4, 0.6, 0.8, 1.0]
METALNESS = [1.0, 0.5, 0.0]
RADIUS = 0.32


def png(width, height, texel):
    """An 8-bit RGB image of texel(x, y)."""
    rows = b"".join(b"\0" + bytes(c for x in range(width) for c in texel(x, y)) for y in range(height))

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)) +
            chunk(b"IDAT", zlib.compress(rows, 9)) + chunk(b"IEND", b""))


def tile_normal(x, y):
    """A tile with rounded edges, 64 x 64, as a normal map: y upward."""
    def slope(t):
        edge = min(t, 1 - t)
        return (1 if t < 0.5 else -1) * max(0.0, 1 - edge / 0.08) * 0.7
    n = (-slope((x + 0.5) / 64), slope((y + 0.5) / 64), 1.0)
    size = math.sqrt(sum(c * c for c in n))
    return [round(255 * (0.5 + 0.5 * c / size)) for c in n]


class Level:
    def __init__(self):
        self.binary = bytearray()
        self.json = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [], "extras": {"relume": {"lightUnit": "radiometric"}}}],
                     "extensionsUsed": ["KHR_lights_punctual", "KHR_materials_emissive_strength"], "nodes": [],
                     "meshes": [], "materials": [], "accessors": [], "bufferViews": [], "images": [], "textures": [],
                     "cameras": []}

    def view(self, data):
        self.binary += b"\0" * (-len(self.binary) % 4)
        self.json["bufferViews"].append({"buffer": 0, "byteOffset": len(self.binary), "byteLength": len(data)})
        self.binary += data
        return len(self.json["bufferViews"]) - 1

    def floats(self, values, components):
        columns = [values[i::components] for i in range(components)]
        self.json["accessors"].append({"bufferView": self.view(struct.pack(f"<{len(values)}f", *values)),
                                       "componentType": 5126, "count": len(values) // components,
                                       "type": "SCALAR" if components == 1 else f"VEC{components}",
                                       "min": [min(c) for c in columns], "max": [max(c) for c in columns]})
        return len(self.json["accessors"]) - 1

    def indices(self, values):
        self.json["accessors"].append({"bufferView": self.view(struct.pack(f"<{len(values)}H", *values)),
                                       "componentType": 5123, "count": len(values), "type": "SCALAR"})
        return len(self.json["accessors"]) - 1

    def texture(self, data):
        self.json["images"].append({"bufferView": self.view(data), "mimeType": "image/png"})
        self.json["textures"].append({"source": len(self.json["images"]) - 1})
        return len(self.json["textures"]) - 1

    def material(self, name, color, metalness=0.0, roughness=1.0, **more):
        self.json["materials"].append({"name": name, "pbrMetallicRoughness": {
            "baseColorFactor": [*color, 1], "metallicFactor": metalness, "roughnessFactor": roughness}, **more})
        return len(self.json["materials"]) - 1

    def mesh(self, name, positions, normals, uvs, triangles, material, translation=(0, 0, 0), **more):
        flat = [c for v in positions for c in v]
        attributes = {"POSITION": self.floats(flat, 3), "NORMAL": self.floats([c for v in normals for c in v], 3),
                      "TEXCOORD_0": self.floats([c for v in uvs for c in v], 2)}
        self.json["meshes"].append({"name": name, "primitives": [{
            "attributes": attributes, "indices": self.indices([i for t in triangles for i in t]),
            "material": material}]})
        self.node({"name": name, "mesh": len(self.json["meshes"]) - 1, "translation": list(translation), **more})

    def node(self, node):
        self.json["nodes"].append(node)
        self.json["scenes"][0]["nodes"].append(len(self.json["nodes"]) - 1)

    def quad(self, name, corner, u, v, material, repeat=1.0):
        """Seen from where u x v points to; the image upright along v."""
        n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
        size = math.sqrt(sum(c * c for c in n))
        at = [[corner[i] + a * u[i] + b * v[i] for i in range(3)] for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))]
        self.mesh(name, at, [[c / size for c in n]] * 4,
                  [(0, repeat), (repeat, repeat), (repeat, 0), (0, 0)], [(0, 1, 2), (0, 2, 3)], material)

    def ball(self, name, centre, material, columns=32, rows=16):
        points, uvs, triangles = [], [], []
        for r in range(rows + 1):
            for c in range(columns + 1):
                phi, theta = 2 * math.pi * c / columns, math.pi * r / rows
                points.append((math.sin(theta) * math.sin(phi), math.cos(theta), math.sin(theta) * math.cos(phi)))
                uvs.append((c / columns, r / rows))
        for r in range(rows):
            for c in range(columns):
                a, b = r * (columns + 1) + c, (r + 1) * (columns + 1) + c
                if r > 0:
                    triangles.append((a, b, a + 1))
                if r < rows - 1:
                    triangles.append((a + 1, b, b + 1))
        self.mesh(name, [[RADIUS * c for c in p] for p in points], points, uvs, triangles, material, centre)

    def write(self, path):
        self.json["buffers"] = [{"byteLength": len(self.binary)}]
        text = json.dumps(self.json, separators=(",", ":")).encode()
        text += b" " * (-len(text) % 4)
        self.binary += b"\0" * (-len(self.binary) % 4)
        with open(path, "wb") as out:
            out.write(struct.pack("<III", 0x46546C67, 2, 28 + len(text) + len(self.binary)))
            out.write(struct.pack("<II", len(text), 0x4E4F534A) + text)
            out.write(struct.pack("<II", len(self.binary), 0x004E4942) + bytes(self.binary))


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    level = Level()
    white = level.material("white", (0.75, 0.75, 0.75))
    red = level.material("red", (0.7, 0.15, 0.1))
    blue = level.material("blue", (0.1, 0.2, 0.7))
    lamp = level.material("lamp", (0.0, 0.0, 0.0), emissiveFactor=[1.0, 0.9, 0.75],
                          extensions={"KHR_materials_emissive_strength": {"emissiveStrength": 12.0}})
    tiles = level.texture(png(64, 64, tile_normal))
    # Roughness 0.9 and 0.5 in turns, no metal.
    checker = level.texture(png(2, 2, lambda x, y: [0, 230 if (x + y) % 2 else 128, 0]))
    floor = level.material("floor", (0.5, 0.5, 0.5), 1.0, 1.0, normalTexture={"index": tiles})
    level.json["materials"][floor]["pbrMetallicRoughness"]["metallicRoughnessTexture"] = {"index": checker}

    width, depth, height = 6.0, 6.0, 3.2
    x, z = width / 2, depth / 2
    level.quad("floor", (-x, 0, z), (width, 0, 0), (0, 0, -depth), floor, 8.0)
    level.quad("ceiling", (-x, height, -z), (width, 0, 0), (0, 0, depth), white)
    level.quad("back", (-x, 0, -z), (width, 0, 0), (0, height, 0), white)
    level.quad("front", (x, 0, z), (-width, 0, 0), (0, height, 0), white)
    level.quad("left", (-x, 0, z), (0, 0, -depth), (0, height, 0), red)
    level.quad("right", (x, 0, -z), (0, 0, depth), (0, height, 0), blue)
    level.quad("lamp", (-1.5, height - 0.02, 0.2), (3.0, 0, 0), (0, 0, 0.6), lamp)
    for row, metalness in enumerate(METALNESS):
        for column, roughness in enumerate(ROUGHNESS):
            name = f"ball m{metalness:g} r{roughness:g}"
            material = level.material(name, (0.9, 0.6, 0.3), metalness, roughness)
            level.ball(name, (-2.1 + 0.84 * column, 2.35 - 0.85 * row, -0.7), material)
    level.json["extensions"] = {"KHR_lights_punctual": {"lights": [
        {"type": "spot", "name": "spot", "color": [1, 1, 1], "intensity": 6.0,
         "spot": {"innerConeAngle": 0.3, "outerConeAngle": 0.5}}]}}
    tilt = math.radians(-20)  # down
    level.node({"name": "spot", "translation": [0, 2.6, 2.4], "rotation": [math.sin(tilt / 2), 0, 0, math.cos(tilt / 2)],
                "extensions": {"KHR_lights_punctual": {"light": 0}}})
    level.json["cameras"].append({"type": "perspective", "perspective": {"yfov": math.radians(46), "znear": 0.01}})
    level.node({"name": "cam", "camera": 0, "translation": [0, 1.5, 2.9]})
    level.write(sys.argv[1])


main()
