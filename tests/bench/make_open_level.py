#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Make a level whose ground, or whose sky box, is far larger than what can be seen of it.

A ground of L metres and what stands in its middle: houses (boxes with a doorway and a window, one in four lit inside)
along two streets, or one box of 1 m. Cameras stand in the street, or beside the box. Two triangles a ground, so that
nothing but the baker decides how finely it is looked at. The same bytes on every run.

    tests/bench/make_open_level.py OUTPUT.gltf [--ground L] [--houses N] [--sky-box L] [--tilt DEGREES]
"""
import argparse
import base64
import json
import math
import struct


class Mesh:
    def __init__(self):
        self.position, self.normal, self.index = [], [], []

    def quad(self, corners):
        """Four corners, counter-clockwise seen from outside."""
        a, b, d = corners[0], corners[1], corners[3]
        u, v = [b[k] - a[k] for k in range(3)], [d[k] - a[k] for k in range(3)]
        n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
        length = math.sqrt(sum(x * x for x in n))
        first = len(self.position)
        self.position += [tuple(c) for c in corners]
        self.normal += [tuple(x / length for x in n)] * 4
        self.index += [first, first + 1, first + 2, first, first + 2, first + 3]
        return self

    def box(self, low, high, inward=False):
        for axis in range(3):
            for sign in (-1, 1):
                u, v = (axis + 1) % 3, (axis + 2) % 3
                corners = []
                for s, t in ((0, 0), (1, 0), (1, 1), (0, 1)):
                    corner = [0.0, 0.0, 0.0]
                    corner[axis] = high[axis] if sign > 0 else low[axis]
                    corner[u], corner[v] = (low, high)[s][u], (low, high)[t][v]
                    corners.append(corner)
                self.quad(corners if (sign > 0) != inward else corners[::-1])
        return self


def house(x, z):
    """8 x 6 m and 3 m high, walls of 0.2 m, a doorway towards -z and a window towards +z."""
    m, w, h = Mesh(), 0.2, 3.0
    x0, x1, z0, z1 = x - 4.0, x + 4.0, z - 3.0, z + 3.0
    m.box((x0, 0, z0), (x0 + w, h, z1)).box((x1 - w, 0, z0), (x1, h, z1))
    m.box((x0 + w, 0, z0), (x - 0.6, h, z0 + w)).box((x + 0.6, 0, z0), (x1 - w, h, z0 + w))
    m.box((x - 0.6, 2.1, z0), (x + 0.6, h, z0 + w))
    m.box((x0 + w, 0, z1 - w), (x - 1.0, h, z1)).box((x + 1.0, 0, z1 - w), (x1 - w, h, z1))
    m.box((x - 1.0, 0, z1 - w), (x + 1.0, 0.9, z1)).box((x - 1.0, 2.0, z1 - w), (x + 1.0, h, z1))
    return m.box((x0, h, z0), (x1, h + w, z1))


class Level:
    def __init__(self):
        self.data = b""
        self.gltf = {"asset": {"version": "2.0", "generator": "make_open_level"}, "scene": 0, "scenes": [{"nodes": []}],
                     "nodes": [], "meshes": [], "cameras": [], "materials": [], "accessors": [], "bufferViews": []}

    def view(self, data, target):
        self.gltf["bufferViews"].append({"buffer": 0, "byteOffset": len(self.data), "byteLength": len(data),
                                         "target": target})
        self.data += data
        return len(self.gltf["bufferViews"]) - 1

    def material(self, name, colour, emission=None):
        material = {"name": name, "pbrMetallicRoughness": {"baseColorFactor": [*colour, 1.0], "metallicFactor": 0.0}}
        if emission:
            material["emissiveFactor"] = [1.0, 1.0, 1.0]
            material["extensions"] = {"KHR_materials_emissive_strength": {"emissiveStrength": emission}}
            self.gltf["extensionsUsed"] = ["KHR_lights_punctual", "KHR_materials_emissive_strength"]
        self.gltf["materials"].append(material)
        return len(self.gltf["materials"]) - 1

    def node(self, node):
        self.gltf["nodes"].append(node)
        self.gltf["scenes"][0]["nodes"].append(len(self.gltf["nodes"]) - 1)

    def add(self, name, mesh, material, **node):
        flat = lambda rows: b"".join(struct.pack("<3f", *r) for r in rows)
        low = [min(struct.unpack("<f", struct.pack("<f", p[k]))[0] for p in mesh.position) for k in range(3)]
        high = [max(struct.unpack("<f", struct.pack("<f", p[k]))[0] for p in mesh.position) for k in range(3)]
        first = len(self.gltf["accessors"])
        self.gltf["accessors"] += [
            {"bufferView": self.view(flat(mesh.position), 34962), "componentType": 5126, "type": "VEC3",
             "count": len(mesh.position), "min": low, "max": high},
            {"bufferView": self.view(flat(mesh.normal), 34962), "componentType": 5126, "type": "VEC3",
             "count": len(mesh.normal)},
            {"bufferView": self.view(struct.pack(f"<{len(mesh.index)}I", *mesh.index), 34963), "componentType": 5125,
             "type": "SCALAR", "count": len(mesh.index)}]
        self.gltf["meshes"].append({"name": name, "primitives": [{
            "attributes": {"POSITION": first, "NORMAL": first + 1}, "indices": first + 2, "material": material}]})
        self.node({"name": name, "mesh": len(self.gltf["meshes"]) - 1, **node})

    def camera(self, name, eye, target):
        """Looks from one point to another, level with the horizon or nearly."""
        d = [t - e for t, e in zip(target, eye)]
        yaw, pitch = math.atan2(-d[0], -d[2]), math.atan2(d[1], math.hypot(d[0], d[2]))
        cy, sy, cp, sp = math.cos(yaw / 2), math.sin(yaw / 2), math.cos(pitch / 2), math.sin(pitch / 2)
        self.gltf["cameras"].append({"type": "perspective", "perspective": {
            "yfov": 0.9, "znear": 0.05, "aspectRatio": 1.5}})
        self.node({"name": name, "camera": len(self.gltf["cameras"]) - 1, "translation": list(eye),
                   "rotation": [cy * sp, sy * cp, -sy * sp, cy * cp]})

    def lights(self, lights):
        self.gltf.setdefault("extensionsUsed", ["KHR_lights_punctual"])
        self.gltf["extensions"] = {"KHR_lights_punctual": {"lights": [l for l, _ in lights]}}
        for i, (light, node) in enumerate(lights):
            self.node({"name": light["name"], **node, "extensions": {"KHR_lights_punctual": {"light": i}}})

    def write(self, path):
        for each in ("cameras",):
            if not self.gltf[each]:
                del self.gltf[each]
        self.gltf["buffers"] = [{"byteLength": len(self.data), "uri": "data:application/octet-stream;base64," +
                                 base64.b64encode(self.data).decode()}]
        with open(path, "w", encoding="utf-8") as file:
            json.dump(self.gltf, file)


def make(ground, houses, sky_box, tilt, camera):
    level = Level()
    grey, warm = level.material("ground", (0.5, 0.45, 0.4)), level.material("wall", (0.7, 0.3, 0.2))
    blue = level.material("wall 2", (0.3, 0.5, 0.7))
    h = 0.5 * ground
    a = math.radians(tilt)
    turn = {"rotation": [math.sin(a / 2), 0, 0, math.cos(a / 2)]} if tilt else {}
    level.add("ground", Mesh().quad([(-h, 0, -h), (-h, 0, h), (h, 0, h), (h, 0, -h)]), grey, **turn)
    lamp = {"name": "lamp", "type": "point", "color": [1, 0.9, 0.8], "intensity": 60.0}
    if houses:
        for i in range(houses):
            row, column = i % 2, i // 2
            x, z = 12.0 * (column - 0.5 * (houses // 2 - 1)), 14.0 * (row - 0.5)
            level.add(f"house {i}", house(x, z), (warm, blue)[i % 2])
        level.camera("street", (-20, 1.7, 0), (10, 1.2, 0.5))
        level.camera("room", (-8.5, 1.6, 8.5), (-3.5, 1.0, 5.0))
        lights = [(lamp, {"translation": [-3, 2.2, 1]})]
    else:
        level.add("box", Mesh().box((-0.5, 0, -0.5), (0.5, 1, 0.5)), warm)
        if camera:
            level.camera("box", (-2.2, 1.6, 2.4), (0, 0.4, 0))
        lights = [(lamp, {"translation": [-2, 2.0, 0.5]})]
    if sky_box:
        s = 0.5 * sky_box
        level.add("sky box", Mesh().box((-s, -s, -s), (s, s, s), inward=True), level.material("sky", (0.4, 0.6, 0.9)))
    sun = {"name": "sun", "type": "directional", "color": [1, 1, 1], "intensity": 3.0}
    lights.append((sun, {"rotation": [-0.4226, 0.2, 0, 0.8839]}))
    level.lights(lights)
    return level


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("output")
    parser.add_argument("--ground", type=float, default=400.0, help="side of the ground [m]")
    parser.add_argument("--houses", type=int, default=20, help="0: one box of 1 m")
    parser.add_argument("--sky-box", type=float, default=0.0, help="side of a box around it all [m]; 0: none")
    parser.add_argument("--tilt", type=float, default=0.0, help="of the ground about x [degrees]")
    parser.add_argument("--no-camera", action="store_true", help="leave out the camera beside the box")
    o = parser.parse_args()
    make(o.ground, o.houses, o.sky_box, o.tilt, not o.no_camera).write(o.output)


if __name__ == "__main__":
    main()
