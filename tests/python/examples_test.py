#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The examples of bindings/python, and its README's, as a reader would run them; what they print is held against what it must be.

    examples_test.py RELUME LEVEL      with RELUME_LIBRARY and PYTHONPATH in the environment
"""
import json
import os
import re
import struct
import subprocess
import sys
import tempfile
import unittest

import numpy

import relume

RELUME, LEVEL = sys.argv[1:]
WORK = tempfile.TemporaryDirectory()
BAKE = os.path.join(WORK.name, 'level.relume')
PACKAGE = os.path.dirname(os.path.dirname(os.path.abspath(relume.__file__)))


def bake_of(level, bake):
    subprocess.run([RELUME, 'bake', level, '-o', bake, '--preset', 'draft'], check=True, capture_output=True)


def without_parts(names):
    """The level, its nodes of some names without their meshes: a .glb beside the bake."""
    with open(LEVEL, 'rb') as file:
        data = file.read()
    length, = struct.unpack_from('<I', data, 12)
    document = json.loads(data[20:20 + length])
    for node in document['nodes']:
        if node.get('name') in names:
            del node['mesh']
            node.pop('extras', None)
    text = json.dumps(document).encode()
    text += b' ' * (-len(text) % 4)
    rest = data[20 + length:]
    path = os.path.join(WORK.name, 'edited.glb')
    with open(path, 'wb') as file:
        file.write(data[:8] + struct.pack('<III', 20 + len(text) + len(rest), len(text), 0x4E4F534A) + text + rest)
    return path


class Example(unittest.TestCase):
    def test_that_of_the_readme(self):
        with open(os.path.join(PACKAGE, 'README.md'), encoding='utf8') as file:
            blocks = re.findall(r'^```python\n(.*?)^```$', file.read(), re.MULTILINE | re.DOTALL)
        self.assertEqual(len(blocks), 2)
        done = subprocess.run([sys.executable, '-B', '-c', ''.join(blocks)], cwd=WORK.name, capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)

    def test_a_wall_is_taken_away(self):
        example = os.path.join(PACKAGE, 'examples/edits.py')
        edited = os.path.join(WORK.name, 'edited.relume')
        bake_of(without_parts({'living_wall_east', 'hall_wall_west', 'doorway'}), edited)
        # The example's own lights and shadows, and the bake that one would wait for.
        truth = (f'import sys; sys.argv = ["edits.py", {LEVEL!r}, {BAKE!r}]; sys.path.insert(0, {os.path.dirname(example)!r})\n'
                 f'exec(open({example!r}).read())\n'
                 f'new = relume.Relighter(relume.Bake({edited!r}))\n'
                 'for _ in range(24): new.relight([lamp], shadows, emission_scale=0)\n'
                 'truth = new.irradiance_in_grid(walk, up)\n'
                 'print("error", *(((light - truth) ** 2).mean() ** 0.5 / truth.mean() for light in (stale, corrected)))')
        done = subprocess.run([sys.executable, '-B', '-c', truth], capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        stale, corrected = (float(word) for word in done.stdout.split('error')[1].split())
        self.assertLess(corrected, 0.7 * stale, done.stdout)

    def test_light_along_a_walk(self):
        with tempfile.TemporaryDirectory() as folder:
            picture = os.path.join(folder, 'corridor.png')
            done = subprocess.run([sys.executable, '-B', os.path.join(PACKAGE, 'examples/corridor.py'), LEVEL, BAKE, picture],
                                  capture_output=True, text=True, check=False)
            self.assertIn('largest difference of the sum', done.stdout, done.stderr)
            rows = numpy.array([[float(word) for word in line.split()] for line in done.stdout.split('\n')[1:10]])
            sun, lamp, spot = rows[:, 1:4].T
            self.assertTrue((rows > 0).all())
            self.assertGreater(lamp[:5].mean(), 3 * lamp[-3:].mean(), 'the lamp stands in the living room')
            self.assertGreater(spot[-3:].mean(), 3 * spot[:5].mean(), 'the spot in the hall')
            numpy.testing.assert_allclose(sun + lamp + spot, rows[:, 4], rtol=0.05)
            if 'matplotlib is not installed' in done.stderr:
                self.skipTest('the picture: matplotlib is not installed')
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertGreater(os.path.getsize(picture), 10000)


if __name__ == '__main__':
    bake_of(LEVEL, BAKE)
    unittest.main(argv=sys.argv[:1])
