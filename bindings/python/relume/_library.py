# SPDX-License-Identifier: MIT
"""The C library: its structs as include/relume/relume.h and relume_live.h have them, its functions with their types, and where it is found."""
import ctypes
import ctypes.util
import glob
import os
from ctypes import POINTER, Structure, c_char, c_char_p, c_float, c_int, c_size_t, c_uint, c_void_p

API_VERSION = 1


class RelumeError(Exception):
    """A call that failed: `status` is a relume_status, the text says where and what to do."""

    def __init__(self, status, text):
        super().__init__(text or f'status {status}')
        self.status = status

    def __reduce__(self):
        return type(self), (self.status, str(self))


Task = ctypes.CFUNCTYPE(None, c_void_p, c_uint)
ParallelFor = ctypes.CFUNCTYPE(None, c_void_p, c_uint, Task, c_void_p)
Visibility = ctypes.CFUNCTYPE(None, c_void_p, c_uint, c_uint, POINTER(c_float), POINTER(c_float), POINTER(c_float))


class Info(Structure):
    """What is read, and printed."""

    def __repr__(self):
        def shown(value):
            return [round(each, 6) for each in value] if isinstance(value, ctypes.Array) else value
        fields = (f'{name}={shown(getattr(self, name))!r}' for name, *_ in self._fields_ if name not in ('struct_size', 'values'))
        return f'{type(self).__name__}({", ".join(fields)})'


class ContextDesc(Structure):
    _fields_ = [('struct_size', c_size_t), ('api_version', c_uint), ('user', c_void_p), ('log', c_void_p),
                ('parallel_for', ParallelFor), ('allocate', c_void_p), ('deallocate', c_void_p)]


class BakeInfo(Info):
    _fields_ = [('struct_size', c_size_t), ('surfels', c_uint), ('nodes', c_uint), ('caches', c_uint),
                ('sky_patches', c_uint), ('instances', c_uint), ('lightmap_width', c_uint), ('lightmap_height', c_uint),
                ('luma_bands', c_uint), ('chroma_bands', c_uint), ('grid_origin', c_float * 3),
                ('grid_spacing', c_float * 3), ('grid_resolution', c_uint * 3), ('scene_hash', c_char * 17)]


class DrivenImage(Structure):
    _fields_ = [('material', c_char_p), ('width', c_uint), ('height', c_uint)]


class RelighterDesc(Structure):
    _fields_ = [('struct_size', c_size_t), ('backend', c_int), ('luma_bands', c_int), ('chroma_bands', c_int),
                ('visibility_glsl', c_char_p), ('get_proc_address', c_void_p), ('get_proc_address_user', c_void_p),
                ('driven_images', POINTER(DrivenImage)), ('driven_image_count', c_size_t), ('glossy', c_int),
                ('grid_texture', c_int), ('grid_trust', c_float), ('grid_texture_bytes', c_uint), ('moving_parts', c_uint),
                ('moving_lag', c_uint)]


class CLight(Structure):
    _fields_ = [('kind', c_int), ('intensity', c_float * 3), ('position', c_float * 3), ('direction', c_float * 3),
                ('range', c_float), ('inner_cone_radians', c_float), ('outer_cone_radians', c_float)]


class MaterialEmission(Structure):
    _fields_ = [('material', c_uint), ('radiance', c_float * 3), ('image', POINTER(c_float)), ('texel_count', c_size_t),
                ('texture', c_uint)]


class CMovingMesh(Structure):
    _fields_ = [('positions', POINTER(c_float)), ('position_count', c_size_t), ('triangles', POINTER(c_uint)),
                ('triangle_count', c_size_t), ('albedo', POINTER(c_float)), ('albedo_count', c_size_t),
                ('emission', POINTER(c_float)), ('emission_count', c_size_t)]


class MovingPart(Structure):
    _fields_ = [('shape', c_uint), ('to_world', c_float * 12)]


class LightSetup(Structure):
    _fields_ = [('struct_size', c_size_t), ('lights', POINTER(CLight)), ('light_count', c_size_t),
                ('visibility', Visibility), ('visibility_user', c_void_p), ('surfel_irradiance', POINTER(c_float)),
                ('surfel_emission', POINTER(c_float)), ('sky_patches', POINTER(c_float)), ('sky_radiance', c_float * 3),
                ('emission_scale', c_float * 3), ('bounce_scale', c_float),
                ('material_emissions', POINTER(MaterialEmission)), ('material_emission_count', c_size_t),
                ('moving_parts', POINTER(MovingPart)), ('moving_part_count', c_size_t), ('moving_shapes', c_void_p)]


class ResolveTextureInfo(Structure):
    _fields_ = [('struct_size', c_size_t), ('sampler', c_char_p), ('shape', c_int), ('format', c_int), ('width', c_uint),
                ('height', c_uint), ('depth', c_uint), ('filtered', c_int), ('light', c_int), ('bytes', c_size_t)]


