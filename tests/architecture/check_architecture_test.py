#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""check_architecture.py finds what it is there to find: arrows that the page forbids, packages outside their files,
includes of nothing, circles, types that share a name."""
import os
import subprocess
import sys
import tempfile
import unittest

CHECK = os.path.join(os.path.dirname(os.path.abspath(__file__)), 'check_architecture.py')
PAGE = '''# Architecture
```rooms
formats ->
bake/base -> formats
bake -> formats, bake/base
runtime -> formats
samples -> runtime
```
```packages
CGAL/*: bake/mesh.cpp
zip.h: bake/zip.cpp
```
'''


def check(files, page=PAGE):
    """Exit status and text of the check over a repository of these files."""
    with tempfile.TemporaryDirectory() as root:
        for path, text in {**files, 'docs/architecture.md': page}.items():
            os.makedirs(os.path.join(root, os.path.dirname(path)), exist_ok=True)
            with open(os.path.join(root, path), 'w', encoding='utf8') as file:
                file.write(text)
        subprocess.run(['git', '-C', root, 'init', '-q'], check=True)
        subprocess.run(['git', '-C', root, 'add', '.'], check=True)
        done = subprocess.run([sys.executable, CHECK, '--root', root], capture_output=True, text=True, check=False)
        return done.returncode, done.stdout + done.stderr


class CheckArchitecture(unittest.TestCase):
    good = {'formats/a.h': '', 'bake/base/b.h': '#include "formats/a.h"\n#include <vector>\n',
            'bake/mesh.cpp': '#include <CGAL/x.h>\n#include "bake/base/b.h"\n', 'runtime/r.h': '#include "formats/a.h"\n',
            'samples/s.cpp': '#include "runtime/r.h"\n'}

    def expect(self, path, text, message, page=PAGE):
        status, said = check({**self.good, path: text}, page)
        self.assertEqual(status, 1, said)
        self.assertIn(message, said)

    def test_what_the_page_allows_passes(self):
        status, said = check(self.good)
        self.assertEqual(status, 0, said)

    def test_forbidden_arrows(self):
        self.expect('runtime/x.cpp', '\n#include "bake/base/b.h"\n', 'runtime/x.cpp:2: includes "bake/base/b.h"')
        self.expect('bake/x.cpp', '#include "runtime/r.h"\n', 'bake must not include runtime')
        self.expect('bake/x.h', '#include "samples/s.cpp"\n', 'bake must not include samples')

    def test_packages_outside_their_files(self):
        self.expect('bake/x.cpp', '#include <CGAL/y.h>\n', 'only bake/mesh.cpp may')
        self.expect('runtime/x.cpp', '# include <zip.h>\n', 'only bake/zip.cpp may')

    def test_includes_of_nothing(self):
        self.expect('bake/x.cpp', '#include "bake/gone.h"\n', 'which is not in the project')

    def test_folders_without_a_room(self):
        self.expect('attic/x.cpp', '', 'its folder has no room')

    def test_limits_of_tests_by_hand(self):
        self.expect('tests/CMakeLists.txt', 'relume_test_limit(b 300)\nset_tests_properties(a PROPERTIES TIMEOUT 1200)\n',
                    'tests/CMakeLists.txt:2: the limit of a test is set by relume_test_limit()')

    def test_circles(self):
        page = PAGE.replace('formats ->\n', 'formats -> runtime\n')
        status, said = check(self.good, page)
        self.assertEqual(status, 1, said)
        self.assertIn('formats reaches itself', said)

    def test_types_of_one_name(self):
        own = 'namespace relume {\nnamespace {\nstruct Ray {\n};\n}  // namespace\nstruct Ray::State {\n};\n}  // namespace relume\n'
        shared = 'namespace relume {\nclass Ray;\nclass Ray final : public Line {\n};\n}  // namespace relume\n'
        other = 'namespace other {\nstruct Ray {\n};\n}  // namespace other\n'
        status, said = check({**self.good, 'formats/ray.h': shared, 'bake/own.cpp': own, 'bake/other.h': other,
                              'samples/one/main.cpp': shared, 'samples/two/main.cpp': shared})
        self.assertEqual(status, 0, said)
        status, said = check({**self.good, 'formats/ray.h': shared, 'runtime/ray.cpp': shared})
        self.assertEqual(status, 1, said)
        self.assertIn('runtime/ray.cpp:3: relume::Ray is defined in formats/ray.h:3 too', said)

    def test_a_page_without_lists(self):
        status, said = check(self.good, '# Architecture\n')
        self.assertNotEqual(status, 0, said)


if __name__ == '__main__':
    unittest.main()
