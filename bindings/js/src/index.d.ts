// SPDX-License-Identifier: MIT
// Radiometric and metric throughout; +Y up; colours are linear red, green, blue. include/relume/relume.h says more. Vectors that are
// handed over are any arrays of three numbers, as toArray() of three.js' vectors and colours gives them.

export type Vector3 = readonly [number, number, number];

/** What was refused, or could not be loaded, by the library's own text. */
export class RelumeError extends Error {
  constructor(message: string, status?: number);
  /** relume_status: 1 usage, 2 input and output, 3 invalid file, 4 failed, 5 unsupported, 6 memory; 0 unknown. */
  readonly status: number;
}

export interface ModuleOptions {
  /** Default: where the browser has it. */
  simd?: boolean;
  /** With things that move (MovingShapes), a sixth larger; default false. */
  moving?: boolean;
  /** Folder of the .mjs and .wasm files, absolute, with a / at its end; default: the package's. */
  folder?: URL;
  /** The .wasm file's bytes, where they cannot be fetched. */
  wasmBinary?: ArrayBuffer | Uint8Array;
}

/** A WebAssembly module with memory of its own. */
export class Module {
  private constructor();
  readonly simd: boolean;
  readonly moving: boolean;
  readonly version: string;
  /** Bytes that bakes and relighters hold. */
  readonly liveBytes: number;
}

export function hasSimd(): boolean;
/** Without options, one module for the whole page. */
export function loadModule(options?: ModuleOptions): Promise<Module>;

/** How a URL is fetched. */
export interface RequestOptions {
  /** Sent along, as a token; default none. */
  headers?: RequestInit['headers'];
  /** Whether cookies are; default that of fetch(): 'same-origin'. */
  credentials?: RequestInit['credentials'];
}

export interface LoadOptions extends RequestOptions {
  module?: Module;
  /** total: 0 where the server does not say. What it throws ends the download, and is what loadBake() throws. */
  onProgress?: (received: number, total: number) => void;
  /** Ends the download: loadBake() throws its reason. */
  signal?: AbortSignal;
}

/**
 * Bakes of all kinds, packed or not, through gzip (`relume pack -o OUT.relume.gz`) or not. Throws RelumeError: a URL that is not there, bytes that are no bake, no memory,
 * gzip where the browser has no DecompressionStream.
 */
export function loadBake(source: string | URL | ArrayBuffer | ArrayBufferView, options?: LoadOptions): Promise<Bake>;

export interface BakeInfo {
  readonly surfels: number;
  readonly nodes: number;
  readonly caches: number;
  readonly skyPatches: number;
  readonly instances: number;
  /** [texel] 0 without a light map. */
  readonly lightmapWidth: number;
  readonly lightmapHeight: number;
  /** What the bake recommends. */
  readonly lumaBands: number;
  readonly chromaBands: number;
  /** [m] */
  readonly gridOrigin: Vector3;
  readonly gridSpacing: Vector3;
  readonly gridResolution: Vector3;
  /** Hexadecimal: what the bake was made from. */
  readonly sceneHash: string;
}

export class Bake {
  private constructor();
  readonly module: Module;
  readonly info: BakeInfo;
  /** Names of the materials whose light a frame may replace. */
  readonly drivableMaterials: string[];
  instanceName(instance: number): string;
  /** Two floats per triangle corner in the level's order; -1 where the grid lights a triangle. */
  lightmapCoordinates(instance: number, options?: {backSide?: boolean}): Float32Array;
  /** [m] and unit, three floats per surfel. */
  surfels(): {positions: Float32Array; normals: Float32Array};
  /** Unit, three floats per patch of sky. */
  skyDirections(): Float32Array;
  /** Gives the memory back; relighters of it stay. */
  dispose(): void;
}

export interface Light {
  kind: 'directional' | 'point' | 'spot';
  /** Point, spot [W/sr]; directional [W/m²]. */
  intensity: ArrayLike<number>;
  /** [m] at most 1e9 on an axis. */
  position?: ArrayLike<number>;
  /** Unit, the way the light travels. */
  direction?: ArrayLike<number>;
  /** [m] 0 = no limit. */
  range?: number;
  /** [rad] of a spot; default 0. */
  innerConeAngle?: number;
  /** [rad] of a spot; default pi / 4. */
  outerConeAngle?: number;
}

/** A rigid mesh in axes of its own. */
export interface MovingMesh {
  /** [m] three floats per vertex. */
  positions: ArrayLike<number>;
  /** Three vertices per triangle; the front is counter-clockwise. */
  triangles: ArrayLike<number>;
  /** [0..1] three floats, or three per triangle. */
  albedo: ArrayLike<number>;
  /** [W/m²/sr] of the fronts: three floats, or three per triangle. */
  emission?: ArrayLike<number>;
}

/** What moves through a baked level, shadows its indirect light and throws colour: for modules of loadModule({moving: true}). */
export class MovingShapes {
  constructor(module: Module, meshes: readonly MovingMesh[]);
  /** Gives the memory back; frames must not name it any more. */
  dispose(): void;
}

export interface MovingPart {
  /** Index of the mesh that was handed to MovingShapes. */
  shape: number;
  /** By columns: x, y and z axis, then the place; 12 floats, or the 16 of a matrix with a last row. */
  toWorld: ArrayLike<number>;
}

