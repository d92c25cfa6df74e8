// SPDX-License-Identifier: MIT
// relume/three in headless Chromium: the sample level in three.js against pictures of `relume render`. three comes by npm, and the
// test skips where it cannot.
//   node three_test.mjs PACKAGE RELUME LEVEL WORK
import assert from 'node:assert/strict';
import {execFileSync, spawnSync} from 'node:child_process';
import {existsSync, mkdirSync, readFileSync, writeFileSync} from 'node:fs';
import path from 'node:path';
import {fileURLToPath} from 'node:url';
import {Chromium, needChromium, serve, skip} from './chromium.mjs';

const kThree = '0.187.0';
const [folder, relume, level, work] = process.argv.slice(2);
const program = needChromium(folder, {long: true});
mkdirSync(work, {recursive: true});
const three = path.join(work, 'node_modules', 'three');
if (!existsSync(path.join(three, 'build', 'three.module.js'))) {
  const said = spawnSync('npm', ['install', '--no-save', '--no-audit', '--no-fund', '--prefix', work, `three@${kThree}`], {timeout: 60000, encoding: 'utf8'});
  if (said.status !== 0 || !existsSync(three)) skip(`npm gives no three@${kThree}: ${(said.stderr ?? said.error?.message ?? '').trim().split('\n')[0]}`);
}
// The level with a TEXCOORD_1 of its own, and with extras on its nodes that change nothing.
function withOwnCoordinates(glb) {
  const end = 20 + glb.readUInt32LE(12), root = JSON.parse(glb.subarray(20, end));
  for (const {attributes} of root.meshes.flatMap((mesh) => mesh.primitives)) if ('TEXCOORD_0' in attributes) attributes.TEXCOORD_1 = attributes.TEXCOORD_0;
  for (const node of root.nodes) if ('mesh' in node) ((node.extras ??= {}).relume ??= {}).texelDensity ??= 1;
  const text = Buffer.from(JSON.stringify(root)), padded = Buffer.concat([text, Buffer.alloc(-text.length & 3, ' ')]);
  const out = Buffer.concat([glb.subarray(0, 20), padded, glb.subarray(end)]);
  out.writeUInt32LE(out.length, 8);
  out.writeUInt32LE(padded.length, 12);
  return out;
}
const withOwn = path.join(work, 'small_uv.glb'), bake = path.join(work, 'level.relume');
writeFileSync(withOwn, withOwnCoordinates(readFileSync(level)));
for (const [from, name, preset] of [[level, 'level', 'medium'], [level, 'small', 'draft'], [withOwn, 'small_uv', 'draft']]) {
  execFileSync(relume, ['bake', from, '-o', path.join(work, `${name}.relume`), '--preset', preset, '--progress', 'none', '--export-glb', path.join(work, `${name}_game.glb`)], {stdio: 'pipe'});
}

// Of views, each under one light: stops of exposure that use the picture's 8 bits and clip nothing.
const kViews = [['cam_living', 'lamp', 0], ['cam_living', 'own', 0], ['cam_living', 'sun', 0]];
// The spot of three_page.mjs.
const direction = [0, -2.2, 0.4].map((v) => v / Math.hypot(2.2, 0.4));
writeFileSync(path.join(work, 'own.json'), JSON.stringify([{type: 'spot', name: 'own', position: [1.5, 2.2, 1.5], direction, color: [1, 1, 1], intensity: 25,
                                                            innerConeAngle: 0.6999, outerConeAngle: 0.7}]));
for (const [camera, light, exposure] of kViews) {
  execFileSync(relume, ['render', level, '--bake', bake, '--camera', camera, ...(light === 'own' ? ['--lights', 'none', '--lights-file', path.join(work, 'own.json')] : ['--lights', light]), '--aov', 'indirect', '--size', '320x180', '--exposure', String(exposure),
                        '-o', path.join(work, `${camera}_${light}.png`)], {stdio: 'pipe'});
}

