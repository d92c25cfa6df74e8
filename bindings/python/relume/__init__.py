# SPDX-License-Identifier: MIT
"""Indirect light of a baked level, relit every frame: Relume's runtime for Python, over librelume by ctypes.

    import relume
    bake = relume.Bake("level.relume")
    relighter = relume.Relighter(bake)
    relighter.relight([relume.Light.directional((0, -1, 0), (9, 8.5, 7.5))])
    relighter.irradiance_in_grid([(0, 1, 0)], [(0, 1, 0)])        # array([[...]], dtype=float32)

Arrays of C-contiguous float32 are handed over as they are, others are copied once. Coordinates are right-handed with +Y up,
in metres; light is radiometric, in linear red, green, blue. include/relume/relume.h says what everything means.

Threads: ctypes lets other Python threads run during a call. Of one relighter, relight(), reset(), inherit() and close()
each need it alone; reads may run at the same time.
"""
import collections
import concurrent.futures
import ctypes
import os
import threading
from ctypes import byref, c_float, c_size_t, c_uint, c_void_p, sizeof
from dataclasses import dataclass, field

import numpy

from ._library import (API_VERSION, BakeInfo, CLight, ContextDesc, DrivenImage, LightSetup, MaterialEmission, ParallelFor,
                       RelighterDesc, RelumeError, ResolveTextureInfo, Visibility, load)

__all__ = ['Bake', 'Light', 'Relighter', 'RelumeError', 'ResolveTexture', 'version']

_runtime = load()
_DIRECTIONAL, _POINT, _SPOT = 0, 1, 2


def version():
    """Of the library: "major.minor.patch"."""
    return _runtime.relume_version().decode()


@dataclass(frozen=True)
class ResolveTexture:
    """A texture of one mip level, clamped to its edges, that Relighter.resolve_glsl() reads."""
    sampler: str   # its uniform
    shape: str     # 'flat', 'array', 'volume'
    size: tuple    # (layers or depth, height, width, channels)
    dtype: object  # float16, or uint8 for 0..1
    filtered: bool  # linear; else nearest
    light: bool    # to be read anew after each frame; else once


def _floats(name, values, width):
    """C-contiguous float32 of shape (n, width), or (n,) for width 1; the array itself where it is that already."""
    array = numpy.ascontiguousarray(values, dtype=numpy.float32)
    if width == 1:
        if array.ndim != 1:
            raise ValueError(f'{name}: shape (n,) expected, {array.shape} found')
    elif array.ndim != 2 or array.shape[1] != width:
        raise ValueError(f'{name}: shape (n, {width}) expected, {array.shape} found')
    return array


def _three(name, value):
    """Three floats, from a sequence of three or from one number for all."""
    array = numpy.broadcast_to(numpy.asarray(value, dtype=numpy.float32), (3,)) if numpy.ndim(value) == 0 else numpy.asarray(
        value, dtype=numpy.float32)
    if array.shape != (3,):
        raise ValueError(f'{name}: three numbers expected, shape {array.shape} found')
    return (c_float * 3)(*array.tolist())


def _pointer(array):
    return None if array is None else array.ctypes.data_as(ctypes.POINTER(c_float))


def _output(name, out, shape, dtype=numpy.float32):
    """The array that a call writes: `out`, which must fit, or a new one."""
    if out is None:
        return numpy.empty(shape, dtype=dtype)
    fits = isinstance(out, numpy.ndarray) and out.shape == shape and out.dtype == dtype and out.flags.c_contiguous
    if not fits or not out.flags.writeable:
        raise ValueError(f'{name}: a writeable C-contiguous array of {numpy.dtype(dtype)}, shape {shape}, expected')
    return out


def _aligned(data):
    """Bytes at an address that eight divides: `data`, or a copy."""
    if data.ctypes.data % 8 == 0:
        return data
    copy = numpy.empty(len(data) + 8, dtype=numpy.uint8)
    copy = copy[-copy.ctypes.data % 8:][:len(data)]
    copy[:] = data
    return copy


def _same_length(**arrays):
    lengths = {name: len(array) for name, array in arrays.items() if array is not None}
    if len(set(lengths.values())) > 1:
        raise ValueError('arrays of one length expected: ' + ', '.join(f'{n} has {k}' for n, k in lengths.items()))


