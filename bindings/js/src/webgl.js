// SPDX-License-Identifier: MIT
// The relighter as passes of WebGL 2: surfels, pull level by level, caches, then the textures that a resolve by textures reads
// (include/relume/texture_resolve.h). No frame reads anything back, nor runs WebAssembly, which loads the bake and lays it out.
// Where the context cannot draw into floating-point textures the frames come from WebAssembly instead, and `backend` and
// `reason` say so. The light is the CPU backend's, to the rounding of halves and of packed colours (docs/notes/web.md).
import {RelumeError, Relighter} from './core.js';

const kRow = 1024, kLinkRow = 2048;  // texels of a row: shaders/webgl/lists.glsl, light_caches.frag
const kMaxOutputs = 8;               // shaders/webgl/outputs.glsl
const kUsage = 1, kFailed = 4, kUnsupported = 5;
const kLinkSh = 0, kLinkCone = 1, kLinkOct6 = 3, kLinkIrradiance = 5;

const kVertex = `#version 300 es
void main() { gl_Position = vec4(vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0), 0.0, 1.0); }
`;

const words = (bands) => Math.ceil(bands * bands / 4);

// Objects of one context by kind, so that all of them can be deleted.
class Objects {
  constructor(gl) {
    this.gl = gl;
    this.made = [];
  }
  add(kind, object) {
    if (!object && !this.gl.isContextLost()) throw new RelumeError(`WebGL gives no ${kind}`, kFailed);
    this.made.push([kind, object]);
    return object;
  }
  // A texture of one mip level. shape: 2D unless it has layers.
  texture(format, width, height, {layers = 0, filtered = false} = {}) {
    const {gl} = this, target = layers > 0 ? gl.TEXTURE_2D_ARRAY : gl.TEXTURE_2D;
    const texture = this.add('Texture', gl.createTexture());
    gl.bindTexture(target, texture);
    if (layers > 0) gl.texStorage3D(target, 1, format, width, height, layers);
    else gl.texStorage2D(target, 1, format, width, height);
    for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(target, name, filtered ? gl.LINEAR : gl.NEAREST);
    for (const name of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(target, name, gl.CLAMP_TO_EDGE);
    return texture;
  }
  // attachments: [texture, layer or -1]
  framebuffer(attachments) {
    const {gl} = this, framebuffer = this.add('Framebuffer', gl.createFramebuffer());
    gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
    attachments.forEach(([texture, layer], i) => {
      const point = gl.COLOR_ATTACHMENT0 + i;
      if (layer < 0) gl.framebufferTexture2D(gl.FRAMEBUFFER, point, gl.TEXTURE_2D, texture, 0);
      else gl.framebufferTextureLayer(gl.FRAMEBUFFER, point, texture, 0, layer);
    });
    gl.drawBuffers(attachments.map((_, i) => gl.COLOR_ATTACHMENT0 + i));
    const status = gl.checkFramebufferStatus(gl.FRAMEBUFFER);
    if (status !== gl.FRAMEBUFFER_COMPLETE && !gl.isContextLost()) {
      throw new RelumeError(`WebGL cannot draw into a texture of light (framebuffer status 0x${status.toString(16)})`, kUnsupported);
    }
    return framebuffer;
  }
  // Compiles without waiting for the compiler: check() does.
  program(name, fragment, defines) {
    const {gl} = this;
    const head = '#version 300 es\n' + Object.entries(defines).map(([key, value]) => `#define ${key} ${value}\n`).join('');
    const shader = (type, text) => {
      const made = this.add('Shader', gl.createShader(type));
      gl.shaderSource(made, text);
      gl.compileShader(made);
      return made;
    };
    const program = this.add('Program', gl.createProgram()), parts = [shader(gl.VERTEX_SHADER, kVertex), shader(gl.FRAGMENT_SHADER, head + fragment)];
    for (const part of parts) gl.attachShader(program, part);
    gl.linkProgram(program);
    return {name, program, parts, uniforms: new Map(), units: new Map()};
  }
  check(pass) {
    const {gl} = this, {program, parts} = pass;
    if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost()) {
      const log = parts.map((part) => gl.getShaderInfoLog(part)).join('') || gl.getProgramInfoLog(program);
      throw new RelumeError(`shader ${pass.name} does not compile: ${log.trim()}`, kFailed);
    }
    const count = gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS) ?? 0;
    gl.useProgram(program);
    for (let i = 0; i < count; ++i) {
      const {name, type} = gl.getActiveUniform(program, i), at = gl.getUniformLocation(program, name), plain = name.replace('[0]', '');
      pass.uniforms.set(plain, at);
      // Samplers of ours take units in their order; the host's own take theirs when it binds them.
      const isSampler = [gl.SAMPLER_2D, gl.SAMPLER_2D_ARRAY, gl.UNSIGNED_INT_SAMPLER_2D, gl.SAMPLER_3D].includes(type);
      if (isSampler && plain.startsWith('relume')) {
        gl.uniform1i(at, pass.units.size);
        pass.units.set(plain, pass.units.size);
      }
    }
  }
  dispose() {
    for (const [kind, object] of this.made.reverse()) this.gl[`delete${kind}`](object);
    this.made = [];
  }
}

