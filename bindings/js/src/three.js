// SPDX-License-Identifier: MIT
// Relume in three.js' WebGL renderer. A level that `relume export` wrote has its light-map coordinates in TEXCOORD_1; what has none,
// and what moves, reads the grid. Direct light and shadows stay three's own: after a frame the surfels are drawn as points, a
// texel each, under the scene's lights and the shadow maps of that frame, and what they receive is relit (webgl.js).
import * as THREE from 'three';
import {loadBake, RelumeError} from './core.js';
import {RelumeProbes} from './three_probes.js';
import {GpuRelighter} from './webgl.js';

export {RelumeProbes};

const kLayer = 31;    // of the surfels, and while they are drawn of the lights
const kWidth = 512;   // [texel] rows of surfels

// The host's material of each clone, of all lightings: the last one that is applied to a mesh lights it.
const originals = new WeakMap();
const eachOf = (material, use) => (Array.isArray(material) ? material.map(use) : use(material));

// GLSL in place of, or after, one of three's chunks.
const after = (text, chunk, more) => {
  const at = `#include <${chunk}>`;
  if (!text.includes(at)) throw new RelumeError(`this three.js has no shader chunk ${chunk}`, 5);
  return text.replace(at, `${at}\n${more}`);
};
const instead = (text, chunk, other) => {
  const at = `#include <${chunk}>`;
  if (!text.includes(at)) throw new RelumeError(`this three.js has no shader chunk ${chunk}`, 5);
  return text.replace(at, other);
};

// Sets properties of an object, and gives a function that puts back what they were.
function hold(object, values) {
  const were = Object.fromEntries(Object.keys(values).map((name) => [name, object[name]]));
  Object.assign(object, values);
  return () => Object.assign(object, were);
}

// renderer.resetState(), without the loss of the reversed depth, which three sets as the renderer is made and never again.
function resetState(renderer) {
  const {depth} = renderer.state.buffers, reversed = depth.getReversed?.();
  renderer.resetState();
  if (!reversed) return;
  depth.setReversed(true);
  depth.setClear(1);  // the farthest, whichever way depth runs
}

// Runs draw(), which renders into targets of Relume's, and gives the renderer back as it was, with the page's counts. A headset's cameras and a
// cutaway's planes are not for that, and the shadow maps stay those of the frame that was just drawn.
function drawAside(renderer, draw) {
  const {xr, shadowMap, info} = renderer, target = renderer.getRenderTarget();
  const clearColor = renderer.getClearColor(new THREE.Color()), clearAlpha = renderer.getClearAlpha();
  const {frame, ...counts} = info.render;  // frame goes on: by its number three tells what it has uploaded
  const putBack = [
    hold(renderer, {clippingPlanes: []}), hold(xr, {enabled: false}), hold(shadowMap, {autoUpdate: false, needsUpdate: false}), hold(info, {autoReset: false}),
  ];
  try {
    draw();
  } finally {
    for (const each of putBack) each();
    Object.assign(info.render, counts);
    renderer.setClearColor(clearColor, clearAlpha);
    renderer.setRenderTarget(target);
  }
}

// Leaves a scene's lights alone in the surfels' layer, and gives a function that puts the layers back.
function showLightsAlone(scene) {
  const changed = [];
  scene.traverse(({layers, isLight, isLightProbeGrid}) => {
    if (layers.isEnabled(kLayer) === Boolean(isLight && !isLightProbeGrid)) return;
    layers.toggle(kLayer);
    changed.push(layers);
  });
  return () => changed.forEach((layers) => layers.toggle(kLayer));
}

// Which attributes of a mesh have the light-map coordinates of its front and of its back, "front" or "front,back", or "grid" where none has.
// Extras of a glTF's primitive are the geometry's. Older exports name the sets on the mesh alone, where extras of a node hide them.
function coordinatesOf({geometry, userData, isSkinnedMesh, isInstancedMesh}) {
  const named = [geometry.userData.relume, userData.relume].find((each) => each?.lightmapTexcoord !== undefined);
  if (!named || isSkinnedMesh || isInstancedMesh) return 'grid';
  // As GLTFLoader calls them.
  const [front, back] = [named.lightmapTexcoord, named.backLightmapTexcoord].map((set) => ['uv', 'uv1', 'uv2', 'uv3'][set] ?? `texcoord_${set}`);
  if (!geometry.attributes[front]) return 'grid';
  return geometry.attributes[back] ? `${front},${back}` : front;
}