class LiveSurface(Structure):
    _fields_ = [('albedo', c_float * 3), ('emission', c_float * 3), ('coverage', c_float), ('double_sided', c_int)]


class LiveMesh(Structure):
    _fields_ = [('positions', POINTER(c_float)), ('position_count', c_size_t), ('triangles', POINTER(c_uint)),
                ('triangle_count', c_size_t), ('surfaces', POINTER(c_uint))]


class LivePart(Structure):
    _fields_ = [('mesh', c_uint), ('to_world', c_float * 12), ('moves', c_int)]


class LiveEdit(Structure):
    _fields_ = [('part', c_uint), ('to_world', c_float * 12), ('present', c_int)]


class LiveDesc(Structure):
    _fields_ = [('struct_size', c_size_t), ('backend', c_int), ('surfaces', POINTER(LiveSurface)), ('surface_count', c_size_t),
                ('meshes', POINTER(LiveMesh)), ('mesh_count', c_size_t), ('parts', POINTER(LivePart)), ('part_count', c_size_t),
                ('box_min', c_float * 3), ('box_max', c_float * 3), ('cells', c_uint), ('rays_per_cell', c_uint),
                ('surface_budget', c_uint), ('visibility_glsl', c_char_p), ('get_proc_address', c_void_p),
                ('get_proc_address_user', c_void_p), ('cascades', c_uint), ('box_follows_eye', c_int),
                ('eye', POINTER(c_float))]


class LiveFrame(Structure):
    _fields_ = [('struct_size', c_size_t), ('emission_scale', c_float * 3), ('bounce_scale', c_float), ('keep', c_float),
                ('sky_radiance', c_float * 3), ('sky_map', POINTER(c_float)), ('sky_side', c_uint), ('ray_set', c_uint),
                ('freeze_voxels', c_int)]


class LiveInfo(Info):
    _fields_ = [('struct_size', c_size_t), ('voxels', c_uint), ('dropped_voxels', c_uint), ('caches', c_uint)]


class EditBox(Structure):
    _fields_ = [('min', c_float * 3), ('max', c_float * 3)]


class EditBlendDesc(Structure):
    _fields_ = [('struct_size', c_size_t), ('boxes', POINTER(EditBox)), ('box_count', c_size_t), ('voxel', c_float),
                ('reach', c_float), ('fade', c_float), ('box_reaches', POINTER(c_float))]


class EditBlendInfo(Structure):
    _fields_ = [('struct_size', c_size_t), ('boxes', c_uint), ('voxel', c_float), ('values', POINTER(c_float))]


