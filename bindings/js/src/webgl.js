// SPDX-License-Identifier: MIT
// The relighter as passes of WebGL 2: surfels, pull level by level, caches, then the textures that a resolve by textures reads
// (include/relume/texture_resolve.h). No frame reads anything back, nor runs WebAssembly, which loads the bake and lays it out.
// Where the context cannot draw into floating-point textures the frames come from WebAssembly instead, and `backend` and
// `reason` say so. The light is the CPU backend's, to the rounding of halves and of packed colours (docs/notes/web.md).
import {RelumeError, Relighter} from './core.js';
import {list, object} from './errors.js';
import {color, packColors, packLight, refuse} from './webgl_lights.js';
import {GlObjects, setState} from './webgl_objects.js';
import {makePasses} from './webgl_passes.js';
import {kRow, withTables} from './webgl_tables.js';

const kUnsupported = 5;

export class GpuRelighter {
  // gl: a WebGL2RenderingContext. bake: not to be disposed of before this.
  constructor(gl, bake, {onLost, onRestored, onError, onFallback, forceFallback = false, keepState = true, visibilityGlsl = '', bindVisibility = null, ...options} = {}) {
    if (!gl?.texStorage3D) refuse('GpuRelighter: expected a WebGL 2 context');
    if (gl.isContextLost()) refuse('GpuRelighter: the context is lost; make the relighter when it has come back (webglcontextrestored)');
    if (options.movingParts > 0) refuse('movingParts is for the CPU: Relighter and WorkerRelighter have it');
    Object.assign(this, {gl, bake, options, visibilityGlsl, bindVisibility, keepState, info: bake.info});
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
    this.objects = new GlObjects(gl);
    this.cpu?.dispose();
    this.cpu = null;
    const cpu = new Relighter(this.bake, this.options);
    try {
      gl.activeTexture(gl.TEXTURE0);
      gl.bindSampler(0, null);
      this.resolve = cpu.textureResolve();
      this.makeResolveTextures(cpu);
      if (this.backend === 'webgl2') this.makeFrame(cpu);
      if (this.backend === 'wasm') this.cpu = cpu;
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
    this.textures = {};
    this.uploads = this.resolve.textures.map((texture, i) => {
      const [internal, format, type, Texels] = formats[texture.format];
      if (texture.shape === 'volume') throw new RelumeError('gridTexture is not for WebGL', kUnsupported);
      const layers = texture.shape === 'array' ? texture.depth : 0;
      const made = this.objects.texture(internal, texture.width, texture.height, {layers, filtered: texture.filtered});
      this.textures[texture.sampler] = made;
      const upload = () => {
        const bytes = cpu.resolveTexels(i), texels = new Texels(bytes.buffer, bytes.byteOffset, bytes.length / Texels.BYTES_PER_ELEMENT);
        this.objects.put(made, {format, type, width: texture.width, height: texture.height, layers}, texels);
      };
      upload();
      return texture.light ? upload : null;
    });
  }

  // The passes, and what frames draw with.
  makeFrame(cpu) {
    const {gl, objects, bake} = this;
    this.passes = withTables(bake, (tables) => makePasses({
      objects, bake, tables, textures: this.textures, options: this.options, coefficientsPerCache: cpu.coefficientsPerCache,
      resolveGrid: this.resolve.grid, visibilityGlsl: this.visibilityGlsl,
    }));
    this.lists = this.passes.lists;
    this.nearest = objects.add('Sampler', gl.createSampler());
    for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.samplerParameteri(this.nearest, name, gl.NEAREST);
    this.vao = objects.add('VertexArray', gl.createVertexArray());
    this.inputs = {};  // textures of what frames hand over: {texture, width, height}
    for (const name of ['relumeLights', 'relumeHostLight', 'relumeHostEmission', 'relumeSkyPatches']) this.input(name, 3, 1);
  }
  // A floating-point texture of an input, at least so large.
  input(name, width, height) {
    const held = this.inputs[name];
    if (held && held.width >= width && held.height >= height) return held;
    this.inputs[name] = {texture: this.objects.texture(this.gl.RGBA32F, width, height), width, height};
    if (held) this.objects.deleteTexture(held.texture);
    this.lists[name] = this.inputs[name].texture;
    return this.inputs[name];
  }
  putInput(name, {texels, width, height}) {
    const {gl} = this, {texture} = this.input(name, width, height);
    this.objects.put(texture, {format: gl.RGBA, type: gl.FLOAT, width, height}, texels);
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
    object('setup', setup);
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
    const frame = {...setup, lights: list('lights', setup.lights ?? []), skyRadiance: setup.skyRadiance ?? [0, 0, 0],
                   emissionScale: setup.emissionScale ?? [1, 1, 1], bounceScale: setup.bounceScale ?? 1};
    this.handOver(frame, this.checkFrame(frame));
    this.gl.bindVertexArray(this.vao);
    this.drawSurfels(frame);
    this.drawTree();
    this.drawCaches();
  }
  // All that can be refused before anything is drawn. Gives what the frame hands over, by the names of the samplers.
  checkFrame(frame) {
    const {info} = this, {bounceScale, surfelIrradianceTexture: host} = frame;
    if (frame.visibility) refuse('visibility is for the CPU: in WebGL hand visibilityGlsl or surfelIrradiance over');
    if (frame.movingParts?.length > 0) refuse('movingParts is for the CPU: Relighter and WorkerRelighter have it');
    if (frame.materials?.length > 0) refuse('materials is for the CPU: in WebGL hand surfelEmission over');
    for (const name of ['skyRadiance', 'emissionScale']) color(name, frame[name]);
    if (!(bounceScale >= 0 && bounceScale <= 1)) refuse(`bounceScale is ${bounceScale}, expected 0 to 1`);
    if (host && !(host.width > 0)) refuse('surfelIrradianceTexture.width is missing');
    const lights = new Float32Array(12 * Math.max(frame.lights.length, 1));
    frame.lights.forEach((light, i) => packLight(light, i, lights));
    return {
      relumeLights: {texels: lights, width: lights.length / 4, height: 1},
      relumeHostLight: packColors('surfelIrradiance', frame.surfelIrradiance, info.surfels, kRow),
      relumeHostEmission: packColors('surfelEmission', frame.surfelEmission, info.surfels, kRow),
      relumeSkyPatches: packColors('skyPatches', frame.skyPatches, info.skyPatches, info.skyPatches),
    };
  }
  // What the host gives, into textures.
  handOver({surfelIrradianceTexture: host}, inputs) {
    for (const [name, packed] of Object.entries(inputs)) packed && this.putInput(name, packed);
    this.lists.relumeHostLight = host ? host.texture : this.inputs.relumeHostLight.texture;
  }
  drawSurfels(frame) {
    const {gl} = this, host = frame.surfelIrradianceTexture, pass = this.passes.surfels, {uniforms} = pass;
    this.use(pass);
    gl.uniform1ui(uniforms.get('relumeLightCount'), frame.lights.length);
    gl.uniform1i(uniforms.get('relumeHostWidth'), host ? host.width : frame.surfelIrradiance ? kRow : 0);
    gl.uniform1i(uniforms.get('relumeHostEmits'), frame.surfelEmission ? 1 : 0);
    gl.uniform1i(uniforms.get('relumeHostSky'), frame.skyPatches ? 1 : 0);
    gl.uniform3fv(uniforms.get('relumeEmissionScale'), Float32Array.from(frame.emissionScale));
    gl.uniform3fv(uniforms.get('relumeSkyRadiance'), Float32Array.from(frame.skyRadiance));
    gl.uniform1f(uniforms.get('relumeBounceScale'), this.frames > 0 ? frame.bounceScale : 0);
    if (this.bindVisibility) {
      this.bindVisibility(gl, pass.program, pass.units.size);
      this.use(pass);
    }
    this.drawRange(0, this.passes.senders);
  }
  // Elements [begin, end) by a pass that is told of them.
  drawElements(pass, begin, end) {
    const {gl} = this;
    this.use(pass);
    gl.uniform1ui(pass.uniforms.get('relumeBegin'), begin);
    gl.uniform1ui(pass.uniforms.get('relumeEnd'), end);
    this.drawRange(begin, end);
  }
  // The hierarchy, level by level.
  drawTree() {
    const {levels, pull, join} = this.passes;
    for (let level = levels.length - 2; level >= 0; --level) this.drawElements(pull[level % 2], levels[level], levels[level + 1]);
    this.drawElements(join, 0, this.info.nodes);
  }
  // Caches, then the textures that hosts read.
  drawCaches() {
    const {gl, info} = this, {caches, fillMap, fillGrid, gridTexels} = this.passes;
    for (const pass of caches) this.drawElements(pass, pass.begin, pass.end);
    for (const pass of fillMap) {
      this.use(pass);
      gl.viewport(0, 0, info.lightmapWidth, info.lightmapHeight);
      gl.drawArrays(gl.TRIANGLES, 0, 3);
    }
    if (fillGrid) {
      this.use(fillGrid);
      this.drawRange(0, gridTexels);
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
