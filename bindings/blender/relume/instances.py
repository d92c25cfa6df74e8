# SPDX-License-Identifier: MIT
"""What a render shows beside the objects that stand for themselves: instances by Geometry Nodes, by faces, vertices and particles, within
collection instances too, and metaballs. Blender's exporter makes collection instances, and has most others wrong or not at all. Here they are found in what
Blender evaluates, a stand-in for each different mesh or lamp is exported with the scene, and nodes that share it are put into the file."""
import contextlib

import bpy
import mathutils
import numpy

INSTANCERS = {"VERTS", "FACES"}  # whose children are instanced, and do not stand for themselves
_WRITTEN = {"MESH", "CURVE", "SURFACE", "FONT", "LIGHT"}  # of what the exporter makes more than an empty node
_NO_MESH = {"VOLUME", "POINTCLOUD", "CURVES", "GPENCIL", "GREASEPENCIL"}
_AXES = numpy.array(((1, 0, 0, 0), (0, 0, 1, 0), (0, -1, 0, 0), (0, 0, 0, 1)), float)  # Blender's to glTF's
_LAST = 2 ** 31 - 1  # ends an instance's persistent_id


@contextlib.contextmanager
def changed(wanted):
    """Attributes, as (owner, name, value), until the end."""
    kept = [(each, name, getattr(each, name), value) for each, name, value in wanted if getattr(each, name, value) != value]
    try:
        for each, name, _, value in kept:
            setattr(each, name, value)
        yield
    finally:
        for each, name, before, _ in reversed(kept):
            setattr(each, name, before)


@contextlib.contextmanager
def _window_as_render():
    """The window shows what a render does: scripts have no other evaluation of the scene."""
    layer = bpy.context.view_layer
    layers, eyes = [layer.layer_collection], [each for each in layer.objects if each.hide_get()]
    for each in layers:
        layers += each.children
    wanted = [(each, "hide_viewport", each.hide_render) for each in (*bpy.data.objects, *bpy.data.collections)]
    wanted += [(each, "show_instancer_for_viewport", each.show_instancer_for_render) for each in bpy.data.objects]
    wanted += [(each, "hide_viewport", False) for each in layers[1:]]
    wanted += [(each, "resolution", each.render_resolution) for each in bpy.data.metaballs]
    for each in bpy.data.particles:
        if each.type == "HAIR":  # others would start anew
            wanted += [(each, "display_percentage", 100)]
            wanted += [(each, name, each.rendered_child_count) for name in ("child_nbr", "child_percent")]
    with changed(wanted):
        for each in eyes:
            each.hide_set(False)
        try:
            yield
        finally:
            for each in eyes:
                each.hide_set(True)


@contextlib.contextmanager
def exporting_objects_alone(scene, found):
    """The exporter makes nodes of objects, the stand-ins among them, and of collection instances, as which it knows children best."""
    wanted = [(each, "instance_type", "NONE") for each in bpy.data.objects if each.instance_type in INSTANCERS]
    wanted += [(each, "render_type", "NONE") for each in bpy.data.particles if each.render_type in {"OBJECT", "COLLECTION"}]
    with changed(wanted):
        for each in found.stand_ins.values():
            scene.collection.objects.link(each)
        yield


@contextlib.contextmanager
def found_in(scene, shown):
    """Instances that the exporter leaves out, until the end, where their stand-ins go. Of `shown` goes what a render shows as an instance or by its
    instances alone."""
    found = Instances()
    try:
        with _window_as_render():
            found.gather(scene, shown)
        yield found
    finally:
        for each in found.stand_ins.values():
            data = each.data
            bpy.data.objects.remove(each)
            if isinstance(data, bpy.types.Mesh):
                bpy.data.meshes.remove(data)


class _Instance:
    """Of object_, made by `parent`, or None for a metaball's own mesh. matrix: to the world. source: name of the node to be like."""

    def __init__(self, object_, parent, matrix, source):
        self.object_, self.parent, self.matrix, self.source = object_, parent, matrix, source


