// SPDX-License-Identifier: MIT
// A box of the bake's grid as a light-probe grid of three.js (0.187 and later): what lies in it is lit by it whatever its material is.
// At every probe the grid's irradiance is read in 26 directions, and nine coefficients of spherical harmonics are fitted to them:
// Lebedev's rule of degree 7 (V. I. Lebedev, Quadratures on a sphere, 1976), which is exact for what three evaluates.
// three keeps nine RGB coefficients of radiance in the channels of seven volumes above each other, with a copy of the first and the
// last slice around each (its shader chunk lightprobes_pars_fragment).
import * as THREE from 'three';
import {RelumeError} from './core.js';

const kVolumes = 7, kChannels = 4 * kVolumes;

// Points of the rule: x, y, z, weight; the weights sum to 1.
const kDirections = (() => {
  const weights = [0, 1 / 21, 4 / 105, 9 / 280], directions = [];
  for (let x = -1; x <= 1; ++x) for (let y = -1; y <= 1; ++y) for (let z = -1; z <= 1; ++z) {
    const axes = Math.abs(x) + Math.abs(y) + Math.abs(z), length = Math.sqrt(axes);  // how many it leans towards
    if (axes > 0) directions.push(new THREE.Vector4(x / length, y / length, z / length, weights[axes]));
  }
  return directions;
})();

// What coefficient c of the radiance takes of the irradiance towards n: 4 pi times the basis function over the cosine lobe's
// coefficient in its band (R. Ramamoorthi, P. Hanrahan, An efficient representation for irradiance environment maps, 2001).
const kLobe = [Math.PI, 2 * Math.PI / 3, Math.PI / 4];
const basis = (c, {x, y, z}) => [
  0.282095, 0.488603 * y, 0.488603 * z, 0.488603 * x, 1.092548 * x * y, 1.092548 * y * z, 0.315392 * (3 * z * z - 1), 1.092548 * x * z, 0.546274 * (x * x - y * y),
][c];
const bandOf = (c) => (c === 0 ? 0 : c < 4 ? 1 : 2);
// [direction * 12 + coefficient], the last three are zero
const kFit = Float32Array.from({length: kDirections.length * 12}, (_, i) => {
  const d = kDirections[Math.floor(i / 12)], c = i % 12;
  return c < 9 ? 4 * Math.PI * d.w * basis(c, d) / kLobe[bandOf(c)] : 0;
});

const kTriangle = 'void main() { gl_Position = vec4(vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0, 0.0, 1.0); }';

export class RelumeProbes extends THREE.Light {
  // Made by RelumeLighting.probes().
  constructor(lighting, {box, resolution, priority = 0} = {}) {
    super(0xffffff, 1);
    this.isLightProbeGrid = true;
    this.type = 'RelumeProbes';
    this.lighting = lighting;
    this.boundingBox = box?.clone() ?? gridBox(lighting.bake.info);
    this.resolution = resolution?.clone() ?? defaultResolution(lighting.bake.info, this.boundingBox);
    this.priority = priority;
    this.texture = null;  // none before the first update()
    if (this.boundingBox.isEmpty()) throw new RelumeError('probes: box is empty', 1);
    for (const axis of ['x', 'y', 'z']) {
      const count = this.resolution[axis];
      if (!Number.isInteger(count) || count < 1) throw new RelumeError(`probes: resolution.${axis} is ${count}, expected a whole number from 1 on`, 1);
    }
  }

  get layerCount() { return kVolumes * (this.resolution.z + 2); }

