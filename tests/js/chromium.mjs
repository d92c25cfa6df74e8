// SPDX-License-Identifier: MIT
// Headless Chromium over its DevTools protocol by pipe: not puppeteer, so that tests need nothing of a package registry.
// Messages are JSON, each ended by a zero byte, to file descriptor 3 and from 4.
import {spawn, spawnSync} from 'node:child_process';
import {existsSync, mkdtempSync, rmSync} from 'node:fs';
import http from 'node:http';
import {readFile} from 'node:fs/promises';
import {tmpdir} from 'node:os';
import path from 'node:path';

// Ends a test as ctest counts one that skips.
export function skip(why) {
  console.log(`skipped: ${why}`);
  process.exit(77);
}

export function needPackage(folder) {
  if (!existsSync(path.join(folder, 'wasm', 'relume-simd.wasm'))) skip(`there is no ${folder}/wasm, which cmake --preset wasm builds (Debian: emscripten)`);
}

// Chromium's program, for a test of the package in a page. long: of the long run.
export function needChromium(folder, {long = false} = {}) {
  if (long && process.env.RELUME_LONG_TESTS !== '1') skip('of the long run (RELUME_LONG_TESTS=1): three comes from the registry of npm');
  needPackage(folder);
  return findChromium() ?? skip('there is no Chromium (Debian: chromium)');
}

function findChromium() {
  return ['chromium', 'chromium-browser', 'google-chrome'].find((name) => spawnSync('sh', ['-c', `command -v ${name}`]).status === 0);
}

const kTypes = {'.html': 'text/html', '.js': 'text/javascript', '.mjs': 'text/javascript', '.wasm': 'application/wasm', '.json': 'application/json',
                '.css': 'text/css', '.glb': 'model/gltf-binary'};

// A server of folders by their prefixes; the longest prefix wins.
export async function serve(folders) {
  const prefixes = Object.keys(folders).sort((a, b) => b.length - a.length);
  const server = http.createServer(async (request, response) => {
    const wanted = decodeURIComponent(new URL(request.url, 'http://localhost').pathname);
    const prefix = prefixes.find((each) => wanted.startsWith(each));
    try {
      if (!prefix || wanted.includes('..')) throw new Error('none');
      const bytes = await readFile(path.join(folders[prefix], wanted.slice(prefix.length)));
      response.writeHead(200, {'content-type': kTypes[path.extname(wanted)] ?? 'application/octet-stream', 'content-length': bytes.length}).end(bytes);
    } catch {
      response.writeHead(404).end('not found');
    }
  }).listen(0, '127.0.0.1');
  await new Promise((done) => server.once('listening', done));
  return {url: `http://127.0.0.1:${server.address().port}`, close() { server.close(); server.closeAllConnections(); }};
}

export class Chromium {
  static async start(program, {width = 800, height = 450} = {}) {
    const profile = mkdtempSync(path.join(tmpdir(), 'relume-chromium-'));
    const child = spawn(program, ['--headless=new', '--no-sandbox', '--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader',
                                  '--ignore-gpu-blocklist', '--disable-dev-shm-usage', '--hide-scrollbars',
                                  `--user-data-dir=${profile}`, '--remote-debugging-pipe', 'about:blank'],
                        {stdio: ['ignore', 'ignore', 'ignore', 'pipe', 'pipe'], detached: true});
    const browser = new Chromium(child, profile);
    const {targetInfos} = await browser.send('Target.getTargets');
    const target = targetInfos.find((each) => each.type === 'page');
    browser.session = (await browser.send('Target.attachToTarget', {targetId: target.targetId, flatten: true})).sessionId;
    await browser.send('Emulation.setDeviceMetricsOverride', {width, height, deviceScaleFactor: 1, mobile: false});
    for (const domain of ['Page', 'Runtime', 'Log']) await browser.send(`${domain}.enable`);
    return browser;
  }
  constructor(child, profile) {
    Object.assign(this, {child, profile, waiting: new Map(), calls: 0, problems: [], said: []});
    let text = '';
    child.stdio[4].setEncoding('utf8').on('data', (part) => {
      text += part;
      for (let end; (end = text.indexOf('\0')) >= 0; text = text.slice(end + 1)) this.receive(JSON.parse(text.slice(0, end)));
    });
    child.on('exit', (code) => {
      for (const {reject} of this.waiting.values()) reject(new Error(`Chromium ended with ${code}`));
    });
  }
  receive({id, result, error, method, params}) {
    if (id) {
      const waits = this.waiting.get(id);
      this.waiting.delete(id);
      return error ? waits.reject(new Error(error.message)) : waits.resolve(result);
    }
    if (method === 'Runtime.consoleAPICalled') {
      const text = params.args.map((arg) => arg.value ?? arg.description).join(' ');
      this.said.push(`${params.type}: ${text}`);
      if (params.type === 'error' || params.type === 'assert') this.problems.push(text);
    }
    if (method === 'Runtime.exceptionThrown') this.problems.push(params.exceptionDetails.exception?.description ?? params.exceptionDetails.text);
    if (method === 'Log.entryAdded') {
      this.said.push(`log ${params.entry.level}: ${params.entry.text} ${params.entry.url ?? ''}`);
      if (params.entry.level === 'error') this.problems.push(`${params.entry.text} ${params.entry.url ?? ''}`);
    }
  }
  send(method, params = {}) {
    const id = ++this.calls;
    this.child.stdio[3].write(JSON.stringify({id, method, params, ...(this.session ? {sessionId: this.session} : {})}) + '\0');
    return new Promise((resolve, reject) => this.waiting.set(id, {resolve, reject}));
  }
  async open(url) {
    await this.send('Page.navigate', {url});
    await this.until(async () => await this.run('document.readyState').catch(() => '') === 'complete', `${url} does not load`);
  }
  // The page says that it is ready (data-ready of its root).
  async ready() {
    await this.until(async () => await this.run('document.documentElement.dataset.ready') === 'yes', 'the page is not ready');
  }
  // Ten minutes: what waits is for what hangs, not for what is slow.
  async until(is, otherwise) {
    for (let i = 0; i < 12000; ++i) {
      if (await is()) return;
      await new Promise((done) => setTimeout(done, 50));
    }
    throw new Error(otherwise);
  }
  // The value of an expression in the page; promises are waited for.
  async run(expression) {
    const {result, exceptionDetails} = await this.send('Runtime.evaluate', {expression, awaitPromise: true, returnByValue: true});
    if (exceptionDetails) throw new Error(exceptionDetails.exception?.description ?? exceptionDetails.text);
    return result.value;
  }
  async screenshot() {
    return Buffer.from((await this.send('Page.captureScreenshot', {format: 'png'})).data, 'base64');
  }
  async close() {
    const ended = new Promise((done) => this.child.once('exit', done));
    await this.send('Browser.close').catch(() => {});
    await Promise.race([ended, new Promise((done) => setTimeout(done, 5000))]);
    try {
      process.kill(-this.child.pid, 'SIGKILL');
    } catch {  // it has ended
    }
    rmSync(this.profile, {recursive: true, force: true, maxRetries: 5, retryDelay: 200});
  }
}
