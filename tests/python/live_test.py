#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""bindings/python against librelume, without a bake: light of two rooms whose wall is taken away, and how an edit is blended.

    live_test.py      with RELUME_LIBRARY and PYTHONPATH in the environment
"""
import unittest

import numpy

import relume

LAMP = relume.Light.point((1.5, 2.2, 2.0), (12, 10, 8))
UP = (0.0, 1.0, 0.0)
DARK = [(6.0, 0.0, 2.0)]  # behind the wall


def box(low, high, inward=False):
    """A box of twelve triangles, seen from within or from outside."""
    corners = numpy.float32([[(low, high)[i >> axis & 1][axis] for axis in range(3)] for i in range(8)])
    faces = [(0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6)]
    triangles = numpy.array([t for a, b, c, d in faces for t in ((a, b, c), (a, c, d))])
    return relume.Mesh(corners, triangles[:, ::-1] if inward else triangles)


MESHES = [box((0, 0, 0), (8, 3, 4), inward=True), box((3.9, 0, 0), (4.1, 3, 4)), box((-0.4, -0.4, -0.4), (0.4, 0.4, 0.4))]
SURFACES = [relume.Surface((0.7, 0.6, 0.5))]


def rooms(parts=(0, 1), **options):
    return relume.LiveLight(SURFACES, MESHES, [relume.Part(mesh) for mesh in parts], **{'cells': 16, **options})


def behind_the_wall(light, positions, normals):
    return numpy.where(positions[:, 0] > 4.0, 0.0, 1.0)


class Live(unittest.TestCase):
    def test_a_wall_is_taken_away_and_comes_back(self):
        light = rooms()
        self.assertGreater(light.info.voxels, 1000)

        def lit(visibility):
            light.reset()
            for _ in range(4):
                light.update([LAMP], visibility)
            return light.irradiance(DARK, [UP])[0]

        self.assertLess(lit(behind_the_wall).max(), 1e-3)
        self.assertGreater(light.info.caches, 100)
        walls = light.info.voxels
        light.edit({1: None})
        self.assertLess(light.info.voxels, walls)
        self.assertGreater(lit(None).min(), 0.1)
        light.edit({1: numpy.eye(4)})
        self.assertEqual(light.info.voxels, walls)
        self.assertLess(lit(behind_the_wall).max(), 1e-3)

    def test_light_scales_with_the_lights_and_is_that_of_any_threads(self):
        points, normals = numpy.float32([(1, 0, 1), (5, 3, 2), (2, 0, 3)]), numpy.float32([UP, (0, -1, 0), UP])
        found = []
        for threads, scale in ((1, 1), (1, 2), (3, 1)):
            light = rooms(threads=threads)
            for _ in range(2):
                light.update([relume.Light.point(LAMP.position, tuple(scale * x for x in LAMP.intensity))])
            found.append(light.irradiance(points, normals))
        self.assertGreater(found[0].min(), 0)
        numpy.testing.assert_allclose(found[1], 2 * found[0], rtol=1e-3)
        numpy.testing.assert_array_equal(found[2], found[0])
        out = numpy.zeros_like(points)
        self.assertIs(light.irradiance(points, normals, out=out), out)

    def test_parts_move(self):
        light = relume.LiveLight([SURFACES[0], relume.Surface(emission=(5, 0, 0))],
                                 [MESHES[0], relume.Mesh(MESHES[2].positions, MESHES[2].triangles, numpy.ones(12, int))],
                                 [relume.Part(0), relume.Part(1, moves=True)], cells=16)
        points = [(1.0, 0.0, 2.0), (7.0, 0.0, 2.0)]
        for x in (1.0, 7.0):
            place = numpy.eye(4)[:3].copy()
            place[:, 3] = x, 1.5, 2.0
            light.move([place])
            light.reset()
            for _ in range(2):
                light.update()
            near, far = light.irradiance(points, [UP, UP])[::1 if x == 1.0 else -1, 0]
            self.assertGreater(near, 3 * far)
        with self.assertRaisesRegex(ValueError, '1 matrices expected, 2'):
            light.move([None, None])

    def test_sky_and_frames(self):
        light = relume.LiveLight(SURFACES, [box((0, 0, 0), (8, 0.2, 4))], [relume.Part(0)], cells=16)
        top = [(4.0, 0.2, 2.0)]
        light.update(sky_radiance=(1, 2, 3), bounce_scale=0)
        sky = light.irradiance(top, [UP])
        numpy.testing.assert_allclose(sky[0], numpy.pi * numpy.float32((1, 2, 3)), rtol=0.1)
        light.reset()
        light.update(sky_map=numpy.broadcast_to(numpy.float32((1, 2, 3)), (8, 8, 3)), bounce_scale=0, ray_set=0)
        numpy.testing.assert_allclose(light.irradiance(top, [UP]), sky, rtol=1e-4)
        light.update(keep=0.5, bounce_scale=0)
        numpy.testing.assert_allclose(light.irradiance(top, [UP]), sky / 2, rtol=1e-3)

    def test_the_eye_is_followed(self):
        light = rooms(cascades=2, eye=(1, 1, 2))
        self.assertTrue(light.centre((7, 1, 2)))
        self.assertFalse(light.centre((7, 1, 2)))

    def test_what_is_wrong_is_said(self):
        light = rooms()
        with self.assertRaisesRegex(KeyError, 'no shadow map'):
            light.update([LAMP], lambda *_: {}['no shadow map'])
        wrong = relume.Mesh([(0, 0, 0)], [(0, 0, 1)])
        for text, call in (('triangle', lambda: relume.LiveLight(SURFACES, [wrong], [relume.Part(0)])),
                           ('7 cells', lambda: rooms(cells=7)), ('part', lambda: light.edit({2: None})),
                           ('keep', lambda: light.update(keep=1.0)), ('eye', lambda: light.centre((0, float('nan'), 0)))):
            with self.assertRaisesRegex(relume.RelumeError, text) as caught:
                call()
            self.assertEqual(caught.exception.status, 1)
        for text, call in (('meshes.0..triangles', lambda: relume.LiveLight(SURFACES, [relume.Mesh([UP], [0])], [relume.Part(0)])),
                           ('whole numbers', lambda: relume.LiveLight(SURFACES, [relume.Mesh([UP], [(0, 0, -1)])], [relume.Part(0)])),
                           ('surfaces', lambda: relume.LiveLight(SURFACES, [relume.Mesh([UP], [(0, 0, 0)], [0, 0])], [])),
                           ('matrix', lambda: light.edit({1: numpy.eye(3)})), ('sky_map', lambda: light.update(sky_map=[UP])),
                           ('positions', lambda: light.irradiance(UP, UP))):
            with self.assertRaisesRegex(ValueError, text):
                call()
        light.close()
        with self.assertRaisesRegex(ValueError, 'closed'):
            light.update()


class Edits(unittest.TestCase):
    def setUp(self):
        self.blend = relume.EditBlend([[(3.9, 0, 0), (4.1, 3, 4)]], voxel=8 / 64, reach=1, fade=1)

    def test_what_is_lost_scales_and_what_is_gained_is_added(self):
        share = self.blend.share([(4.0, 1, 1), (4.8, 1, 1), (5.6, 1, 1), (7.0, 1, 1)])
        self.assertTrue((numpy.diff(share[:, 0]) <= 0).all() and share[0, 0] == 1 and 0 < share[2, 0] < 1 and not share[3].any())
        only_change = numpy.float32([(1, 0)] * 3)
        baked = numpy.float32([(1, 2, 3)] * 3)
        before, after = numpy.float32([[2], [2], [2]]) * numpy.ones((3, 3)), numpy.float32([[1], [2], [3]]) * numpy.ones((3, 3))
        numpy.testing.assert_allclose(self.blend.irradiance(only_change, baked, before, after),
                                      [baked[0] / 2, baked[0], baked[0] + 1], rtol=0.08)  # the ratio is a damped one
        numpy.testing.assert_array_equal(self.blend.irradiance([relume.EDITED_PART] * 3, baked, before, after), after)
        untouched = self.blend.irradiance(numpy.zeros((3, 2)), baked, before * numpy.nan, after * numpy.nan, out=baked)
        self.assertIs(untouched, baked)
        numpy.testing.assert_array_equal(untouched, [(1, 2, 3)] * 3)

    def test_two_lights_say_what_has_changed(self):
        before, after = rooms(), rooms()
        after.edit({1: None})
        for light in (before, after):
            for _ in range(4):
                light.update([LAMP])
        blend = relume.EditBlend([[(3.9, 0, 0), (4.1, 3, 4)]], voxel=8 / 64)
        far = numpy.float32(DARK)
        baked = numpy.full((1, 3), 0.2, numpy.float32)
        found = blend.irradiance(blend.share(far), baked, before.irradiance(far, [UP]), after.irradiance(far, [UP]))
        self.assertTrue((found > baked).all(), found)  # light of the lamp's own room comes through

    def test_shaders_have_the_same(self):
        self.assertIn('vec2 relumeEditShare(vec3 positionWorld)', self.blend.glsl())
        boxes, voxel = self.blend.uniforms()
        numpy.testing.assert_allclose(boxes, [(3.9, 0, 0, 1), (4.1, 3, 4, 1)], rtol=1e-6)
        self.assertEqual(voxel, 0.125)
        nothing = relume.EditBlend([], 0.1)
        self.assertEqual(nothing.uniforms()[0].shape, (0, 4))
        self.assertFalse(nothing.share([UP]).any())

    def test_what_is_wrong_is_said(self):
        for text, call in (('1', lambda: relume.EditBlend([[UP, UP], [UP, (0, 0, 0)]], 0.1)),
                           ('voxel', lambda: relume.EditBlend([], 0))):
            with self.assertRaisesRegex(relume.RelumeError, text):
                call()
        for text, call in (('boxes', lambda: relume.EditBlend([UP], 0.1)), ('shares', lambda: self.blend.irradiance([UP], [UP], [UP], [UP])),
                           ('one length', lambda: self.blend.irradiance([(0, 0)], [UP], [UP, UP], [UP]))):
            with self.assertRaisesRegex(ValueError, text):
                call()


if __name__ == '__main__':
    unittest.main()
