# SPDX-License-Identifier: MIT
"""Indirect light without a bake, found while a program runs, on the CPU: coarser than a bake's, and walls may be moved.

    rooms = relume.Mesh(positions, triangles)             # (n, 3) [m], (m, 3) of vertices, the front counter-clockwise
    light = relume.LiveLight([relume.Surface((0.7, 0.6, 0.5))], [rooms], [relume.Part(0)])
    for frame in range(30):
        light.update([lamp], shadows, keep=0.8)           # each adds a bounce
    light.irradiance([(0, 1, 0)], [(0, 1, 0)])            # all but the lamps' direct light

docs/guide/embedding.md has what it is for, docs/notes/live.md its errors.
"""
from __future__ import annotations

from ctypes import byref, c_float, c_int, sizeof
from dataclasses import dataclass
from typing import Mapping, Sequence

import numpy
from numpy.typing import ArrayLike

from ._arrays import axes, ByValue, Floats, floats, indices, output, pointer, same_length, three, uints, whole
from ._handles import Context, Handle
from ._library import LiveDesc, LiveEdit, LiveFrame, LiveInfo, LiveMesh, LivePart, LiveSurface, runtime
from ._lights import Frame, Light, Shadows


@dataclass(eq=False)
class Surface(ByValue):
    """What triangles reflect and emit."""
    albedo: ArrayLike = (0.5, 0.5, 0.5)  # [0..1]
    emission: ArrayLike = (0, 0, 0)  # [W/m2/sr] of the front, and of the back where double_sided
    coverage: float = 1.0  # [0..1] share of the triangle that is there: leaves, fences
    double_sided: bool = False  # emits from its back as well; both sides of any triangle reflect


@dataclass(eq=False)
class Mesh(ByValue):
    """Triangles in the axes of their part. surfaces: by index, one for each triangle, or one for all."""
    positions: ArrayLike  # [m] (n, 3)
    triangles: ArrayLike  # (m, 3) indices of positions
    surfaces: ArrayLike = 0


@dataclass(eq=False)
class Part(ByValue):
    """A mesh that stands in the level. to_world: a matrix (3, 4) or (4, 4) for columns, the place in its last; None = as it is.
    moves: placed anew by move()."""
    mesh: int
    to_world: ArrayLike | None = None
    moves: bool = False


