#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""bindings/python against librelume: light of a bake, arrays in place, visibility in batches, bad input, the layout of structs,
a wheel with the library inside; examples_test.py runs the examples, live_test.py and interrupts_test.py have what needs no bake.

    relume_test.py RELUME LEVEL HEADERS      with RELUME_LIBRARY and PYTHONPATH in the environment
"""
import _thread
import copy
import ctypes
import glob
import json
import os
import pickle
import shutil
import struct
import subprocess
import sys
import tempfile
import time
import unittest
import zipfile

import numpy

import relume
from relume import _arrays, _library

RELUME, LEVEL, HEADERS = sys.argv[1:]
WORK = tempfile.TemporaryDirectory()
BAKE = os.path.join(WORK.name, 'level.relume')
PACKAGE = os.path.dirname(os.path.dirname(os.path.abspath(relume.__file__)))
SUN = relume.Light.directional((0, -1, 0), (9, 8, 7))
UP = (0.0, 1.0, 0.0)
SIZES = ('--preset', 'draft', '--surfels', '8192', '--lightmap-caches', '200', '--sky-patches', '16', '--progress', 'none')


def bake_with_two_screens():
    """The level, in which floor and lattice, those with texture coordinates, are of materials named 'screen' that emit."""
    with open(LEVEL, 'rb') as file:
        data = file.read()
    length, = struct.unpack_from('<I', data, 12)
    document, rest = json.loads(data[20:20 + length]), data[20 + length:]
    for material in document['materials']:
        if material['name'] in ('parquet', 'lattice'):
            material.update(name='screen', emissiveFactor=[1, 1, 1])
    text = json.dumps(document).encode()
    text += b' ' * (-len(text) % 4)
    level, bake = (os.path.join(WORK.name, 'screens' + ending) for ending in ('.glb', '.relume'))
    with open(level, 'wb') as file:
        file.write(data[:8] + struct.pack('<III', 20 + len(text) + len(rest), len(text), 0x4E4F534A) + text + rest)
    subprocess.run([RELUME, 'bake', level, '-o', bake, *SIZES], check=True, stdout=subprocess.DEVNULL)
    return bake


class Light(unittest.TestCase):
    def setUp(self):
        self.bake = relume.Bake(BAKE)
        self.relighter = relume.Relighter(self.bake)
        self.positions, self.normals = self.bake.surfels()
        self.points = self.positions + 0.05 * self.normals

    def read(self, relighter=None):
        return (relighter or self.relighter).irradiance_in_grid(self.points, self.normals)

    def test_light_scales_with_the_lights(self):
        self.relighter.relight([SUN], bounce_scale=0, emission_scale=0)
        once = self.read()
        self.assertGreater(once.max(), 0)
        self.relighter.relight([relume.Light.directional((0, -1, 0), (18, 16, 14))], bounce_scale=0, emission_scale=0)
        numpy.testing.assert_allclose(self.read(), 2 * once, rtol=1e-4, atol=1e-6)
        self.relighter.reset()
        self.relighter.relight([], emission_scale=0)
        self.assertEqual(self.read().max(), 0)

    def test_threads_give_the_same_light(self):
        with relume.Bake(BAKE, threads=3) as bake:
            relighter = relume.Relighter(bake)
            for _ in range(3):
                self.relighter.relight([SUN], sky_radiance=(1, 2, 3))
                relighter.relight([SUN], sky_radiance=(1, 2, 3))
            numpy.testing.assert_array_equal(self.read(relighter), self.read())
        relighter.relight([SUN], materials={name: 0 for name in self.bake.drivable_materials()})  # a closed bake's relighters stay
        with self.assertRaisesRegex(ValueError, 'this Bake is closed'):
            relighter.inherit(self.relighter)

    def test_an_interrupt_waits_for_the_threads(self):
        bake = relume.Bake(BAKE, threads=2)
        relighter = relume.Relighter(bake)
        started, ended = [], []

        def slow(light, positions, normals):
            try:
                started.append(light)
                if len(started) == 1:
                    _thread.interrupt_main()
                time.sleep(0.05)
                return numpy.ones(len(positions))
            finally:
                ended.append(light)

        with self.assertRaises(KeyboardInterrupt):
            relighter.relight([SUN], slow)
            time.sleep(0.1)  # where it comes after the call
        self.assertEqual(len(started), len(ended))
        relighter.relight([SUN])
        self.assertGreater(self.read(relighter).max(), 0)

    def test_visibility_may_call_other_relighters(self):
        # A task has 4096 surfels: with more, both threads are in `visible` before they call.
        for call in ('irradiance_map()', 'ambient_volume(UP, UP, (4, 4, 4))', 'irradiance_in_grid(points, points)', 'relight()'):
            script = ('import itertools, numpy, relume, threading\nUP = (0, 1, 0)\npoints, calls = 5000 * [UP], itertools.count()\n'
                      f'bake, both = relume.Bake({BAKE!r}, threads=2), threading.Barrier(2)\ndef visible(light, p, n):\n'
                      f'  if next(calls) < 2: both.wait()\n  relume.Relighter(bake).{call}\n  return numpy.ones(len(p))\n'
                      'relume.Relighter(bake).relight([relume.Light.directional((0, -1, 0), (1, 1, 1))], visible)')
            subprocess.run([sys.executable, '-c', script], check=True, timeout=60)  # else it waits for ever for threads

    def test_bytes_are_the_file(self):
        self.relighter.relight([SUN])
        with open(BAKE, 'rb') as file:
            data = file.read()
        odd = memoryview(b'x' + data)[1:]
        for source in (data, bytearray(data), odd, numpy.frombuffer(data, numpy.uint8)):
            relighter = relume.Relighter(relume.Bake(source))
            relighter.relight([SUN])
            numpy.testing.assert_array_equal(self.read(relighter), self.read())

    def test_arrays_are_used_in_place(self):
        self.assertIs(_arrays.floats('p', self.points, 3), self.points)
        out = numpy.zeros_like(self.points)
        self.relighter.relight([SUN])
        self.assertIs(self.relighter.irradiance_in_grid(self.points, self.normals, out=out), out)
        numpy.testing.assert_array_equal(out, self.read())
        numpy.testing.assert_array_equal(self.relighter.irradiance_in_grid(self.points.tolist(), self.normals.tolist()), out)
        numpy.testing.assert_array_equal(
            self.relighter.irradiance_in_grid(self.points.astype(float)[::2], numpy.asfortranarray(self.normals)[::2]), out[::2])

    def test_visibility_comes_in_batches_of_views(self):
        asked = {0: 0, 1: 0}

        def visible(light, positions, normals):
            self.assertEqual(positions.shape, normals.shape)
            self.assertLessEqual(len(positions), 256)
            self.assertFalse(positions.flags.writeable or positions.flags.owndata)
            self.assertTrue((normals[:, 1] > 0).all())  # both lights come from above
            asked[light] += len(positions)
            return numpy.where(positions[:, 0] > middle, 1.0, 0.0)

        middle = float(numpy.median(self.positions[:, 0]))
        self.relighter.relight([SUN, SUN], visible, bounce_scale=0, emission_scale=0)
        facing = int((self.normals[:, 1] > 0).sum())
        self.assertEqual(asked[0], asked[1])
        self.assertTrue(0 < asked[0] <= facing)
        some = self.read()
        self.relighter.relight([SUN, SUN], lambda light, p, n: numpy.zeros(len(p)), bounce_scale=0, emission_scale=0)
        self.assertEqual(self.read().max(), 0)
        self.relighter.relight([SUN, SUN], bounce_scale=0, emission_scale=0)
        self.assertGreater(self.read().sum(), some.sum())

    def test_exceptions_come_through(self):
        def broken(light, positions, normals):
            raise KeyError('no shadow map')
        for error, words, visible in ((KeyError, 'no shadow map', broken), (ValueError, '', lambda _, p, n: numpy.ones(len(p) + 1)),
                                      (RuntimeError, 'cannot be closed', lambda *_: self.relighter.close())):
            with self.assertRaisesRegex(error, words):
                self.relighter.relight([SUN], visible)

    def test_own_irradiance_emission_and_sky(self):
        self.relighter.relight(surfel_irradiance=numpy.full((len(self.positions), 3), 2.0), bounce_scale=0, emission_scale=0)
        self.assertGreater(self.read().max(), 0)
        self.relighter.relight(surfel_emission=numpy.full((len(self.positions), 3), 2.0), bounce_scale=0)
        self.assertGreater(self.read().max(), 0)
        directions = self.bake.sky_directions()
        numpy.testing.assert_allclose(numpy.linalg.norm(directions, axis=1), 1, rtol=1e-4)
        if len(directions):
            self.relighter.relight(sky_radiance=2, bounce_scale=0, emission_scale=0)
            constant = self.read()
            self.relighter.relight(sky_patches=numpy.full((len(directions), 3), 2.0), bounce_scale=0, emission_scale=0)
            numpy.testing.assert_allclose(self.read(), constant, rtol=1e-4, atol=1e-6)

    def test_plain_results_are_the_look_ups(self):
        self.relighter.relight([SUN])
        info = self.bake.info
        origin, spacing = numpy.array(info.grid_origin), numpy.array(info.grid_spacing)
        volume = self.relighter.ambient_volume(origin, spacing, (2, 1, 2))
        self.assertEqual(volume.shape, (2, 1, 2, 6, 3))
        axes = numpy.concatenate([[d, -d] for d in numpy.eye(3, dtype=numpy.float32)])
        at = origin + spacing * (1, 0, 0)
        numpy.testing.assert_allclose(self.relighter.irradiance_in_grid(numpy.tile(at, (6, 1)), axes), volume[0, 0, 1],
                                      rtol=1e-5, atol=1e-7)
        texels = self.relighter.irradiance_map()
        self.assertEqual(texels.shape, (info.lightmap_height, info.lightmap_width, 4))
        self.assertEqual(texels.dtype, numpy.float16)
        self.assertTrue(numpy.isin(texels[..., 3], (0, 1)).all() and texels[..., 3].any())
        self.assertEqual(self.relighter.irradiance_map_l1().shape, (4, *texels.shape))
        self.assertEqual(len(self.relighter.cache_coefficients()), info.caches)

    def test_probes_of_nine_coefficients(self):
        """docs/guide/engines.md: irradiance at 18 normals as a polynomial, and in Unity's order."""
        self.relighter.relight([SUN], sky_radiance=(1, 2, 3))
        info = self.bake.info
        at = numpy.array(info.grid_origin) + 1.5 * numpy.array(info.grid_spacing)

        def look_up(normals):
            return self.relighter.irradiance_in_grid(numpy.tile(at, (len(normals), 1)), normals)

        axes = numpy.eye(3)
        pairs = [(0, 1), (1, 2), (0, 2)]
        edges = numpy.array([(axes[a] + sign * axes[b]) / 2 ** 0.5 for a, b in pairs for sign in (1, -1)])
        front, back = look_up(numpy.concatenate([axes, edges])), look_up(-numpy.concatenate([axes, edges]))
        even, odd = (front + back) / 2, (front - back) / 2
        s, q = even[:3], [(even[3 + 2 * k] - even[4 + 2 * k]) / 2 for k in range(3)]
        unity = numpy.array([s.sum(0) / 3, odd[1], odd[2], odd[0], 2 * q[0], 2 * q[1], (2 * s[2] - s[0] - s[1]) / 6, 2 * q[2],
                             (s[0] - s[1]) / 2])
        normals = numpy.random.default_rng(1).normal(size=(300, 3))
        normals /= numpy.linalg.norm(normals, axis=1)[:, None]
        x, y, z = normals.T
        terms = numpy.stack([x ** 0, y, z, x, x * y, y * z, 3 * z * z - 1, x * z, x * x - y * y], axis=1)
        found, expected = terms @ unity, look_up(normals)
        self.assertGreater(expected.mean(), 0)
        # Weights of caches depend on the normal a little: receivers are not quite a polynomial.
        self.assertLess(numpy.sqrt(((found - expected) ** 2).mean()), 0.05 * expected.mean())

    def test_textures_to_resolve_with(self):
        self.relighter.relight([SUN])
        textures = {t.sampler: (i, t) for i, t in enumerate(self.relighter.resolve_textures())}
        index, texture = textures['relumeLightmap']
        info = self.bake.info
        self.assertEqual((texture.shape, texture.filtered, texture.light), ('array', True, True))
        self.assertEqual(texture.size[1:], (info.lightmap_height, info.lightmap_width, 4))
        layers = self.relighter.resolve_texture(index)
        self.assertEqual((layers.shape, layers.dtype), (texture.size, texture.dtype))
        # The last layer is of the caches' normals; Y's first coefficient is light, wherever one is.
        held = layers[-1, ..., 3] == 1
        self.assertTrue(numpy.array_equal(held, self.relighter.irradiance_map()[..., 3] == 1))
        self.assertTrue((layers[0, ..., 0][held] > 0).any() and not layers[:, ~held].any())
        words, described = textures['relumeGridWords']
        self.assertEqual((described.dtype, described.light), (numpy.uint8, False))
        self.assertTrue(self.relighter.resolve_texture(words).any())
        grid = self.relighter.resolve_uniforms()
        numpy.testing.assert_array_equal(grid[0, :3], numpy.array(info.grid_origin, numpy.float32))
        self.assertIn('vec3 relumeIrradianceGrid(vec3 positionWorld, vec3 n)', self.relighter.resolve_glsl())
        with self.assertRaisesRegex(ValueError, 'float16'):
            self.relighter.resolve_texture(index, numpy.zeros(texture.size, numpy.float32))

    def test_the_light_map_and_its_coordinates(self):
        self.relighter.relight([SUN])
        names = self.bake.instance_names()
        self.assertTrue(len(names) == self.bake.info.instances and all(names))
        uvs = numpy.concatenate([self.bake.lightmap_coordinates(i) for i in range(len(names))])
        uvs = uvs[uvs[:, 0] >= 0]
        self.assertTrue(len(uvs) and uvs.max() <= 1)
        normals = numpy.tile(numpy.float32(UP), (len(uvs), 1))
        light = self.relighter.irradiance_on_lightmap(uvs, normals)
        numpy.testing.assert_array_equal(self.relighter.irradiance_on_lightmap(uvs, normals, normals), light)
        self.assertGreater(light.max(), 0)
        glossy = self.relighter.glossy_on_lightmap(uvs, normals, numpy.full(len(uvs), 4.0))
        self.assertTrue(glossy.shape == light.shape and glossy.max() > 0)
        in_grid = self.relighter.glossy_in_grid(self.points, self.normals, self.normals, numpy.full(len(self.points), 4.0))
        self.assertTrue(numpy.isfinite(in_grid).all() and in_grid.max() > 0)

    def test_hot_reload_keeps_the_light(self):
        for _ in range(8):
            self.relighter.relight([SUN])
        kept, fresh = (relume.Relighter(relume.Bake(BAKE)) for _ in range(2))
        kept.inherit(self.relighter)
        for relighter in (kept, fresh, self.relighter):
            relighter.relight([SUN])
        error = [numpy.abs(self.read(r) - self.read()).sum() / self.read().sum() for r in (kept, fresh)]
        self.assertLess(error[0], 0.2 * error[1])

    def test_driven_materials(self):
        names = self.bake.drivable_materials()
        with self.assertRaisesRegex(ValueError, '"no such" cannot be driven'):
            self.relighter.relight(materials={'no such': (1, 1, 1)})
        for name in names[:1]:
            self.relighter.relight(materials={name: (3, 0, 0)}, bounce_scale=0, emission_scale=0)
            self.assertGreater(self.read()[:, 0].max(), 0)
            with self.assertRaisesRegex(ValueError, r'declare its image in Relighter\(images=\), \(2, 2, 3\) found'):
                self.relighter.relight(materials={name: numpy.ones((2, 2, 3))})

    def test_materials_of_one_name_are_driven_together(self):
        bake = relume.Bake(bake_with_two_screens())
        self.assertEqual(bake.drivable_materials(), ['panel', 'screen', 'screen'])
        relighter = relume.Relighter(bake, images={'screen': (2, 4)})
        dark = numpy.zeros((2, 4, 3))
        for value, lit in ((1, True), (0, False), (dark, True), (dark + 1, True)):  # the image goes to the first alone
            relighter.reset()
            relighter.relight(materials={'panel': 0, 'screen': value}, bounce_scale=0)
            self.assertEqual(bool(relighter.irradiance_map()[..., :3].any()), lit)
        with self.assertRaisesRegex(ValueError, r'an image of shape \(2, 4, 3\) was declared, \(4, 2, 3\) found'):
            relighter.relight(materials={'screen': numpy.ones((4, 2, 3))})


