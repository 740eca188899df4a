// The page at /, as a person uses it.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { mkdtempSync, readFileSync, rmSync } from 'node:fs';
import { createServer, request as ask } from 'node:http';
import { createRequire } from 'node:module';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, test } from 'node:test';

import { Daemon, root } from '../node/daemon.mjs';
import { covered, difference, launch, PHONE, TABLET, Visit } from './page_driver.mjs';

const axe = createRequire(import.meta.url).resolve('axe-core/axe.min.js');
const daemon = new Daemon(['--sample']);
let browser, models;

before(async () => {
  await daemon.start();
  browser = await launch();
  const listed = await (await fetch(`${daemon.url}/v1/models`)).json();
  models = Object.fromEntries(listed.models.map(({ name, id }) => [name, id]));
});

after(async () => {
  await browser?.close();
  await daemon.remove();
});

/** A test that visits the page; options as for Visit.begin. */
const visits = (name, options, use) =>
  test(name, async () => {
    const visit = await Visit.begin(browser, `${daemon.url}/`, options);
    try {
      await use(visit);
    } catch (error) {
      await visit.picture(`failed ${name}`).catch(() => {});
      throw error;
    }
    await visit.end();
  });

/** Drops files on the page, as a hand would: {name: text or bytes}. */
const drop = (visit, files) =>
  visit.page.evaluate((given) => {
    const dataTransfer = new DataTransfer();
    for (const [name, text] of Object.entries(given)) dataTransfer.items.add(new File([text], name));
    for (const type of ['dragenter', 'dragover', 'drop'])
      document.body.dispatchEvent(new DragEvent(type, { dataTransfer, bubbles: true, cancelable: true }));
  }, files);

const PYRAMID = 'v -1 0 -1\nv 1 0 -1\nv 1 0 1\nv -1 0 1\nv 0 1.5 0\nf 1 2 3 4\nf 2 1 5\nf 3 2 5\nf 4 3 5\nf 1 4 5\n';

