# SPDX-License-Identifier: MIT
"""A baked level that is being edited: near the changed parts two lights without a bake, of the level as it was baked and as it
is, correct the bake's light, and nowhere else.

    blend = relume.EditBlend(boxes, voxel)               # after an edit
    share = blend.share(positions)
    light = relighter.irradiance_in_grid(positions, normals)
    blend.irradiance(share, light, before.irradiance(positions, normals), after.irradiance(positions, normals))

Both lights take the frame's lights and shadows, those of the level as it is. They are known near surfaces: what moves through the
air keeps the bake's light. docs/notes/edits.md has errors and times.
"""
from __future__ import annotations

from ctypes import byref, sizeof

import numpy
from numpy.typing import ArrayLike

from ._arrays import Floats, floats, output, pointer, same_length
from ._handles import Context, Handle
from ._library import EditBlendDesc, EditBlendInfo, EditBox, runtime

EDITED_PART = (1.0, 1.0)  # share() of the surfaces of changed parts, wherever they are


class EditBlend(Handle):
    """How much an edit counts where.

    boxes: [m] (n, 2, 3), least and greatest corner of each changed part where it was and where it is. voxel: [m] of both lights,
    the longest side of their box / (4 cells). reach: [m] how far from a box its change counts in full; 0 = by the box's size.
    fade: [m] within which it fades beyond that; 0 = as wide as the reach. box_reaches: [m] (n,), as far as which the change of each
    box counts in full at least: of a part that emits, as far as its light goes.
    RelumeError: a box that is not finite and right side out, a length out of its range."""
    _destroy = staticmethod(runtime.relume_edit_blend_destroy)
    _error = staticmethod(runtime.relume_edit_blend_error)

    def __init__(self, boxes: ArrayLike, voxel: float, reach: float = 0.0, fade: float = 0.0, box_reaches: ArrayLike | None = None):
        array = numpy.ascontiguousarray(boxes, dtype=numpy.float32)
        if array.size and (array.ndim != 3 or array.shape[1:] != (2, 3)):
            raise ValueError(f'boxes: shape (n, 2, 3) expected, {array.shape} found')
        self._context = Context(1)
        desc = EditBlendDesc(struct_size=sizeof(EditBlendDesc), voxel=voxel, reach=reach, fade=fade)
        desc.boxes = (EditBox * len(array)).from_buffer_copy(array)
        desc.box_count = len(array)
        if box_reaches is not None:
            reaches = numpy.ascontiguousarray(box_reaches, dtype=numpy.float32)
            if reaches.shape != (len(array),):
                raise ValueError(f'box_reaches: shape ({len(array)},) expected, {reaches.shape} found')
            desc.box_reaches = pointer(reaches)
        self._create(self._context, runtime.relume_edit_blend_create, byref(desc))

    def share(self, positions: ArrayLike, out: Floats | None = None) -> Floats:
        """At points: change, of what the lights say has changed, and contact, of the light after the edit itself. (n, 2)"""
        p = floats('positions', positions, 3)
        out = output('out', out, (len(p), 2))
        self._call(runtime.relume_edit_blend_share, len(p), pointer(p), pointer(out))
        return out

    def irradiance(self, shares: ArrayLike, baked: ArrayLike, before: ArrayLike, after: ArrayLike,
                   out: Floats | None = None) -> Floats:
        """Irradiance [W/m2] of the bake, corrected by that of the lights before and after the edit: the bake's to the bit where
        change is 0. `out` may be one of them. (n, 3)"""
        s = floats('shares', shares, 2)
        b, old, new = (floats(name, v, 3) for name, v in (('baked', baked), ('before', before), ('after', after)))
        same_length(shares=s, baked=b, before=old, after=new)
        out = output('out', out, b.shape)
        self._call(runtime.relume_edit_blend_irradiance, len(b), pointer(s), pointer(b), pointer(old), pointer(new), pointer(out))
        return out

    def glsl(self) -> str:
        """The same for a shader: relumeEditShare() and relumeBlendEdited(), by uniforms() (relume/edit_blend.h)."""
        with self._running() as handle:
            return runtime.relume_edit_blend_glsl(handle).decode()

    def uniforms(self) -> tuple[Floats, float]:
        """relumeEditBox (2 * boxes, 4) and relumeEditVoxel of that GLSL; relumeEditBoxes is half of the former's length."""
        info = EditBlendInfo(struct_size=sizeof(EditBlendInfo))
        self._call(runtime.relume_edit_blend_get_info, byref(info))
        boxes = numpy.empty((2 * info.boxes, 4), numpy.float32)
        if len(boxes):
            boxes[:] = numpy.ctypeslib.as_array(info.values, boxes.shape)
        return boxes, info.voxel
