// SPDX-License-Identifier: MIT
// The passes of a frame in WebGL 2: their programs (shaders/webgl), what they read and what they draw into. webgl.js draws them.
import {RelumeError} from './core.js';
import {kLinkIrradiance, kRow, makeLists} from './webgl_tables.js';

const kMaxOutputs = 8;  // shaders/webgl/outputs.glsl
const kFailed = 4;

const layersOf = ({luma, chroma}) => Math.ceil(luma * luma / 4) + 2 * Math.ceil(chroma * chroma / 4);

// Text of a file of shaders/ from the module.
function shaderText(module, path, visibilityGlsl) {
  const cString = (text) => {
    const bytes = new TextEncoder().encode(text), address = module.allocate(bytes.length + 1);
    module.bytes(address, bytes.length + 1).set([...bytes, 0]);
    return address;
  };
  const name = cString(path), glsl = cString(visibilityGlsl);
  try {
    const text = module.text(module.wasm._relume_web_shader(name, glsl));
    if (text === '') throw new RelumeError(`there is no shader ${path}`, kFailed);
    return text;
  } finally {
    module.wasm._free(name);
    module.wasm._free(glsl);
  }
}

// Compiles passes, all of them before the first is waited for.
class PassMaker {
  constructor(objects, module, visibilityGlsl) {
    Object.assign(this, {objects, module, visibilityGlsl, made: []});
  }
  // attachments: as GlObjects.framebuffer() takes them.
  add(name, defines, attachments) {
    const text = shaderText(this.module, `webgl/${name}.frag`, this.visibilityGlsl);
    const pass = {...this.objects.program(name, text, defines), framebuffer: this.objects.framebuffer(attachments)};
    this.made.push(pass);
    return pass;
  }
  // Into `count` layers, as many at once as can be drawn into; each pass walks its lists again.
  addLayers(name, defines, texture, count) {
    const {gl} = this.objects, passes = [];
    const maxOutputs = Math.min(gl.getParameter(gl.MAX_DRAW_BUFFERS), gl.getParameter(gl.MAX_COLOR_ATTACHMENTS), kMaxOutputs);
    for (let first = 0; first < count; first += maxOutputs) {
      const outputs = Math.min(maxOutputs, count - first), attachments = Array.from({length: outputs}, (_, i) => [texture, first + i]);
      passes.push(this.add(name, {...defines, RELUME_FIRST: first, RELUME_OUTPUTS: outputs}, attachments));
    }
    return passes;
  }
  finish() {
    for (const pass of this.made) this.objects.check(pass);
  }
}

// Bands and range of the grid's caches and of the light map's.
function partsOf(bake, options, tables, coefficientsPerCache) {
  const {info, module} = bake, irradiance = tables.kind === kLinkIrradiance ? 1 : 0;
  const luma = (options.lumaBands || 0) || Math.min(info.lumaBands, 4);
  const chroma = options.chromaBands || Math.round(Math.sqrt((coefficientsPerCache - luma * luma) / 2));
  const onMap = (bands) => (irradiance || !options.glossy ? module.wasm._relume_web_bands_on_map(bands, irradiance) : bands);
  return {
    irradiance, grid: {luma, chroma, begin: 0, end: tables.firstMapCache},
    map: {luma: onMap(luma), chroma: onMap(chroma), begin: tables.firstMapCache, end: info.caches},
  };
}

// What passes draw into and read again: nodes as leaves, as levels by parity and as all; caches in layers.
function makeTargets(objects, info, tables, layers) {
  const {gl} = objects, rows = (count) => Math.max(Math.ceil(count / kRow), 1), nodes = () => objects.texture(gl.R32UI, kRow, rows(info.nodes));
  return {
    relumeSenders: objects.texture(gl.R32UI, kRow, rows(tables.senders)), relumeEven: nodes(), relumeOdd: nodes(), relumeNodes: nodes(),
    relumeCacheLight: objects.texture(gl.RGBA16F, kRow, rows(info.caches), {layers}),
  };
}

