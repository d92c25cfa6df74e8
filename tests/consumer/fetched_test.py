#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""A game takes the sources by CMake's FetchContent, without a network. Its own files must be compiled with the flags that they
had before: those of the game's file that links Relume may differ in include folders and the standard. What the game goes without, or
computes inexactly, Relume does not. Its headers refuse GLM's aligned types. With RELUME_LONG_TESTS=1 the game is built, with all of
the runtime, and run.

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
GAMES_FLAGS = ['-fno-exceptions', '-fno-rtti', '-ffast-math']


def run(*command):
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        sys.exit(f'{" ".join(command)}: exit status {done.returncode}\n{done.stdout}{done.stderr}')


def flags(commands, target):
    """What a target's one file is compiled with, but for the compiler, the game's own flags and the names of files."""
    found = [c for c in commands if f'/{target}.dir/' in c['command']]
    if len(found) != 1:
        sys.exit(f'{target}: {len(found)} compile commands')
    words = shlex.split(found[0]['command'])
    words = words[words.index(options.compiler) + 1:]
    return [word for word in words[:words.index('-o')] if word not in GAMES_FLAGS]


shutil.rmtree(options.work, ignore_errors=True)
launcher = ['-DCMAKE_CXX_COMPILER_LAUNCHER=' + options.launcher] if options.launcher else []
run('cmake', '-G', 'Ninja', '-S', os.path.join(options.source, 'tests/consumer/fetched'), '-B', options.work,
    '-DRELUME_ROOT=' + options.source, '-DCMAKE_CXX_COMPILER=' + options.compiler,
    '-DCMAKE_CXX_FLAGS=' + ' '.join(GAMES_FLAGS), *launcher)
with open(os.path.join(options.work, 'compile_commands.json'), encoding='utf8') as file:
    commands = json.load(file)
for target in ('before', 'after'):
    if flags(commands, target):
        sys.exit(f'{target}, which does not link Relume, is compiled with {flags(commands, target)}')
strange = [f for f in flags(commands, 'game') if not f.startswith(('-I', '-isystem', '-std=')) and not f.startswith('/')]
if strange:
    sys.exit(f'linking relume::runtime adds compile flags: {strange}')
for command in commands:
    words = shlex.split(command['command'])
    for without, own in zip(GAMES_FLAGS, ('-fexceptions', '-frtti', '-fno-fast-math')):
        if '/relume_' in command['command'] and (own not in words or words.index(own) < words.index(without)):
            sys.exit(f'{without} of the game reaches {command["file"]}')

aligned = subprocess.run([options.compiler, '-std=c++20', '-fsyntax-only', '-x', 'c++', '-DGLM_FORCE_INTRINSICS',
                          '-DGLM_FORCE_DEFAULT_ALIGNED_GENTYPES', '-I' + os.path.join(options.source, 'include'),
                          os.path.join(options.source, 'include/relume/relighter.h')], capture_output=True, text=True, check=False)
if aligned.returncode == 0 or 'GLM_FORCE_DEFAULT_ALIGNED_GENTYPES' not in aligned.stderr:
    sys.exit(f'aligned types of GLM: exit status {aligned.returncode}\n{aligned.stderr}')

if os.environ.get('RELUME_LONG_TESTS') == '1':
    run('cmake', '--build', options.work)
    run(os.path.join(options.work, 'game'), options.bake)
