// The package: packed as npm publishes it, installed from that file, and used by projects of several kinds under strict TypeScript.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { cpSync, mkdirSync, mkdtempSync, readdirSync, readFileSync, rmSync, symlinkSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { fileURLToPath, pathToFileURL } from 'node:url';
import { gzipSync } from 'node:zlib';

import esbuild from 'esbuild';
import { build } from 'vite';

import { Daemon, root } from '../node/daemon.mjs';

const daemon = new Daemon();
const packages = fileURLToPath(new URL('./node_modules/', import.meta.url));
const source = join(root, 'api/client');
const manifest = JSON.parse(readFileSync(join(source, 'package.json')));
const sample = (name) => readFileSync(join(root, 'server/samples', name), 'utf8');
const folder = mkdtempSync(join(tmpdir(), 'tweend-package-'));
const of = (...names) => join(folder, ...names);
const offline = { ...process.env, npm_config_offline: 'true', npm_config_update_notifier: 'false' };
const npm = (...args) => execFileSync('npm', [...args, '--no-audit', '--no-fund'], { cwd: folder, env: offline, encoding: 'utf8' });
const run = (file, ...args) => import(pathToFileURL(file)).then((module) => module.run(daemon.url, ...args));
const compile = (project) => execFileSync(process.execPath, [join(packages, 'typescript/bin/tsc'), '--project', of(project)], { stdio: 'inherit' });
let packed;

before(async () => {
  await daemon.start();
  cpSync(fileURLToPath(new URL('./consumers', import.meta.url)), folder, { recursive: true });
  [packed] = JSON.parse(npm('pack', source, '--json'));
  npm('install', packed.filename);
  // What the projects have besides; three.js and Babylon.js are the user's own.
  for (const name of ['three', '@types/three', '@babylonjs']) {
    mkdirSync(of('node_modules/@types'), { recursive: true });
    symlinkSync(join(packages, name), of('node_modules', name), 'dir');
  }
});

after(async () => {
  await daemon.remove();
  rmSync(folder, { recursive: true });
});

test('the version is the daemon’s, and the licence the project’s', async () => {
  const { version } = await (await fetch(`${daemon.url}/version`)).json();
  assert.equal(manifest.version, version);
  assert.equal(readFileSync(join(source, 'LICENSE'), 'utf8'), readFileSync(join(root, 'LICENSE'), 'utf8'));
});

test('the package holds what it exports, with types, and little else', () => {
  const files = packed.files.map(({ path }) => path);
  const exported = Object.values(manifest.exports).flatMap((target) => (typeof target === 'string' ? target : Object.values(target)));
  const wanted = [...new Set(exported.map((path) => path.slice(2))), 'LICENSE', 'README.md'];
  assert.deepEqual(files.sort(), wanted.sort());
  assert.ok(packed.size < 50e3, `${packed.size} bytes`);
  assert.equal(manifest.dependencies, undefined);
  assert.ok(Object.keys(manifest.peerDependencies).every((name) => manifest.peerDependenciesMeta[name].optional));
  assert.deepEqual(readdirSync(of('node_modules')).filter((name) => !name.startsWith('.') && !['three', '@types', '@babylonjs'].includes(name)), ['tweend']);
});

test('a program for Node.js', async () => {
  compile('node');
  const tank = sample('tank.json');
  const told = await run(of('node/out/main.js'), tank);
  assert.deepEqual(told, { sent: Buffer.byteLength(tank), rows: 2 * told.stride, stride: told.stride, root: 3, refused: 400 });
});

test('the program of its README', () => {
  const [, program] = readFileSync(join(source, 'README.md'), 'utf8').match(/`octopus\.mjs`:\n\n```js\n([^]*?)```/);
  writeFileSync(of('octopus.mjs'), program.replace('http://127.0.0.1:8080', daemon.url));
  cpSync(join(root, 'server/samples/octopus.obj'), of('octopus.obj'));
  execFileSync(process.execPath, ['octopus.mjs'], { cwd: folder, stdio: 'inherit' });
  assert.equal(readFileSync(of('octopus.glb')).toString('latin1', 0, 4), 'glTF');
});

/** A bundle of esbuild, without a warning. */
async function bundle(entry, options) {
  const { errors, warnings, outputFiles } = await esbuild.build({
    entryPoints: [of(entry)], bundle: true, minify: true, format: 'esm', target: 'es2022', write: false, logLevel: 'silent', absWorkingDir: folder, ...options,
  });
  assert.deepEqual([...errors, ...warnings], []);
  return outputFiles[0].text;
}