const server = await serve({'/relume/': folder, '/work/': work, '/three/': three, '/': path.dirname(fileURLToPath(import.meta.url))});
const browser = await Chromium.start(program);
try {
  await browser.open(`${server.url}/three_page.html`);
  await browser.ready();
  for (const [camera, light, exposure] of kViews) {
    const found = await browser.run(`tests.indirect('${camera}', '${light}', '/work/${camera}_${light}.png', ${exposure})`);
    console.log(`${camera} ${light}: energy ${(100 * found.energy - 100).toFixed(1)} %, relative RMSE ${(100 * found.rmse).toFixed(1)} % in ${(100 * found.smooth).toFixed(0)} % of the picture, mean ${found.mean.toFixed(3)}`);
    writeFileSync(path.join(work, `${camera}_${light}_three.png`), await browser.screenshot());
    assert.equal(found.backend, 'webgl2');
    assert.ok(found.smooth > 0.4 && found.mean > 0.01);
    assert.ok(Math.abs(found.energy - 1) < 0.02 && found.rmse < 0.1, JSON.stringify(found));
    assert.ok(await browser.run('tests.clean()') <= 100, 'bytes that nothing gave back');
  }
  // What is not Relume's own material, by probes; on the CPU too.
  for (const wasm of [false, true]) {
    const found = await browser.run(`tests.probes('cam_living', 'lamp', ${wasm})`);
    console.log(`probes${wasm ? ' by WebAssembly' : ''}: ${JSON.stringify(found)}`);
    writeFileSync(path.join(work, `probes${wasm ? '_wasm' : ''}.png`), await browser.screenshot());
    assert.equal(found.backend, wasm ? 'wasm' : 'webgl2');
    assert.equal(found.error, 0);
    assert.ok(found.pixels > 500 && found.lit > 0.01 && found.dark === 0, 'the ball has no light but the probes');
    assert.ok(Math.abs(found.energy - 1) < 0.05 && found.rmse < 0.1);
    assert.ok(found.twice === 0 && found.elsewhere === 0, 'probes light what has the light already');
    assert.match(found.refusals[0], /resolution\.y is 0/);
    assert.match(found.refusals[1], /box is empty/);
    const left = await browser.run('tests.clean()');
    assert.ok(left.bytes <= 100 && !left.inScene, JSON.stringify(left));
  }
  const {before, change, meshes, ...reloaded} = await browser.run(`tests.reload('cam_living', 'lamp')`);
  console.log(`a bake replaced: indirect light changes by ${(100 * change).toFixed(3)} %`);
  assert.ok(before > 100 && meshes > 10 && Math.abs(change) < 1e-3, JSON.stringify({before, change, meshes}));
  assert.deepEqual(reloaded, {waits: true, back: true, error: 0});
  assert.ok(await browser.run('tests.clean()') <= 100, 'bytes that nothing gave back');
  const {named, differences, ball, shown, error} = await browser.run(`tests.coordinates('cam_living', 'lamp')`);
  console.log(`coordinates: ${JSON.stringify({named, differences, ball, shown, error})}`);
  assert.ok(named > 10 && differences.every((d) => d < 1e-3) && ball < 1e-3 && shown > 1e-3 && error === 0);
  for (const reversed of [false, true]) {
    const depth = await browser.run(`tests.reversed('cam_living', 'sun', ${reversed})`);
    console.log(`depth ${reversed ? 'reversed' : 'as ever'}: ${JSON.stringify(depth)}`);
    assert.ok(depth.light > 1 && depth.change < 1e-3);
    assert.equal(depth.reversed[0], depth.reversed[1]);
    assert.equal(depth.error, 0);
  }
  const aside = await browser.run(`tests.aside('cam_living', 'lamp')`);
  console.log(`aside: ${JSON.stringify(aside)}`);
  assert.ok(aside.expected.every((v) => v > 1) && Object.values(aside.change).every((v) => v < 1e-5));
  assert.deepEqual([aside.kept, aside.error], [{planes: true, layers: true, headset: true, counts: true}, 0]);
  const fallback = await browser.run(`tests.fallback('cam_living', 'lamp')`);
  console.log(`lights of the fallback: ${JSON.stringify(fallback)}`);
  assert.ok(Object.values(fallback.change).every((v) => v < 1e-6));
  assert.deepEqual([fallback.held, fallback.error], [true, 0]);
  const {warnings: [quiet, warned], refused, ...host} = await browser.run(`tests.host('cam_living', 'lamp')`);
  assert.match(refused, /another renderer; load the bake once more/);
  assert.deepEqual(host, {otherError: 0, asked: ['Bearer key', 'include'], removed: [true, true, 0, 0], error: 0});
  assert.equal(quiet.length, 0);
  assert.equal(warned.length, 1);
  assert.match(warned[0], /moved after applyTo\(\)/);
  const full = await browser.run(`tests.full('cam_living', ['sun', 'lamp'])`);
  writeFileSync(path.join(work, 'full_three.png'), await browser.screenshot());
  assert.equal(full.errors, 0);
  assert.deepEqual(browser.problems, []);
  console.log('passed');
} catch (error) {
  console.log(browser.said.slice(-20).join('\n'));
  throw error;
} finally {
  await browser.close();
  server.close();
}
