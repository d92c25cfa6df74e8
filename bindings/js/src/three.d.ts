// SPDX-License-Identifier: MIT
import type {Box3, Data3DTexture, Light as ThreeLight, Loader, Object3D, Scene, Vector2, Vector3, WebGLRenderer} from 'three';
import type {Bake, Light} from './index.js';
import type {GpuLightSetup, GpuRelighter, GpuRelighterOptions} from './webgl.js';

/** Loads a bake as the lighting of a scene, with setRequestHeader() and setWithCredentials(). Failures are RelumeError. */
export class RelumeLoader extends Loader<RelumeLighting> {}

export class RelumeLighting {
  /** Takes the bake over. */
  constructor(bake: Bake, options?: Omit<GpuRelighterOptions, 'visibilityGlsl' | 'bindVisibility' | 'onRestored' | 'keepState'>);
  readonly bake: Bake;
  /** Null before the first update(). */
  readonly relighter: GpuRelighter | null;
  /** Factors on direct light (x) and on indirect light (y): (1, 0), (0, 1), (1, 1). */
  readonly show: Vector2;
  /**
   * All meshes below, those of the level and those that move: MeshStandardMaterial, MeshPhysicalMaterial, MeshLambertMaterial and
   * MeshPhongMaterial, which are replaced by clones. What has the light-map coordinates of `relume export` reads the light map, the rest the grid:
   * geometry.userData.relume names the sets, {lightmapTexcoord, backLightmapTexcoord}, or the mesh's userData.relume.
   * The level stays where it was baked, which is where its .glb has it: what reads the light map takes no light along.
   * What another lighting lit is this one's from then on: to replace a bake, apply the new one and then dispose of the old.
   */
  applyTo(object: Object3D): this;
  /** Puts the materials back of all meshes below that still have this lighting's, and forgets the meshes. Clones go when their original is disposed of. */
  remove(object: Object3D): this;
  /**
   * A light-probe grid (three 0.187 and later) for what applyTo() is not called for, whatever its material: add it to the scene. update() fills it
   * each frame. What lies in several is lit by that of the highest priority.
   */
  probes(options?: RelumeProbeOptions): RelumeProbes;
  /** The relighter and its textures before the first frame; update() does it as well. A lighting is for one renderer. */
  prepare(renderer: WebGLRenderer): void;
  /**
   * After renderer.render(scene, camera): relights for the next frame by the scene's lights and the shadow maps of this one. Nothing while the context is lost.
   * Layers, clipping planes and a headset's cameras are for pictures alone; the renderer is as it was afterwards, with its counts.
   */
  update(renderer: WebGLRenderer, scene: Scene, setup?: Omit<GpuLightSetup, 'lights' | 'surfelIrradiance' | 'surfelIrradianceTexture'>): void;
  /** Puts the materials back where meshes still have this lighting's, gives back what the GPU and the module hold, and disposes of the bake. */
  dispose(): void;
}

export interface RelumeProbeOptions {
  /** In the world; default: the bake's grid. */
  box?: Box3;
  /** Probes along each axis; default: one for each cell of the bake's grid, 32 at most. Failures of WebGL's limits come with the first update(). */
  resolution?: Vector3;
  priority?: number;
}

/** What WebGLRenderer takes as isLightProbeGrid. Materials that applyTo() replaced do not read it. */
export class RelumeProbes extends ThreeLight {
  private constructor();
  readonly isLightProbeGrid: true;
  readonly boundingBox: Box3;
  readonly resolution: Vector3;
  priority: number;
  /** Null before the first update(). */
  readonly texture: Data3DTexture | null;
  /** Takes it from the scene and the lighting. */
  dispose(): void;
}

/** The scene's point, spot and directional lights as the library has them, without their shadows; none that is at its target. */
export function lightsOf(scene: Object3D): Light[];
