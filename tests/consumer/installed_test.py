#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Install the build, and its Debian packages, into empty folders; build games against each, in C, C++ and Python, and
look whether all of them see the same light of the sample level; build a tool that bakes with relume::bake, and look whether
it writes the bytes that the command writes. What finds the packages by CMake is built with RELUME_LONG_TESTS=1 alone.

    installed_test.py --build BUILD --source ROOT --relume PROGRAM --work FOLDER [--launcher PROGRAM]
"""
import argparse
import filecmp
import glob
import os
import re
import shutil
import subprocess
import sys

parser = argparse.ArgumentParser()
for name in ('build', 'source', 'relume', 'work'):
    parser.add_argument('--' + name, required=True)
parser.add_argument('--launcher', default='')
options = parser.parse_args()
source, work = os.path.abspath(options.source), os.path.abspath(options.work)
samples = os.path.join(source, 'samples')
is_long = os.environ.get('RELUME_LONG_TESTS') == '1'


def run(*command, **more):
    done = subprocess.run(command, capture_output=True, text=True, check=False, **more)
    if done.returncode:
        sys.exit(f'{" ".join(command)}: exit status {done.returncode}\n{done.stdout}{done.stderr}')
    return done.stdout


def check(condition, text):
    if not condition:
        sys.exit(text)


def light(text):
    """Irradiance of the 16 frames."""
    frames = [tuple(float(x) for x in m) for m in
              re.findall(r'^frame +\d+: irradiance at .* facing up: (\S+) (\S+) (\S+) W/m2', text, re.M)]
    check(len(frames) == 16, f'expected 16 frames of light:\n{text}')
    check(all(x > 0 for x in frames[-1]), f'no light in the last frame:\n{text}')
    return frames


def check_same(name, found, expected):
    for frame, (a, b) in enumerate(zip(found, expected)):
        for x, y in zip(a, b):
            check(abs(x - y) <= 2e-4 + 1e-3 * abs(y), f'{name}: frame {frame}: {a}, expected {b}')


def check_headers(include, baker):
    """Nothing private is installed, nothing that is needs what is not, and none but GLM of other people's libraries;
    in those that are for Vulkan alone, Vulkan's."""
    installed = {os.path.relpath(f, include) for f in glob.glob(include + '/**/*', recursive=True) if os.path.isfile(f)}
    check('relume/relume.h' in installed and 'relume/relighter.h' in installed, f'headers are missing: {installed}')
    bakers = {header for header in installed if header.startswith('relume/bake/')}
    check(bool(bakers) == baker, f'headers of the baker, expected {"some" if baker else "none"}: {bakers}')
    for header in sorted(installed):
        check(header.startswith('relume/'), f'{header} is private')
        with open(os.path.join(include, header), encoding='utf8') as file:
            text = file.read()
        for target in re.findall(r'^\s*#\s*include\s*"([^"]+)"', text, re.M):
            check(target in installed, f'{header} includes "{target}", which is not installed')
            check(header in bakers or target not in bakers, f'{header}, of the runtime, includes "{target}", of the baker')
        for target in re.findall(r'^\s*#\s*include\s*<([^>]+)>', text, re.M):
            vulkan = header.startswith('relume/vulkan_') and target == 'vulkan/vulkan_core.h'
            check(vulkan or re.match(r'glm/|[a-z_]+$|[a-z]+\.h$', target), f'{header} includes <{target}>')


def check_linked(where, library):
    """Neither the library nor what says how to link it has anything of OpenGL or Vulkan."""
    graphics = re.compile(r'epoxy|lib(Open)?GLX?\b|libGLESv|libGLdispatch|libEGL|glfw|vulkan|-lGL|-lEGL|OpenGL::', re.I)
    needed = [line for line in run('objdump', '-p', library).split('\n') if line.split()[:1] == ['NEEDED']]
    check(any('libstdc++' in line for line in needed), f'librelume.so needs {needed}')
    found = [line for line in needed if graphics.search(line)]
    unresolved = run('nm', '-D', '--undefined-only', library).split()
    found += [name for name in unresolved if re.match(r'epoxy_|(gl|glX|egl)[A-Z]', name)]
    files = glob.glob(where + '/lib*/**/relume*Targets*.cmake', recursive=True)
    files += glob.glob(where + '/lib*/**/relume.pc', recursive=True)
    check(len(files) >= 3, f'how to link is said by {files} alone')
    for name in files:
        with open(name, encoding='utf8') as file:
            found += [f'{name}: {line}' for line in file if graphics.search(line)]
    check(not found, f'the runtime links OpenGL: {found}')


