// SPDX-License-Identifier: MIT
// The relighter in a worker, so that a page's frames wait for nothing: relight() gives a promise of what the frame wants.
import {isNode, RelumeError} from './core.js';

// url: of worker.js where it lies elsewhere. In one expression with Worker bundlers know the file for a worker.
async function makeWorker(url) {
  if (isNode) {
    const threads = 'node:worker_threads', here = import.meta.url;  // in variables, so that bundlers for pages let them be
    const {Worker: Thread} = await import(/* webpackIgnore: true */ /* @vite-ignore */ threads);
    return new Thread(url ?? new URL('./worker.js', here));
  }
  return url ? new Worker(url, {type: 'module'}) : new Worker(new URL('./worker.js', import.meta.url), {type: 'module'});
}

export class WorkerRelighter {
  // source: as loadBake() takes it; a relative URL is one of the page. What create() fails with ends the worker.
  static async create(source, {onProgress, headers, credentials, module: moduleOptions, worker, ...options} = {}) {
    if (typeof source === 'string' && !isNode) source = new URL(source, globalThis.document?.baseURI ?? location.href).href;
    if (source instanceof URL) source = source.href;
    if (moduleOptions?.folder) moduleOptions = {...moduleOptions, folder: String(moduleOptions.folder)};  // a URL cannot be sent
    const request = {headers: headers && [...new Headers(headers)], credentials};                         // nor can Headers
    const made = new WorkerRelighter(await makeWorker(worker), onProgress);
    try {
      Object.assign(made, await made.call('create', {source, request, options, moduleOptions}));
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
    // The event of a script that cannot be loaded has no message.
    const fail = ({message}) => this.end(`the worker failed: ${message || 'its script cannot be loaded; docs/guide/web.md says what bundlers need'}`);
    if (isNode) worker.on('message', handle).on('error', fail).on('exit', (code) => this.end(`the worker ended with ${code}`));
    else worker.onmessage = (event) => handle(event.data), worker.onerror = fail;
  }
  // Ends the worker; what waits, and what is called from now on, is rejected with `text`.
  end(text) {
    if (!this.worker) return;
    this.worker.terminate();
    this.worker = null;
    this.ended = text;
    for (const {reject} of this.waiting.values()) reject(new RelumeError(text));
    this.waiting.clear();
  }
  call(name, message = {}) {
    if (!this.worker) return Promise.reject(new RelumeError(this.ended, 1));
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
    this.end('the relighter was disposed of');
  }
}
