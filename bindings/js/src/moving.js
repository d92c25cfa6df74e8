// SPDX-License-Identifier: MIT
// Things that move through a baked level, and take part in its indirect light: rigid meshes become shapes once, and each frame
// says which of them stand where (include/relume/moving_shapes.h). For modules of loadModule({moving: true}) alone: the others
// are a sixth smaller.
import {countOf, forgotten, kUnsupported, kUsage, list, RelumeError, whole} from './errors.js';

const kMeshWords = 8, kPartWords = 13;

// Whether a module has what they need; an Error of that name else.
export function requireMoving(module, name) {
  if (!module.moving) {
    throw new RelumeError(`${name}: this module knows nothing that moves; loadModule({moving: true}) loads one that does`, kUnsupported);
  }
}

export class MovingShapes {
  // meshes: {positions, triangles, albedo, emission}; see index.d.ts. They are copied.
  constructor(module, meshes) {
    requireMoving(module, 'MovingShapes');
    // relume_moving_mesh of 32-bit machines, then what they point to.
    const arrays = list('meshes', meshes).map((mesh, i) => [['positions', 3], ['triangles', 3], ['albedo', 3], ['emission', 3]].map(([name, width]) => {
      const values = mesh[name] ?? [];
      countOf(`meshes[${i}].${name}`, values, width);
      if (name === 'triangles') values.forEach((corner, at) => whole(`meshes[${i}].triangles[${at}]`, corner));
      return values;
    }));
    const words = arrays.reduce((sum, mesh) => sum + mesh.reduce((all, values) => all + values.length, kMeshWords), 0);
    const block = module.allocate(4 * words), heads = module.words(block, words), floats = module.floats(block, words);
    let at = kMeshWords * meshes.length;
    arrays.forEach((mesh, i) => mesh.forEach((values, k) => {
      heads[kMeshWords * i + 2 * k] = values.length > 0 ? block + 4 * at : 0;
      heads[kMeshWords * i + 2 * k + 1] = values.length / 3;
      (k === 1 ? heads : floats).set(values, at);
      at += values.length;
    }));
    this.address = module.wasm._relume_web_shapes(block, meshes.length);
    module.wasm._free(block);
    if (this.address === 0) throw new RelumeError(module.text(module.wasm._relume_web_error()), kUsage);
    const {address} = this;
    this.module = module;
    forgotten?.register(this, () => module.wasm._relume_web_free_shapes(address), this);
  }
  dispose() {
    if (this.address === 0) return;
    forgotten?.unregister(this);
    this.module.wasm._relume_web_free_shapes(this.address);
    this.address = 0;
  }
}

// {shape, toWorld}, as relume_moving_part has them, in memory of a relighter's; their address.
export function handParts(relighter, parts) {
  const {module} = relighter, address = relighter.block('parts', 4 * kPartWords * Math.max(parts.length, 1));
  const words = module.words(address, kPartWords * parts.length), floats = module.floats(address, kPartWords * parts.length);
  parts.forEach(({shape, toWorld}, i) => {
    whole(`movingParts[${i}].shape`, shape);
    if (toWorld?.length !== 12 && toWorld?.length !== 16) {
      throw new RelumeError(`movingParts[${i}].toWorld has ${toWorld?.length} elements, expected 12 or 16, by columns`, kUsage);
    }
    const rows = toWorld.length / 4;
    words[kPartWords * i] = shape;
    for (let k = 0; k < 12; ++k) floats[kPartWords * i + 1 + k] = toWorld[rows * Math.floor(k / 3) + k % 3];
  });
  return address;
}

// The address of a frame's shapes, 0 where it has none.
export function shapesOf(relighter, shapes) {
  if (shapes === undefined || shapes === null) return 0;
  if (!(shapes instanceof MovingShapes) || shapes.module !== relighter.module) {
    throw new RelumeError('movingShapes: expected MovingShapes of the bake\'s module', kUsage);
  }
  if (shapes.address === 0) throw new RelumeError('movingShapes: the shapes were disposed of', kUsage);
  return shapes.address;
}
