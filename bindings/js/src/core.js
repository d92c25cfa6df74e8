// SPDX-License-Identifier: MIT
// Bakes and the relighter on the CPU, as WebAssembly: in pages, in workers and in node. What is computed, and every unit, is
// that of include/relume/relume.h; index.d.ts says what JavaScript hands over. Bake and Relighter own memory of the module,
// which no garbage collector sees: dispose() of both gives it back.

import {countOf, forgotten, kInvalidFile, kIo, kMemory, kUnsupported, kUsage, list, object, RelumeError, sized, vector, whole} from './errors.js';
import {kModuleFiles} from './module_files.js';
import {handParts, requireMoving, shapesOf} from './moving.js';

export {RelumeError};

// A function that gives a vector of 16 bytes: valid where there is SIMD.
const kSimdProbe = new Uint8Array([0, 97, 115, 109, 1, 0, 0, 0, 1, 5, 1, 96, 0, 1, 123, 3, 2, 1, 0, 10, 8, 1, 6, 0, 65, 0, 253, 15, 11]);

export function hasSimd() {
  return typeof WebAssembly === 'object' && WebAssembly.validate(kSimdProbe);
}

export const isNode = typeof process === 'object' && typeof process.versions?.node === 'string';

// One module for all bakes of a page, unless options ask for one of their own.
let shared = null;

export function loadModule(options = {}) {
  if (Object.keys(options).length > 0) return makeModule(options);
  shared ??= makeModule(options).catch((error) => {
    shared = null;  // the next call tries again
    throw error;
  });
  return shared;
}

async function makeModule({simd = hasSimd(), moving = false, folder, wasmBinary} = {}) {
  const name = `relume-${simd ? 'simd' : 'scalar'}${moving ? '-moving' : ''}`;
  const fileOf = (end) => (folder ? new URL(`${name}.${end}`, folder) : kModuleFiles[`${name}.${end}`]());
  const callbacks = new Map();
  try {
    const make = (await import(/* webpackIgnore: true */ /* @vite-ignore */ fileOf('mjs').href)).default;
    if (!wasmBinary && isNode) {
      const files = 'node:fs/promises';  // in a variable, so that bundlers for pages let it be
      wasmBinary = await (await import(/* webpackIgnore: true */ /* @vite-ignore */ files)).readFile(fileOf('wasm'));
    }
    const wasm = await make({
      ...(wasmBinary ? {wasmBinary} : {}),
      locateFile: () => fileOf('wasm').href,
      relumeVisibility: (relighter, ...given) => callbacks.get(relighter)(...given),
    });
    return new Module(wasm, callbacks, simd);
  } catch (error) {
    throw new RelumeError(`${name}: the module cannot be loaded: ${error?.message ?? error}`, kIo);
  }
}

export class Module {
  constructor(wasm, callbacks, simd) {
    this.wasm = wasm;
    this.callbacks = callbacks;  // visibility of the relighters that are being relit, by their address
    this.simd = simd;
    this.moving = wasm._relume_web_shapes !== undefined;
  }
  get version() {
    return this.wasm.UTF8ToString(this.wasm._relume_version());
  }
  // Bytes that bakes and relighters hold.
  get liveBytes() {
    return this.wasm._relume_web_live_bytes();
  }
  // Views of the memory as it is now: they end when memory grows.
  floats(address, count) {
    return new Float32Array(this.wasm.HEAPU8.buffer, address, count);
  }
  words(address, count) {
    return new Uint32Array(this.wasm.HEAPU8.buffer, address, count);
  }
  bytes(address, count) {
    return new Uint8Array(this.wasm.HEAPU8.buffer, address, count);
  }
  text(address) {
    return this.wasm.UTF8ToString(address);
  }
  allocate(bytes) {
    const address = this.wasm._malloc(Math.max(bytes, 4));
    if (address === 0) throw new RelumeError(`out of memory: ${bytes} bytes`, kMemory);
    return address;
  }
}