export class RelumeLoader extends THREE.Loader {
  load(url, onLoad, onProgress, onError) {
    const full = this.manager.resolveURL(this.path + url);
    this.manager.itemStart(full);
    loadBake(full, {
      onProgress: (loaded, total) => onProgress?.({loaded, total, lengthComputable: total > 0}),
      headers: this.requestHeader, credentials: this.withCredentials ? 'include' : 'same-origin',
    })
        .then((bake) => {
          onLoad(new RelumeLighting(bake));
          this.manager.itemEnd(full);
        })
        .catch((error) => {
          onError ? onError(error) : console.error(error);
          this.manager.itemError(full);
          this.manager.itemEnd(full);
        });
  }
}

export class RelumeLighting {
  // Takes the bake over: dispose() disposes of it.
  constructor(bake, options = {}) {
    this.bake = bake;
    this.options = options;
    this.show = new THREE.Vector2(1, 1);  // factors on direct light and on indirect light
    this.patched = new Map();             // [map, grid] variants of a material, by the original
    // By mesh: {original, worn, place}: what it had and what it has of ours, and where it was, if it reads the light map.
    this.meshes = new Map();
    this.relighter = null;
    this.uniforms = {relumeShow: {value: this.show}, relumeGrid: {value: new Float32Array(24)}};
    this.probeGrids = new Set();
    this.warned = false;  // of a level that was moved
    this.onDispose = ({target}) => this.unpatch(target);
  }

  // A light-probe grid for what applyTo() is not called for: add it to the scene; update() fills it.
  probes(options) {
    const grid = new RelumeProbes(this, options);
    this.probeGrids.add(grid);
    return grid;
  }

  // All meshes below, those of the level and those that move. Materials are replaced by clones, another lighting's too; dispose() puts
  // the host's back where a mesh still has ours.
  applyTo(object) {
    object.traverse((mesh) => {
      if (!mesh.isMesh || mesh.material === this.meshes.get(mesh)?.worn) return;
      const kind = coordinatesOf(mesh);
      const original = eachOf(mesh.material, (material) => originals.get(material) ?? material);
      const worn = eachOf(original, (material) => this.patch(material, kind));
      mesh.updateWorldMatrix(true, false);
      this.meshes.set(mesh, {original, worn, place: kind === 'grid' ? null : mesh.matrixWorld.clone()});
      mesh.material = worn;
    });
    return this;
  }

  // Puts the host's materials back below, and forgets the meshes.
  remove(object) {
    object.traverse((mesh) => this.forget(mesh));
    return this;
  }
  forget(mesh) {
    const held = this.meshes.get(mesh);
    if (held && mesh.material === held.worn) mesh.material = held.original;
    this.meshes.delete(mesh);
  }

  // Says once that what reads the light map has left its place: its light does not go with it.
  warnOfMoves() {
    if (this.warned) return;
    for (const [mesh, {place}] of this.meshes) {
      if (!place || place.equals(mesh.matrixWorld)) continue;
      this.warned = true;
      console.warn(`relume: "${mesh.name}" was moved after applyTo(), but a level is lit where it was baked; bake what moves as extras.relume.bake: "dynamic"`);
      return;
    }
  }