// The state that the passes want. What it was is put back by the function that this returns; texture units are left empty. keep: false =
// nothing is put back, nor asked for: questions to a context wait for what it was told before.
function setState(gl, keep) {
  if (!keep) {
    for (const flag of [gl.BLEND, gl.DEPTH_TEST, gl.SCISSOR_TEST, gl.CULL_FACE, gl.STENCIL_TEST, gl.RASTERIZER_DISCARD]) gl.disable(flag);
    for (const name of [gl.UNPACK_FLIP_Y_WEBGL, gl.UNPACK_PREMULTIPLY_ALPHA_WEBGL, gl.UNPACK_ROW_LENGTH, gl.UNPACK_SKIP_ROWS, gl.UNPACK_SKIP_PIXELS,
                        gl.UNPACK_COLORSPACE_CONVERSION_WEBGL]) gl.pixelStorei(name, 0);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    gl.bindBuffer(gl.PIXEL_UNPACK_BUFFER, null);
    gl.colorMask(true, true, true, true);
    return () => {};
  }
  const flags = [gl.BLEND, gl.DEPTH_TEST, gl.SCISSOR_TEST, gl.CULL_FACE, gl.STENCIL_TEST, gl.RASTERIZER_DISCARD].map((flag) => [flag, gl.isEnabled(flag)]);
  const pixels = [gl.UNPACK_FLIP_Y_WEBGL, gl.UNPACK_PREMULTIPLY_ALPHA_WEBGL, gl.UNPACK_ALIGNMENT, gl.UNPACK_ROW_LENGTH, gl.UNPACK_SKIP_ROWS,
                  gl.UNPACK_SKIP_PIXELS, gl.UNPACK_COLORSPACE_CONVERSION_WEBGL].map((name) => [name, gl.getParameter(name)]);
  const [program, vao, draw, read, unit, viewport, mask, unpack] =
      [gl.CURRENT_PROGRAM, gl.VERTEX_ARRAY_BINDING, gl.DRAW_FRAMEBUFFER_BINDING, gl.READ_FRAMEBUFFER_BINDING, gl.ACTIVE_TEXTURE, gl.VIEWPORT,
       gl.COLOR_WRITEMASK, gl.PIXEL_UNPACK_BUFFER_BINDING].map((name) => gl.getParameter(name));
  for (const [flag] of flags) gl.disable(flag);
  for (const [name] of pixels) gl.pixelStorei(name, name === gl.UNPACK_ALIGNMENT ? 1 : 0);
  gl.bindBuffer(gl.PIXEL_UNPACK_BUFFER, null);
  gl.colorMask(true, true, true, true);
  return () => {
    for (const [flag, on] of flags) on ? gl.enable(flag) : gl.disable(flag);
    for (const [name, value] of pixels) gl.pixelStorei(name, value);
    gl.useProgram(program && gl.isProgram(program) ? program : null);  // hosts may have deleted it
    gl.bindVertexArray(vao);
    gl.bindFramebuffer(gl.DRAW_FRAMEBUFFER, draw);
    gl.bindFramebuffer(gl.READ_FRAMEBUFFER, read);
    gl.activeTexture(unit);
    gl.viewport(...viewport);
    gl.colorMask(...mask);
    gl.bindBuffer(gl.PIXEL_UNPACK_BUFFER, unpack);
  };
}

