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

// Give back what was never disposed of, when nothing refers to it any more. A net, not a plan: engines may never call it.
export const forgotten = typeof FinalizationRegistry === 'function' ? new FinalizationRegistry((give) => give()) : null;
