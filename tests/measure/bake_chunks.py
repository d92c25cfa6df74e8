# SPDX-License-Identifier: MIT
"""The raw arrays of a bake file (formats/README.md), for scripts beside this one."""
import pathlib
import struct

import numpy

TYPES = {1: numpy.uint32, 2: numpy.float32, 3: numpy.float16}


def read(path):
    """Chunks by name, rows x columns; those of bytes are left out."""
    data, arrays = pathlib.Path(path).read_bytes(), {}
    for k in range(struct.unpack_from("<I", data, 20)[0]):
        entry = 64 + 64 * k
        name = data[entry:entry + 16].rstrip(b"\0").decode()
        kind = TYPES.get(struct.unpack_from("<I", data, entry + 16)[0])
        rows, columns = struct.unpack_from("<QQ", data, entry + 24)
        begin, size = struct.unpack_from("<QQ", data, entry + 40)
        if kind:
            arrays[name] = numpy.frombuffer(data, kind, size // numpy.dtype(kind).itemsize, begin).reshape(rows, columns)
    return arrays
