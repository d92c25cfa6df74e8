# SPDX-License-Identifier: MIT
"""What the tests of the add-on share: scenes, what becomes of them, and how tests are run, in Blender without a window.

    blender -b --factory-startup --python TEST.py -- ADDON.zip RELUME FOLDER

BLENDER_USER_SCRIPTS is a folder for the add-on (addon_test.sh).
"""
import pathlib
import sys
import traceback

import bpy

ADDON, RELUME, FOLDER = sys.argv[sys.argv.index("--") + 1:]
FOLDER = pathlib.Path(FOLDER)
LAYER = "Relume"


def make_material(name, color):
    material = bpy.data.materials.new(name)
    material.use_nodes = material.use_backface_culling = True
    material.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = (*color, 1)
    return material


def add_box(name, center, size, material, inward=False):
    low, high = [c - s / 2 for c, s in zip(center, size)], [c + s / 2 for c, s in zip(center, size)]
    corners = [tuple((high if i >> axis & 1 else low)[axis] for axis in range(3)) for i in range(8)]
    faces = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    return add_mesh(name, corners, [face[::-1] for face in faces] if inward else faces, material)


def add_mesh(name, corners, faces, material):
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(corners, [], faces)
    mesh.materials.append(material)
    object_ = bpy.data.objects.new(name, mesh)
    bpy.context.collection.objects.link(object_)
    return object_


def make_scene(scale=1.0):
    """A room with a lamp, drawn in units of 1 / scale metres."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    bpy.ops.preferences.addon_enable(module="relume")
    bpy.context.preferences.addons["relume"].preferences.program = RELUME
    scene = bpy.context.scene
    scene.unit_settings.scale_length = 1 / scale
    grey, red = make_material("grey", (0.6, 0.6, 0.6)), make_material("red", (0.7, 0.1, 0.1))
    at = lambda *values: [scale * value for value in values]
    add_box("Room", at(0, 0, 1.25), at(4, 5, 2.5), grey, inward=True)
    crate = add_box("Crate", at(0, 0, 0.35), at(0.7, 0.7, 0.7), red)
    crate.location = at(-1, 1, 0)
    copy = bpy.data.objects.new("Crate.copy", crate.data)
    copy.location = at(1, 1, 0)
    bpy.context.collection.objects.link(copy)
    # One face of four corners, bent by a right angle between its two triangles.
    add_mesh("Bent", [at(*p) for p in ((-1, -1, 0.4), (-0.2, -1, 0.4), (-0.2, -0.2, 1.2), (-1, -0.2, 0.4))], [(0, 1, 2, 3)], grey)
    fence = add_box("Fence", at(1.5, -1, 0.5), at(0.1, 0.1, 1), grey)
    fence.modifiers.new("Array", "ARRAY").count = 3
    lamp = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "POINT"))
    lamp.data.energy, lamp.location = 100 * scale * scale, at(0, 0, 2)
    bpy.context.collection.objects.link(lamp)
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location, camera.rotation_euler = at(0, -2.2, 1.4), (1.4, 0, 0)
    bpy.context.collection.objects.link(camera)
    scene.camera = camera
    settings = scene.relume_settings
    settings.preset, settings.width, settings.height = "draft", 160, 90
    options = FOLDER / "options.json"
    options.write_text('{"surfels": {"count": 2048}, "links": {"raysPerCache": 128}}')
    settings.options = str(options)
    settings.bake = str(FOLDER / "room.relume")
    return scene


def refused(act, *words):
    try:
        act()
    except RuntimeError as error:
        assert all(word in str(error) for word in words), error
        return
    raise AssertionError(f"accepted what should say {words}")


def exported(scene):
    from relume import gltf, level
    level.export(scene, str(FOLDER / "level.glb"))
    return gltf.Document(FOLDER / "level.glb").json


def add_collection(name, parent, *objects):
    collection = bpy.data.collections.new(name)
    parent.children.link(collection)
    for object_ in objects:
        for before in object_.users_collection:
            before.objects.unlink(object_)
        collection.objects.link(object_)
    return collection


def add_empty(name):
    empty = bpy.data.objects.new(name, None)
    bpy.context.collection.objects.link(empty)
    return empty


def run_tests(names):
    """All functions test_..., with the add-on installed and a scene made for the first."""
    try:
        bpy.ops.preferences.addon_install(filepath=ADDON)
        make_scene()
        for name, test in [each for each in names.items() if each[0].startswith("test_")]:
            for left in FOLDER.glob("*.relume"):
                left.unlink()
            test()
            print(f"passed: {name}", flush=True)
    except Exception:  # Blender itself would end with 0
        traceback.print_exc()
        sys.exit(1)