def configure(name, prefix, *arguments, reason=None, folder='tests/consumer'):
    """A project of `folder`, configured in an empty folder against an installation. With `reason` it must fail so."""
    build = os.path.join(work, name)
    shutil.rmtree(build, ignore_errors=True)
    launcher = [f'-DCMAKE_{l}_COMPILER_LAUNCHER={options.launcher}' for l in ('C', 'CXX')] if options.launcher else []
    command = ['cmake', '-G', 'Ninja', '-S', os.path.join(source, folder, name), '-B', build,
               '-DCMAKE_PREFIX_PATH=' + prefix, *launcher, *arguments]
    if reason is None:
        run(*command)
    else:
        failed = subprocess.run(command, capture_output=True, text=True, check=False)
        words = ' '.join((failed.stdout + failed.stderr).split())
        check(failed.returncode != 0 and reason in words, f'{" ".join(command)}: expected "{reason}", found\n{words}')
    return build


def check_baker(where, level, bake):
    """A tool that bakes by the library that is installed at `where`: the bytes of the command's `bake`."""
    check_headers(where + '/include', baker=True)
    build = configure('baking', where)
    run('cmake', '--build', build)
    output = os.path.join(work, 'by_library.relume')
    said = run(os.path.join(build, 'bake_level'), level, output, 'draft', *[f'{name}={value}' for name, _, value in sizes])
    found = re.fullmatch(r'irradiance (\S+) (\S+) (\S+)\n', said)
    check(found and all(float(x) > 0 for x in found.groups()), f'no light: {said}')
    check(filecmp.cmp(output, bake, shallow=False), f'{output} and {bake}, of the command, differ')

    # Without the baker's packages the component is refused by name, and who does not ask for it is served.
    configure('baking', where, '-DCMAKE_DISABLE_FIND_PACKAGE_embree=ON',
              reason='component bake: it needs embree, which CMake does not find')
    configure('installed', where, '-DSAMPLES=' + samples, '-DCMAKE_DISABLE_FIND_PACKAGE_embree=ON',
              '-DCMAKE_DISABLE_FIND_PACKAGE_TBB=ON')


def library_of(where):
    library = next(iter(glob.glob(where + '/lib*/**/librelume.so', recursive=True)), None)
    check(library is not None, f'no librelume.so below {where}')
    return library, {**os.environ, 'LD_LIBRARY_PATH': os.path.dirname(library)}


def check_games(where, bake, expected):
    """Games of all kinds that find by CMake what is installed at `where`."""
    _, environment = library_of(where)
    games = configure('installed', where, '-DSAMPLES=' + samples)
    run('cmake', '--build', games)
    for game in ('cpp_static', 'cpp_shared', 'c_shared'):
        said = run(os.path.join(games, game), bake, env=environment)
        check_same(game, light(said), expected)
        if game == 'c_shared':  # all of it in the game's memory, and all of that given back
            check(re.search(r'^memory: [1-9]\d* KiB at most, 0 bytes left$', said, re.M), f'{game} leaks:\n{said}')

    # One in C alone, on a machine without GLM.
    alone = configure('c_only', where, '-DSAMPLES=' + samples, '-DCMAKE_DISABLE_FIND_PACKAGE_glm=ON')
    run('cmake', '--build', alone)
    for game in ('c_only', 'c_static'):
        check_same(game, light(run(os.path.join(alone, game), bake, env=environment)), expected)

    # Passes as data, for a renderer of the game's own.
    said = [run(os.path.join(games, game), bake, env=environment) for game in ('passes_runtime', 'passes_shared')]
    check(said[0] == said[1] and re.fullmatch(r'[1-9]\d? programs, [1-9]\d? dispatches\n', said[0]), f'passes: {said}')

    # Light without a bake: dark behind the wall, lit once that is gone.
    said = [run(os.path.join(games, game), env=environment) for game in ('live_runtime', 'live_shared')]
    frames = [float(e) for e in re.findall(r'^frame +\d+: indirect (\S+)', said[0], re.M)]
    check(said[0] == said[1] and len(frames) == 6 and max(frames[:3]) < 1e-3 < 0.1 < frames[5], f'live light: {said}')

    # A baked level that is being edited: what is lost scales the bake's light, what is gained is added.
    said = [run(os.path.join(games, game), env=environment) for game in ('edits_runtime', 'edits_shared')]
    blended = [float(e) for e in re.findall(r'\d+\.\d+', said[0])]
    check(said[0] == said[1] and len(blended) == 3 and blended[0] < blended[1] == 1.0 < blended[2], f'edits: {said}')

    # In OpenGL, whose functions the game hands over.
    for game in glob.glob(games + '/gl_*'):
        done = subprocess.run([game, bake], env=environment, capture_output=True, text=True, check=False)
        check(done.returncode in (0, 5), f'{game}: exit status {done.returncode}\n{done.stdout}{done.stderr}')
        if done.returncode:
            print(f'{os.path.basename(game)} is not tested: {done.stderr.strip()}')


