// SPDX-License-Identifier: MIT
export {Bake, hasSimd, loadBake, loadModule, Module, RelumeError, Relighter} from './core.js';
export {MovingShapes} from './moving.js';
export {WorkerRelighter} from './worker_relighter.js';
