# SPDX-License-Identifier: MIT
"""The add-on of bindings/blender in Blender without a window, by its operators, on scenes that are made here.

    blender -b --factory-startup --python addon_test.py -- ADDON.zip RELUME FOLDER

BLENDER_USER_SCRIPTS is a folder for the add-on (addon_test.sh). What `relume` itself does with levels has tests of its own.
"""
import json
import os
import pathlib
import subprocess
import sys
import time
import tomllib
import types

import bpy
import numpy

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from scenes import FOLDER, LAYER, RELUME, add_box, add_collection, add_empty, exported, make_scene, refused, run_tests


def relume_says(*words):
    return subprocess.run([RELUME, *words], capture_output=True, text=True, check=True).stdout


def info(path):
    return json.loads(relume_says("info", "--json", path))


def triangles(mesh):
    """Of each triangle its three corners and coordinates, n x 3 x 5, in an order that only they decide."""
    mesh.calc_loop_triangles()
    layer = mesh.uv_layers[LAYER].data
    rows = [sorted((*mesh.vertices[mesh.loops[loop].vertex_index].co, *layer[loop].uv) for loop in triangle.loops)
            for triangle in mesh.loop_triangles]
    return numpy.array(sorted(rows))


def coordinates_are_those_of_the_level(scene):
    """Against Blender's own importer."""
    mine = {name: triangles(bpy.data.objects[name].data) for name in ("Room", "Crate", "Crate.copy", "Bent")}
    assert bpy.data.objects["Crate"].data != bpy.data.objects["Crate.copy"].data, "linked copies have one place on the map"
    assert LAYER not in bpy.data.objects["Fence"].data.uv_layers
    bpy.ops.relume.export(filepath=str(FOLDER / "game.glb"))
    assert subprocess.run([RELUME, "status", FOLDER / "game.glb", FOLDER / "game.relume"], capture_output=True).returncode == 0
    numpy.bool = bool  # Debian's numpy is newer than its Blender's importer
    before = set(bpy.data.objects)
    bpy.ops.import_scene.gltf(filepath=str(FOLDER / "game.glb"))
    imported = {each.name.removesuffix(".001"): each for each in bpy.data.objects if each not in before and each.type == "MESH"}
    for name, expected in mine.items():
        mesh = imported[name].data
        mesh.uv_layers[1].name = LAYER
        found = triangles(mesh)
        assert found.shape == expected.shape, name
        assert numpy.abs(found - expected).max() < 1e-4, (name, numpy.abs(found - expected).max())
    # What is on the map has a place there, its own: centres of triangles, to a thousandth of the map. Undersides of crates are not.
    mapped = [rows[:, :, 3:][numpy.any(rows[:, :, 3:] != (1, 0), axis=(1, 2))] for rows in mine.values()]
    assert [len(rows) for rows in mapped] == [12, 10, 10, 2], [len(rows) for rows in mapped]
    places = numpy.concatenate(mapped)
    assert numpy.all(numpy.abs(numpy.cross(places[:, 1] - places[:, 0], places[:, 2] - places[:, 0])) > 1e-6)
    assert len({tuple(each) for each in numpy.round(places.mean(axis=1), 3)}) == len(places)
    assert places.min() >= 0 and places.max() <= 1


def test_versions():
    import relume
    folder = pathlib.Path(relume.__file__).parent
    with open(folder / "blender_manifest.toml", "rb") as file:
        manifest = tomllib.load(file)
    version = ".".join(map(str, relume.bl_info["version"]))
    assert manifest["version"] == version == relume_says("--version").split()[1], (manifest, version)
    assert manifest["name"] == relume.bl_info["name"]


