// SPDX-License-Identifier: MIT
// bindings/js in node: the light of the sample level by WebAssembly, with SIMD and without, in this thread and in a worker,
// against the native library's; bad input gives exceptions with the library's text, and nothing leaks.
//   node node_test.mjs PACKAGE RELUME NATIVE_LIGHT LEVEL WORK
import assert from 'node:assert/strict';
import {execFileSync} from 'node:child_process';
import {mkdirSync, readFileSync, writeFileSync} from 'node:fs';
import http from 'node:http';
import path from 'node:path';
import {gzipSync} from 'node:zlib';
import {pathToFileURL} from 'node:url';
import vm from 'node:vm';
import {needPackage} from './chromium.mjs';
import {checkSameRefusals} from './same_refusals.mjs';

const [folder, relume, nativeLight, level, work] = process.argv.slice(2);
needPackage(folder);
const {hasSimd, loadBake, loadModule, MovingShapes, RelumeError, Relighter, WorkerRelighter} = await import(pathToFileURL(path.join(folder, 'src', 'index.js')));
const {packLight} = await import(pathToFileURL(path.join(folder, 'src', 'webgl_lights.js')));

// What the types promise as values is exported. three.js is not here: its module is read as text.
for (const name of ['index', 'webgl', 'three']) {
  const file = (end) => path.join(folder, 'src', `${name}.${end}`);
  const promised = [...readFileSync(file('d.ts'), 'utf8').matchAll(/^export (?:class|function|const) (\w+)/gm)].map((found) => found[1]);
  const text = readFileSync(file('js'), 'utf8');
  const exported = name === 'three' ? [...text.matchAll(/^export (?:(?:class|function|const) |\{)(\w+)/gm)].map((found) => found[1])
                                    : Object.keys(await import(pathToFileURL(file('js'))));
  assert.deepEqual(promised.sort(), exported.sort(), name);
}

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

// What a page downloads: the module with SIMD and its glue, without and with what moves.
for (const [name, most] of [['relume-simd', 159500], ['relume-simd-moving', 189500]]) {
  const download = ['wasm', 'mjs'].map((end) => gzipSync(readFileSync(path.join(folder, 'wasm', `${name}.${end}`)), {level: 9}).length).reduce((a, b) => a + b);
  console.log(`${name}: ${download} bytes through gzip`);
  assert.ok(download <= most, 'docs/notes/web.md says what counts');
}

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
  const irradiance = difference(relighter.irradianceInGrid(positions.map((p, i) => p + 0.05 * normals[i]), normals), native.subarray(count, count + positions.length));
  console.log(`${module.simd ? 'simd' : 'scalar'}: coefficients within ${coefficients.toExponential(1)} of their RMS, ` +
              `irradiance in the grid within ${irradiance.toExponential(1)}`);
  // Kernels of other widths sum in another order, and may round to the next of a cache's units, 2^-14 of what is largest.
  assert.ok(coefficients < 5e-4 && irradiance < 1e-4);
  relighter.dispose();
}

// The box of native_light.cpp.
const box = {
  positions: Array.from({length: 8}, (_, i) => [i & 1 ? 0.4 : -0.4, i & 2 ? 0.3 : -0.3, i & 4 ? 0.5 : -0.5]).flat(),
  triangles: [0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4, 2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5],
  albedo: [0.8, 0.2, 0.1], emission: [0, 2, 1],
};
// In frame i; the 16 numbers are those of three's Matrix4.
const boxAt = (i) => ({shape: 0, toWorld: [0.6, 0, -0.8, 0, 0, 1, 0, 0, 0.8, 0, 0.6, 0, 2 + 0.25 * i, 1, 2, 1]});

