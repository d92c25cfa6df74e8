// SPDX-License-Identifier: MIT
// bindings/js in node: the light of the sample level by WebAssembly, with SIMD and without, in this thread and in a worker,
// against the native library's; bad input gives exceptions with the library's text, and nothing leaks.
//   node node_test.mjs PACKAGE RELUME NATIVE_LIGHT LEVEL WORK
import assert from 'node:assert/strict';
import {execFileSync} from 'node:child_process';
import {mkdirSync, readFileSync} from 'node:fs';
import http from 'node:http';
import path from 'node:path';
import {gzipSync} from 'node:zlib';
import {pathToFileURL} from 'node:url';
import {needPackage} from './chromium.mjs';

const [folder, relume, nativeLight, level, work] = process.argv.slice(2);
needPackage(folder);
const {hasSimd, loadBake, loadModule, RelumeError, Relighter, WorkerRelighter} = await import(pathToFileURL(path.join(folder, 'src', 'index.js')));

mkdirSync(work, {recursive: true});
const bakeFile = path.join(work, 'level.relume'), nativeFile = path.join(work, 'native.bin');
execFileSync(relume, ['bake', level, '-o', bakeFile, '--preset', 'draft', '--progress', 'none'], {stdio: 'pipe'});
execFileSync(nativeLight, [bakeFile, nativeFile]);
const bytes = readFileSync(bakeFile);
const packedFile = path.join(work, 'packed.relume');
execFileSync(relume, ['pack', bakeFile, '-o', packedFile, '--force'], {stdio: 'pipe'});
execFileSync(relume, ['pack', bakeFile, '-o', `${packedFile}.gz`, '--force'], {stdio: 'pipe'});
const packed = readFileSync(packedFile), zipped = readFileSync(`${packedFile}.gz`);
const native = new Float32Array(readFileSync(nativeFile).buffer.slice(0));

// What a page downloads: the module with SIMD and its glue.
const download = ['wasm', 'mjs'].map((end) => gzipSync(readFileSync(path.join(folder, 'wasm', `relume-simd.${end}`)), {level: 9}).length).reduce((a, b) => a + b);
console.log(`${download} bytes through gzip`);
assert.ok(download <= 156000, 'docs/notes/web.md says what counts');

// The frames of native_light.cpp.
const setup = {
  lights: [
    {kind: 'directional', intensity: [9, 8, 7], direction: [0, -1, 0]},
    {kind: 'spot', intensity: [20, 30, 40], position: [1, 1.5, -1], direction: [0, 0, -1], innerConeAngle: 0.5, outerConeAngle: 1},
  ],
  skyRadiance: [0.1, 0.2, 0.4], emissionScale: [1, 0.5, 2], bounceScale: 0.9,
  visibility(light, count, positions, normals, visible) {
    for (let i = 0; i < count; ++i) visible[i] = light === 0 && positions[3 * i + 1] > 1.5 ? 0.25 : 1;
  },
};

const rms = (values) => Math.sqrt(values.reduce((sum, v) => sum + v * v, 0) / values.length);
// Largest difference over the RMS of what is expected.
function difference(found, expected) {
  assert.equal(found.length, expected.length);
  const scale = rms(expected);
  assert.ok(scale > 0);
  return found.reduce((max, v, i) => Math.max(max, Math.abs(v - expected[i])), 0) / scale;
}

function checkLight(module, bake) {
  const relighter = new Relighter(bake);
  for (let i = 0; i < 4; ++i) relighter.relight(setup);
  const count = bake.info.caches * relighter.coefficientsPerCache;
  const coefficients = difference(relighter.coefficients(), native.subarray(0, count));
  const {positions, normals} = bake.surfels();
  const irradiance = difference(relighter.irradianceInGrid(positions.map((p, i) => p + 0.05 * normals[i]), normals), native.subarray(count));
  console.log(`${module.simd ? 'simd' : 'scalar'}: coefficients within ${coefficients.toExponential(1)} of their RMS, ` +
              `irradiance in the grid within ${irradiance.toExponential(1)}`);
  // Kernels of other widths sum in another order, and may round to the next of a cache's units, 2^-14 of what is largest.
  assert.ok(coefficients < 5e-4 && irradiance < 1e-4);
  relighter.dispose();
}

