// The web pages of README and GUIDE, on another origin than the daemon, with keys on: three.js moves what the daemon
// plays, and model-viewer shows a surface.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { createServer } from 'node:http';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { fileURLToPath } from 'node:url';

import { Daemon, root } from '../node/daemon.mjs';
import { launch, PATIENCE_MS } from './chromium.mjs';

const packages = fileURLToPath(new URL('./node_modules/', import.meta.url));
const codeOf = (file, heading) => {
  const [section] = readFileSync(join(root, file), 'utf8').match(new RegExp(`^## ${heading}\\n.*?(?=^## |(?![^]))`, 'ms'));
  return section.match(/^```html\n(.*?)^```$/ms)[1];
};
const example = codeOf('README.md', 'The same from a web page');
const viewer = codeOf('api/GUIDE.md', 'In model-viewer');

const daemon = new Daemon(['--api-keys', 'sesame', '--url-keys', 'seal']);
let browser, server, page, url;

before(async () => {
  await daemon.start();
  const withKey = (text) => text.replace('new Tweend()', "new Tweend(undefined, { key: 'sesame' })");
  const changes = [['./tweend.js', `${daemon.url}/tweend.js`], [/https:\/\/.*?\/three@[^/]*/g, '/three'],
    ['renderer.setAnimationLoop', 'window.played = { scene, player };\nrenderer.setAnimationLoop']];
  const files = {
    '/three.html': ['text/html', changes.reduce((text, [from, to]) => text.replace(from, to), withKey(example))],
    '/viewer.html': ['text/html', `<!doctype html><link rel="icon" href="data:,">${withKey(viewer).replace('http://127.0.0.1:8080', daemon.url)}`],
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

test('the page for three.js is the example that the daemon serves', () =>
  assert.equal(example, readFileSync(join(root, 'server/page/example.html'), 'utf8')));

test('the page for three.js shows a surface and plays its clip', async () => {
  await open('/three.html', () => window.played?.player.time > 0.1);
  const { missing, turned, triangles } = await page.evaluate(() => {
    let triangles = 0;
    played.scene.traverse((object) => (triangles += object.geometry ? object.geometry.index.count / 3 : 0));
    return { missing: played.player.missing, turned: played.scene.getObjectByName('body').quaternion.y, triangles };
  });
  assert.deepEqual(missing, []);
  assert.ok(Math.abs(turned) > 0.01);
  assert.equal(triangles, 6 * 4 ** 3 * 2);
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