def test_bake():
    scene = make_scene()
    assert bpy.ops.relume.bake() == {"FINISHED"}
    baked = (FOLDER / "room.relume").read_bytes()
    assert info(FOLDER / "room.relume")["surfels"]["count"] == 2048
    assert len(bpy.data.objects["Bent"].data.polygons) == 2, "a chart ends inside its face"
    assert len(bpy.data.objects["Crate"].data.polygons) == 6
    # Neither our UV map nor the cut faces are a change of the level.
    stamp = os.stat(FOLDER / "room.relume").st_ino
    assert bpy.ops.relume.bake() == {"FINISHED"}
    assert os.stat(FOLDER / "room.relume").st_ino == stamp, "baked again"
    assert (FOLDER / "room.relume").read_bytes() == baked
    assert [layer.name for layer in bpy.data.objects["Crate"].data.uv_layers] == [LAYER]
    coordinates_are_those_of_the_level(scene)


def preview():
    assert bpy.ops.relume.preview() == {"FINISHED"}
    image = bpy.data.images["Relume preview"]
    assert tuple(image.size) == (160, 90)
    return numpy.array(image.pixels[:]).reshape(-1, 4)[:, :3].mean()


def test_preview():
    make_scene()
    refused(bpy.ops.relume.preview, "there is no bake", "bake first") if not (FOLDER / "room.relume").exists() else None
    bpy.ops.relume.bake()
    bright = preview()
    bpy.data.lights["Lamp"].energy *= 0.25
    dim = preview()
    assert bright > 1.2 * dim > 0.01, (bright, dim)
    bpy.context.scene.camera = None
    assert preview() > 0
    bpy.data.objects["Crate"].location.x += 0.5
    refused(bpy.ops.relume.preview, "Crate")
    bpy.context.preferences.addons["relume"].preferences.program = str(FOLDER / "none")
    refused(bpy.ops.relume.bake, "is not a program", "preferences")


def test_units():
    """A scene in centimetres is the level that it is in metres."""
    found, means = [], []
    for scale in (1.0, 100.0):
        scene = make_scene(scale)
        from relume import level
        level.export(scene, str(FOLDER / "level.glb"))
        said = info(FOLDER / "level.glb")
        lamp = said["lights"][0]
        bpy.ops.relume.bake()
        found.append([said["boundsMinM"], said["boundsMaxM"], lamp["positionM"], lamp["intensity"]])
        means.append(preview())
        assert said["lightUnit"] == "photometric"
        assert numpy.allclose(lamp["intensity"], 100 / (4 * numpy.pi), rtol=1e-4), lamp
    assert numpy.allclose(*found, rtol=1e-5, atol=1e-5), found
    assert abs(means[0] / means[1] - 1) < 0.01, means  # positions round otherwise, and so do bakes
    assert numpy.allclose(found[0][:2], [[-2, 0, -2.5], [2, 2.5, 2.5]], atol=1e-5), found[0]


def test_cancel():
    make_scene()
    from relume import level, program
    level.export(bpy.context.scene, str(FOLDER / "level.glb"))
    output = FOLDER / "cancelled.relume"
    run = program.Run(RELUME, "bake", FOLDER / "level.glb", "-o", output, "--preset", "draft", "--rays", "65536", "--threads", "1")
    while run.stage != "links" and not run.ended():
        pass
    assert 0 < run.overall < 1
    run.cancel()
    assert run.wait().cancelled and not output.exists()
    refused_by_name = program.Run(RELUME, "bake", FOLDER / "none.glb", "-o", output).wait()
    try:
        refused_by_name.check()
    except program.RelumeError as error:
        assert "none.glb" in str(error)
    else:
        raise AssertionError("a level that is not there")


class Window:
    """Takes the place of a context with a window, which Blender has none of here, and keeps what is told to it."""

    def __init__(self):
        self.scene, self.preferences, self.window = bpy.context.scene, bpy.context.preferences, None
        self.window_manager = self.workspace = self
        self.texts, self.timers, self.ended, self.handlers, self.shares = [], 0, 0, 0, []
        self.status_text_set, self.progress_update = self.texts.append, self.shares.append

    def event_timer_add(self, seconds, window):
        self.timers += 1
        return "timer"

    def event_timer_remove(self, timer):
        assert timer == "timer"
        self.timers -= 1

    def modal_handler_add(self, operator):
        self.handlers += 1

    def progress_begin(self, low, high):
        assert (low, high) == (0, 100)

    def progress_end(self):
        self.ended += 1


