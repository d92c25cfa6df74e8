// SPDX-License-Identifier: MIT
// The page of page_test.mjs: what it asks for by name, in window.tests.
import {loadBake, loadModule, RelumeError, Relighter, WorkerRelighter} from '/relume/src/index.js';
import {GpuRelighter} from '/relume/src/webgl.js';

// A context whose objects are counted.
function makeContext() {
  const canvas = document.createElement('canvas'), gl = canvas.getContext('webgl2');
  const counted = {live: 0, gl, canvas};
  for (const kind of ['Texture', 'Framebuffer', 'Program', 'Shader', 'VertexArray', 'Buffer', 'Sampler', 'Renderbuffer']) {
    const create = gl[`create${kind}`], destroy = gl[`delete${kind}`], live = new Set();
    gl[`create${kind}`] = (...args) => {
      const made = create.apply(gl, args);
      live.add(made);
      counted.live += 1;
      return made;
    };
    gl[`delete${kind}`] = (object) => {
      if (live.delete(object)) counted.live -= 1;
      destroy.call(gl, object);
    };
  }
  return counted;
}

const lights = [
  {kind: 'directional', intensity: [9, 8, 7], direction: [0, -1, 0]},
  {kind: 'spot', intensity: [20, 30, 40], position: [1, 1.5, -1], direction: [0, 0, -1], innerConeAngle: 0.5, outerConeAngle: 1},
  {kind: 'point', intensity: [3, 2, 1], position: [-1, 1, 1], range: 4},
];
const setups = {
  lights: {lights, bounceScale: 0.9},
  sky: {skyRadiance: [0.1, 0.2, 0.4], emissionScale: [0, 0, 0]},
  emission: {emissionScale: [1, 0.5, 2]},
};

// Irradiance that a host's shader reads, drawn at receivers: rgb of each. uvs or positions.
function readResolve(gl, relighter, receivers, normals, onMap) {
  const count = normals.length / 3;
  const compile = (type, text) => {
    const shader = gl.createShader(type);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
    return shader;
  };
  const program = gl.createProgram();
  const vertex = compile(gl.VERTEX_SHADER, '#version 300 es\nvoid main() { gl_Position = vec4(vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0), 0.0, 1.0); }');
  const fragment = compile(gl.FRAGMENT_SHADER, `#version 300 es\n${relighter.resolve.glsl}
    uniform highp sampler2D receivers, normals;
    out vec4 color;
    void main() {
      vec3 r = texelFetch(receivers, ivec2(gl_FragCoord.xy), 0).xyz, n = texelFetch(normals, ivec2(gl_FragCoord.xy), 0).xyz;
      color = vec4(${onMap ? 'relumeIrradianceLightmap(r.xy, n)' : 'relumeIrradianceGrid(r, n)'}, 1.0);
    }`);
  gl.attachShader(program, vertex);
  gl.attachShader(program, fragment);
  gl.linkProgram(program);
  gl.useProgram(program);
  const width = 256, height = Math.ceil(count / width), made = [];
  const put = (values, each) => {
    const texels = new Float32Array(4 * width * height), texture = gl.createTexture();
    for (let i = 0; i < count; ++i) for (let k = 0; k < each; ++k) texels[4 * i + k] = values[each * i + k];
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA32F, width, height, 0, gl.RGBA, gl.FLOAT, texels);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
    made.push(texture);
    return texture;
  };
  gl.activeTexture(gl.TEXTURE0);
  const inputs = [put(receivers, receivers.length / count), put(normals, 3), put([], 0)];
  const framebuffer = gl.createFramebuffer();
  gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
  gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, inputs[2], 0);
  let unit = 0;
  const bind = (name, target, texture) => {
    const at = gl.getUniformLocation(program, name);
    if (at === null) return;
    gl.activeTexture(gl.TEXTURE0 + unit);
    gl.bindTexture(target, texture);
    gl.uniform1i(at, unit++);
  };
  bind('receivers', gl.TEXTURE_2D, inputs[0]);
  bind('normals', gl.TEXTURE_2D, inputs[1]);
  for (const {sampler, shape} of relighter.resolve.textures) bind(sampler, shape === 'array' ? gl.TEXTURE_2D_ARRAY : gl.TEXTURE_2D, relighter.textures[sampler]);
  gl.uniform4fv(gl.getUniformLocation(program, 'relumeGrid'), relighter.resolve.grid);
  gl.viewport(0, 0, width, height);
  gl.drawArrays(gl.TRIANGLES, 0, 3);
  const pixels = new Float32Array(4 * width * height);
  gl.readPixels(0, 0, width, height, gl.RGBA, gl.FLOAT, pixels);
  for (const texture of made) gl.deleteTexture(texture);
  gl.deleteFramebuffer(framebuffer);
  gl.deleteShader(vertex);
  gl.deleteShader(fragment);
  gl.deleteProgram(program);
  gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  const rgb = new Float32Array(3 * count);
  for (let i = 0; i < count; ++i) for (let k = 0; k < 3; ++k) rgb[3 * i + k] = pixels[4 * i + k];
  return rgb;
}