  // kind: attributes of the front's and the back's coordinates, or "grid".
  patch(material, kind) {
    if (!(material.isMeshStandardMaterial || material.isMeshLambertMaterial || material.isMeshPhongMaterial)) return material;
    const variants = this.patched.get(material) ?? {};
    if (!this.patched.has(material)) material.addEventListener('dispose', this.onDispose);
    this.patched.set(material, variants);
    if (variants[kind]) return variants[kind];
    const clone = material.clone(), [front, back] = kind === 'grid' ? [] : kind.split(',');
    clone.onBeforeCompile = (shader, renderer) => {
      material.onBeforeCompile.call(clone, shader, renderer);
      Object.assign(shader.uniforms, this.uniforms);
      const declare = (name) => `#ifndef USE_${name.toUpperCase()}\nattribute vec2 ${name};\n#endif\n`;
      // three declares uv whatever the material reads of it.
      const attributes = [front, back].filter((name) => name && name !== 'uv').map(declare).join('');
      shader.vertexShader = after(shader.vertexShader, 'common', `${attributes}varying vec3 vRelumePosition;\nvarying vec4 vRelumeUv;`);
      shader.vertexShader = after(shader.vertexShader, 'project_vertex', `
        vec4 relumePosition = vec4(transformed, 1.0);
        #ifdef USE_BATCHING
          relumePosition = batchingMatrix * relumePosition;
        #endif
        #ifdef USE_INSTANCING
          relumePosition = instanceMatrix * relumePosition;
        #endif
        vRelumePosition = (modelMatrix * relumePosition).xyz;
        vRelumeUv = vec4(${front ?? 'vec2(1.0)'}, ${back ?? 'vec2(1.0)'});`);
      shader.fragmentShader = after(shader.fragmentShader, 'common', `
        ${this.resolveGlsl()}
        uniform vec2 relumeShow;
        varying vec3 vRelumePosition;
        varying vec4 vRelumeUv;
        // A vertex at (1, 1) is lit by the grid, and all corners of its triangles are.
        vec3 relumeIrradiance(vec3 n, vec3 geometricNormal) {
          vec2 uv = gl_FrontFacing ? vRelumeUv.xy : vRelumeUv.zw;
          return min(uv.x, uv.y) > 0.99999 ? relumeIrradianceGrid(vRelumePosition, n) : relumeIrradianceLightmap(uv, n, geometricNormal);
        }`);
      // The grids are not for these materials: their light would come twice.
      const lights = THREE.ShaderChunk.lights_fragment_begin.replaceAll('NUM_LIGHT_PROBE_GRIDS', '0');
      shader.fragmentShader = instead(shader.fragmentShader, 'lights_fragment_begin', lights);
      // Vectors times viewMatrix are turned back into the world.
      shader.fragmentShader = after(shader.fragmentShader, 'lights_fragment_maps', `
        #ifdef RE_IndirectDiffuse
          irradiance += relumeIrradiance(normalize((vec4(normal, 0.0) * viewMatrix).xyz), normalize((vec4(nonPerturbedNormal, 0.0) * viewMatrix).xyz));
        #endif`);
      shader.fragmentShader = after(shader.fragmentShader, 'lights_fragment_end', `
        reflectedLight.directDiffuse *= relumeShow.x;
        reflectedLight.directSpecular *= relumeShow.x;
        reflectedLight.indirectDiffuse *= relumeShow.y;
        reflectedLight.indirectSpecular *= relumeShow.y;`);
    };
    // Two lightings may have other bands, and so other shaders.
    clone.customProgramCacheKey = () => `${material.customProgramCacheKey()}relume ${kind} ${this.glslKey ?? ''}`;
    originals.set(clone, material);
    return variants[kind] = clone;
  }

  // A material of the host's that goes takes its clones along.
  unpatch(material) {
    for (const clone of Object.values(this.patched.get(material))) clone.dispose();
    this.patched.delete(material);
    material.removeEventListener('dispose', this.onDispose);
  }

  resolveGlsl() {
    return this.relighter ? this.relighter.resolve.glsl : 'vec3 relumeIrradianceGrid(vec3 p, vec3 n) { return vec3(0.0); }\n' +
        'vec3 relumeIrradianceLightmap(vec2 uv, vec3 n, vec3 g) { return vec3(0.0); }';
  }

  // The relighter and its textures for this renderer, before the first frame that uses them; update() does it as well.
  prepare(renderer) {
    const gl = renderer.getContext(), held = renderer.getRenderTarget();
    if (this.relighter) {
      if (this.relighter.gl === gl) return;
      throw new RelumeError('RelumeLighting: it has its textures in the context of another renderer; load the bake once more for this one', 1);
    }
    this.relighter = new GpuRelighter(gl, this.bake, {...this.options, keepState: false, onRestored: () => this.takeTextures(renderer)});
    this.glslKey = this.relighter.resolve.glsl.length + this.relighter.resolve.glsl.slice(0, 200);
    this.takeTextures(renderer);
    for (const variants of this.patched.values()) for (const clone of Object.values(variants)) clone.needsUpdate = true;
    resetState(renderer);
    renderer.setRenderTarget(held);
  }
  takeTextures(renderer) {
    const {resolve, textures} = this.relighter;
    for (const {sampler, shape, width, height, depth} of resolve.textures) {
      const texture = new THREE.ExternalTexture(textures[sampler]);
      if (shape === 'array') texture.isDataArrayTexture = true, texture.image = {width, height, depth};
      (this.uniforms[sampler] ??= {value: null}).value = texture;
    }
    this.uniforms.relumeGrid.value = resolve.grid;
    resetState(renderer);
  }

