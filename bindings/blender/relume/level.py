# SPDX-License-Identifier: MIT
"""The open scene as a level: Blender's own glTF exporter, given what a render shows, then what it leaves out of units and materials.

Lamps are exported in candela and lux, as glTF wants, and the level says so. Blender's unit scale is put into the level, whose lengths are
metres: a scene that is drawn in centimetres is as bright as it was, so that lamps lose with the square of their distances.
"""
import contextlib

import bpy

from . import gltf, instances
from .program import RelumeError

LAYER = "Relume"  # UV map of the light map's coordinates

# Of faces without a material, as Blender draws them and as its exporter writes a new material. glTF has them white, which absorbs nothing.
DEFAULT_MATERIAL = {"name": "Blender default", "doubleSided": True,
                    "pbrMetallicRoughness": {"baseColorFactor": [0.8, 0.8, 0.8, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.5}}


def said(owner):
    """What the property `relume` says of an object or a scene."""
    found = owner.get("relume")
    if found is None:
        return {}
    if not hasattr(found, "to_dict"):
        raise RelumeError(f'{owner.bl_rna.name.lower()} "{owner.name}": its property "relume" is no dictionary; set the property\'s type to '
                          'Python and its value to one')
    return found.to_dict()


def inherited(object_):
    """What is said of an object, by itself or by those above it. A volume is of itself alone."""
    above = inherited(object_.parent) if object_.parent else {}
    above.pop("volume", None)
    return {**above, **said(object_)}


def shown_objects(scene):
    """Objects of the scene that are part of the level: what a render of the view layer shows, even where the window hides it, and what no
    render shows anyway, play volumes and cameras, but not of collections that are excluded."""
    shown = {scene.camera} if scene.camera else set()

    def visit(layer, hidden):
        hidden = hidden or layer.collection.hide_render
        for object_ in layer.collection.objects if not layer.exclude else ():
            draws = object_.type not in {"EMPTY", "CAMERA", "ARMATURE"} or object_.instance_type != "NONE"
            instanced = object_.parent is not None and object_.parent.instance_type in instances.INSTANCERS
            if not (draws and (hidden or object_.hide_render or instanced)):
                shown.add(object_)
        for child in layer.children:
            visit(child, hidden)
    visit(bpy.context.view_layer.layer_collection, False)
    return shown


@contextlib.contextmanager
def only_shown(scene, shown):
    """Hides from renders what is not shown and nothing else, for the exporter goes by that; and shows the rest in the window, where
    modifiers of what is hidden do nothing."""
    collections = [each for each in scene.collection.children_recursive if not shown.isdisjoint(each.all_objects)]
    wanted = [(each, name, False) for each in collections for name in ("hide_render", "hide_viewport")]
    wanted += [(each, "hide_viewport", False) for each in shown] + [(each, "hide_render", each not in shown) for each in scene.objects]
    with instances.changed(wanted):
        yield


@contextlib.contextmanager
def without_layer(meshes):
    """Our own UV map is no part of the level: as TEXCOORD_1 it would be what the next bake unwraps by."""
    kept = []
    for mesh in {mesh for mesh in meshes if mesh.library is None and LAYER in mesh.uv_layers}:
        layer, values = mesh.uv_layers[LAYER], [0.0] * (2 * len(mesh.loops))
        layer.data.foreach_get("uv", values)
        kept.append((mesh, values, mesh.uv_layers.active.name == LAYER, layer.active_render))
        mesh.uv_layers.remove(layer)
    try:
        yield
    finally:
        for mesh, values, active, render in kept:
            layer = mesh.uv_layers.new(name=LAYER, do_init=False)
            layer.data.foreach_set("uv", values)
            layer.active_render = render
            if active:
                mesh.uv_layers.active = layer


def export(scene, path):
    """Write the scene as a level. Gives names of what it cannot have, by what to do about it."""
    wanted = dict(filepath=path, export_format="GLB", export_extras=True, export_cameras=True, export_lights=True, export_apply=True,
                  export_yup=True, export_animations=False, export_import_convert_lighting_mode="SPEC", use_active_scene=True,
                  use_renderable=True)
    known = bpy.ops.export_scene.gltf.get_rna_type().properties.keys()
    shown, of_scene = shown_objects(scene), said(scene)
    of_objects = {each.name: inherited(each) for each in shown}
    with without_layer(mesh for mesh in bpy.data.meshes if not mesh.is_editmode), instances.found_in(scene, shown) as found, \
            only_shown(scene, shown), instances.exporting_objects_alone(scene, found):
        bpy.ops.export_scene.gltf(**{name: value for name, value in wanted.items() if name in known})
    document = gltf.Document(path)
    for exported in document.json.get("scenes", []):
        exported.setdefault("extras", {})["relume"] = {**of_scene, "lightUnit": "photometric"}
    found.write(document.json, inherited)
    complete_nodes(document.json.get("nodes", []), shown, of_objects, found.hidden)
    give_default_material(document.json)
    if scene.unit_settings.system != "NONE":
        scale_to_metres(document.json, scene.unit_settings.scale_length)
    document.write(path)
    return found.left_out


def complete_nodes(nodes, shown, of_objects, hidden):
    """Say again what an object that was left out said of those below it, and leave out what is hidden inside of collection instances, of
    which the exporter takes all."""
    orphans = {each.name for each in shown if above_is_hidden(each, shown)}
    for node in nodes:
        if node.get("name") in orphans and of_objects[node["name"]]:
            node.setdefault("extras", {})["relume"] = of_objects[node["name"]]
        if node.get("name") in hidden:
            leave_out(nodes, node, hidden[node["name"]])


def leave_out(nodes, instance, names):
    below = list(instance.get("children", []))
    while below:
        node = nodes[below.pop()]
        below += node.get("children", [])
        if node.get("name") in names:
            node.pop("mesh", None)
            node.pop("extensions", None)


def above_is_hidden(object_, shown):
    return object_.parent is not None and (object_.parent not in shown or above_is_hidden(object_.parent, shown))


def give_default_material(document):
    bare = [each for mesh in document.get("meshes", []) for each in mesh["primitives"] if "material" not in each]
    if bare:  # after all others, whose numbers stay
        document.setdefault("materials", []).append(DEFAULT_MATERIAL)
    for primitive in bare:
        primitive["material"] = len(document["materials"]) - 1


def scale_to_metres(document, scale):
    if abs(scale - 1.0) < 1e-6:
        return
    for exported in document.get("scenes", []):
        root = {"name": "Blender units", "scale": [scale] * 3, "children": exported.get("nodes", [])}
        document["nodes"].append(root)
        exported["nodes"] = [len(document["nodes"]) - 1]
    for light in document.get("extensions", {}).get("KHR_lights_punctual", {}).get("lights", []):
        if light["type"] != "directional":
            light["intensity"] = light.get("intensity", 1.0) * scale * scale
            if "range" in light:
                light["range"] *= scale
    for camera in document.get("cameras", []):
        lengths = camera.get(camera["type"], {})
        for name in {"xmag", "ymag", "znear", "zfar"} & lengths.keys():
            lengths[name] *= scale