@dataclass
class Light:
    """A punctual light as KHR_lights_punctual defines it; see the three constructors."""
    kind: int
    intensity: tuple              # [W/sr], of a directional light [W/m2]
    position: tuple = (0, 0, 0)   # [m]
    direction: tuple = (0, -1, 0)  # the way the light travels, of length 1
    range: float = 0.0            # [m] 0 = no limit
    inner_cone: float = 0.0       # [radians]
    outer_cone: float = 0.7853982

    @classmethod
    def directional(cls, direction, irradiance):
        """A sun; irradiance [W/m2] of a surface that faces it."""
        return cls(_DIRECTIONAL, irradiance, direction=direction)

    @classmethod
    def point(cls, position, intensity, range=0.0):
        """A lamp; intensity [W/sr]."""
        return cls(_POINT, intensity, position=position, range=range)

    @classmethod
    def spot(cls, position, direction, intensity, inner_cone=0.0, outer_cone=0.7853982, range=0.0):
        """A spotlight; cones are angles from its axis [radians]."""
        return cls(_SPOT, intensity, position, direction, range, inner_cone, outer_cone)

    def _c(self):
        return CLight(self.kind, _three('intensity', self.intensity), _three('position', self.position),
                      _three('direction', self.direction), self.range, self.inner_cone, self.outer_cone)


class _Handle:
    """Something of the library that is destroyed once: by close(), at the end of a `with`, or with the object."""
    _destroy = None
    _handle = None

    def close(self):
        handle, self._handle = self._handle, None
        if handle:
            self._destroy(handle)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def __del__(self):
        self.close()

    def _open(self):
        if not self._handle:
            raise ValueError(f'this {type(self).__name__} is closed')
        return self._handle


class _Batch:
    """Tasks of one call. Only workers take them: an exception from outside, Ctrl-C's, comes to the main thread alone."""

    def __init__(self, tasks, task, data):
        self._waiting, self._ended, self._tasks = collections.deque(range(tasks)), [], tasks
        self._task, self._data = task, data
        self.done = threading.Event()
        if tasks == 0:
            self.done.set()

    def work(self):
        while True:
            try:
                index = self._waiting.popleft()
            except IndexError:
                return
            self._task(self._data, index)
            self._ended.append(index)
            if len(self._ended) == self._tasks:
                self.done.set()


class _Context(_Handle):
    """Errors of loading, and the threads that relighters of its bakes run on."""
    _destroy = staticmethod(_runtime.relume_context_destroy)

    def __init__(self, threads):
        if not 1 <= threads <= 1024:
            raise ValueError(f'threads: 1 to 1024 expected, {threads} found')
        self.interrupted = None
        desc = ContextDesc(struct_size=sizeof(ContextDesc), api_version=API_VERSION)
        if threads > 1:
            self._threads = threads
            self._pool = concurrent.futures.ThreadPoolExecutor(threads)
            self._parallel_for = ParallelFor(self._run)  # must live as long as the library may call it
            desc.parallel_for = self._parallel_for
        context = c_void_p()
        status = _runtime.relume_context_create(byref(desc), byref(context))
        if status:
            raise RelumeError(status, _runtime.relume_status_text(status).decode())
        self._handle = context

    def _run(self, _, tasks, task, data):
        """All tasks are done when this returns, Ctrl-C or not: they use memory of the call that asked for them."""
        batch = _Batch(tasks, task, data)
        while not batch.done.is_set():
            try:
                for _ in range(min(self._threads, tasks)):
                    self._pool.submit(batch.work)
                batch.done.wait()
            except RuntimeError:  # the interpreter is about to end, and takes no more work
                batch.work()
            except BaseException as error:  # pylint: disable=broad-except
                self.interrupted = error

    def take_interrupt(self):
        """What came up while tasks ran, Ctrl-C for example; None = nothing."""
        error, self.interrupted = self.interrupted, None
        return error


