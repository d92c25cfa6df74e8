// SPDX-License-Identifier: MIT
// The worker of worker_relighter.js: one bake and its relighter. Messages in: {id, call, ...}; out: {id, result}, {id, error}, or
// {progress}.
import {isNode, loadBake, loadModule, RelumeError, Relighter} from './core.js';
import {MovingShapes} from './moving.js';

let port = isNode ? null : self;
let module = null, bake = null, relighter = null, movingShapes = null;

const calls = {
  async create({source, request, options, moduleOptions}) {
    module = await loadModule(moduleOptions ?? {});
    const onProgress = (received, total) => port.postMessage({progress: [received, total]});
    bake = await loadBake(source, {...request, module, onProgress});
    relighter = new Relighter(bake, options);
    const {glsl, grid, textures} = relighter.textureResolve();
    return {
      info: bake.info, drivableMaterials: bake.drivableMaterials, surfels: bake.surfels(), skyDirections: bake.skyDirections(),
      coefficientsPerCache: relighter.coefficientsPerCache, simd: module.simd, resolve: {glsl, grid, textures},
      still: textures.map((texture, i) => (texture.light ? null : relighter.resolveTexels(i).slice())),
    };
  },
  // wants: any of "textures", "irradianceMap", "coefficients".
  relight({setup, wants}) {
    const begin = performance.now();
    relighter.relight({...setup, movingShapes});
    const result = {ms: performance.now() - begin};
    const {textures} = relighter.textureResolve();
    if (wants.includes('textures')) {
      result.textures = textures.map((texture, i) => (texture.light ? relighter.resolveTexels(i).slice() : null));
    }
    if (wants.includes('irradianceMap')) result.irradianceMap = relighter.irradianceMap().slice();
    if (wants.includes('coefficients')) result.coefficients = relighter.coefficients().slice();
    return result;
  },
  reset() {
    relighter.reset();
  },
  setMovingShapes({meshes}) {
    const made = new MovingShapes(module, meshes);
    movingShapes?.dispose();
    movingShapes = made;
  },
};

function buffersOf(value, found = []) {
  if (ArrayBuffer.isView(value)) found.push(value.buffer);
  else if (value && typeof value === 'object') Object.values(value).forEach((each) => buffersOf(each, found));
  return found;
}

async function answer(message) {
  try {
    const result = await calls[message.call](message);
    port.postMessage({id: message.id, result}, message.call === 'relight' ? buffersOf(result) : []);
  } catch (error) {
    const status = error instanceof RelumeError ? error.status : undefined;
    port.postMessage({id: message.id, error: {message: String(error?.message ?? error), status}});
  }
}

// A page's first message does not wait for a listener that comes late, and bundlers' formats for workers have no await here.
if (isNode) {
  const threads = 'node:worker_threads';  // in a variable, so that bundlers for pages let it be
  import(/* webpackIgnore: true */ /* @vite-ignore */ threads).then(({parentPort}) => {
    port = parentPort;
    port.on('message', answer);
  });
} else {
  port.addEventListener('message', (event) => answer(event.data));
}