async function checkMoving(module) {
  const bake = await loadBake(bytes, {module}), relighter = new Relighter(bake, {movingParts: 2});
  const shapes = new MovingShapes(module, [box]);
  for (let i = 0; i < 4; ++i) relighter.relight({...setup, movingShapes: shapes, movingParts: [boxAt(i)]});
  const count = bake.info.caches * relighter.coefficientsPerCache, expected = native.subarray(native.length - count);
  const found = difference(relighter.coefficients(), expected), without = difference(native.subarray(0, count), expected);
  console.log(`${module.simd ? 'simd' : 'scalar'}, with a box that moves: coefficients within ${found.toExponential(1)} of their RMS; ` +
              `the box changes ${without.toExponential(1)}`);
  assert.ok(found < 5e-4 && without > 0.1);

  // Twelve numbers are the same.
  relighter.reset();
  const rows = boxAt(3).toWorld.filter((_, k) => k % 4 !== 3);
  relighter.relight({...setup, movingShapes: shapes, movingParts: [{shape: 0, toWorld: rows}]});
  const twelve = relighter.coefficients().slice();
  relighter.reset();
  relighter.relight({...setup, movingShapes: shapes, movingParts: [boxAt(3)]});
  assert.deepEqual(relighter.coefficients().slice(), twelve);

  // What is wrong is named, and nothing is applied.
  const part = boxAt(0);
  for (const [bad, text] of [
    [{movingParts: [part]}, /movingParts without movingShapes/], [{movingShapes: shapes, movingParts: [part, part, part]}, /movingParts has 3 elements, expected at most 2/],
    [{movingShapes: shapes, movingParts: [{shape: 1, toWorld: rows}]}, /movingParts\[0\]\.shape is 1/],
    [{movingShapes: shapes, movingParts: [{shape: 0, toWorld: [1, 2]}]}, /toWorld has 2 elements/],
    [{movingShapes: shapes, movingParts: [{toWorld: rows}]}, /movingParts\[0\]\.shape is undefined, expected a whole number/],
    [{movingShapes: shapes, movingParts: [{shape: 0, toWorld: rows.map(() => NaN)}]}, /toWorld has \(nan/], [{movingShapes: {}, movingParts: [part]}, /expected MovingShapes/],
  ]) {
    assert.throws(() => relighter.relight(bad), (e) => e instanceof RelumeError && text.test(e.message) || assert.fail(`${e}, expected ${text}`));
  }
  assert.deepEqual(relighter.coefficients().slice(), twelve);
  for (const [mesh, text] of [[{...box, albedo: []}, /albedo/], [{...box, triangles: [0, 1, 9]}, /triangle/], [{...box, triangles: [0, 1, NaN]}, /triangles\[2\] is NaN, expected a whole number/],
    [{...box, positions: [1]}, /positions has 1 elements/]]) {
    assert.throws(() => new MovingShapes(module, [box, mesh]), (e) => e instanceof RelumeError && text.test(e.message) || assert.fail(`${e}, expected ${text}`));
  }
  assert.throws(() => new Relighter(bake, {movingParts: 257}), /movingParts is 257/);
  assert.throws(() => new Relighter(bake, {movingParts: 1, movingLag: 3}), /movingLag is 3/);
  shapes.dispose();
  shapes.dispose();
  assert.throws(() => relighter.relight({movingShapes: shapes}), /disposed of/);
  relighter.dispose();

  // Memory that shapes and frames with parts take is given back.
  const heap = [];
  for (let i = 0; i < 8; ++i) {
    const again = new MovingShapes(module, [box]), lit = new Relighter(bake, {movingParts: 2});
    for (let frame = 0; frame < 2; ++frame) lit.relight({...setup, movingShapes: again, movingParts: [boxAt(frame)]});
    lit.dispose();
    again.dispose();
    heap.push(module.wasm.HEAPU8.length);
  }
  assert.equal(heap[7], heap[1], 'the heap grows');
  bake.dispose();
}

// What is left of an array whose buffer was handed to a worker.
function handedOn(array) {
  const left = Uint8Array.from(array);
  structuredClone(left, {transfer: [left.buffer]});
  return left;
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
  // WebAssembly would take these for instance 0.
  for (const value of [undefined, NaN, '0', 0.5, -1, 2 ** 32]) {
    for (const read of ['instanceName', 'lightmapCoordinates']) {
      assert.throws(() => bake[read](value), (e) => e instanceof RelumeError && /^instance is .*, expected a whole number/.test(e.message) || assert.fail(`${e}`));
    }
  }
  for (const value of [99, -1, undefined, 'x']) {
    assert.throws(() => relighter.resolveTexels(value), (e) => e instanceof RelumeError && /^texture is .*, expected less than 3/.test(e.message) || assert.fail(`${e}`));
  }

  // Bad setups are refused, and leave last frame's light.
  const kept = relighter.coefficients().slice();
  assert.throws(() => relighter.relight({surfelIrradiance: [1, 2]}), /surfelIrradiance has 2 elements, expected \d+/);
  for (const kind of ['sun', 'toString']) {
    assert.throws(() => relighter.relight({lights: [{kind, intensity: [1, 1, 1]}]}), (e) => e.message.includes(`lights[0].kind is "${kind}"`) || assert.fail(`${e}`));
  }
  for (const [value, text] of [[2, /bounceScale is 2,/], [1.1, /bounceScale is 1\.1,/], [1e-7 - 1, /bounceScale is -0\.9999999,/], [Infinity, /bounceScale is inf/], [NaN, /bounceScale is nan/]]) {
    assert.throws(() => relighter.relight({bounceScale: value}), (e) => e instanceof RelumeError && text.test(e.message) && e.status === 1 || assert.fail(`${e}, expected ${text}`));
  }
  assert.throws(() => relighter.relight({materials: [{material: 'no such', radiance: [1, 1, 1]}]}), /no drivable material "no such"/);
  // What is no array of three would be copied as nothing, and leave what the last frame had there: three's vectors, single numbers.
  class Vector3 { constructor() { Object.assign(this, {x: 1, y: 2, z: 3}); } }
  const lamp = {kind: 'point', intensity: [1, 1, 1], position: [1, 1, 1]};
  for (const [bad, text] of [
    [{lights: [{...lamp, position: new Vector3()}]}, /lights\[0\]\.position is of type Vector3, expected an array of three/],
    [{lights: [lamp, {...lamp, intensity: 20}]}, /lights\[1\]\.intensity is 20, expected an array of three/],
    [{lights: [{kind: 'point'}]}, /lights\[0\]\.intensity is undefined/], [{lights: [{...lamp, direction: [0, -1]}]}, /lights\[0\]\.direction is \[0,-1\]/],
    [{lights: lamp}, /lights is of type Object, expected an array/], [{skyRadiance: 0.1}, /skyRadiance is 0\.1/], [{emissionScale: [1, 1]}, /emissionScale is \[1,1\]/],
    [{materials: [{material: 0, radiance: 3}]}, /materials\[0\]\.radiance is 3/],
    [{materials: [{name: 'panel', radiance: [9, 9, 9]}]}, /materials\[0\]\.material is undefined, expected a name, or a whole number/],
    [{materials: [{material: NaN, radiance: [9, 9, 9]}]}, /materials\[0\]\.material is NaN/], [{materials: [null]}, /materials\[0\] is null, expected an object/],
    [{lights: [lamp, null]}, /lights\[1\] is null, expected an object/], [null, /setup is null, expected an object/],
    [{surfelIrradiance: 5}, /surfelIrradiance is 5, expected \d+ numbers/], [{movingParts: {}}, /movingParts is of type Object/],
  ]) {
    assert.throws(() => relighter.relight(bad), (e) => e instanceof RelumeError && text.test(e.message) && e.status === 1 || assert.fail(`${e}, expected ${text}`));
  }
  assert.throws(() => relighter.irradianceInGrid([1, 2, 3, 4], [0, 1, 0, 0]), /positions has 4 elements, expected 3 numbers for each/);
  assert.throws(() => relighter.irradianceOnLightmap([0.5], [0, 1, 0]), /uvs has 1 elements, expected 2/);
  assert.deepEqual(relighter.coefficients(), kept);
  // Vectors are whatever has three numbers.
  const like = (values) => ({length: 3, ...values}), direction = [0, -0.6, 0.8], intensity = [1, 2, 3];
  const packs = [{direction, intensity}, {direction: new Float32Array(direction), intensity: like(intensity)}].map((vectors) => {
    const packed = new Float32Array(12);
    packLight({kind: 'spot', position: like([4, 5, 6]), ...vectors}, 0, packed);
    return packed;
  });
  assert.ok(packs[0].every((v, i) => Math.abs(v - packs[1][i]) < 1e-6) && packs[0][8] === 1);
  relighter.relight({skyRadiance: like([0, 0, 0])});
  for (const [name, value] of [['direction', new Vector3()], ['direction', [0, -1]], ['intensity', 20], ['position', new Vector3()]]) {
    assert.throws(() => packLight({kind: 'spot', intensity: [1, 1, 1], [name]: value}, 0, new Float32Array(12)),
                  (e) => e instanceof RelumeError && e.message.startsWith(`lights[0].${name} is `) || assert.fail(`${e}`));
  }
  // A visibility that throws: what it did not answer is in shadow, in that frame's light.
  const dark = {lights: setup.lights, bounceScale: 0, emissionScale: [0, 0, 0]};
  relighter.relight({...dark, visibility: (light, count, positions, normals, visible) => visible.fill(0)});
  const inShadow = relighter.coefficients().slice();
  relighter.relight(dark);
  assert.notDeepEqual(relighter.coefficients().slice(), inShadow);
  assert.throws(() => relighter.relight({...dark, visibility() { throw new Error('of the host'); }}), /of the host/);
  assert.deepEqual(relighter.coefficients().slice(), inShadow);
  // In a visibility others may be relit, but not its own relighter.
  const lightAfter = (visibility) => {
    relighter.reset();
    relighter.relight({...setup, visibility});
    return relighter.coefficients().slice();
  };
  const alone = lightAfter(setup.visibility), inner = new Relighter(bake);
  for (const innerVisibility of [setup.visibility, undefined]) {
    let calls = 0;
    assert.deepEqual(lightAfter((...given) => {
      setup.visibility(...given);
      if (calls++ === 0) inner.relight({...setup, visibility: innerVisibility});
    }), alone);
    assert.ok(calls > 1);
    if (innerVisibility) assert.deepEqual(inner.coefficients().slice(), alone);
  }
  for (const call of [() => relighter.relight(), () => relighter.dispose()]) {
    assert.throws(() => lightAfter(call),
                  (e) => e instanceof RelumeError && e.status === 1 && /visibility of the same relighter/.test(e.message) || assert.fail(`${e}`));
  }
  assert.deepEqual(lightAfter(setup.visibility), alone);
  inner.dispose();
  assert.throws(() => new Relighter(bake, {lumaBands: 7}), /lumaBands is 7, expected 1 to 4/);
  for (const name of ['lumaBands', 'chromaBands', 'movingParts', 'movingLag']) {
    assert.throws(() => new Relighter(bake, {[name]: 1.5}), (e) => e instanceof RelumeError && e.message === `${name} is 1.5, expected a whole number from 0 on`);
  }
  assert.throws(() => new Relighter(bake, {lumaBands: 2, chromaBands: 3}), /chromaBands is 3/);
  relighter.reset();
  relighter.dispose();
  relighter.dispose();
  assert.throws(() => relighter.relight(setup), /was disposed of/);
  // And takes no memory any more: so much would make the heap grow.
  const heapBefore = module.wasm.HEAPU8.length, far = new Float32Array(3 * Math.ceil(heapBefore / 12));
  for (const ask of [() => relighter.irradianceInGrid(far, far), () => relighter.irradianceOnLightmap(far.subarray(0, 2), far.subarray(0, 3)),
                     () => relighter.coefficients(), () => relighter.irradianceMap(), () => relighter.resolveTexels(0)]) {
    assert.throws(ask, /was disposed of/);
  }
  assert.equal(module.wasm.HEAPU8.length, heapBefore);
  assert.ok(kept.every(Number.isFinite));
  bake.dispose();
  assert.throws(() => bake.surfels(), /was disposed of/);

  // Bytes that are no bake.
  const damaged = new Uint8Array(bytes);
  damaged[damaged.length >> 1] ^= 0x40;
  for (const [source, text] of [
    [damaged, /checksum/], [bytes.subarray(0, bytes.length >> 1), /file size: truncated/], [bytes.subarray(0, 20), /header/],
    [new Uint8Array(0), /empty file/], [new TextEncoder().encode('<!doctype html>'.repeat(100)), /header magic/], [42, /source is Number, expected a URL/],
    [null, /source is null/], [{}, /source is Object/], [handedOn(bytes), /handed on.*detached/],
    [vm.runInNewContext('new ArrayBuffer(20)'), /header/],  // of another realm
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
await checkMoving(await loadModule({moving: true}));
await checkMoving(await loadModule({moving: true, simd: false}));
checkLight(await loadModule({moving: true}), await loadBake(bytes, {module: await loadModule({moving: true})}));
{
  const still = await loadModule(), bake = await loadBake(bytes, {module: still});
  assert.throws(() => new MovingShapes(still, [box]), (e) => e.status === 5 && /loadModule\(\{moving: true\}\)/.test(e.message));
  assert.throws(() => new Relighter(bake, {movingParts: 1}), (e) => e.status === 5 && /movingParts is 1: .*moving: true/.test(e.message));
  bake.dispose();
}
{
  const bake = await loadBake(bytes), relighter = new Relighter(bake);
  checkSameRefusals(relighter, packLight, RelumeError);
  relighter.dispose();
  bake.dispose();
}
assert.equal(await loadModule(), await loadModule());
for (const [options, text] of [[{folder: new URL('nowhere/', import.meta.url)}, /^relume-simd: the module cannot be loaded: .*nowhere/],
                               [{simd: false, wasmBinary: new Uint8Array([1, 2, 3])}, /^relume-scalar: the module cannot be loaded: .*CompileError/]]) {
  await assert.rejects(loadModule(options), (e) => e instanceof RelumeError && e.status === 2 && text.test(e.message) || assert.fail(`${e}, expected ${text}`));
}

// A name that two drivable materials have drives both.
{
  const glb = readFileSync(level), binAt = 20 + glb.readUInt32LE(12), scene = JSON.parse(glb.toString('utf8', 20, binAt));
  Object.assign(scene.materials.find(({name}) => name === 'plaster'), {name: 'panel', extras: {relume: {drivable: true}}});
  const json = Buffer.from(JSON.stringify(scene)), text = Buffer.concat([json, Buffer.alloc(-json.length & 3, ' ')]), twins = path.join(work, 'twins.glb');
  const head = Buffer.from(glb.subarray(0, 20));
  head.writeUInt32LE(20 + text.length + glb.length - binAt, 8);
  head.writeUInt32LE(text.length, 12);
  writeFileSync(twins, Buffer.concat([head, text, glb.subarray(binAt)]));
  execFileSync(relume, ['bake', twins, '-o', `${twins}.relume`, '--preset', 'draft', '--surfels', '500', '--progress', 'none', '--force'], {stdio: 'pipe'});
  const bake = await loadBake(readFileSync(`${twins}.relume`)), relighter = new Relighter(bake), radiance = [1, 2, 3];
  assert.deepEqual(bake.drivableMaterials, ['panel', 'panel']);
  const lightOf = (...materials) => {
    relighter.reset();
    relighter.relight({materials: materials.map((material) => ({material, radiance}))});
    return relighter.coefficients().slice();
  };
  assert.deepEqual(lightOf('panel'), lightOf(0, 1));
  assert.notDeepEqual(lightOf('panel'), lightOf(0));
  relighter.dispose();
  bake.dispose();
}

// Over HTTP: progress, what is not there, what ends early, what wants a header.
const server = http.createServer((request, response) => {
  if (request.url === '/level.relume') return response.writeHead(200, {'content-length': bytes.length}).end(bytes);
  if (request.url === '/short') {
    response.writeHead(200, {'content-length': bytes.length});
    return response.write(bytes.subarray(0, 1000), () => response.destroy());
  }
  if (request.url === '/endless') return response.writeHead(200).write(bytes.subarray(0, 1000));
  if (request.url === '/locked') return response.writeHead(request.headers['x-key'] === 'mine' ? 200 : 401).end(bytes);
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
await assert.rejects(loadBake(url('locked')), /locked: HTTP 401/);
(await loadBake(url('locked'), {headers: {'x-key': 'mine'}})).dispose();
(await WorkerRelighter.create(url('locked'), {headers: new Headers({'x-key': 'mine'})})).dispose();
// What comes in parts, whose first is shorter than what is looked for in it: the sign of gzip, the size in the header.
{
  const {fetch} = globalThis, loadParts = (parts) => {
    globalThis.fetch = async () => new Response(new ReadableStream({
      start(stream) {
        parts.forEach((part) => stream.enqueue(new Uint8Array(part)));
        stream.close();
      },
    }));
    return loadBake('in parts', {onProgress() {}});
  };
  const after = (file, first) => [file.subarray(0, first), file.subarray(first)];
  try {
    for (const file of [zipped, packed]) (await loadParts(after(file, 1))).dispose();
    (await loadParts([zipped.subarray(0, 0), ...after(zipped, 1)])).dispose();
    await assert.rejects(loadParts([zipped.subarray(0, 1)]), (e) => e instanceof RelumeError && /header/.test(e.message) || assert.fail(`${e}`));
    // 15 bytes of gzip's own, then the file as it is: the first 16 bytes of it come alone.
    const swollen = gzipSync(Buffer.concat([packed, Buffer.alloc(1 << 20)]), {level: 0});
    await assert.rejects(loadParts(after(swollen, 31)), (e) => e instanceof RelumeError && /gzip: more than the \d+ bytes/.test(e.message) || assert.fail(`${e}`));
  } finally {
    globalThis.fetch = fetch;
  }
}
// The browser's own ways: cookies of other origins, and no DecompressionStream in old ones.
{
  const {fetch, DecompressionStream} = globalThis;
  try {
    globalThis.fetch = async (source, {credentials}) => new Response(credentials === 'include' ? bytes : null);
    (await loadBake('with cookies', {credentials: 'include'})).dispose();
    delete globalThis.DecompressionStream;
    await assert.rejects(loadBake(zipped), (e) => e instanceof RelumeError && e.status === 5 && /^gzip: .*without gzip/.test(e.message) || assert.fail(`${e}`));
  } finally {
    Object.assign(globalThis, {fetch, DecompressionStream});
  }
}
// What the host itself ends a download with comes out as it is.
{
  const own = new Error('of the host'), isOwn = (e) => e === own || assert.fail(`${e}, expected the host's own`);
  const ended = (reason) => {
    const stop = new AbortController();
    stop.abort(reason);
    return stop.signal;
  };
  await assert.rejects(loadBake(url('level.relume'), {signal: ended()}), {name: 'AbortError'});
  await assert.rejects(loadBake(url('level.relume'), {signal: ended(own)}), isOwn);
  for (const onProgress of [undefined, () => {}]) await assert.rejects(loadBake(url('endless'), {signal: AbortSignal.timeout(100), onProgress}), {name: 'TimeoutError'});
  const stop = new AbortController();
  await assert.rejects(loadBake(url('endless'), {signal: stop.signal, onProgress: (received) => received > 0 && stop.abort(own)}), isOwn);
  await assert.rejects(loadBake(url('level.relume'), {onProgress() { throw own; }}), isOwn);
}

// In a worker, with a box that moves.
{
  const moved = await WorkerRelighter.create(url('level.relume'), {movingParts: 1, module: {moving: true}});
  const module = await loadModule({moving: true}), lit = new Relighter(await loadBake(bytes, {module}), {movingParts: 1});
  const shapes = new MovingShapes(module, [box]), {visibility, ...rest} = setup, movingParts = [boxAt(0)];
  await assert.rejects(moved.relight({...rest, movingParts}), /movingParts without movingShapes/);
  await moved.setMovingShapes([box]);
  const frame = await moved.relight({...rest, movingParts}, ['coefficients']);
  lit.relight({...rest, movingParts, movingShapes: shapes});
  assert.deepEqual(frame.coefficients, lit.coefficients());
  moved.dispose();
}

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
// Where it dies, the calls that wait and those that come are refused.
{
  const dying = await WorkerRelighter.create(bytes), wait = dying.relight(rest);
  dying.worker.terminate();
  await assert.rejects(Promise.all([wait, dying.relight(rest)]), (e) => e instanceof RelumeError && /the worker ended with 1/.test(e.message) || assert.fail(`${e}`));
  await assert.rejects(dying.relight(rest), /the worker ended with 1/);
  dying.dispose();
  await assert.rejects(WorkerRelighter.create(bytes, {worker: new URL('nowhere.js', import.meta.url)}), /the worker failed: .*nowhere\.js/);
  // The module's folder and the worker's own script, where they lie elsewhere.
  const moved = await WorkerRelighter.create(bytes, {worker: pathToFileURL(path.join(folder, 'src', 'worker.js')), module: {folder: pathToFileURL(path.join(folder, 'wasm/'))}});
  await moved.relight(rest);
  moved.dispose();
}
const late = worker.relight(rest);
worker.dispose();
await assert.rejects(late, /was disposed of/);
await assert.rejects(worker.relight(rest), /was disposed of/);
await assert.rejects(WorkerRelighter.create(url('missing.relume')), /HTTP 404/);
await assert.rejects(WorkerRelighter.create(new Uint8Array(1000)), /header magic/);
server.close();
server.closeAllConnections();
console.log('passed');