const isVector = (v) => v && v.length === 3 && Array.prototype.every.call(v, Number.isFinite);
const refuse = (text) => { throw new RelumeError(text, kUsage); };

// RelumeLight of shaders/shared/layout.h, twelve floats, as runtime/gl/passes.cpp packs it.
function packLight(light, i, to) {
  if (!['directional', 'point', 'spot'].includes(light.kind)) {
    refuse(`lights[${i}].kind is ${JSON.stringify(light.kind)}, expected "directional", "point" or "spot"`);
  }
  if (!isVector(light.intensity) || light.intensity.some((v) => v < 0 || v > 1e20)) refuse(`lights[${i}].intensity is ${light.intensity}, expected three numbers in [0..1e20]`);
  const directional = light.kind === 'directional', spot = light.kind === 'spot', at = 12 * i;
  const position = light.position ?? [0, 0, 0], direction = light.direction ?? [0, 0, -1];
  if (!directional && !isVector(position)) refuse(`lights[${i}].position is ${position}, expected three finite numbers`);
  const length = Math.hypot(...direction);
  if ((directional || spot) && !(Math.abs(length - 1) <= 0.01)) refuse(`lights[${i}].direction has length ${length}, expected 1`);
  const range = light.range ?? 0, inner = light.innerConeAngle ?? 0, outer = light.outerConeAngle ?? Math.PI / 4;
  if (!(range >= 0)) refuse(`lights[${i}].range is ${range}, expected >= 0`);
  if (spot && !(inner >= 0 && inner <= outer && outer <= Math.PI)) refuse(`lights[${i}]: cone angles ${inner}, ${outer}, expected 0 <= inner <= outer <= pi`);
  const cosOuter = Math.cos(outer), coneScale = spot ? 1 / Math.max(Math.cos(inner) - cosOuter, 0.001) : 0;
  to.set(position, at);
  to[at + 3] = directional ? -1 : range > 0 ? 1 / (range * range) : 0;
  if (directional || spot) to.set(direction.map((v) => v / length), at + 4);
  to[at + 7] = coneScale;
  to.set(light.intensity, at + 8);
  to[at + 11] = spot ? -cosOuter * coneScale : 1;
}

export class GpuRelighter {
  // gl: a WebGL2RenderingContext. bake: not to be disposed of before this.
  constructor(gl, bake, {onLost, onRestored, onError, onFallback, forceFallback = false, keepState = true, visibilityGlsl = '', bindVisibility = null, ...options} = {}) {
    if (!gl?.texStorage3D) refuse('GpuRelighter: expected a WebGL 2 context');
    Object.assign(this, {gl, bake, options, visibilityGlsl, bindVisibility, keepState, info: bake.info});
    this.module = bake.module;
    this.lost = false;
    this.frames = 0;  // since the light was forgotten
    this.backend = 'webgl2';
    this.reason = '';
    this.canvas = gl.canvas;
    if (forceFallback || !(gl.getExtension('EXT_color_buffer_float') || gl.getExtension('EXT_color_buffer_half_float'))) {
      this.backend = 'wasm';
      this.reason = forceFallback ? 'asked for' : 'this WebGL draws into no floating-point textures (EXT_color_buffer_float)';
      if (!forceFallback) console.warn(`relume: ${this.reason}: relighting on the CPU`);
      onFallback?.(this.reason);
    }
    this.build();
    this.onLost = (event) => {
      event.preventDefault();  // else it never comes back
      this.lost = true;
      onLost?.();
    };
    this.onRestored = () => {
      try {
        gl.getExtension('EXT_color_buffer_float') || gl.getExtension('EXT_color_buffer_half_float');
        this.lost = false;
        this.build();
        onRestored?.();
      } catch (error) {
        this.lost = true;
        onError ? onError(error) : console.error(`relume: ${error.message}`);
      }
    };
    this.canvas?.addEventListener?.('webglcontextlost', this.onLost);
    this.canvas?.addEventListener?.('webglcontextrestored', this.onRestored);
  }

  // All objects anew, without light.
  build() {
    const {gl} = this, restore = setState(gl, this.keepState);
    this.frames = 0;
    this.objects = new Objects(gl);
    const cpu = new Relighter(this.bake, this.options);
    try {
      gl.activeTexture(gl.TEXTURE0);
      gl.bindSampler(0, null);
      this.resolve = cpu.textureResolve();
      this.makeResolveTextures(cpu);
      if (this.backend === 'webgl2') this.makePasses(cpu);
      this.cpu = this.backend === 'wasm' ? cpu : null;
    } catch (error) {
      this.objects.dispose();
      cpu.dispose();
      restore();
      throw error;
    }
    if (this.backend === 'webgl2') cpu.dispose();
    restore();
  }

