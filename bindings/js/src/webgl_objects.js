// SPDX-License-Identifier: MIT
// Objects of WebGL 2 that are deleted together, and the state of the host's context, which passes leave as they found it.
import {RelumeError} from './core.js';

const kFailed = 4, kUnsupported = 5;

const kVertex = `#version 300 es
void main() { gl_Position = vec4(vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0), 0.0, 1.0); }
`;

// Objects of one context by kind, so that all of them can be deleted.
export class GlObjects {
  constructor(gl) {
    this.gl = gl;
    this.made = [];
    this.maxSide = gl.getParameter(gl.MAX_TEXTURE_SIZE);
  }
  add(kind, object) {
    if (!object && !this.gl.isContextLost()) throw new RelumeError(`WebGL gives no ${kind}`, kFailed);
    this.made.push([kind, object]);
    return object;
  }
  // A texture of one mip level. shape: 2D unless it has layers.
  texture(format, width, height, {layers = 0, filtered = false} = {}) {
    const {gl} = this, target = layers > 0 ? gl.TEXTURE_2D_ARRAY : gl.TEXTURE_2D, side = Math.max(width, height);
    if (side > this.maxSide) throw new RelumeError(`a texture of ${side} texels is needed, this WebGL has at most ${this.maxSide}`, kUnsupported);
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
  // Texels of a texture's level, from its first on.
  put(texture, {format, type, width, height, layers = 0, y = 0}, texels) {
    const {gl} = this;
    if (layers > 0) {
      gl.bindTexture(gl.TEXTURE_2D_ARRAY, texture);
      gl.texSubImage3D(gl.TEXTURE_2D_ARRAY, 0, 0, 0, 0, width, height, layers, format, type, texels);
    } else {
      gl.bindTexture(gl.TEXTURE_2D, texture);
      gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, y, width, height, format, type, texels);
    }
  }
  deleteTexture(texture) {
    this.gl.deleteTexture(texture);
    this.made = this.made.filter(([, object]) => object !== texture);
  }
  dispose() {
    for (const [kind, object] of this.made.reverse()) this.gl[`delete${kind}`](object);
    this.made = [];
  }
}

// The state that the passes want. What it was is put back by the function that this returns; texture units are left empty. keep: false =
// nothing is put back, nor asked for: questions to a context wait for what it was told before.
export function setState(gl, keep) {
  const flags = [gl.BLEND, gl.DEPTH_TEST, gl.SCISSOR_TEST, gl.CULL_FACE, gl.STENCIL_TEST, gl.RASTERIZER_DISCARD];
  const pixels = [gl.UNPACK_FLIP_Y_WEBGL, gl.UNPACK_PREMULTIPLY_ALPHA_WEBGL, gl.UNPACK_ALIGNMENT, gl.UNPACK_ROW_LENGTH, gl.UNPACK_IMAGE_HEIGHT,
                  gl.UNPACK_SKIP_ROWS, gl.UNPACK_SKIP_PIXELS, gl.UNPACK_SKIP_IMAGES, gl.UNPACK_COLORSPACE_CONVERSION_WEBGL];
  const restore = keep ? readState(gl, flags, pixels) : () => {};
  for (const flag of flags) gl.disable(flag);
  for (const name of pixels) gl.pixelStorei(name, name === gl.UNPACK_ALIGNMENT ? 1 : 0);
  gl.bindBuffer(gl.PIXEL_UNPACK_BUFFER, null);
  gl.colorMask(true, true, true, true);
  return restore;
}

// A function that puts back what is set now.
function readState(gl, flags, pixels) {
  const on = flags.map((flag) => gl.isEnabled(flag)), values = pixels.map((name) => gl.getParameter(name));
  const [program, vao, draw, read, unit, viewport, mask, unpack] =
      [gl.CURRENT_PROGRAM, gl.VERTEX_ARRAY_BINDING, gl.DRAW_FRAMEBUFFER_BINDING, gl.READ_FRAMEBUFFER_BINDING, gl.ACTIVE_TEXTURE, gl.VIEWPORT,
       gl.COLOR_WRITEMASK, gl.PIXEL_UNPACK_BUFFER_BINDING].map((name) => gl.getParameter(name));
  return () => {
    flags.forEach((flag, i) => (on[i] ? gl.enable(flag) : gl.disable(flag)));
    pixels.forEach((name, i) => gl.pixelStorei(name, values[i]));
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
