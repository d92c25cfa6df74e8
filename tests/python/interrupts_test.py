#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""bindings/python against librelume: exceptions that come while the library calls back. All tasks of a call are done, and the
exception is raised after it; a frame that lacks tasks never passes for a good one.

    interrupts_test.py      with RELUME_LIBRARY and PYTHONPATH in the environment
"""
import ctypes
import random
import signal
import sys
import threading
import time
import unittest

import numpy

import relume
from relume import _lights, _threads
from relume._library import ParallelFor, Task

LAMP = relume.Light.point((1.5, 2.2, 2.0), (12, 10, 8))
POINTS, NORMALS = numpy.float32([(1, 0, 1), (2, 0, 3)]), numpy.float32([(0, 1, 0)] * 2)


def room(**options):
    corners = [(x, y, z) for z in (0, 4) for y in (0, 3) for x in (0, 8)]
    faces = [(0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6)]
    inwards = [t for a, b, c, d in faces for t in ((c, b, a), (d, c, a))]
    return relume.LiveLight([relume.Surface((0.7, 0.6, 0.5))], [relume.Mesh(corners, inwards)], [relume.Part(0)],
                            **{'cells': 8, 'rays_per_cell': 8, **options})


def lit(_, positions, normals):
    return numpy.ones(len(positions))


class Stop(Exception):
    """What comes."""


def stop(*_):
    raise Stop


class StrikeAt:
    """A trace function that raises Stop at a line of a module, the n-th that runs; its functions begin with one."""

    def __init__(self, module, n):
        self.file, self.left, self.struck = module.__file__, n, None

    def __call__(self, frame, event, _):
        if frame.f_code.co_filename != self.file:
            return None
        if event in ('call', 'line'):
            if self.left == 0:
                self.struck = frame.f_code.co_name
                sys.settrace(None)
                raise Stop
            self.left -= 1
        return self

    def __enter__(self):
        sys.settrace(self)
        return self

    def __exit__(self, *_):
        sys.settrace(None)


class Interrupts(unittest.TestCase):
    def setUp(self):
        self.addCleanup(setattr, sys, 'unraisablehook', sys.unraisablehook)
        self.dropped = []
        sys.unraisablehook = lambda what: self.dropped.append(what.exc_type)

    def test_all_signals_that_python_handles_wait(self):
        names = ('SIGVTALRM', 'SIGPROF', 'SIGWINCH', 'SIGCHLD', 'SIGURG', 'SIGRTMIN', 'SIGUSR1', 'SIGTERM')
        numbers = [getattr(signal, name) for name in names if hasattr(signal, name)]

        class Shares:
            """Those of light, read by numpy outside of the host's function; a signal comes meanwhile."""
            def __init__(self, number, count):
                self.number, self.count = number, count

            def __array__(self, *_, **__):
                signal.raise_signal(self.number)
                return numpy.ones(self.count)

        light = room()
        light.update([LAMP], ray_set=0)
        reference = light.irradiance(POINTS, NORMALS)
        for number in numbers:
            self.addCleanup(signal.signal, number, signal.signal(number, stop))
            light.reset()
            with self.assertRaises(Stop):
                light.update([LAMP], lambda _, p, n, number=number: Shares(number, len(p)), ray_set=0)
            numpy.testing.assert_array_equal(light.irradiance(POINTS, NORMALS), reference)

    def test_all_tasks_are_done_wherever_it_strikes(self):
        """One call of 40 tasks, and Stop at each line of it in turn."""
        ended, n, seen = [], 0, set()

        def task(_, index):
            if index % 8 == 0:
                time.sleep(1e-4)  # others are done by workers
            ended.append(index)

        task = Task(task)
        while True:
            threads = _threads.Threads(2)
            parallel_for = ParallelFor(threads.parallel_for)
            ended.clear()
            strike = StrikeAt(_threads, n)
            try:
                with strike:
                    threads.call(parallel_for, None, 40, task, None)
                error = None
            except (Stop, RuntimeError) as raised:
                error = type(raised)
            at_return = sorted(ended)
            if strike.struck is None:
                self.assertIsNone(error)
                break
            self.assertIsNotNone(error, f'line {n}, in {strike.struck}')
            self.assertIn(at_return, ([], list(range(40))), strike.struck)
            if error is RuntimeError:
                self.assertEqual(at_return, [])
            seen.add(strike.struck)
            ended.clear()
            threads.call(parallel_for, None, 40, task, None)  # the next is a good one
            self.assertEqual(sorted(ended), list(range(40)))
            n += 1
        self.assertEqual(at_return, list(range(40)))
        self.assertLessEqual({'call', 'run', 'work', 'wait', '_ask'}, seen)

    def test_visibility_that_does_not_begin_is_told(self):
        light, n, errors = room(), 0, []
        while True:
            light.reset()
            frame = _lights.Frame([LAMP], lit)
            how = relume.live.LiveFrame()
            relume.live.runtime.relume_live_frame_default(ctypes.byref(how), ctypes.sizeof(how))
            strike = StrikeAt(_lights, n)
            try:
                with strike:
                    frame.run(light, relume.live.runtime.relume_live_update, ctypes.byref(frame.setup), ctypes.byref(how))
            except (Stop, RuntimeError) as error:
                errors.append(type(error))
            if strike.struck is None or n == 30:
                break
            n += 1
            self.assertEqual(len(errors), n, f'line {n - 1}, in {strike.struck}')
        self.assertEqual(set(errors), {Stop, RuntimeError})

    def test_exceptions_at_random_moments(self):
        set_error, me = ctypes.pythonapi.PyThreadState_SetAsyncExc, ctypes.c_ulong(threading.get_ident())
        light, moment = room(threads=3), random.Random(1)
        begin = time.perf_counter()
        light.update([LAMP], ray_set=0)
        length, reference = time.perf_counter() - begin, light.irradiance(POINTS, NORMALS).tolist()
        for _ in range(200):
            sender = threading.Thread(target=lambda: (time.sleep(length * moment.random()), set_error(me, ctypes.py_object(Stop))))
            light.reset()
            with self.assertRaises((Stop, RuntimeError)):
                sender.start()
                light.update([LAMP], ray_set=0)
                self.assertEqual(light.irradiance(POINTS, NORMALS).tolist(), reference)  # it comes later
                sender.join()
            sender.join()

    def test_a_full_stack(self):
        """Frames at any depth up to the recursion limit either are good or say that they are not."""
        for visibility in (None, lit):
            light = room(threads=2)
            light.update([LAMP], visibility, ray_set=0)
            reference, ends = light.irradiance(POINTS, NORMALS).tolist(), []

            def dive():
                try:
                    dive()
                except RecursionError:
                    pass
                if len(ends) < 60:
                    light.reset()
                    try:
                        light.update([LAMP], visibility, ray_set=0)
                        ends.append(light.irradiance(POINTS, NORMALS).tolist())
                    except (RecursionError, RuntimeError):
                        ends.append(None)

            limit = sys.getrecursionlimit()
            self.addCleanup(sys.setrecursionlimit, limit)
            sys.setrecursionlimit(300)
            try:
                dive()
            finally:
                sys.setrecursionlimit(limit)
            self.assertTrue(all(end in (None, reference) for end in ends))
            self.assertEqual(ends[-1], reference)


if __name__ == '__main__':
    unittest.main()
