// The web page of the README: its script runs as it stands, and three.js moves what the daemon plays.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { createServer } from 'node:http';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { fileURLToPath } from 'node:url';

import { chromium } from 'playwright-core';

import { Daemon, root } from '../node/daemon.mjs';

const three = fileURLToPath(new URL('./node_modules/three', import.meta.url));
const readme = readFileSync(join(root, 'README.md'), 'utf8');
const [, script] = readme.match(/^## The same from a web page\n\n```js\n(.*?)^```$/ms);

const imports = { three: '/three/build/three.module.js', 'three/addons/': '/three/examples/jsm/' };
const html = `<!doctype html><link rel="icon" href="data:,"><script type="importmap">${JSON.stringify({ imports })}</script>
<script type="module" src="/script.js"></script>`;

const daemon = new Daemon();
let browser, server, page;

before(async () => {
  await daemon.start();
  const files = {
    '/': ['text/html', html],
    '/script.js': ['text/javascript', script.replace('http://127.0.0.1:8080', daemon.url) + '\nwindow.played = { scene, objects };'],
    '/tank.json': ['application/json', readFileSync(join(root, 'server/samples/tank.json'))],
  };
  server = createServer((request, response) => {
    const [type, body] = files[request.url] ?? ['text/javascript', readFileSync(three + request.url.replace('/three', ''))];
    response.setHeader('Content-Type', type);
    response.end(body);
  });
  await new Promise((resolve) => server.listen(0, '127.0.0.1', resolve));
  browser = await chromium.launch({
    executablePath: process.env.CHROMIUM ?? '/usr/bin/chromium',
    args: ['--no-sandbox'],
  });
  page = await browser.newPage();
});

after(async () => {
  await browser?.close();
  server?.close();
  await daemon.remove();
});

test('its script loads the tank and plays its clip', async () => {
  const errors = [];
  page.on('pageerror', (error) => errors.push(String(error)));
  await page.goto(`http://127.0.0.1:${server.address().port}/`);
  await page.waitForFunction(() => window.played, undefined, { timeout: 20000 }).catch(() => {});
  assert.deepEqual(errors, []);
  const turned = () => page.evaluate(() => played.objects.map((object) => object.quaternion.toArray()));
  const before = await turned();
  await page.waitForFunction(
    (earlier) => played.objects.some((object, i) => Math.abs(object.quaternion.w - earlier[i][3]) > 0.01),
    before,
    { timeout: 20000 },
  );
  const triangles = await page.evaluate(() => {
    let count = 0;
    played.scene.traverse((object) => (count += object.geometry ? object.geometry.index.count / 3 : 0));
    return count;
  });
  assert.ok(triangles > 1000, `${triangles} triangles`);
});