async function checkModule(module) {
  const before = module.liveBytes;
  const bake = await loadBake(bytes, {module});
  checkLight(module, bake);

  // What resolves by textures.
  const relighter = new Relighter(bake);
  relighter.relight(setup);
  const {textures, glsl, grid} = relighter.textureResolve();
  assert.ok(glsl.includes('relumeIrradianceLightmap') && grid.length === 24);
  assert.deepEqual(textures.map((t) => t.sampler), ['relumeLightmap', 'relumeGridCaches', 'relumeGridWords']);
  textures.forEach((texture, i) => assert.equal(relighter.resolveTexels(i).length, texture.bytes));
  assert.ok(relighter.resolveTexels(0).some((byte) => byte !== 0));
  assert.equal(relighter.irradianceMap().length, 4 * bake.info.lightmapWidth * bake.info.lightmapHeight);
  // Host light in place of the lights, and light-map coordinates.
  const light = new Float32Array(3 * bake.info.surfels).fill(2);
  relighter.relight({surfelIrradiance: light, bounceScale: 0});
  const once = relighter.coefficients().slice();
  relighter.relight({surfelIrradiance: light.map((v) => 2 * v), bounceScale: 0, emissionScale: [2, 2, 2]});
  assert.ok(difference(relighter.coefficients().map((v) => v / 2), once) < 1e-2);
  assert.ok(bake.lightmapCoordinates(0).length > 0 && bake.instanceName(0) !== '');

  // Bad setups are refused, and leave last frame's light.
  const kept = relighter.coefficients().slice();
  assert.throws(() => relighter.relight({surfelIrradiance: [1, 2]}), /surfelIrradiance has 2 elements, expected \d+/);
  assert.throws(() => relighter.relight({lights: [{kind: 'sun', intensity: [1, 1, 1]}]}), /lights\[0\]\.kind is "sun"/);
  for (const [value, text] of [[2, /bounceScale is 2,/], [1.1, /bounceScale is 1\.1,/], [1e-7 - 1, /bounceScale is -0\.9999999,/], [Infinity, /bounceScale is inf/], [NaN, /bounceScale is nan/]]) {
    assert.throws(() => relighter.relight({bounceScale: value}), (e) => e instanceof RelumeError && text.test(e.message) && e.status === 1 || assert.fail(`${e}, expected ${text}`));
  }
  assert.throws(() => relighter.relight({materials: [{material: 'no such', radiance: [1, 1, 1]}]}), /no drivable material "no such"/);
  assert.throws(() => relighter.relight({lights: setup.lights, visibility() { throw new Error('of the host'); }}), /of the host/);
  assert.throws(() => new Relighter(bake, {lumaBands: 7}), /lumaBands is 7, expected 1 to 4/);
  assert.throws(() => new Relighter(bake, {lumaBands: 2, chromaBands: 3}), /chromaBands is 3/);
  relighter.reset();
  relighter.dispose();
  relighter.dispose();
  assert.throws(() => relighter.relight(setup), /was disposed of/);
  assert.ok(kept.every(Number.isFinite));
  bake.dispose();
  assert.throws(() => bake.surfels(), /was disposed of/);

  // Bytes that are no bake.
  const damaged = new Uint8Array(bytes);
  damaged[damaged.length >> 1] ^= 0x40;
  for (const [source, text] of [
    [damaged, /checksum/], [bytes.subarray(0, bytes.length >> 1), /file size: truncated/], [bytes.subarray(0, 20), /header/],
    [new Uint8Array(0), /empty file/], [new TextEncoder().encode('<!doctype html>'.repeat(100)), /header magic/], [42, /source is Number, expected a URL/],
    [null, /source is null/], [{}, /source is Object/],
  ]) {
    await assert.rejects(loadBake(source, {module}), (e) => e instanceof RelumeError && text.test(e.message) || assert.fail(`${e}, expected ${text}`));
  }
  // Packed, and through gzip: the same bake. Damaged, or far more than it says: refused.
  for (const source of [packed, zipped]) {
    const same = await loadBake(source, {module});
    checkLight(module, same);
    same.dispose();
  }
  const swollen = gzipSync(Buffer.concat([packed, Buffer.alloc(1 << 24)]));
  for (const [source, text] of [[zipped.subarray(0, zipped.length >> 1), /^gzip: /], [swollen, /^gzip: more than the \d+ bytes/],
                                [gzipSync(Buffer.from('<!doctype html>'.repeat(100))), /^gzip: more than|header magic/]]) {
    await assert.rejects(loadBake(source, {module}), (e) => e instanceof RelumeError && text.test(e.message) || assert.fail(`${e}, expected ${text}`));
  }
  // A copy that lies askew in its buffer.
  const askew = new Uint8Array(bytes.length + 3);
  askew.set(bytes, 3);
  (await loadBake(askew.subarray(3), {module})).dispose();
  assert.equal(module.liveBytes, Math.max(before, 100), 'bytes that nothing gave back');

  // The heap does not grow from frame to frame, nor from bake to bake.
  const heap = [];
  for (let i = 0; i < 12; ++i) {
    const again = await loadBake(bytes, {module}), lit = new Relighter(again);
    again.dispose();
    for (let frame = 0; frame < 3; ++frame) lit.relight(setup), lit.coefficients();
    lit.dispose();
    await assert.rejects(loadBake(damaged, {module}));
    heap.push(module.wasm.HEAPU8.length);
  }
  assert.equal(heap[11], heap[1], 'the heap grows');
}