class Moving(unittest.TestCase):
    """A box over the floor of the living room."""
    AT = numpy.float32([(1, 0, 0, 2.5), (0, 1, 0, 0.8), (0, 0, 1, 3.0)])

    @staticmethod
    def box(albedo):
        corners = [(x, y, z) for z in (-0.4, 0.4) for y in (-0.4, 0.4) for x in (-0.4, 0.4)]
        faces = [(0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6)]
        return relume.MovingMesh(corners, [t for a, b, c, d in faces for t in ((a, b, c), (a, c, d))], albedo)

    def test_a_box_hides_light_and_throws_its_colour(self):
        bake = relume.Bake(BAKE)
        with relume.MovingShapes([self.box((0, 0, 0)), self.box([(0.9, 0, 0)] * 12)]) as shapes:
            found = []
            for parts in ((), [(0, self.AT)], [(1, self.AT)]):
                relighter = relume.Relighter(bake, moving_parts=1, moving_lag=1)
                relighter.relight([SUN], bounce_scale=0, moving_shapes=shapes, moving_parts=parts)
                found.append(relighter.irradiance_map()[..., :3].astype(float))
        plain = relume.Relighter(bake)
        plain.relight([SUN], bounce_scale=0)
        without, black, red = found
        self.assertLess((black - without).min(), -0.3)
        self.assertLess((black - without).max(), 1e-3)
        thrown = red - black
        self.assertGreater(thrown[..., 0].max(), 0.3)
        self.assertLess(numpy.abs(thrown[..., 1:]).max(), 2e-3)
        numpy.testing.assert_array_equal(without, plain.irradiance_map()[..., :3])

    def test_what_is_wrong_is_said(self):
        bake, parts = relume.Bake(BAKE), [(0, self.AT)]
        relighter, shapes = relume.Relighter(bake, moving_parts=1), relume.MovingShapes([self.box((1, 1, 1))])
        for text, call in (
                ('without movingShapes', lambda: relighter.relight(moving_parts=parts)),
                ('expected at most 1', lambda: relighter.relight(moving_shapes=shapes, moving_parts=2 * parts)),
                ('shape is 1', lambda: relighter.relight(moving_shapes=shapes, moving_parts=[(1, None)])),
                ('movingParts is 257', lambda: relume.Relighter(bake, moving_parts=257)),
                ('cannot be closed', lambda: relighter.relight([SUN], lambda *_: shapes.close(), moving_shapes=shapes)),
                ('triangle', lambda: relume.MovingShapes([relume.MovingMesh([UP], [(0, 0, 1)])])),
                ('albedo', lambda: relume.MovingShapes([relume.MovingMesh([UP], [(0, 0, 0)], albedo=2 * [UP])]))):
            with self.assertRaisesRegex((relume.RelumeError, RuntimeError), text):
                call()
        with self.assertRaisesRegex(ValueError, r'moving_parts\[0\]: a matrix'):
            relighter.relight(moving_shapes=shapes, moving_parts=[(0, numpy.eye(2))])
        shapes.close()
        with self.assertRaisesRegex(ValueError, 'closed'):
            relighter.relight(moving_shapes=shapes, moving_parts=parts)


