// The custom element, as the daemon serves it, on a page of another origin with a policy that allows the daemon alone.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { createServer } from 'node:http';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { gzipSync } from 'node:zlib';

import { Daemon, root } from '../node/daemon.mjs';
import { launch, PATIENCE_MS } from './chromium.mjs';

const daemon = new Daemon();
let browser, server, page, tank;
const errors = [];

const html = () => `<!doctype html><link rel="icon" href="data:,"><title>viewers</title>
<style>tweend-viewer { width: 320px; height: 240px }</style>
<script type="module" src="${daemon.url}/viewer.js"></script>`;

before(async () => {
  await daemon.start();
  tank = (await daemon.upload(readFileSync(join(root, 'server/samples/tank.json')))).split('/').at(-1);
  server = createServer(({ url }, response) => {
    const isFile = url === '/cube.obj';
    const policy = `default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src ${daemon.url}; connect-src 'self' ${daemon.url}`;
    response.setHeader('Content-Type', isFile ? 'text/plain' : 'text/html');
    response.setHeader('Content-Security-Policy', policy);
    response.end(isFile ? readFileSync(join(root, 'server/samples/cube.obj')) : html());
  });
  await new Promise((resolve) => server.listen(0, '127.0.0.1', resolve));
  browser = await launch();
  page = await browser.newPage();
  page.setDefaultTimeout(PATIENCE_MS);
  page.on('pageerror', (error) => errors.push(String(error)));
  page.on('console', (message) => ['error', 'warning'].includes(message.type()) && !/GPU stall|404|422/.test(message.text()) && errors.push(message.text()));
  await page.goto(`http://127.0.0.1:${server.address().port}`);
  await page.evaluate(() => {
    /** Adds a viewer, or changes one, and waits until it has loaded or failed. */
    window.show = async (attributes, viewer = document.createElement('tweend-viewer')) => {
      const told = new Promise((resolve) => ['load', 'error'].forEach((name) => viewer.addEventListener(name, resolve, { once: true })));
      for (const [name, value] of Object.entries(attributes)) value === null ? viewer.removeAttribute(name) : viewer.setAttribute(name, value);
      if (!viewer.isConnected) document.body.append(viewer);
      return { viewer, event: await told };
    };
    /** The pixels; to be called in the task that drew them. */
    window.pixels = (viewer) => {
      const context = new OffscreenCanvas(80, 60).getContext('2d');
      context.drawImage(viewer.shadowRoot.querySelector('canvas'), 0, 0, 80, 60);
      return [...context.getImageData(0, 0, 80, 60).data];
    };
  });
});

after(async () => {
  await browser?.close();
  server?.close();
  await daemon.remove();
});

/** How many pixels are covered, and how light these are, 0 to 255. */
function covered(pixels) {
  let [count, light] = [0, 0];
  for (let i = 0; i < pixels.length; i += 4) if (pixels[i + 3] > 128) [count, light] = [count + 1, light + pixels[i]];
  return { count, light: light / count };
}

test('the script is served small, to pages of all origins', async () => {
  const answer = await fetch(`${daemon.url}/viewer.js`, { headers: { Origin: 'https://far.example', 'Accept-Encoding': 'gzip' } });
  assert.equal(answer.headers.get('Access-Control-Allow-Origin'), '*');
  const size = gzipSync(Buffer.from(await answer.arrayBuffer())).length;
  console.log(`${size} bytes compressed`);
  assert.ok(size < 220e3, `${size} bytes`);
});

test('a file is shown whole, in the middle, and lit though it is a metal; keys turn it', async () => {
  const { type, before, turned, near, bytes } = await page.evaluate(async () => {
    const { viewer, event } = await show({ src: 'cube.obj', level: 1, alt: 'A cube' });
    const press = (key) => viewer.dispatchEvent(new KeyboardEvent('keydown', { key, cancelable: true })) || pixels(viewer);
    window.cube = viewer;
    return { type: event.type, before: pixels(viewer), turned: press('ArrowLeft'), near: press('+'), bytes: viewer.gltf.scene.children.length };
  });
  assert.equal(type, 'load');
  assert.equal(bytes, 1);
  const first = covered(before);
  assert.ok(first.count > 80 * 60 * 0.15 && first.count < 80 * 60 * 0.8, `${first.count} pixels`);
  assert.ok(first.light > 60, `${first.light}`);
  const rim = [...Array(80).keys()].flatMap((x) => [before[4 * x + 3], before[4 * (59 * 80 + x) + 3]]);
  assert.ok(rim.every((alpha) => alpha === 0), 'the model is cut off');
  assert.notDeepEqual(turned, before);
  assert.ok(covered(near).count > covered(turned).count);
  assert.deepEqual(await page.evaluate(() => [cube.role, cube.ariaLabel, cube.tabIndex]), ['img', 'A cube', 0]);
  assert.deepEqual((await (await fetch(`${daemon.url}/v1/models`)).json()).models.map(({ id }) => id), [tank], 'the file is not stored');
});

test('a stored model plays its clip, and stands without it', async () => {
  const names = await page.evaluate(async (tank) => {
    const { viewer } = await show({ model: tank, level: 0, clip: 'drive', options: 'creases=none' });
    window.tank = viewer;
    return viewer.gltf.animations.map(({ name }) => name);
  }, tank);
  assert.deepEqual(names, ['drive']);
  const place = () => page.evaluate(() => window.tank.gltf.scene.getObjectByName('hull').position.toArray());
  const start = await place();
  await page.waitForFunction((start) => window.tank.gltf.scene.getObjectByName('hull').position.z !== start[2], start);
  await page.evaluate(() => show({ clip: null }, window.tank));
  const rest = await place();
  await page.waitForTimeout(200);
  assert.deepEqual(await place(), rest);
});

test('what cannot be shown is said, and the next is shown all the same', async () => {
  const said = await page.evaluate(async () => {
    const { viewer, event } = await show({ model: null, src: 'cube.obj', options: 'level=99' }, window.cube);
    const words = viewer.shadowRoot.querySelector('p').textContent;
    const nowhere = await show({ model: 'nothing', options: '' }, viewer);
    const again = await show({ model: null }, viewer);
    return { nowhere: nowhere.event.error.status,  type: event.type, status: event.error.status, words, again: again.event.type, after: viewer.shadowRoot.querySelector('p').textContent };
  });
  assert.deepEqual({ ...said, words: '' }, { nowhere: 404, type: 'error', status: 422, words: '', again: 'load', after: '' });
  assert.match(said.words, /level/);
});

test('viewers that leave the page free what they drew with', async () => {
  const found = await page.evaluate(async () => {
    window.tank.remove();
    const context = window.cube.shadowRoot.querySelector('canvas').getContext('webgl2');
    const before = context.isContextLost();
    const loaded = new Promise((resolve) => window.cube.addEventListener('load', resolve, { once: true }));
    document.body.append(window.cube); // as a framework moves it
    await loaded;
    return { before, after: context.isContextLost(), canvases: window.cube.shadowRoot.querySelectorAll('canvas').length };
  });
  assert.deepEqual(found, { before: false, after: true, canvases: 1 }); // browsers keep 16 contexts
  assert.deepEqual(errors, []);
});
