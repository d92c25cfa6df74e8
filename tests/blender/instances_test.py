# SPDX-License-Identifier: MIT
"""Levels of the add-on beside what a render engine is given, which is what a render shows: instances of all kinds and metaballs."""
import os
import sys
import time

import bpy
import numpy

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from scenes import FOLDER, add_box, add_collection, add_empty, exported, make_scene, refused, run_tests

from mathutils import Matrix, Quaternion, Vector


class Seen(bpy.types.RenderEngine):
    """Draws nothing, and keeps what it was to draw: where faces are, and lamps."""

    bl_idname, bl_label = "RELUME_SEEN", "Seen"
    meshes, lamps = [], []

    def render(self, depsgraph):
        Seen.meshes, Seen.lamps = [], []
        for each in depsgraph.object_instances:
            to_world, data = numpy.array(each.matrix_world), each.object.data
            if each.object.type == "LIGHT":
                Seen.lamps.append(to_world[:3, 3])
            elif each.object.type == "MESH" and each.show_self and data.polygons:
                Seen.meshes.append(extent(to_world, [each.co for each in data.vertices]))


def extent(to_world, corners):
    placed = numpy.array(corners) @ to_world[:3, :3].T + to_world[:3, 3]
    return numpy.concatenate((placed.min(axis=0), placed.max(axis=0)))


def render(scene):
    scene.render.engine = "RELUME_SEEN"
    bpy.ops.render.render()
    return numpy.array(Seen.meshes), numpy.array(Seen.lamps)


def of_level(document):
    """The same of a level, in Blender's axes."""
    back = numpy.array(((1, 0, 0, 0), (0, 0, -1, 0), (0, 1, 0, 0), (0, 0, 0, 1)))
    meshes, lamps, left = [], [], [(index, back) for index in document["scenes"][0]["nodes"]]
    for index, above in left:
        node = document["nodes"][index]
        turn = Quaternion(numpy.roll(node.get("rotation", (0, 0, 0, 1)), 1))
        local = Matrix.LocRotScale(Vector(node.get("translation", (0, 0, 0))), turn, Vector(node.get("scale", (1, 1, 1))))
        world = above @ (numpy.array(node["matrix"]).reshape(4, 4).T if "matrix" in node else numpy.array(local))
        left += [(child, world) for child in node.get("children", ())]
        if "mesh" in node:
            from relume import gltf
            file, primitives = gltf.Document(FOLDER / "level.glb"), document["meshes"][node["mesh"]]["primitives"]
            corners = numpy.concatenate([file.array(each["attributes"]["POSITION"]) for each in primitives])
            meshes.append(extent(world, corners))
        if "KHR_lights_punctual" in node.get("extensions", {}):
            lamps.append(world[:3, 3])
    assert len(left) == len(document["nodes"]), "nodes that are nowhere"
    return numpy.array(meshes), numpy.array(lamps)


def same(found, expected):
    """Whether rows are the same ones in any order."""
    if len(found) != len(expected):
        return False
    left = list(expected)
    for row in found:
        nearest = min(range(len(left)), key=lambda i: numpy.abs(left[i] - row).max())
        if numpy.abs(left.pop(nearest) - row).max() > 1e-4:
            return False
    return True


def level_is_as_rendered(scene):
    expected, document = render(scene), exported(scene)
    for found, wanted in zip(of_level(document), expected):
        assert same(found, wanted), f"{len(found)} in the level:\n{found}\n{len(wanted)} in a render:\n{wanted}"
    return document


def scatter(object_, *, instance=None, collection=None, joined=False):
    """Geometry Nodes on object_'s points: an object, a collection or a cone of its own."""
    tree = bpy.data.node_groups.new("scatter", "GeometryNodeTree")
    tree.inputs.new("NodeSocketGeometry", "Geometry")
    tree.outputs.new("NodeSocketGeometry", "Geometry")
    add = lambda kind: tree.nodes.new(kind)
    first, last, points = add("NodeGroupInput"), add("NodeGroupOutput"), add("GeometryNodeInstanceOnPoints")
    source = add("GeometryNodeObjectInfo" if instance else "GeometryNodeCollectionInfo" if collection else "GeometryNodeMeshCone")
    if instance or collection:
        source.inputs[0].default_value = instance or collection
    if instance:
        source.inputs["As Instance"].default_value = True
    made = source.outputs["Geometry"] if instance else source.outputs[0]
    points.inputs["Scale"].default_value, points.inputs["Rotation"].default_value = (0.2, 0.3, 0.4), (0.3, 0.2, 0.1)
    tree.links.new(first.outputs[0], points.inputs["Points"])
    tree.links.new(made, points.inputs["Instance"])
    join = add("GeometryNodeJoinGeometry")
    tree.links.new(points.outputs[0], join.inputs[0])
    if joined:
        tree.links.new(first.outputs[0], join.inputs[0])
    tree.links.new(join.outputs[0], last.inputs[0])
    object_.modifiers.new("scatter", "NODES").node_group = tree


