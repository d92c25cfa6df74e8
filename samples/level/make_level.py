#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Make samples/level/two_rooms.glb, the level that ships with Relume.

A living room with a window and a hall beyond a doorway: walls with thickness, one red and one green, a textured
floor, an alpha-masked lattice, furniture, a round pillar and a ball, an emissive panel on the hall's ceiling, the
lights "sun", "lamp" and "spot", the cameras "cam_living" and "cam_hall", and a box in extras.relume for each room
that says where receivers can be. Metres, Y up; intensities are radiometric (W/sr, W/m², W/m²/sr). The same bytes on
every run; needs nothing but Python.

    samples/level/make_level.py [OUTPUT.glb]
"""
import json
import math
import pathlib
import struct
import sys
import zlib

WALL = 0.2  # [m] thickness of the outer walls
LIVING = (0.0, 5.0)  # [m] x range of the rooms; both are 4 m deep (z) and 2.7 m high (y)
HALL = (5.2, 8.2)
DEPTH, HEIGHT = 4.0, 2.7


class Mesh:
    """Triangles with normals and, for textured materials, one set of texture coordinates."""

    def __init__(self, material):
        self.material, self.position, self.normal, self.uv, self.index = material, [], [], [], []

    def quad(self, corners, normal, uv=None):
        """Four corners, counter-clockwise seen from the side the normal points to."""
        first = len(self.position)
        self.position += corners
        self.normal += [normal] * 4
        self.uv += uv or [(0.0, 0.0)] * 4
        self.index += [first, first + 1, first + 2, first, first + 2, first + 3]

    def box(self, low, high, skip=()):
        """An axis-aligned box without the faces named in skip ("-x", "+y", ...)."""
        for axis in range(3):
            for sign in (-1, 1):
                if ("+" if sign > 0 else "-") + "xyz"[axis] not in skip:
                    self.quad(*face(low, high, axis, sign))
        return self


def face(low, high, axis, sign):
    """Corners and normal of one face of a box."""
    u, v = (axis + 1) % 3, (axis + 2) % 3
    corners = []
    for a, b in ((0, 0), (1, 0), (1, 1), (0, 1)) if sign > 0 else ((0, 0), (0, 1), (1, 1), (1, 0)):
        corner = [0.0, 0.0, 0.0]
        corner[axis] = high[axis] if sign > 0 else low[axis]
        corner[u] = high[u] if a else low[u]
        corner[v] = high[v] if b else low[v]
        corners.append(tuple(corner))
    return corners, tuple(float(sign) if i == axis else 0.0 for i in range(3))


def rotated(mesh, angle, origin):
    """The mesh turned around the Y axis through the origin, then moved there."""
    c, s = math.cos(angle), math.sin(angle)
    mesh.position = [(c * x + s * z + origin[0], y + origin[1], c * z - s * x + origin[2]) for x, y, z in mesh.position]
    mesh.normal = [(c * x + s * z, y, c * z - s * x) for x, y, z in mesh.normal]
    return mesh


def tube(material, radius, y0, y1, segments, top=False, bottom=False):
    """A cylinder around the Y axis with smooth sides, with lids when asked."""
    mesh = Mesh(material)

    def vertex(i, y, normal=None):
        a = 2.0 * math.pi * (i % segments) / segments
        mesh.position.append((radius * math.cos(a), y, -radius * math.sin(a)))
        mesh.normal.append(normal or (math.cos(a), 0.0, -math.sin(a)))
        mesh.uv.append((0.0, 0.0))

    for i in range(segments + 1):
        vertex(i, y0)
        vertex(i, y1)
    for i in range(segments):
        b = 2 * i
        mesh.index += [b, b + 2, b + 3, b, b + 3, b + 1]
    for wanted, y, up in ((top, y1, 1.0), (bottom, y0, -1.0)):
        if wanted:
            ring = len(mesh.position)
            for i in range(segments):
                vertex(i, y, (0.0, up, 0.0))
            for i in range(1, segments - 1):
                mesh.index += [ring, ring + i, ring + i + 1] if up > 0 else [ring, ring + i + 1, ring + i]
    return mesh


def ball(material, radius, rings, segments):
    """A sphere around the origin with smooth normals."""
    mesh = Mesh(material)
    for j in range(rings + 1):
        t = math.pi * j / rings
        for i in range(segments + 1):
            a = 2.0 * math.pi * (i % segments) / segments
            n = (math.sin(t) * math.cos(a), math.cos(t), -math.sin(t) * math.sin(a))
            n = tuple(0.0 if abs(c) < 1e-12 else c for c in n)
            mesh.position.append(tuple(radius * c for c in n))
            mesh.normal.append(n)
            mesh.uv.append((0.0, 0.0))
    row = segments + 1
    for j in range(rings):
        for i in range(segments):
            a, b = j * row + i, (j + 1) * row + i
            if j > 0:
                mesh.index += [a, b, a + 1]
            if j < rings - 1:
                mesh.index += [a + 1, b, b + 1]
    return mesh


def house():
    """Walls, floors and ceilings as the surface of a solid on an uneven lattice: no hidden faces, no T-junctions."""
    window_x, window_y = (1.4, 3.4), (0.9, 2.1)
    door_z, door_y = (1.2, 2.2), 2.1
    xs = [-WALL, 0.0, *window_x, 5.0, 5.2, 6.7, 8.2, 8.2 + WALL]
    ys = [-WALL, 0.0, window_y[0], 2.1, HEIGHT, HEIGHT + WALL]
    zs = [-WALL, 0.0, *door_z, DEPTH, DEPTH + WALL]

    def inside(value, interval):
        return interval[0] < value < interval[1]

    def space(x, y, z):
        """The name of the space that holds a point, None in a wall."""
        if inside(y, (0.0, HEIGHT)) and inside(z, (0.0, DEPTH)):
            if inside(x, LIVING):
                return "living"
            if inside(x, HALL):
                return "hall"
        if inside(x, (5.0, 5.2)) and inside(z, door_z) and inside(y, (0.0, door_y)):
            return "doorway"
        if inside(x, window_x) and inside(y, window_y) and inside(z, (-WALL, 0.0)):
            return "window"
        if inside(x, (xs[0], xs[-1])) and inside(y, (ys[0], ys[-1])) and inside(z, (zs[0], zs[-1])):
            return None
        return "outside"

    # Materials of the faces that a space sees, by the direction they look in.
    materials = {
        ("living", "+y"): "parquet", ("living", "-y"): "ceiling", ("living", "+x"): "red", ("living", "-x"): "green",
        ("living", "+z"): "plaster", ("living", "-z"): "plaster",
        ("hall", "+y"): "stone", ("hall", "-y"): "ceiling", ("hall", "+x"): "plaster", ("hall", "-x"): "blue",
        ("hall", "+z"): "plaster", ("hall", "-z"): "plaster",
    }
    names = {"+y": "floor", "-y": "ceiling", "+x": "wall_west", "-x": "wall_east", "+z": "wall_north", "-z": "wall_south"}
    meshes = {}

    def emit(low, high, axis, sign, name):
        direction = ("+" if sign > 0 else "-") + "xyz"[axis]
        key = f"{name}_{names[direction]}" if name in ("living", "hall") else name
        material = materials.get((name, direction), "exterior" if name == "outside" else "paint")
        corners, normal = face(low, high, axis, sign)
        uv = [(c[0], c[2]) for c in corners] if material == "parquet" else None
        meshes.setdefault(key, Mesh(material)).quad(corners, normal, uv)

    def middle(values, i):
        if i < 0:
            return values[0] - 1.0
        return values[-1] + 1.0 if i + 1 >= len(values) else 0.5 * (values[i] + values[i + 1])

    axes = (xs, ys, zs)
    for i in range(len(xs) - 1):
        for j in range(len(ys) - 1):
            for k in range(len(zs) - 1):
                cell = (i, j, k)
                if space(*(middle(axes[a], cell[a]) for a in range(3))) is not None:
                    continue
                low = tuple(axes[a][cell[a]] for a in range(3))
                high = tuple(axes[a][cell[a] + 1] for a in range(3))
                for axis in range(3):
                    for sign in (-1, 1):
                        next_cell = list(cell)
                        next_cell[axis] += sign
                        name = space(*(middle(axes[a], next_cell[a]) for a in range(3)))
                        if name is not None:
                            emit(low, high, axis, sign, name)
    return sorted(meshes.items())


def furniture():
    """What stands in the rooms. Faces that rest on something are left out."""
    parts = []
    sofa = Mesh("fabric")
    sofa.box((0.12, 0.0, 1.3), (1.0, 0.42, 3.1), skip=("-y",))
    sofa.box((0.12, 0.42, 1.3), (0.34, 0.85, 3.1), skip=("-y",))
    sofa.box((0.34, 0.42, 1.3), (1.0, 0.6, 1.5), skip=("-y", "-x"))
    sofa.box((0.34, 0.42, 2.9), (1.0, 0.6, 3.1), skip=("-y", "-x"))
    parts.append(("sofa", sofa))

    table = Mesh("wood")
    table.box((2.1, 0.40, 1.75), (3.2, 0.45, 2.4))
    for x in (2.15, 3.09):
        for z in (1.8, 2.29):
            table.box((x, 0.0, z), (x + 0.06, 0.40, z + 0.06), skip=("-y", "+y"))
    parts.append(("table", table))
    parts.append(("rug", Mesh("rug").box((1.7, 0.0, 1.45), (3.6, 0.015, 2.75), skip=("-y",))))

    shelf = Mesh("wood")
    shelf.box((4.65, 0.0, 2.6), (5.0, 1.8, 2.64), skip=("-y", "+x"))
    shelf.box((4.65, 0.0, 3.46), (5.0, 1.8, 3.5), skip=("-y", "+x"))
    for y in (0.1, 0.65, 1.2, 1.76):
        shelf.box((4.65, y, 2.64), (5.0, y + 0.04, 3.46), skip=("+x", "-z", "+z"))
    parts.append(("shelf", shelf))

    frame = Mesh("paint")
    frame.box((2.37, 0.9, -0.12), (2.43, 2.1, -0.06), skip=("-y", "+y"))
    for low, high in ((1.4, 2.37), (2.43, 3.4)):
        frame.box((low, 1.47, -0.12), (high, 1.53, -0.06), skip=("-x", "+x"))
    parts.append(("window_frame", frame))

    screen = Mesh("lattice")
    for x0, x1 in ((-0.55, 0.0), (0.0, 0.55)):
        screen.quad([(x0, 0.02, 0.0), (x1, 0.02, 0.0), (x1, 1.7, 0.0), (x0, 1.7, 0.0)], (0.0, 0.0, 1.0),
                    [(2 * x0, 3.4), (2 * x1, 3.4), (2 * x1, 0.0), (2 * x0, 0.0)])
    parts.append(("screen", rotated(screen, 0.6, (0.85, 0.0, 0.6))))

    parts.append(("lamp_pole", rotated(tube("metal", 0.02, 0.03, 1.35, 10), 0.0, (4.5, 0.0, 0.55))))
    parts.append(("lamp_foot", rotated(tube("metal", 0.16, 0.0, 0.03, 24, top=True), 0.0, (4.5, 0.0, 0.55))))
    dish = tube("metal", 0.1, 1.35, 1.38, 24, top=True, bottom=True)
    parts.append(("lamp_dish", rotated(dish, 0.0, (4.5, 0.0, 0.55))))

    parts.append(("pillar", rotated(tube("stone", 0.17, 0.0, HEIGHT, 32), 0.0, (5.75, 0.0, 3.2))))
    parts.append(("pedestal", rotated(Mesh("plaster").box((-0.22, 0.0, -0.22), (0.22, 0.75, 0.22), skip=("-y",)), 0.35,
                                      (7.0, 0.0, 0.75))))
    globe = ball("ochre", 0.24, 18, 32)
    globe.position = [(x, y + 0.99, z) for x, y, z in globe.position]
    parts.append(("globe", rotated(globe, 0.0, (7.0, 0.0, 0.75))))
    bench = Mesh("wood").box((7.6, 0.0, 1.8), (8.2, 0.42, 3.2), skip=("-y", "+x"))
    parts.append(("bench", bench))

    panel = Mesh("paint").box((6.1, 2.62, 1.7), (7.3, HEIGHT, 2.3), skip=("+y", "-y"))
    parts.append(("panel_rim", panel))
    light = Mesh("panel")
    light.quad(*face((6.1, 2.62, 1.7), (7.3, HEIGHT, 2.3), 1, -1))
    parts.append(("panel", light))
    ground = Mesh("ground").box((-4.0, -0.4, -6.0), (12.0, -0.2, -0.2), skip=("-y",))
    parts.append(("ground", ground))
    return parts


MATERIALS = {  # base colour (linear), then extras of glTF
    "red": {"color": (0.62, 0.07, 0.05)},
    "green": {"color": (0.12, 0.45, 0.11)},
    "blue": {"color": (0.16, 0.25, 0.52)},
    "plaster": {"color": (0.72, 0.70, 0.66)},
    "ceiling": {"color": (0.80, 0.80, 0.78)},
    "paint": {"color": (0.75, 0.74, 0.70)},
    "stone": {"color": (0.45, 0.44, 0.42)},
    "exterior": {"color": (0.55, 0.50, 0.45)},
    "ground": {"color": (0.20, 0.28, 0.12)},
    "fabric": {"color": (0.20, 0.24, 0.36)},
    "wood": {"color": (0.42, 0.25, 0.12)},
    "rug": {"color": (0.55, 0.42, 0.30)},
    "metal": {"color": (0.25, 0.25, 0.27)},
    "ochre": {"color": (0.70, 0.45, 0.12)},
    "panel": {"color": (0.6, 0.6, 0.6), "emission": ((1.0, 0.86, 0.68), 9.0)},
    "parquet": {"color": (1.0, 1.0, 1.0), "texture": 0},
    "lattice": {"color": (1.0, 1.0, 1.0), "texture": 1, "mask": True},
}


def png(width, height, pixel, alpha):
    """A PNG file from a function (x, y) -> 8-bit components."""
    rows = b"".join(b"\0" + bytes(c for x in range(width) for c in pixel(x, y)) for y in range(height))

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, 8, 6 if alpha else 2, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows, 9)) + chunk(b"IEND", b"")


def parquet(x, y):
    """Boards of 16 x 64 texels, shifted by half a board in every other column, with dark joints."""
    column = x // 16
    row = ((y + 32 * (column % 2)) % 64)
    board = (column * 7 + ((y + 32 * (column % 2)) // 64) * 5) % 8
    grain = ((x * 13 + (y // 6) * 29 + board * 31) % 11) - 5
    if x % 16 == 0 or row == 0:
        return (96, 66, 42)
    return tuple(max(0, min(255, c + 5 * (board - 4) + grain)) for c in (176, 128, 84))


def lattice(x, y):
    """Slats around square holes of 14 x 14 texels."""
    solid = x % 20 < 6 or y % 20 < 6
    return (150, 110, 70, 255 if solid else 0)


def look_along(direction):
    """The quaternion that turns -Z into a direction, Y staying up."""
    z = [-c / math.sqrt(sum(d * d for d in direction)) for c in direction]
    length = math.hypot(z[2], z[0])
    x = [z[2] / length, 0.0, -z[0] / length]
    y = [z[1] * x[2] - z[2] * x[1], z[2] * x[0] - z[0] * x[2], z[0] * x[1] - z[1] * x[0]]
    w = math.sqrt(max(0.0, 1.0 + x[0] + y[1] + z[2])) / 2.0
    if w > 1e-6:
        q = [(y[2] - z[1]) / (4 * w), (z[0] - x[2]) / (4 * w), (x[1] - y[0]) / (4 * w), w]
    else:
        q = [0.0, 1.0, 0.0, 0.0]
    return [round(c, 7) for c in q]


class Glb:
    """Collects buffer views and accessors and writes the file."""

    def __init__(self):
        self.binary, self.views, self.accessors = bytearray(), [], []

    def view(self, data, target=None):
        self.binary += b"\0" * (-len(self.binary) % 4)
        entry = {"buffer": 0, "byteOffset": len(self.binary), "byteLength": len(data)}
        if target:
            entry["target"] = target
        self.binary += data
        self.views.append(entry)
        return len(self.views) - 1

    def floats(self, rows, bounds=False):
        width = len(rows[0])
        rows = [tuple(struct.unpack("<f", struct.pack("<f", c))[0] for c in row) for row in rows]
        data = struct.pack(f"<{width * len(rows)}f", *(c for row in rows for c in row))
        entry = {"bufferView": self.view(data, 34962), "componentType": 5126, "count": len(rows), "type": f"VEC{width}"}
        if bounds:
            entry["min"] = [min(c) for c in zip(*rows)]
            entry["max"] = [max(c) for c in zip(*rows)]
        self.accessors.append(entry)
        return len(self.accessors) - 1

    def indices(self, values):
        data = struct.pack(f"<{len(values)}H", *values)
        self.accessors.append({"bufferView": self.view(data, 34963), "componentType": 5123, "count": len(values),
                               "type": "SCALAR"})
        return len(self.accessors) - 1

    def bytes(self, document):
        document.update(buffers=[{"byteLength": len(self.binary)}], bufferViews=self.views, accessors=self.accessors)
        text = json.dumps(document, separators=(",", ":"), sort_keys=True).encode()
        text += b" " * (-len(text) % 4)
        binary = bytes(self.binary) + b"\0" * (-len(self.binary) % 4)
        total = 12 + 8 + len(text) + 8 + len(binary)
        return (struct.pack("<4sII", b"glTF", 2, total) + struct.pack("<I4s", len(text), b"JSON") + text
                + struct.pack("<I4s", len(binary), b"BIN\0") + binary)


def material_json(name, spec):
    pbr = {"baseColorFactor": [*spec["color"], 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.9}
    entry = {"name": name, "pbrMetallicRoughness": pbr}
    if "texture" in spec:
        pbr["baseColorTexture"] = {"index": spec["texture"]}
    if spec.get("mask"):
        entry.update(alphaMode="MASK", alphaCutoff=0.5, doubleSided=True)
    if "emission" in spec:
        color, strength = spec["emission"]
        entry["emissiveFactor"] = list(color)
        entry["extensions"] = {"KHR_materials_emissive_strength": {"emissiveStrength": strength}}
    return entry


def build():
    glb, nodes, meshes = Glb(), [], []
    material_index = {name: i for i, name in enumerate(MATERIALS)}
    for name, mesh in house() + furniture():
        attributes = {"POSITION": glb.floats(mesh.position, bounds=True), "NORMAL": glb.floats(mesh.normal)}
        if "texture" in MATERIALS[mesh.material]:
            attributes["TEXCOORD_0"] = glb.floats(mesh.uv)
        meshes.append({"name": name, "primitives": [{"attributes": attributes, "indices": glb.indices(mesh.index),
                                                     "material": material_index[mesh.material]}]})
        nodes.append({"name": name, "mesh": len(meshes) - 1})
        if name in ("outside", "ground"):  # only ever seen from afar
            nodes[-1]["extras"] = {"relume": {"texelDensity": 0.25}}

    # A ball that a game would move: no part of the bake, drawn with the light of the grid.
    toy = ball("red", 0.14, 12, 24)
    attributes = {"POSITION": glb.floats(toy.position, bounds=True), "NORMAL": glb.floats(toy.normal)}
    meshes.append({"name": "toy", "primitives": [{"attributes": attributes, "indices": glb.indices(toy.index),
                                                  "material": material_index["ochre"]}]})
    nodes.append({"name": "toy", "mesh": len(meshes) - 1, "translation": [3.9, 0.14, 1.3],
                  "extras": {"relume": {"bake": "dynamic"}}})

    cameras = []
    for name, at, toward, yfov in (("cam_living", (2.5, 1.65, 3.92), (2.6, 0.85, 0.0), 1.05),
                                   ("cam_hall", (7.95, 1.6, 3.75), (5.7, 1.05, 0.9), 1.05)):
        cameras.append({"name": name, "type": "perspective", "perspective": {"yfov": yfov, "znear": 0.02, "zfar": 100.0}})
        nodes.append({"name": name, "camera": len(cameras) - 1, "translation": list(at),
                      "rotation": look_along([b - a for a, b in zip(at, toward)])})

    lights = [
        {"name": "sun", "type": "directional", "color": [1.0, 0.93, 0.80], "intensity": 14.0},
        {"name": "lamp", "type": "point", "color": [1.0, 0.72, 0.42], "intensity": 3.0},
        {"name": "spot", "type": "spot", "color": [0.95, 0.97, 1.0], "intensity": 22.0,
         "spot": {"innerConeAngle": 0.28, "outerConeAngle": 0.42}},
    ]
    places = [((2.0, 6.0, -6.0), (0.22, -0.62, 0.8)), ((4.5, 1.7, 0.55), (0.0, -1.0, 0.1)),
              ((7.6, 2.5, 3.3), (-0.6, -1.5, -2.6))]
    for i, (at, direction) in enumerate(places):
        nodes.append({"name": lights[i]["name"], "translation": list(at), "rotation": look_along(direction),
                      "extensions": {"KHR_lights_punctual": {"light": i}}})

    for name, x in (("play_living", LIVING), ("play_hall", HALL)):
        nodes.append({"name": name, "translation": [sum(x) / 2, HEIGHT / 2, DEPTH / 2],
                      "extras": {"relume": {"volume": [round(x[1] - x[0] - 0.2, 3), HEIGHT - 0.2, DEPTH - 0.2]}}})

    images = [{"name": "parquet", "mimeType": "image/png", "bufferView": glb.view(png(64, 64, parquet, False))},
              {"name": "lattice", "mimeType": "image/png", "bufferView": glb.view(png(40, 40, lattice, True))}]
    return glb.bytes({
        "asset": {"version": "2.0", "generator": "samples/level/make_level.py"},
        "extensionsUsed": ["KHR_lights_punctual", "KHR_materials_emissive_strength"],
        "extensions": {"KHR_lights_punctual": {"lights": lights}},
        "scene": 0, "scenes": [{"name": "two_rooms", "nodes": list(range(len(nodes)))}],
        "nodes": nodes, "meshes": meshes, "cameras": cameras, "images": images,
        "materials": [material_json(name, spec) for name, spec in MATERIALS.items()],
        "samplers": [{"magFilter": 9729, "minFilter": 9987, "wrapS": 10497, "wrapT": 10497}],
        "textures": [{"source": 0, "sampler": 0}, {"source": 1, "sampler": 0}],
    })


if __name__ == "__main__":
    output = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else pathlib.Path(__file__).with_name("two_rooms.glb")
    output.write_bytes(build())
    print(f"{output}: {output.stat().st_size} bytes")
