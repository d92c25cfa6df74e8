// SPDX-License-Identifier: MIT
// The host's lights and colours, checked, as the passes read them.
import {RelumeError} from './core.js';
import {sized, vector} from './errors.js';

const kUsage = 1;

export const refuse = (text) => { throw new RelumeError(text, kUsage); };
const isVector = (v) => v?.length === 3 && Array.prototype.every.call(v, Number.isFinite);
const kMaxLight = 1e20;  // kMaxIntensity of formats/limits.h

// `value`, if it is three channels of light, or a factor on them.
export function color(name, value) {
  if (!isVector(value) || Array.prototype.some.call(value, (v) => v < 0 || v > kMaxLight)) refuse(`${name} is ${value}, expected three numbers in [0..1e20]`);
  return value;
}

// `count` colours in rows of `row` texels, where there are any: {texels, width, height}, else null.
export function packColors(name, values, count, row) {
  if (values === undefined || values === null) return null;
  sized(name, values, 3 * count);
  const height = Math.ceil(count / row), texels = new Float32Array(4 * row * height);
  for (let i = 0; i < count; ++i) {
    for (let k = 0; k < 3; ++k) {
      const value = texels[4 * i + k] = values[3 * i + k];
      if (!(value >= 0 && value <= kMaxLight)) color(`${name}[${i}]`, Array.from({length: 3}, (_, c) => values[3 * i + c]));
    }
  }
  return {texels, width: row, height};
}

// RelumeLight of shaders/shared/layout.h, twelve floats, as runtime/passes/pack_lights.cpp packs it.
export function packLight(light, i, to) {
  if (!['directional', 'point', 'spot'].includes(light.kind)) {
    refuse(`lights[${i}].kind is ${JSON.stringify(light.kind)}, expected "directional", "point" or "spot"`);
  }
  color(`lights[${i}].intensity`, light.intensity);
  const directional = light.kind === 'directional', spot = light.kind === 'spot', at = 12 * i;
  const position = light.position ?? [0, 0, 0], direction = vector(`lights[${i}].direction`, light.direction ?? [0, 0, -1]);
  if (!directional && !isVector(position)) refuse(`lights[${i}].position is ${position}, expected three finite numbers`);
  const length = Math.hypot(direction[0], direction[1], direction[2]);
  if ((directional || spot) && !(Math.abs(length - 1) <= 0.01)) refuse(`lights[${i}].direction has length ${length}, expected 1`);
  const range = light.range ?? 0, inner = light.innerConeAngle ?? 0, outer = light.outerConeAngle ?? Math.PI / 4;
  if (!(range >= 0)) refuse(`lights[${i}].range is ${range}, expected >= 0`);
  if (spot && !(inner >= 0 && inner <= outer && outer <= Math.PI)) refuse(`lights[${i}]: cone angles ${inner}, ${outer}, expected 0 <= inner <= outer <= pi`);
  const cosOuter = Math.cos(outer), coneScale = spot ? 1 / Math.max(Math.cos(inner) - cosOuter, 0.001) : 0;
  to.set(position, at);
  to[at + 3] = directional ? -1 : range > 0 ? 1 / (range * range) : 0;
  if (directional || spot) to.set(Array.from(direction, (v) => v / length), at + 4);
  to[at + 7] = coneScale;
  to.set(light.intensity, at + 8);
  to[at + 11] = spot ? -cosOuter * coneScale : 1;
}