def check_library(where, bake, expected, baker=False):
    """What is installed at `where`, what the library links and shows, and programs of C and Python over it."""
    library, environment = library_of(where)
    check_headers(where + '/include', baker)
    check_linked(where, library)

    # C89 by pkg-config, as a makefile would.
    pc = glob.glob(where + '/lib*/**/relume.pc', recursive=True)
    flags = run('pkg-config', '--cflags', '--libs', 'relume',
                env={**environment, 'PKG_CONFIG_PATH': os.path.dirname(pc[0])}).split()
    program = os.path.join(work, 'c89')
    run('cc', '-std=c89', '-pedantic', '-Wall', '-Werror', os.path.join(samples, '02_hello_c/hello_relight.c'), '-o',
        program, *flags, '-lm')
    check_same('C89', light(run(program, bake, env=environment)), expected)
    python = os.path.join(samples, '03_hello_python/hello_relight.py')
    in_python = {**environment, 'RELUME_LIBRARY': library, 'PYTHONPATH': os.path.join(source, 'bindings/python')}
    check_same('Python', light(run(sys.executable, '-B', python, bake, env=in_python)), expected)
    missing = subprocess.run([program, '/no/such.relume'], env=environment, capture_output=True, text=True, check=False)
    check(missing.returncode == 2 and '/no/such.relume' in missing.stderr, f'a missing bake: {missing}')
    for hello in ([program], [sys.executable, '-B', python]):
        dark = subprocess.run([*hello, no_grid], env=in_python, capture_output=True, text=True, check=False)
        check(dark.returncode == 1 and 'no_grid.relume: no grid' in dark.stderr, f'a bake without a grid: {dark}')

    # What the library shows: relume_* and names of relume's C++ API.
    symbols = run('nm', '-D', '--defined-only', library).split('\n')
    names = [line.split()[-1] for line in symbols if line]
    strange = [n for n in names if not re.match(r'(relume_|_ZN?K?\d*6relume|_ZNK?6relume|_ZT[ISV]N6relume|_ZTIN)', n)]
    check(names and not strange, f'librelume.so shows {strange[:10]}')


shutil.rmtree(work, ignore_errors=True)
os.makedirs(work)
bake, no_grid = os.path.join(work, 'level.relume'), os.path.join(work, 'no_grid.relume')
level = os.path.join(samples, 'level/two_rooms.glb')
sizes = (('surfels.count', '--surfels', '512'), ('caches.lightmapCaches', '--lightmap-caches', '200'),
         ('links.linksPerCache', '--links', '64'), ('links.raysPerCache', '--rays', '64'),
         ('playSpace.walks', '--walks', '5000'))
for file, more in ((bake, ()), (no_grid, ('--grid-caches', '0'))):
    run(options.relume, 'bake', level, '-o', file, '--preset', 'draft', '--progress', 'none', *more,
        *[word for _, flag, value in sizes for word in (flag, value)])
