// The page at /: uploads, long work, downloads, keys, and the lines for scripts.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { copyFileSync, mkdirSync, mkdtempSync, readdirSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { createServer, request as ask } from 'node:http';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { test } from 'node:test';

import { biped } from '../node/biped.mjs';
import { Daemon, root } from '../node/daemon.mjs';
import { mocap } from '../node/mocap.mjs';
import { slowWayTo, writeLarge } from './large_file.mjs';
import { covered, difference, drop, open, PHONE, PYRAMID, UNDRAWN, Visit } from './page_driver.mjs';

const site = open();
const { daemon, visits } = site;

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
  assert.match(await visit.address(), /level=3/);
  await visit.page.getByLabel('Encoding').selectOption('meshopt');
  await visit.wait(() => /^Level 3 .* kB/.test(document.getElementById('facts').textContent) && location.hash.includes('meshopt'));
  await visit.page.getByLabel('Scheme').selectOption('bilinear');
  await visit.wait(() => location.hash.includes('bilinear') && !document.querySelector('.busy:not([hidden])'));
});

visits('files are chosen, a glTF with what it names', UNDRAWN, async (visit) => {
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

visits('a kit is dropped as a folder: each model comes with the textures that it names', UNDRAWN, async (visit) => {
  await visit.level(2);
  const folder = join(daemon.folder, 'kit');
  const cases = join(root, 'tests/node/cases');
  mkdirSync(join(folder, 'Textures'), { recursive: true });
  copyFileSync(join(cases, 'swatch.png'), join(folder, 'Textures/swatch.png'));
  const leaf = readFileSync(join(cases, 'outside-texture.glb'), 'latin1');
  for (const name of ['leaf', 'twig']) writeFileSync(join(folder, `${name}.glb`), leaf.replace('"leaf"', `"${name}"`), 'latin1');
  const devtools = await visit.page.context().newCDPSession(visit.page);
  for (const type of ['dragEnter', 'dragOver', 'drop'])
    await devtools.send('Input.dispatchDragEvent', { type, x: 300, y: 300, data: { items: [], files: [folder], dragOperationsMask: 1 } });
  for (const name of ['leaf.glb', 'twig.glb']) await visit.page.locator('.model', { hasText: name }).waitFor();
  assert.equal(await visit.page.locator('.problem').count(), 0);
  await visit.wait(() => document.getElementById('facts').textContent && /^(leaf|twig)/.test(document.getElementById('subject').textContent));
  await visit.tab('Surface');
  assert.match(await visit.page.locator('.outliner').textContent(), /textured/);

  const decoded = [];
  visit.page.on('request', (request) => request.url().startsWith('blob:') && decoded.push(request.url()));
  await visit.tab('Models');
  await visit.page.locator('.model:not([aria-current])', { hasText: /(leaf|twig)\.glb/ }).click();
  await visit.tab('Edit');
  await visit.wait(() => 'pickable' in document.querySelector('canvas').dataset);
  await visit.level(2);
  assert.equal(decoded.length, 1, 'the texture is decoded for the surface, not for the cage too');
});

visits('a daemon that is busy is told of, and a file that it puts off is sent again by a click', { ...UNDRAWN, refused: [503] }, async (visit) => {
  await visit.level(2);
  const { page } = visit;
  let left = 1;
  const busy = { status: 503, contentType: 'application/problem+json', body: JSON.stringify({ status: 503, title: 'Service unavailable', detail: 'too many requests are waiting' }) };
  await page.route('**/v1/models?name=*', (route) => (left-- > 0 ? route.fulfill({ ...busy, headers: { 'Retry-After': left > 0 ? '40' : '2' } }) : route.fallback()));
  await drop(visit, { 'late.obj': `${PYRAMID}# late` });
  await page.locator('.upload', { hasText: 'too many requests are waiting, sent again in 2 s' }).waitFor();
  await page.locator('.upload').getByRole('button', { name: 'Cancel' }).click();
  await page.locator('.upload').waitFor({ state: 'detached' });
  left = 2; // the first says that it takes longer than a page waits
  await drop(visit, { 'late.obj': `${PYRAMID}# late` });
  assert.match(await visit.text('.problem'), /late\.obj could not be sent[^]*503[^]*Try again in 40 s/);
  left = 0;
  await page.getByRole('button', { name: 'Send again' }).click();
  await visit.wait(() => document.getElementById('subject').textContent === 'late.obj');
  assert.equal(await page.locator('.problem').count(), 0);
});

test('a file of 200 MB tells how far it is, and leaves nothing when it is cancelled, while it is sent or read', async () => {
  const file = join(daemon.folder, 'large.obj');
  const way = await slowWayTo(daemon, 100e6);
  const stored = () => readdirSync(join(daemon.folder, 'data'), { recursive: true }).sort();
  try {
    const size = writeLarge(file);
    const visit = await Visit.begin(site.browser, `${way.url}/`);
    const { page } = visit;
    const row = page.locator('.upload');
    await visit.level(2);
    const [before, picture] = [stored(), await visit.pixels()];
    for (const isSent of [false, true]) {
      await page.getByLabel('Files to upload').setInputFiles(file);
      for (const part of isSent ? [1] : [0.1, 0.2, 0.3]) await visit.wait((least) => document.querySelector('.upload progress')?.value >= least, part);
      await row.getByText(isSent ? 'reading' : new RegExp(`^\\d+ MB of ${Math.round(size / 1e6)} MB$`)).waitFor();
      if (!isSent) await visit.picture('upload');
      await row.getByRole('button', { name: 'Cancel' }).click();
      await row.waitFor({ state: 'detached' });
      assert.equal(await page.locator('.problem, .notice').count(), 0);
      assert.equal(await visit.text('#subject'), 'tank.json');
      assert.ok(difference(picture, await visit.pixels()) < 0.002, 'the picture stays');
      const isBusy = async () => !/^tweend_http_requests_in_flight 1$/m.test(await (await fetch(`${daemon.url}/metrics`)).text());
      for (let waited = 0; waited < 300 && (await isBusy()); waited++) await page.waitForTimeout(100);
      assert.deepEqual(stored(), before);
    }
    await visit.end();
  } finally {
    way.close();
    rmSync(file, { force: true });
  }
});

visits('a refused file is explained at its place', { ...UNDRAWN, refused: [422] }, async (visit) => {
  await visit.level(2);
  await drop(visit, { 'bad.obj': 'v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 9\n' });
  const problem = visit.page.locator('.problem');
  await problem.waitFor();
  const text = await problem.innerText();
  assert.match(text, /bad\.obj was refused[^]*422[^]*index 9 is out of range: the file has 3 points/);
  assert.match(await visit.text('.problem .here'), /4\s*f 1 2 9/);
  await visit.picture('error');
  await drop(visit, { 'bad.json': '{"meshes": [{"positions": [[0, 0, 0]], "faces": [[0, 1, 2]]}]}' });
  await visit.page.getByText('/meshes/0/faces/0/1').first().waitFor();
  assert.equal(await problem.count(), 1, 'what was said of the first has gone');
  await problem.getByRole('button', { name: 'Close' }).click();
  await visit.page.getByLabel('Scheme').waitFor({ state: 'attached' });
  await visit.tab('Surface');
  await visit.page.getByLabel('Scheme').selectOption('loop');
  await visit.page.locator('.notice', { hasText: 'triangles' }).waitFor();
  await visit.picture('notice');
});

visits('a hidden panel stays so for a file that opens, and is shown for one that is refused', { ...UNDRAWN, refused: [422], isAlone: true, hash: '#panel=0' }, async (visit) => {
  const { page } = visit;
  await visit.level(2);
  await drop(visit, { 'fit.obj': `# fit\n${PYRAMID}` });
  await visit.wait(() => document.getElementById('subject').textContent === 'fit.obj');
  assert.ok(await page.getByRole('tab', { name: 'Models' }).isHidden());
  await drop(visit, { 'bad.obj': 'v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n' });
  await page.getByText('bad.obj was refused').waitFor();
});

visits('a long download is announced and can be declined', { ...UNDRAWN, hash: '#tab=surface' }, async (visit) => {
  await visit.level(2);
  await visit.page.getByRole('button', { name: 'Show level 7' }).click();
  const dialog = visit.page.getByRole('dialog');
  await dialog.waitFor();
  assert.match(await dialog.innerText(), /173 MB to load/);
  await visit.picture('large');
  await dialog.getByRole('button', { name: 'Cancel' }).click();
  await dialog.waitFor({ state: 'detached' });
  await visit.wait(() => /level=2(&|$)/.test(location.hash));
  assert.match(await visit.text('#facts'), /^Level 2/);
  assert.equal(await visit.page.getByRole('slider', { name: 'Level' }).inputValue(), '2');
});

visits('what is surely small is loaded while its counts are asked for', { ...UNDRAWN, hash: '#tab=surface' }, async (visit) => {
  await visit.level(2);
  await visit.page.getByRole('button', { name: 'Show level 1', exact: true }).waitFor(); // the table has asked for its counts by then
  const release = await visit.hold('**/surface.json?level=1');
  const loaded = visit.page.waitForResponse((response) => response.url().endsWith('surface.glb?level=1'));
  await visit.page.getByRole('button', { name: 'Show level 1', exact: true }).click();
  await loaded;
  assert.match(await visit.text('#facts'), /^Level 2/);
  release();
  await visit.level(1);
});

visits('work can be cancelled', { ...UNDRAWN, hash: '#tab=surface' }, async (visit) => {
  await visit.level(2);
  const release = await visit.hold('**/surface.glb?level=5', (route) => route.abort());
  await visit.page.getByRole('button', { name: 'Show level 5' }).click();
  await visit.page.locator('#busy').waitFor();
  await visit.picture('busy');
  await visit.page.locator('#cancel').click();
  await visit.page.locator('#busy').waitFor({ state: 'hidden' });
  release();
  assert.match(await visit.text('#facts'), /^Level 2/);
  assert.equal(await visit.page.getByRole('slider', { name: 'Level' }).inputValue(), '2');
});

visits('of two that work at once, the older is shown again when the newer ends', { ...UNDRAWN, hash: '#tab=surface', refused: [404] }, async (visit) => {
  const { page } = visit;
  await visit.level(2);
  const id = await visit.model();
  const releaseLevel = await visit.hold('**/surface.glb?level=5', (route) => route.abort());
  const releaseOriginal = await visit.hold(`**/v1/models/${id}`, (route) => route.fulfill({ status: 404, body: '{}' }));
  const shows = (text) => page.locator('#busy', { hasText: text }).waitFor();
  await page.getByRole('button', { name: 'Show level 5' }).click();
  await shows('Level 5');
  await page.evaluate((of) => (location.hash += `&beside=${of}`), id);
  await shows('The original');
  releaseOriginal();
  await shows('Level 5');
  await page.locator('#cancel').click();
  await page.locator('#busy').waitFor({ state: 'hidden' });
  releaseLevel();
  assert.match(await visit.text('#facts'), /^Level 2/);
});

/** A page without a policy of its own for scripts, as other sites have them. */
async function otherPage(visit) {
  const page = await visit.page.context().newPage();
  await page.goto(`${daemon.url}/version`);
  return page;
}

const REQUESTS = ['This surface', 'Its counts', 'This pose', 'The clip at 60 a second', 'The live stream'];

/** The code of a request, by its title, in a language. */
async function codeIn({ page }, language, title) {
  await page.getByRole('button', { name: language, exact: true }).click();
  return page.getByLabel(title, { exact: true }).innerText();
}

visits('scripts give the bytes that are shown', { ...UNDRAWN, hash: '#tab=scripts&level=1&limit=true' }, async (visit) => {
  await visit.level(1);
  const curl = await codeIn(visit, 'curl', 'This surface');
  const script = await codeIn(visit, 'JavaScript', 'This surface');
  const python = await codeIn(visit, 'Python', 'This surface');
  const folder = mkdtempSync(join(tmpdir(), 'tweend-curl-'));
  try {
    execFileSync('bash', ['-c', `${curl} --silent`], { cwd: folder });
    const [, file] = curl.match(/-o (\S+)/);
    const bytes = readFileSync(join(folder, file));
    assert.equal(bytes.subarray(0, 4).toString(), 'glTF');
    for (const [command, name, code] of [[process.execPath, 'script.mjs', script], ['python3', 'script.py', python]]) {
      rmSync(join(folder, file));
      writeFileSync(join(folder, name), code);
      execFileSync(command, [name], { cwd: folder });
      assert.ok(bytes.equals(readFileSync(join(folder, file))), name);
    }
    const other = await otherPage(visit);
    const base64 = await other.evaluate(async (code) => {
      const bytes = await new (async () => {}).constructor(`${code}\nreturn bytes;`)();
      return btoa(String.fromCharCode(...bytes));
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
  assert.match(await codeIn(visit, 'Python', 'This pose'), /at=1\.5/);
});

visits('the scripts of every request run, on a page and by Node.js and Python, and are short', { ...UNDRAWN, hash: '#tab=scripts&level=1&t=1.5' }, async (visit) => {
  await visit.level(1);
  await visit.page.locator('pre', { hasText: 'at=1.5' }).waitFor(); // the clip's come with it
  const codes = async (language) => {
    const all = [];
    for (const title of REQUESTS) all.push(await codeIn(visit, language, title));
    return all;
  };
  const [pythons, scripts] = [await codes('Python'), await codes('JavaScript')];
  const onPage = await visit.text('pre[aria-label="The live stream, on a page"]');
  assert.ok([...scripts, ...pythons, onPage].every((code) => code.split('\n').length < 12));
  const other = await otherPage(visit);
  const found = await other.evaluate(async ([texts, onPage]) => {
    const hull = { quaternion: [], position: [], scale: [] };
    const run = (code, name) => new (async () => {}).constructor('gltf', `${code}\nreturn ${name};`)({ scene: { hull } });
    const names = ['bytes', 'found', 'found', 'bytes'];
    const [glb, counts, pose, poses, player] = await Promise.all([...names.map((name, i) => run(texts[i], name)), run(onPage, 'player')]);
    player.close();
    return { size: glb.byteLength, bytes: counts.bytes, at: pose.times, poses: poses.byteLength > 1000, turned: hull.quaternion.length };
  }, [scripts, onPage]);
  assert.deepEqual({ ...found, size: 0 }, { size: 0, bytes: found.size, at: [1.5], poses: true, turned: 4 });
  const printed = (command, args, code) => JSON.parse(execFileSync(command, args, { input: code, encoding: 'utf8' }));
  assert.deepEqual(printed('python3', ['-'], pythons[2]).times, [1.5]);
  const json = scripts[2].replace('console.log(found)', 'console.log(JSON.stringify(found))');
  assert.deepEqual(printed(process.execPath, ['--input-type=module'], json), printed('python3', ['-'], pythons[2]));
  const events = (command, args, code) => execFileSync(command, args, { input: code.replace('loop=repeat', 'loop=clamp').replace('&speed=1', '&speed=20'), encoding: 'utf8' });
  assert.match(events('python3', ['-'], pythons[4]), /^data: \{"t":.*^event: end/ms);
  assert.match(events(process.execPath, ['--input-type=module'], scripts[4]), /^data: \{"t":.*^event: end/ms);
});

/** What a click downloads; clicked again where the list was drawn anew under the pointer. */
async function downloaded(page, link, tries = 3) {
  const saved = page.waitForEvent('download', { timeout: 10000 }).catch(() => null);
  await link.click();
  return (await saved) ?? (assert.ok(tries > 1, 'nothing is downloaded'), downloaded(page, link, tries - 1));
}

visits('each form and encoding can be downloaded', { ...UNDRAWN, hash: '#tab=scripts&level=1' }, async (visit) => {
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
    const visit = await Visit.begin(site.browser, `${locked.url}/`, { ...UNDRAWN, hash: '#level=1&tab=scripts', refused: [401] });
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

test('a key is asked for and kept for the tab', async () => {
  const locked = new Daemon(['--sample', '--api-keys', 's3cret']);
  await locked.start();
  try {
    const visit = await Visit.begin(site.browser, `${locked.url}/`, { ...UNDRAWN, refused: [401, 403, 404] }); // it signs nothing
    const dialog = visit.page.getByRole('dialog');
    await dialog.waitFor();
    await visit.picture('key');
    await dialog.getByRole('button', { name: 'Cancel' }).click();
    await visit.page.locator('.notice').getByRole('button', { name: 'Try again' }).click();
    assert.ok(await visit.page.getByText('No model yet').isHidden(), 'which models there are is not known');
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
    await visit.page.getByRole('button', { name: 'Live', exact: true }).click();
    await visit.wait(() => parseFloat(document.querySelector('.clock').textContent) > 0.2);
    await visit.end();
    const other = await Visit.begin(site.browser, `${locked.url}/`, { ...UNDRAWN, refused: [401] });
    await other.page.getByRole('dialog').waitFor();
    await other.end();
  } finally {
    await locked.remove();
  }
});

test('on a phone a key is given, a character and its motion are chosen, and a script is copied and run', async () => {
  const locked = new Daemon(['--sample', '--api-keys', 's3cret']);
  await locked.start();
  const folder = mkdtempSync(join(tmpdir(), 'tweend-phone-'));
  try {
    const visit = await Visit.begin(site.browser, `${locked.url}/`, { ...UNDRAWN, ...PHONE, hash: '#show=surface', refused: [401, 404] });
    const { page } = visit;
    await page.getByRole('dialog').getByLabel('Key').tap();
    await page.keyboard.type('s3cret');
    await page.getByRole('button', { name: 'Use key' }).tap();
    await visit.level(2);
    const upload = () => page.getByRole('button', { name: 'Upload', exact: true }).tap();
    await visit.choose([['figure.gltf', biped({ names: 'mixamo' })]], upload);
    await visit.wait(() => document.getElementById('subject').textContent === 'figure.gltf' && document.getElementById('facts').textContent);
    await visit.choose([['walk.bvh', mocap(30).text]], upload);
    await visit.wait(() => /clip=[0-9a-f]{32}/.test(location.hash));
    assert.equal(await visit.text('#subject'), 'figure.gltf');
    await page.locator('.sentences li').first().waitFor();
    await page.getByRole('button', { name: 'Play' }).tap();
    await visit.wait(() => parseFloat(document.querySelector('.clock').textContent) > 0.1);

    await page.context().grantPermissions(['clipboard-read', 'clipboard-write']);
    await page.getByRole('tab', { name: 'Scripts' }).tap();
    await page.getByRole('button', { name: 'Python' }).tap();
    await page.getByRole('button', { name: 'Copy: This surface' }).tap();
    await page.getByText('Copied').waitFor();
    writeFileSync(join(folder, 'script.py'), await page.evaluate(() => navigator.clipboard.readText()));
    execFileSync('python3', ['script.py'], { cwd: folder, env: { ...process.env, KEY: 's3cret' } });
    const [file] = readdirSync(folder).filter((name) => name.endsWith('.glb'));
    const saved = page.waitForEvent('download');
    await page.getByRole('link', { name: 'glb float' }).tap();
    assert.ok(readFileSync(join(folder, file)).equals(readFileSync(await (await saved).path())));
    await visit.end();
  } finally {
    rmSync(folder, { recursive: true });
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
    const visit = await Visit.begin(site.browser, `http://127.0.0.1:${proxy.address().port}/3d/tweend/`, UNDRAWN);
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
    const visit = await Visit.begin(site.browser, `${empty.url}/`, UNDRAWN);
    await visit.page.getByText('No model yet').waitFor();
    await visit.picture('empty');
    await visit.end();
  } finally {
    await empty.remove();
  }
});
