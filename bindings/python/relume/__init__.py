# SPDX-License-Identifier: MIT
"""Indirect light of a baked level, relit every frame: Relume's runtime for Python, over librelume by ctypes.

    import relume
    bake = relume.Bake("level.relume")
    relighter = relume.Relighter(bake)
    relighter.relight([relume.Light.directional((0, -1, 0), (9, 8.5, 7.5))])
    relighter.irradiance_in_grid([(0, 1, 0)], [(0, 1, 0)])        # array([[...]], dtype=float32)

MovingShapes are things that move through a level. LiveLight is light without a bake, EditBlend corrects a bake's light where its
level has been edited.

Arrays of C-contiguous float32 are handed over as they are, others are copied once. Coordinates are right-handed with +Y up,
in metres; light is radiometric, in linear red, green, blue. include/relume/relume.h says what everything means.

Threads: ctypes lets other Python threads run during a call. Of one relighter, relight(), reset(), inherit() and close()
each need it alone; reads may run at the same time. A LiveLight is as a relighter. close() raises RuntimeError while a call runs,
also where a frame's `visibility` asks for it.
"""
from __future__ import annotations

import ctypes
import os
from ctypes import byref, c_size_t, c_uint, sizeof
from dataclasses import dataclass
from typing import Any, Mapping, Sequence

import numpy
from numpy.typing import ArrayLike, NDArray

from ._arrays import aligned, Floats, floats, output, pointer, same_length, three, whole
from ._handles import Context, Handle, opened
from ._library import (BakeInfo, DrivenImage, MaterialEmission, RelighterDesc, RelumeError, ResolveTextureInfo, runtime)
from ._lights import Frame, Light, Shadows
from .edits import EDITED_PART, EditBlend
from .live import LiveLight, Mesh, Part, Surface
from .moving import MovingMesh, MovingShapes, hand_parts

__all__ = ['Bake', 'EDITED_PART', 'EditBlend', 'Light', 'LiveLight', 'Mesh', 'MovingMesh', 'MovingShapes', 'Part', 'Relighter',
           'RelumeError', 'ResolveTexture', 'Surface', 'version']


def version() -> str:
    """Of the library: "major.minor.patch"."""
    return runtime.relume_version().decode()


@dataclass(frozen=True)
class ResolveTexture:
    """A texture of one mip level, clamped to its edges, that Relighter.resolve_glsl() reads."""
    sampler: str   # its uniform
    shape: str     # 'flat', 'array', 'volume'
    size: tuple[int, int, int, int]  # (layers or depth, height, width, channels)
    dtype: numpy.dtype[Any]  # float16, or uint8 for 0..1
    filtered: bool  # linear; else nearest
    light: bool    # to be read anew after each frame; else once


class Bake(Handle):
    """A bake: of a file, or of bytes, which are used in place where they are aligned to eight bytes.

    threads: on which relighters of it run. info: counts, sizes and the grid, as relume_bake_info has them.
    RelumeError: the file cannot be read, or is no bake."""
    _destroy = staticmethod(runtime.relume_bake_destroy)
    _error = staticmethod(runtime.relume_bake_error)

    def __init__(self, source: str | os.PathLike[str] | bytes | bytearray | memoryview | NDArray[Any], threads: int = 1):
        self._context = Context(threads)
        if isinstance(source, (bytes, bytearray, memoryview, numpy.ndarray)):
            self._bytes = held = aligned(numpy.frombuffer(source, dtype=numpy.uint8))
            self._create(self._context, runtime.relume_bake_from_memory, held.ctypes.data, held.nbytes, None, None)
        else:
            path = os.fsencode(source)
            if b'\0' in path:  # where C's strings end
                raise ValueError('source: a path without null bytes expected')
            self._create(self._context, runtime.relume_bake_load, path)
        self.info: BakeInfo = BakeInfo(struct_size=sizeof(BakeInfo))
        self._call(runtime.relume_bake_get_info, byref(self.info))

    def surfels(self) -> tuple[Floats, Floats]:
        """Positions [m] and unit normals of all surfels: two arrays of shape (surfels, 3)."""
        positions, normals = (numpy.empty((self.info.surfels, 3), numpy.float32) for _ in range(2))
        self._call(runtime.relume_bake_surfels, 0, len(positions), pointer(positions), pointer(normals))
        return positions, normals

    def sky_directions(self) -> Floats:
        """Unit directions of the patches of sky. (sky_patches, 3)"""
        directions = numpy.empty((self.info.sky_patches, 3), numpy.float32)
        self._call(runtime.relume_bake_sky_directions, pointer(directions))
        return directions

    def instance_names(self) -> list[str]:
        """Names of the glTF nodes, by instance."""
        with self._running() as handle:
            return [runtime.relume_bake_instance_name(handle, i).decode() for i in range(self.info.instances)]

    def lightmap_coordinates(self, instance: int, back_side: bool = False) -> Floats:
        """Coordinates on the light map of an instance's corners, three a triangle; -1 where the grid lights it. (corners, 2)"""
        which = whole('instance', instance), int(back_side)
        count = c_size_t()
        self._call(runtime.relume_bake_lightmap_coordinates, *which, None, byref(count))
        coordinates = numpy.empty((count.value, 2), numpy.float32)
        self._call(runtime.relume_bake_lightmap_coordinates, *which, pointer(coordinates), byref(count))
        return coordinates

    def drivable_materials(self) -> list[str]:
        """Names of the materials whose light relight(materials=) can replace."""
        with self._running() as handle:
            count = runtime.relume_bake_drivable_count(handle)
            return [runtime.relume_bake_drivable_name(handle, i).decode() for i in range(count)]


