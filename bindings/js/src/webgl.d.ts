// SPDX-License-Identifier: MIT
import type {Bake, BakeInfo, LightSetup, RelighterOptions, TextureResolve} from './index.js';

export interface GpuRelighterOptions extends Omit<RelighterOptions, 'gridTexture' | 'movingParts' | 'movingLag'> {
  /** GLSL ES 3.00 that defines `float relumeVisibility(uint light, vec3 positionWorld, vec3 normal)`; default: nothing is in shadow. */
  visibilityGlsl?: string;
  /** Sets that code's uniforms before each frame. Texture units from firstUnit on are free; bind what it reads there. */
  bindVisibility?: (gl: WebGL2RenderingContext, program: WebGLProgram, firstUnit: number) => void;
  onLost?: () => void;
  /** All objects are anew: read textures and resolve again. Light starts from none. */
  onRestored?: () => void;
  /** What went wrong as the context came back; default: console.error. */
  onError?: (error: Error) => void;
  /** Frames come from WebAssembly, and why. */
  onFallback?: (reason: string) => void;
  /** Default true: calls leave the context's state as it was. false saves asking for it, which waits for the GPU process. */
  keepState?: boolean;
  /** Relight by WebAssembly whatever the context can. */
  forceFallback?: boolean;
}

export interface GpuLightSetup extends Omit<LightSetup, 'visibility' | 'materials' | 'movingParts' | 'movingShapes'> {
  /** In place of surfelIrradiance, without its way through main memory: texel i, in rows of `width`, has the irradiance of surfel i. */
  surfelIrradianceTexture?: {texture: WebGLTexture; width: number};
}

/**
 * The relighter in WebGL 2. The context's state is as before after each call (keepState), but for texture units, of which those that it used
 * are empty. The bake must not be disposed of before it.
 */
export class GpuRelighter {
  /** Throws RelumeError, also where the context is lost just then: make it after webglcontextrestored. */
  constructor(gl: WebGL2RenderingContext, bake: Bake, options?: GpuRelighterOptions);
  readonly info: BakeInfo;
  /** 'wasm' where the context cannot draw into floating-point textures. */
  readonly backend: 'webgl2' | 'wasm';
  /** Why backend is 'wasm'; '' else. */
  readonly reason: string;
  readonly lost: boolean;
  /** By the names of their samplers in resolve.glsl. Others after onRestored. */
  readonly textures: Readonly<Record<string, WebGLTexture>>;
  readonly resolve: TextureResolve;
  /** One frame; false while the context is lost. */
  relight(setup?: GpuLightSetup): boolean;
  reset(): void;
  /** Deletes all objects. */
  dispose(): void;
}