test('its bytes are few, its tag is strong, its policy allows no inline code', async () => {
  const answer = await fetch(`${daemon.url}/`, { headers: { 'Accept-Encoding': 'gzip' } });
  const policy = answer.headers.get('Content-Security-Policy');
  assert.match(answer.headers.get('ETag'), /^"/);
  assert.doesNotMatch(policy, /unsafe-inline|unsafe-eval(?<!wasm-unsafe-eval)|https?:/);
  const size = Number(answer.headers.get('Content-Length'));
  console.log(`# the page has ${size} bytes`);
  assert.ok(size < 250000, `${size} bytes`);
  const html = await answer.text();
  assert.doesNotMatch(html.replace(/<script[^]*?<\/script>/g, ''), /(?:href|src)=["']?(?:https?:)?\/\//);
});

visits('the tank is there, its cage over it', {}, async (visit) => {
  await visit.level(2);
  const first = Date.now() - visit.started;
  console.log(`# the first picture is there after ${first} ms`);
  assert.ok(first < 15000, `${first} ms`);
  await visit.picture('desktop light');
  for (const name of ['cage', 'points']) await visit.shows(name, false);
  const plain = await visit.pixels();
  assert.ok(covered(plain) > 0.1 && covered(plain) < 0.8, `${covered(plain)} of the picture is covered`);
  await visit.shows('cage', true);
  const caged = await visit.pixels();
  assert.ok(difference(plain, caged) > 0.005, 'the cage is seen');
  await visit.shows('points', true);
  assert.ok(difference(caged, await visit.pixels()) > 0.0005, 'extraordinary points are seen');
  assert.match(await visit.text('#legend'), /valence under 4[^]*crease 3/);
  assert.match(await visit.text('#facts'), /^Level 2 · 3,530 points · 3,520 faces · 136 kB · [\d.]+ ms$/);
});

visits('creases of a glTF are found, and stay on its edges', { hash: '#show=cage&tab=surface' }, async (visit) => {
  await visit.level(2);
  // The sample cube as glTF, its node turned and moved; then the same under a joint that bends it.
  const cube = await (await fetch(`${daemon.url}/v1/models/${models['cube.obj']}/surface.gltf?level=0&polygons=ngon&normals=none`)).json();
  cube.nodes[0] = { ...cube.nodes[0], translation: [1, 2, 3], rotation: [0, 0.6, 0, 0.8] };
  const open = async (name, document) => {
    await drop(visit, { [name]: JSON.stringify(document) });
    await visit.wait((wanted) => document.getElementById('subject').textContent === wanted, name);
    await visit.wait(() => document.getElementById('facts').textContent.startsWith('Level 2'));
    await visit.tab('Surface');
    for (;;) {
      await visit.drawn();
      const pixels = await visit.pixels();
      if (covered(pixels) > 0.002) return pixels; // its cage is there
    }
  };
  const isPurple = (pixels, i) => pixels[i] > pixels[i + 1] + 40 && pixels[i + 2] > pixels[i + 1] + 10;
  const purple = (pixels) => {
    let count = 0;
    for (let i = 0; i < pixels.length; i += 4) if (isPurple(pixels, i)) count++;
    return count;
  };
  const smooth = await open('cube.gltf', cube);
  assert.equal(purple(smooth), 0);
  await visit.page.getByLabel('Creases').selectOption('auto');
  await visit.wait(() => document.getElementById('legend').textContent.includes('crease, infinite'));
  await visit.drawn();
  const creased = await visit.pixels();
  assert.ok(purple(creased) > 500, `${purple(creased)} pixels of creases`);
  await visit.picture('creases');
  // All edges of the cube are creases: these reach as far as the cage.
  const { width } = await visit.page.locator('#stage').boundingBox();
  const reach = (pixels, is) => {
    const found = { left: Infinity, right: 0, top: Infinity, bottom: 0 };
    for (let i = 0; i < pixels.length; i += 4) {
      if (!is(pixels, i)) continue;
      const [x, y] = [(i / 4) % width, Math.floor(i / 4 / width)];
      found.left = Math.min(found.left, x);
      found.right = Math.max(found.right, x);
      found.top = Math.min(found.top, y);
      found.bottom = Math.max(found.bottom, y);
    }
    return found;
  };
  const cage = reach(smooth, (pixels, i) => pixels[i] < 120);
  const found = reach(creased, isPurple);
  for (const side of Object.keys(cage)) assert.ok(Math.abs(cage[side] - found[side]) < 5, `${side}: ${cage[side]} of the cage, ${found[side]} of creases`);
  await visit.page.getByLabel('Creases').selectOption('none');
  await visit.wait(() => document.getElementById('legend').hidden || !document.getElementById('legend').textContent.includes('crease'));
  await visit.page.getByLabel('Creases').selectOption('auto');
  // Joints: one that holds all points, moved up.
  const places = Buffer.from(cube.buffers[0].uri.split(',')[1], 'base64');
  const count = cube.accessors[cube.meshes[0].primitives[0].attributes.POSITION].count;
  const skin = Buffer.concat([Buffer.alloc(4 * count), Buffer.from(new Float32Array(Array.from({ length: 4 * count }, (_, i) => (i % 4 ? 0 : 1))).buffer)]);
  const start = places.length;
  cube.buffers[0] = { byteLength: start + skin.length, uri: `data:application/octet-stream;base64,${Buffer.concat([places, skin]).toString('base64')}` };
  cube.bufferViews.push({ buffer: 0, byteOffset: start, byteLength: 4 * count }, { buffer: 0, byteOffset: start + 4 * count, byteLength: 16 * count });
  cube.accessors.push({ bufferView: cube.bufferViews.length - 2, componentType: 5121, count, type: 'VEC4' }, { bufferView: cube.bufferViews.length - 1, componentType: 5126, count, type: 'VEC4' });
  Object.assign(cube.meshes[0].primitives[0].attributes, { JOINTS_0: cube.accessors.length - 2, WEIGHTS_0: cube.accessors.length - 1 });
  cube.nodes = [{ mesh: 0, skin: 0, translation: [1, 2, 3] }, { name: 'joint', translation: [0, 5, 0], scale: [1, 2, 1] }];
  cube.skins = [{ joints: [1] }];
  cube.scenes = [{ nodes: [0, 1] }];
  cube.extensionsRequired = cube.extensionsUsed = undefined;
  await open('skin.gltf', cube);
  await visit.wait(() => document.getElementById('legend').textContent.includes('crease, infinite'));
  await visit.drawn();
  const skinned = await visit.pixels();
  await visit.picture('creases of a skin');
  assert.ok(purple(skinned) > 150, `${purple(skinned)} pixels of creases`);
});

visits('each overlay changes the picture, and goes again', {}, async (visit) => {
  await visit.level(2);
  const usual = await visit.pixels();
  for (const name of ['wireframe', 'normals', 'skeleton']) {
    await visit.shows(name, true);
    assert.ok(difference(usual, await visit.pixels()) > 0.001, name);
    await visit.shows(name, false);
    assert.ok(difference(usual, await visit.pixels()) < 0.0005, `${name} is gone`);
  }
});

visits('a checker lies along the UVs', { hash: '#show=surface' }, async (visit) => {
  await visit.level(2);
  await drop(visit, { 'square.obj': 'v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n' });
  await visit.wait(() => document.getElementById('subject').textContent === 'square.obj');
  await visit.level(2);
  const plain = await visit.pixels();
  await visit.shows('uv', true);
  assert.ok(difference(plain, await visit.pixels()) > 0.05);
});

visits('a dropped OBJ is shown, and its level moves', {}, async (visit) => {
  await visit.level(2);
  await drop(visit, { 'pyramid.obj': PYRAMID });
  await visit.wait(() => document.getElementById('subject').textContent === 'pyramid.obj');
  await visit.wait(() => document.getElementById('facts').textContent.includes(' 64 faces'));
  await visit.drawn();
  const seen = covered(await visit.pixels());
  assert.ok(seen > 0.02 && seen < 0.8, `${seen} of the picture is covered`);
  assert.equal(await visit.text('.model[aria-current] .name'), 'pyramid.obj');
  await visit.tab('Surface');
  await visit.page.getByRole('slider', { name: 'Level' }).focus();
  await visit.page.keyboard.press('ArrowRight');
  await visit.level(3);
  assert.match(await visit.text('#facts'), /^Level 3 · 258 points · 256 faces/);
  assert.match(await visit.text('tr[aria-current]'), /^3\s+258\s+256\s+[\d.]+ kB\s+[\d.]+ ms$/);
  assert.match(visit.page.url(), /level=3/);
  await visit.page.getByLabel('Encoding').selectOption('meshopt');
  await visit.wait(() => /^Level 3 .* kB/.test(document.getElementById('facts').textContent) && location.hash.includes('meshopt'));
  await visit.page.getByLabel('Scheme').selectOption('bilinear');
  await visit.wait(() => location.hash.includes('bilinear') && !document.querySelector('.busy:not([hidden])'));
});

visits('files are chosen, a glTF with what it names', {}, async (visit) => {
  await visit.level(2);
  const bin = Buffer.from(new Float32Array([0, 0, 0, 1, 0, 0, 0, 1, 0]).buffer);
  const gltf = {
    asset: { version: '2.0' }, scenes: [{ nodes: [0] }], nodes: [{ mesh: 0 }], buffers: [{ uri: 'a.bin', byteLength: 36 }],
    meshes: [{ primitives: [{ attributes: { POSITION: 0 } }] }], bufferViews: [{ buffer: 0, byteLength: 36 }],
    accessors: [{ bufferView: 0, componentType: 5126, count: 3, type: 'VEC3', min: [0, 0, 0], max: [1, 1, 0] }],
  };
  await visit.page.getByLabel('Files to upload').setInputFiles([
    { name: 'a.bin', mimeType: 'application/octet-stream', buffer: bin },
    { name: 'a.gltf', mimeType: 'model/gltf+json', buffer: Buffer.from(JSON.stringify(gltf)) },
  ]);
  await visit.wait(() => document.getElementById('subject').textContent === 'a.gltf');
  await visit.wait(() => document.getElementById('facts').textContent.startsWith('Level 2'));
});

visits('a long upload tells how far it is, and can be cancelled', {}, async (visit) => {
  await visit.level(2);
  const network = await visit.page.context().newCDPSession(visit.page);
  await network.send('Network.enable');
  await network.send('Network.emulateNetworkConditions', { offline: false, latency: 0, downloadThroughput: -1, uploadThroughput: 400000 });
  await drop(visit, { 'long.obj': PYRAMID + '# nothing\n'.repeat(300000) });
  await visit.wait(() => document.querySelector('.upload progress')?.value > 0.05);
  const bar = visit.page.getByRole('progressbar');
  assert.ok((await bar.evaluate(({ value }) => value)) < 1);
  assert.match(await visit.text('.upload'), /long\.obj[^]* of 3\.0 MB/);
  await visit.picture('upload');
  await visit.page.locator('.upload').getByRole('button', { name: 'Cancel' }).click();
  await bar.waitFor({ state: 'detached' });
  assert.equal(await visit.page.locator('.problem').count(), 0);
});

test('a browser without WebGL is told so', async () => {
  const plain = await launch(['--disable-gpu', '--disable-software-rasterizer', '--disable-3d-apis']);
  try {
    const page = await plain.newPage();
    await page.goto(`${daemon.url}/`);
    await page.getByText('This browser has no WebGL 2').waitFor();
  } finally {
    await plain.close();
  }
});

visits('a refused file is explained at its place', { refused: [422] }, async (visit) => {
  await visit.level(2);
  await drop(visit, { 'bad.obj': 'v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 9\n' });
  const problem = visit.page.locator('.problem');
  await problem.waitFor();
  const text = await problem.innerText();
  assert.match(text, /bad\.obj was refused[^]*422[^]*index 9 is out of range: the file has 3 points/);
  assert.match(await visit.text('.problem .here'), /4\s*f 1 2 9/);
  await visit.picture('error');
  await problem.getByRole('button', { name: 'Close' }).click();
  await drop(visit, { 'bad.json': '{"meshes": [{"positions": [[0, 0, 0]], "faces": [[0, 1, 2]]}]}' });
  await visit.page.getByText('/meshes/0/faces/0/1').first().waitFor();
  await visit.page.getByLabel('Scheme').waitFor({ state: 'attached' });
  await visit.tab('Surface');
  await visit.page.getByLabel('Scheme').selectOption('loop');
  await visit.page.locator('.notice', { hasText: 'triangles' }).waitFor();
  await visit.picture('notice');
});

visits('the clip is scrubbed and played, and goes on live', { hash: `#show=surface` }, async (visit) => {
  await visit.level(2);
  const still = await visit.pixels();
  assert.equal(await visit.page.locator('#shown [data-name=follow]').getAttribute('aria-pressed'), 'false');
  await visit.seek(2.6);
  assert.ok(difference(still, await visit.pixels()) > 0.01, 'the pose changed');
  assert.equal(await visit.time(), 2.6);
  await visit.wait(() => location.hash.includes('t=2.6'));
  assert.ok((await visit.page.locator('.ticks line').count()) > 5, 'keys are drawn');
  await visit.page.getByRole('button', { name: 'Play' }).click();
  await visit.wait(() => Math.abs(parseFloat(document.querySelector('.clock').textContent) - 2.6) > 0.3);
  await visit.page.getByRole('button', { name: 'Pause' }).click();
  const paused = await visit.time();
  await visit.drawn();
  assert.equal(await visit.time(), paused);
  await visit.page.getByRole('button', { name: 'Live' }).click();
  await visit.wait((from) => Math.abs(parseFloat(document.querySelector('.clock').textContent) - from) > 0.3, paused);
  // Changes while a stream is asked for leave one stream, and none when it is left.
  await visit.page.getByLabel('Speed').evaluate((select) => {
    for (select.value of ['2', '4', '1']) select.dispatchEvent(new Event('change'));
  });
  const now = await visit.time();
  await visit.wait((from) => Math.abs(parseFloat(document.querySelector('.clock').textContent) - from) > 0.6, now);
  await visit.page.getByRole('button', { name: 'Live' }).click();
  await visit.wait((at) => parseFloat(document.querySelector('.clock').textContent) === at, paused);
  const listeners = async () => (await (await fetch(`${daemon.url}/metrics`)).text()).match(/^tweend_live_listeners (\d+)$/m)[1];
  for (let waited = 0; waited < 100 && (await listeners()) !== '0'; waited++) await visit.page.waitForTimeout(100);
  assert.equal(await listeners(), '0');
  await visit.page.getByLabel('Clip').selectOption('aim');
  await visit.wait(() => location.hash.includes('clip=aim'));
});

visits('a clip moves morph targets as well as nodes', { hash: '#show=surface' }, async (visit) => {
  await visit.level(2);
  // A square whose one target draws a corner out, and whose node turns.
  const floats = [0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, /* target */ 0, 0, 0, 0, 0, 0, 2, 2, 0, 0, 0, 0, /* times */ 0, 1, /* weights */ 0, 1,
    /* turns */ 0, 0, 0, 1, 0, 0, 0.5, 0.8660254];
  const buffer = Buffer.concat([Buffer.from(new Float32Array(floats).buffer), Buffer.from(new Uint16Array([0, 1, 2, 0, 2, 3]).buffer)]);
  const view = (byteOffset, byteLength) => ({ buffer: 0, byteOffset, byteLength });
  const floatsAt = (bufferView, count, type, more) => ({ bufferView, componentType: 5126, count, type, ...more });
  const document = {
    asset: { version: '2.0' }, scenes: [{ nodes: [0] }], nodes: [{ mesh: 0, name: 'sheet' }],
    buffers: [{ byteLength: buffer.length, uri: `data:application/octet-stream;base64,${buffer.toString('base64')}` }],
    bufferViews: [view(0, 48), view(48, 48), view(96, 8), view(104, 8), view(112, 32), view(144, 12)],
    accessors: [floatsAt(0, 4, 'VEC3', { min: [0, 0, 0], max: [1, 1, 0] }), floatsAt(1, 4, 'VEC3', { min: [0, 0, 0], max: [2, 2, 0] }),
      floatsAt(2, 2, 'SCALAR', { min: [0], max: [1] }), floatsAt(3, 2, 'SCALAR'), floatsAt(4, 2, 'VEC4'), { bufferView: 5, componentType: 5123, count: 6, type: 'SCALAR' }],
    meshes: [{ weights: [0], primitives: [{ attributes: { POSITION: 0 }, targets: [{ POSITION: 1 }], indices: 5 }] }],
    animations: [{ name: 'lift', samplers: [{ input: 2, output: 3 }], channels: [{ sampler: 0, target: { node: 0, path: 'weights' } }] },
      { name: 'turn', samplers: [{ input: 2, output: 4 }], channels: [{ sampler: 0, target: { node: 0, path: 'rotation' } }] }],
  };
  await drop(visit, { 'sheet.gltf': JSON.stringify(document) });
  await visit.wait(() => document.getElementById('subject').textContent === 'sheet.gltf');
  await visit.wait(() => document.getElementById('facts').textContent.startsWith('Level 2'));
  await visit.drawn();
  for (const clip of ['lift', 'turn']) {
    await visit.page.getByLabel('Clip').selectOption(clip);
    await visit.wait(() => document.querySelector('.clock').textContent === '0.00 / 1.00 s');
    await visit.drawn();
    const still = await visit.pixels();
    await visit.seek(1);
    assert.ok(difference(still, await visit.pixels()) > 0.02, clip);
  }
});

visits('a clip that stops at its end stays there', { hash: '#loop=clamp&speed=4&t=3.5' }, async (visit) => {
  await visit.level(2);
  await visit.page.getByRole('button', { name: 'Play' }).click();
  await visit.wait(() => document.querySelector('.clock').textContent.startsWith('4.00'));
  await visit.page.getByRole('button', { name: 'Play' }).waitFor();
});

visits('gimbal lock appears, and the best order takes it away', { hash: '#tab=animation', colorScheme: 'dark' }, async (visit) => {
  await visit.level(2);
  const locked = () => visit.page.locator('.band [data-locked=true]').count();
  await visit.page.getByLabel('Node').selectOption('antenna_euler');
  await visit.wait(() => document.querySelectorAll('.band [data-locked=true]').length > 3);
  assert.match(await visit.text('.verdict'), /XYZ locks: least 0\.000 at 0\.9/);
  await visit.seek(0.9412);
  assert.ok(Number(await visit.text('h3 .value')) < 0.05);
  await visit.picture('rotation dark');
  await visit.page.getByRole('button', { name: /^Use XZY/ }).click();
  await visit.wait(() => document.querySelector('.verdict')?.textContent.startsWith('XZY stays clear'));
  assert.equal(await locked(), 0);
  await visit.seek(2.5);
  const asked = 'pose.json?clip=drive&at=2.5&nodes=antenna_euler&as=euler&order=XZY&unit=degrees';
  const { poses } = await (await fetch(`${daemon.url}/v1/models/${models['tank.json']}/${asked}`)).json();
  const said = await visit.page.locator('.chart + .keys').nth(1).locator('output').allInnerTexts();
  poses[0].euler[0].forEach((angle, k) => assert.ok(Math.abs(angle - Number(said[k])) < 1, `${said} for ${poses[0].euler}`));
  await visit.page.getByLabel('Euler order').selectOption('XYZ');
  await visit.wait(() => document.querySelectorAll('.band [data-locked=true]').length > 3);
  const without = await visit.pixels();
  await visit.page.getByRole('combobox', { name: 'Shown' }).selectOption('both');
  await visit.drawn();
  assert.ok(difference(without, await visit.pixels()) > 0.0005, 'ghosts are seen');
});

visits('its URL brings back what it shows', { hash: '#tab=surface&level=1&encoding=quantized&show=cage&theme=dark' }, async (visit) => {
  await visit.level(1);
  assert.equal(await visit.page.getByLabel('Encoding').inputValue(), 'quantized');
  assert.equal(await visit.page.locator('#shown [data-name=surface]').getAttribute('aria-pressed'), 'false');
  assert.equal(await visit.page.locator('html').getAttribute('data-theme'), 'dark');
  const here = visit.page.url();
  await visit.page.evaluate(() => (location.hash = 'level=3'));
  await visit.level(3);
  await visit.page.goto(here);
  await visit.level(1);
  await visit.wait(() => !document.getElementById('legend').hidden);
  await visit.drawn();
  const still = await visit.pixels();
  const box = await visit.page.locator('#view').boundingBox();
  await visit.page.mouse.move(box.x + 300, box.y + 300);
  await visit.page.mouse.down();
  await visit.page.mouse.move(box.x + 420, box.y + 340, { steps: 4 });
  await visit.page.mouse.up();
  await visit.page.mouse.wheel(0, -200);
  await visit.wait(() => location.hash.includes('view='));
  await visit.drawn();
  const turned = await visit.pixels();
  const moved = difference(still, turned);
  const other = await Visit.begin(browser, visit.page.url());
  await other.level(1);
  await other.wait(() => !document.getElementById('legend').hidden);
  await other.drawn();
  const apart = difference(turned, await other.pixels()); // the view is rounded, lines are thin
  assert.ok(apart < moved / 3, `another visitor sees ${apart} otherwise, the turn changed ${moved}`);
  await other.end();
});

visits('scripts give the bytes that are shown', { hash: '#tab=scripts&level=1&limit=true' }, async (visit) => {
  await visit.level(1);
  const surface = visit.page.locator('section', { hasText: 'This surface' });
  const [curl, script] = await surface.locator('pre').allInnerTexts();
  const folder = mkdtempSync(join(tmpdir(), 'tweend-curl-'));
  try {
    execFileSync('bash', ['-c', `${curl} --silent`], { cwd: folder });
    const [, file] = curl.match(/-o (\S+)/);
    const bytes = readFileSync(join(folder, file));
    assert.equal(bytes.subarray(0, 4).toString(), 'glTF');
    const other = await visit.page.context().newPage(); // of no origin, as any page may be
    await other.goto(`${daemon.url}/version`);
    const base64 = await other.evaluate(async (line) => {
      const bytes = await new (async () => {}).constructor(`${line} return bytes;`)();
      return btoa(String.fromCharCode(...new Uint8Array(bytes)));
    }, script);
    assert.ok(bytes.equals(Buffer.from(base64, 'base64')));
    await other.close();
    const saved = visit.page.waitForEvent('download');
    await visit.page.getByRole('link', { name: 'glb float' }).click();
    assert.ok(bytes.equals(readFileSync(await (await saved).path())));
  } finally {
    rmSync(folder, { recursive: true });
  }
  await visit.picture('scripts');
  await visit.seek(1.5);
  assert.match(await visit.text('section:has(h3:text-is("This pose")) pre'), /at=1\.5/);
});

/** What a click downloads; clicked again where the list was drawn anew under the pointer. */
async function downloaded(page, link, tries = 3) {
  const saved = page.waitForEvent('download', { timeout: 10000 }).catch(() => null);
  await link.click();
  return (await saved) ?? (assert.ok(tries > 1, 'nothing is downloaded'), downloaded(page, link, tries - 1));
}

visits('each form and encoding can be downloaded', { hash: '#tab=scripts&level=1' }, async (visit) => {
  await visit.level(1);
  const links = visit.page.locator('.downloads a');
  const named = ['glb float', 'glb quantized', 'glb meshopt', 'glb ngon', 'gltf float', 'obj', 'source', 'pose json', 'pose ndjson', 'pose bin', 'pose csv'];
  assert.deepEqual(await links.allInnerTexts(), named);
  const found = {};
  for (const name of named) {
    const link = visit.page.getByRole('link', { name, exact: true });
    found[name] = readFileSync(await (await downloaded(visit.page, link)).path());
    const wanted = Buffer.from(await (await fetch(await link.evaluate(({ href }) => href))).arrayBuffer());
    assert.ok(found[name].equals(wanted), name);
  }
  const json = (name) => JSON.parse(found[name].subarray(20, 20 + found[name].readUInt32LE(12)));
  assert.equal(json('glb float').extensionsUsed, undefined);
  assert.deepEqual(json('glb quantized').extensionsRequired, ['KHR_mesh_quantization']);
  assert.ok(json('glb meshopt').extensionsRequired.includes('EXT_meshopt_compression'));
  assert.ok(json('glb ngon').extensionsUsed.includes('FB_ngon_encoding'));
});

test('with a key, a signed URL is what is downloaded', async () => {
  const locked = new Daemon(['--sample', '--api-keys', 's3cret', '--url-keys', 'another']);
  await locked.start();
  try {
    const visit = await Visit.begin(browser, `${locked.url}/`, { hash: '#level=1&tab=scripts', refused: [401] });
    await visit.page.getByRole('dialog').getByLabel('Key').fill('s3cret');
    await visit.page.keyboard.press('Enter');
    await visit.level(1);
    const saved = visit.page.waitForEvent('download');
    await visit.page.getByRole('link', { name: 'glb ngon' }).click();
    const answer = await saved;
    assert.match(answer.url(), /^http.*polygons=ngon.*exp=\d+&sig=/);
    assert.equal(readFileSync(await answer.path()).subarray(0, 4).toString(), 'glTF');
    await visit.end();
  } finally {
    await locked.remove();
  }
});

visits('a long download is announced and can be declined', { hash: '#tab=surface' }, async (visit) => {
  await visit.level(2);
  await visit.page.getByRole('button', { name: 'Show level 7' }).click();
  const dialog = visit.page.getByRole('dialog');
  await dialog.waitFor();
  assert.match(await dialog.innerText(), /173 MB to load/);
  await visit.picture('large');
  await dialog.getByRole('button', { name: 'Cancel' }).click();
  await dialog.waitFor({ state: 'detached' });
  await visit.wait(() => location.hash.includes('tab=surface') && !location.hash.includes('level'));
  assert.match(await visit.text('#facts'), /^Level 2/);
  assert.equal(await visit.page.getByRole('slider', { name: 'Level' }).inputValue(), '2');
});

visits('what is surely small is loaded while its counts are asked for', { hash: '#tab=surface' }, async (visit) => {
  await visit.level(2);
  let release;
  const held = new Promise((resolve) => (release = resolve));
  await visit.page.route('**/surface.json?level=1', (route) => held.then(() => route.continue()));
  const loaded = visit.page.waitForResponse((response) => response.url().endsWith('surface.glb?level=1'));
  await visit.page.getByRole('button', { name: 'Show level 1' }).click();
  await loaded;
  assert.match(await visit.text('#facts'), /^Level 2/);
  release();
  await visit.level(1);
});

visits('work can be cancelled', { hash: '#tab=surface' }, async (visit) => {
  await visit.level(2);
  let release;
  await visit.page.route('**/surface.glb?level=5', (route) => new Promise((resolve) => (release = resolve)).then(() => route.abort()));
  await visit.page.getByRole('button', { name: 'Show level 5' }).click();
  await visit.page.locator('#busy').waitFor();
  await visit.picture('busy');
  await visit.page.locator('#cancel').click();
  await visit.page.locator('#busy').waitFor({ state: 'hidden' });
  release();
  assert.match(await visit.text('#facts'), /^Level 2/);
  assert.equal(await visit.page.getByRole('slider', { name: 'Level' }).inputValue(), '2');
});

visits('on a phone', { ...PHONE }, async (visit) => {
  await visit.level(2);
  const overflow = () => visit.page.evaluate(() => document.scrollingElement.scrollWidth - innerWidth);
  for (const name of ['Models', 'Surface', 'Rotation', 'Scripts']) {
    await visit.page.getByRole('tab', { name }).tap();
    await visit.drawn();
    assert.ok((await overflow()) <= 0, `${name} is ${await overflow()} too wide`);
    await visit.picture(`phone ${name}`);
  }
  assert.ok(covered(await visit.pixels()) > 0.1);
  await visit.page.getByRole('button', { name: 'Play' }).tap();
  await visit.wait(() => parseFloat(document.querySelector('.clock').textContent) > 0.2);
});

visits('by keyboard alone', {}, async (visit) => {
  await visit.level(2);
  const { keyboard } = visit.page;
  const focused = () => visit.page.evaluate(() => document.activeElement.getAttribute('aria-label') ?? document.activeElement.textContent);
  const reach = async (wanted) => {
    for (let i = 0; i < 60 && !(await focused()).startsWith(wanted); i++) await keyboard.press('Tab');
    assert.ok((await focused()).startsWith(wanted), `Tab reaches ${wanted}`);
  };
  await reach('tank.json, level 2');
  const before = await visit.pixels();
  await keyboard.press('ArrowLeft');
  await keyboard.press('ArrowLeft');
  await visit.drawn();
  const turned = await visit.pixels();
  assert.ok(difference(before, turned) > 0.01, 'arrows orbit');
  await keyboard.press('-');
  await keyboard.press('-');
  await visit.drawn();
  assert.ok(covered(await visit.pixels()) < covered(turned), 'minus zooms out');
  await keyboard.press('f');
  await visit.drawn();
  assert.ok(Math.abs(covered(await visit.pixels()) - covered(turned)) < 0.02, 'F frames');
  await keyboard.press(' ');
  await visit.wait(() => parseFloat(document.querySelector('.clock').textContent) > 0.1);
  await keyboard.press(' ');
  await reach('Models');
  await keyboard.press('ArrowRight');
  assert.equal(await focused(), 'Surface');
  await reach('Level');
  await keyboard.press('ArrowLeft');
  await visit.level(1);
});

for (const [name, options] of [['light', {}], ['dark', TABLET]])
  visits(`axe finds nothing to mend, ${name}`, options, async (visit) => {
    await visit.level(2);
    await visit.page.evaluate(readFileSync(axe, 'utf8'));
    for (const tab of ['Models', 'Surface', 'Rotation', 'Scripts']) {
      await visit.tab(tab);
      await visit.page.waitForTimeout(500);
      const { violations } = await visit.page.evaluate(() => axe.run());
      const said = violations.map(({ id, nodes }) => `${id}: ${nodes.map(({ target, failureSummary }) => `${target} ${failureSummary}`).join('; ')}`);
      assert.deepEqual(said, [], tab);
      await visit.picture(`${tab} ${name}`);
    }
  });

test('a key is asked for and kept for the tab', async () => {
  const locked = new Daemon(['--sample', '--api-keys', 's3cret']);
  await locked.start();
  try {
    const visit = await Visit.begin(browser, `${locked.url}/`, { refused: [401, 403, 404] }); // it signs nothing
    const dialog = visit.page.getByRole('dialog');
    await dialog.waitFor();
    await visit.picture('key');
    await dialog.getByLabel('Key').fill('wrong');
    await dialog.getByRole('button', { name: 'Use key' }).click();
    await visit.page.getByText('The daemon says').waitFor();
    await dialog.getByLabel('Key').fill('s3cret');
    await visit.page.keyboard.press('Enter');
    await visit.level(2);
    await visit.page.reload();
    await visit.level(2);
    assert.equal(await dialog.count(), 0);
    await visit.tab('Scripts');
    assert.match(await visit.text('.code pre'), /^curl -H "Authorization: Bearer \$KEY"/);
    const saved = visit.page.waitForEvent('download');
    await visit.page.getByRole('link', { name: 'source' }).click();
    assert.ok(readFileSync(await (await saved).path()).equals(readFileSync(join(root, 'server/samples/tank.json'))));
    await visit.page.getByRole('button', { name: 'Live' }).click();
    await visit.wait(() => parseFloat(document.querySelector('.clock').textContent) > 0.2);
    await visit.end();
    const other = await Visit.begin(browser, `${locked.url}/`, { refused: [401] });
    await other.page.getByRole('dialog').waitFor();
    await other.end();
  } finally {
    await locked.remove();
  }
});

test('it works behind a prefix', async () => {
  const proxy = createServer((request, response) => {
    if (!request.url.startsWith('/3d/tweend/')) return response.writeHead(404).end();
    const { hostname, port } = new URL(daemon.url);
    const through = ask({ hostname, port, path: request.url.slice('/3d/tweend'.length), method: request.method, headers: request.headers },
      (answer) => answer.pipe(response.writeHead(answer.statusCode, answer.headers)));
    request.pipe(through);
  });
  await new Promise((resolve) => proxy.listen(0, '127.0.0.1', resolve));
  try {
    const visit = await Visit.begin(browser, `http://127.0.0.1:${proxy.address().port}/3d/tweend/`);
    await visit.level(2);
    await drop(visit, { 'pyramid.obj': PYRAMID });
    await visit.wait(() => document.getElementById('facts').textContent.includes(' 64 faces'));
    await visit.end();
  } finally {
    proxy.close();
    proxy.closeAllConnections();
  }
});

test('an empty daemon says what to do', async () => {
  const empty = new Daemon();
  await empty.start();
  try {
    const visit = await Visit.begin(browser, `${empty.url}/`);
    await visit.page.getByText('No model yet').waitFor();
    await visit.picture('empty');
    await visit.end();
  } finally {
    await empty.remove();
  }
});
