#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""01_hello_relight in Python: load a bake, relight it under a moving lamp and a sun, ask what light arrives at a point.
    PYTHONPATH=bindings/python hello_relight.py LEVEL.relume
"""
import math
import sys

import numpy

import relume

if len(sys.argv) != 2:
    sys.exit(__doc__)
try:
    bake = relume.Bake(sys.argv[1])
    if bake.info.grid_resolution[0] == 0:
        sys.exit(f'{sys.argv[1]}: no grid to read light in the air from: bake without --grid-caches 0')
    relighter = relume.Relighter(bake)
    # Half a metre over the floor that is nearest to the middle, which itself may lie in a wall
    positions, normals = bake.surfels()
    point = middle = positions.mean(axis=0, dtype=float)
    floor = positions[normals[:, 1] >= 0.7]
    if len(floor):
        point = floor[numpy.linalg.norm(floor - middle, axis=1).argmin()] + (0, 0.5, 0)
    way = numpy.array((0.28, -0.75, 0.6))
    sun = relume.Light.directional(way / numpy.linalg.norm(way), (9, 8.5, 7.5))
    for frame in range(16):
        at = (point[0] + math.cos(0.4 * frame), point[1] + 0.5, point[2] + math.sin(0.4 * frame))
        relighter.relight([sun, relume.Light.point(at, (4, 3, 2))])
        light = relighter.irradiance_in_grid([point], [(0, 1, 0)])[0]
        print(f'frame {frame:2d}: irradiance at ({point[0]:.2f} {point[1]:.2f} {point[2]:.2f}) facing up: '
              f'{light[0]:.4f} {light[1]:.4f} {light[2]:.4f} W/m2')
except relume.RelumeError as error:
    print(error, file=sys.stderr)
    sys.exit(error.status)