test('programs for bundlers compile in strict mode', () => compile('.'));

test('three.js, by a bundle of esbuild', async () => {
  writeFileSync(of('three.mjs'), await bundle('esbuild/three.ts', { platform: 'node' }));
  globalThis.self = globalThis; // the loader looks for a browser's names
  globalThis.ProgressEvent ??= class extends Event {};
  const { told, ...rest } = await run(of('three.mjs'), sample('cube.obj'));
  assert.deepEqual(rest, { faces: [192, 192, 192], missing: 'TweendError', broken: 'TweendError', left: 'AbortError', faulty: 0 });
  assert.deepEqual(told, ['all', 'all', 'failed', 'all', 'failed', 'all']);
});

/** As much of a browser's as Babylon.js asks of it. */
class Request extends EventTarget {
  readyState = 0;
  open(method, url) {
    this.responseURL = url;
  }
  async send() {
    const answer = await fetch(this.responseURL);
    Object.assign(this, { readyState: 4, status: answer.status, response: await answer.arrayBuffer() });
    for (const name of ['readystatechange', 'loadend']) this.dispatchEvent(new Event(name));
  }
  setRequestHeader() {}
  getResponseHeader() {}
  abort() {}
}

test('Babylon.js, by a bundle of esbuild', async () => {
  globalThis.XMLHttpRequest = Request;
  writeFileSync(of('babylon.mjs'), await bundle('esbuild/babylon.ts', { platform: 'node' }));
  const told = await run(of('babylon.mjs'), sample('tank.json'));
  assert.deepEqual(told, { faces: told.faces, groups: ['drive', 'aim'], same: true, unmoved: [], appended: true, missing: true, faulty: 0 });
  assert.ok(told.faces > 100);
  delete globalThis.XMLHttpRequest;
});

test('a page by Vite, and what renders it on a server', async () => {
  const warnings = [];
  const customLogger = { info() {}, warn: (text) => warnings.push(text), warnOnce: (text) => warnings.push(text), error: (text) => warnings.push(text), clearScreen() {}, hasErrorLogged: () => false, hasWarned: false };
  const options = { root: of('vite'), configFile: false, customLogger };
  await build({ ...options, build: { target: 'es2022', chunkSizeWarningLimit: 2000 } });
  await build({ ...options, ssr: { noExternal: ['tweend'] }, build: { ssr: 'server.ts', outDir: 'server', target: 'es2022' } });
  assert.deepEqual(warnings, []);
  const [script] = readdirSync(of('vite/dist/assets'));
  assert.match(readFileSync(of('vite/dist/assets', script), 'utf8'), /customElements\.define/);
  const { id, element, guessed } = await run(of('vite/server/server.js'));
  assert.match(id, /^[0-9a-f]{32}$/);
  assert.ok(element);
  assert.match(guessed, /^TypeError: .*give the daemon's URL/);
});

test('a program for Deno, with the package and with the module that the daemon serves', () => {
  const deno = join(packages, 'deno/bin.cjs');
  const env = { ...process.env, DENO_DIR: of('deno-cache'), DENO_NO_UPDATE_CHECK: '1', NO_COLOR: '1' };
  const args = ['run', '--quiet', '--check', '--allow-net', '--allow-import', 'main.ts', daemon.url, `${daemon.url}/tweend.js`];
  const said = execFileSync(process.execPath, [deno, ...args], { cwd: of('deno'), env, encoding: 'utf8' });
  const { sent, bytes, ...rest } = JSON.parse(said);
  assert.equal(sent.at(-1), bytes);
  assert.deepEqual(rest, { points: 78, faces: 24, faulty: 0 });
});

test('what is not used is not bundled', async () => {
  const sizes = {};
  for (const [name, text] of Object.entries({
    nothing: "import { Tweend } from 'tweend'; import { TweendLoader } from 'tweend/three'; import { tweendPlugin } from 'tweend/babylon'; import { TweendViewer } from 'tweend/viewer';",
    error: "import { TweendError } from 'tweend'; console.log(TweendError);",
    client: "import { Tweend } from 'tweend'; import { TweendLoader } from 'tweend/three'; console.log(Tweend);",
  })) {
    writeFileSync(of(`${name}.js`), text);
    const text1 = await bundle(`${name}.js`);
    sizes[name] = gzipSync(text1).length;
    assert.doesNotMatch(text1, /WebGL|GLTFLoader|customElements/, name);
    if (name === 'nothing') assert.equal(text1, '');
  }
  console.log(sizes);
  assert.ok(sizes.error < 1000 && sizes.client < 8000, JSON.stringify(sizes));
});
