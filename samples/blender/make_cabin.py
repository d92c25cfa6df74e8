# SPDX-License-Identifier: MIT
"""Build a small level in Blender and export it as glTF: the example of docs/guide/blender.md.

A cabin with two rooms: walls with thickness by a Solidify modifier, a window and a doorway, a table and linked copies of
a stool, a lamp, a spot, a sun, a glowing strip on the ceiling, a camera in each room, a box in each room that says where
receivers can be, a crate that the game moves, and a fern that the light map leaves out. Metres; tested with Blender 3.4.

    blender -b --factory-startup --python samples/blender/make_cabin.py -- cabin.glb            as the guide says
    blender -b --factory-startup --python samples/blender/make_cabin.py -- cabin.glb defaults   with the exporter's defaults
    blender -b --factory-startup --python samples/blender/make_cabin.py -- cabin.glb thin       modelled so that light leaks
    blender -b --factory-startup --python samples/blender/make_cabin.py -- cabin.blend          the file to look at

samples/blender/cabin.glb and cabin_thin.glb are what the first and the third of these wrote.
"""
import math
import os
import sys
import traceback

import bpy
from mathutils import Vector

WIDTH, DEPTH, HEIGHT = 8.0, 4.0, 2.6  # [m] inside; Blender's z is up, the exporter turns it into glTF's y
PARTITION = 1.0  # [m] x of the wall between the rooms


def material(name, color, emission=0.0):
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    made.use_backface_culling = True  # without this the exporter marks the material as two-sided
    shader = made.node_tree.nodes["Principled BSDF"]
    shader.inputs["Base Color"].default_value = (*color, 1.0)
    shader.inputs["Roughness"].default_value = 0.9
    if emission > 0.0:
        shader.inputs["Emission"].default_value = (1.0, 0.85, 0.65, 1.0)
        shader.inputs["Emission Strength"].default_value = emission
    return made


def mesh(name, vertices, faces, paint):
    data = bpy.data.meshes.new(name)
    data.from_pydata(vertices, [], faces)
    data.materials.append(paint)
    made = bpy.data.objects.new(name, data)
    bpy.context.collection.objects.link(made)
    return made


