// SPDX-License-Identifier: MIT
// A bake's lists, as the module lays them out (module/gpu_tables.cpp), in textures.
import {RelumeError} from './core.js';

export const kRow = 1024;  // texels of a row: shaders/webgl/lists.glsl
const kLinkRow = 2048;     // the same of links: shaders/webgl/light_caches.frag
const kLinkSh = 0, kLinkCone = 1, kLinkOct6 = 3;
export const kLinkIrradiance = 5;
const kMemory = 6;

// In the order of relume_web_tables().
const kLists = ['surfels', 'emission', 'tree', 'levelBegin', 'rows', 'heads', 'shapes', 'cones', 'shNodes', 'shCoefficients', 'mapCaches', 'leafNodes'];
const kNumbers = ['kind', 'shBands', 'gridLinks', 'firstMapCache', 'senders'];
const kBoxFloats = 7;

// use(tables): {address, count} of each list, the numbers, and `box`, floats of the surfels' box and radius. Addresses hold meanwhile.
export function withTables(bake, use) {
  const {module} = bake, {wasm} = module, tables = wasm._relume_web_make_tables(bake.alive);
  if (tables === 0) throw new RelumeError('out of memory for the lists of WebGL', kMemory);
  try {
    const boxAt = 2 * kLists.length + kNumbers.length, words = module.words(wasm._relume_web_tables(tables), boxAt + kBoxFloats).slice();
    const read = {box: new Float32Array(words.buffer, 4 * boxAt, kBoxFloats)};
    kLists.forEach((name, i) => (read[name] = {address: words[2 * i], count: words[2 * i + 1]}));
    kNumbers.forEach((name, i) => (read[name] = words[2 * kLists.length + i]));
    return use(read);
  } finally {
    wasm._relume_web_free_tables(tables);
  }
}

// The textures that passes read of a bake, by the names of their samplers.
export function makeLists(objects, bake, tables) {
  const {gl} = objects, memory = bake.module.wasm.HEAPU8.buffer;
  const formats = {
    r32ui: [gl.R32UI, gl.RED_INTEGER, gl.UNSIGNED_INT, Uint32Array, 1], rgba32ui: [gl.RGBA32UI, gl.RGBA_INTEGER, gl.UNSIGNED_INT, Uint32Array, 4],
    rgba32f: [gl.RGBA32F, gl.RGBA, gl.FLOAT, Float32Array, 4], r16ui: [gl.R16UI, gl.RED_INTEGER, gl.UNSIGNED_SHORT, Uint16Array, 1],
  };
  const list = (name, {address, count}, width = kRow) => {
    const [internal, format, type, Texels, each] = formats[name], full = Math.floor(count / width);
    const texture = objects.texture(internal, width, Math.max(Math.ceil(count / width), 1));
    const put = (y, w, h) => objects.put(texture, {format, type, width: w, height: h, y},
                                         new Texels(memory, address + y * width * each * Texels.BYTES_PER_ELEMENT, w * h * each));
    if (full > 0) put(0, width, full);
    if (count > full * width) put(full, count - full * width, 1);
    return texture;
  };
  const {surfels, emission, tree, rows, heads, shapes, mapCaches, kind} = tables;
  const lists = {
    relumeSurfels: list('rgba32ui', surfels), relumeTree: list('rgba32ui', tree), relumeLeafNodes: list('r32ui', tables.leafNodes),
    relumeRows: list('r32ui', rows), relumeMapCaches: mapCaches.count > 0 ? list('r32ui', mapCaches, bake.info.lightmapWidth) : null,
  };
  if (emission.count > 0) lists.relumeEmission = list('rgba32f', emission);
  if (kind === kLinkSh) {
    lists.relumeLinks = list('r32ui', tables.shNodes, kLinkRow);
    lists.relumeLinkShape = list('r16ui', tables.shCoefficients, kLinkRow);
  } else if (kind === kLinkCone) {
    lists.relumeLinks = list('rgba32ui', tables.cones, kLinkRow);
  } else {
    lists.relumeLinks = list('r32ui', heads, kLinkRow);
    // Two shapes of oct6 links a word, the first in the low half.
    lists.relumeLinkShape = kind === kLinkOct6 ? list('r16ui', {address: shapes.address, count: heads.count}, kLinkRow) : list('r32ui', shapes, kLinkRow);
  }
  return lists;
}
