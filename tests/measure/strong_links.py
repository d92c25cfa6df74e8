#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""How many caches of the light map have much of what they receive from a single surfel; docs/notes/lightmap.md.

    python3 tests/measure/strong_links.py BAKE.relume...          of kinds that have link.head, not packed
"""
import pathlib
import sys

import numpy

sys.path.insert(0, str(pathlib.Path(__file__).parent))
import bake_chunks

LEAF = 1 << 31


def main():
    for path in sys.argv[1:]:
        arrays = bake_chunks.read(path)
        row, head = arrays["link.row"].ravel().astype(int), arrays["link.head"].ravel()
        child, surfels = arrays["node.child"].ravel(), len(arrays["surfel.position"])
        node, transfer = head & 0xfffff, (head >> 20 << 2).astype(numpy.uint16).view(numpy.float16).astype(float)
        cache = numpy.repeat(numpy.arange(len(row) - 1), numpy.diff(row))
        one = (child[node] >= LEAF) & ((child[node] & (LEAF - 1)) < surfels)
        total, most = numpy.zeros(len(row) - 1), numpy.zeros(len(row) - 1)
        numpy.add.at(total, cache, transfer)
        numpy.maximum.at(most, cache, numpy.where(one, transfer, 0.0))
        onMap = numpy.linalg.norm(arrays["cache.normal"], axis=1) > 0
        share = most[onMap] / numpy.maximum(total[onMap], 1e-30)
        print(path, len(share), ", ".join(f"{100 * (share > x).mean():.1f} % more than {x}" for x in (0.1, 0.25, 0.5)))


if __name__ == "__main__":
    main()