hello = glob.glob(os.path.join(options.build, 'samples/01_hello_relight/hello_relight'))
check(hello, 'the sample is not built')
expected = light(run(hello[0], bake))

prefix = os.path.join(work, 'prefix')
for component in ('runtime', 'dev'):
    run('cmake', '--install', options.build, '--prefix', prefix, '--component', component)
check_library(prefix, bake, expected)
check_games(prefix, bake, expected)
configure('baking', prefix, reason='component bake: it is not installed here')
if subprocess.run(['pkg-config', '--exists', 'glfw3', 'epoxy', 'stb'], check=False).returncode == 0:
    run('cmake', '--build', configure('04_embed', prefix, folder='samples'))
if is_long and subprocess.run(['pkg-config', '--exists', 'OGRE', 'stb'], check=False).returncode == 0:
    run('cmake', '--build', configure('07_ogre', prefix, folder='samples'))
if is_long:
    run('cmake', '--build', configure('08_godot', prefix, folder='samples'))
run('cmake', '--install', options.build, '--prefix', prefix, '--component', 'bake_dev')
check_baker(prefix, level, bake)

# Without the shared library pkg-config names all that an archive needs.
static = os.path.join(work, 'static')
run('cmake', '-G', 'Ninja', '-S', source, '-B', static, '-DRELUME_BUILD_BAKE=OFF', '-DRELUME_BUILD_SHARED=OFF', '-DRELUME_BUILD_SAMPLES=OFF',
    '-DRELUME_BUILD_TESTS=OFF')
libraries = run('pkg-config', '--libs', 'relume', env={**os.environ, 'PKG_CONFIG_PATH': static}).split()
check({'-lrelume_runtime', '-lrelume_formats', '-lxxhash'} <= set(libraries), f'pkg-config of archives: {libraries}')

# The packages, unpacked where a package manager would put them.
if shutil.which('dpkg-deb') and shutil.which('cpack'):
    debs = os.path.join(work, 'debs')
    run('cpack', '-G', 'DEB', '-B', debs, '--config', os.path.join(options.build, 'CPackConfig.cmake'))
    packages = {run('dpkg-deb', '-f', f, 'Package').strip(): f for f in glob.glob(debs + '/*.deb')}
    names = sorted(packages)
    runtime = next((n for n in names if re.fullmatch(r'librelume[\d.]+', n)), None)
    check(runtime and set(names) == {runtime, 'librelume-dev', 'librelume-bake-dev', 'relume-tools'}, f'packages: {names}')
    needs = {name: run('dpkg-deb', '-f', packages[name], 'Depends') for name in names}
    check('libstdc++6' in needs[runtime], 'the library depends on nothing')
    check('libembree' in needs['relume-tools'], 'the tools depend on no Embree')
    check('libembree-dev' in needs['librelume-bake-dev'] and 'librelume-dev' in needs['librelume-bake-dev'],
          f'the baker\'s library depends on {needs["librelume-bake-dev"]}')
    for name in (runtime, 'librelume-dev'):
        check('libembree' not in needs[name], f'{name} depends on the baker')
        check('epoxy' not in needs[name], f'{name} depends on libepoxy')
    root = os.path.join(work, 'root')
    for package in packages.values():
        run('dpkg-deb', '-x', package, root)
    check_library(root + '/usr', bake, expected, baker=True)
    if is_long:
        check_games(root + '/usr', bake, expected)
        check_baker(root + '/usr', level, bake)

    # Each package says its licence, and those with code of CGAL say that they are GPL.
    for name in names:
        licences = glob.glob(os.path.join(root, 'usr/share/doc', name, '*'))
        wanted = {'LICENSE', 'LICENSE.third-party'} | ({'LICENSE.binaries'} if 'embree' in needs[name] else set())
        check({os.path.basename(f) for f in licences} >= wanted, f'{name}: licences {licences}')
    tool = os.path.join(root, 'usr/bin/relume')
    check('relume' in run(tool, '--version'), 'the packaged tool does not say its version')
    status = run(tool, 'validate', bake)
    print(f'packages: {", ".join(names)}')
else:
    print('dpkg-deb or cpack is missing: packages are not tested')