const megabytes = (bytes) => `${(bytes / 1048576).toFixed(1)} MiB`;

// What use() promises. Its failure is told by `text`, but for the reason of a signal, which is the host's own.
async function download(use, text, signal) {
  try {
    return await use();
  } catch (error) {
    if (signal?.aborted) throw signal.reason ?? error;
    throw new RelumeError(`${text}: ${error?.cause?.message ?? error?.message ?? error}`, kIo);
  }
}

// Bytes of a response, with onProgress(received, total or 0) as they come; what that throws ends the download. read(use): as download().
async function readBody(response, onProgress, read) {
  // What is packed on the way has a length that is not the file's.
  const total = response.headers.get('content-encoding') ? 0 : Number(response.headers.get('content-length')) || 0;
  if (!response.body || !onProgress) return [new Uint8Array(await read(() => response.arrayBuffer()))];
  const parts = [], reader = response.body.getReader();
  let received = 0;
  try {
    onProgress(0, total);
    for (;;) {
      const {done, value} = await read(() => reader.read());
      if (done) return parts;
      parts.push(value);
      received += value.length;
      onProgress(received, total);
    }
  } catch (error) {
    reader.cancel().catch(() => {});
    throw error;
  }
}

// Also of another realm, as an iframe's, whose class is another one.
const isArrayBuffer = (value) => Object.prototype.toString.call(value) === '[object ArrayBuffer]';

// The parts of what `source` names or is.
async function readSource(source, {onProgress, signal, headers, credentials}) {
  try {
    if (isArrayBuffer(source)) return [new Uint8Array(source)];
    if (ArrayBuffer.isView(source)) return [new Uint8Array(source.buffer, source.byteOffset, source.byteLength)];
  } catch {
    throw new RelumeError('loadBake: the bytes of source were handed on, as to a worker (a detached ArrayBuffer)', kUsage);
  }
  if (typeof source !== 'string' && !(source instanceof URL)) {
    const what = source === null ? 'null' : (source?.constructor?.name ?? typeof source);
    throw new RelumeError(`loadBake: source is ${what}, expected a URL, an ArrayBuffer or a view of one`, kUsage);
  }
  const response = await download(() => fetch(source, {signal, headers, credentials}), `${source}: cannot be fetched`, signal);
  if (!response.ok) {
    throw new RelumeError(`${source}: HTTP ${response.status} ${response.statusText}`.trimEnd(), kIo);
  }
  return readBody(response, onProgress, (use) => download(use, `${source}: ended early`, signal));
}

// The first `count` bytes of parts, or as many as they have: a part may be as short as one.
function firstBytes(parts, count) {
  const bytes = [];
  for (const part of parts) bytes.push(...part.subarray(0, count - bytes.length));
  return new Uint8Array(bytes);
}

function isGzip(parts) {
  const [first, second] = firstBytes(parts, 2);
  return first === 0x1f && second === 0x8b;
}

const kSizeAt = 24, kSizeEnd = 32;  // [byte] of a bake's header, where it says how long the file is

// The parts of a bake that went through gzip (`relume pack -o OUT.relume.gz`). No more is unpacked than the bake's header says it has.
async function unpackGzip(parts, name) {
  if (typeof DecompressionStream !== 'function') {
    throw new RelumeError(`${name}gzip: this browser unpacks none (DecompressionStream): serve the bake without gzip`, kUnsupported);
  }
  const reader = new Blob(parts).stream().pipeThrough(new DecompressionStream('gzip')).getReader();
  const unpacked = [];
  let size = 0, most = Infinity;
  try {
    for (;;) {
      const {done, value} = await reader.read();
      if (done) return unpacked;
      unpacked.push(value);
      size += value.length;
      if (most === Infinity && size >= kSizeEnd) {
        most = Number(new DataView(firstBytes(unpacked, kSizeEnd).buffer).getBigUint64(kSizeAt, true));
      }
      if (size > most) throw new Error(`more than the ${most} bytes that its header names`);
    }
  } catch (error) {
    reader.cancel().catch(() => {});
    throw new RelumeError(`${name}gzip: ${error?.cause?.message ?? error?.message ?? error}`, kInvalidFile);
  }
}

