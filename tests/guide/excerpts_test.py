#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Compile the excerpts of all documents: each fenced block of C++ and C against the public headers alone, of GLSL by
glslangValidator behind what the library puts in front of it; check the grammar of Python, JavaScript and bash, and the names
that JavaScript takes from the package.

Blocks of C++ and C are statements of a function. What they presume stands in presumed.h and presumed_c.h, by name, or for a
block alone in a comment right above it, which readers do not see:

    <!-- presumes: relume::LiveLightOptions options; -->

That of GLSL is what stands in front of the block, but for lines @NAME, which are a text of print_glsl. After the language
may stand "at file scope", or "not compiled: REASON". A block of a language that nobody knows is an error.

    excerpts_test.py --source DIR --work DIR --cxx PROGRAM [--glslang PROGRAM --print-glsl PROGRAM] [--node PROGRAM]
"""
import argparse
import concurrent.futures
import pathlib
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass

FENCE = re.compile(r'^(?:<!-- presumes: *((?:(?!-->).)*?) *-->\n)?^```([^\n`]*)\n(.*?)^```$', re.MULTILINE | re.DOTALL)
DOCUMENTS = ('*.md', 'docs/**/*.md', 'bindings/**/*.md', 'formats/**/*.md', 'samples/**/*.md')
MOST_NOT_COMPILED = 0  # excerpts that nobody compiles go stale
OTHERS = {'', 'sh', 'cmake', 'nginx', 'ninja', 'rooms', 'packages'}  # other tests run them, or nobody can; '': of no language
STANDARD = ''.join(f'#include <{name}>\n' for name in
                   ('algorithm', 'cmath', 'cstddef', 'cstdint', 'memory', 'span', 'string', 'utility', 'vector'))


@dataclass
class Excerpt:
    page: str
    line: int  # of its first line
    language: str
    how: str
    presumes: str
    text: str

    def __str__(self):
        return f'{self.page}:{self.line}'


def excerpts_of(page, text):
    found = []
    for match in FENCE.finditer(text):
        language, _, how = match[2].partition(' ')
        line = text.count('\n', 0, match.start(3)) + 1
        found.append(Excerpt(page, line, language, how.strip(), match[1] or '', match[3]))
    return found


def run(command, **more):
    """What a command that fails has said, else nothing."""
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False, **more)
    return done.stdout[:4000] or f'exit status {done.returncode}' if done.returncode else ''


class Presumed:
    """Paragraphs of a header by the names that open them."""

    def __init__(self, path, opening):
        self.paragraphs = []
        self.used = set()
        for paragraph in path.read_text().split('\n\n')[1:]:
            names, _, text = paragraph.partition('\n')
            self.paragraphs.append((set(re.fullmatch(opening, names)[1].split()), text + '\n'))

    def of(self, excerpt):
        """What an excerpt needs of them: includes, declarations."""
        words = set(re.findall(r'\w+', excerpt.text))
        declared = set(re.findall(r'\w+', excerpt.presumes))
        texts = []
        for names, text in self.paragraphs:
            if names & words - declared:
                self.used |= names & words
                texts.append(text)
        lines = ''.join(texts).splitlines(True)
        return [''.join(line for line in lines if line.startswith('#') == is_include) for is_include in (True, False)]

    def unused(self):
        return sorted(set().union(*(names for names, _ in self.paragraphs)) - self.used)


def body(excerpt, name, prelude=''):
    """An excerpt with its own includes left out, under its own line numbers."""
    text = re.sub(r'^#include.*', '', excerpt.text, flags=re.MULTILINE)
    marked = f'#line {excerpt.line} "{excerpt.page}"\n{text}'
    return prelude + (marked if excerpt.how == 'at file scope' else f'void {name}(void);\nvoid {name}(void) {{\n{marked}}}\n')


class Compiler:
    def __init__(self, options):
        self.source, self.work, self.options = options.source.resolve(), options.work.resolve(), options
        self.cpp = Presumed(self.source / 'tests/guide/presumed.h', r'// (.*)')
        self.c = Presumed(self.source / 'tests/guide/presumed_c.h', r'/\* (.*) \*/')
        shutil.rmtree(self.work, ignore_errors=True)
        self.work.mkdir(parents=True)
        # The public headers, and nothing that lies beside them.
        (self.work / 'include').symlink_to(self.source / 'include')

    def compile(self, name, text, *flags):
        path = self.work / name
        path.write_text(text)
        return run([self.options.cxx, '-fsyntax-only', '-Wall', '-Wextra', '-Werror', '-Wno-unused-variable',
                    '-Wno-unused-but-set-variable', '-Wno-unused-function', '-Wno-unused-parameter', '-I', self.work / 'include', *flags, path])

    def cpp_unit(self, excerpts, name, all_headers):
        """Excerpts with includes of their own need no others; those without are lines of a file that has all."""
        headers, text = [], ''
        for i, excerpt in enumerate(excerpts):
            includes, declarations = self.cpp.of(excerpt)
            headers += includes.splitlines() + re.findall(r'^#include.*', excerpt.text, re.MULTILINE)
            headers += re.findall(r'^#include.*', excerpt.presumes, re.MULTILINE)
            declarations += re.sub(r'^#include.*', '', excerpt.presumes, flags=re.MULTILINE) + '\n'
            text += f'namespace excerpt{i} {{\n{body(excerpt, "excerpt", declarations)}}}\n'
        if all_headers:
            headers += [f'#include <relume/{path.name}>' for path in sorted((self.source / 'include/relume').glob('*.h'))
                        if path.name != 'vulkan_executor.h']
        return self.compile(name, STANDARD + '\n'.join(dict.fromkeys(headers)) + '\n' + text, '-std=c++20')

    def c_unit(self, excerpt, name):
        includes, declarations = self.c.of(excerpt)
        return self.compile(name, '#include <relume/relume.h>\n' + includes + body(excerpt, 'excerpt', declarations +
                                                                                   excerpt.presumes + '\n'), '-x', 'c', '-std=c99', '-pedantic')

    def glsl_unit(self, excerpt, name):
        def text_of(match):
            return (self.work / match[1]).read_text()
        text = re.sub(r'^@(\w+)$', text_of, excerpt.presumes, flags=re.MULTILINE) + '\n'
        if 'void main()' not in excerpt.text:
            text += 'void main() {\n' + excerpt.text + '}\n'
        else:
            text += excerpt.text
        path = self.work / name
        path.write_text(text)
        stage = 'comp' if 'gl_GlobalInvocationID' in excerpt.text else 'vert' if 'gl_Position' in excerpt.text else 'frag'
        vulkan = ['-V', '-o', '/dev/null'] if '#version 450' in excerpt.presumes else []
        return run([self.options.glslang, '-S', stage, *vulkan, path])

    def js_unit(self, excerpt, name):
        path = self.work / name.replace('.js', '.mjs')
        path.write_text(excerpt.text)
        failure = run([self.options.node, '--check', path]) if self.options.node else ''
        types = self.source / 'bindings/js/src'
        modules = {'relume': 'index.d.ts', 'relume/webgl': 'webgl.d.ts', 'relume/three': 'three.d.ts'}
        for names, module in re.findall(r"import \{([^}]*)\} from '(relume[^']*)'", excerpt.text):
            declared = (types / modules[module]).read_text()
            failure += ''.join(f'{word} is not declared in {modules[module]}\n' for word in re.findall(r'\w+', names)
                               if not re.search(rf'export (declare )?(class|function|const) {word}\b', declared))
        declared = ''.join(path.read_text() for path in types.glob('*.d.ts'))
        return failure + ''.join(
            f'.{member} is not declared\n' for member in re.findall(r'\b(?:relighter|bake|lighting)\.(\w+)', excerpt.text)
            if not re.search(rf'\b{member}\b', declared))

    def python_unit(self, excerpt, _):
        try:
            compile('\n' * (excerpt.line - 1) + excerpt.text, excerpt.page, 'exec')
            return ''
        except SyntaxError as error:
            return str(error)

    def bash_unit(self, excerpt, name):
        (self.work / name).write_text(excerpt.text)
        return run(['bash', '-n', self.work / name])

    def jobs(self, excerpts):
        """Calls that compile them all, each with the excerpts that it is for."""
        units = {'c': self.c_unit, 'js': self.js_unit, 'python': self.python_unit, 'bash': self.bash_unit}
        if self.options.glslang:
            units['glsl'] = self.glsl_unit
        alone = [e for e in excerpts if e.language == 'cpp' and '#include' in e.text]
        together = [e for e in excerpts if e.language == 'cpp' and '#include' not in e.text]
        made = [([e], self.cpp_unit, [e], f'alone{i}.cpp', False) for i, e in enumerate(alone)]
        if together:
            made.append((together, self.cpp_unit, together, 'together.cpp', True))
        made += [([e], units[e.language], e, f'{i}.{e.language}') for i, e in enumerate(excerpts) if e.language in units]
        return made

    def failures(self, excerpts):
        with concurrent.futures.ThreadPoolExecutor(2) as pool:
            pending = [(of, pool.submit(call, *arguments)) for of, call, *arguments in self.jobs(excerpts)]
            return [f'{", ".join(map(str, of))}: does not compile\n{job.result()}' for of, job in pending if job.result()]


# What must not compile: the test itself, tested.
BROKEN = '''
```cpp
#include <relume/lights.h>
lights.front().colour = {1, 2, 3};
```
```c
relume_relight(relighter, setup);
```
```js
import {loadBakes} from 'relume';
```
```js
relighter.relightAll({});
```
```python
import relume as
```
```bash
if true
```
<!-- presumes: #version 430
vec3 n; -->
```glsl
vec3 e = relumeIrradianceLightmap(vec2(0.0), n);
```
'''


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name in ('source', 'work'):
        parser.add_argument('--' + name, type=pathlib.Path, required=True)
    parser.add_argument('--cxx', required=True)
    for name in ('glslang', 'print-glsl', 'node'):
        parser.add_argument('--' + name)
    options = parser.parse_args()
    compiler = Compiler(options)
    for lacking in ('glslang', 'node'):
        if not getattr(options, lacking):
            print(f'there is no {lacking}: its excerpts are not compiled')
    if options.print_glsl and run([options.print_glsl, compiler.work]):
        return f'{options.print_glsl} fails'

    failures = [f'compiles: {e.language}, {e.text}' for e in excerpts_of('broken', BROKEN)
                if (e.language != 'glsl' or options.glslang) and not compiler.failures([e])]
    compiler.cpp.used.clear(), compiler.c.used.clear()

    pages = sorted({page for pattern in DOCUMENTS for page in compiler.source.glob(pattern)})
    excerpts = [e for page in pages for e in excerpts_of(page.relative_to(compiler.source).as_posix(), page.read_text())]
    for page in pages:  # every fence has been found, and none is indented
        fences = len(re.findall(r'^\s*```', page.read_text(), re.MULTILINE))
        found = sum(e.page == page.relative_to(compiler.source).as_posix() for e in excerpts)
        if fences != 2 * found:
            failures.append(f'{page.name}: {fences} lines of ```, {found} blocks')
    known = {'cpp', 'c', 'glsl', 'js', 'python', 'bash'}
    failures += [f'{e}: "{e.language}" is no language that this test knows' for e in excerpts
                 if e.language not in known | OTHERS]
    excerpts = [e for e in excerpts if e.language in known]
    left_out = [e for e in excerpts if re.fullmatch(r'not compiled: .{12,}', e.how)]
    failures += [f'{e}: "{e.how}" is none of what this test knows' for e in excerpts
                 if e not in left_out and e.how not in ('', 'at file scope')]
    if len(left_out) > MOST_NOT_COMPILED:
        failures.append(f'not compiled: {", ".join(map(str, left_out))}; at most {MOST_NOT_COMPILED} expected')
    excerpts = [e for e in excerpts if e not in left_out]
    if compiler.compile('vulkan.cpp', '#if !__has_include(<vulkan/vulkan_core.h>)\n#error no Vulkan\n#endif\n'):
        print('there are no headers of Vulkan: excerpts that need them are not compiled')
        vulkan = [e for e in excerpts if e.language == 'cpp' and e.page.endswith('vulkan.md')]
        for e in vulkan:
            compiler.cpp.of(e)  # what they presume is presumed all the same
        excerpts = [e for e in excerpts if e not in vulkan]
    failures += compiler.failures(excerpts)
    failures += [f'{name} is presumed by no excerpt' for name in compiler.cpp.unused() + compiler.c.unused()]
    counts = {language: sum(e.language == language for e in excerpts) for language in sorted(known)}
    if not options.glslang:
        counts['glsl'] = 0
    print('\n'.join(failures) or 'excerpts that hold: ' + ', '.join(f'{n} {name}' for name, n in counts.items()) +
          f'; {len(left_out)} are not compiled')
    return 1 if failures else 0


if __name__ == '__main__':
    sys.exit(main())
