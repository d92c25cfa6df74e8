# SPDX-License-Identifier: MIT
"""The open scene as a level: Blender's own glTF exporter, then what it leaves out of units.

Lamps are exported in candela and lux, as glTF wants, and the level says so. Blender's unit scale is put into the level, whose lengths are
metres: a scene that is drawn in centimetres is as bright as it was, so that lamps lose with the square of their distances.
"""
import contextlib

import bpy

from . import gltf

LAYER = "Relume"  # UV map of the light map's coordinates


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
    """Write the scene as a level."""
    wanted = dict(filepath=path, export_format="GLB", export_extras=True, export_cameras=True, export_lights=True, export_apply=True,
                  export_yup=True, export_animations=False, export_import_convert_lighting_mode="SPEC", use_active_scene=True)
    known = bpy.ops.export_scene.gltf.get_rna_type().properties.keys()
    with without_layer(object_.data for object_ in scene.objects if object_.type == "MESH"):
        bpy.ops.export_scene.gltf(**{name: value for name, value in wanted.items() if name in known})
    document = gltf.Document(path)
    for exported in document.json.get("scenes", []):
        said = exported.setdefault("extras", {}).setdefault("relume", {})
        said.setdefault("lightUnit", "photometric")
    if scene.unit_settings.system != "NONE":
        scale_to_metres(document.json, scene.unit_settings.scale_length)
    document.write(path)


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


def sky(scene):
    """Options of `relume render` for the scene's world: a colour, or an image of OpenEXR or Radiance HDR on disk."""
    world = scene.world
    if world is None:
        return []
    if not world.use_nodes:
        return ["--sky", ",".join(f"{value:.9g}" for value in world.color)]
    background = next((node for node in world.node_tree.nodes if node.type == "BACKGROUND"), None)
    if background is None:
        return []
    strength, color = background.inputs["Strength"].default_value, background.inputs["Color"]
    if not color.is_linked:
        return ["--sky", ",".join(f"{strength * value:.9g}" for value in color.default_value[:3])]
    source = color.links[0].from_node
    path = bpy.path.abspath(source.image.filepath) if source.type == "TEX_ENVIRONMENT" and source.image else ""
    if path.lower().endswith((".exr", ".hdr")) and strength == 1.0:
        return ["--sky-map", path, "--sky-rotation", "-90"]
    return []