export async function loadBake(source, options = {}) {
  const name = typeof source === 'string' || source instanceof URL ? `${source}: ` : '';
  const [module, received] = await Promise.all([options.module ?? loadModule(), readSource(source, options)]);
  const parts = isGzip(received) ? await unpackGzip(received, name) : received;
  const size = parts.reduce((sum, part) => sum + part.length, 0);
  const file = module.wasm._relume_web_file(size);
  if (file === 0) throw new RelumeError(`${name}out of memory: a bake of ${megabytes(size)}`, kMemory);
  let at = file;
  for (const part of parts) {
    module.wasm.HEAPU8.set(part, at);
    at += part.length;
  }
  const bake = module.wasm._relume_web_bake(file, size);
  if (bake === 0) throw new RelumeError(name + module.text(module.wasm._relume_web_error()), kInvalidFile);
  return new Bake(module, bake);
}

export class Bake {
  constructor(module, address) {
    this.module = module;
    this.address = address;
    const wasm = module.wasm;
    forgotten?.register(this, () => wasm._relume_bake_destroy(address), this);
    // relume_bake_info of 32-bit machines.
    const w = module.words(wasm._relume_web_info(address), 22), f = module.floats(w.byteOffset, 22);
    this.info = Object.freeze({
      surfels: w[1], nodes: w[2], caches: w[3], skyPatches: w[4], instances: w[5], lightmapWidth: w[6], lightmapHeight: w[7],
      lumaBands: w[8], chromaBands: w[9], gridOrigin: [f[10], f[11], f[12]], gridSpacing: [f[13], f[14], f[15]],
      gridResolution: [w[16], w[17], w[18]], sceneHash: module.text(w.byteOffset + 76),
    });
  }
  get alive() {
    if (this.address === 0) throw new RelumeError('the bake was disposed of', kUsage);
    return this.address;
  }
  check(status) {
    if (status !== 0) throw new RelumeError(this.module.text(this.module.wasm._relume_bake_error(this.address)), status);
  }
  // Runs use(address of `floats` floats) and gives their copy.
  copyOut(floats, use) {
    const to = this.module.allocate(4 * floats);
    try {
      this.check(use(to));
      return this.module.floats(to, floats).slice();
    } finally {
      this.module.wasm._free(to);
    }
  }
  instanceName(instance) {
    return this.module.text(this.module.wasm._relume_bake_instance_name(this.alive, whole('instance', instance)));
  }
  // Names of the materials whose light a frame may replace.
  get drivableMaterials() {
    const wasm = this.module.wasm;
    return Array.from({length: wasm._relume_bake_drivable_count(this.alive)},
                      (_, i) => this.module.text(wasm._relume_bake_drivable_name(this.address, i)));
  }
  lightmapCoordinates(instance, {backSide = false} = {}) {
    whole('instance', instance);
    const {wasm} = this.module, count = this.module.allocate(4);
    try {
      this.check(wasm._relume_bake_lightmap_coordinates(this.alive, instance, backSide ? 1 : 0, 0, count));
      const corners = this.module.words(count, 1)[0];
      if (corners === 0) return new Float32Array(0);
      return this.copyOut(2 * corners, (to) => wasm._relume_bake_lightmap_coordinates(this.address, instance, backSide ? 1 : 0, to, count));
    } finally {
      wasm._free(count);
    }
  }
  surfels() {
    const count = this.info.surfels, wasm = this.module.wasm, bake = this.alive;
    return {
      positions: this.copyOut(3 * count, (to) => wasm._relume_bake_surfels(bake, 0, count, to, 0)),
      normals: this.copyOut(3 * count, (to) => wasm._relume_bake_surfels(bake, 0, count, 0, to)),
    };
  }
  skyDirections() {
    return this.copyOut(3 * this.info.skyPatches, (to) => this.module.wasm._relume_bake_sky_directions(this.alive, to));
  }
  dispose() {
    if (this.address === 0) return;
    forgotten?.unregister(this);
    this.module.wasm._relume_bake_destroy(this.address);
    this.address = 0;
  }
}