class BadInput(unittest.TestCase):
    def test_files(self):
        with self.assertRaisesRegex(ValueError, 'null bytes'):
            relume.Bake('level.relume\0.other')
        with self.assertRaisesRegex(relume.RelumeError, '/no/such.relume') as caught:
            relume.Bake('/no/such.relume')
        self.assertEqual(caught.exception.status, 2)
        for data in (b'', b'RELUME', bytes(64)):
            with self.assertRaises(relume.RelumeError) as caught:
                relume.Bake(data)
            self.assertEqual(caught.exception.status, 3)
        with self.assertRaisesRegex(relume.RelumeError, r'/no/\\xff.relume'):
            relume.Bake(os.fsdecode(b'/no/\xff.relume'))
        for threads in (0, 2.0):
            with self.assertRaises(ValueError):
                relume.Bake(BAKE, threads=threads)

    def test_shapes_and_numbers(self):
        bake = relume.Bake(BAKE)
        relighter = relume.Relighter(bake)
        for call in (lambda: relighter.irradiance_in_grid([1, 2, 3], [UP]), lambda: relighter.irradiance_in_grid([UP], [UP, UP]),
                     lambda: relighter.irradiance_on_lightmap([UP], [UP]),
                     lambda: relighter.irradiance_in_grid([UP], [UP], out=numpy.zeros((1, 3))),
                     lambda: relighter.irradiance_in_grid([UP], [UP], out=numpy.zeros((2, 3), numpy.float32)),
                     lambda: relighter.relight(surfel_irradiance=[UP]), lambda: relighter.relight(sky_radiance=(1, 2)),
                     lambda: relighter.ambient_volume(UP, UP, (0, 1, 1)), lambda: relighter.ambient_volume(UP, UP, (1.9, 1, 1))):
            self.assertRaises(ValueError, call)
        for lights in ([relume.Light.point((0, 0, 0), (float('nan'), 0, 0))], [relume.Light.directional((0, -2, 0), (1, 1, 1))]):
            with self.assertRaises(relume.RelumeError) as caught:
                relighter.relight(lights)
            self.assertEqual(caught.exception.status, 1)
        with self.assertRaises(relume.RelumeError):
            bake.lightmap_coordinates(bake.info.instances)
        for name, call in (('instance', bake.lightmap_coordinates), ('index', relighter.resolve_texture),
                           ('luma_bands', lambda n: relume.Relighter(bake, luma_bands=n)),
                           ('moving_parts', lambda n: relume.Relighter(bake, moving_parts=n)),
                           (r'moving_parts\[0\]', lambda n: relighter.relight(moving_parts=[(n, None)])),
                           ('kind', lambda n: relighter.relight([relume.Light(n, 1)]))):
            for number in (-1, 2 ** 32, 0.5):
                with self.assertRaisesRegex(ValueError, f'{name}: a whole number from 0 to .* expected, {number} found'):
                    call(number)
        for text, call in (('a sequence of them expected', lambda: relighter.relight(SUN)),
                           (r'lights\[1\]: a Light expected, tuple', lambda: relighter.relight([SUN, (1, 2, 3)])),
                           ('visibility returned None', lambda: relighter.relight([SUN], lambda light, p, n: None)),
                           ('a Bake expected, str', lambda: relume.Relighter(BAKE)),
                           ('previous: a Relighter expected, Bake', lambda: relighter.inherit(bake)),
                           ('moving_shapes: a MovingShapes expected, Bake', lambda: relighter.relight(moving_shapes=bake)),
                           ('this Bake cannot be copied', lambda: copy.copy(bake)),
                           ('this Relighter cannot be copied or pickled', lambda: pickle.dumps(relighter))):
            with self.assertRaisesRegex(TypeError, text):
                call()
        with self.assertRaisesRegex(relume.RelumeError, 'lumaBands is 9'):
            relume.Relighter(bake, luma_bands=9)
        relighter.close()
        relighter.close()
        with self.assertRaisesRegex(ValueError, 'closed'):
            relighter.relight([])

    def test_errors_cross_processes(self):
        error = pickle.loads(pickle.dumps(relume.RelumeError(2, 'no such file')))
        self.assertEqual((type(error), error.status, str(error)), (relume.RelumeError, 2, 'no such file'))

    def test_lights_are_compared_by_value(self):
        lights = [relume.Light.point(numpy.array(UP), numpy.full(3, i)) for i in range(2)]
        self.assertEqual(lights.index(relume.Light.point(UP, (1, 1, 1))), 1)
        self.assertNotEqual(lights[0], lights[1])
        self.assertNotEqual(lights[0], None)
        meshes = [relume.Mesh(numpy.zeros((3, 3)), [(0, 1, 2)]), relume.Mesh(numpy.ones((3, 3)), [(0, 1, 2)])]
        self.assertEqual(meshes.index(meshes[1]), 1)