// Numbers that are the same in every frame.
function setConstants(gl, {surfels, caches, grid}, {info}, tables, resolveGrid) {
  const at = (pass, name) => pass.uniforms.get(name);
  gl.useProgram(surfels.program);
  gl.uniform3fv(at(surfels, 'relumeBoxOrigin'), tables.box.subarray(0, 3));
  gl.uniform3fv(at(surfels, 'relumeBoxStep'), tables.box.subarray(3, 6));
  gl.uniform1f(at(surfels, 'relumeSurfelRadius'), tables.box[6]);
  gl.uniform1ui(at(surfels, 'relumeSurfelCount'), info.surfels);
  gl.uniform1ui(at(surfels, 'relumeSenderCount'), tables.senders);
  gl.uniform4fv(at(surfels, 'relumeGrid'), resolveGrid);
  for (const pass of caches) {
    gl.useProgram(pass.program);
    gl.uniform1ui(at(pass, 'relumeGridLinks'), tables.gridLinks);
    gl.uniform1ui(at(pass, 'relumeShapeStride'), tables.shBands * tables.shBands);
  }
  if (grid) {
    gl.useProgram(grid.program);
    gl.uniform1ui(at(grid, 'relumeCacheCount'), tables.firstMapCache);
  }
}

// tables: of withTables(). textures: of the resolve, by their samplers. Gives the passes in the order of the frame, `lists` with all
// textures by their samplers, and the ranges that are drawn.
export function makePasses({objects, bake, tables, textures, options, coefficientsPerCache, resolveGrid, visibilityGlsl}) {
  const {gl} = objects, {info, module} = bake;
  const {irradiance, grid, map} = partsOf(bake, options, tables, coefficientsPerCache);
  const lists = {...makeLists(objects, bake, tables), ...makeTargets(objects, info, tables, Math.max(layersOf(grid), layersOf(map))), ...textures};
  const maker = new PassMaker(objects, module, visibilityGlsl), single = (texture) => [[texture, -1]];
  const surfels = maker.add('light_surfels', {
    RELUME_LUMA_BANDS: grid.luma, RELUME_CHROMA_BANDS: grid.chroma, RELUME_MAP_LUMA_BANDS: map.luma, RELUME_MAP_CHROMA_BANDS: map.chroma,
    RELUME_MAP_IRRADIANCE: irradiance, RELUME_RESOLVE_TEXTURES: 1, RELUME_GRID_TEXTURE: 0, RELUME_GUESS_BANDS: 0,
    RELUME_EMITS: tables.emission.count > 0 ? 1 : 0,
  }, single(lists.relumeSenders));
  const pull = [lists.relumeEven, lists.relumeOdd].map((texture, odd) => maker.add('pull', {RELUME_JOIN: 0, RELUME_ODD: odd}, single(texture)));
  const join = maker.add('pull', {RELUME_JOIN: 1}, single(lists.relumeNodes));
  const caches = [grid, map].filter(({begin, end}) => begin < end).flatMap((part) => {
    const defines = {RELUME_LINK_KIND: tables.kind, RELUME_LUMA_BANDS: part.luma, RELUME_CHROMA_BANDS: part.chroma};
    return maker.addLayers('light_caches', defines, lists.relumeCacheLight, layersOf(part)).map((pass) => Object.assign(pass, {begin: part.begin, end: part.end}));
  });
  // The light map's last layer has normals, and stays.
  const fillMap = lists.relumeMapCaches ? maker.addLayers('fill_map', {RELUME_GRID: 0}, textures.relumeLightmap, layersOf(map)) : [];
  const gridTexels = grid.end * layersOf(grid);
  const fillGrid = grid.end === 0 ? null : maker.add('fill_map', {RELUME_GRID: 1, RELUME_OUTPUTS: 1, RELUME_FIRST: 0, RELUME_WORDS: layersOf(grid)},
                                                     single(textures.relumeGridCaches));
  maker.finish();
  setConstants(gl, {surfels, caches, grid: fillGrid}, bake, tables, resolveGrid);
  const levels = module.words(tables.levelBegin.address, tables.levelBegin.count).slice();
  return {surfels, pull, join, caches, fillMap, fillGrid, lists, levels, senders: tables.senders, gridTexels};
}