class Instances:
    """left_out: names of what a level cannot have, by what to do about it. hidden: for the name of an object that instances a collection, names of
    what a render does not show of it."""

    def __init__(self):
        self.stand_ins, self.left_out, self.hidden, self._all = {}, {}, {}, []

    def gather(self, scene, shown):
        sources, standing, parents = {}, set(), set()
        children, places = {}, {}
        depsgraph = bpy.context.evaluated_depsgraph_get()  # and matrices are of now
        for each in bpy.data.objects:
            children.setdefault(each.parent, []).append(each)
        for each in shown:
            if each.instance_type == "COLLECTION":
                _add_places(places, each, each, numpy.array(each.matrix_world), children)
        exported = shown | {object_ for _, object_ in places}
        for each in depsgraph.object_instances:
            object_, evaluated = each.object.original, each.object
            self._note_left_out(object_, evaluated.type)
            if not each.is_instance:
                standing.add(object_)
                continue
            parent, matrix = each.parent.original, numpy.array(each.matrix_world)
            parents.add(parent)
            itself = object_ == parent and each.persistent_id[1] == _LAST  # the mesh that another kind of object has
            if evaluated.type not in {"MESH", "LIGHT"} or (itself and parent.type in _WRITTEN):
                continue
            if _take(places.get((parent, object_)), matrix[:3, 3]):
                continue
            own = evaluated.data == object_.evaluated_get(depsgraph).data
            key = object_ if own else evaluated.data.as_pointer()
            if key not in sources:
                skinned = any(modifier.type == "ARMATURE" for modifier in object_.modifiers)
                is_there = own and evaluated.type == "MESH" and object_ in exported and not skinned
                sources[key] = object_.name if is_there else self._stand_in(evaluated, own, depsgraph)
            if sources[key]:
                self._all.append(_Instance(object_, None if itself else parent, matrix, sources[key]))
            if itself:
                shown.discard(object_)
        shown -= {each for each in parents - standing if each.instance_type != "COLLECTION"}
        for (parent, object_), left in places.items():
            if numpy.all(numpy.isfinite(left)):
                self.hidden.setdefault(parent.name, set()).add(object_.name)

    def _note_left_out(self, object_, kind):
        if kind in _NO_MESH:
            self.left_out.setdefault("they have no mesh; convert them to meshes", set()).add(object_.name)
        elif kind == "LIGHT" and object_.data.type == "AREA":
            self.left_out.setdefault("glTF has no area lamps; model surfaces with emission", set()).add(object_.name)
        elif any(each.type == "PARTICLE_SYSTEM" and each.show_render and each.particle_system.settings.type == "HAIR" and
                 each.particle_system.settings.render_type == "PATH" for each in object_.modifiers):
            self.left_out.setdefault("their hair has no mesh; convert it to one", set()).add(object_.name)

    def _stand_in(self, evaluated, own, depsgraph):
        """Its name; None of what has no faces, or is no lamp of glTF's."""
        if evaluated.type == "LIGHT":
            data = evaluated.original.data if evaluated.data.type != "AREA" else None
        else:
            # With all layers Blender makes the object's own mesh anew, which another's is not to be.
            data = bpy.data.meshes.new_from_object(evaluated, preserve_all_data_layers=own, depsgraph=depsgraph)
            for i, slot in enumerate(evaluated.material_slots):
                if slot.link == "OBJECT" and i < len(data.materials):
                    data.materials[i] = slot.material and slot.material.original
            if not data.polygons:
                bpy.data.meshes.remove(data)
                data = None
        if data is None:
            return None
        object_ = bpy.data.objects.new("Relume stand-in", data)
        self.stand_ins[object_.name] = object_
        return object_.name

    def write(self, document, inherited):
        """Nodes for all, below those of the objects that make them, with what `inherited` says of an object."""
        if not self._all:
            return
        nodes, roots = document["nodes"], document["scenes"][document.get("scene", 0)]["nodes"]
        made, counts = set(self.stand_ins), {}
        sources, above = _sources(nodes, made), _worlds(nodes, roots)
        for each in self._all:
            index, like, turn = sources.get(each.source, (None, None, None))
            if like is None:  # without faces
                continue
            owner = each.parent or each.object_.parent
            below, world = above.get(owner and owner.name, (None, numpy.eye(4)))
            matrix = numpy.linalg.solve(world, _AXES @ each.matrix @ _AXES.T) @ turn
            counts[each.parent, each.object_] = counts.get((each.parent, each.object_), 0) + 1
            name = f"{each.parent.name}/{each.object_.name}.{counts[each.parent, each.object_]:03}" if each.parent else each.object_.name
            node = {**like, "name": name, "matrix": matrix.T.ravel().tolist()}
            says = {**(inherited(each.parent) if each.parent else {}), **inherited(each.object_)}
            says.pop("volume", None)
            if says:
                node["extras"] = {"relume": says}
            if each.source in made:  # the first takes the stand-in's place
                made.remove(each.source)
                roots.remove(index)
                nodes[index] = node
            else:
                index = len(nodes)
                nodes.append(node)
            (roots if below is None else nodes[below].setdefault("children", [])).append(index)


def _add_places(places, top, instance, matrix, children):
    """Where the exporter puts what `instance` instances: by `top`, the first of instances in one another, and object. matrix: of `instance`."""
    collection = instance.instance_collection
    within = [each for each in collection.all_objects if each.parent is None] if collection else []
    for each in within:
        within += children.get(each, [])
        to_world = matrix @ numpy.array(mathutils.Matrix.Translation(-collection.instance_offset)) @ numpy.array(each.matrix_world)
        if each.type in _WRITTEN:
            before = places.get((top, each), numpy.empty((0, 3)))
            places[top, each] = numpy.vstack((before, to_world[:3, 3]))
        if each.instance_type == "COLLECTION":
            _add_places(places, top, each, to_world, children)


def _take(places, where):
    """Whether one of these is there; it is no other's then."""
    if places is None:
        return False
    distances = numpy.abs(places - where).max(axis=1)
    nearest = distances.argmin()
    if not distances[nearest] < 1e-4 * (1 + numpy.abs(where).max()):
        return False
    places[nearest] = numpy.inf
    return True


def _local(node):
    if "matrix" in node:
        return numpy.array(node["matrix"]).reshape(4, 4).T
    x, y, z, w = node.get("rotation", (0, 0, 0, 1))
    return numpy.array(mathutils.Matrix.LocRotScale(mathutils.Vector(node.get("translation", (0, 0, 0))), mathutils.Quaternion((w, x, y, z)),
                                                    mathutils.Vector(node.get("scale", (1, 1, 1)))))


def _sources(nodes, stand_ins):
    """By name of the first node that shows something: its number, what that is, and how it turns it."""
    found = {}
    for index, node in enumerate(nodes):
        like = {key: node[key] for key in ("mesh", "extensions") if key in node}
        if like and "skin" not in node:
            turn = _local(node) if node.get("name") in stand_ins else numpy.eye(4)
            found.setdefault(node.get("name"), (index, like, turn))
    return found


def _worlds(nodes, roots):
    """By name of the node nearest to the top: its number and where it is; none of what has no extent."""
    found, left = {}, [(index, numpy.eye(4)) for index in roots]
    for index, above in left:
        world = above @ _local(nodes[index])
        if abs(numpy.linalg.det(world)) > 1e-30:
            found.setdefault(nodes[index].get("name"), (index, world))
            left += [(child, world) for child in nodes[index].get("children", ())]
    return found
