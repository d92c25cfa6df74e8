// SPDX-License-Identifier: MIT
// Milliseconds of a frame by WebAssembly: node relight_times.mjs PACKAGE BAKE [PARTS]. With PARTS as many boxes of 0.8 x 0.6 x 1 m go
// through the level, 2 cm a frame. The native library's: tests/bench/relight_times.cpp.
import {readFile} from 'node:fs/promises';
import path from 'node:path';
import {pathToFileURL} from 'node:url';

const [folder, file, parts = '0'] = process.argv.slice(2), movingParts = Number(parts);
const {loadBake, loadModule, MovingShapes, Relighter} = await import(pathToFileURL(path.resolve(folder, 'src', 'index.js')));
const kFrames = 60;
const box = {
  positions: Array.from({length: 8}, (_, i) => [i & 1 ? 0.4 : -0.4, i & 2 ? 0.3 : -0.3, i & 4 ? 0.5 : -0.5]).flat(),
  triangles: [0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4, 2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5],
  albedo: [0.8, 0.2, 0.1],
};
for (const simd of [true, false]) {
  const module = await loadModule({simd, moving: movingParts > 0});
  const bake = await loadBake(await readFile(file), {module});
  const relighter = new Relighter(bake, {movingParts});
  const lights = [{kind: 'directional', intensity: [1, 1, 1], direction: [0, -1, 0]}, {kind: 'spot', intensity: [1, 1, 1], position: [0, 1, 0]}];
  const movingShapes = movingParts > 0 ? new MovingShapes(module, [box]) : null;
  const times = Array.from({length: kFrames}, (_, frame) => {
    const at = (k) => ({shape: 0, toWorld: [1, 0, 0, 0, 1, 0, 0, 0, 1, 1 + k + 0.02 * frame, 0.6, 2]});
    const setup = {lights, movingShapes, movingParts: Array.from({length: movingParts}, (_, k) => at(k))};
    const begin = performance.now();
    relighter.relight(setup);
    return performance.now() - begin;
  });
  const first = times[0];
  times.sort((a, b) => a - b);
  console.log(`${simd ? 'simd' : 'scalar'}: median ${times[kFrames >> 1].toFixed(1)} ms, least ${times[0].toFixed(1)} ms, the first ${first.toFixed(1)} ms`);
}