def baking():
    """The bake as an operator that keeps what it reports."""
    from relume import operators

    class Baking(operators.Command):
        words, done = operators.Bake.words, operators.Bake.done
        said = []

        def report(self, kind, text):
            self.said.append(text)

    return Baking()


def run_in_window(escape_at=None):
    """The bake, driven by events as a window drives it."""
    window, operator = Window(), baking()
    ended = operator.invoke(window, None)
    while ended == {"RUNNING_MODAL"}:
        time.sleep(0.01)
        if escape_at and operator._run.stage == escape_at:
            operator.modal(window, types.SimpleNamespace(type="ESC"))
        assert operator.modal(window, types.SimpleNamespace(type="MOUSEMOVE")) == {"PASS_THROUGH"}
        ended = operator.modal(window, types.SimpleNamespace(type="TIMER"))
    assert (window.timers, window.ended, window.handlers) == (0, 1, 1) and window.texts[-1] is None
    return ended, window, operator.said


def test_window():
    scene = make_scene()
    ended, window, said = run_in_window()
    assert ended == {"FINISHED"}, said
    assert any("caches" in text for text in said) and LAYER in bpy.data.objects["Room"].data.uv_layers
    assert window.shares and max(window.shares) <= 100 and all("Esc: cancel" in text for text in window.texts[:-1])
    assert bpy.ops.relume.bake() == {"FINISHED"}
    pathlib.Path(scene.relume_settings.bake).unlink()
    scene.relume_settings.preset = "best"
    ended, window, said = run_in_window(escape_at="links")
    assert ended == {"CANCELLED"} and not pathlib.Path(scene.relume_settings.bake).exists()
    assert any("cancelled" in text for text in said)


def test_one_at_a_time():
    make_scene()
    window, operator = Window(), baking()
    assert operator.invoke(window, None) == {"RUNNING_MODAL"}
    for act in (bpy.ops.relume.bake, bpy.ops.relume.preview, bpy.ops.relume.export):
        refused(act, "relume is running")
    late = baking()  # its file dialog was open before
    assert late.execute(window) == {"CANCELLED"} and "relume is running" in late.said[0]
    operator.cancel(window)  # another file is opened
    operator._run.wait()
    assert operator._run.cancelled and window.timers == 0
    # An error that nobody foresaw frees it as well.
    window, operator = Window(), baking()
    operator.done = lambda context, run: {}["none"]
    operator.invoke(window, None)
    try:
        while operator.modal(window, types.SimpleNamespace(type="TIMER")) == {"RUNNING_MODAL"}:
            time.sleep(0.01)
    except KeyError:
        pass
    assert window.timers == 0 and bpy.ops.relume.bake() == {"FINISHED"}


def test_what_a_render_shows():
    scene = make_scene()
    grey, layers = bpy.data.materials["grey"], bpy.context.view_layer.layer_collection.children
    box = lambda name: add_box(name, (0, 0, 0), (0.1, 0.1, 0.1), grey)
    box("Cutter").hide_render = True
    parent, child = box("Parent"), box("Child")
    parent["relume"], parent.hide_render, child.parent = {"bake": "gridLit", "texelDensity": 2}, True, parent
    child["relume"] = {"bake": "dynamic"}
    quiet = add_collection("quiet", scene.collection, add_empty("Volume"))
    add_collection("nested", quiet, box("Nested"))
    quiet.hide_render, bpy.data.objects["Volume"]["relume"] = True, {"volume": [1, 2, 3]}
    # An excluded library of parts, some of which hide by themselves or with a collection, and an instance of it.
    library = add_collection("library", scene.collection, box("Part"), box("PartCutter"))
    add_collection("cutters", library, box("OtherCutter")).hide_render = True
    layers["library"].exclude = bpy.data.objects["PartCutter"].hide_render = True
    instance = add_empty("Instance")
    instance.instance_type, instance.instance_collection = "COLLECTION", library
    # What the window alone hides is there, with its modifiers.
    bpy.data.objects["Fence"].hide_viewport = True
    dim = add_collection("dim", scene.collection, box("Dim"))
    dim.hide_viewport, layers["dim"].hide_viewport = True, True
    bpy.data.objects["Dim"].modifiers.new("Array", "ARRAY").count = 2
    states = lambda: [(each.name, each.hide_render, each.hide_viewport) for each in (*scene.objects, *bpy.data.collections)]
    before, document = states(), exported(scene)
    assert states() == before
    nodes = {node["name"]: node for node in document["nodes"]}
    drawn = sorted(node["name"] for node in document["nodes"] if "mesh" in node)
    assert drawn == ["Bent", "Child", "Crate", "Crate.copy", "Dim", "Fence", "Part", "Room"], drawn
    assert nodes["Child"]["extras"]["relume"] == {"bake": "dynamic", "texelDensity": 2} and "Volume" in nodes
    corners = lambda name: document["accessors"][document["meshes"][nodes[name]["mesh"]]["primitives"][0]["attributes"]["POSITION"]]["count"]
    assert (corners("Fence"), corners("Dim")) == (3 * 24, 2 * 24)


