# SPDX-License-Identifier: MIT
"""Binary glTF files as JSON and bytes: as much of them as levels that Blender wrote and `relume export` completed need."""
import json
import struct

import numpy

_MAGIC, _VERSION, _JSON, _BINARY = 0x46546C67, 2, 0x4E4F534A, 0x004E4942
_COMPONENTS = {5121: ("<u1", 255.0), 5123: ("<u2", 65535.0), 5125: ("<u4", None), 5126: ("<f4", None)}
_COLUMNS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}


class Document:
    def __init__(self, path):
        with open(path, "rb") as file:
            data = file.read()
        magic, version, size = struct.unpack_from("<III", data)
        if magic != _MAGIC or version != _VERSION or size > len(data):
            raise ValueError(f"{path}: not a binary glTF 2.0 file")
        self.binary, at = b"", 12
        while at < size:
            length, kind = struct.unpack_from("<II", data, at)
            part = data[at + 8:at + 8 + length]
            if kind == _JSON:
                self.json = json.loads(part)
            elif kind == _BINARY:
                self.binary = part
            at += 8 + length

    def write(self, path):
        text = json.dumps(self.json, separators=(",", ":")).encode()
        chunks = [(_JSON, text + b" " * (-len(text) % 4)), (_BINARY, self.binary + b"\0" * (-len(self.binary) % 4))]
        body = b"".join(struct.pack("<II", len(part), kind) + part for kind, part in chunks if part)
        with open(path, "wb") as file:
            file.write(struct.pack("<III", _MAGIC, _VERSION, 12 + len(body)) + body)

    def array(self, index):
        """An accessor as rows x columns; normalised integers as floats."""
        accessor = self.json["accessors"][index]
        kind, scale = _COMPONENTS[accessor["componentType"]]
        columns, count, kind = _COLUMNS[accessor["type"]], accessor["count"], numpy.dtype(kind)
        view = self.json["bufferViews"][accessor["bufferView"]]
        stride = view.get("byteStride", kind.itemsize * columns)
        first = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
        rows = numpy.ndarray((count, columns), kind, self.binary, first, (stride, kind.itemsize))
        return rows / numpy.float64(scale) if accessor.get("normalized") and scale else rows