class LiveLight(Handle):
    """Light of a level of surfaces, meshes and parts, which are copied.

    cells: [8..64] on the box's longest side; voxels are a quarter of one. rays_per_cell: [8..4096] of a frame. box: least and
    greatest corner [m] of where light is wanted; None = the bounds of the parts. surface_budget: [voxels] that keep their sides;
    0 = a quarter of the volume. cascades: [1..4] volumes in one another about the eye, which centre() moves; eye: where they are
    at first [m]; box_follows_eye: the outermost moves as well. threads: on which frames run.
    RelumeError: a number out of its range; the text names surface, mesh, triangle or part."""
    _destroy = staticmethod(runtime.relume_live_destroy)
    _error = staticmethod(runtime.relume_live_error)

    def __init__(self, surfaces: Sequence[Surface], meshes: Sequence[Mesh], parts: Sequence[Part], *, cells: int = 32,
                 rays_per_cell: int = 64, box: ArrayLike | None = None, surface_budget: int = 0, cascades: int = 1,
                 box_follows_eye: bool = False, eye: ArrayLike | None = None, threads: int = 1):
        self._context = Context(threads)
        self._moving = sum(bool(part.moves) for part in parts)
        self._next_rays = 0
        desc = LiveDesc(struct_size=sizeof(LiveDesc), cells=whole('cells', cells), cascades=whole('cascades', cascades),
                        rays_per_cell=whole('rays_per_cell', rays_per_cell), box_follows_eye=int(box_follows_eye),
                        surface_budget=whole('surface_budget', surface_budget))
        desc.surfaces = (LiveSurface * len(surfaces))(*[LiveSurface(
            three(f'surfaces[{i}].albedo', s.albedo), three(f'surfaces[{i}].emission', s.emission), s.coverage,
            int(s.double_sided)) for i, s in enumerate(surfaces)])
        desc.surface_count = len(surfaces)
        kept, read = [], []  # until relume_live_create() has read them
        for i, mesh in enumerate(meshes):
            p = floats(f'meshes[{i}].positions', mesh.positions, 3)
            t = indices(f'meshes[{i}].triangles', mesh.triangles, (0, 3), 2 ** 32)
            s = mesh.surfaces if numpy.ndim(mesh.surfaces) else numpy.full(len(t), mesh.surfaces)
            s = indices(f'meshes[{i}].surfaces', s, (len(t),), 2 ** 32)
            kept += [p, t, s]
            read.append(LiveMesh(pointer(p), len(p), uints(t), len(t), uints(s)))
        desc.meshes, desc.mesh_count = (LiveMesh * len(read))(*read), len(read)
        desc.parts = (LivePart * len(parts))(*[LivePart(whole(f'parts[{i}].mesh', part.mesh),
                                                        axes(f'parts[{i}].to_world', part.to_world), int(part.moves))
                                               for i, part in enumerate(parts)])
        desc.part_count = len(parts)
        if box is not None:
            desc.box_min, desc.box_max = (three('box', corner) for corner in box)
        if eye is not None:
            desc.eye = three('eye', eye)
        self._create(self._context, runtime.relume_live_create, byref(desc))

    @property
    def info(self) -> LiveInfo:
        """voxels, dropped_voxels (without sides: they are black), and caches as of the last frame."""
        info = LiveInfo(struct_size=sizeof(LiveInfo))
        self._call(runtime.relume_live_get_info, byref(info))
        return info

    def move(self, to_world: Sequence[ArrayLike]) -> None:
        """Where the moving parts are now, all of them in their order: matrices as Part has them."""
        if len(to_world) != self._moving:
            raise ValueError(f'to_world: {self._moving} matrices expected, {len(to_world)} found')
        numbers = [number for i, matrix in enumerate(to_world) for number in axes(f'to_world[{i}]', matrix)]
        self._call(runtime.relume_live_move, (c_float * len(numbers))(*numbers), len(to_world))

    def edit(self, parts: Mapping[int, ArrayLike | None]) -> None:
        """{part: matrix} of standing parts that are placed elsewhere, by their index; None in place of the matrix = taken away."""
        edits = (LiveEdit * len(parts))(*[LiveEdit(whole('parts', part), axes(f'parts[{part}]', matrix), int(matrix is not None))
                                          for part, matrix in parts.items()])
        self._call(runtime.relume_live_edit_parts, edits, len(edits))

    def centre(self, eye: ArrayLike) -> bool:
        """The eye is here now [m]: volumes follow it. Whether any has moved."""
        moved = c_int()
        self._call(runtime.relume_live_centre, three('eye', eye), byref(moved))
        return bool(moved.value)

    def update(self, lights: Sequence[Light] = (), visibility: Shadows | None = None, *, keep: float = 0.0,
               sky_radiance: ArrayLike = 0.0, sky_map: ArrayLike | None = None, emission_scale: ArrayLike = 1.0,
               bounce_scale: float = 1.0, ray_set: int | None = None, freeze_voxels: bool = False) -> None:
        """One frame. One that is refused leaves last frame's light. lights, visibility: as Relighter.relight() has them.

        keep: [0..1) share of last frame's light that stays: exp(-seconds / 0.15) hides the noise of few rays. sky_map: [W/m2/sr]
        (side, side, 3), an octahedral map of the sky (LiveSky of relume/live_light.h), in place of sky_radiance. ray_set: which
        rays; None = those after the last frame's. freeze_voxels: more rays of the voxels as they are lit, no bounce more."""
        frame = Frame(lights, visibility)
        how = LiveFrame()
        runtime.relume_live_frame_default(byref(how), sizeof(how))
        how.emission_scale = three('emission_scale', emission_scale)
        how.sky_radiance = three('sky_radiance', sky_radiance)
        how.bounce_scale, how.keep, how.freeze_voxels = bounce_scale, keep, int(freeze_voxels)
        how.ray_set = self._next_rays if ray_set is None else whole('ray_set', ray_set)
        if sky_map is not None:
            sky = numpy.ascontiguousarray(sky_map, dtype=numpy.float32)
            if sky.ndim != 3 or sky.shape != (len(sky), len(sky), 3):
                raise ValueError(f'sky_map: shape (side, side, 3) expected, {sky.shape} found')
            how.sky_map, how.sky_side = pointer(sky), len(sky)
        frame.run(self, runtime.relume_live_update, byref(frame.setup), byref(how))
        self._next_rays = (how.ray_set + 1) % 2 ** 32

    def reset(self) -> None:
        """No light, as before the first frame."""
        self._call(runtime.relume_live_reset)

    def irradiance(self, positions: ArrayLike, normals: ArrayLike, out: Floats | None = None) -> Floats:
        """Irradiance [W/m2] by all light but the lights' own, at points with unit normals. (n, 3)"""
        p, n = floats('positions', positions, 3), floats('normals', normals, 3)
        same_length(positions=p, normals=n)
        out = output('out', out, p.shape)
        self._call(runtime.relume_live_irradiance, len(p), pointer(p), pointer(n), pointer(out))
        return out
