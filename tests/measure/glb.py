# SPDX-License-Identifier: MIT
"""What scripts of tests do with levels: read a .glb of one buffer, change its JSON, add a mesh, write it."""
import json
import pathlib
import struct

JSON_CHUNK, BIN_CHUNK = 0x4E4F534A, 0x004E4942


def read(path):
    """The JSON of a file, and its buffer."""
    data = pathlib.Path(path).read_bytes()
    size, = struct.unpack_from("<I", data, 12)
    return json.loads(data[20:20 + size]), data[28 + size:]


def write(path, level, binary):
    text = json.dumps(level, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    binary += b"\0" * (-len(binary) % 4)
    pathlib.Path(path).write_bytes(struct.pack("<4sIIII", b"glTF", 2, 28 + len(text) + len(binary), len(text), JSON_CHUNK) +
                                   text + struct.pack("<II", len(binary), BIN_CHUNK) + binary)


def add_mesh(level, binary, positions, triangles, albedo, **node):
    """Add a node of one colour; returns the buffer with its mesh. node: its other properties."""
    position = struct.pack(f"<{3 * len(positions)}f", *(c for p in positions for c in p))
    index = struct.pack(f"<{3 * len(triangles)}H", *(i for t in triangles for i in t))
    binary += b"\0" * (-len(binary) % 4)
    views, accessors = level["bufferViews"], level["accessors"]
    views += [{"buffer": 0, "byteOffset": len(binary), "byteLength": len(position)},
              {"buffer": 0, "byteOffset": len(binary) + len(position), "byteLength": len(index)}]
    accessors += [{"bufferView": len(views) - 2, "componentType": 5126, "count": len(positions), "type": "VEC3",
                   "min": [min(p[k] for p in positions) for k in range(3)],
                   "max": [max(p[k] for p in positions) for k in range(3)]},
                  {"bufferView": len(views) - 1, "componentType": 5123, "count": 3 * len(triangles), "type": "SCALAR"}]
    binary += position + index
    level["buffers"][0]["byteLength"] = len(binary)
    level["materials"].append({"pbrMetallicRoughness": {"baseColorFactor": [*albedo, 1], "metallicFactor": 0}})
    level["meshes"].append({"primitives": [{"attributes": {"POSITION": len(accessors) - 2}, "indices": len(accessors) - 1,
                                            "material": len(level["materials"]) - 1}]})
    level["nodes"].append({**node, "mesh": len(level["meshes"]) - 1})
    level["scenes"][level.get("scene", 0)]["nodes"].append(len(level["nodes"]) - 1)
    return binary