def box(name, *location, parent=None):
    object_ = add_box(name, (0, 0, 0), (0.2, 0.3, 0.4), bpy.data.materials["red"])
    object_.location, object_.parent = location, parent
    return object_


def lamp(name, parent):
    object_ = bpy.data.objects.new(name, bpy.data.lights.new(name, "SPOT"))
    object_.location, object_.parent = (0, 0, 0.1), parent
    bpy.context.collection.objects.link(object_)


def hair(object_, count=5, **settings):
    object_.modifiers.new("hair", "PARTICLE_SYSTEM")
    made = object_.particle_systems[0].settings
    made.type, made.count = "HAIR", count
    for name, value in settings.items():
        setattr(made, name, value)


def test_geometry_nodes():
    scene = make_scene()
    tree = box("Tree", 0, 0, -5)
    tree.modifiers.new("Array", "ARRAY").count = 2
    tree.hide_render = tree.hide_viewport = True
    tree["relume"] = {"bake": "gridLit"}
    scatter(box("Wood", 0.5, 0, 1), instance=tree)
    scatter(box("Cones", -0.5, 0, 1), joined=True)
    scatter(box("Again", -1.5, 0, 1), instance=bpy.data.objects["Crate"], joined=True)
    wood, alone = bpy.data.objects["Wood"], box("Alone", 0, 1, 1)
    wood["relume"] = {"texelDensity": 2}
    scatter(alone, instance=tree, joined=True)
    alone.show_instancer_for_render = False
    wood.hide_set(True)  # by the eye
    document = level_is_as_rendered(scene)
    assert wood.hide_get() and not any("stand-in" in each.name for each in bpy.data.objects)
    nodes = {node["name"]: node for node in document["nodes"]}
    assert nodes["Wood/Tree.008"]["extras"]["relume"] == {"bake": "gridLit", "texelDensity": 2}, nodes["Wood/Tree.008"]
    assert len({nodes[f"Wood/Tree.{i:03}"]["mesh"] for i in range(1, 9)}) == 1
    assert nodes["Again/Crate.001"]["mesh"] == nodes["Crate"]["mesh"] == nodes["Crate.copy"]["mesh"]
    assert [document["nodes"][i]["name"] for i in nodes["Wood"]["children"]] == [f"Wood/Tree.{i:03}" for i in range(1, 9)]
    assert bpy.ops.relume.bake() == {"FINISHED"} and bpy.ops.relume.preview() == {"FINISHED"}


def test_faces_and_particles():
    scene = make_scene()
    faces = box("Faces", 1, 0, 1)
    faces.instance_type, faces.show_instancer_for_render, faces.scale = "FACES", False, (1, 2, 3)
    child = box("Child", 0, 0.1, 0, parent=faces)
    box("Grandchild", 0, 0, 0.3, parent=child)
    lamp("Spot", faces)
    corners = box("Corners", -1, 0, 1)
    corners.instance_type = "VERTS"
    box("Corner", 0, 0, 0, parent=corners)
    ground = box("Ground", 0, 1, 1)
    hair(ground, render_type="OBJECT", instance_object=bpy.data.objects["Grandchild"], particle_size=0.5, display_percentage=20)
    box("On ground", 0, 0, 0.5, parent=ground)
    hair(box("Bare", -0.5, 1, 1), render_type="OBJECT", instance_object=child)  # which nothing but its parent may show
    document = level_is_as_rendered(scene)
    assert (faces.instance_type, ground.particle_systems[0].settings.render_type) == ("FACES", "OBJECT")
    assert ground.particle_systems[0].settings.display_percentage == 20
    assert not any(node["name"] in {"Child", "Faces", "Corner"} for node in document["nodes"] if "mesh" in node)


