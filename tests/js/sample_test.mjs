// SPDX-License-Identifier: MIT
// samples/05_web, built by its one command, in headless Chromium: wide and as on a phone, the lamp dragged, the three ways to show light, two levels
// chosen in a row, a level that does not load whole.
//   node sample_test.mjs PACKAGE RELUME SAMPLE WORK
import assert from 'node:assert/strict';
import {spawnSync} from 'node:child_process';
import {copyFileSync, mkdirSync, writeFileSync} from 'node:fs';
import path from 'node:path';
import {Chromium, needChromium, serve, skip} from './chromium.mjs';

const [folder, relume, sample, work] = process.argv.slice(2);
const program = needChromium(folder, {long: true});
if (spawnSync('npm', ['view', 'three', 'version'], {timeout: 30000}).status !== 0) skip('npm reaches no registry for three');
mkdirSync(work, {recursive: true});
const out = path.join(work, 'page'), env = {...process.env, RELUME: relume, RELUME_NPM: folder, PRESET: 'draft'};
const level = path.join(sample, '..', 'level', 'two_rooms.glb'), again = path.join(work, 'again.glb');
copyFileSync(level, again);
const built = spawnSync(path.join(sample, 'build.sh'), [out, level, again], {env, encoding: 'utf8', timeout: 900000});
assert.equal(built.status, 0, built.stderr);
const missing = spawnSync(path.join(sample, 'build.sh'), [out, 'missing.glb'], {env, encoding: 'utf8'});
assert.ok(missing.status === 1 && /missing\.glb: there is no such level/.test(missing.stderr));
const twin = path.join(work, 'elsewhere', 'again.gltf');
mkdirSync(path.dirname(twin), {recursive: true});
copyFileSync(level, twin);
const twins = spawnSync(path.join(sample, 'build.sh'), [out, again, twin], {env, encoding: 'utf8'});
assert.ok(twins.status === 1 && /again\.glb and .*again\.gltf would both be the page's level again/.test(twins.stderr), twins.stderr);
// A level whose bake alone is there.
copyFileSync(path.join(out, 'levels', 'again.relume.gz'), path.join(out, 'levels', 'half.relume.gz'));

const server = await serve({'/': out});
for (const [name, size] of Object.entries({wide: {width: 960, height: 540}, phone: {width: 390, height: 800}})) {
  const browser = await Chromium.start(program, size);
  // Frames go by in SwiftShader's time.
  const frames = (count) => browser.run(`new Promise((done) => { let n = ${count}; const next = () => (n-- > 0 ? requestAnimationFrame(next) : done()); next(); })`);
  try {
    await browser.open(`${server.url}/index.html`);
    await browser.ready();
    assert.equal(await browser.run('document.getElementById("status").textContent'), '');
    // Nothing hangs over the window's edge.
    assert.ok(await browser.run('document.documentElement.scrollWidth <= innerWidth && document.querySelector("canvas").clientHeight > innerHeight / 3'));
    const pictures = {};
    for (const show of ['direct', 'indirect', 'both']) {
      await browser.run(`document.querySelector('input[value=${show}]').click()`);
      await frames(4);
      pictures[show] = await browser.screenshot();
      writeFileSync(path.join(work, `${name}_${show}.png`), pictures[show]);
    }
    assert.ok(!pictures.direct.equals(pictures.both) && !pictures.indirect.equals(pictures.both));
    assert.match(await browser.run('document.getElementById("times").textContent'), /^frame [\d.]+ ms.*WebGL 2.*8192 surfels/);
    // The lamp stands before the camera, 0.3 m above the middle of the view.
    const {x, y, width, height} = await browser.run('(({x, y, width, height}) => ({x, y, width, height}))(document.querySelector("canvas").getBoundingClientRect())');
    const at = {x: x + width / 2, y: y + height / 2 - height * 0.3 / 2.5 / (2 * Math.tan(0.525))};
    const mouse = (type, dx) => browser.send('Input.dispatchMouseEvent', {type, x: at.x + dx, y: at.y, button: 'left', buttons: 1, clickCount: 1});
    await mouse('mousePressed', 0);
    for (const dx of [10, 40, width / 4]) await mouse('mouseMoved', dx);
    await mouse('mouseReleased', width / 4);
    await frames(4);
    const dragged = await browser.screenshot();
    writeFileSync(path.join(work, `${name}_dragged.png`), dragged);
    assert.ok(!dragged.equals(pictures.both));
    // Two choices in a row: the level of the last one alone is in the scene. three's classes are the page's.
    await browser.run(`import('three').then(({Object3D}) => {
      const {add} = Object3D.prototype;
      Object3D.prototype.add = function (...objects) {
        if (this.isScene) window.scene = this;
        return add.apply(this, objects);
      };
      const select = document.getElementById('level');
      for (const name of ['again', 'two_rooms']) {
        select.value = name;
        select.dispatchEvent(new Event('change'));
      }
    })`);
    const roots = '(window.scene?.children.filter((object) => object.isGroup).length ?? 0)';
    const loaded = `performance.getEntriesByType('resource').filter(({name}) => /levels\\/.*(glb|gz)$/.test(name)).length`;
    await browser.until(async () => await browser.run(`${loaded} === 6 && ${roots} > 0`), 'the levels do not load');
    await frames(10);
    assert.equal(await browser.run(roots), 1, 'levels in the scene');
    assert.deepEqual(browser.problems, []);
    // The level `half` has no .glb, and the answer that says so is held back: once another is shown, nobody hears of it.
    await browser.run(`import('./relume/src/index.js').then(async ({loadModule}) => {
      const module = await loadModule(), select = document.getElementById('level'), {fetch} = window;
      const held = new Promise((done) => (window.answer = done));
      window.fetch = async (request, ...rest) => {
        if (/half\\.glb$/.test(request.url ?? request)) await held;
        return fetch(request, ...rest);
      };
      select.add(new Option('half'));
      window.choose = (name) => {
        select.value = name;
        select.dispatchEvent(new Event('change'));
      };
      window.liveBytes = () => module.liveBytes;
    })`);
    const status = () => browser.run('document.getElementById("status").textContent'), liveBytes = () => browser.run('liveBytes()');
    const isRefused = async () => browser.problems.some((text) => /404.*half\.glb/.test(text));
    const ofOne = await liveBytes();
    await browser.run('scene = null, choose("half"), choose("two_rooms")');
    await browser.until(async () => await browser.run(`${roots} > 0 && ${loaded} === 9`), 'the level does not load');
    await browser.run('answer()');
    await browser.until(isRefused, 'half.glb is not refused');
    await frames(10);
    assert.deepEqual([await status(), await browser.run(roots), await liveBytes()], ['', 1, ofOne]);
    // Chosen last, it says so, and its bake is given back.
    await browser.run('choose("half")');
    await browser.until(async () => /half\.glb.*404/.test(await status()), 'no status of half.glb');
    await frames(10);
    assert.equal(await browser.run(roots), 0, 'levels in the scene');
    assert.ok(await liveBytes() < ofOne / 2, `${await liveBytes()} bytes, ${ofOne} with a level`);
    assert.deepEqual(browser.problems.filter((text) => !/half\.glb/.test(text)), []);
  } catch (error) {
    console.log(browser.said.slice(-20).join('\n'));
    throw error;
  } finally {
    await browser.close();
  }
}
server.close();
console.log('passed');
