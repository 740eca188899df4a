// The web pages of the README: their scripts run as they stand, three.js moves what the daemon plays, and model-viewer
// shows a surface.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { createServer } from 'node:http';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { fileURLToPath } from 'node:url';

import { Daemon, root } from '../node/daemon.mjs';
import { launch, PATIENCE_MS } from './chromium.mjs';

const packages = fileURLToPath(new URL('./node_modules/', import.meta.url));
const readme = readFileSync(join(root, 'README.md'), 'utf8');
const [section] = readme.match(/^## The same from a web page\n.*?(?=^## )/ms);
const [, script] = section.match(/^```js\n(.*?)^```$/ms);
const [, viewer] = section.match(/^```html\n(.*?)^```$/ms);

const imports = { three: '/three/build/three.module.js', 'three/addons/': '/three/examples/jsm/' };
const head = `<!doctype html><link rel="icon" href="data:,"><script type="importmap">${JSON.stringify({ imports })}</script>`;
const setting = `import { PerspectiveCamera, Scene, WebGLRenderer } from 'three';
  const [scene, camera, renderer] = [new Scene(), new PerspectiveCamera(), new WebGLRenderer()];`;

const daemon = new Daemon(['--api-keys', 'sesame', '--url-keys', 'seal']);
let browser, server, page, url;

before(async () => {
  await daemon.start();
  const here = (text) => text.replace('http://127.0.0.1:8080', daemon.url).replace('new Tweend()', "new Tweend(undefined, { key: 'sesame' })");
  const files = {
    '/three.html': ['text/html', `${head}<script type="module" src="/script.js"></script>`],
    '/script.js': ['text/javascript', `${setting}\n${here(script)}\nwindow.played = { scene, player };`],
    '/viewer.html': ['text/html', head + here(viewer)],
    '/tank.json': ['application/json', readFileSync(join(root, 'server/samples/tank.json'))],
    '/octopus.obj': ['text/plain', readFileSync(join(root, 'server/samples/octopus.obj'))],
    '/model-viewer.min.js': ['text/javascript', readFileSync(join(packages, '@google/model-viewer/dist/model-viewer.min.js'))],
  };
  server = createServer((request, response) => {
    const [type, body] = files[request.url] ?? ['text/javascript', readFileSync(packages + request.url)];
    response.setHeader('Content-Type', type);
    response.end(body);
  });
  await new Promise((resolve) => server.listen(0, '127.0.0.1', resolve));
  url = `http://127.0.0.1:${server.address().port}`;
  browser = await launch();
});

after(async () => {
  await browser?.close();
  server?.close();
  await daemon.remove();
});

/** Opens a page and waits until a condition holds in it: without errors, and nothing asked of another host. */
async function open(path, condition) {
  const errors = [];
  page = await browser.newPage();
  page.on('pageerror', (error) => errors.push(String(error)));
  page.on('request', (request) => /^https?:\/\/(?!127\.0\.0\.1:)/.test(request.url()) && errors.push(request.url()));
  await page.goto(url + path);
  await page.waitForFunction(condition, undefined, { timeout: PATIENCE_MS }).catch((error) => errors.push(String(error)));
  assert.deepEqual(errors, []);
}

test('the script for three.js loads the tank and plays its clip', async () => {
  await open('/three.html', () => window.played);
  assert.deepEqual(await page.evaluate(() => played.player.missing), []);
  const before = await page.evaluate(() => played.scene.getObjectByName('hull').quaternion.toArray());
  await page.waitForFunction(
    ([, y]) => Math.abs(played.scene.getObjectByName('hull').quaternion.y - y) > 0.01 && played.player.time > 0,
    before,
    { timeout: PATIENCE_MS },
  );
  const triangles = await page.evaluate(() => {
    let count = 0;
    played.scene.traverse((object) => (count += object.geometry ? object.geometry.index.count / 3 : 0));
    return count;
  });
  assert.ok(triangles > 1000, `${triangles} triangles`);
  await page.close();
});

test('the page for model-viewer shows the octopus, by a signed URL', async () => {
  await open('/viewer.html', () => document.querySelector('model-viewer').loaded);
  const { src, size } = await page.evaluate(() => {
    const shown = document.querySelector('model-viewer');
    return { src: shown.src, size: shown.getDimensions().toString() };
  });
  assert.match(src, /\/surface\.glb\?level=3&exp=\d+&sig=/);
  assert.ok(size.split(' ').every((length) => parseFloat(length) > 0.1), size);
  await page.close();
});
