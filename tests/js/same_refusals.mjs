// SPDX-License-Identifier: MIT
// Of node_test.mjs: lights that the relighter on the CPU and the one in WebGL must take or refuse alike.
import assert from 'node:assert/strict';

const angles = [0, 0.5, 1, Math.PI, 3.2, -1, NaN, '0.5', true];
const kValues = {
  intensity: [[1e20, 0, 0], [1e21, 0, 0], [-1, 0, 0], [NaN, 0, 0], ['1', 0, 0], [1, 1]],
  position: [[1e9, 0, 0], [1e9 + 1, 0, 0], [0, -2e9, 0], [0, 0, 1e39], [NaN, 0, 0], [null, 0, 0], [0, 0]],
  direction: [[0, -1.005, 0], [0, -1.02, 0], [0, NaN, 0], [0, -1]],
  range: [0, 1e-30, 1e30, 1e39, Infinity, -1, NaN, null, '2', 'x'],
  innerConeAngle: angles,
  outerConeAngle: angles,
};

// Text of a refusal: which field, and what is expected; numbers are written in other ways, and the CPU has names of C++.
function refusal(act, RelumeError) {
  try {
    act();
    return 'accepted';
  } catch (error) {
    assert.ok(error instanceof RelumeError, error);
    const text = error.message.replace('light setup: ', '').replace('positionWorld', 'position').replace(/ConeRad/g, 'ConeAngle').replace(String(1e20), '1e20');
    return text.replace(/ is .*, expected/, ' expected').replace(/(outerConeAngle), [\d.]+$/, '$1');
  }
}

export function checkSameRefusals(relighter, packLight, RelumeError) {
  const refused = {directional: 0, point: 0, spot: 0};
  for (const kind of Object.keys(refused)) {
    for (const [name, value] of Object.entries(kValues).flatMap(([key, values]) => values.map((each) => [key, each]))) {
      const light = {kind, intensity: [1, 1, 1], position: [0, 1, 0], direction: [0, -1, 0], [name]: value}, packed = new Float32Array(12);
      const cpu = refusal(() => relighter.relight({lights: [light]}), RelumeError), gpu = refusal(() => packLight(light, 0, packed), RelumeError);
      assert.equal(gpu, cpu, `${kind}, ${name} ${value}`);
      if (gpu === 'accepted') assert.ok(Number.isFinite(packed[3]), `${kind}, ${name} ${value}: 1 / range² is ${packed[3]}`);
      else ++refused[kind];
    }
  }
  assert.ok(refused.directional > 5 && refused.point > refused.directional && refused.spot > refused.point, JSON.stringify(refused));
}
