#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The version is written where each package manager wants it. All of these say what CMakeLists.txt says, and so do the pages that
tell games which one to find.

    check_versions.py [--root DIR]      exit status 1 where one differs, with its place
"""
import argparse
import os
import re
import sys

# Place, and what stands before and after the version there; MINOR is major.minor.
PLACES = [
    ('bindings/python/pyproject.toml', r'^version = "(.*?)"', 'FULL'),
    ('bindings/js/package.json', r'^  "version": "(.*?)"', 'FULL'),
    ('bindings/blender/relume/blender_manifest.toml', r'^version = "(.*?)"', 'FULL'),
    ('bindings/blender/relume/__init__.py', r'^    "version": \((.*?)\)', 'TUPLE'),
    ('CHANGELOG.md', r'^## (\d[\d.]*)', 'FULL'),
    ('docs/guide/embedding.md', r'find_package\(relume ([\d.]+)', 'MINOR'),
    ('docs/guide/embedding.md', r'\blibrelume(\d[\d.]*\d)', 'MINOR'),
    ('tests/consumer/installed/CMakeLists.txt', r'find_package\(relume ([\d.]+)', 'MINOR'),
    ('tests/consumer/baking/CMakeLists.txt', r'find_package\(relume ([\d.]+)', 'MINOR'),
    ('tests/consumer/c_only/CMakeLists.txt', r'find_package\(relume ([\d.]+)', 'MINOR'),
    ('samples/04_embed/CMakeLists.txt', r'find_package\(relume ([\d.]+)', 'MINOR'),
    ('samples/06_vulkan_headless/CMakeLists.txt', r'find_package\(relume ([\d.]+)', 'MINOR'),
    ('samples/07_ogre/CMakeLists.txt', r'find_package\(relume ([\d.]+)', 'MINOR'),
    ('samples/08_godot/CMakeLists.txt', r'find_package\(relume ([\d.]+)', 'MINOR'),
]


def read(root, path):
    with open(os.path.join(root, path), encoding='utf8') as file:
        return file.read()


def main():
    parser = argparse.ArgumentParser(description=__doc__.split('\n')[0])
    parser.add_argument('--root', default=os.path.join(os.path.dirname(os.path.abspath(__file__)), '..', '..'))
    root = parser.parse_args().root
    version = re.search(r'^project\(relume VERSION ([\d.]+)', read(root, 'CMakeLists.txt'), re.M).group(1)
    expected = {'FULL': version, 'MINOR': version.rpartition('.')[0], 'TUPLE': version.replace('.', ', ')}
    problems = []
    for path, pattern, kind in PLACES:
        found = re.findall(pattern, read(root, path), re.M)
        if path == 'CHANGELOG.md':
            found = found[:1]  # the newest stands first
        if not found or any(each != expected[kind] for each in found):
            problems.append(f'{path}: {", ".join(found) or "no version"} found, {expected[kind]} expected')
    print('\n'.join(problems) or f'{version} in {len(PLACES)} places')
    return 1 if problems else 0


if __name__ == '__main__':
    sys.exit(main())