class Package(unittest.TestCase):
    def test_what_is_public_says_its_types(self):
        for name in relume.__all__:
            made = getattr(relume, name)
            for method, function in vars(made).items() if isinstance(made, type) else ():
                function = getattr(function, '__func__', getattr(function, 'fget', None) or function)
                if callable(function) and not method.startswith('_') and not isinstance(function, type):
                    self.assertIn('return', getattr(function, '__annotations__', {}), f'{name}.{method}')
        bake = relume.Bake(BAKE)
        self.assertRegex(repr(bake.info), r'BakeInfo\(surfels=8192, .*grid_origin=\[.*scene_hash=b')

    def test_structs_are_those_of_the_header(self):
        compiler = shutil.which('cc')
        if not compiler:
            self.skipTest('no C compiler')
        structs = {'relume_context_desc': _library.ContextDesc, 'relume_bake_info': _library.BakeInfo,
                   'relume_driven_image': _library.DrivenImage, 'relume_relighter_desc': _library.RelighterDesc,
                   'relume_light': _library.CLight, 'relume_material_emission': _library.MaterialEmission,
                   'relume_light_setup': _library.LightSetup, 'relume_moving_mesh': _library.CMovingMesh,
                   'relume_moving_part': _library.MovingPart, 'relume_live_surface': _library.LiveSurface,
                   'relume_live_mesh': _library.LiveMesh, 'relume_live_part': _library.LivePart,
                   'relume_live_edit': _library.LiveEdit, 'relume_live_desc': _library.LiveDesc,
                   'relume_live_frame': _library.LiveFrame, 'relume_live_info': _library.LiveInfo,
                   'relume_edit_box': _library.EditBox, 'relume_edit_blend_desc': _library.EditBlendDesc,
                   'relume_edit_blend_info': _library.EditBlendInfo}
        fields = [(c, name, getattr(python, name)) for c, python in structs.items() for name, *_ in python._fields_]
        with tempfile.TemporaryDirectory() as folder:
            source, program = os.path.join(folder, 'fields.c'), os.path.join(folder, 'fields')
            with open(source, 'w', encoding='utf8') as file:
                lines = ''.join(f'printf("%d %d\\n", (int)offsetof({c}, {f}), (int)sizeof((({c}*)0)->{f}));' for c, f, _ in fields)
                file.write(f'#include <relume/relume.h>\n#include <stdio.h>\nint main(void) {{{lines} return 0;}}')
            subprocess.run([compiler, '-I', HEADERS, source, '-o', program], check=True)
            found = subprocess.run([program], capture_output=True, text=True, check=True).stdout.split('\n')
        for (c, name, field), line in zip(fields, found):
            self.assertEqual(f'{field.offset} {field.size}', line, f'{c}.{name}')

    def test_a_library_that_is_none_is_named(self):
        for path in ('/no/librelume.so', ctypes.util.find_library('m') or 'libm.so.6'):
            done = subprocess.run([sys.executable, '-c', 'import relume'], env={**os.environ, 'RELUME_LIBRARY': path},
                                  capture_output=True, text=True, check=False)
            self.assertNotEqual(done.returncode, 0)
            self.assertIn('ImportError', done.stderr)
            self.assertIn(os.path.basename(path), done.stderr)

    def test_a_wheel_brings_the_library(self):
        try:
            import setuptools  # pylint: disable=unused-import,import-outside-toplevel
            import wheel  # pylint: disable=unused-import,import-outside-toplevel
        except ImportError as error:
            self.skipTest(str(error))
        with tempfile.TemporaryDirectory() as folder:
            project, place = os.path.join(folder, 'sources/bindings/python'), os.path.join(folder, 'place')
            os.makedirs(os.path.join(folder, 'sources/runtime'))
            for licence in ('LICENSE', 'runtime/LICENSE.third-party'):
                shutil.copy(os.path.join(PACKAGE, '../..', licence), os.path.join(folder, 'sources', licence))
            shutil.copytree(PACKAGE, project, ignore=shutil.ignore_patterns('__pycache__', 'build', '*.egg-info'))
            older = shutil.copy(os.environ['RELUME_LIBRARY'], os.path.join(folder, 'librelume.so.0.0.1'))
            for bundle in ('', older, os.environ['RELUME_LIBRARY']):  # the last is built where the one before has been
                build = f'from setuptools import build_meta; build_meta.build_wheel({folder!r})'
                environment = {k: v for k, v in os.environ.items() if k != 'PYTHONPATH'}
                done = subprocess.run([sys.executable, '-c', build], cwd=project, env={**environment, 'RELUME_BUNDLE': bundle},
                                      capture_output=True, text=True, check=False)
                self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
            wheels = sorted(glob.glob(os.path.join(folder, '*.whl')))
            names = [os.path.basename(w) for w in wheels]
            self.assertEqual(len(names), 2, names)
            self.assertTrue(names[1].endswith('-none-any.whl'), names)
            for wheel_file, files in zip(wheels, ({'py.typed', 'LICENSE', 'LICENSE.third-party'}, {'py.typed', 'LICENSE'})):
                with zipfile.ZipFile(wheel_file) as archive:
                    self.assertLessEqual({f'relume/{name}' for name in files}, set(archive.namelist()))
                    libraries = [name for name in archive.namelist() if 'librelume' in name]
                    self.assertEqual(len(libraries), 'LICENSE.third-party' in files, libraries)
                    self.assertNotIn('relume/librelume.so.0.0.1', libraries)
            with zipfile.ZipFile(wheels[0]) as archive:
                archive.extractall(place)
            light = (f'import relume; r = relume.Relighter(relume.Bake({BAKE!r})); '
                     'r.relight([relume.Light.directional((0, -1, 0), (9, 8, 7))]); print(r.irradiance_map().max())')
            environment.pop('RELUME_LIBRARY')
            done = subprocess.run([sys.executable, '-c', light], env={**environment, 'PYTHONPATH': place}, capture_output=True,
                                  text=True, check=False)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertGreater(float(done.stdout), 0)


if __name__ == '__main__':
    subprocess.run([RELUME, 'bake', LEVEL, '-o', BAKE, *SIZES], check=True, stdout=subprocess.DEVNULL)
    unittest.main(argv=sys.argv[:1])
