// SPDX-License-Identifier: MIT
// The relighter in a worker, so that a page's frames wait for nothing: relight() gives a promise of what the frame wants.
import {isNode, RelumeError} from './core.js';

async function makeWorker() {
  const url = new URL('./worker.js', import.meta.url);
  if (!isNode) return new Worker(url, {type: 'module'});
  const threads = 'node:worker_threads';  // in a variable, so that bundlers for pages let it be
  return new (await import(/* @vite-ignore */ threads)).Worker(url);
}

export class WorkerRelighter {
  // source: as loadBake() takes it; a relative URL is one of the page. What create() fails with ends the worker.
  static async create(source, {onProgress, module: moduleOptions, ...options} = {}) {
    if (typeof source === 'string' && !isNode) source = new URL(source, document.baseURI).href;
    if (source instanceof URL) source = source.href;
    const made = new WorkerRelighter(await makeWorker(), onProgress);
    try {
      Object.assign(made, await made.call('create', {source, options, moduleOptions}));
      return made;
    } catch (error) {
      made.dispose();
      throw error;
    }
  }
  constructor(worker, onProgress) {
    this.worker = worker;
    this.waiting = new Map();  // {resolve, reject} by the call's number
    this.calls = 0;
    const handle = ({id, result, error, progress}) => {
      if (progress) return onProgress?.(...progress);
      const waits = this.waiting.get(id);
      this.waiting.delete(id);
      if (error) waits?.reject(new RelumeError(error.message, error.status));
      else waits?.resolve(result);
    };
    const fail = (error) => this.end(`the worker failed: ${error?.message ?? error}`);
    if (isNode) worker.on('message', handle).on('error', fail);
    else worker.onmessage = (event) => handle(event.data), worker.onerror = fail;
  }
  end(text) {
    for (const {reject} of this.waiting.values()) reject(new RelumeError(text));
    this.waiting.clear();
  }
  call(name, message = {}) {
    if (!this.worker) return Promise.reject(new RelumeError('the relighter was disposed of', 1));
    return new Promise((resolve, reject) => {
      const id = ++this.calls;
      this.waiting.set(id, {resolve, reject});
      try {
        this.worker.postMessage({id, call: name, ...message});
      } catch (error) {  // what cannot be sent: a function in the setup
        this.waiting.delete(id);
        reject(new RelumeError(`${name}: ${error.message}`, 1));
      }
    });
  }
  // setup: as Relighter.relight() takes it, but for visibility: a worker cannot call the page. Hand surfelIrradiance over.
  relight(setup = {}, wants = ['textures']) {
    return this.call('relight', {setup, wants});
  }
  reset() {
    return this.call('reset');
  }
  // What the movingParts of later frames name.
  setMovingShapes(meshes) {
    return this.call('setMovingShapes', {meshes});
  }
  dispose() {
    if (!this.worker) return;
    this.worker.terminate();
    this.worker = null;
    this.end('the relighter was disposed of');
  }
}