  make(renderer) {
    const {x, y, z} = this.resolution, gl = renderer.getContext();
    const most = {2: gl.getParameter(gl.MAX_TEXTURE_SIZE), 3: gl.getParameter(gl.MAX_3D_TEXTURE_SIZE)};
    // Irradiance has a row of probes for each slice and direction, the atlas a slice's rows below each other.
    for (const [what, size, limit] of [['x * y', x * y, most[2]], ['z', kDirections.length * z, most[2]], ['y * z', y * this.layerCount, most[2]], ['z', this.layerCount, most[3]]]) {
      if (size > limit) throw new RelumeError(`probes: resolution ${x}, ${y}, ${z} needs textures of ${size} texels, this WebGL has ${limit}: lessen ${what}, or use two boxes`, 1);
    }
    this.texture = new THREE.Data3DTexture(new Uint16Array(4 * x * y * this.layerCount), x, y, this.layerCount);
    Object.assign(this.texture, {type: THREE.HalfFloatType, minFilter: THREE.LinearFilter, magFilter: THREE.LinearFilter, generateMipmaps: false, unpackAlignment: 1, needsUpdate: true});
    if (this.lighting.relighter.backend === 'wasm') return;
    const plain = {minFilter: THREE.NearestFilter, magFilter: THREE.NearestFilter, depthBuffer: false, generateMipmaps: false};
    this.irradiance = new THREE.WebGLRenderTarget(x * y, kDirections.length * z, {...plain, type: THREE.FloatType});
    this.atlas = new THREE.WebGLRenderTarget(x, y * this.layerCount, {...plain, type: THREE.HalfFloatType});
    const step = new THREE.Vector3().subVectors(this.boundingBox.max, this.boundingBox.min).divide(this.resolution);
    const common = {glslVersion: THREE.GLSL3, vertexShader: kTriangle, depthTest: false, depthWrite: false, toneMapped: false};
    this.read = new THREE.RawShaderMaterial({
      ...common,
      uniforms: {...this.lighting.uniforms, probeMin: {value: this.boundingBox.min}, probeStep: {value: step}, direction: {value: kDirections}},
      fragmentShader: `precision highp float;
        precision highp int;
        precision highp sampler2DArray;
        precision highp usampler2D;
        precision highp usampler2DArray;
        ${this.lighting.resolveGlsl()}
        uniform vec3 probeMin, probeStep;
        uniform vec4 direction[${kDirections.length}];
        out vec4 color;
        void main() {
          ivec2 at = ivec2(gl_FragCoord.xy);
          vec3 probe = vec3(at.x % ${x}, at.x / ${x}, at.y / ${kDirections.length}) + 0.5;
          color = vec4(relumeIrradianceGrid(probeMin + probe * probeStep, direction[at.y % ${kDirections.length}].xyz), 1.0);
        }`,
    });
    this.fit = new THREE.RawShaderMaterial({
      ...common,
      uniforms: {irradiance: {value: this.irradiance.texture}, weight: {value: Array.from({length: kFit.length / 4}, (_, i) => new THREE.Vector4().fromArray(kFit, 4 * i))}},
      fragmentShader: `precision highp float;
        precision highp int;
        uniform highp sampler2D irradiance;
        uniform vec4 weight[${kFit.length / 4}];
        out vec4 color;
        void main() {
          ivec2 at = ivec2(gl_FragCoord.xy);
          int layer = at.y / ${y}, volume = layer / ${z + 2}, slice = clamp(layer % ${z + 2} - 1, 0, ${z - 1});
          ivec2 first = ivec2(at.x + ${x} * (at.y % ${y}), slice * ${kDirections.length});
          vec4 sum = vec4(0.0);
          for (int d = 0; d < ${kDirections.length}; ++d) {
            vec3 e = texelFetch(irradiance, first + ivec2(0, d), 0).rgb;
            for (int i = 0; i < 4; ++i) {
              int channel = 4 * volume + i, c = channel / 3;
              sum[i] += weight[3 * d + c / 4][c % 4] * e[channel % 3];
            }
          }
          color = sum;
        }`,
    });
    this.triangle = new THREE.Mesh(new THREE.BufferGeometry(), this.read);
    this.triangle.geometry.setDrawRange(0, 3);
    this.triangle.frustumCulled = false;
    this.camera = new THREE.Camera();
  }

