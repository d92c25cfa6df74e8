#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""A picture of a window on a screen that nobody sees: needs Xvfb and xdotool.

    window.py OUT.png WIDTHxHEIGHT STEPS PROGRAM [ARGUMENTS...]

STEPS are arguments of xdotool, separated by semicolons, or "sleep SECONDS": "mousemove 500 190 click 1; sleep 2".
"""
import os
import shutil
import struct
import subprocess
import sys
import tempfile
import time
import zlib


def read_screen(path):
    """Width, height and rows of RGB from Xvfb's file, which is in XWD's format: blue, green, red and nothing."""
    with open(path, "rb") as file:
        data = file.read()
    header = struct.unpack(">25I", data[:100])
    width, height, row, first = header[4], header[5], header[12], header[0] + 12 * header[19]
    rows = []
    for y in range(height):
        line = data[first + y * row:first + y * row + 4 * width]
        pixels = bytearray(3 * width)
        pixels[0::3], pixels[1::3], pixels[2::3] = line[2::4], line[1::4], line[0::4]
        rows.append(bytes(pixels))
    return width, height, rows


def write_png(path, width, height, rows):
    def chunk(kind, body):
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

    # The filter "up" suits pictures of smooth light.
    filtered, above = b"", bytes(3 * width)
    for row in rows:
        filtered += b"\2" + bytes((a - b) & 255 for a, b in zip(row, above))
        above = row
    with open(path, "wb") as file:
        file.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)) +
                   chunk(b"IDAT", zlib.compress(filtered, 9)) + chunk(b"IEND", b""))


def main():
    out, size, steps = sys.argv[1:4]
    folder = tempfile.mkdtemp()
    ready, tell = os.pipe()
    server = subprocess.Popen(["Xvfb", "-displayfd", str(tell), "-nolisten", "tcp", "-screen", "0", size + "x24", "-fbdir", folder],
                              pass_fds=[tell], stderr=subprocess.DEVNULL)
    number = b""
    while not number.endswith(b"\n"):
        number += os.read(ready, 1)
    environment = dict(os.environ, DISPLAY=":" + number.decode().strip())
    program = subprocess.Popen(sys.argv[4:] + ["--size", size], env=environment, stdout=subprocess.DEVNULL)
    try:
        time.sleep(6)
        for step in filter(None, (s.split() for s in steps.split(";"))):
            if step[0] == "sleep":
                time.sleep(float(step[1]))
            else:
                subprocess.run(["xdotool", *step], env=environment, check=True)
        write_png(out, *read_screen(os.path.join(folder, "Xvfb_screen0")))
    finally:
        for process in (program, server):
            process.terminate()
            process.wait()
        shutil.rmtree(folder)


if __name__ == "__main__":
    main()
