// SPDX-License-Identifier: MIT
// The host's lights and colours, checked, as the passes read them.
import {RelumeError} from './core.js';
import {sized, vector} from './errors.js';

const kUsage = 1;

export const refuse = (text) => { throw new RelumeError(text, kUsage); };
// Bounds and texts are those of runtime/check_setup.cpp; numbers are checked in single precision, as passes read them.
const {fround} = Math;
const kMaxLight = fround(1e20), kMaxCoordinate = 1e9;  // kMaxIntensity [W/sr, W/m²] and kMaxCoordinate [m] of formats/limits.h
const isLight = (v) => v >= 0 && v <= kMaxLight;
const shown = (v) => `(${Array.from(v).join(', ')})`;

// `value`, if it is three channels of light, or a factor on them.
export function color(name, value) {
  const channels = Float32Array.from(vector(name, value));
  if (!channels.every(isLight)) refuse(`${name} is ${shown(value)}, expected 0 to 1e20 in each channel`);
  return channels;
}

// `count` colours in rows of `row` texels, where there are any: {texels, width, height}, else null.
export function packColors(name, values, count, row) {
  if (values === undefined || values === null) return null;
  sized(name, values, 3 * count);
  const height = Math.ceil(count / row), texels = new Float32Array(4 * row * height);
  for (let i = 0; i < count; ++i) {
    for (let k = 0; k < 3; ++k) {
      const value = texels[4 * i + k] = values[3 * i + k];
      if (!isLight(value)) color(`${name}[${i}]`, Array.from({length: 3}, (_, c) => values[3 * i + c]));
    }
  }
  return {texels, width: row, height};
}

// RelumeLight of shaders/shared/layout.h, twelve floats, as runtime/passes/pack_lights.cpp packs it.
export function packLight(light, i, to) {
  if (!['directional', 'point', 'spot'].includes(light.kind)) {
    refuse(`lights[${i}].kind is ${JSON.stringify(light.kind)}, expected "directional", "point" or "spot"`);
  }
  const intensity = color(`lights[${i}].intensity`, light.intensity);
  const directional = light.kind === 'directional', spot = light.kind === 'spot', at = 12 * i;
  const position = Float32Array.from(vector(`lights[${i}].position`, light.position ?? [0, 0, 0]));
  const direction = Float32Array.from(vector(`lights[${i}].direction`, light.direction ?? [0, 0, -1])), length = Math.hypot(...direction);
  const range = light.range ?? 0, inner = light.innerConeAngle ?? 0, outer = light.outerConeAngle ?? Math.PI / 4;
  // Fields that a kind of light does not have may hold anything.
  if ((directional || spot) && !(Math.abs(length - 1) <= 0.01)) {
    refuse(`lights[${i}].direction is ${shown(light.direction)} of length ${length}, expected 1, at most 1 % more or less: normalise it`);
  }
  if (!directional) {
    if (!position.every((v) => Math.abs(v) <= kMaxCoordinate)) refuse(`lights[${i}].position is ${shown(light.position)}, expected coordinates within ${kMaxCoordinate} m`);
    if (!(fround(range) >= 0 && fround(range) < Infinity)) refuse(`lights[${i}].range is ${range}, expected a length in metres, or 0 for no limit`);
  }
  if (spot) {
    if (!(fround(outer) >= 0 && fround(outer) <= fround(Math.PI))) refuse(`lights[${i}].outerConeAngle is ${outer}, expected 0 to pi`);
    if (!(fround(inner) >= 0 && fround(inner) <= fround(outer))) refuse(`lights[${i}].innerConeAngle is ${inner}, expected 0 to outerConeAngle, ${outer}`);
  }
  const cosOuter = Math.cos(outer), coneScale = spot ? 1 / Math.max(Math.cos(inner) - cosOuter, 0.001) : 0;
  to.set(position, at);
  // As runtime/light_window.h has it: finite for every range.
  to[at + 3] = directional ? -1 : range > 0 ? 1 / Math.max(Math.min(range, 1e18) ** 2, 1e-30) : 0;
  if (directional || spot) to.set(direction.map((v) => v / length), at + 4);
  to[at + 7] = coneScale;
  to.set(intensity, at + 8);
  to[at + 11] = spot ? -cosOuter * coneScale : 1;
}