class Bake(_Handle):
    """A bake: of a file, or of bytes, which are used in place where they are aligned to eight bytes.

    threads: on which relighters of it run. info: counts, sizes and the grid, as relume_bake_info has them.
    RelumeError: the file cannot be read, or is no bake."""
    _destroy = staticmethod(_runtime.relume_bake_destroy)

    def __init__(self, source, threads=1):
        self._context = _Context(threads)
        bake = c_void_p()
        if isinstance(source, (bytes, bytearray, memoryview, numpy.ndarray)):
            self._bytes = held = _aligned(numpy.frombuffer(source, dtype=numpy.uint8))
            status = _runtime.relume_bake_from_memory(self._context._handle, held.ctypes.data, held.nbytes, None, None,
                                                      byref(bake))
        else:
            status = _runtime.relume_bake_load(self._context._handle, os.fsencode(source), byref(bake))
        if status:
            raise RelumeError(status, _runtime.relume_context_error(self._context._handle).decode())
        self._handle = bake
        self.info = BakeInfo(struct_size=sizeof(BakeInfo))
        self._check(_runtime.relume_bake_get_info(bake, byref(self.info)))

    def _check(self, status):
        if status:
            raise RelumeError(status, _runtime.relume_bake_error(self._handle).decode())

    def surfels(self):
        """Positions [m] and unit normals of all surfels: two arrays of shape (surfels, 3)."""
        positions, normals = (numpy.empty((self.info.surfels, 3), numpy.float32) for _ in range(2))
        self._check(_runtime.relume_bake_surfels(self._open(), 0, len(positions), _pointer(positions), _pointer(normals)))
        return positions, normals

    def sky_directions(self):
        """Unit directions of the patches of sky. (sky_patches, 3)"""
        directions = numpy.empty((self.info.sky_patches, 3), numpy.float32)
        self._check(_runtime.relume_bake_sky_directions(self._open(), _pointer(directions)))
        return directions

    def instance_names(self):
        """Names of the glTF nodes, by instance."""
        return [_runtime.relume_bake_instance_name(self._open(), i).decode() for i in range(self.info.instances)]

    def lightmap_coordinates(self, instance, back_side=False):
        """Coordinates on the light map of an instance's corners, three a triangle; -1 where the grid lights it. (corners, 2)"""
        count = c_size_t()
        call = _runtime.relume_bake_lightmap_coordinates
        self._check(call(self._open(), instance, int(back_side), None, byref(count)))
        coordinates = numpy.empty((count.value, 2), numpy.float32)
        self._check(call(self._open(), instance, int(back_side), _pointer(coordinates), byref(count)))
        return coordinates

    def drivable_materials(self):
        """Names of the materials whose light relight(materials=) can replace."""
        count = _runtime.relume_bake_drivable_count(self._open())
        return [_runtime.relume_bake_drivable_name(self._open(), i).decode() for i in range(count)]


@dataclass
class _Frame:
    """A LightSetup and what it points to."""
    setup: LightSetup
    kept: list = field(default_factory=list)
    raised: list = field(default_factory=list)