// RMSE over RMS of Y, and of the chroma's two channels over Y's.
function compare(found, expected) {
  let y2 = 0, dy2 = 0, dc2 = 0;
  for (let i = 0; i < expected.length; i += 3) {
    const yOf = (v) => 0.25 * v[i] + 0.5 * v[i + 1] + 0.25 * v[i + 2];
    const d = (k) => found[i + k] - expected[i + k];
    y2 += yOf(expected) ** 2;
    dy2 += (yOf(found) - yOf(expected)) ** 2;
    dc2 += (0.5 * (d(0) - d(2))) ** 2 + (-0.25 * d(0) + 0.5 * d(1) - 0.25 * d(2)) ** 2;
  }
  return {rms: Math.sqrt(3 * y2 / expected.length), y: Math.sqrt(dy2 / y2), chroma: Math.sqrt(dc2 / y2)};
}

// Points of the light map (texel centres that have a cache) with the normals of their caches, from the last layer's texels.
function mapReceivers(relighter) {
  const {resolve, info} = relighter, uvs = [], normals = [], texture = resolve.textures[0], texels = relighter.resolveTexels(0);
  const halves = new DataView(texels.buffer, texels.byteOffset, texels.length), layer = 8 * texture.width * texture.height * (texture.depth - 1);
  const half = (at) => {
    const h = halves.getUint16(at, true), e = (h >> 10) & 31, m = h & 1023;
    return (h & 32768 ? -1 : 1) * (e === 0 ? m * 2 ** -24 : (1 + m / 1024) * 2 ** (e - 15));
  };
  for (let i = 0; i < info.lightmapWidth * info.lightmapHeight; ++i) {
    const at = layer + 8 * i;
    if (half(at + 6) === 0) continue;
    uvs.push((i % info.lightmapWidth + 0.5) / info.lightmapWidth, (Math.floor(i / info.lightmapWidth) + 0.5) / info.lightmapHeight);
    const n = [half(at), half(at + 2), half(at + 4)], length = Math.hypot(...n) || 1;
    normals.push(...n.map((v) => v / length));
  }
  return {uvs: new Float32Array(uvs), normals: new Float32Array(normals)};
}

const bakes = new Map();
async function bakeOf(name) {
  if (!bakes.has(name)) bakes.set(name, await loadBake(`/work/${name}`));
  return bakes.get(name);
}

