// SPDX-License-Identifier: MIT
// bindings/js in headless Chromium: all passes in WebGL 2 against the CPU, lost contexts, fallback, two levels in a page, what is left.
//   node page_test.mjs PACKAGE RELUME LEVEL WORK
import assert from 'node:assert/strict';
import {execFileSync} from 'node:child_process';
import {mkdirSync, statSync} from 'node:fs';
import path from 'node:path';
import {fileURLToPath} from 'node:url';
import {Chromium, needChromium, serve} from './chromium.mjs';

const [folder, relume, level, work] = process.argv.slice(2);
const program = needChromium(folder);
mkdirSync(work, {recursive: true});
const isLong = process.env.RELUME_LONG_TESTS === '1';
const bake = (name, ...options) => {
  const preset = name === 'medium.relume' ? 'medium' : 'draft';
  execFileSync(relume, ['bake', level, '-o', path.join(work, name), '--preset', preset, '--progress', 'none', ...options], {stdio: 'pipe'});
};
bake('level.relume');
if (isLong) bake('medium.relume');
// The first has no light map, the second no grid.
for (const [kind, ...options] of [['cone', '--lightmap-caches', '0'], ['irradiance', '--grid-caches', '0'], ['sh', '--bands', '3']])
  bake(`${kind}.relume`, '--link-kind', kind, '--surfels', '2000', ...options);

const server = await serve({'/relume/': folder, '/work/': work, '/': path.dirname(fileURLToPath(import.meta.url))});
const browser = await Chromium.start(program);
try {
  await browser.open(`${server.url}/page.html`);
  await browser.ready();
  const run = (expression) => browser.run(expression);

  // The CPU's light. Links of kind sh add and take away, so that what nodes are rounded by weighs more.
  const limitOf = (name) => name === 'sh.relume' ? 0.003 : 0.0015;
  const kBakes = [...(isLong ? [['medium.relume', '{}']] : []), ['level.relume', '{}'], ['level.relume', '{lumaBands: 2, chromaBands: 1}, 4'],
                  ['level.relume', '{glossy: true}, 1'], ['cone.relume', '{}'], ['irradiance.relume', '{}'], ['sh.relume', '{}']];
  for (const [name, options] of kBakes) {
    const found = await run(`tests.compare('${name}', ${options})`);
    for (const setup of ['lights', 'sky', 'emission']) {
      assert.deepEqual([!found[setup].map, !found[setup].grid], [name === 'cone.relume', name === 'irradiance.relume']);
      const show = (c) => !c ? 'none' : `${(100 * c.y).toFixed(3)} % in Y, ${(100 * c.chroma).toFixed(3)} % in chroma`;
      console.log(`${name} ${options} ${setup}: light map ${show(found[setup].map)}; grid ${show(found[setup].grid)}`);
      for (const each of [found[setup].map, found[setup].grid].filter(Boolean)) assert.ok(each.rms > 0 && Math.max(each.y, each.chroma) < limitOf(name), JSON.stringify(found));
      assert.equal(found[setup].backend, 'webgl2');
    }
    assert.equal(found.live, 0, 'objects that nothing deleted');
  }

  for (const options of ['{}', '{forceFallback: true}']) {
    const lost = await run(`tests.loseContext('level.relume', ${options})`);
    assert.deepEqual({...lost, rms: lost.rms > 0}, {
      said: ['lost', 'restored'], refused: false, same: true, rms: true, error: 0, bytes: 0,
      made: 'RelumeError: GpuRelighter: the context is lost; make the relighter when it has come back (webglcontextrestored)',
    });
  }

  const fallback = await run(`tests.fallBack('level.relume')`);
  assert.deepEqual({...fallback, y: fallback.y < 0.001}, {
    backend: 'wasm', reasons: ['this WebGL draws into no floating-point textures (EXT_color_buffer_float)'], y: true, error: 0, live: 0,
  });
  assert.ok(browser.said.some((text) => text.startsWith('warning: relume: this WebGL draws into no floating-point')));

  assert.deepEqual(await run(`tests.twoLevels('level.relume', 'sh.relume')`),
                   {state: [true, [1, 2, 3, 4], true, true], same: [true, true], live: 0, error: 0});

  const host = await run(`tests.hostLight('level.relume')`);
  console.log(`the host's own light: ${JSON.stringify(host.found)}`);
  assert.ok(Object.values(host.found).every((y) => y < 0.006) && Object.keys(host.found).length === 5);
  assert.deepEqual([host.live, host.error], [0, 0]);

  const {texts, ...rest} = await run(`tests.refusals('level.relume')`);
  const kTexts = {
    kind: /lights\[0\]\.kind is "sun"/, nan: /lights\[0\]\.intensity/, direction: /lights\[0\]\.direction is \(0, 2, 0\) of length 2, expected 1/, bounce: /bounceScale is 2/,
    size: /surfelIrradiance has 3 elements, expected \d+/, number: /surfelIrradiance is 5, expected \d+ numbers/,
    irradiance: /surfelIrradiance\[1\] is \(NaN, 0, 0\), expected/, patches: /skyPatches\[0\] is \(-1, -1, -1\), expected/, sky: /skyRadiance is \(1e\+30, 0, 0\), expected/,
    element: /lights\[0\] is null/, setup: /setup is null/, visibility: /visibility is for the CPU/, context: /expected a WebGL 2 context/,
    glsl: /light_surfels does not compile: .*nothing/s, side: /a texture of \d+ texels is needed, this WebGL has at most 64/, disposed: /was disposed of/,
  };
  for (const [key, text] of Object.entries(kTexts)) assert.match(texts[key], text);
  assert.ok(!Object.values(texts).some((text) => /not a RelumeError|accepted/.test(text)), JSON.stringify(texts));
  assert.deepEqual({...rest, size: rest.size > 64}, {accepted: true, size: true, live: 0, error: 0});

  const bytes = statSync(path.join(work, 'level.relume')).size;
  const {lost, nowhere, ...loaded} = await run(`tests.loading('level.relume')`);
  assert.match(lost, /the worker failed: its script cannot be loaded; docs\/guide\/web\.md/);
  assert.match(nowhere, /^RelumeError: relume-simd: the module cannot be loaded: .*missing\/relume-simd\.mjs/);
  assert.deepEqual(loaded, {
    texts: {'/work/missing.relume': '/work/missing.relume: HTTP 404 Not Found',
            '/page.html': '/page.html: header magic: expected a Relume bake, found something else'},
    progress: [[0, bytes], [bytes, bytes]], same: true, nested: true, left: 0, simd: true,
  });
  // Chromium itself reports each 404 that was asked for, and nothing else.
  browser.problems = browser.problems.filter((text) => !/404 .*missing/.test(text));
  assert.deepEqual(browser.problems, []);
  console.log('passed');
} catch (error) {
  console.log(browser.said.join('\n'));
  throw error;
} finally {
  await browser.close();
  server.close();
}
