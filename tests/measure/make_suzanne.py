# SPDX-License-Identifier: MIT
"""Build the level of docs/notes/lightmap.md's last table in Blender: Suzanne in a room of 4 x 4 x 3 m under a lamp.

    blender -b --factory-startup --python tests/measure/make_suzanne.py -- suzanne.glb [TEXEL_DENSITY]
    relume bake suzanne.glb -o suzanne.relume --preset high
    relume reference suzanne.glb --camera Camera --size 480x360 --spp 200 -o suzanne/Camera__Point.exr
    bench_view_error suzanne.glb suzanne.relume suzanne/Camera__Point.exr 16
"""
import math
import os
import sys

import bpy


def material(name, color):
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    made.use_backface_culling = True  # without this the exporter marks the material as two-sided
    made.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = (*color, 1.0)
    return made


def make_room():
    bpy.ops.mesh.primitive_cube_add(size=1, location=(0, 0, 1.5))
    room = bpy.context.object
    room.name = "room"
    room.scale = (4, 4, 3)
    bpy.ops.object.transform_apply(scale=True)
    room.data.flip_normals()
    room.data.materials.append(material("walls", (0.7, 0.65, 0.6)))


def make_suzanne(texel_density):
    bpy.ops.mesh.primitive_monkey_add(size=0.8, location=(0, 0, 1.2))
    head = bpy.context.object
    head.name = "suzanne"
    head.modifiers.new("smooth", "SUBSURF").levels = 1
    bpy.ops.object.modifier_apply(modifier="smooth")
    bpy.ops.object.shade_smooth()
    head.data.materials.append(material("skin", (0.8, 0.7, 0.5)))
    if texel_density:
        head["relume"] = {"texelDensity": texel_density}


def main():
    arguments = sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else []
    if not 1 <= len(arguments) <= 2:
        sys.exit(__doc__)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    make_room()
    make_suzanne(float(arguments[1]) if len(arguments) > 1 else 0.0)
    bpy.ops.object.light_add(type="POINT", location=(1.2, -1.3, 2.6))
    bpy.context.object.data.energy = 60
    bpy.context.object.data.shadow_soft_size = 0
    bpy.ops.object.camera_add(location=(0, -1.6, 1.3), rotation=(math.radians(88), 0, 0))
    bpy.context.scene.camera = bpy.context.object
    bpy.context.scene["relume"] = {"lightUnit": "photometric"}  # the exporter writes candela
    bpy.ops.export_scene.gltf(filepath=os.path.abspath(arguments[0]), export_lights=True, export_cameras=True,
                              export_apply=True, export_extras=True)


main()
