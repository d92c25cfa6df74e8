# SPDX-License-Identifier: MIT
"""What scripts of tests/measure do with pictures: read the OpenEXR files that relume writes, compare, lay out as a JPEG.

Needs numpy; montage() needs PIL (Debian's python3-pil) in addition.
"""
import struct
import zlib

import numpy


def read_exr(path):
    """Channels of a scanline file without compression or with ZIP, by name: float32 arrays of height x width."""
    data = open(path, "rb").read()
    if data[:4] != b"\x76\x2f\x31\x01":
        raise ValueError(f"{path}: not an OpenEXR file")
    at, header = 8, {}
    while data[at]:
        name, kind = data[at:].split(b"\0", 2)[:2]
        at += len(name) + len(kind) + 2
        size, = struct.unpack_from("<i", data, at)
        header[name.decode()] = data[at + 4:at + 4 + size]
        at += 4 + size
    at += 1
    x0, y0, x1, y1 = struct.unpack("<4i", header["dataWindow"])
    width, height, compression = x1 - x0 + 1, y1 - y0 + 1, header["compression"][0]
    lines = {0: 1, 2: 1, 3: 16}.get(compression)
    if lines is None:
        raise ValueError(f"{path}: compression {compression}; expected none or ZIP")
    channels, text = [], header["channels"]
    while text[0]:
        name, text = text.split(b"\0", 1)
        channels.append((name.decode(), {1: "<f2", 2: "<f4"}[struct.unpack_from("<i", text)[0]]))
        text = text[16:]
    image = {name: numpy.zeros((height, width), numpy.float32) for name, _ in channels}
    for offset in struct.unpack_from(f"<{-(-height // lines)}Q", data, at):
        y, size = struct.unpack_from("<ii", data, offset)
        y -= y0
        rows = min(lines, height - y)
        plain = rows * width * sum(numpy.dtype(kind).itemsize for _, kind in channels)
        block = data[offset + 8:offset + 8 + size]
        if size < plain:
            delta = numpy.frombuffer(zlib.decompress(block), numpy.uint8).astype(numpy.int64)
            delta[1:] -= 128
            coded = (numpy.cumsum(delta) & 255).astype(numpy.uint8)
            half = (plain + 1) // 2
            mixed = numpy.empty(plain, numpy.uint8)
            mixed[0::2], mixed[1::2] = coded[:half], coded[half:]
            block = mixed.tobytes()
        place = 0
        for row in range(rows):
            for name, kind in channels:
                image[name][y + row] = numpy.frombuffer(block, kind, width, place)
                place += width * numpy.dtype(kind).itemsize
    return image


def rgb(image, layer=""):
    """Height x width x 3 of a layer."""
    prefix = layer + "." if layer else ""
    return numpy.stack([image[prefix + c] for c in "RGB"], axis=2)


def error_of(picture, truth, mask=None):
    """Root mean square of the difference over the mean of the truth [%], and energy over the truth's."""
    mask = numpy.ones(truth.shape[:2], bool) if mask is None else mask
    a, b = picture[mask].astype(float), truth[mask].astype(float)
    return 100 * numpy.sqrt(((a - b) ** 2).mean()) / b.mean(), a.mean() / b.mean()


def to_srgb(linear, stops=0.0):
    v = numpy.clip(linear * 2.0 ** stops, 0, 1)
    return numpy.round(255 * numpy.where(v <= 0.0031308, 12.92 * v, 1.055 * v ** (1 / 2.4) - 0.055)).astype(numpy.uint8)


def montage(path, rows, quality=82):
    """A JPEG of rows of sRGB pictures, all of one size, 4 white pixels between them."""
    from PIL import Image
    height, width = rows[0][0].shape[:2]
    columns = max(len(row) for row in rows)
    sheet = numpy.full((len(rows) * (height + 4) - 4, columns * (width + 4) - 4, 3), 255, numpy.uint8)
    for y, row in enumerate(rows):
        for x, picture in enumerate(row):
            sheet[y * (height + 4):y * (height + 4) + height, x * (width + 4):x * (width + 4) + width] = picture
    Image.fromarray(sheet).save(path, quality=quality, optimize=True)