def box(name, low, high, paint):
    (a, b, c), (x, y, z) = low, high
    corners = [(a, b, c), (x, b, c), (x, y, c), (a, y, c), (a, b, z), (x, b, z), (x, y, z), (a, y, z)]
    faces = [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
    return mesh(name, corners, faces, paint)


def wall(name, start, end, paint, hole=None):
    """A wall that faces to the left of start -> end, 0.2 m thick behind its face. hole: (from, to, bottom, top) in metres
    along the wall and above the floor."""
    length = math.dist(start, end)
    along = [0.0, *(hole[:2] if hole else ()), length]
    up = [0.0, *(z for z in (hole[2:] if hole else ()) if 0.0 < z < HEIGHT), HEIGHT]

    def point(s, z):
        t = s / length
        return (start[0] + t * (end[0] - start[0]), start[1] + t * (end[1] - start[1]), z)

    vertices = [point(s, z) for z in up for s in along]
    faces = []
    for j in range(len(up) - 1):
        for i in range(len(along) - 1):
            if hole and i == 1 and hole[2] <= up[j] and up[j + 1] <= hole[3]:
                continue
            a = j * len(along) + i
            faces.append((a + 1, a, a + len(along), a + len(along) + 1))
    return solidify(mesh(name, vertices, faces, paint))


def solidify(flat):
    thick = flat.modifiers.new("Solidify", "SOLIDIFY")
    thick.thickness, thick.offset = 0.2, -1.0
    return flat


def light(name, kind, location, toward=None, **values):
    data = bpy.data.lights.new(name, kind)
    for key, value in values.items():
        setattr(data, key, value)
    made = bpy.data.objects.new(name, data)
    bpy.context.collection.objects.link(made)
    made.location = location
    aim(made, toward)
    return made


def aim(made, toward):
    if toward:
        direction = [b - a for a, b in zip(made.location, toward)]
        made.rotation_euler = Vector(direction).to_track_quat("-Z", "Y").to_euler()


def camera(name, location, toward):
    data = bpy.data.cameras.new(name)
    data.lens_unit, data.angle = "FOV", math.radians(75.0)
    made = bpy.data.objects.new(name, data)
    bpy.context.collection.objects.link(made)
    made.location = location
    aim(made, toward)


def say(made, **values):
    """The custom property "relume" of an object, which becomes extras.relume of its node."""
    made["relume"] = values


def build():
    for thing in list(bpy.data.objects):
        bpy.data.objects.remove(thing)
    plaster, blue = material("plaster", (0.72, 0.70, 0.65)), material("blue", (0.12, 0.22, 0.50))
    boards, wood = material("boards", (0.42, 0.26, 0.14)), material("wood", (0.50, 0.32, 0.16))
    orange, leaf = material("orange", (0.75, 0.30, 0.06)), material("leaf", (0.10, 0.32, 0.06))
    strip = material("strip", (0.6, 0.6, 0.6), emission=6.0)
    leaf.use_backface_culling = False  # leaves are seen and lit from both sides

    solidify(mesh("floor", [(0, 0, 0), (WIDTH, 0, 0), (WIDTH, DEPTH, 0), (0, DEPTH, 0)], [(0, 1, 2, 3)], boards))
    solidify(mesh("ceiling", [(0, 0, HEIGHT), (WIDTH, 0, HEIGHT), (WIDTH, DEPTH, HEIGHT), (0, DEPTH, HEIGHT)],
                  [(3, 2, 1, 0)], plaster))
    wall("wall_south", (0, 0), (WIDTH, 0), plaster, hole=(2.2, 4.2, 0.9, 2.1))
    wall("wall_east", (WIDTH, 0), (WIDTH, DEPTH), plaster)
    wall("wall_north", (WIDTH, DEPTH), (0, DEPTH), plaster)
    wall("wall_west", (0, DEPTH), (0, 0), blue)
    wall("partition", (5.0, DEPTH), (5.0, 0), orange, hole=(1.4, 2.6, 0.0, 2.0))

    box("table", (1.6, 2.0, 0.70), (3.0, 2.9, 0.76), wood)
    box("table_leg", (2.2, 2.35, 0.0), (2.4, 2.55, 0.70), wood)
    stool = box("stool", (-0.18, -0.18, 0.0), (0.18, 0.18, 0.45), wood)
    stool.location = (1.3, 1.5, 0.0)
    for name, x, y in (("stool_2", 3.3, 1.6), ("stool_3", 2.3, 3.3)):  # linked: they share the stool's mesh
        copy = bpy.data.objects.new(name, stool.data)
        bpy.context.collection.objects.link(copy)
        copy.location = (x, y, 0.0)
    mesh("strip", [(6.0, 1.2, HEIGHT - 0.02), (7.2, 1.2, HEIGHT - 0.02), (7.2, 1.5, HEIGHT - 0.02),
                   (6.0, 1.5, HEIGHT - 0.02)], [(3, 2, 1, 0)], strip)

    leaves = []
    for i in range(14):  # blades around a stem
        a, lean = 2.4 * i, 0.15 + 0.02 * i
        x, y, w = math.cos(a), math.sin(a), 0.035
        leaves += [(-w * y, w * x, 0.0), (w * y, -w * x, 0.0), (lean * x, lean * y, 0.9 - 0.02 * i)]
    fern = mesh("fern", leaves, [(3 * i, 3 * i + 1, 3 * i + 2) for i in range(14)], leaf)
    fern.location = (0.5, 0.6, 0.0)
    say(fern, bake="gridLit")
    crate = box("crate", (-0.25, -0.25, 0.0), (0.25, 0.25, 0.5), orange)
    crate.location = (6.6, 2.9, 0.0)
    say(crate, bake="dynamic")

    for name, x in (("room_west", 2.45), ("room_east", 6.6)):
        volume = bpy.data.objects.new(name, None)
        bpy.context.collection.objects.link(volume)
        volume.empty_display_type = "CUBE"
        volume.location = (x, DEPTH / 2, 1.2)
        say(volume, volume=[4.6 if x < 5.0 else 2.6, 2.2, 3.7])  # glTF's axes: x, up, depth

    # The exporter writes lamps in candela and lux ("Lighting: Standard"), and the level says so.
    say(bpy.context.scene, lightUnit="photometric")
    light("sun", "SUN", (3.0, -4.0, 6.0), toward=(2.6, 2.0, 0.0), energy=10.0)
    light("lamp", "POINT", (2.3, 2.45, 1.35), energy=40.0, color=(1.0, 0.72, 0.42), shadow_soft_size=0.05)
    light("spot", "SPOT", (7.6, 0.4, 2.4), toward=(6.2, 3.4, 0.3), energy=120.0, spot_size=0.9)
    camera("cam_west", (4.8, 3.8, 1.7), (1.2, 0.9, 0.8))
    camera("cam_east", (7.7, 0.3, 1.6), (5.6, 2.9, 1.05))


def make_thin():
    """Walls and ceiling without thickness, on one ground that runs on beneath the walls into the sun."""
    for made in bpy.data.objects:
        made.modifiers.clear()
    bpy.data.objects.remove(bpy.data.objects["floor"])
    mesh("ground", [(-20, -20, 0), (30, -20, 0), (30, 20, 0), (-20, 20, 0)], [(0, 1, 2, 3)], bpy.data.materials["boards"])


def main():
    arguments = sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else []
    output = os.path.abspath(arguments[0] if arguments else "cabin.glb")  # Blender takes others relative to the .blend
    build()
    if arguments[1:] == ["thin"]:
        make_thin()
    if output.endswith(".blend"):
        bpy.ops.wm.save_as_mainfile(filepath=output)
    elif arguments[1:] == ["defaults"]:
        bpy.ops.export_scene.gltf(filepath=output)
    else:
        bpy.ops.export_scene.gltf(
            filepath=output,
            export_extras=True,  # Include: Custom Properties
            export_cameras=True,  # Include: Cameras
            export_lights=True,  # Include: Punctual Lights
            export_apply=True,  # Data, Mesh: Apply Modifiers
        )


try:
    main()
except Exception:  # Blender itself would end with 0
    traceback.print_exc()
    sys.exit(1)
