#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""bindings/python against librelume, without a bake: light of two rooms whose wall is taken away, how an edit is blended, and what
signals, threads and forks do to frames.

    live_test.py      with RELUME_LIBRARY and PYTHONPATH in the environment
"""
import gc
import os
import random
import signal
import threading
import time
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
        light.edit({1: numpy.diag((1, 1, 1, 1 + 1e-6))})  # rounded
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
        rows = numpy.eye(4)  # a matrix for rows, its place in the last
        rows[3, :3] = 4, 1.5, -1
        for text, call in (('triangle', lambda: relume.LiveLight(SURFACES, [wrong], [relume.Part(0)])),
                           ('7 cells', lambda: rooms(cells=7)), ('part', lambda: light.edit({2: None})),
                           ('keep', lambda: light.update(keep=1.0)), ('eye', lambda: light.centre((0, float('nan'), 0)))):
            with self.assertRaisesRegex(relume.RelumeError, text) as caught:
                call()
            self.assertEqual(caught.exception.status, 1)
        for text, call in (('meshes.0..triangles', lambda: relume.LiveLight(SURFACES, [relume.Mesh([UP], [0])], [relume.Part(0)])),
                           ('whole numbers', lambda: relume.LiveLight(SURFACES, [relume.Mesh([UP], [(0, 0, -1)])], [relume.Part(0)])),
                           ('surfaces', lambda: relume.LiveLight(SURFACES, [relume.Mesh([UP], [(0, 0, 0)], [0, 0])], [])),
                           ('parts: a whole number', lambda: light.edit({2 ** 32: None})),
                           (r'parts\[0\].mesh: a whole', lambda: rooms(parts=[-1])),
                           ('ray_set: a whole number', lambda: light.update(ray_set=2 ** 32)),
                           ('matrix', lambda: light.edit({1: numpy.eye(3)})),
                           (r'parts\[1\]: .*last row .* \(4.0, 1.5, -1.0, 1.0\) found; transpose', lambda: light.edit({1: rows})),
                           ('last row', lambda: light.edit({1: numpy.diag((1, 1, 1, 0.5))})),
                           ('last row', lambda: light.edit({1: numpy.diag((1, 1, 1, numpy.nan))})),
                           ('sky_map', lambda: light.update(sky_map=[UP])),
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
        far = relume.EditBlend([[(0, 0, 0), (1, 1, 1)]] * 2, 0.1, reach=1, box_reaches=[0, 40])
        self.assertEqual(far.share([(40, 0, 0)])[0, 0], 1)
        nothing = relume.EditBlend([], 0.1)
        self.assertEqual(nothing.uniforms()[0].shape, (0, 4))
        self.assertFalse(nothing.share([UP]).any())

    def test_what_is_wrong_is_said(self):
        for text, call in (('1', lambda: relume.EditBlend([[UP, UP], [UP, (0, 0, 0)]], 0.1)),
                           ('voxel', lambda: relume.EditBlend([], 0))):
            with self.assertRaisesRegex(relume.RelumeError, text):
                call()
        for text, call in (('boxes', lambda: relume.EditBlend([UP], 0.1)),
                           ('box_reaches', lambda: relume.EditBlend([[UP, UP]], 0.1, box_reaches=[1, 2])),
                           ('shares', lambda: self.blend.irradiance([UP], [UP], [UP], [UP])),
                           ('one length', lambda: self.blend.irradiance([(0, 0)], [UP], [UP, UP], [UP]))):
            with self.assertRaisesRegex(ValueError, text):
                call()


class Stop(Exception):
    """What the handlers below raise."""


def stop(number, _):
    raise Stop(number)


class SharesWithSignals:
    """Shares of 1, as numpy reads them in the library's callback, outside of the host's function; signals come meanwhile."""

    def __init__(self, count, *numbers):
        self.count, self.numbers = count, numbers

    def __array__(self, *_, **__):
        for number in self.numbers:
            signal.raise_signal(number)
        return numpy.ones(self.count)


class Signals(unittest.TestCase):
    POINTS, NORMALS = numpy.float32([(1, 0, 1), (2, 0, 3)]), numpy.float32([UP, UP])

    def setUp(self):
        for number in (signal.SIGINT, signal.SIGTERM):
            self.addCleanup(signal.signal, number, signal.signal(number, stop))

    def read(self, light):
        return light.irradiance(self.POINTS, self.NORMALS).tolist()

    def reference(self):
        light = rooms()
        light.update([LAMP])
        return self.read(light)

    def handlers(self):
        return signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM)

    def test_signals_wait_for_the_frame(self):
        light = rooms()
        with self.assertRaises(Stop):
            light.update([LAMP], lambda _, p, n: SharesWithSignals(len(p), signal.SIGTERM))
        self.assertEqual(self.read(light), self.reference())
        self.assertEqual(self.handlers(), (stop, stop))

    def test_handlers_of_all_that_came_run_once(self):
        ran = []
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, lambda number, _: ran.append(number) or stop(number, None))
        with self.assertRaises(Stop):
            rooms().update([LAMP], lambda _, p, n: SharesWithSignals(len(p), signal.SIGINT, signal.SIGTERM))
        self.assertEqual(sorted(ran), [signal.SIGINT, signal.SIGTERM])

    def test_visibility_is_interrupted_at_once(self):
        asked = []

        def visible(light, positions, normals):
            asked.append(light)
            signal.raise_signal(signal.SIGINT)
            self.fail('it goes on')

        with self.assertRaises(Stop):
            rooms().update([LAMP], visible)
        self.assertEqual(len(asked), 1)
        self.assertEqual(self.handlers(), (stop, stop))

    def test_frames_within_frames(self):
        inner, outer, ended = rooms(), rooms(), []

        def visible(light, positions, normals):
            try:
                inner.update([LAMP], lambda _, p, n: SharesWithSignals(len(p), signal.SIGINT))
            finally:
                ended.append(self.read(inner))

        with self.assertRaises(Stop):
            outer.update([LAMP], visible)
        self.assertEqual(ended, [self.reference()])
        self.assertEqual(self.handlers(), (stop, stop))

    def test_what_python_does_not_handle_stays(self):
        found = []

        def visible(light, positions, normals):
            found[:] = self.handlers()
            return numpy.ones(len(positions))

        signal.signal(signal.SIGINT, signal.SIG_IGN)
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        rooms().update([LAMP], visible)
        self.assertEqual(found, [signal.SIG_IGN, signal.SIG_DFL])

    def test_a_handler_set_by_visibility_stays(self):
        def visible(light, positions, normals):
            signal.signal(signal.SIGTERM, signal.SIG_IGN)
            return numpy.ones(len(positions))

        rooms().update([LAMP], visible)
        self.assertEqual(self.handlers(), (stop, signal.SIG_IGN))

    def test_frames_of_other_threads(self):
        found = []

        def frame():
            light = rooms()
            light.update([LAMP], lambda _, p, n: numpy.ones(len(p)))
            found.append(self.read(light))

        thread = threading.Thread(target=frame)
        thread.start()
        thread.join()
        self.assertEqual(found, [self.reference()])

    def test_no_signal_of_many_is_lost(self):
        """Where the library calls back is not known from here: at random moments."""
        for threads, rounds, visibility in ((1, 20, lambda _, p, n: numpy.ones(len(p))), (2, 200, None)):
            light = rooms(threads=threads, cells=8, rays_per_cell=8)
            begin = time.perf_counter()
            light.update([LAMP], visibility, ray_set=0)
            length, moment, reference = time.perf_counter() - begin, random.Random(1), self.read(light)
            for _ in range(rounds):
                sender = threading.Thread(target=lambda: (time.sleep(length * moment.random()), signal.raise_signal(signal.SIGINT)))
                light.reset()
                with self.assertRaises(Stop):
                    sender.start()
                    light.update([LAMP], visibility, ray_set=0)
                    self.assertEqual(self.read(light), reference)  # it comes later
                    sender.join()
                sender.join()


class Threads(unittest.TestCase):
    def test_they_end_with_the_light(self):
        before = set(threading.enumerate())
        gc.disable()
        self.addCleanup(gc.enable)
        light = rooms(threads=2)
        light.update([LAMP], lambda _, p, n: numpy.ones(len(p)))
        workers = set(threading.enumerate()) - before
        self.assertTrue(workers)
        light.close()
        for worker in workers:
            worker.join(60)
            self.assertFalse(worker.is_alive())

    def test_what_runs_is_not_closed(self):
        for threads in (1, 2):
            light, raised = rooms(threads=threads), []

            def close():
                try:
                    light.close()
                except RuntimeError as error:
                    raised.append(str(error))

            def visible(_, p, n):
                close()  # in the frame, and beside it
                other = threading.Thread(target=close)
                other.start()
                other.join()
                return numpy.ones(len(p))

            light.update([LAMP], visible)
            self.assertGreater(light.irradiance([(1.5, 0, 2)], [UP]).max(), 0)
            self.assertTrue(raised)
            self.assertEqual(set(raised), {'this LiveLight cannot be closed while a call of it runs, such as a frame: '
                                           'close it when that has returned'})
            with self.assertRaises(RuntimeError):
                light.update([LAMP], lambda *_: light.close())
            light.close()
            with self.assertRaisesRegex(ValueError, 'closed'):
                light.update([LAMP])

    @unittest.skipUnless(hasattr(os, 'fork'), 'there are no forks')
    def test_a_fork_has_its_own(self):
        light = rooms(threads=2)
        light.update([LAMP])
        child = os.fork()
        if child == 0:
            signal.alarm(60)  # else it would wait for ever for threads of its parent
            light.update([LAMP])
            os._exit(0)
        self.assertEqual(os.waitpid(child, 0)[1], 0)


if __name__ == '__main__':
    unittest.main()