window.tests = {
  // WebGL 2 against the CPU: receivers on the light map and in the grid.
  // maxOutputs: textures that the context draws into at once, 0 = what it can.
  async compare(name, options = {}, maxOutputs = 0, frames = 3) {
    const bake = await bakeOf(name), context = makeContext(), {gl} = context, found = {}, getParameter = gl.getParameter.bind(gl);
    gl.getExtension('EXT_color_buffer_float');
    if (maxOutputs > 0) gl.getParameter = (parameter) => (parameter === gl.MAX_DRAW_BUFFERS ? maxOutputs : getParameter(parameter));
    for (const [setupName, setup] of Object.entries(setups)) {
      const cpu = new Relighter(bake, options), gpu = new GpuRelighter(gl, bake, options);
      for (let i = 0; i < frames; ++i) {
        cpu.relight(setup);
        if (!gpu.relight(setup)) throw new Error('the context is lost');
      }
      const {positions, normals} = bake.surfels(), points = positions.map((p, i) => p + 0.05 * normals[i]);
      const map = mapReceivers(Object.assign(cpu, {resolve: cpu.textureResolve()}));
      found[setupName] = {
        backend: gpu.backend,
        map: map.uvs.length ? compare(readResolve(gl, gpu, map.uvs, map.normals, true), cpu.irradianceOnLightmap(map.uvs, map.normals)) : null,
        grid: bake.info.gridResolution[0] > 0 ? compare(readResolve(gl, gpu, points, normals, false), cpu.irradianceInGrid(points, normals)) : null,
      };
      if (gl.getError() !== 0) throw new Error('an error of WebGL');
      cpu.dispose();
      gpu.dispose();
    }
    return {...found, live: context.live, renderer: gl.getParameter(gl.VERSION)};
  },
  // A context that is lost and comes back: no error, the same light as before, and no more memory of the module.
  async loseContext(name, options = {}) {
    const bake = await bakeOf(name), {gl, canvas} = makeContext(), said = [];
    gl.getExtension('EXT_color_buffer_float');
    const gpu = new GpuRelighter(gl, bake, {...options, onLost: () => said.push('lost'), onRestored: () => said.push('restored')});
    const {positions, normals} = bake.surfels(), light = () => {
      for (let i = 0; i < 3; ++i) gpu.relight(setups.lights);
      return readResolve(gl, gpu, positions, normals, false);
    };
    const before = light(), bytes = bake.module.liveBytes, loss = gl.getExtension('WEBGL_lose_context'), event = (type) => new Promise((done) => canvas.addEventListener(type, done, {once: true}));
    const lost = event('webglcontextlost');
    loss.loseContext();
    await lost;
    const refused = gpu.relight(setups.lights);
    let made = '';
    try {
      new GpuRelighter(gl, bake);
    } catch (error) {
      made = `${error.name}: ${error.message}`;
    }
    const restored = event('webglcontextrestored');
    setTimeout(() => loss.restoreContext(), 10);
    await restored;
    const after = light(), result = {said, refused, made, bytes: bake.module.liveBytes - bytes, same: before.every((v, i) => v === after[i]), rms: compare(after, before).rms, error: gl.getError()};
    gpu.dispose();
    return result;
  },
  // Frames by WebAssembly where there are no floating-point targets, with the CPU's very texels.
  async fallBack(name) {
    const bake = await bakeOf(name), context = makeContext(), {gl} = context, reasons = [];
    const getExtension = gl.getExtension.bind(gl);
    gl.getExtension = (extension) => (/color_buffer/.test(extension) ? null : getExtension(extension));
    const gpu = new GpuRelighter(gl, bake, {onFallback: (reason) => reasons.push(reason)});
    const cpu = new Relighter(bake);
    for (let i = 0; i < 3; ++i) gpu.relight(setups.lights), cpu.relight(setups.lights);
    getExtension('EXT_color_buffer_float');
    const {positions, normals} = bake.surfels();
    const result = {backend: gpu.backend, reasons, y: compare(readResolve(gl, gpu, positions, normals, false), cpu.irradianceInGrid(positions, normals)).y,
                    error: gl.getError()};
    gpu.dispose();
    cpu.dispose();
    return {...result, live: context.live};
  },
  // Two levels on one context, each with its own light; the host's state stays; nothing is left of either.
  async twoLevels(first, second) {
    const context = makeContext(), {gl} = context;
    gl.getExtension('EXT_color_buffer_float');
    const names = [first, second], relighters = [], alone = [];
    const light = async (relighter, name) => {
      const {positions, normals} = (await bakeOf(name)).surfels();
      return readResolve(gl, relighter, positions, normals, false);
    };
    for (const name of names) {
      const one = new GpuRelighter(gl, await bakeOf(name));
      for (let i = 0; i < 3; ++i) one.relight(setups.lights);
      alone.push(await light(one, name));
      one.dispose();
    }
    gl.enable(gl.DEPTH_TEST);
    gl.viewport(1, 2, 3, 4);
    const unpack = {UNPACK_FLIP_Y_WEBGL: true, UNPACK_SKIP_IMAGES: 1, UNPACK_IMAGE_HEIGHT: 256, UNPACK_SKIP_ROWS: 2};
    for (const [key, value] of Object.entries(unpack)) gl.pixelStorei(gl[key], value);
    for (const name of names) relighters.push(new GpuRelighter(gl, await bakeOf(name)));
    for (let i = 0; i < 3; ++i) for (const relighter of relighters) relighter.relight(setups.lights);
    const state = [gl.isEnabled(gl.DEPTH_TEST), [...gl.getParameter(gl.VIEWPORT)], Object.entries(unpack).every(([key, value]) => gl.getParameter(gl[key]) === value),
                   gl.getParameter(gl.FRAMEBUFFER_BINDING) === null];
    gl.disable(gl.DEPTH_TEST);
    for (const key of Object.keys(unpack)) gl.pixelStorei(gl[key], 0);
    const same = [];
    for (let i = 0; i < 2; ++i) same.push((await light(relighters[i], names[i])).every((v, k) => v === alone[i][k]));
    for (const relighter of relighters) relighter.dispose(), relighter.dispose();
    return {state, same, live: context.live, error: gl.getError()};
  },
  // The host's own light: from an array, from a texture, by GLSL that shadows by a rule; and light without shadows for comparison.
  async hostLight(name) {
    const bake = await bakeOf(name), context = makeContext(), {gl} = context, {positions, normals} = bake.surfels(), count = bake.info.surfels;
    gl.getExtension('EXT_color_buffer_float');
    const light = new Float32Array(3 * count).map((_, i) => (i % 7) / 3), read = (relighter) => readResolve(gl, relighter, positions, normals, false);
    const gpu = new GpuRelighter(gl, bake), cpu = new Relighter(bake), found = {};
    const lit = (setup, cpuSetup = setup) => {
      gpu.reset(), cpu.reset();
      for (let i = 0; i < 3; ++i) gpu.relight(setup), cpu.relight(cpuSetup);
      return compare(read(gpu), cpu.irradianceInGrid(positions, normals)).y;
    };
    found.array = lit({surfelIrradiance: light});
    const width = 100, texture = gl.createTexture(), texels = new Float32Array(4 * width * Math.ceil(count / width));
    for (let i = 0; i < count; ++i) texels.set(light.subarray(3 * i, 3 * i + 3), 4 * i);
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA32F, width, Math.ceil(count / width), 0, gl.RGBA, gl.FLOAT, texels);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
    found.texture = lit({surfelIrradianceTexture: {texture, width}}, {surfelIrradiance: light});
    gl.deleteTexture(texture);
    found.emission = lit({surfelEmission: light});
    found.sky = lit({skyPatches: new Float32Array(3 * bake.info.skyPatches).map((_, i) => (i % 5) / 4)});
    gpu.dispose();
    const glsl = 'uniform float limit;\nfloat relumeVisibility(uint light, vec3 p, vec3 n) { return light == 0u && p.y > limit ? 0.25 : 1.0; }';
    const shadowed = new GpuRelighter(gl, bake, {visibilityGlsl: glsl, bindVisibility: (gl_, program) => gl.uniform1f(gl.getUniformLocation(program, 'limit'), 1.5)});
    cpu.reset();
    const visibility = (index, n, p, _, visible) => {
      for (let i = 0; i < n; ++i) visible[i] = index === 0 && p[3 * i + 1] > 1.5 ? 0.25 : 1;
    };
    for (let i = 0; i < 3; ++i) shadowed.relight({lights}), cpu.relight({lights, visibility});
    found.glsl = compare(read(shadowed), cpu.irradianceInGrid(positions, normals)).y;
    shadowed.dispose();
    cpu.dispose();
    return {found, live: context.live, error: gl.getError()};
  },
  // What is refused, by its text; nothing is left of it.
  async refusals(name) {
    const bake = await bakeOf(name), context = makeContext(), {gl} = context, texts = {};
    gl.getExtension('EXT_color_buffer_float');
    const gpu = new GpuRelighter(gl, bake);
    const refused = (key, act) => {
      try {
        act();
        texts[key] = 'accepted';
      } catch (error) {
        texts[key] = `${error instanceof RelumeError ? '' : 'not a RelumeError: '}${error.message}`;
      }
    };
    refused('kind', () => gpu.relight({lights: [{kind: 'sun', intensity: [1, 1, 1]}]}));
    refused('nan', () => gpu.relight({lights: [{kind: 'point', intensity: [NaN, 1, 1]}]}));
    refused('direction', () => gpu.relight({lights: [{kind: 'spot', intensity: [1, 1, 1], direction: [0, 2, 0]}]}));
    refused('bounce', () => gpu.relight({bounceScale: 2}));
    refused('size', () => gpu.relight({surfelIrradiance: [1, 2, 3]}));
    refused('number', () => gpu.relight({surfelIrradiance: 5}));
    refused('irradiance', () => gpu.relight({surfelIrradiance: new Float32Array(3 * bake.info.surfels).fill(NaN, 3, 4)}));
    refused('patches', () => gpu.relight({skyPatches: new Float32Array(3 * bake.info.skyPatches).fill(-1)}));
    refused('sky', () => gpu.relight({skyRadiance: [1e30, 0, 0]}));
    refused('element', () => gpu.relight({lights: [null]}));
    refused('setup', () => gpu.relight(null));
    refused('visibility', () => gpu.relight({visibility() {}}));
    refused('context', () => new GpuRelighter(document.createElement('canvas').getContext('2d'), bake));
    refused('glsl', () => new GpuRelighter(gl, bake, {visibilityGlsl: 'float relumeVisibility(uint l, vec3 p, vec3 n) { return nothing; }'}));
    const size = gl.getParameter(gl.MAX_TEXTURE_SIZE), getParameter = gl.getParameter.bind(gl);
    gl.getParameter = (name_) => (name_ === gl.MAX_TEXTURE_SIZE ? 64 : getParameter(name_));
    refused('side', () => new GpuRelighter(gl, bake));
    gl.getParameter = getParameter;
    const accepted = gpu.relight(setups.lights);
    gpu.dispose();
    refused('disposed', () => gpu.relight(setups.lights));
    return {texts, accepted, size, live: context.live, error: gl.getError()};
  },
  // Bakes over the network, and the relighter in a worker, in a page.
  async loading(name) {
    const module = await loadModule(), before = module.liveBytes, texts = {}, progress = [];
    for (const url of ['/work/missing.relume', '/page.html']) await loadBake(url).catch((error) => (texts[url] = error.message));
    const bake = await loadBake(`/work/${name}`, {onProgress: (received, total) => progress.push([received, total])});
    const here = new Relighter(bake), worker = await WorkerRelighter.create(`/work/${name}`);
    let frame;
    for (let i = 0; i < 3; ++i) {
      here.relight(setups.sky);
      frame = await worker.relight(setups.sky, ['coefficients']);
    }
    const same = here.coefficients().every((v, i) => v === frame.coefficients[i]);
    // One in a worker, by a script of its own, with the module's folder named; and what is not there.
    const within = URL.createObjectURL(new Blob([`import {WorkerRelighter} from '${location.origin}/relume/src/index.js';
      const options = {worker: '${location.origin}/relume/src/worker.js', module: {folder: new URL('${location.origin}/relume/wasm/')}};
      WorkerRelighter.create('${location.origin}/work/${name}', options).then((made) => made.relight({}, ['coefficients']))
          .then((frame) => postMessage(frame.coefficients.length), (error) => postMessage(String(error)));`], {type: 'text/javascript'}));
    const outer = new Worker(within, {type: 'module'}), nested = await new Promise((done) => (outer.onmessage = ({data}) => done(data)));
    outer.terminate();
    const lost = await WorkerRelighter.create(`/work/${name}`, {worker: '/missing.js'}).catch((error) => error.message);
    const nowhere = await loadModule({folder: new URL('/missing/', location.href)}).catch((error) => `${error.name}: ${error.message}`);
    worker.dispose();
    here.dispose();
    bake.dispose();
    return {texts, progress: [progress[0], progress.at(-1)], same, nested: nested === frame.coefficients.length || nested, lost, nowhere, left: module.liveBytes - before, simd: module.simd};
  },
};
document.documentElement.dataset.ready = 'yes';
