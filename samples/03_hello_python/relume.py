# SPDX-License-Identifier: MIT
"""Relume's runtime in Python, over librelume.so by ctypes (include/relume/relume.h says what everything means).

    bake = Bake("level.relume")
    relighter = Relighter(bake)
    relighter.relight([Light(DIRECTIONAL, intensity=(9, 8.5, 7.5), direction=(0, -1, 0))])
    relighter.irradiance_in_grid([(0, 1, 0)], [(0, 1, 0)])

The library is the one that the loader finds, or the path in the environment variable RELUME_LIBRARY.
"""
import array
import ctypes
import ctypes.util
import os

API_VERSION = 1
DIRECTIONAL, POINT, SPOT = 0, 1, 2


class RelumeError(Exception):
    """A status other than RELUME_OK, with the library's text."""

    def __init__(self, status, text):
        super().__init__(text or f'status {status}')
        self.status = status


class _ContextDesc(ctypes.Structure):
    _fields_ = [('struct_size', ctypes.c_size_t), ('api_version', ctypes.c_uint), ('user', ctypes.c_void_p),
                ('log', ctypes.c_void_p), ('parallel_for', ctypes.c_void_p)]


class BakeInfo(ctypes.Structure):
    _fields_ = [('struct_size', ctypes.c_size_t), ('surfels', ctypes.c_uint), ('nodes', ctypes.c_uint),
                ('caches', ctypes.c_uint), ('sky_patches', ctypes.c_uint), ('instances', ctypes.c_uint),
                ('lightmap_width', ctypes.c_uint), ('lightmap_height', ctypes.c_uint), ('luma_bands', ctypes.c_uint),
                ('chroma_bands', ctypes.c_uint), ('grid_origin', ctypes.c_float * 3),
                ('grid_spacing', ctypes.c_float * 3), ('grid_resolution', ctypes.c_uint * 3),
                ('scene_hash', ctypes.c_char * 17)]


class _Light(ctypes.Structure):
    _fields_ = [('kind', ctypes.c_int), ('intensity', ctypes.c_float * 3), ('position', ctypes.c_float * 3),
                ('direction', ctypes.c_float * 3), ('range', ctypes.c_float), ('inner_cone_radians', ctypes.c_float),
                ('outer_cone_radians', ctypes.c_float)]


_Visibility = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_uint, ctypes.c_uint, ctypes.POINTER(ctypes.c_float),
                               ctypes.POINTER(ctypes.c_float), ctypes.POINTER(ctypes.c_float))


class _LightSetup(ctypes.Structure):
    _fields_ = [('struct_size', ctypes.c_size_t), ('lights', ctypes.POINTER(_Light)), ('light_count', ctypes.c_size_t),
                ('visibility', _Visibility), ('visibility_user', ctypes.c_void_p),
                ('surfel_irradiance', ctypes.POINTER(ctypes.c_float)),
                ('surfel_emission', ctypes.POINTER(ctypes.c_float)), ('sky_patches', ctypes.POINTER(ctypes.c_float)),
                ('sky_radiance', ctypes.c_float * 3), ('emission_scale', ctypes.c_float * 3),
                ('bounce_scale', ctypes.c_float)]


def Light(kind, intensity, position=(0, 0, 0), direction=(0, -1, 0), range=0.0, inner_cone=0.0, outer_cone=0.785):
    """A light of KHR_lights_punctual: W/m2 for directional ones, else W/sr; metres, radians."""
    return _Light(kind, tuple(intensity), tuple(position), tuple(direction), range, inner_cone, outer_cone)


def _load():
    path = os.environ.get('RELUME_LIBRARY') or ctypes.util.find_library('relume') or 'librelume.so'
    library = ctypes.CDLL(path)
    for name in ('relume_context_error', 'relume_bake_error', 'relume_relighter_error', 'relume_status_text',
                 'relume_version'):
        getattr(library, name).restype = ctypes.c_char_p
    for name in ('relume_context_destroy', 'relume_bake_destroy', 'relume_relighter_destroy'):
        getattr(library, name).restype = None
        getattr(library, name).argtypes = [ctypes.c_void_p]
    if library.relume_api_version() != API_VERSION:
        raise ImportError(f'{path} has API version {library.relume_api_version()}, expected {API_VERSION}')
    return library


_library = _load()


