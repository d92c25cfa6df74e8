#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""PNG files for samples: put pictures of one size beside each other, so many in a row. Needs nothing but Python.

    strip.py COLUMNS OUTPUT.png PICTURE.png...
"""
import pathlib
import struct
import sys
import zlib


def write_png(path, width, height, rgb):
    """8-bit sRGB, rows from the top."""
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    def filtered(row):  # by "Sub": what a pixel differs by from the one to its left
        return b"\1" + row[:3] + bytes((b - a) & 255 for a, b in zip(row, row[3:]))
    rows = b"".join(filtered(rgb[3 * width * y:3 * width * (y + 1)]) for y in range(height))
    pathlib.Path(path).write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0))
                                   + chunk(b"IDAT", zlib.compress(rows, 9)) + chunk(b"IEND", b""))


def read_png(path):
    """Width, height and bytes of an 8-bit RGB image without filters but those of PNG itself."""
    data = pathlib.Path(path).read_bytes()
    at, compressed, width, height = 8, b"", 0, 0
    while at < len(data):
        size, kind = struct.unpack(">I4s", data[at:at + 8])
        body = data[at + 8:at + 8 + size]
        if kind == b"IHDR":
            width, height, depth, color = struct.unpack(">IIBB", body[:10])
            if (depth, color) != (8, 2):
                sys.exit(f"{path}: 8-bit RGB expected")
        if kind == b"IDAT":
            compressed += body
        at += 12 + size
    raw, stride = zlib.decompress(compressed), 3 * width
    rows, before = [], bytearray(stride)
    for y in range(height):
        filtered = raw[(stride + 1) * y]
        row = bytearray(raw[(stride + 1) * y + 1:(stride + 1) * (y + 1)])
        for i in range(stride):
            left = row[i - 3] if i >= 3 else 0
            up, corner = before[i], before[i - 3] if i >= 3 else 0
            if filtered == 1:
                guess = left
            elif filtered == 2:
                guess = up
            elif filtered == 3:
                guess = (left + up) // 2
            elif filtered == 4:
                p = left + up - corner
                guess = min((left, up, corner), key=lambda v: abs(p - v))
            else:
                guess = 0
            row[i] = (row[i] + guess) & 255
        rows.append(bytes(row))
        before = row
    return width, height, rows


def strip(columns, path, frames):
    images = [read_png(frame) for frame in frames]
    width, height, _ = images[0]
    blank = b"\0" * (3 * width)
    rgb = b""
    for first in range(0, len(images), columns):
        line = images[first:first + columns]
        for y in range(height):
            rgb += b"".join(image[2][y] for image in line) + blank * (columns - len(line))
    write_png(path, columns * width, height * -(-len(images) // columns), rgb)


if __name__ == "__main__":
    if len(sys.argv) < 4:
        sys.exit(__doc__)
    strip(int(sys.argv[1]), sys.argv[2], sys.argv[3:])