const kMaxBands = 4;
const kKinds = new Map([['directional', 0], ['point', 1], ['spot', 2]]);
const kLightWords = 13, kLightMin = 8, kScalars = 7;
const kZero = [0, 0, 0], kOne = [1, 1, 1];

// Lights as relume_light has them, at `address`.
export function writeLights(module, lights, address) {
  const floats = module.floats(address, kLightWords * lights.length), words = module.words(address, kLightWords * lights.length);
  lights.forEach((light, i) => {
    const at = kLightWords * i, kind = kKinds.get(light.kind);
    if (kind === undefined) {
      throw new RelumeError(`lights[${i}].kind is ${JSON.stringify(light.kind)}, expected "directional", "point" or "spot"`, kUsage);
    }
    words[at] = kind;
    floats.set(vector(`lights[${i}].intensity`, light.intensity), at + 1);
    floats.set(vector(`lights[${i}].position`, light.position ?? kZero), at + 4);
    floats.set(vector(`lights[${i}].direction`, light.direction ?? [0, 0, -1]), at + 7);
    floats[at + 10] = light.range ?? 0;
    floats[at + 11] = light.innerConeAngle ?? 0;
    floats[at + 12] = light.outerConeAngle ?? Math.PI / 4;
  });
}

const kShapes = ['flat', 'array', 'volume'], kFormats = ['rgba16f', 'rg16f', 'rgba8', 'r8'];