  // The surfels as points that three lights, and where they are drawn.
  makeSurfels() {
    const {positions, normals} = this.bake.surfels(), count = this.bake.info.surfels, geometry = new THREE.BufferGeometry();
    geometry.setAttribute('position', new THREE.BufferAttribute(positions, 3));
    geometry.setAttribute('normal', new THREE.BufferAttribute(normals, 3));
    const height = Math.ceil(count / kWidth), material = new THREE.MeshLambertMaterial({color: 0xffffff, fog: false, toneMapped: false});
    material.onBeforeCompile = (shader) => {
      // Where a surfel lies stays as it is for the lights; where it is drawn is its texel.
      shader.vertexShader = after(shader.vertexShader, 'fog_vertex', `
        gl_Position = vec4((vec2(gl_VertexID % ${kWidth}, gl_VertexID / ${kWidth}) + 0.5) * vec2(${2 / kWidth}, ${2 / height}) - 1.0, 0.0, 1.0);
        gl_PointSize = 1.0;`);
      shader.fragmentShader = instead(shader.fragmentShader, 'opaque_fragment', 'gl_FragColor = vec4(reflectedLight.directDiffuse * PI, 1.0);');
      for (const chunk of ['tonemapping_fragment', 'colorspace_fragment', 'dithering_fragment', 'premultiplied_alpha_fragment']) {
        shader.fragmentShader = instead(shader.fragmentShader, chunk, '');
      }
    };
    const points = new THREE.Points(geometry, material);
    points.layers.set(kLayer);
    points.frustumCulled = false;
    points.receiveShadow = true;
    points.matrixAutoUpdate = false;
    const target = new THREE.WebGLRenderTarget(kWidth, height, {
      type: THREE.FloatType, minFilter: THREE.NearestFilter, magFilter: THREE.NearestFilter, depthBuffer: false, generateMipmaps: false,
    });
    const camera = new THREE.PerspectiveCamera();
    camera.layers.set(kLayer);
    this.surfels = {points, target, camera};
  }

  // After renderer.render(scene, camera): the light that the next frame shows. setup: GpuRelighter.relight()'s sky, emission and
  // bounces; the lights are the scene's.
  update(renderer, scene, setup = {}) {
    if (!this.relighter && renderer.getContext().isContextLost()) return;
    this.prepare(renderer);
    if (this.relighter.lost) return;
    this.warnOfMoves();
    drawAside(renderer, () => {
      const onCpu = this.relighter.backend === 'wasm';
      const light = onCpu ? {lights: lightsOf(scene)} : {surfelIrradianceTexture: this.drawSurfels(renderer, scene)};
      try {
        this.relighter.relight({...setup, ...light});
      } finally {
        resetState(renderer);  // as it is after that; three sets what it wants
      }
      for (const grid of this.probeGrids) grid.update(renderer);
    });
  }
  // Their direct light, as GpuRelighter.relight() takes it.
  drawSurfels(renderer, scene) {
    if (!this.surfels) this.makeSurfels();
    const {points, target, camera} = this.surfels;
    const putBack = [showLightsAlone(scene), hold(scene, {background: null, overrideMaterial: null})];
    scene.add(points);
    try {
      renderer.setRenderTarget(target);
      renderer.setClearColor(0, 0);
      renderer.render(scene, camera);
    } finally {
      scene.remove(points);
      for (const each of putBack) each();
    }
    return {texture: renderer.properties.get(target.texture).__webglTexture, width: kWidth};
  }

  // Gives back what the GPU and the module hold, and the meshes their materials.
  dispose() {
    for (const mesh of this.meshes.keys()) this.forget(mesh);
    for (const material of this.patched.keys()) this.unpatch(material);
    for (const grid of [...this.probeGrids]) grid.dispose();
    if (this.surfels) {
      this.surfels.points.geometry.dispose();
      this.surfels.points.material.dispose();
      this.surfels.target.dispose();
      this.surfels = null;
    }
    this.relighter?.dispose();
    this.relighter = null;
    this.bake.dispose();
  }
}

// The scene's lights as the library has them, without shadows: where frames come from WebAssembly. three's candela and lux are read
// as W/sr and W/m², as everywhere here. What three takes and the library refuses: a light at its target, which shines nowhere, is left out, a
// negative intensity is none, and an infinite distance is no limit.
export function lightsOf(scene) {
  const lights = [], from = new THREE.Vector3(), to = new THREE.Vector3();
  scene.traverseVisible((light) => {
    if (!light.isDirectionalLight && !light.isPointLight && !light.isSpotLight) return;
    from.setFromMatrixPosition(light.matrixWorld);
    if (light.target) to.setFromMatrixPosition(light.target.matrixWorld).sub(from).normalize();
    if (light.target && to.lengthSq() === 0) return;
    lights.push({
      kind: light.isDirectionalLight ? 'directional' : light.isSpotLight ? 'spot' : 'point',
      intensity: light.color.toArray().map((v) => Math.max(v * light.intensity, 0)), position: from.toArray(),
      ...(light.target ? {direction: to.toArray()} : {}), range: Number.isFinite(light.distance) ? Math.max(light.distance, 0) : 0,
      ...(light.isSpotLight ? {innerConeAngle: light.angle * (1 - light.penumbra), outerConeAngle: light.angle} : {}),
    });
  });
  return lights;
}