def _floats(vectors, width):
    """Vectors of `width` numbers each as one C array; anything with the buffer protocol of floats is used in place."""
    try:
        view = memoryview(vectors)
    except TypeError:
        view = memoryview(array.array('f', [x for v in vectors for x in v]))
    flat = view.cast('B').cast('f')
    if len(flat) % width:
        raise ValueError(f'{len(flat)} numbers are no vectors of {width}')
    if flat.readonly:
        return (ctypes.c_float * len(flat))(*flat), len(flat) // width
    return (ctypes.c_float * len(flat)).from_buffer(flat), len(flat) // width


class Bake:
    """A bake of a file, or of bytes."""

    def __init__(self, source):
        desc = _ContextDesc(ctypes.sizeof(_ContextDesc), API_VERSION)
        self._context, self._bake = ctypes.c_void_p(), ctypes.c_void_p()
        status = _library.relume_context_create(ctypes.byref(desc), ctypes.byref(self._context))
        if status:
            raise RelumeError(status, _library.relume_status_text(status).decode())
        if isinstance(source, (bytes, bytearray, memoryview)):
            self._bytes = ctypes.create_string_buffer(bytes(source), len(source))
            status = _library.relume_bake_from_memory(self._context, self._bytes, ctypes.c_size_t(len(source)), None,
                                                      None, ctypes.byref(self._bake))
        else:
            status = _library.relume_bake_load(self._context, os.fsencode(source), ctypes.byref(self._bake))
        if status:
            raise RelumeError(status, _library.relume_context_error(self._context).decode())
        self.info = BakeInfo(ctypes.sizeof(BakeInfo))
        self._check(_library.relume_bake_get_info(self._bake, ctypes.byref(self.info)))

    def __del__(self):
        _library.relume_bake_destroy(getattr(self, '_bake', None))
        _library.relume_context_destroy(getattr(self, '_context', None))

    def _check(self, status):
        if status:
            raise RelumeError(status, _library.relume_bake_error(self._bake).decode())

    def surfels(self):
        """Positions and normals of all surfels: two flat arrays of floats."""
        count = self.info.surfels
        positions, normals = (ctypes.c_float * (3 * count))(), (ctypes.c_float * (3 * count))()
        self._check(_library.relume_bake_surfels(self._bake, ctypes.c_size_t(0), ctypes.c_size_t(count), positions,
                                                 normals))
        return positions, normals


class Relighter:
    """The light of a bake, frame by frame."""

    def __init__(self, bake):
        self._bake = bake  # with its bytes
        self._relighter = ctypes.c_void_p()
        bake._check(_library.relume_relighter_create(bake._bake, None, ctypes.byref(self._relighter)))

    def __del__(self):
        _library.relume_relighter_destroy(getattr(self, '_relighter', None))

    def _check(self, status):
        if status:
            raise RelumeError(status, _library.relume_relighter_error(self._relighter).decode())

    def relight(self, lights, visibility=None, sky_radiance=(0, 0, 0), bounce_scale=1.0):
        """One frame. visibility(light, positions, normals) gives a share in [0..1] for each of the points, which come as
        flat arrays of floats, at most 256 points a call."""
        setup = _LightSetup()
        _library.relume_light_setup_default(ctypes.byref(setup), ctypes.c_size_t(ctypes.sizeof(setup)))
        setup.lights = (_Light * len(lights))(*lights)
        setup.light_count = len(lights)
        setup.sky_radiance = tuple(sky_radiance)
        setup.bounce_scale = bounce_scale
        raised = []
        if visibility is not None:
            def call(_, light, count, positions, normals, visible):
                try:
                    shares = visibility(light, positions[:3 * count], normals[:3 * count])
                    for i in range(count):
                        visible[i] = shares[i]
                except BaseException as error:  # none may cross the C library
                    raised.append(error)
            setup.visibility = _Visibility(call)
        self._check(_library.relume_relight(self._relighter, ctypes.byref(setup)))
        if raised:
            raise raised[0]

    def irradiance_in_grid(self, positions, normals):
        """Irradiance [W/m2] at points: a flat array of floats, three per point."""
        (p, count), (n, normal_count) = _floats(positions, 3), _floats(normals, 3)
        if count != normal_count:
            raise ValueError(f'{count} positions, {normal_count} normals')
        light = (ctypes.c_float * (3 * count))()
        self._check(_library.relume_irradiance_in_grid(self._relighter, ctypes.c_size_t(count), p, n, light))
        return light

    def irradiance_map(self):
        """RGBA16F texels of the light map: bytes, row by row."""
        info = self._bake.info
        texels = ctypes.create_string_buffer(8 * info.lightmap_width * info.lightmap_height)
        self._check(_library.relume_irradiance_map(self._relighter, texels, ctypes.c_size_t(len(texels))))
        return texels.raw
