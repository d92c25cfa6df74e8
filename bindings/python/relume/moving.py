# SPDX-License-Identifier: MIT
"""Things that move through a baked level: they shadow the light that its surfaces send to each other, and throw their colour.

    shapes = relume.MovingShapes([relume.MovingMesh(positions, triangles, (0.4, 0.25, 0.12))])    # once
    relighter = relume.Relighter(bake, moving_parts=8)                                            # the most of a frame
    relighter.relight([lamp], shadows, moving_shapes=shapes, moving_parts=[(0, crate_to_world)])

docs/guide/embedding.md has what they do, docs/notes/moving.md errors and times.
"""
from __future__ import annotations

from dataclasses import dataclass
from typing import Sequence

import numpy
from numpy.typing import ArrayLike

from ._arrays import axes, ByValue, floats, indices, pointer, uints, whole
from ._handles import Context, Handle, opened
from ._library import CMovingMesh, MovingPart, runtime


@dataclass(eq=False)
class MovingMesh(ByValue):
    """A rigid mesh in axes of its own. albedo, emission: of the whole, or one for each triangle, (m, 3)."""
    positions: ArrayLike  # [m] (n, 3)
    triangles: ArrayLike  # (m, 3) indices of positions, the front counter-clockwise
    albedo: ArrayLike = (0.5, 0.5, 0.5)  # [0..1]
    emission: ArrayLike | None = None  # [W/m2/sr] of the fronts


class MovingShapes(Handle):
    """Meshes as shapes that frames place; any relighters may share them. RelumeError: names mesh, vertex or triangle."""
    _destroy = staticmethod(runtime.relume_moving_shapes_destroy)

    def __init__(self, meshes: Sequence[MovingMesh]):
        self._context = Context(1)
        kept, read = [], []  # until relume_moving_shapes_create() has read them
        for i, mesh in enumerate(meshes):
            p = floats(f'meshes[{i}].positions', mesh.positions, 3)
            t = indices(f'meshes[{i}].triangles', mesh.triangles, (0, 3), 2 ** 32)
            albedo, emission = (floats(f'meshes[{i}].{name}', numpy.zeros((0, 3)) if value is None else numpy.atleast_2d(value), 3)
                                for name, value in (('albedo', mesh.albedo), ('emission', mesh.emission)))
            kept += [p, t, albedo, emission]
            read.append(CMovingMesh(pointer(p), len(p), uints(t), len(t), pointer(albedo), len(albedo), pointer(emission),
                                     len(emission)))
        self._create(self._context, runtime.relume_moving_shapes_create, (CMovingMesh * len(read))(*read), len(read))


def hand_parts(frame, shapes, parts):
    """The parts of a frame, (shape, matrix) each, into its setup."""
    handed = (MovingPart * len(parts))(*[MovingPart(whole(f'moving_parts[{i}]', shape), axes(f'moving_parts[{i}]', matrix))
                                         for i, (shape, matrix) in enumerate(parts)])
    frame.kept.append(handed)
    frame.setup.moving_parts, frame.setup.moving_part_count = handed, len(parts)
    if shapes is not None:
        frame.setup.moving_shapes = opened('moving_shapes', shapes, MovingShapes)
        frame.handles.append(shapes)