  // RelumeLighting.update() calls it after each frame's light; the renderer's state is as three left it.
  update(renderer) {
    if (!this.texture) this.make(renderer);
    if (!this.irradiance) return this.updateOnCpu();
    for (const [material, target] of [[this.read, this.irradiance], [this.fit, this.atlas]]) {
      this.triangle.material = material;
      renderer.setRenderTarget(target);
      renderer.render(this.triangle, this.camera);
    }
    // From the atlas' framebuffer, which initTexture() may have unbound.
    const gl = renderer.getContext(), {x, y} = this.resolution;
    renderer.initTexture(this.texture);
    renderer.setRenderTarget(this.atlas);
    renderer.state.bindTexture(gl.TEXTURE_3D, renderer.properties.get(this.texture).__webglTexture);
    for (let layer = 0; layer < this.layerCount; ++layer) gl.copyTexSubImage3D(gl.TEXTURE_3D, 0, 0, 0, layer, 0, layer * y, x, y);
    renderer.state.unbindTexture();
  }

  updateOnCpu() {
    const {x, y, z} = this.resolution, {min, max} = this.boundingBox, {cpu} = this.lighting.relighter, {data} = this.texture.image;
    const directions = kDirections.length, positions = new Float32Array(3 * directions), normals = Float32Array.from(kDirections.flatMap((d) => [d.x, d.y, d.z]));
    const found = new Float32Array(kChannels);
    for (let slice = 0; slice < z; ++slice) for (let row = 0; row < y; ++row) for (let column = 0; column < x; ++column) {
      const place = [min.x + (column + 0.5) / x * (max.x - min.x), min.y + (row + 0.5) / y * (max.y - min.y), min.z + (slice + 0.5) / z * (max.z - min.z)];
      for (let d = 0; d < directions; ++d) positions.set(place, 3 * d);
      const irradiance = cpu.irradianceInGrid(positions, normals);
      found.fill(0);
      for (let d = 0; d < directions; ++d) for (let i = 0; i < 27; ++i) found[i] += kFit[12 * d + Math.floor(i / 3)] * irradiance[3 * d + i % 3];
      for (let volume = 0; volume < kVolumes; ++volume) {
        const texel = Array.from(found.subarray(4 * volume, 4 * volume + 4), (v) => THREE.DataUtils.toHalfFloat(Math.max(-65504, Math.min(v, 65504))));
        const layers = [slice + 1, ...(slice === 0 ? [0] : []), ...(slice === z - 1 ? [z + 1] : [])];
        for (const layer of layers) data.set(texel, 4 * (column + x * (row + y * (volume * (z + 2) + layer))));
      }
    }
    this.texture.needsUpdate = true;
  }

  // Also what holds it in the scene lets it go.
  dispose() {
    this.removeFromParent();
    this.lighting.probeGrids.delete(this);
    for (const each of [this.texture, this.irradiance, this.atlas, this.read, this.fit, this.triangle?.geometry]) each?.dispose();
    this.texture = this.irradiance = this.atlas = this.read = this.fit = this.triangle = null;
    super.dispose();
  }
}

// The bake's grid, half a cell around its caches.
function gridBox({gridOrigin, gridSpacing, gridResolution}) {
  const box = new THREE.Box3(), spacing = new THREE.Vector3().fromArray(gridSpacing);
  if (gridResolution.some((count) => count < 1)) throw new RelumeError('probes: the bake has no grid; give the box that is to be lit', 1);
  box.min.fromArray(gridOrigin);
  box.max.fromArray(gridResolution).subScalar(1).multiply(spacing).add(box.min);
  return box.expandByVector(spacing.multiplyScalar(0.5));
}

// A probe for each cache of the grid, 32 along an axis at most.
function defaultResolution({gridSpacing}, box) {
  const spacing = new THREE.Vector3().fromArray(gridSpacing), count = box.getSize(new THREE.Vector3()).divide(spacing);
  return count.round().clampScalar(1, 32);
}