export class Relighter {
  // bake may be disposed of afterwards: a relighter keeps what it needs.
  constructor(bake, {lumaBands = 0, chromaBands = 0, glossy = false, gridTexture = false, movingParts = 0, movingLag = 0} = {}) {
    this.module = bake.module;
    const wasm = this.module.wasm;
    for (const [name, value] of Object.entries({lumaBands, chromaBands, movingParts, movingLag})) whole(name, value);
    if (lumaBands > kMaxBands) {
      throw new RelumeError(`lumaBands is ${lumaBands}, expected 1 to ${kMaxBands}, or 0 for the bake's choice`, kUsage);
    }
    if (movingParts > 0) requireMoving(this.module, `movingParts is ${movingParts}`);
    this.address = wasm._relume_web_relighter(bake.alive, lumaBands, chromaBands, glossy ? 1 : 0, gridTexture ? 1 : 0, movingParts, movingLag);
    if (this.address === 0) throw new RelumeError(this.module.text(wasm._relume_bake_error(bake.address)), kUsage);
    this.info = bake.info;
    this.drivable = bake.drivableMaterials;
    this.coefficientsPerCache = wasm._relume_coefficients_per_cache(this.address);
    this.blocks = {};  // memory of inputs and outputs: address and size by name
    const {address, blocks, module} = this;
    forgotten?.register(this, () => freeRelighter(module, address, blocks), this);
    this.resolve = null;
  }
  get alive() {
    if (this.address === 0) throw new RelumeError('the relighter was disposed of', kUsage);
    return this.address;
  }
  check(status) {
    if (status !== 0) throw new RelumeError(this.module.text(this.module.wasm._relume_relighter_error(this.address)), status);
  }
  // Memory that stays from call to call, until dispose(): nobody would give back what is taken after that.
  block(name, bytes) {
    void this.alive;
    const held = this.blocks[name];
    if (held && held.bytes >= bytes) return held.address;
    if (held) this.module.wasm._free(held.address);
    delete this.blocks[name];
    const address = this.module.allocate(bytes);
    this.blocks[name] = {address, bytes};
    return address;
  }
  // An array of the setup, copied in; 0 where there is none.
  hand(name, values, count) {
    if (values === undefined || values === null) return 0;
    sized(name, values, count);
    const address = this.block(name, 4 * count);
    this.module.floats(address, count).set(values);
    return address;
  }
  // Indices of the drivable materials that materials[i] names: all of that name, or the one of that index.
  drivenBy(i, material) {
    if (typeof material !== 'string') return [whole(`materials[${i}].material`, material, 'a name, or a whole number from 0 on')];
    const found = [...this.drivable.keys()].filter((index) => this.drivable[index] === material);
    if (found.length > 0) return found;
    const names = this.drivable.map((name) => `"${name}"`).join(', ') || 'none';
    throw new RelumeError(`materials[${i}]: no drivable material "${material}"; the bake has ${names}`, kUsage);
  }
  // {name or index, radiance}, as relume_material_emission has them, and how many those are.
  handMaterials(materials) {
    const driven = materials.flatMap(({material, radiance}, i) => {
      const color = vector(`materials[${i}].radiance`, radiance);
      return this.drivenBy(i, material).map((index) => [index, color]);
    });
    const kWords = 7, address = this.block('materials', 4 * kWords * Math.max(driven.length, 1));
    const words = this.module.words(address, kWords * driven.length), floats = this.module.floats(address, kWords * driven.length);
    words.fill(0);
    driven.forEach(([index, color], i) => {
      words[kWords * i] = index;
      floats.set(color, kWords * i + 1);
    });
    return {address, count: driven.length};
  }
  relight(setup = {}) {
    const {wasm} = this.module, relighter = this.alive;
    if (this.module.callbacks.has(relighter)) {
      throw new RelumeError('relight: called by the visibility of the same relighter, which may relight others alone', kUsage);
    }
    object('setup', setup);
    const lights = list('lights', setup.lights ?? []), materials = list('materials', setup.materials ?? []);
    const lightBlock = this.block('lights', 4 * kLightWords * Math.max(lights.length, kLightMin));
    const irradiance = this.hand('surfelIrradiance', setup.surfelIrradiance, 3 * this.info.surfels);
    const emission = this.hand('surfelEmission', setup.surfelEmission, 3 * this.info.surfels);
    const sky = this.hand('skyPatches', setup.skyPatches, 3 * this.info.skyPatches);
    const driven = this.handMaterials(materials), movingParts = list('movingParts', setup.movingParts ?? []);
    const parts = handParts(this, movingParts), shapes = shapesOf(this, setup.movingShapes);
    const scalars = this.block('scalars', 4 * kScalars);
    // From here on nothing is allocated here, so that these views last.
    writeLights(this.module, lights, lightBlock);
    const to = this.module.floats(scalars, kScalars);
    to.set(vector('skyRadiance', setup.skyRadiance ?? kZero));
    to.set(vector('emissionScale', setup.emissionScale ?? kOne), 3);
    to[6] = setup.bounceScale ?? 1;
    let thrown = null;
    if (setup.visibility) {
      this.module.callbacks.set(relighter, (light, count, positions, normals, visible) => {
        if (thrown) return;
        try {
          setup.visibility(light, count, this.module.floats(positions, 3 * count), this.module.floats(normals, 3 * count),
                           this.module.floats(visible, count));
        } catch (error) {  // none may pass through the library
          thrown = {error};
        }
      });
    }
    try {
      this.check(wasm._relume_web_relight(relighter, lightBlock, lights.length, setup.visibility ? 1 : 0, irradiance, emission, sky,
                                          scalars, driven.address, driven.count, parts, movingParts.length, shapes));
    } finally {
      this.module.callbacks.delete(relighter);
    }
    if (thrown) throw thrown.error;
  }
  // Forget last frame's light.
  reset() {
    this.check(this.module.wasm._relume_reset(this.alive));
  }
  // Runs write(address, bytes) for an output of so many bytes, and gives a view of it that lasts until the next call.
  output(name, bytes, write) {
    const address = this.block(name, bytes);
    this.check(write(address, bytes));
    return this.module.bytes(address, bytes);
  }
  coefficients() {
    const view = this.output('coefficients', 4 * this.info.caches * this.coefficientsPerCache,
                             (to, bytes) => this.module.wasm._relume_cache_coefficients(this.alive, to, bytes));
    return new Float32Array(view.buffer, view.byteOffset, view.length / 4);
  }
  // RGBA16F, as halves.
  irradianceMap() {
    const view = this.output('map', 8 * this.info.lightmapWidth * this.info.lightmapHeight,
                             (to, bytes) => this.module.wasm._relume_irradiance_map(this.alive, to, bytes));
    return new Uint16Array(view.buffer, view.byteOffset, view.length / 2);
  }
  // Irradiance at receivers: arrays of three floats each, uvs of two.
  irradianceOnLightmap(uvs, normals, geometricNormals = null) {
    const count = countOf('uvs', uvs, 2), from = this.hand('uvs', uvs, 2 * count), n = this.hand('normals', normals, 3 * count);
    const g = this.hand('geometricNormals', geometricNormals, 3 * count);
    const view = this.output('irradiance', 12 * count,
                             (to) => this.module.wasm._relume_irradiance_on_lightmap(this.alive, count, from, n, g, to));
    return new Float32Array(view.buffer, view.byteOffset, 3 * count);
  }
  irradianceInGrid(positions, normals) {
    const count = countOf('positions', positions, 3), p = this.hand('positions', positions, 3 * count), n = this.hand('normals', normals, 3 * count);
    const view = this.output('irradiance', 12 * count, (to) => this.module.wasm._relume_irradiance_in_grid(this.alive, count, p, n, to));
    return new Float32Array(view.buffer, view.byteOffset, 3 * count);
  }
  // What a resolve by textures needs: {textures, glsl, grid}, see index.d.ts.
  textureResolve() {
    if (this.resolve) return this.resolve;
    const {wasm} = this.module, relighter = this.alive;
    const length = this.module.allocate(100);
    let text = 0;
    try {
      this.check(wasm._relume_resolve_glsl(relighter, 0, 0, length));
      const bytes = this.module.words(length, 1)[0] + 1;
      text = this.module.allocate(bytes);
      this.check(wasm._relume_resolve_glsl(relighter, text, bytes, length));
      const glsl = this.module.text(text);
      this.check(wasm._relume_resolve_texture_count(relighter, length));
      const textures = Array.from({length: this.module.words(length, 1)[0]}, (_, i) => {
        const w = this.module.words(wasm._relume_web_texture(relighter, i), 9);
        return Object.freeze({
          sampler: this.module.text(w[8]), shape: kShapes[w[0]], format: kFormats[w[1]], width: w[2], height: w[3], depth: w[4],
          filtered: w[5] === 1, light: w[6] === 1, bytes: w[7],
        });
      });
      this.check(wasm._relume_resolve_uniforms(relighter, length));
      this.resolve = Object.freeze({textures, glsl, grid: this.module.floats(length, 24).slice()});
    } finally {
      wasm._free(length);
      if (text !== 0) wasm._free(text);
    }
    return this.resolve;
  }
  // Texels of one of textureResolve().textures, by its index.
  resolveTexels(texture) {
    const {textures} = this.textureResolve();
    if (!textures[texture]) throw new RelumeError(`texture is ${texture}, expected less than ${textures.length}`, kUsage);
    const {bytes} = textures[texture];
    return this.output(`texture${texture}`, bytes, (to) => this.module.wasm._relume_resolve_texture_write(this.alive, texture, to, bytes));
  }
  dispose() {
    if (this.address === 0) return;
    if (this.module.callbacks.has(this.address)) throw new RelumeError('dispose: called by the visibility of the same relighter', kUsage);
    forgotten?.unregister(this);
    freeRelighter(this.module, this.address, this.blocks);
    this.address = 0;
    this.blocks = {};
  }
}

function freeRelighter(module, address, blocks) {
  module.wasm._relume_relighter_destroy(address);
  for (const block of Object.values(blocks)) module.wasm._free(block.address);
}
