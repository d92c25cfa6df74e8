# SPDX-License-Identifier: MIT
"""Bake a level's indirect diffuse light into its light map by Blender's Cycles, as one would without Relume.

    blender -b --factory-startup --python tests/measure/cycles_bake.py -- GAME.glb LIGHTS BOUNCES PREFIX SAMPLES...

GAME.glb is what `relume bake --export-glb` wrote, so that both light the same texels. LIGHTS: names of its directional and
point lights, by commas. The i-th of the numbers of samples per texel is written to PREFIX_i.raw, RGBA floats, rows from the
bottom: irradiance / pi, and 1 in alpha where a texel was baked. No two share their random numbers. Lines say how many CPU
seconds each bake took.
"""
import json
import math
import struct
import sys
import time

import numpy

numpy.bool = bool  # Debian's importer is older than its numpy
import bpy


def json_of(path):
    with open(path, "rb") as file:
        length = struct.unpack("<5I", file.read(20))[3]
        return json.loads(file.read(length))


def diffuse(old):
    """The material as the baker sees it: Lambertian, with the alpha test of a mask."""
    nodes = old.node_tree.nodes
    principled = next((n for n in nodes if n.type == "BSDF_PRINCIPLED"), None)
    color = principled.inputs["Base Color"] if principled else None
    alpha = principled.inputs["Alpha"] if principled else None
    links = old.node_tree.links
    bsdf, output = nodes.new("ShaderNodeBsdfDiffuse"), next(n for n in nodes if n.type == "OUTPUT_MATERIAL")
    if color is not None and color.links:
        links.new(color.links[0].from_socket, bsdf.inputs["Color"])
    elif color is not None:
        bsdf.inputs["Color"].default_value = color.default_value
    surface = bsdf.outputs[0]
    if alpha is not None and alpha.links and old.blend_method == "CLIP":
        clear, mix, test = (nodes.new(k) for k in ("ShaderNodeBsdfTransparent", "ShaderNodeMixShader", "ShaderNodeMath"))
        test.operation = "GREATER_THAN"
        test.inputs[1].default_value = old.alpha_threshold
        links.new(alpha.links[0].from_socket, test.inputs[0])
        links.new(test.outputs[0], mix.inputs[0])
        links.new(clear.outputs[0], mix.inputs[1])
        links.new(bsdf.outputs[0], mix.inputs[2])
        surface = mix.outputs[0]
    links.new(surface, output.inputs["Surface"])


def set_lights(level, names):
    punctual = level.get("extensions", {}).get("KHR_lights_punctual", {}).get("lights", [])
    said = {}
    for node in level["nodes"]:
        index = node.get("extensions", {}).get("KHR_lights_punctual", {}).get("light")
        if index is not None:
            said[node.get("name")] = punctual[index]
    found = []
    for obj in [o for o in bpy.data.objects if o.type == "LIGHT"]:
        if obj.name not in names:
            bpy.data.objects.remove(obj)
            continue
        light = said[obj.name]
        if light["type"] == "spot":
            sys.exit("a spot: Blender's has another falloff")
        obj.data.color = light.get("color", [1, 1, 1])
        obj.data.energy = light["intensity"] * (1 if light["type"] == "directional" else 4 * math.pi)
        if light["type"] == "directional":
            obj.data.angle = 0
        else:
            obj.data.shadow_soft_size = 0
        found.append(obj.name)
    if sorted(found) != sorted(names):
        sys.exit(f"lights {names} expected, {found} found")


def join_receivers(texcoord):
    """One mesh of all that is on the light map: Cycles would prepare the whole level anew for each object."""
    for obj in bpy.context.scene.objects:
        obj.select_set(False)
    for obj in bpy.context.scene.objects:
        if obj.type != "MESH" or len(obj.data.uv_layers) <= texcoord or not obj.data.materials:
            continue
        obj.data = obj.data.copy()
        layers = obj.data.uv_layers
        names = [layer.name for layer in layers]
        layers[names[0]].name = "material"
        layers[names[texcoord]].name = "lightmap"
        for name in names[1:texcoord] + names[texcoord + 1:]:
            layers.remove(layers[name])
        obj.select_set(True)
        bpy.context.view_layer.objects.active = obj
    bpy.ops.object.join()
    layers = bpy.context.view_layer.objects.active.data.uv_layers
    layers["material"].active_render = True
    layers.active = layers["lightmap"]


def main():
    arguments = sys.argv[sys.argv.index("--") + 1:]
    if len(arguments) < 5:
        sys.exit(__doc__)
    path, lights, bounces, prefix = arguments[0], arguments[1].split(","), int(arguments[2]), arguments[3]
    level = json_of(path)
    said = level["asset"]["extras"]["relume"]["lightmap"]
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.import_scene.gltf(filepath=path)
    set_lights(level, lights)
    for obj in list(bpy.data.objects):  # what the baker leaves out of the light
        if obj.get("relume", {}).get("bake") in ("dynamic", "ignore"):
            bpy.data.objects.remove(obj)

    image = bpy.data.images.new("lightmap", said["width"], said["height"], alpha=True, float_buffer=True)
    image.colorspace_settings.name = "Non-Color"
    for material in bpy.data.materials:
        if not material.use_nodes:
            continue
        diffuse(material)
        target = material.node_tree.nodes.new("ShaderNodeTexImage")
        target.image = image
        material.node_tree.nodes.active = target
    join_receivers(said["texcoord"])

    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.render.threads_mode = "AUTO"
    cycles = scene.cycles
    cycles.device = "CPU"
    cycles.use_adaptive_sampling = cycles.use_denoising = False  # Debian builds without a denoiser
    cycles.sample_clamp_indirect = cycles.sample_clamp_direct = 0
    cycles.max_bounces = cycles.diffuse_bounces = bounces
    cycles.transparent_max_bounces = 64
    def bake(passes):
        began = time.process_time()
        bpy.ops.object.bake(type="DIFFUSE", pass_filter=passes, uv_layer="lightmap", margin=0, use_clear=True)
        seconds = time.process_time() - began
        pixels = numpy.empty(4 * said["width"] * said["height"], numpy.float32)
        image.pixels.foreach_get(pixels)
        return seconds, pixels.reshape(-1, 4)

    for i, samples in enumerate(map(int, arguments[4:])):
        cycles.samples, cycles.seed = samples, i
        # Blender 3.4 writes zeros for indirect light alone. Direct light by the same samples takes itself away.
        seconds, both = bake({"DIRECT", "INDIRECT"})
        _, direct = bake({"DIRECT"})
        print(f"cycles_bake: {samples} samples {seconds:.2f} s", flush=True)
        both[:, :3] -= direct[:, :3]
        both.tofile(f"{prefix}_{i}.raw")


main()