class Relighter(Handle):
    """The light of a bake, frame by frame, on the CPU.

    luma_bands, chroma_bands: of spherical harmonics; 0 = as the bake recommends. glossy: the light map keeps what
    glossy_on_lightmap() alone reads. images: {material: (height, width)}, of images that frames put on materials. moving_parts: [0..256]
    the most of a frame. moving_lag: [1, 2, 4 .. 64] frames within which caches near parts are looked at again; 0 = 32."""
    _destroy = staticmethod(runtime.relume_relighter_destroy)
    _error = staticmethod(runtime.relume_relighter_error)

    def __init__(self, bake: Bake, luma_bands: int = 0, chroma_bands: int = 0, glossy: bool = False,
                 images: Mapping[str, tuple[int, int]] | None = None, moving_parts: int = 0, moving_lag: int = 0):
        opened('bake', bake, Bake)
        self.bake, self._context = bake, bake._context  # its bytes, and the threads
        self._drivable = bake.drivable_materials()
        self._images = dict(images or {})
        driven = (DrivenImage * max(1, len(self._images)))()
        for image, (material, (height, width)) in zip(driven, self._images.items()):
            image.material = material.encode()
            image.width, image.height = (whole(f'images: "{material}"', side) for side in (width, height))
        desc = RelighterDesc(struct_size=sizeof(RelighterDesc), luma_bands=whole('luma_bands', luma_bands, 2 ** 31),
                             chroma_bands=whole('chroma_bands', chroma_bands, 2 ** 31), driven_images=driven,
                             driven_image_count=len(self._images), glossy=int(glossy),
                             moving_parts=whole('moving_parts', moving_parts), moving_lag=whole('moving_lag', moving_lag))
        self._create(bake, runtime.relume_relighter_create, byref(desc))

    def relight(self, lights: Sequence[Light] = (), visibility: Shadows | None = None, *, surfel_irradiance: ArrayLike | None = None,
                surfel_emission: ArrayLike | None = None, sky_patches: ArrayLike | None = None, sky_radiance: ArrayLike = 0.0,
                emission_scale: ArrayLike = 1.0, bounce_scale: float = 1.0, materials: Mapping[str, ArrayLike] | None = None,
                moving_shapes: MovingShapes | None = None, moving_parts: Sequence[tuple[int, ArrayLike | None]] = ()) -> None:
        """One frame. A setup that is refused leaves last frame's light.

        visibility(light, positions, normals): shares [0..1] of a light, by its index, that reach points, of shape (n,); the
        points are read-only views of shape (n, 3), n <= 256, that live until it returns. With Bake(threads=) it is called from
        several threads. None = nothing is in shadow. What it raises is raised here after the frame, which counts all the same, with
        the points that it did not answer for in shadow; reset() forgets that light.
        surfel_irradiance: [W/m2] (surfels, 3), the host's own direct light in place of the lights. surfel_emission: [W/m2/sr]
        (surfels, 3). sky_patches: [W/m2/sr] (sky_patches, 3), or sky_radiance for all of the sky. materials: {name: colour, or
        image of shape (height, width, 3), as declared} [W/m2/sr] in place of what they were baked with; where several have one
        name, a colour is for all of them, an image for the first. moving_parts: (shape, matrix) each, which of moving_shapes stand
        where, as Part has its to_world; visibility answers for points on them as well.
        Ctrl-C waits for the end of the frame, unless it comes in `visibility` on the calling thread; so do other signals whose
        handlers are Python's."""
        info = self.bake.info
        frame = Frame(lights, visibility)
        setup = frame.setup
        for name, values, count in (('surfel_irradiance', surfel_irradiance, info.surfels),
                                    ('surfel_emission', surfel_emission, info.surfels),
                                    ('sky_patches', sky_patches, info.sky_patches)):
            if values is None:
                continue
            array = floats(name, values, 3)
            if len(array) != count:
                raise ValueError(f'{name}: shape ({count}, 3) expected, {array.shape} found')
            frame.kept.append(array)
            setattr(setup, name, pointer(array))
        setup.sky_radiance = three('sky_radiance', sky_radiance)
        setup.emission_scale = three('emission_scale', emission_scale)
        setup.bounce_scale = bounce_scale
        if materials:
            self._drive(frame, materials)
        hand_parts(frame, moving_shapes, moving_parts)
        frame.run(self, runtime.relume_relight, byref(setup))

    def _drive(self, frame, materials):
        driven = []
        for name, value in materials.items():
            named = [i for i, other in enumerate(self._drivable) if other == name]
            if not named:
                raise ValueError(f'materials: "{name}" cannot be driven; those that can: {", ".join(self._drivable) or "none"}')
            array = numpy.ascontiguousarray(value, dtype=numpy.float32)
            if array.ndim == 3:
                if name not in self._images:
                    raise ValueError(f'materials: "{name}": declare its image in Relighter(images=), {array.shape} found')
                if array.shape != (*self._images[name], 3):
                    raise ValueError(f'materials: "{name}": an image of shape {(*self._images[name], 3)} was declared, '
                                     f'{array.shape} found')
                frame.kept.append(array)
                driven.append(MaterialEmission(material=named[0], radiance=(1, 1, 1), image=pointer(array),
                                               texel_count=array.size // 3))
            else:
                driven += [MaterialEmission(material=i, radiance=three(f'materials: "{name}"', value)) for i in named]
        frame.setup.material_emissions = (MaterialEmission * len(driven))(*driven)
        frame.setup.material_emission_count = len(driven)

    def reset(self) -> None:
        """Forget last frame's light."""
        self._call(runtime.relume_reset)

    def inherit(self, previous: Relighter) -> None:
        """Hot reload: begin with the light of `previous`, a relighter of an older bake of the level. This relighter's own bake
        must still be open."""
        opened('previous', previous, Relighter)
        with self.bake._running() as bake, previous._running() as before:
            self._call(runtime.relume_inherit, bake, before)

    def irradiance_in_grid(self, positions: ArrayLike, normals: ArrayLike, out: Floats | None = None) -> Floats:
        """Irradiance [W/m2] at points anywhere, by the grid. (n, 3) One outside of the grid's box reads the grid points around the
        nearest place in it; how much of each is seen, and which way it lies, counts from the point itself."""
        p, n = floats('positions', positions, 3), floats('normals', normals, 3)
        same_length(positions=p, normals=n)
        out = output('out', out, p.shape)
        self._call(runtime.relume_irradiance_in_grid, len(p), pointer(p), pointer(n), pointer(out))
        return out

    def irradiance_on_lightmap(self, uvs: ArrayLike, normals: ArrayLike, geometric_normals: ArrayLike | None = None,
                               out: Floats | None = None) -> Floats:
        """Irradiance [W/m2] at coordinates of the light map. (n, 3)"""
        uv, n = floats('uvs', uvs, 2), floats('normals', normals, 3)
        g = None if geometric_normals is None else floats('geometric_normals', geometric_normals, 3)
        same_length(uvs=uv, normals=n, geometric_normals=g)
        out = output('out', out, n.shape)
        self._call(runtime.relume_irradiance_on_lightmap, len(uv), pointer(uv), pointer(n), pointer(g), pointer(out))
        return out

    def glossy_in_grid(self, positions: ArrayLike, normals: ArrayLike, reflected: ArrayLike, exponents: ArrayLike,
                       out: Floats | None = None) -> Floats:
        """Mean radiance [W/m2/sr] in lobes cos^exponent about `reflected`, by the grid. (n, 3)"""
        p, n, r = (floats(name, v, 3) for name, v in
                   (('positions', positions), ('normals', normals), ('reflected', reflected)))
        e = floats('exponents', exponents, 1)
        same_length(positions=p, normals=n, reflected=r, exponents=e)
        out = output('out', out, p.shape)
        self._call(runtime.relume_glossy_in_grid, len(p), pointer(p), pointer(n), pointer(r), pointer(e), pointer(out))
        return out

    def glossy_on_lightmap(self, uvs: ArrayLike, reflected: ArrayLike, exponents: ArrayLike, out: Floats | None = None) -> Floats:
        """The same at coordinates of the light map. (n, 3)"""
        uv, r, e = floats('uvs', uvs, 2), floats('reflected', reflected, 3), floats('exponents', exponents, 1)
        same_length(uvs=uv, reflected=r, exponents=e)
        out = output('out', out, r.shape)
        self._call(runtime.relume_glossy_on_lightmap, len(uv), pointer(uv), pointer(r), pointer(e), pointer(out))
        return out

    def irradiance_map(self, out: NDArray[numpy.float16] | None = None) -> NDArray[numpy.float16]:
        """Irradiance of the light map's texels, each for its own normal: (height, width, 4) of float16; a = 1 where there is
        light."""
        info = self.bake.info
        out = output('out', out, (info.lightmap_height, info.lightmap_width, 4), numpy.float16)
        self._call(runtime.relume_irradiance_map, out.ctypes.data, out.nbytes)
        return out

    def irradiance_map_l1(self, out: NDArray[numpy.float16] | None = None) -> NDArray[numpy.float16]:
        """Four layers of them, (4, height, width, 4): E(n) = max(layer 0 + n.x layer 1 + n.y layer 2 + n.z layer 3, 0)."""
        info = self.bake.info
        out = output('out', out, (4, info.lightmap_height, info.lightmap_width, 4), numpy.float16)
        self._call(runtime.relume_irradiance_map_l1, out.ctypes.data, out.nbytes)
        return out

    def resolve_textures(self) -> list[ResolveTexture]:
        """The textures that resolve_glsl() reads, for a shader of one's own in any graphics API."""
        count = c_uint()
        self._call(runtime.relume_resolve_texture_count, byref(count))
        textures = []
        for i in range(count.value):
            info = ResolveTextureInfo(struct_size=sizeof(ResolveTextureInfo))
            self._call(runtime.relume_resolve_texture_get_info, i, byref(info))
            channels, dtype = [(4, numpy.float16), (2, numpy.float16), (4, numpy.uint8), (1, numpy.uint8)][info.format]
            textures.append(ResolveTexture(info.sampler.decode(), ('flat', 'array', 'volume')[info.shape],
                                           (info.depth, info.height, info.width, channels), numpy.dtype(dtype),
                                           bool(info.filtered), bool(info.light)))
        return textures

    def resolve_texture(self, index: int, out: NDArray[Any] | None = None) -> NDArray[Any]:
        """Texels of resolve_textures()[index], as of the last frame: (depth, height, width, channels)."""
        textures = self.resolve_textures()
        texture = textures[whole('index', index, len(textures))]
        out = output('out', out, texture.size, texture.dtype)
        self._call(runtime.relume_resolve_texture_write, index, out.ctypes.data, out.nbytes)
        return out

    def resolve_uniforms(self) -> Floats:
        """uniform vec4 relumeGrid[6] of resolve_glsl(). (6, 4)"""
        out = numpy.zeros((6, 4), numpy.float32)
        self._call(runtime.relume_resolve_uniforms, pointer(out))
        return out

    def resolve_glsl(self) -> str:
        """GLSL for after #version, 3.30 and ES 3.00 at least: relumeIrradianceLightmap(), relumeIrradianceGrid() and so on."""
        length = c_size_t()
        self._call(runtime.relume_resolve_glsl, None, 0, byref(length))
        text = ctypes.create_string_buffer(length.value + 1)
        self._call(runtime.relume_resolve_glsl, text, len(text), None)
        return text.value.decode()

    def ambient_volume(self, origin: ArrayLike, spacing: ArrayLike, resolution: Sequence[int], out: Floats | None = None) -> Floats:
        """Irradiance for +x, -x, +y, -y, +z, -z at the points of a lattice of (x, y, z) points: (z, y, x, 6, 3)."""
        x, y, z = (whole('resolution', r) for r in resolution)
        if min(x, y, z) < 1:
            raise ValueError(f'resolution: 1 point an axis and more expected, {tuple(resolution)} found')
        out = output('out', out, (z, y, x, 6, 3))
        self._call(runtime.relume_ambient_volume, three('origin', origin), three('spacing', spacing),
                   (c_uint * 3)(x, y, z), pointer(out), out.nbytes)
        return out

    def cache_coefficients(self, out: Floats | None = None) -> Floats:
        """Spherical harmonics coefficients of each cache: Y's, Co's, Cg's. (caches, coefficients)"""
        with self._running() as handle:
            shape = (self.bake.info.caches, runtime.relume_coefficients_per_cache(handle))
        out = output('out', out, shape)
        self._call(runtime.relume_cache_coefficients, pointer(out), out.nbytes)
        return out