_FLOATS = POINTER(c_float)
_FUNCTIONS = {  # name: (result, arguments)
    'relume_api_version': (c_uint, []),
    'relume_version': (c_char_p, []),
    'relume_status_text': (c_char_p, [c_int]),
    'relume_context_create': (c_int, [POINTER(ContextDesc), POINTER(c_void_p)]),
    'relume_context_destroy': (None, [c_void_p]),
    'relume_context_error': (c_char_p, [c_void_p]),
    'relume_bake_load': (c_int, [c_void_p, c_char_p, POINTER(c_void_p)]),
    'relume_bake_from_memory': (c_int, [c_void_p, c_void_p, c_size_t, c_void_p, c_void_p, POINTER(c_void_p)]),
    'relume_bake_destroy': (None, [c_void_p]),
    'relume_bake_error': (c_char_p, [c_void_p]),
    'relume_bake_get_info': (c_int, [c_void_p, POINTER(BakeInfo)]),
    'relume_bake_lightmap_coordinates': (c_int, [c_void_p, c_uint, c_int, _FLOATS, POINTER(c_size_t)]),
    'relume_bake_instance_name': (c_char_p, [c_void_p, c_uint]),
    'relume_bake_drivable_count': (c_uint, [c_void_p]),
    'relume_bake_drivable_name': (c_char_p, [c_void_p, c_uint]),
    'relume_bake_surfels': (c_int, [c_void_p, c_size_t, c_size_t, _FLOATS, _FLOATS]),
    'relume_bake_sky_directions': (c_int, [c_void_p, _FLOATS]),
    'relume_relighter_create': (c_int, [c_void_p, POINTER(RelighterDesc), POINTER(c_void_p)]),
    'relume_relighter_destroy': (None, [c_void_p]),
    'relume_relighter_error': (c_char_p, [c_void_p]),
    'relume_light_setup_default': (None, [POINTER(LightSetup), c_size_t]),
    'relume_relight': (c_int, [c_void_p, POINTER(LightSetup)]),
    'relume_reset': (c_int, [c_void_p]),
    'relume_inherit': (c_int, [c_void_p, c_void_p, c_void_p]),
    'relume_irradiance_on_lightmap': (c_int, [c_void_p, c_size_t, _FLOATS, _FLOATS, _FLOATS, _FLOATS]),
    'relume_irradiance_in_grid': (c_int, [c_void_p, c_size_t, _FLOATS, _FLOATS, _FLOATS]),
    'relume_glossy_on_lightmap': (c_int, [c_void_p, c_size_t, _FLOATS, _FLOATS, _FLOATS, _FLOATS]),
    'relume_glossy_in_grid': (c_int, [c_void_p, c_size_t, _FLOATS, _FLOATS, _FLOATS, _FLOATS, _FLOATS]),
    'relume_irradiance_map': (c_int, [c_void_p, c_void_p, c_size_t]),
    'relume_irradiance_map_l1': (c_int, [c_void_p, c_void_p, c_size_t]),
    'relume_ambient_volume': (c_int, [c_void_p, _FLOATS, _FLOATS, POINTER(c_uint), _FLOATS, c_size_t]),
    'relume_resolve_texture_count': (c_int, [c_void_p, POINTER(c_uint)]),
    'relume_resolve_texture_get_info': (c_int, [c_void_p, c_uint, POINTER(ResolveTextureInfo)]),
    'relume_resolve_texture_write': (c_int, [c_void_p, c_uint, c_void_p, c_size_t]),
    'relume_resolve_uniforms': (c_int, [c_void_p, _FLOATS]),
    'relume_resolve_glsl': (c_int, [c_void_p, c_char_p, c_size_t, POINTER(c_size_t)]),
    'relume_coefficients_per_cache': (c_uint, [c_void_p]),
    'relume_cache_coefficients': (c_int, [c_void_p, _FLOATS, c_size_t]),
    'relume_moving_shapes_create': (c_int, [c_void_p, POINTER(CMovingMesh), c_size_t, POINTER(c_void_p)]),
    'relume_moving_shapes_destroy': (None, [c_void_p]),
    'relume_live_create': (c_int, [c_void_p, POINTER(LiveDesc), POINTER(c_void_p)]),
    'relume_live_destroy': (None, [c_void_p]),
    'relume_live_error': (c_char_p, [c_void_p]),
    'relume_live_move': (c_int, [c_void_p, _FLOATS, c_size_t]),
    'relume_live_edit_parts': (c_int, [c_void_p, POINTER(LiveEdit), c_size_t]),
    'relume_live_centre': (c_int, [c_void_p, _FLOATS, POINTER(c_int)]),
    'relume_live_frame_default': (None, [POINTER(LiveFrame), c_size_t]),
    'relume_live_update': (c_int, [c_void_p, POINTER(LightSetup), POINTER(LiveFrame)]),
    'relume_live_reset': (c_int, [c_void_p]),
    'relume_live_irradiance': (c_int, [c_void_p, c_size_t, _FLOATS, _FLOATS, _FLOATS]),
    'relume_live_get_info': (c_int, [c_void_p, POINTER(LiveInfo)]),
    'relume_edit_blend_create': (c_int, [c_void_p, POINTER(EditBlendDesc), POINTER(c_void_p)]),
    'relume_edit_blend_destroy': (None, [c_void_p]),
    'relume_edit_blend_error': (c_char_p, [c_void_p]),
    'relume_edit_blend_share': (c_int, [c_void_p, c_size_t, _FLOATS, _FLOATS]),
    'relume_edit_blend_irradiance': (c_int, [c_void_p, c_size_t, _FLOATS, _FLOATS, _FLOATS, _FLOATS, _FLOATS]),
    'relume_edit_blend_glsl': (c_char_p, [c_void_p]),
    'relume_edit_blend_get_info': (c_int, [c_void_p, POINTER(EditBlendInfo)]),
}


def _path():
    """RELUME_LIBRARY in the environment, else the library in this package, else the one that the loader finds."""
    named = os.environ.get('RELUME_LIBRARY')
    here = os.path.dirname(os.path.abspath(__file__))
    packaged = sorted(glob.glob(os.path.join(here, 'librelume.*')) + glob.glob(os.path.join(here, 'relume.dll')))
    return named or (packaged[0] if packaged else ctypes.util.find_library('relume') or 'librelume.so')


def _load():
    path = _path()
    try:
        library = ctypes.CDLL(path)
    except OSError as error:
        raise ImportError(f'{error}; install Relume\'s runtime, or name librelume in the environment variable '
                          'RELUME_LIBRARY') from error
    try:
        library.relume_api_version.restype = c_uint
        version = library.relume_api_version()
        if version != API_VERSION:
            raise ImportError(f'{path} has API version {version}, expected {API_VERSION}')
        for name, (result, arguments) in _FUNCTIONS.items():
            function = getattr(library, name)
            function.restype, function.argtypes = result, arguments
    except AttributeError as error:
        raise ImportError(f'{path} is no librelume, or an older one: {error}') from error
    return library


runtime = _load()
