# SPDX-License-Identifier: MIT
"""What the examples have in place of a game: the triangles of a level, and shadows by rays through them, in numpy."""
import json
import struct
from dataclasses import dataclass

import numpy


@dataclass
class LevelPart:
    """A node of a level: its triangles in the world, and what they reflect on the whole."""
    name: str
    corners: object  # [m] (n, 3, 3)
    albedo: tuple    # of the first material; textures count as half


def parts_of(path):
    """The nodes of a .glb that have meshes, and are moved, neither turned nor scaled."""
    with open(path, 'rb') as file:
        data = file.read()
    length, = struct.unpack_from('<I', data, 12)
    document, binary = json.loads(data[20:20 + length]), data[28 + length:]

    def read(index):
        accessor = document['accessors'][index]
        view = document['bufferViews'][accessor['bufferView']]
        kind = {5123: numpy.uint16, 5125: numpy.uint32, 5126: numpy.float32}[accessor['componentType']]
        width = {'SCALAR': 1, 'VEC3': 3}[accessor['type']]
        start = view.get('byteOffset', 0) + accessor.get('byteOffset', 0)
        return numpy.frombuffer(binary, kind, accessor['count'] * width, start).reshape(-1, width)

    found = []
    for node in document['nodes']:
        if 'mesh' not in node:
            continue
        primitives = document['meshes'][node['mesh']]['primitives']
        corners = [(read(p['attributes']['POSITION']) + numpy.float32(node.get('translation', (0, 0, 0))))[
            read(p['indices']).ravel()].reshape(-1, 3, 3) for p in primitives]
        look = document['materials'][primitives[0]['material']]['pbrMetallicRoughness']
        albedo = (0.5,) * 3 if 'baseColorTexture' in look else tuple(look.get('baseColorFactor', (1, 1, 1))[:3])
        found.append(LevelPart(node.get('name', ''), numpy.concatenate(corners), albedo))
    return found


def blocked(origins, directions, distances, corners):
    """Whether rays hit a triangle before their ends (Moeller and Trumbore 1997). (n,)"""
    a, ab, ac = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    p = numpy.cross(directions[:, None], ac)                      # (rays, triangles, 3)
    determinant = numpy.einsum('tk,rtk->rt', ab, p)
    scale = 1.0 / numpy.where(numpy.abs(determinant) > 1e-12, determinant, numpy.inf)
    s = origins[:, None] - a
    u = numpy.einsum('rtk,rtk->rt', s, p) * scale
    q = numpy.cross(s, ab)
    v = numpy.einsum('rk,rtk->rt', directions, q) * scale
    t = numpy.einsum('tk,rtk->rt', ac, q) * scale
    return ((u >= 0) & (v >= 0) & (u + v <= 1) & (t > 1e-3) & (t < distances[:, None] - 1e-3)).any(axis=1)


class Shadows:
    """Visibility of lights that stand still: rays once for each, then from memory."""

    def __init__(self, lights, corners, away):
        self.lights, self.corners, self.away = lights, corners, away
        self.known = {}

    def __call__(self, index, positions, normals):
        key = index, positions.tobytes()
        if key not in self.known:
            light, origins = self.lights[index], positions + 1e-3 * normals
            if light.kind == 0:  # directional
                toward = numpy.tile(-numpy.float32(light.direction), (len(origins), 1))
                distances = numpy.full(len(origins), self.away, numpy.float32)
            else:
                toward = numpy.float32(light.position) - origins
                distances = numpy.linalg.norm(toward, axis=1)
                toward /= distances[:, None]
            self.known[key] = ~blocked(origins, toward, distances, self.corners)
        return self.known[key]