def test_no_material():
    """Blender draws it as 0.8 grey, glTF as white."""
    scene = make_scene()
    bpy.data.objects["Room"].data.materials.clear()
    bpy.data.objects["Bent"].data.materials[0] = None
    document = exported(scene)
    assert [each["name"] for each in document["materials"]] == ["red", "grey", "Blender default"]
    for name in ("Room", "Bent"):
        mesh = next(document["meshes"][node["mesh"]] for node in document["nodes"] if node["name"] == name)
        material = document["materials"][mesh["primitives"][0]["material"]]["pbrMetallicRoughness"]
        assert material == {"baseColorFactor": [0.8, 0.8, 0.8, 1], "metallicFactor": 0, "roughnessFactor": 0.5}, material


def test_property():
    scene = make_scene()
    scene["relume"] = {"lightUnit": "radiometric", "other": 1}
    assert exported(scene)["scenes"][0]["extras"]["relume"] == {"lightUnit": "photometric", "other": 1}
    for owner in (bpy.data.objects["Crate"], scene):
        owner["relume"] = '{"bake": "dynamic"}'
        refused(bpy.ops.relume.bake, f'"{owner.name}"', "dictionary")
        del owner["relume"]


def test_off_the_map():
    """What a later bake does not map anymore reads nothing of its map, and what never is on it keeps its shared mesh."""
    scene = make_scene()
    at_corner = lambda name: {tuple(each.uv) for each in bpy.data.objects[name].data.uv_layers[LAYER].data} == {(1, 0)}
    crate, copy, parts = bpy.data.objects["Crate"], bpy.data.objects["Crate.copy"], bpy.data.collections.new("parts")
    assert bpy.ops.relume.bake() == {"FINISHED"} and not at_corner("Crate") and not at_corner("Crate.copy")
    group = add_empty("Group")
    for location in ((-1, -1.5, 0), (1, -1.5, 0)):
        bush = bpy.data.objects.new("Bush", bpy.data.meshes.get("Bush") or crate.data.copy())
        bush.data.name, bush.location, bush.parent = "Bush", location, group
        scene.collection.objects.link(bush)
    group["relume"] = copy["relume"] = {"bake": "gridLit"}
    parts.objects.link(crate)
    instance = add_empty("Instance")
    instance.instance_type, instance.instance_collection, instance.location = "COLLECTION", parts, (0, 0.5, 0)
    ended, window, said = run_in_window()
    assert ended == {"FINISHED"} and all(at_corner(name) for name in ("Crate", "Crate.copy", "Bush", "Bush.001"))
    assert bpy.data.objects["Bush"].data == bpy.data.objects["Bush.001"].data
    for words in ("no longer on the light map: Bush, Crate, Crate.copy;", "none on Crate: several nodes"):
        assert any(words in text for text in said), said


