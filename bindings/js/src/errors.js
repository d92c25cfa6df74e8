// SPDX-License-Identifier: MIT
// How failures come out, and what becomes of memory that nobody gave back.

// What the library refused, by its own text. status: relume_status.
export class RelumeError extends Error {
  constructor(message, status = 0) {
    super(message);
    this.name = 'RelumeError';
    this.status = status;
  }
}

export const kUsage = 1, kIo = 2, kInvalidFile = 3, kUnsupported = 5, kMemory = 6;

const isObject = (value) => value !== null && typeof value === 'object';
const shown = (value) => {
  if (Array.isArray(value) || ArrayBuffer.isView(value)) return `[${Array.from(value)}]`;
  if (typeof value === 'string') return JSON.stringify(value);
  return isObject(value) ? `of type ${value.constructor?.name ?? 'object'}` : String(value);
};

const refuse = (text) => {
  throw new RelumeError(text, kUsage);
};

// `value`, if it is an array of three. What has no length, as vectors of three.js, would be copied as nothing at all.
export function vector(name, value) {
  if (value?.length !== 3) refuse(`${name} is ${shown(value)}, expected an array of three numbers`);
  return value;
}

// `value`, if it is an index or a count. WebAssembly would read anything else as one: undefined, NaN and 2^32 as 0.
export function whole(name, value, expected = 'a whole number from 0 on') {
  if (!Number.isInteger(value) || value < 0 || value > 0xffffffff) refuse(`${name} is ${shown(value)}, expected ${expected}`);
  return value;
}

// `value`, if it is an object.
export function object(name, value) {
  if (!isObject(value)) refuse(`${name} is ${shown(value)}, expected an object`);
  return value;
}

// `values`, if it is an array of objects.
export function list(name, values) {
  if (!Array.isArray(values)) refuse(`${name} is ${shown(values)}, expected an array`);
  const other = values.findIndex((value) => !isObject(value));
  if (other >= 0) object(`${name}[${other}]`, values[other]);
  return values;
}

const found = (values) => (values?.length === undefined ? `is ${shown(values)}` : `has ${values.length} elements`);

// `values`, if there are `count` numbers.
export function sized(name, values, count) {
  if (values?.length !== count) refuse(`${name} ${found(values)}, expected ${count} numbers`);
  return values;
}

// How many of `width` numbers there are.
export function countOf(name, values, width) {
  if (!(values?.length % width === 0)) refuse(`${name} ${found(values)}, expected ${width} numbers for each`);
  return values.length / width;
}

// Give back what was never disposed of, when nothing refers to it any more. A net, not a plan: engines may never call it.
export const forgotten = typeof FinalizationRegistry === 'function' ? new FinalizationRegistry((give) => give()) : null;
