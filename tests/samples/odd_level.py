# SPDX-License-Identifier: MIT
"""What loaders of levels get wrong unseen, in the sample level: odd_level.py LEVEL.glb ODD.glb

A sofa and a table are mirrored, and bent by morph targets of 16 bits with a sign: the sofa by its node's weights, which go
before its mesh's, the table by its mesh's alone. The first camera is orthographic, the next one scaled and mirrored. The
sun's own node is mirrored, which does not turn it. Another sofa and another sun, before the others, are below a hidden node.
"""
import pathlib
import struct
import sys

sys.path.insert(0, str(pathlib.Path(__file__).parent.parent / "measure"))
import glb

level, binary = glb.read(sys.argv[1])
nodes, views, accessors = level["nodes"], level["bufferViews"], level["accessors"]
for node in nodes:
    if node.get("name") not in ("sofa", "table"):
        continue
    node["scale"] = [-1, 1, 1]
    mesh = level["meshes"][node["mesh"]]
    count = accessors[mesh["primitives"][0]["attributes"]["POSITION"]]["count"]
    binary += b"\0" * (-len(binary) % 4)
    up = struct.pack("<4h", 0, 8192, 0, 0) * count
    views.append({"buffer": 0, "byteOffset": len(binary), "byteLength": len(up), "byteStride": 8})
    accessors.append({"bufferView": len(views) - 1, "componentType": 5122, "normalized": True, "type": "VEC3", "count": count,
                      "min": [0, 8192, 0], "max": [0, 8192, 0]})
    binary += up
    mesh["primitives"][0]["targets"] = [{"POSITION": len(accessors) - 1}]
    mesh["weights"] = [0 if node["name"] == "sofa" else 1.5]
    if node["name"] == "sofa":
        node["weights"] = [2]
level["buffers"][0]["byteLength"] = len(binary)
more = ["KHR_mesh_quantization", "KHR_node_visibility"]
level["extensionsUsed"] += more
level["extensionsRequired"] = more

next(node for node in nodes if node.get("name") == "sun")["scale"] = [1, 1, -1]

next(node for node in nodes if "camera" in node)["scale"] = [-2, 3, 3]
level["cameras"].append({"name": "plan", "type": "orthographic", "orthographic": {"xmag": 2, "ymag": 2, "znear": 0, "zfar": 9}})
nodes.append({"camera": len(level["cameras"]) - 1, "translation": [0, 2, 0]})
sofa = next(node["mesh"] for node in nodes if node.get("name") == "sofa")
nodes.append({"mesh": sofa, "translation": [1.3, 0, 0], "extensions": {"KHR_lights_punctual": {"light": 0}}})
nodes.append({"children": [len(nodes) - 1], "extensions": {"KHR_node_visibility": {"visible": False}}})
level["scenes"][level.get("scene", 0)]["nodes"][:0] = [len(nodes) - 3, len(nodes) - 1]
glb.write(sys.argv[2], level, binary)
