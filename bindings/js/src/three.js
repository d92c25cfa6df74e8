// SPDX-License-Identifier: MIT
// Relume in three.js' WebGL renderer. A level that `relume export` wrote has its light-map coordinates in TEXCOORD_1; what has none,
// and what moves, reads the grid. Direct light and shadows stay three's own: after a frame the surfels are drawn as points, a
// texel each, under the scene's lights and the shadow maps of that frame, and what they receive is relit (webgl.js).
import * as THREE from 'three';
import {loadBake, RelumeError} from './core.js';
import {RelumeProbes} from './three_probes.js';
import {GpuRelighter} from './webgl.js';

export {RelumeProbes};

const kLayer = 31;    // of the surfels, and of lights in addition to their own
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

export class RelumeLoader extends THREE.Loader {
  load(url, onLoad, onProgress, onError) {
    const full = this.manager.resolveURL(this.path + url);
    this.manager.itemStart(full);
    loadBake(full, {onProgress: (loaded, total) => onProgress?.({loaded, total, lengthComputable: total > 0})})
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
    this.meshes = new Map();              // {original, worn}: what a mesh had and what it has of ours, by mesh
    this.relighter = null;
    this.uniforms = {relumeShow: {value: this.show}, relumeGrid: {value: new Float32Array(24)}};
    this.probeGrids = new Set();
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
      const set = mesh.userData.relume?.lightmapTexcoord ?? 1, name = set === 0 ? 'uv' : `uv${set}`;
      const back = mesh.userData.relume?.backLightmapTexcoord;
      const onMap = Boolean(mesh.geometry.attributes[name]) && !mesh.isSkinnedMesh && !mesh.isInstancedMesh;
      const kind = onMap ? `${name}${back !== undefined && mesh.geometry.attributes[`uv${back}`] ? `,uv${back}` : ''}` : 'grid';
      const original = eachOf(mesh.material, (material) => originals.get(material) ?? material);
      const worn = eachOf(original, (material) => this.patch(material, kind));
      this.meshes.set(mesh, {original, worn});
      mesh.material = worn;
    });
    return this;
  }

  // kind: attributes of the front's and the back's coordinates, or "grid".
  patch(material, kind) {
    if (!(material.isMeshStandardMaterial || material.isMeshLambertMaterial || material.isMeshPhongMaterial)) return material;
    const variants = this.patched.get(material) ?? {};
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

  resolveGlsl() {
    return this.relighter ? this.relighter.resolve.glsl : 'vec3 relumeIrradianceGrid(vec3 p, vec3 n) { return vec3(0.0); }\n' +
        'vec3 relumeIrradianceLightmap(vec2 uv, vec3 n, vec3 g) { return vec3(0.0); }';
  }

  // The relighter and its textures for this renderer, before the first frame that uses them; update() does it as well.
  prepare(renderer) {
    if (this.relighter) return;
    const gl = renderer.getContext(), held = renderer.getRenderTarget();
    this.relighter = new GpuRelighter(gl, this.bake, {...this.options, keepState: false, onRestored: () => this.takeTextures(renderer)});
    this.glslKey = this.relighter.resolve.glsl.length + this.relighter.resolve.glsl.slice(0, 200);
    this.takeTextures(renderer);
    for (const variants of this.patched.values()) for (const clone of Object.values(variants)) clone.needsUpdate = true;
    renderer.resetState();
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
    renderer.resetState();
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
    if (this.relighter.backend === 'wasm') {
      this.relighter.relight({...setup, lights: lightsOf(scene)});
      renderer.resetState();
      return this.updateProbes(renderer);
    }
    if (!this.surfels) this.makeSurfels();
    const {points, target, camera} = this.surfels, {background, overrideMaterial} = scene, held = renderer.getRenderTarget();
    const {autoUpdate, needsUpdate} = renderer.shadowMap, clearColor = renderer.getClearColor(new THREE.Color()), clearAlpha = renderer.getClearAlpha();
    scene.traverse((object) => object.isLight && !object.isLightProbeGrid && object.layers.enable(kLayer));
    scene.add(points);
    scene.background = null;
    scene.overrideMaterial = null;
    renderer.shadowMap.autoUpdate = false;  // those of the frame that was just drawn
    renderer.shadowMap.needsUpdate = false;
    try {
      renderer.setRenderTarget(target);
      renderer.setClearColor(0, 0);
      renderer.render(scene, camera);
    } finally {
      renderer.setRenderTarget(held);
      renderer.setClearColor(clearColor, clearAlpha);
      renderer.shadowMap.autoUpdate = autoUpdate;
      renderer.shadowMap.needsUpdate = needsUpdate;
      scene.remove(points);
      scene.background = background;
      scene.overrideMaterial = overrideMaterial;
    }
    const texture = renderer.properties.get(target.texture).__webglTexture;
    this.relighter.relight({...setup, surfelIrradianceTexture: {texture, width: kWidth}});
    renderer.resetState();  // as it is after that; three sets what it wants
    try {
      this.updateProbes(renderer);
    } finally {
      renderer.setRenderTarget(held);
    }
  }
  updateProbes(renderer) {
    const autoUpdate = renderer.shadowMap.autoUpdate;
    renderer.shadowMap.autoUpdate = false;
    try {
      for (const grid of this.probeGrids) grid.update(renderer);
    } finally {
      renderer.shadowMap.autoUpdate = autoUpdate;
    }
  }

  // Gives back what the GPU and the module hold, and the meshes their materials.
  dispose() {
    for (const [mesh, {original, worn}] of this.meshes) if (mesh.material === worn) mesh.material = original;
    for (const variants of this.patched.values()) for (const clone of Object.values(variants)) clone.dispose();
    this.meshes.clear();
    this.patched.clear();
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
// as W/sr and W/m², as everywhere here.
export function lightsOf(scene) {
  const lights = [], from = new THREE.Vector3(), to = new THREE.Vector3();
  scene.traverseVisible((light) => {
    if (!light.isDirectionalLight && !light.isPointLight && !light.isSpotLight) return;
    from.setFromMatrixPosition(light.matrixWorld);
    if (light.target) to.setFromMatrixPosition(light.target.matrixWorld).sub(from).normalize();
    lights.push({
      kind: light.isDirectionalLight ? 'directional' : light.isSpotLight ? 'spot' : 'point',
      intensity: light.color.toArray().map((v) => v * light.intensity), position: from.toArray(),
      ...(light.target ? {direction: to.toArray()} : {}), range: light.distance ?? 0,
      ...(light.isSpotLight ? {innerConeAngle: light.angle * (1 - light.penumbra), outerConeAngle: light.angle} : {}),
    });
  });
  return lights;
}
