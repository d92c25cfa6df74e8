#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""A game takes the sources by CMake's FetchContent, without a network. Its own files must be compiled with the flags that they
had before: those of the game's file that links Relume may differ in include folders and the standard. With
RELUME_LONG_TESTS=1 the game is built, with all of the runtime, and run.

    fetched_test.py --source ROOT --work FOLDER --bake FILE --compiler CXX [--launcher PROGRAM]
"""
import argparse
import json
import os
import shlex
import shutil
import subprocess
import sys

parser = argparse.ArgumentParser()
for name in ('source', 'work', 'bake', 'compiler'):
    parser.add_argument('--' + name, required=True)
parser.add_argument('--launcher', default='')
options = parser.parse_args()


def run(*command):
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        sys.exit(f'{" ".join(command)}: exit status {done.returncode}\n{done.stdout}{done.stderr}')


def flags(commands, target):
    """What a target's one file is compiled with, but for the compiler and the names of files."""
    found = [c for c in commands if f'/{target}.dir/' in c['command']]
    if len(found) != 1:
        sys.exit(f'{target}: {len(found)} compile commands')
    words = shlex.split(found[0]['command'])
    words = words[words.index(options.compiler) + 1:]
    return words[:words.index('-o')]


shutil.rmtree(options.work, ignore_errors=True)
launcher = ['-DCMAKE_CXX_COMPILER_LAUNCHER=' + options.launcher] if options.launcher else []
run('cmake', '-G', 'Ninja', '-S', os.path.join(options.source, 'tests/consumer/fetched'), '-B', options.work,
    '-DRELUME_ROOT=' + options.source, '-DCMAKE_CXX_COMPILER=' + options.compiler,
    *launcher)
with open(os.path.join(options.work, 'compile_commands.json'), encoding='utf8') as file:
    commands = json.load(file)
for target in ('before', 'after'):
    if flags(commands, target):
        sys.exit(f'{target}, which does not link Relume, is compiled with {flags(commands, target)}')
strange = [f for f in flags(commands, 'game') if not f.startswith(('-I', '-isystem', '-std=')) and not f.startswith('/')]
if strange:
    sys.exit(f'linking relume::runtime adds compile flags: {strange}')
if os.environ.get('RELUME_LONG_TESTS') == '1':
    run('cmake', '--build', options.work)
    run(os.path.join(options.work, 'game'), options.bake)
