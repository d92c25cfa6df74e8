// SPDX-License-Identifier: MIT
// Where the files of wasm/ are. Each has a URL written out, for by these bundlers find what they must copy beside their output; none is
// made before it is asked for, for in a classic script there is no import.meta.url.
export const kModuleFiles = {
  'relume-simd.mjs': () => new URL('../wasm/relume-simd.mjs', import.meta.url),
  'relume-simd.wasm': () => new URL('../wasm/relume-simd.wasm', import.meta.url),
  'relume-simd-moving.mjs': () => new URL('../wasm/relume-simd-moving.mjs', import.meta.url),
  'relume-simd-moving.wasm': () => new URL('../wasm/relume-simd-moving.wasm', import.meta.url),
  'relume-scalar.mjs': () => new URL('../wasm/relume-scalar.mjs', import.meta.url),
  'relume-scalar.wasm': () => new URL('../wasm/relume-scalar.wasm', import.meta.url),
  'relume-scalar-moving.mjs': () => new URL('../wasm/relume-scalar-moving.mjs', import.meta.url),
  'relume-scalar-moving.wasm': () => new URL('../wasm/relume-scalar-moving.wasm', import.meta.url),
};
