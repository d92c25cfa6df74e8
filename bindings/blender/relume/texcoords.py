# SPDX-License-Identifier: MIT
"""The light map's coordinates, from a level that `relume bake --export-glb` wrote, as a UV map on the objects it was exported from.

Triangles are told by their corners' positions, which exporters keep to the last bit. Charts may end inside a face of Blender, where a corner
would need two coordinates: such faces are cut into the triangles that they were exported as.
"""
import bmesh
import numpy

from . import gltf
from .level import LAYER, inherited, shown_objects

_SOURCE = "relume_loop"  # attribute of corners while faces are cut
ON_GRID = (1.0, 1.0)  # coordinate of triangles that the grid lights (docs/EXPORT.md)


def listed(names, most=8):
    """Names for a message: the first of them, and how many more there are."""
    names = sorted(names)
    return ", ".join(names[:most]) + (f" and {len(names) - most} more" if len(names) > most else "")


class Report:
    """What putting coordinates on objects did, by names."""

    def __init__(self):
        self.mapped, self.cut, self.left_out, self.taken_off = [], {}, {}, []

    def __str__(self):
        text = f"light-map coordinates on {len(self.mapped)} objects"
        if self.cut:
            text += f"; faces cut into triangles: {sum(self.cut.values())}, of {listed(self.cut)}"
        if self.taken_off:
            text += f"; no longer on the light map: {listed(self.taken_off)}"
        for why in sorted(set(self.left_out.values())):
            text += f"; none on {listed(name for name, its in self.left_out.items() if its == why)}: {why}"
        return text


def _keys(corners):
    """A key for each of n x 3 x 3 corners that does not depend on which of them is first, and the number of that one."""
    corners = numpy.ascontiguousarray(corners + numpy.float32(0.0), numpy.float32)  # -0 is 0
    rows = [[corner.tobytes() for corner in triangle] for triangle in corners]
    first = [row.index(min(row)) for row in rows]
    return [b"".join(row[i:] + row[:i]) for row, i in zip(rows, first)], first


def _triangles(document, node, texcoord):
    """Corners of a node's triangles in Blender's axes, and their coordinates in Blender's: v goes up."""
    corners, coordinates = [], []
    for primitive in document.json["meshes"][node["mesh"]]["primitives"]:
        attributes = primitive["attributes"]
        positions = document.array(attributes["POSITION"])
        indices = document.array(primitive["indices"])[:, 0] if "indices" in primitive else numpy.arange(len(positions))
        values = document.array(attributes[texcoord]) if texcoord in attributes else numpy.tile(ON_GRID, (len(positions), 1))
        corners.append(positions[indices][:, (0, 2, 1)] * numpy.array((1, -1, 1), numpy.float32))
        coordinates.append(values[indices] * (1, -1) + (0, 1))
    return numpy.concatenate(corners).reshape(-1, 3, 3), numpy.concatenate(coordinates).reshape(-1, 3, 2)


def _find(mesh, corners, coordinates):
    """Coordinates of the mesh's loop triangles, n x 3 x 2; None where they are not those that were exported."""
    held = {}
    for key, first, values in zip(*_keys(corners), coordinates):
        held.setdefault(key, []).append(numpy.roll(values, -first, axis=0))
    mesh.calc_loop_triangles()
    count = len(mesh.loop_triangles)
    if count != len(corners):
        return None
    vertices, positions = numpy.empty(3 * count, numpy.int32), numpy.empty(3 * len(mesh.vertices), numpy.float32)
    mesh.loop_triangles.foreach_get("vertices", vertices)
    mesh.vertices.foreach_get("co", positions)
    found = numpy.empty((count, 3, 2))
    for i, (key, first) in enumerate(zip(*_keys(positions.reshape(-1, 3)[vertices].reshape(-1, 3, 3)))):
        values = held.get(key)
        if not values:
            return None
        found[i] = numpy.roll(values.pop(0) if len(values) > 1 else values[0], first, axis=0)
    return found


def _torn(mesh, found):
    """Faces of which a corner has two coordinates."""
    count = len(mesh.loop_triangles)
    loops, faces = numpy.empty(3 * count, numpy.int32), numpy.empty(count, numpy.int32)
    mesh.loop_triangles.foreach_get("loops", loops)
    mesh.loop_triangles.foreach_get("polygon_index", faces)
    values = found.reshape(-1, 2)
    last = numpy.empty((len(mesh.loops), 2))
    last[loops] = values
    return numpy.unique(faces.repeat(3)[numpy.any(last[loops] != values, axis=1)])


def _corner_normals(mesh):
    """Of every loop, in the order of loops."""
    normals = numpy.empty(3 * len(mesh.loops), numpy.float32)
    if hasattr(mesh, "corner_normals"):  # from Blender 4.1 on
        mesh.corner_normals.foreach_get("vector", normals)
    else:
        mesh.calc_normals_split()
        mesh.loops.foreach_get("normal", normals)
        mesh.free_normals_split()
        mesh.use_auto_smooth = True  # else it has no normals of its own
    return normals.reshape(-1, 3)


