// SPDX-License-Identifier: MIT
// Milliseconds of a frame by WebAssembly: node relight_times.mjs PACKAGE BAKE. The native library's: tests/bench/relight_times.cpp.
import {readFile} from 'node:fs/promises';
import path from 'node:path';
import {pathToFileURL} from 'node:url';

const [folder, file] = process.argv.slice(2);
const {loadBake, loadModule, Relighter} = await import(pathToFileURL(path.resolve(folder, 'src', 'index.js')));
const kFrames = 60;
for (const simd of [true, false]) {
  const bake = await loadBake(await readFile(file), {module: await loadModule({simd})});
  const relighter = new Relighter(bake);
  const lights = [{kind: 'directional', intensity: [1, 1, 1], direction: [0, -1, 0]}, {kind: 'spot', intensity: [1, 1, 1], position: [0, 1, 0]}];
  const times = Array.from({length: kFrames}, () => {
    const begin = performance.now();
    relighter.relight({lights});
    return performance.now() - begin;
  }).sort((a, b) => a - b);
  console.log(`${simd ? 'simd' : 'scalar'}: median ${times[kFrames >> 1].toFixed(1)} ms, least ${times[0].toFixed(1)} ms`);
}