class Relighter(_Handle):
    """The light of a bake, frame by frame, on the CPU.

    luma_bands, chroma_bands: of spherical harmonics; 0 = as the bake recommends. glossy: the light map keeps what
    glossy_on_lightmap() alone reads. images: {material: (height, width)}, of images that frames put on materials."""
    _destroy = staticmethod(_runtime.relume_relighter_destroy)

    def __init__(self, bake, luma_bands=0, chroma_bands=0, glossy=False, images=None):
        self.bake = bake  # with its bytes, its context and that one's threads
        self._images = dict(images or {})
        driven = (DrivenImage * max(1, len(self._images)))()
        for image, (material, (height, width)) in zip(driven, self._images.items()):
            image.material, image.width, image.height = material.encode(), width, height
        desc = RelighterDesc(struct_size=sizeof(RelighterDesc), luma_bands=luma_bands, chroma_bands=chroma_bands,
                             driven_images=driven, driven_image_count=len(self._images), glossy=int(glossy))
        relighter = c_void_p()
        bake._check(_runtime.relume_relighter_create(bake._open(), byref(desc), byref(relighter)))
        self._handle = relighter

    def _check(self, status):
        if status:
            raise RelumeError(status, _runtime.relume_relighter_error(self._handle).decode())

    def relight(self, lights=(), visibility=None, *, surfel_irradiance=None, surfel_emission=None, sky_patches=None,
                sky_radiance=0.0, emission_scale=1.0, bounce_scale=1.0, materials=None):
        """One frame. A setup that is refused leaves last frame's light.

        visibility(light, positions, normals): shares [0..1] of a light, by its index, that reach points, of shape (n,); the
        points are read-only views of shape (n, 3), n <= 256, that live until it returns. With Bake(threads=) it is called from
        several threads. None = nothing is in shadow.
        surfel_irradiance: [W/m2] (surfels, 3), the host's own direct light in place of the lights. surfel_emission: [W/m2/sr]
        (surfels, 3). sky_patches: [W/m2/sr] (sky_patches, 3), or sky_radiance for all of the sky. materials: {name: colour, or
        image of shape (height, width, 3), as declared} [W/m2/sr] in place of what they were baked with."""
        info = self.bake.info
        setup = LightSetup()
        _runtime.relume_light_setup_default(byref(setup), sizeof(setup))
        frame = _Frame(setup)
        setup.lights = (CLight * len(lights))(*[light._c() for light in lights])
        setup.light_count = len(lights)
        for name, values, count in (('surfel_irradiance', surfel_irradiance, info.surfels),
                                    ('surfel_emission', surfel_emission, info.surfels),
                                    ('sky_patches', sky_patches, info.sky_patches)):
            if values is None:
                continue
            array = _floats(name, values, 3)
            if len(array) != count:
                raise ValueError(f'{name}: shape ({count}, 3) expected, {array.shape} found')
            frame.kept.append(array)
            setattr(setup, name, _pointer(array))
        setup.sky_radiance = _three('sky_radiance', sky_radiance)
        setup.emission_scale = _three('emission_scale', emission_scale)
        setup.bounce_scale = bounce_scale
        if materials:
            self._drive(frame, materials)
        if visibility is not None:
            setup.visibility = Visibility(_visibility_call(visibility, frame.raised))
        status = _runtime.relume_relight(self._open(), byref(setup))
        error = self.bake._context.take_interrupt() or (frame.raised[0] if frame.raised else None)
        if error is not None:
            raise error
        self._check(status)

    def _drive(self, frame, materials):
        names = self.bake.drivable_materials()
        driven = []
        for name, value in materials.items():
            if name not in names:
                raise ValueError(f'materials: "{name}" cannot be driven; those that can: {", ".join(names) or "none"}')
            array = numpy.ascontiguousarray(value, dtype=numpy.float32)
            emission = MaterialEmission(material=names.index(name), radiance=(1, 1, 1))
            if array.ndim == 3:
                if self._images.get(name) != array.shape[:2] or array.shape[2] != 3:
                    raise ValueError(f'materials: "{name}": an image of shape {self._images.get(name)} x 3 was declared, '
                                     f'{array.shape} found')
                frame.kept.append(array)
                emission.image, emission.texel_count = _pointer(array), array.size // 3
            else:
                emission.radiance = _three(f'materials: "{name}"', value)
            driven.append(emission)
        frame.setup.material_emissions = (MaterialEmission * len(driven))(*driven)
        frame.setup.material_emission_count = len(driven)

    def reset(self):
        """Forget last frame's light."""
        self._check(_runtime.relume_reset(self._open()))

    def inherit(self, previous):
        """Hot reload: begin with the light of `previous`, a relighter of an older bake of the level."""
        self._check(_runtime.relume_inherit(self._open(), self.bake._open(), previous._open()))

    def irradiance_in_grid(self, positions, normals, out=None):
        """Irradiance [W/m2] at points anywhere, by the grid. (n, 3)"""
        p, n = _floats('positions', positions, 3), _floats('normals', normals, 3)
        _same_length(positions=p, normals=n)
        out = _output('out', out, p.shape)
        self._check(_runtime.relume_irradiance_in_grid(self._open(), len(p), _pointer(p), _pointer(n), _pointer(out)))
        return out

    def irradiance_on_lightmap(self, uvs, normals, geometric_normals=None, out=None):
        """Irradiance [W/m2] at coordinates of the light map. (n, 3)"""
        uv, n = _floats('uvs', uvs, 2), _floats('normals', normals, 3)
        g = None if geometric_normals is None else _floats('geometric_normals', geometric_normals, 3)
        _same_length(uvs=uv, normals=n, geometric_normals=g)
        out = _output('out', out, n.shape)
        self._check(_runtime.relume_irradiance_on_lightmap(self._open(), len(uv), _pointer(uv), _pointer(n), _pointer(g),
                                                           _pointer(out)))
        return out

    def glossy_in_grid(self, positions, normals, reflected, exponents, out=None):
        """Mean radiance [W/m2/sr] in lobes cos^exponent about `reflected`, by the grid. (n, 3)"""
        p, n, r = (_floats(name, v, 3) for name, v in
                   (('positions', positions), ('normals', normals), ('reflected', reflected)))
        e = _floats('exponents', exponents, 1)
        _same_length(positions=p, normals=n, reflected=r, exponents=e)
        out = _output('out', out, p.shape)
        self._check(_runtime.relume_glossy_in_grid(self._open(), len(p), _pointer(p), _pointer(n), _pointer(r), _pointer(e),
                                                   _pointer(out)))
        return out

    def glossy_on_lightmap(self, uvs, reflected, exponents, out=None):
        """The same at coordinates of the light map. (n, 3)"""
        uv, r, e = _floats('uvs', uvs, 2), _floats('reflected', reflected, 3), _floats('exponents', exponents, 1)
        _same_length(uvs=uv, reflected=r, exponents=e)
        out = _output('out', out, r.shape)
        self._check(_runtime.relume_glossy_on_lightmap(self._open(), len(uv), _pointer(uv), _pointer(r), _pointer(e),
                                                       _pointer(out)))
        return out

    def irradiance_map(self, out=None):
        """Irradiance of the light map's texels, each for its own normal: (height, width, 4) of float16; a = 1 where there is
        light."""
        info = self.bake.info
        out = _output('out', out, (info.lightmap_height, info.lightmap_width, 4), numpy.float16)
        self._check(_runtime.relume_irradiance_map(self._open(), out.ctypes.data, out.nbytes))
        return out

    def irradiance_map_l1(self, out=None):
        """Four layers of them, (4, height, width, 4): E(n) = max(layer 0 + n.x layer 1 + n.y layer 2 + n.z layer 3, 0)."""
        info = self.bake.info
        out = _output('out', out, (4, info.lightmap_height, info.lightmap_width, 4), numpy.float16)
        self._check(_runtime.relume_irradiance_map_l1(self._open(), out.ctypes.data, out.nbytes))
        return out

    def resolve_textures(self):
        """The textures that resolve_glsl() reads, for a shader of one's own in any graphics API."""
        count = c_uint()
        self._check(_runtime.relume_resolve_texture_count(self._open(), byref(count)))
        textures = []
        for i in range(count.value):
            info = ResolveTextureInfo(struct_size=sizeof(ResolveTextureInfo))
            self._check(_runtime.relume_resolve_texture_get_info(self._open(), i, byref(info)))
            channels, dtype = [(4, numpy.float16), (2, numpy.float16), (4, numpy.uint8), (1, numpy.uint8)][info.format]
            textures.append(ResolveTexture(info.sampler.decode(), ('flat', 'array', 'volume')[info.shape],
                                           (info.depth, info.height, info.width, channels), numpy.dtype(dtype),
                                           bool(info.filtered), bool(info.light)))
        return textures

    def resolve_texture(self, index, out=None):
        """Texels of resolve_textures()[index], as of the last frame: (depth, height, width, channels)."""
        texture = self.resolve_textures()[index]
        out = _output('out', out, texture.size, texture.dtype)
        self._check(_runtime.relume_resolve_texture_write(self._open(), index, out.ctypes.data, out.nbytes))
        return out

    def resolve_uniforms(self):
        """uniform vec4 relumeGrid[6] of resolve_glsl(). (6, 4)"""
        out = numpy.zeros((6, 4), numpy.float32)
        self._check(_runtime.relume_resolve_uniforms(self._open(), _pointer(out)))
        return out

    def resolve_glsl(self):
        """GLSL for after #version, 3.30 and ES 3.00 at least: relumeIrradianceLightmap(), relumeIrradianceGrid() and so on."""
        length = c_size_t()
        self._check(_runtime.relume_resolve_glsl(self._open(), None, 0, byref(length)))
        text = ctypes.create_string_buffer(length.value + 1)
        self._check(_runtime.relume_resolve_glsl(self._open(), text, len(text), None))
        return text.value.decode()

    def ambient_volume(self, origin, spacing, resolution, out=None):
        """Irradiance for +x, -x, +y, -y, +z, -z at the points of a lattice of (x, y, z) points: (z, y, x, 6, 3)."""
        x, y, z = (int(r) for r in resolution)
        if min(x, y, z) < 1:
            raise ValueError(f'resolution: 1 point an axis and more expected, {tuple(resolution)} found')
        out = _output('out', out, (z, y, x, 6, 3))
        self._check(_runtime.relume_ambient_volume(self._open(), _three('origin', origin), _three('spacing', spacing),
                                                   (c_uint * 3)(x, y, z), _pointer(out), out.nbytes))
        return out

    def cache_coefficients(self, out=None):
        """Spherical harmonics coefficients of each cache: Y's, Co's, Cg's. (caches, coefficients)"""
        shape = (self.bake.info.caches, _runtime.relume_coefficients_per_cache(self._open()))
        out = _output('out', out, shape)
        self._check(_runtime.relume_cache_coefficients(self._open(), _pointer(out), out.nbytes))
        return out


def _visibility_call(visibility, raised):
    """`visibility` as the library calls it; what it raises goes to `raised`, as no exception may cross the library."""

    def call(_, light, count, positions, normals, visible):
        if raised:
            return
        try:
            points = [numpy.ctypeslib.as_array(p, (count, 3)) for p in (positions, normals)]
            for view in points:
                view.flags.writeable = False
            numpy.ctypeslib.as_array(visible, (count,))[:] = visibility(light, *points)
        except BaseException as error:  # pylint: disable=broad-except
            raised.append(error)

    return call