  // The textures that hosts read, by the names of their samplers, as they are before the first frame.
  makeResolveTextures(cpu) {
    const {gl} = this;
    const formats = {
      rgba16f: [gl.RGBA16F, gl.RGBA, gl.HALF_FLOAT, Uint16Array], rg16f: [gl.RG16F, gl.RG, gl.HALF_FLOAT, Uint16Array],
      rgba8: [gl.RGBA8, gl.RGBA, gl.UNSIGNED_BYTE, Uint8Array], r8: [gl.R8, gl.RED, gl.UNSIGNED_BYTE, Uint8Array],
    };
    const side = this.maxSide = gl.getParameter(gl.MAX_TEXTURE_SIZE);
    this.textures = {};
    this.uploads = this.resolve.textures.map((texture, i) => {
      const [internal, format, type, Texels] = formats[texture.format];
      if (texture.shape === 'volume') throw new RelumeError('gridTexture is not for WebGL', kUnsupported);
      this.checkSide(Math.max(texture.width, texture.height), side);
      const layers = texture.shape === 'array' ? texture.depth : 0;
      const made = this.objects.texture(internal, texture.width, texture.height, {layers, filtered: texture.filtered});
      this.textures[texture.sampler] = made;
      const upload = () => {
        const bytes = cpu.resolveTexels(i), texels = new Texels(bytes.buffer, bytes.byteOffset, bytes.length / Texels.BYTES_PER_ELEMENT);
        if (layers > 0) {
          gl.bindTexture(gl.TEXTURE_2D_ARRAY, made);
          gl.texSubImage3D(gl.TEXTURE_2D_ARRAY, 0, 0, 0, 0, texture.width, texture.height, layers, format, type, texels);
        } else {
          gl.bindTexture(gl.TEXTURE_2D, made);
          gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, texture.width, texture.height, format, type, texels);
        }
      };
      upload();
      return texture.light ? upload : null;
    });
  }
  checkSide(wanted, side) {
    if (wanted > side) throw new RelumeError(`a texture of ${wanted} texels is needed, this WebGL has at most ${side}`, kUnsupported);
  }

  makePasses(cpu) {
    const {gl, objects, info} = this, wasm = this.module.wasm, tables = wasm._relume_web_make_tables(this.bake.alive);
    if (tables === 0) throw new RelumeError('out of memory for the lists of WebGL', 6);
    try {
      const kLists = 12, t = this.module.words(wasm._relume_web_tables(tables), 2 * kLists + 11).slice();
      const [surfels, emission, tree, levelBegin, rows, heads, shapes, cones, shNodes, shCoefficients, mapCaches, leafNodes] =
          Array.from({length: kLists}, (_, i) => ({address: t[2 * i], count: t[2 * i + 1]}));
      const [kind, shBands, gridLinks, firstMapCache, senders] = t.subarray(2 * kLists);
      const box = new Float32Array(t.buffer, 4 * (2 * kLists + 5), 6);
      const side = gl.getParameter(gl.MAX_TEXTURE_SIZE);
      const formats = {
        r32ui: [gl.R32UI, gl.RED_INTEGER, gl.UNSIGNED_INT, Uint32Array, 1], rgba32ui: [gl.RGBA32UI, gl.RGBA_INTEGER, gl.UNSIGNED_INT, Uint32Array, 4],
        rgba32f: [gl.RGBA32F, gl.RGBA, gl.FLOAT, Float32Array, 4], r16ui: [gl.R16UI, gl.RED_INTEGER, gl.UNSIGNED_SHORT, Uint16Array, 1],
      };
      // A list as a texture in rows, from the module's memory.
      const list = (name, {address, count}, width = kRow) => {
        const [internal, format, type, Texels, each] = formats[name], height = Math.max(Math.ceil(count / width), 1);
        this.checkSide(Math.max(height, width), side);
        const texture = objects.texture(internal, width, height), full = Math.floor(count / width);
        const put = (y, w, h, from) => gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, y, w, h, format, type,
                                                        new Texels(wasm.HEAPU8.buffer, address + from * each * Texels.BYTES_PER_ELEMENT, w * h * each));
        if (full > 0) put(0, width, full, 0);
        if (count > full * width) put(full, count - full * width, 1, full * width);
        return texture;
      };
      const lists = {
        relumeSurfels: list('rgba32ui', surfels), relumeTree: list('rgba32ui', tree), relumeLeafNodes: list('r32ui', leafNodes), relumeRows: list('r32ui', rows),
        relumeMapCaches: mapCaches.count > 0 ? list('r32ui', mapCaches, info.lightmapWidth) : null,
      };
      if (emission.count > 0) lists.relumeEmission = list('rgba32f', emission);
      if (kind === kLinkSh) {
        lists.relumeLinks = list('r32ui', shNodes, kLinkRow);
        lists.relumeLinkShape = list('r16ui', shCoefficients, kLinkRow);
      } else if (kind === kLinkCone) {
        lists.relumeLinks = list('rgba32ui', cones, kLinkRow);
      } else {
        lists.relumeLinks = list('r32ui', heads, kLinkRow);
        // Two shapes of oct6 links a word, the first in the low half.
        lists.relumeLinkShape = kind === kLinkOct6 ? list('r16ui', {address: shapes.address, count: heads.count}, kLinkRow) : list('r32ui', shapes, kLinkRow);
      }
      this.levels = this.module.words(levelBegin.address, levelBegin.count).slice();
      this.senders = senders;
      this.firstMapCache = firstMapCache;

      // Nodes: leaves, then levels by parity, then all.
      const nodeRows = Math.ceil(info.nodes / kRow), target = (height) => objects.texture(gl.R32UI, kRow, height);
      this.checkSide(nodeRows, side);
      lists.relumeSenders = target(Math.max(Math.ceil(senders / kRow), 1));
      lists.relumeEven = target(nodeRows);
      lists.relumeOdd = target(nodeRows);
      lists.relumeNodes = target(nodeRows);

      // Caches.
      const luma = (this.options.lumaBands || 0) || Math.min(info.lumaBands, 4);
      const chroma = this.options.chromaBands || Math.round(Math.sqrt((cpu.coefficientsPerCache - luma * luma) / 2));
      const irradiance = kind === kLinkIrradiance ? 1 : 0;
      const onMap = (bands) => (irradiance || !this.options.glossy ? wasm._relume_web_bands_on_map(bands, irradiance) : bands);
      const grid = {luma, chroma, begin: 0, end: firstMapCache}, map = {luma: onMap(luma), chroma: onMap(chroma), begin: firstMapCache, end: info.caches};
      const layersOf = (bands) => words(bands.luma) + 2 * words(bands.chroma);
      const cacheRows = Math.max(Math.ceil(info.caches / kRow), 1), layers = Math.max(layersOf(grid), layersOf(map));
      lists.relumeCacheLight = objects.texture(gl.RGBA16F, kRow, cacheRows, {layers});
      Object.assign(lists, this.textures);
      this.lists = lists;
      const maxOutputs = Math.min(gl.getParameter(gl.MAX_DRAW_BUFFERS), gl.getParameter(gl.MAX_COLOR_ATTACHMENTS), kMaxOutputs);

      const shader = (path) => {
        const path_ = this.cString(path), glsl = this.cString(this.visibilityGlsl);
        try {
          const text = this.module.text(wasm._relume_web_shader(path_, glsl));
          if (text === '') throw new RelumeError(`there is no shader ${path}`, kFailed);
          return text;
        } finally {
          wasm._free(path_);
          wasm._free(glsl);
        }
      };
      const bandDefines = {
        RELUME_LUMA_BANDS: luma, RELUME_CHROMA_BANDS: chroma, RELUME_MAP_LUMA_BANDS: map.luma, RELUME_MAP_CHROMA_BANDS: map.chroma,
        RELUME_MAP_IRRADIANCE: irradiance, RELUME_RESOLVE_TEXTURES: 1, RELUME_GRID_TEXTURE: 0, RELUME_GUESS_BANDS: 0,
      };
      const passes = [], pass = (name, defines, framebuffer) => {
        const made = {...objects.program(name, shader(`webgl/${name}.frag`), defines), framebuffer};
        passes.push(made);
        return made;
      };
      const single = (texture) => objects.framebuffer([[texture, -1]]);
      this.surfelPass = pass('light_surfels', {...bandDefines, RELUME_EMITS: emission.count > 0 ? 1 : 0}, single(lists.relumeSenders));
      this.pullPasses = [pass('pull', {RELUME_JOIN: 0, RELUME_ODD: 0}, single(lists.relumeEven)), pass('pull', {RELUME_JOIN: 0, RELUME_ODD: 1}, single(lists.relumeOdd))];
      this.joinPass = pass('pull', {RELUME_JOIN: 1}, single(lists.relumeNodes));
      // So many layers at once as can be drawn into; each group walks the links again.
      const groups = (texture, count, make) => {
        for (let first = 0; first < count; first += maxOutputs) {
          const outputs = Math.min(maxOutputs, count - first);
          make({RELUME_FIRST: first, RELUME_OUTPUTS: outputs}, objects.framebuffer(Array.from({length: outputs}, (_, i) => [texture, first + i])));
        }
      };
      this.cachePasses = [];
      for (const part of [grid, map]) {
        if (part.begin === part.end) continue;
        groups(lists.relumeCacheLight, layersOf(part), (defines, framebuffer) => {
          const made = pass('light_caches', {...defines, RELUME_LINK_KIND: kind, RELUME_LUMA_BANDS: part.luma, RELUME_CHROMA_BANDS: part.chroma}, framebuffer);
          this.cachePasses.push({...made, begin: part.begin, end: part.end});
        });
      }
      this.mapPasses = [];
      if (lists.relumeMapCaches) {
        // The last layer has normals, and stays.
        groups(this.textures.relumeLightmap, layersOf(map), (defines, framebuffer) => {
          this.mapPasses.push(pass('fill_map', {...defines, RELUME_GRID: 0}, framebuffer));
        });
      }
      this.gridPass = null;
      if (firstMapCache > 0) {
        this.gridPass = pass('fill_map', {RELUME_GRID: 1, RELUME_OUTPUTS: 1, RELUME_FIRST: 0, RELUME_WORDS: layersOf(grid)}, single(this.textures.relumeGridCaches));
        this.gridTexels = firstMapCache * layersOf(grid);
      }
      for (const each of passes) objects.check(each);
      const surfelUniforms = this.surfelPass.uniforms;
      gl.useProgram(this.surfelPass.program);
      gl.uniform3fv(surfelUniforms.get('relumeBoxOrigin'), box.subarray(0, 3));
      gl.uniform3fv(surfelUniforms.get('relumeBoxStep'), box.subarray(3, 6));
      gl.uniform1ui(surfelUniforms.get('relumeSurfelCount'), info.surfels);
      gl.uniform1ui(surfelUniforms.get('relumeSenderCount'), senders);
      gl.uniform4fv(surfelUniforms.get('relumeGrid'), this.resolve.grid);
      for (const each of this.cachePasses) {
        gl.useProgram(each.program);
        gl.uniform1ui(each.uniforms.get('relumeGridLinks'), gridLinks);
        gl.uniform1ui(each.uniforms.get('relumeShapeStride'), shBands * shBands);
      }
      if (this.gridPass) {
        gl.useProgram(this.gridPass.program);
        gl.uniform1ui(this.gridPass.uniforms.get('relumeCacheCount'), firstMapCache);
      }
      this.nearest = objects.add('Sampler', gl.createSampler());
      for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.samplerParameteri(this.nearest, name, gl.NEAREST);
      this.vao = objects.add('VertexArray', gl.createVertexArray());
      this.inputs = {};  // textures of what frames hand over: {texture, width, height}
      for (const name of ['relumeLights', 'relumeHostLight', 'relumeHostEmission', 'relumeSkyPatches']) this.input(name, 3, 1);
    } finally {
      wasm._relume_web_free_tables(tables);
    }
  }
  cString(text) {
    const bytes = new TextEncoder().encode(text), address = this.module.allocate(bytes.length + 1);
    this.module.bytes(address, bytes.length + 1).set([...bytes, 0]);
    return address;
  }
  // A floating-point texture of an input, at least so large.
  input(name, width, height) {
    const held = this.inputs[name];
    if (held && held.width >= width && held.height >= height) return held;
    if (held) {
      this.gl.deleteTexture(held.texture);
      this.objects.made = this.objects.made.filter(([, object]) => object !== held.texture);
    }
    this.inputs[name] = {texture: this.objects.texture(this.gl.RGBA32F, width, height), width, height};
    this.lists[name] = this.inputs[name].texture;
    return this.inputs[name];
  }
  // Three floats per element into rows of `row` texels.
  putVectors(name, values, count, row) {
    const {gl} = this, height = Math.ceil(count / row), texels = new Float32Array(4 * row * height);
    for (let i = 0; i < count; ++i) {
      for (let k = 0; k < 3; ++k) texels[4 * i + k] = values[3 * i + k];
    }
    gl.bindTexture(gl.TEXTURE_2D, this.input(name, row, height).texture);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, row, height, gl.RGBA, gl.FLOAT, texels);
  }

  use(pass) {
    const {gl} = this;
    gl.useProgram(pass.program);
    gl.bindFramebuffer(gl.FRAMEBUFFER, pass.framebuffer);
    for (const [name, unit] of pass.units) {
      gl.activeTexture(gl.TEXTURE0 + unit);
      // Textures of the host's may want filters that they cannot have, and would read as nothing.
      gl.bindSampler(unit, name === 'relumeHostLight' ? this.nearest : null);
      gl.bindTexture(name === 'relumeLightmap' || name === 'relumeCacheLight' ? gl.TEXTURE_2D_ARRAY : gl.TEXTURE_2D, this.lists[name]);
    }
    this.usedUnits = Math.max(this.usedUnits, pass.units.size);
  }
  // A fragment for each of the elements [begin, end) of a list.
  drawRange(begin, end) {
    const {gl} = this, low = Math.floor(begin / kRow), high = Math.ceil(end / kRow);
    if (high - low === 1) gl.viewport(begin % kRow, low, end - begin, 1);
    else gl.viewport(0, low, kRow, high - low);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  // One frame; false while the context is lost. setup: as Relighter.relight() takes it, with surfelIrradianceTexture = {texture,
  // width}: RGBA32F or RGBA16F, texel i of rows of `width` texels has the irradiance of surfel i. visibility and materials are for the CPU:
  // here shadows are visibilityGlsl's or the host's own light.
  relight(setup = {}) {
    if (!this.objects) refuse('the relighter was disposed of');
    if (this.lost || this.gl.isContextLost()) return false;
    const restore = setState(this.gl, this.keepState);
    this.usedUnits = 1;
    try {
      this.gl.activeTexture(this.gl.TEXTURE0);
      if (this.backend === 'wasm') this.relightOnCpu(setup);
      else this.relightOnGpu(setup);
      this.frames += 1;
    } finally {
      for (let unit = 0; unit < this.usedUnits; ++unit) {
        this.gl.activeTexture(this.gl.TEXTURE0 + unit);
        this.gl.bindTexture(this.gl.TEXTURE_2D, null);
        this.gl.bindTexture(this.gl.TEXTURE_2D_ARRAY, null);
        this.gl.bindSampler(unit, null);
      }
      restore();
    }
    return true;
  }
  relightOnCpu(setup) {
    if (setup.surfelIrradianceTexture) {
      refuse('surfelIrradianceTexture is for the GPU; this relighter works on the CPU (backend "wasm"): hand surfelIrradiance over');
    }
    this.cpu.relight(setup);
    for (const upload of this.uploads) upload?.();
  }
  relightOnGpu(setup) {
    const {gl, info} = this, lights = setup.lights ?? [], host = setup.surfelIrradianceTexture, bounce = setup.bounceScale ?? 1;
    // All that can be refused before anything is drawn.
    if (setup.visibility) refuse('visibility is for the CPU: in WebGL hand visibilityGlsl or surfelIrradiance over');
    if (setup.materials?.length > 0) refuse('materials is for the CPU: in WebGL hand surfelEmission over');
    const sky = setup.skyRadiance ?? [0, 0, 0], scale = setup.emissionScale ?? [1, 1, 1];
    if (!isVector(sky) || sky.some((v) => v < 0)) refuse(`skyRadiance is ${sky}, expected three numbers >= 0`);
    if (!isVector(scale) || scale.some((v) => v < 0)) refuse(`emissionScale is ${scale}, expected three numbers >= 0`);
    if (!(bounce >= 0 && bounce <= 1)) refuse(`bounceScale is ${bounce}, expected 0 to 1`);
    for (const [name, count] of [['surfelIrradiance', info.surfels], ['surfelEmission', info.surfels], ['skyPatches', info.skyPatches]]) {
      if (setup[name] && setup[name].length !== 3 * count) refuse(`${name} has ${setup[name].length} elements, expected ${3 * count}`);
    }
    if (host && !(host.width > 0)) refuse('surfelIrradianceTexture.width is missing');
    const packed = new Float32Array(12 * Math.max(lights.length, 1));
    lights.forEach((light, i) => packLight(light, i, packed));
    this.checkSide(3 * lights.length, this.maxSide);
    gl.bindTexture(gl.TEXTURE_2D, this.input('relumeLights', 3 * Math.max(lights.length, 1), 1).texture);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, 3 * Math.max(lights.length, 1), 1, gl.RGBA, gl.FLOAT, packed);
    if (setup.surfelIrradiance) this.putVectors('relumeHostLight', setup.surfelIrradiance, info.surfels, kRow);
    if (setup.surfelEmission) this.putVectors('relumeHostEmission', setup.surfelEmission, info.surfels, kRow);
    if (setup.skyPatches) this.putVectors('relumeSkyPatches', setup.skyPatches, info.skyPatches, info.skyPatches);
    this.lists.relumeHostLight = host ? host.texture : this.inputs.relumeHostLight.texture;

    gl.bindVertexArray(this.vao);
    const {uniforms} = this.surfelPass;
    this.use(this.surfelPass);
    gl.uniform1ui(uniforms.get('relumeLightCount'), lights.length);
    gl.uniform1i(uniforms.get('relumeHostWidth'), host ? host.width : setup.surfelIrradiance ? kRow : 0);
    gl.uniform1i(uniforms.get('relumeHostEmits'), setup.surfelEmission ? 1 : 0);
    gl.uniform1i(uniforms.get('relumeHostSky'), setup.skyPatches ? 1 : 0);
    gl.uniform3fv(uniforms.get('relumeEmissionScale'), scale);
    gl.uniform3fv(uniforms.get('relumeSkyRadiance'), sky);
    gl.uniform1f(uniforms.get('relumeBounceScale'), this.frames > 0 ? bounce : 0);
    if (this.bindVisibility) {
      this.bindVisibility(gl, this.surfelPass.program, this.surfelPass.units.size);
      this.use(this.surfelPass);
    }
    this.drawRange(0, this.senders);

    for (let level = this.levels.length - 2; level >= 0; --level) {
      const pass = this.pullPasses[level % 2];
      this.use(pass);
      gl.uniform1ui(pass.uniforms.get('relumeBegin'), this.levels[level]);
      gl.uniform1ui(pass.uniforms.get('relumeEnd'), this.levels[level + 1]);
      this.drawRange(this.levels[level], this.levels[level + 1]);
    }
    this.use(this.joinPass);
    gl.uniform1ui(this.joinPass.uniforms.get('relumeBegin'), 0);
    gl.uniform1ui(this.joinPass.uniforms.get('relumeEnd'), info.nodes);
    this.drawRange(0, info.nodes);

    for (const pass of this.cachePasses) {
      this.use(pass);
      gl.uniform1ui(pass.uniforms.get('relumeBegin'), pass.begin);
      gl.uniform1ui(pass.uniforms.get('relumeEnd'), pass.end);
      this.drawRange(pass.begin, pass.end);
    }
    for (const pass of this.mapPasses) {
      this.use(pass);
      gl.viewport(0, 0, info.lightmapWidth, info.lightmapHeight);
      gl.drawArrays(gl.TRIANGLES, 0, 3);
    }
    if (this.gridPass) {
      this.use(this.gridPass);
      this.drawRange(0, this.gridTexels);
    }
  }
  // Forget last frame's light.
  reset() {
    this.frames = 0;
    this.cpu?.reset();
  }
  dispose() {
    this.canvas?.removeEventListener?.('webglcontextlost', this.onLost);
    this.canvas?.removeEventListener?.('webglcontextrestored', this.onRestored);
    this.objects?.dispose();
    this.objects = null;
    this.cpu?.dispose();
    this.cpu = null;
  }
}