def test_within_collections():
    """Of which the exporter makes nodes of objects."""
    scene = make_scene()
    tree = box("Tree", 0, 0, -5)
    tree.hide_render = True
    faces = box("Faces", 0.1, 0, 0)
    faces.instance_type, faces.show_instancer_for_render = "FACES", False
    kinds = [box("Hidden", 0, 0, 0), box("Wood", 0, 0.5, 0), faces, box("Child", 0, 0, 0, parent=faces), box("Cone", 0, 0, 0.2)]
    kinds[0].hide_render = True
    scatter(kinds[1], instance=tree, joined=True)
    scatter(kinds[4], joined=True)
    library = add_collection("library", scene.collection, *kinds, box("Plain", 0.3, 0.2, 0.1))
    library.instance_offset = (0.1, 0.2, 0.3)
    outer = add_collection("outer", scene.collection, add_empty("Inner"), box("Outer", 1, 0, 0))
    for name, collection in (("Instance", library), ("Inner", library), ("Whole", outer)):
        empty = bpy.data.objects.get(name) or add_empty(name)
        empty.instance_type, empty.instance_collection = "COLLECTION", collection
        empty.location, empty.rotation_euler, empty.scale = (0.3, -0.5, 1), (0.1, 0.2, 0.3), (1, 1.5, 0.5)
    scatter(box("All", 0, 0, 0.3), collection=library)
    for excluded in (False, True):
        for name in ("library", "outer"):
            bpy.context.view_layer.layer_collection.children[name].exclude = excluded
        document = level_is_as_rendered(scene)
        assert not any("Plain." in node["name"] for node in document["nodes"] if node["name"].startswith("Whole/")), "twice"


def test_metaballs_curves_and_what_is_left_out():
    scene = make_scene()
    for i, parent in enumerate((None, None, bpy.data.objects["Crate"])):
        ball = bpy.data.objects.new("Ball", bpy.data.metaballs.new("Ball"))
        ball.data.elements.new().radius = 0.4
        ball.location, ball.parent = (0.3 * i, 0, 0.6), parent
        ball.data.materials.append(bpy.data.materials["red"])
        scene.collection.objects.link(ball)
    bpy.ops.object.text_add(location=(0, 0, 1))
    bpy.context.object.data.extrude = 0.1
    bpy.ops.curve.primitive_bezier_circle_add(radius=0.3, location=(0, 0.5, 1))
    bpy.context.object.data.bevel_depth = 0.05
    scatter(box("Rings", 0.5, 0, 1), instance=bpy.context.object)
    document = level_is_as_rendered(scene)
    ball = next(node for node in document["nodes"] if node["name"] == "Ball" and "mesh" in node)
    material = document["meshes"][ball["mesh"]]["primitives"][0]["material"]
    assert document["materials"][material]["name"] == "red"
    area = bpy.data.objects.new("Panel", bpy.data.lights.new("Panel", "AREA"))
    scene.collection.objects.link(area)
    scene.collection.objects.link(bpy.data.objects.new("Smoke", bpy.data.volumes.new("Smoke")))
    hair(bpy.data.objects["Room"], count=10)
    from relume import level
    assert sorted(sorted(names) for names in level.export(scene, str(FOLDER / "level.glb")).values()) == [["Panel"], ["Room"], ["Smoke"]]
    said, relume = [], sys.modules["relume.operators"]
    relume.write_level(scene, said.append)
    assert any("not in the level: Panel: glTF has no area lamps; model surfaces with emission" in each for each in said), said


def test_thousands():
    scene = make_scene()
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=70, y_subdivisions=70, size=2)
    scatter(bpy.context.object, instance=bpy.data.objects["Crate"])
    before = time.monotonic()
    document = exported(scene)
    print(f"71 x 71 instances: {time.monotonic() - before:.2f} s")
    assert sum(node["name"].startswith("Grid/Crate.") for node in document["nodes"]) == 71 * 71
    assert len(document["meshes"]) == 4, [each["name"] for each in document["meshes"]]


def test_errors_leave_the_scene():
    scene = make_scene()
    faces = box("Faces", 1, 0, 1)
    faces.instance_type = "FACES"
    box("Child", 0, 0, 0, parent=faces).hide_viewport = True
    scatter(box("Cones", 0, 0, 0))
    states = lambda: [(each.name, each.hide_render, each.hide_viewport, each.instance_type) for each in bpy.data.objects]
    before, meshes = states(), len(bpy.data.meshes)
    from relume import level
    refused(lambda: level.export(scene, str(FOLDER / "none" / "level.glb")), "")
    assert states() == before and len(bpy.data.meshes) == meshes


def test_cameras_are_in_metres():
    """Whose lengths are as far as the scene's are."""
    found = []
    for scale in (1.0, 100.0):
        for kind in ("PERSP", "ORTHO"):
            scene = make_scene(scale)
            camera = scene.camera.data
            camera.type, camera.ortho_scale, camera.clip_start, camera.clip_end = kind, 3 * scale, 0.2 * scale, 50 * scale
            camera = exported(scene)["cameras"][0]
            found.append(camera[camera["type"]])
    for metres, other in zip(found[:2], found[2:]):
        assert metres.keys() == other.keys() and numpy.allclose(list(metres.values()), list(other.values()), rtol=1e-5), found
    assert {"znear", "zfar", "xmag", "ymag"} <= found[1].keys() and found[0]["znear"] > 0.19, found


bpy.utils.register_class(Seen)
run_tests(globals())
