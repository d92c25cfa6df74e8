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

const shown = (value) => {
  if (Array.isArray(value) || ArrayBuffer.isView(value)) return `[${Array.from(value)}]`;
  return value !== null && typeof value === 'object' ? `of type ${value.constructor?.name ?? 'object'}` : String(value);
};

// `value`, if it is an array of three. What has no length, as vectors of three.js, would be copied as nothing at all.
export function vector(name, value) {
  if (value?.length !== 3) throw new RelumeError(`${name} is ${shown(value)}, expected an array of three numbers`, kUsage);
  return value;
}

// `values`, if it is an array.
export function list(name, values) {
  if (!Array.isArray(values)) throw new RelumeError(`${name} is ${shown(values)}, expected an array`, kUsage);
  return values;
}

// How many of `width` numbers there are.
export function countOf(name, values, width) {
  if (!(values?.length % width === 0)) {
    const found = values?.length === undefined ? `is ${shown(values)}` : `has ${values.length} elements`;
    throw new RelumeError(`${name} ${found}, expected ${width} numbers for each`, kUsage);
  }
  return values.length / width;
}

// Give back what was never disposed of, when nothing refers to it any more. A net, not a plan: engines may never call it.
export const forgotten = typeof FinalizationRegistry === 'function' ? new FinalizationRegistry((give) => give()) : null;