def test_export_over_other_files():
    make_scene()
    assert bpy.ops.relume.bake() == {"FINISHED"}
    (FOLDER / "other.relume").write_text("precious")
    refused(lambda: bpy.ops.relume.export(filepath=str(FOLDER / "other.glb")), "other.relume", "something else")
    assert (FOLDER / "other.relume").read_text() == "precious" and not (FOLDER / "other.glb").exists()


def make_sky():
    """Red toward +Y, green toward +X, blue toward -Y, black toward -X, a quarter each, at 0.25."""
    colors = [(0, 0, 0, 1), (0.25, 0, 0, 1), (0, 0.25, 0, 1), (0, 0, 0.25, 1), (0, 0, 0, 1)]
    image = bpy.data.images.new("sky", 64, 32, float_buffer=True, is_data=True)
    image.pixels.foreach_set(numpy.array([colors[(x + 8) // 16] for x in range(64)] * 32, numpy.float32).ravel())
    image.file_format, image.filepath_raw = "OPEN_EXR", str(FOLDER / "sky.exr")
    image.save()
    return bpy.data.images.load(str(FOLDER / "sky.exr"))


def test_world():
    scene = make_scene()
    from relume import world
    bpy.ops.relume.bake()
    scene.camera.location, scene.camera.rotation_euler = (0, 0, 50), (numpy.pi / 2, 0, 0)  # looks toward +Y
    scene.world = bpy.data.worlds.new("World")
    scene.world.use_nodes = True
    tree = scene.world.node_tree
    background, add = tree.nodes["Background"], lambda kind: tree.nodes.new("ShaderNode" + kind)
    color, strength = background.inputs["Color"], background.inputs["Strength"]

    def seen():
        preview()
        return numpy.array(bpy.data.images["Relume preview"].pixels[:]).reshape(90, 160, 4)[45, 80, :3]

    def warnings():
        said = []
        return world.sky(scene.world, str(FOLDER), said.append), said

    rgb = add("RGB")
    rgb.outputs[0].default_value, strength.default_value = (0.5, 0.25, 0.125, 1), 0.5
    tree.links.new(rgb.outputs[0], color)
    assert warnings() == (["--sky", "0.25,0.125,0.0625"], [])
    texture, mapping = add("TexEnvironment"), add("Mapping")
    texture.image = make_sky()
    tree.links.new(texture.outputs[0], color)
    strength.default_value = 1.0
    assert warnings() == (["--sky-map", str(FOLDER / "sky.exr"), "--sky-rotation", "270"], [])
    bright = {0.25: 0.5371, 0.5: 0.7354}  # in sRGB
    assert numpy.allclose(seen(), (bright[0.25], 0, 0), atol=0.01), seen()
    # From the .blend file, twice as bright; the Mapping node turns it clockwise.
    strength.default_value = 2.0
    texture.image.pack()
    texture.image.filepath_raw = "//gone.exr"
    tree.links.new(add("TexCoord").outputs["Generated"], mapping.inputs["Vector"])
    tree.links.new(mapping.outputs[0], texture.inputs["Vector"])
    turns = [("POINT", 0, (1, 0, 0)), ("POINT", 90, (0, 0, 0)), ("POINT", -90, (0, 1, 0)), ("TEXTURE", 90, (0, 1, 0))]
    for kind, degrees, expected in turns:
        mapping.vector_type, mapping.inputs["Rotation"].default_value[2] = kind, numpy.radians(degrees)
        assert numpy.allclose(seen(), numpy.array(expected) * bright[0.5], atol=0.01), (kind, degrees, seen())
    mapping.inputs["Rotation"].default_value[0] = 1
    assert warnings()[1] and "--sky-map" in warnings()[0]
    # What relume has no word for is said.
    texture.projection = "MIRROR_BALL"
    assert "mirror ball" in warnings()[1][0]
    tree.links.new(add("TexSky").outputs[0], color)
    assert "Sky Texture" in warnings()[1][0]
    tree.links.new(add("MixShader").outputs[0], tree.nodes["World Output"].inputs["Surface"])
    assert "Mix Shader" in warnings()[1][0]


run_tests(globals())
