#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Hold the includes of all C++ and GLSL sources against docs/architecture.md, and their types against one another.

The page has two code blocks that are read here: `rooms`, where a line `room -> room, room` lists what the files of a folder may
include beside their own, and `packages`, where a line `package: file, file` lists the files that may include a third-party
package. A folder without a line belongs to the nearest folder above that has one.

Two types of one name in one namespace would be one type to the linker, whichever files define them: a program that holds both
is wrong without any compiler's saying so. Those in an anonymous namespace are a file's own.

    tests/architecture/check_architecture.py [--root DIR]

Exit status: 0 nothing found; 1 an include, a type or a test's limit that must not be, each named by file and line; 2 the page cannot be read.
"""
import argparse
import fnmatch
import os
import re
import subprocess
import sys

INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]')

NAMESPACE = re.compile(r'^namespace\s*([\w:]*)\s*\{(?!.*\})')
NAMESPACE_END = re.compile(r'^\}\s*//\s*namespace')
TYPE = re.compile(r'^(?:template\s*<.*>\s*)?(?:struct|class|union|enum(?:\s+(?:class|struct))?)\s+(?:alignas\([^)]*\)\s*)?'
                  r'(?:\[\[\w+\]\]\s*)?(?:RELUME_\w+\s+)?(\w+)(?:\s+final)?\s*(?::(?!:)[^;{]*)?\{')


def read_block(page, name):
    """The lines of the code block that opens with ```name."""
    found = re.search(r'^```' + name + r'\n(.*?)^```', page, re.M | re.S)
    if not found:
        sys.exit(f'docs/architecture.md: no code block "{name}"')
    return [line.split('#')[0].strip() for line in found.group(1).splitlines() if line.split('#')[0].strip()]


def read_rooms(page):
    rooms = {}
    for line in read_block(page, 'rooms'):
        name, _, targets = line.partition('->')
        rooms[name.strip()] = {t.strip() for t in targets.split(',') if t.strip()}
    for name, targets in rooms.items():
        for target in targets - set(rooms):
            sys.exit(f'docs/architecture.md: "{name} -> {target}": there is no room "{target}"')
    return rooms


def read_packages(page):
    packages = {}
    for line in read_block(page, 'packages'):
        name, _, files = line.partition(':')
        packages[name.strip()] = [f.strip() for f in files.split(',')]
    return packages


def room_of(path, rooms):
    folder = os.path.dirname(path)
    while folder and folder not in rooms:
        folder = os.path.dirname(folder)
    return folder or None


def sources(root):
    listed = subprocess.run(['git', '-C', root, 'ls-files', '--', '*.h', '*.cpp', '*.comp', '*.glsl'], capture_output=True,
                            text=True, check=True).stdout.split('\n')
    return [path for path in listed if path and not path.startswith('tests/') and os.path.exists(os.path.join(root, path))]


def check_file(root, path, rooms, packages, everything):
    room = room_of(path, rooms)
    if room is None:
        return [f'{path}: its folder has no room in docs/architecture.md']
    problems = []
    with open(os.path.join(root, path), encoding='utf8') as file:
        for number, line in enumerate(file, 1):
            found = INCLUDE.match(line)
            if not found:
                continue
            quote, target = found.groups()
            if quote == '"' and path.startswith('shaders/'):
                target = os.path.normpath(os.path.join('shaders', target))
            where = f'{path}:{number}: includes {quote}{target}{">" if quote == "<" else quote}'
            if quote == '"':
                if 'include/' + target in everything:
                    target = 'include/' + target
                if target not in everything:
                    if '/' in target and not path.startswith('shaders/'):  # the runtime makes some shaders up
                        problems.append(f'{where}, which is not in the project')
                    continue
                other = room_of(target, rooms)
                if other != room and other not in rooms[room]:
                    problems.append(f'{where}: {room} must not include {other}')
            for package, files in packages.items():
                if (fnmatch.fnmatch(target, package) and '/' in package or target == package) and not any(
                        fnmatch.fnmatch(path, allowed) for allowed in files):
                    problems.append(f'{where}: only {", ".join(files)} may')
    return problems


def types_of(root, path):
    """(namespace::name, line number) of the types that a file defines at the outermost level of named namespaces."""
    namespaces, found = [], []
    with open(os.path.join(root, path), encoding='utf8') as file:
        for number, line in enumerate(file, 1):
            opened, defined = NAMESPACE.match(line), TYPE.match(line)
            if opened:
                namespaces.append(opened.group(1))
            elif NAMESPACE_END.match(line) and namespaces:
                namespaces.pop()
            elif defined and '' not in namespaces:
                found.append(('::'.join(namespaces + [defined.group(1)]), number))
    return found


def check_types(root, files):
    first, problems = {}, []
    for path in files:
        # A sample is a program of its own.
        program = '/'.join(path.split('/')[:2]) if path.startswith('samples/') else ''
        for name, number in types_of(root, path):
            where = f'{path}:{number}'
            if (program, name) in first:
                problems.append(f'{where}: {name} is defined in {first[program, name]} too: give one of them another name')
            first.setdefault((program, name), where)
    return problems


def check_cycles(rooms):
    """Rooms that reach themselves. A folder and the folders inside it are one room in this."""
    def inside(a, b):
        return a.startswith(b + '/') or b.startswith(a + '/')

    problems = []
    for start in rooms:
        seen, todo = set(), [t for t in rooms[start] if not inside(start, t)]
        while todo:
            room = todo.pop()
            if room == start:
                problems.append(f'docs/architecture.md: {start} reaches itself')
                break
            if room not in seen:
                seen.add(room)
                todo.extend(t for t in rooms[room] if not inside(room, t))
    return problems


def check_limits(root):
    """Limits of tests are four times what they take, which one function multiplies."""
    names = subprocess.run(['git', 'ls-files', '*CMakeLists.txt'], cwd=root, capture_output=True, text=True, check=True)
    problems = []
    for path in names.stdout.split():
        with open(os.path.join(root, path), encoding='utf8') as file:
            for number, line in enumerate(file, 1):
                if 'PROPERTIES' in line and 'TIMEOUT' in line:
                    problems.append(f'{path}:{number}: the limit of a test is set by relume_test_limit() '
                                    '(cmake/RelumeTarget.cmake)')
    return problems


def main():
    parser = argparse.ArgumentParser(description=__doc__.split('\n')[0])
    parser.add_argument('--root', default=os.path.join(os.path.dirname(os.path.abspath(__file__)), '..', '..'))
    root = parser.parse_args().root
    try:
        with open(os.path.join(root, 'docs', 'architecture.md'), encoding='utf8') as file:
            page = file.read()
    except OSError as error:
        print(error, file=sys.stderr)
        return 2
    rooms, packages = read_rooms(page), read_packages(page)
    files = sources(root)
    everything = set(files)
    problems = check_cycles(rooms) + check_limits(root)
    for path in files:
        problems += check_file(root, path, rooms, packages, everything)
    problems += check_types(root, [path for path in files if path.endswith(('.h', '.cpp'))])
    for problem in problems:
        print(problem)
    print(f'{len(files)} files, {len(problems)} problems')
    return 1 if problems else 0


if __name__ == '__main__':
    sys.exit(main())