def _cut(mesh, faces):
    """Each of these faces becomes its loop triangles, with all that its corners have, and looks as it did: normals stay, to what Blender keeps
    of them."""
    normals, wanted, triangles = _corner_normals(mesh), set(int(face) for face in faces), {}
    for triangle in mesh.loop_triangles:
        if triangle.polygon_index in wanted:
            first = mesh.polygons[triangle.polygon_index].loop_start
            triangles.setdefault(triangle.polygon_index, []).append([loop - first for loop in triangle.loops])
    made = bmesh.new()
    made.from_mesh(mesh)
    made.faces.ensure_lookup_table()
    source = made.loops.layers.int.new(_SOURCE)
    for face in made.faces:
        for loop in face.loops:
            loop[source] = loop.index
    for face in [made.faces[i] for i in sorted(triangles)]:
        loops = list(face.loops)
        for corners in triangles[face.index]:
            part = made.faces.new([loops[i].vert for i in corners], face)
            for loop, i in zip(part.loops, corners):
                loop.copy_from(loops[i])
        made.faces.remove(face)
    made.to_mesh(mesh)
    made.free()
    before = numpy.empty(len(mesh.loops), numpy.int32)
    mesh.attributes[_SOURCE].data.foreach_get("value", before)
    mesh.attributes.remove(mesh.attributes[_SOURCE])
    mesh.normals_split_custom_set(normals[before].tolist())


def _off_map(mesh):
    """Coordinates for every corner that are those of triangles off the map, in Blender's order."""
    return numpy.tile(numpy.array(ON_GRID, numpy.float32) * (1, -1) + (0, 1), (len(mesh.loops), 1))


def _write(mesh, found):
    layer = mesh.uv_layers.get(LAYER) or mesh.uv_layers.new(name=LAYER, do_init=False)
    if layer is None:
        return False
    loops = numpy.empty(3 * len(mesh.loop_triangles), numpy.int32)
    mesh.loop_triangles.foreach_get("loops", loops)
    values = _off_map(mesh)
    values[loops] = found.reshape(-1, 2)
    layer.data.foreach_set("uv", values.ravel())
    mesh.update()
    return True


def _take_off(mesh):
    """Coordinates of an earlier bake would read what lies there now. True where there were some."""
    values = numpy.empty(2 * len(mesh.loops), numpy.float32)
    mesh.uv_layers[LAYER].data.foreach_get("uv", values)
    off = _off_map(mesh).ravel()
    if numpy.array_equal(values, off):
        return False
    mesh.uv_layers[LAYER].data.foreach_set("uv", off)
    mesh.update()
    return True


def _put(object_, corners, coordinates, report):
    if object_.library is not None or object_.data.library is not None:
        return "linked from another file"
    found = _find(object_.data, corners, coordinates)
    if found is None:
        return "modifiers make other faces, apply them" if object_.modifiers else "faces are not as they were exported"
    torn = _torn(object_.data, found)
    if len(torn) > 0:
        _cut(object_.data, torn)
        report.cut[object_.name] = len(torn)
        found = _find(object_.data, corners, coordinates)
        if found is None:
            return "faces could not be cut as they were exported"
    return None if _write(object_.data, found) else "as many UV maps as Blender allows"


def make_single_users(scene):
    """A mesh for every object that shares one and has a place of its own on the light map. Before the level is exported, where meshes have
    their names. Gives the names of the objects."""
    copied, shown = [], shown_objects(scene)
    for object_ in scene.objects:
        if object_.type == "MESH" and object_.library is None and object_.data.library is None and \
                object_.data.users - object_.data.use_fake_user > 1 and _may_be_mapped(object_, shown):
            object_.data = object_.data.copy()
            copied.append(object_.name)
    return copied


def _may_be_mapped(object_, shown):
    skinned = any(each.type == "ARMATURE" and each.object for each in object_.modifiers)
    return object_ in shown and not skinned and inherited(object_).get("bake", "static") == "static"


def put_on_objects(scene, path):
    """path: a level with coordinates, as relume bake --export-glb writes it. Gives a Report."""
    document, report, nodes = gltf.Document(path), Report(), {}
    lightmap = document.json["asset"].get("extras", {}).get("relume", {}).get("lightmap")
    texcoord = f"TEXCOORD_{lightmap['texcoord']}" if lightmap else None  # None: nothing is on it
    for node in document.json["nodes"]:
        if "mesh" in node:
            on_map = any(texcoord in each["attributes"] for each in document.json["meshes"][node["mesh"]]["primitives"])
            nodes.setdefault(node.get("name"), []).append(node if on_map else None)
    meshes, others = set(), []
    for object_ in [each for each in scene.objects if each.type == "MESH"]:
        named = nodes.get(object_.name, [])
        if not any(named):
            others.append(object_)
            continue
        why = "several nodes of the level have its name"
        if len(named) == 1:
            why = _put(object_, *_triangles(document, named[0], texcoord), report)
        if why:
            report.left_out[object_.name] = why
            others.append(object_)
        else:
            report.mapped.append(object_.name)
            meshes.add(object_.data)
    for object_ in others:
        mesh = object_.data
        if mesh.library is None and LAYER in mesh.uv_layers and mesh not in meshes and _take_off(mesh):
            report.taken_off.append(object_.name)
    return report