export interface LightSetup {
  lights?: readonly Light[];
  /** [W/m²] three floats per surfel, in place of the lights: the host's own direct light with its shadows. */
  surfelIrradiance?: ArrayLike<number>;
  /** [W/m²/sr] three floats per surfel, in place of the baked emission. */
  surfelEmission?: ArrayLike<number>;
  /** [W/m²/sr] three floats per patch of sky, in place of skyRadiance. */
  skyPatches?: ArrayLike<number>;
  /** [W/m²/sr] of a constant sky; default 0. */
  skyRadiance?: ArrayLike<number>;
  /** Factor on the baked emission and on that of movingParts; default 1. */
  emissionScale?: ArrayLike<number>;
  /** [0..1] share of last frame's light; default 1. */
  bounceScale?: number;
  /** [W/m²/sr] in place of the baked emission of drivable materials: of all that have the name, or of the one with the index. */
  materials?: readonly {material: string | number; radiance: ArrayLike<number>}[];
  /** What stands where in this frame, lit by the lights and by last frame's grid. `visibility` answers for points on parts as well. */
  movingParts?: readonly MovingPart[];
  /** What movingParts name. WorkerRelighter: setMovingShapes(). */
  movingShapes?: MovingShapes;
  /**
   * Shares [0..1] of a light that reach `count` points: the host's shadows. Write all of `visible`. The arrays end with the call.
   * Other relighters may be called in it once `visible` is written, for that may end the arrays; its own may not be relit or disposed of.
   * Relighter alone: a worker cannot call the page. If it throws, relight() throws the same, but the frame is applied, with the points that
   * had no answer in shadow: reset() forgets it.
   */
  visibility?: (light: number, count: number, positions: Float32Array, normals: Float32Array, visible: Float32Array) => void;
}

export interface RelighterOptions {
  /** [0..256] most of LightSetup.movingParts in a frame; default 0. Of modules that have them alone. */
  movingParts?: number;
  /** [1, 2, 4 .. 64] frames within which each cache near parts is looked at again; 1 = all in every frame; default 32. */
  movingLag?: number;
  /** [0..4] 0 = what the bake recommends. */
  lumaBands?: number;
  /** [0..lumaBands] 0 = what the bake recommends. */
  chromaBands?: number;
  /** The light map keeps the bands that glossy receivers alone read. */
  glossy?: boolean;
  /** Keep the grid as a texture of irradiance vectors too. */
  gridTexture?: boolean;
}

/** include/relume/texture_resolve.h: what a host's shader reads light from. */
export interface ResolveTexture {
  readonly sampler: string;
  readonly shape: 'flat' | 'array' | 'volume';
  readonly format: 'rgba16f' | 'rg16f' | 'rgba8' | 'r8';
  readonly width: number;
  readonly height: number;
  readonly depth: number;
  /** Linear; else nearest. Clamped to the edge either way. */
  readonly filtered: boolean;
  /** To be written after each relight(); else once. */
  readonly light: boolean;
  readonly bytes: number;
}
export interface TextureResolve {
  readonly textures: readonly ResolveTexture[];
  /** GLSL ES 3.00 for after #version: relumeIrradianceLightmap(uv, n), relumeIrradianceGrid(position, n). */
  readonly glsl: string;
  /** uniform vec4 relumeGrid[6]. */
  readonly grid: Float32Array;
}

/** The relighter on the CPU. Arrays that it returns are views that last until its next call: copy what is to stay. */
export class Relighter {
  constructor(bake: Bake, options?: RelighterOptions);
  readonly info: BakeInfo;
  readonly coefficientsPerCache: number;
  /** One frame. A setup that is refused is not applied: last frame's light stays. */
  relight(setup?: LightSetup): void;
  /** Forget last frame's light. */
  reset(): void;
  coefficients(): Float32Array;
  /** RGBA16F, four halves per texel: irradiance for each texel's own normal. */
  irradianceMap(): Uint16Array;
  irradianceOnLightmap(uvs: ArrayLike<number>, normals: ArrayLike<number>, geometricNormals?: ArrayLike<number> | null): Float32Array;
  irradianceInGrid(positions: ArrayLike<number>, normals: ArrayLike<number>): Float32Array;
  textureResolve(): TextureResolve;
  resolveTexels(texture: number): Uint8Array;
  dispose(): void;
}

export interface WorkerRelighterOptions extends RelighterOptions, RequestOptions {
  module?: ModuleOptions;
  onProgress?: (received: number, total: number) => void;
  /** Script of the worker, `relume/worker`, where a bundler put it elsewhere than beside the page's script as worker.js. */
  worker?: URL | string;
}

export interface WorkerFrame {
  /** Of relight() in the worker. */
  ms: number;
  /** Texels of the textures that are light; null for the others. */
  textures?: (Uint8Array | null)[];
  irradianceMap?: Uint16Array;
  coefficients?: Float32Array;
}

/** The same in a worker: frames come as promises. Where the worker fails or ends, calls that wait and later ones are rejected. */
export class WorkerRelighter {
  private constructor();
  static create(source: string | URL | ArrayBuffer | ArrayBufferView,
                options?: WorkerRelighterOptions): Promise<WorkerRelighter>;
  readonly info: BakeInfo;
  readonly simd: boolean;
  readonly coefficientsPerCache: number;
  readonly drivableMaterials: string[];
  readonly surfels: {positions: Float32Array; normals: Float32Array};
  readonly skyDirections: Float32Array;
  readonly resolve: TextureResolve;
  /** Texels of the textures that are written once; null for the others. */
  readonly still: (Uint8Array | null)[];
  /** What the movingParts of later frames name. */
  setMovingShapes(meshes: readonly MovingMesh[]): Promise<void>;
  relight(setup?: Omit<LightSetup, 'visibility' | 'movingShapes'>, wants?: readonly ('textures' | 'irradianceMap' | 'coefficients')[]): Promise<WorkerFrame>;
  reset(): Promise<void>;
  dispose(): void;
}