assert.ok(hasSimd());
await checkModule(await loadModule({simd: true}));
await checkModule(await loadModule({simd: false}));
assert.equal(await loadModule(), await loadModule());

// Over HTTP: progress, what is not there, what ends early.
const server = http.createServer((request, response) => {
  if (request.url === '/level.relume') return response.writeHead(200, {'content-length': bytes.length}).end(bytes);
  if (request.url === '/short') {
    response.writeHead(200, {'content-length': bytes.length});
    return response.write(bytes.subarray(0, 1000), () => response.destroy());
  }
  response.writeHead(404).end('no');
}).listen(0, '127.0.0.1');
await new Promise((done) => server.once('listening', done));
const url = (name) => `http://127.0.0.1:${server.address().port}/${name}`;
const progress = [];
const bake = await loadBake(url('level.relume'), {onProgress: (received, total) => progress.push([received, total])});
checkLight(bake.module, bake);
bake.dispose();
assert.deepEqual(progress[0], [0, bytes.length]);
assert.deepEqual(progress.at(-1), [bytes.length, bytes.length]);
await assert.rejects(loadBake(url('missing.relume')), /missing\.relume: HTTP 404 Not Found/);
await assert.rejects(loadBake(url('short'), {onProgress() {}}), /short: ended early/);
await assert.rejects(loadBake('http://127.0.0.1:1/level.relume'), /cannot be fetched/);
const stop = new AbortController();
stop.abort();
await assert.rejects(loadBake(url('level.relume'), {signal: stop.signal}), {name: 'AbortError'});

// In a worker.
const worker = await WorkerRelighter.create(url('level.relume'), {onProgress() {}});
const {visibility, ...rest} = setup;
const here = new Relighter(await loadBake(bytes));
let frame;
for (let i = 0; i < 3; ++i) {
  here.relight(rest);
  frame = await worker.relight(rest, ['coefficients', 'textures', 'irradianceMap']);
}
assert.deepEqual(frame.coefficients, here.coefficients());
assert.deepEqual(frame.textures[0], here.resolveTexels(0).slice());
assert.deepEqual(worker.still[2], here.resolveTexels(2).slice());
assert.ok(frame.ms > 0 && frame.irradianceMap.length > 0);
await assert.rejects(worker.relight({bounceScale: 3}), (e) => e instanceof RelumeError && /bounceScale/.test(e.message));
await assert.rejects(worker.relight(setup), /could not be cloned/);
await worker.reset();
const late = worker.relight(rest);
worker.dispose();
await assert.rejects(late, /was disposed of/);
await assert.rejects(worker.relight(rest), /was disposed of/);
await assert.rejects(WorkerRelighter.create(url('missing.relume')), /HTTP 404/);
await assert.rejects(WorkerRelighter.create(new Uint8Array(1000)), /header magic/);
server.close();
server.closeAllConnections();
console.log('passed');
