// The page at /: files as exporters write them, and a list of models that is tidied up.
import assert from 'node:assert/strict';
import { createHash } from 'node:crypto';
import { test } from 'node:test';

import { biped } from '../node/biped.mjs';
import { Daemon } from '../node/daemon.mjs';
import { mocap } from '../node/mocap.mjs';
import { ALL_PIXELS, covered, difference, drop, open, PYRAMID, UNDRAWN, Visit } from './page_driver.mjs';

const site = open({ first: 'cube.obj' });
const { daemon, visits } = site;

/** A glTF of a box from -1 to 1 whose quads are split into triangles, as a plain exporter writes them, in a dark material. */
function split(more = {}) {
  const corners = [0, 1, 2, 3, 4, 5, 6, 7].flatMap((i) => [i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1]);
  const quads = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
  const index = quads.flatMap(([a, b, c, d]) => [a, b, c, a, c, d]);
  const bytes = Buffer.concat([Buffer.from(new Float32Array(corners).buffer), Buffer.from(new Uint16Array(index).buffer), Buffer.from(new Float32Array([0, 1]).buffer)]);
  return JSON.stringify({
    asset: { version: '2.0' }, scene: 0, scenes: [{ nodes: [0] }], nodes: [{ mesh: 0 }],
    meshes: [{ primitives: [{ attributes: { POSITION: 0 }, indices: 1, material: 0 }] }],
    materials: [{ pbrMetallicRoughness: { baseColorFactor: [0.05, 0.05, 0.2, 1], metallicFactor: 0 } }],
    buffers: [{ byteLength: bytes.length, uri: `data:application/octet-stream;base64,${bytes.toString('base64')}` }],
    bufferViews: [{ buffer: 0, byteLength: 96 }, { buffer: 0, byteOffset: 96, byteLength: 72 }, { buffer: 0, byteOffset: 168, byteLength: 8 }],
    accessors: [{ bufferView: 0, componentType: 5126, count: 8, type: 'VEC3', min: [-1, -1, -1], max: [1, 1, 1] },
      { bufferView: 1, componentType: 5123, count: 36, type: 'SCALAR' },
      { bufferView: 2, componentType: 5126, count: 2, type: 'SCALAR', min: [0], max: [1] }],
    ...more,
  });
}

const shows = (visit, name) => visit.wait((wanted) => document.getElementById('subject').textContent === wanted, name);

async function says(visit, facts) {
  await visit.wait((wanted) => document.getElementById('facts').textContent.includes(wanted), facts);
  await visit.drawn();
}

visits('lamps of a file do not burn out the picture', {}, async (visit) => {
  await visit.level(2);
  await drop(visit, { 'dark.gltf': split() });
  await shows(visit, 'dark.gltf');
  await visit.level(2);
  const dark = await visit.pixels();
  const lamp = { type: 'point', intensity: 54351 }; // Blender's of 1,000 W
  await drop(visit, { 'lamp.gltf': split({
    extensionsUsed: ['KHR_lights_punctual'], extensions: { KHR_lights_punctual: { lights: [lamp] } }, scenes: [{ nodes: [0, 1] }],
    nodes: [{ mesh: 0 }, { translation: [3, 4, 3], extensions: { KHR_lights_punctual: { light: 0 } } }] }) });
  await shows(visit, 'lamp.gltf');
  await visit.level(2);
  await visit.drawn();
  const apart = difference(dark, await visit.pixels());
  assert.ok(apart < 0.001, `${apart} of the picture is another`);
});

visits('triangles that were quads are joined, and stay so where the model is edited and sculpted', UNDRAWN, async (visit) => {
  const { page } = visit;
  await visit.level(2);
  await drop(visit, { 'split.gltf': split({ extras: {} }) }); // other bytes than dark.gltf
  await shows(visit, 'split.gltf');
  await says(visit, ' 96 faces');
  assert.match(await visit.text('#legend'), /6 joined quads/);
  await page.getByRole('button', { name: 'Split them' }).click();
  await says(visit, ' 144 faces');
  assert.match(await visit.text('#legend'), /6 split quads/);
  await page.getByRole('button', { name: 'Join them' }).click();
  await says(visit, ' 96 faces');
  assert.match(await visit.text('#legend'), /6 joined quads/);
  await visit.tab('Surface');
  assert.equal(await page.getByRole('combobox', { name: /^Triangles/ }).inputValue(), 'auto');
  await visit.tab('Edit');
  await visit.wait(() => 'pickable' in document.querySelector('canvas').dataset);
  await page.getByLabel('Selection').fill('"all"');
  await page.keyboard.press('Tab');
  await page.locator('.selected', { hasText: /^6 faces$/ }).waitFor();
  await page.getByLabel('Selection').fill('[5]');
  await page.keyboard.press('Tab');
  await page.getByRole('button', { name: 'Extrude', exact: true }).click();
  await shows(visit, 'split.gltf, 1 edit');
  await says(visit, ' 160 faces'); // 10 quads
  assert.doesNotMatch(await visit.address(), /quads/); // it has them
  await page.getByRole('button', { name: 'Undo' }).click();
  await shows(visit, 'split.gltf');
  await says(visit, ' 96 faces');
  await visit.tab('Sculpt');
  await visit.wait(() => 'sculpts' in document.querySelector('canvas').dataset);
  await page.getByLabel('Point', { exact: true }).fill('3');
  await page.keyboard.press('Tab');
  await page.getByRole('button', { name: 'Move', exact: true }).click();
  await shows(visit, 'split.gltf, sculpted');
  await says(visit, ' 96 faces');
});

visits('an OBJ comes without its materials, which is said', {}, async (visit) => {
  await visit.level(2);
  await drop(visit, { 'pyramid.mtl': '# Blender\nnewmtl a\n', 'pyramid.obj': `mtllib pyramid.mtl\nusemtl a\n${PYRAMID}`, 'skin.png': 'png' });
  await shows(visit, 'pyramid.obj');
  await visit.level(2);
  for (const name of ['cage', 'points']) await visit.shows(name, false);
  const named = await visit.pixels();
  const said = visit.page.locator('.problem');
  assert.equal(await said.count(), 1);
  assert.match(await said.innerText(), /Left out: pyramid\.mtl, skin\.png[^]*GLB/);
  // What has but a name looks as what has none.
  await drop(visit, { 'nameless.obj': `# nameless\n${PYRAMID}` });
  await shows(visit, 'nameless.obj');
  await visit.level(2);
  await visit.drawn();
  const apart = difference(named, await visit.pixels());
  assert.ok(apart < 0.001, `${apart} of the picture is another`);
});

visits('of many files the first is opened, the others are listed, which is said', { ...UNDRAWN, isAlone: true }, async (visit) => {
  const { page } = visit;
  await visit.level(2);
  const opened = new Set();
  page.on('request', (request) => /\/surface\.glb/.test(request.url()) && opened.add(/models\/(\w+)/.exec(request.url())[1]));
  const names = Array.from({ length: 20 }, (_, i) => `part_${i + 10}.obj`);
  await drop(visit, Object.fromEntries(names.map((name) => [name, `# ${name}\n${PYRAMID}`])));
  await page.getByText('20 models are stored, and in the list.').waitFor();
  await shows(visit, names[0]);
  await visit.level(2);
  assert.deepEqual([...opened], [await visit.model()]);
  for (const name of names) assert.equal(await page.locator('.model .name', { hasText: name }).count(), 1, name);
  await page.goBack();
  await shows(visit, 'cube.obj');
});

visits('a character and its clips that are dropped together open as one that plays', UNDRAWN, async (visit) => {
  const { page } = visit;
  await visit.level(2);
  await page.route('**/v1/models/*', (route) => setTimeout(() => route.fallback(), 300)); // it is not open yet when the clip is stored
  await drop(visit, { 'a_walk.bvh': mocap(30).text, 'figure.gltf': biped({ names: 'mixamo' }) });
  await shows(visit, 'figure.gltf');
  await visit.wait(() => /clip=[0-9a-f]{32}/.test(location.hash));
  await visit.wait(() => document.querySelector('#timeline select').selectedOptions[0]?.text === 'motion (a_walk.bvh)');
  assert.equal(await visit.text('#subject'), 'figure.gltf');
});

visits('what the daemon has to say of a model stands above the list', UNDRAWN, async (visit) => {
  await visit.level(2);
  await drop(visit, { 'lines.obj': `${PYRAMID}l 1 2\n` });
  await shows(visit, 'lines.obj');
  await visit.page.getByText('1 line, point or curve is left out').waitFor();
  for (const sample of ['cube.obj', 'tank.json']) {
    await visit.page.getByRole('button', { name: new RegExp(`^${sample}`) }).click();
    await shows(visit, sample);
    assert.equal(await visit.page.locator('#panel-models .warning').count(), 0);
  }
  // More than two stand behind their number.
  await drop(visit, { 'losses.obj': `${PYRAMID}l 1 2\nf 1 2\nvp 0 0\n` });
  await shows(visit, 'losses.obj');
  const line = visit.page.getByText('1 line, point or curve is left out').first();
  await visit.page.getByText('3 warnings').waitFor();
  assert.equal(await line.isVisible(), false);
  await visit.page.getByText('3 warnings').click();
  assert.equal(await line.isVisible(), true);
});

visits('models are deleted, and the browser goes back to the one before', UNDRAWN, async (visit) => {
  const { page } = visit;
  await visit.level(2);
  await drop(visit, { 'spare.obj': PYRAMID });
  await shows(visit, 'spare.obj');
  await page.getByRole('button', { name: /^cube\.obj/ }).click();
  await shows(visit, 'cube.obj');
  await page.goBack();
  await shows(visit, 'spare.obj');
  const stored = async () => (await (await fetch(`${daemon.url}/v1/models`)).json()).models.some(({ name }) => name === 'spare.obj');
  const remove = page.getByRole('button', { name: 'Delete spare.obj' });
  await remove.click();
  assert.equal(await remove.count(), 0);
  await page.locator('.gone').getByRole('button', { name: 'Undo' }).click();
  await shows(visit, 'spare.obj');
  assert.ok(await stored());
  await remove.click();
  await shows(visit, 'tank.json');
  assert.ok(await stored(), 'there is time to undo');
  for (let waited = 0; waited < 300 && (await stored()); waited++) await page.waitForTimeout(100);
  assert.equal(await stored(), false);
  assert.equal(await remove.count(), 0);
});

visits('tabs of one browser list the same, by the same names', UNDRAWN, async (visit) => {
  await visit.level(2);
  const sent = await fetch(`${daemon.url}/v1/models?name=unopened.obj`, { method: 'POST', headers: { 'Content-Type': 'model/obj' }, body: `# unopened\n${PYRAMID}` });
  assert.equal(sent.status, 201);
  const other = Object.assign(new Visit(), { page: await visit.page.context().newPage() });
  await other.page.goto(await visit.address());
  const rename = async ({ page }, name, to) => {
    await page.getByRole('button', { name: `Rename ${name}` }).click();
    await page.getByRole('dialog').getByLabel('Name').fill(to);
    await page.keyboard.press('Enter');
  };
  const entry = ({ page }, name) => page.locator('.model', { hasText: name });
  await drop(visit, { 'shared.obj': `# shared\n${PYRAMID}` });
  await shows(visit, 'shared.obj');
  await entry(other, 'shared.obj').waitFor();
  await rename(visit, 'cube.obj', 'A cube');
  await entry(other, 'A cube').waitFor();
  await shows(other, 'A cube');
  await rename(other, 'octopus.obj', 'An octopus');
  await entry(visit, 'An octopus').waitFor();
  await visit.page.reload();
  for (const name of ['A cube', 'An octopus']) await entry(visit, name).waitFor();
  await visit.page.getByRole('button', { name: 'Delete shared.obj' }).click();
  await entry(other, 'shared.obj').waitFor({ state: 'detached' }); // when the time to undo is over
  await visit.page.getByRole('button', { name: 'Delete unopened.obj' }).click();
  await entry(other, 'unopened.obj').waitFor({ state: 'detached' }); // no tab has opened or named it
});

visits('a model that cannot be deleted stays in the list, with its name and its versions', UNDRAWN, async (visit) => {
  const { page } = visit;
  await visit.level(2);
  await drop(visit, { 'kept.obj': `# kept\n${PYRAMID}` });
  await shows(visit, 'kept.obj');
  await visit.tab('Edit');
  await visit.wait(() => 'pickable' in document.querySelector('canvas').dataset);
  await page.getByLabel('Selection').fill('[1]');
  await page.keyboard.press('Enter');
  await page.getByRole('button', { name: 'Inset', exact: true }).click();
  await shows(visit, 'kept.obj, 1 edit');
  await visit.tab('Models');
  const names = () => page.locator('.model .name').allInnerTexts();
  const all = await names();
  await page.route('**/v1/models/*', (route) => (route.request().method() === 'DELETE' ? route.abort('connectionrefused') : route.fallback()));
  await page.getByRole('button', { name: 'Delete kept.obj' }).click();
  await page.getByRole('button', { name: 'Delete octopus.obj' }).click(); // which ends the time to undo the other
  await page.locator('.notice', { hasText: 'kept.obj cannot be deleted' }).first().waitFor();
  await page.locator('.model', { hasText: 'kept.obj' }).waitFor();
  await page.locator('.gone').getByRole('button', { name: 'Undo' }).click();
  assert.deepEqual((await names()).sort(), all.sort());
  await page.reload();
  await page.locator('.versions', { hasText: '2 versions' }).waitFor();
  assert.deepEqual((await names()).sort(), all.sort());
  visit.faults = visit.faults.filter((fault) => !fault.includes('ERR_CONNECTION_REFUSED'));
});

test('of more than a hundred models More lists the next, and what is dropped is listed in any case', async () => {
  const own = new Daemon(['--sample']);
  await own.start();
  const visit = await Visit.begin(site.browser, `${own.url}/`, UNDRAWN);
  const { page } = visit;
  try {
    for (let i = 0; i < 120; i++) await own.upload(`# ${i}\n${PYRAMID}`);
    await page.reload();
    const lists = (count) => visit.wait((wanted) => document.querySelectorAll('.model').length === wanted, count);
    await lists(100);
    const { models } = await (await fetch(`${own.url}/v1/models?limit=1000`)).json();
    const files = Array.from({ length: 12 }, (_, i) => [`dropped ${i}.obj`, `# dropped ${i}\n${PYRAMID}`]);
    const late = files.filter(([, text]) => createHash('sha256').update(text).digest('hex') > models[99].id); // in the list of the daemon after the first 100
    assert.ok(late.length > 0);
    await drop(visit, Object.fromEntries(late.slice(0, 1)));
    await shows(visit, late[0][0]);
    await page.locator('.model[aria-current]', { hasText: late[0][0] }).waitFor();
    await page.evaluate(() => {
      const more = [...document.querySelectorAll('button')].find(({ textContent }) => textContent === 'More');
      more.click();
      more.click();
    });
    await lists(models.length + 1);
    assert.ok(await page.getByRole('button', { name: 'More' }).isHidden());
    await drop(visit, { 'last.obj': `# last\n${PYRAMID}` });
    await shows(visit, 'last.obj');
    await lists(models.length + 2); // no fewer than before
    await visit.end();
  } finally {
    await own.remove();
  }
});

visits('all versions of a deleted model go when the page is left', { ...UNDRAWN, isAlone: true }, async (visit) => {
  const { page } = visit;
  await visit.level(2);
  await drop(visit, { 'left.obj': `# left\n${PYRAMID}` });
  await shows(visit, 'left.obj');
  for (const name of ['left.obj, 1 edit', 'left.obj, 2 edits']) {
    await visit.tab('Edit');
    await visit.wait(() => 'pickable' in document.querySelector('canvas').dataset);
    await page.getByLabel('Selection').fill('[1]');
    await page.keyboard.press('Enter');
    await page.getByRole('button', { name: 'Extrude', exact: true }).click();
    await shows(visit, name);
  }
  const stored = async () => (await (await fetch(`${daemon.url}/v1/models`)).json()).models.filter(({ name }) => name.startsWith('left.obj')).length;
  assert.equal(await stored(), 3);
  await visit.tab('Models');
  await page.getByRole('button', { name: 'Delete left.obj' }).click();
  await page.goto('about:blank');
  for (let waited = 0; waited < 100 && (await stored()) > 0; waited++) await page.waitForTimeout(50);
  assert.equal(await stored(), 0);
});

visits('a batch of files is called off at once; the tab that was turned to stays', UNDRAWN, async (visit) => {
  const { page } = visit;
  await visit.level(2);
  let left = 2;
  await page.route('**/v1/models?name=*', (route) => (left-- > 0 ? route.fallback() : undefined)); // the third is never answered
  await drop(visit, Object.fromEntries([1, 2, 3, 4, 5].map((i) => [`batch_${i}.obj`, `# batch ${i}\n${PYRAMID}`])));
  await shows(visit, 'batch_1.obj');
  await visit.tab('Surface');
  await page.locator('.upload', { hasText: 'batch_3.obj' }).waitFor({ state: 'attached' });
  assert.equal(await page.getByRole('tab', { name: 'Surface' }).getAttribute('aria-selected'), 'true');
  await visit.tab('Models');
  await page.locator('.upload').getByRole('button', { name: 'Cancel' }).click();
  await page.getByText('2 models are stored, and in the list. 3 files are not sent.').waitFor();
  assert.equal(await page.locator('.upload').count(), 0);
});

visits('points without faces are told once, and no longer beside the next model', { ...UNDRAWN, refused: [422] }, async (visit) => {
  await visit.level(2);
  const { page } = visit;
  await drop(visit, { 'points.obj': 'v 0 0 0\nv 1 1 1\n' });
  await page.locator('.notice', { hasText: 'it has no surface' }).waitFor();
  await page.locator('.empty', { hasText: 'Nothing is shown' }).waitFor();
  assert.equal(await page.locator('.notice').count(), 1);
  await drop(visit, { 'faces.obj': `# faces\n${PYRAMID}` });
  await shows(visit, 'faces.obj');
  await says(visit, ' faces');
  assert.equal(await page.locator('.notice').count(), 0);
});

visits('what is shown is downloaded by one click', { ...UNDRAWN, hash: '#tab=edit&level=1&encoding=quantized' }, async (visit) => {
  await visit.level(1);
  const saved = visit.page.waitForEvent('download');
  await visit.page.getByRole('link', { name: 'Download' }).click();
  const download = await saved;
  assert.equal(download.suggestedFilename(), 'cube.glb');
  assert.match(download.url(), /surface\.glb\?.*level=1/);
  assert.match(download.url(), /encoding=quantized/);
});

visits('a daemon that went away is told of, and what failed is tried again', { ...UNDRAWN, hash: '#tab=surface' }, async (visit) => {
  await visit.level(2);
  await visit.page.getByRole('button', { name: 'Show level 1', exact: true }).waitFor();
  await visit.page.route('**/v1/**', (route) => route.abort('connectionrefused')); // as long as it is away
  await visit.page.getByRole('button', { name: 'Show level 3' }).click();
  const notice = visit.page.locator('.notice', { hasText: 'Level 3 cannot be shown' });
  await notice.getByText('The daemon does not answer').waitFor();
  await visit.page.unroute('**/v1/**');
  await notice.getByRole('button', { name: 'Try again' }).click();
  await visit.level(3);
  assert.equal(await notice.count(), 0);
  visit.faults = visit.faults.filter((fault) => !fault.includes('ERR_CONNECTION_REFUSED'));
});

visits('of a clip alone the joints are shown', {}, async (visit) => {
  await visit.level(2);
  await drop(visit, { 'wave.json': JSON.stringify({
    nodes: [{ name: 'arm' }, { name: 'hand', parent: 'arm', translation: [0, 170, 0] }],
    clips: [{ name: 'wave', tracks: [{ node: 'arm', path: 'rotation', times: [0, 1], axis_angles: [[0, 0, 1, 0], [0, 0, 1, 1]] }] }] }) });
  await shows(visit, 'wave.json');
  await says(visit, ' 0 faces');
  await visit.drawn();
  const seen = covered(await visit.pixels());
  assert.ok(seen > 0.001, `${seen} of the picture is covered`);
});

visits('the cage and its points follow morph targets, which rest in another clip', { ...ALL_PIXELS, hash: '#show=cage,points' }, async (visit) => {
  await visit.level(2);
  const channels = (path, node) => ({ channels: [{ sampler: 0, target: { node, path } }], samplers: [{ input: 2, output: path === 'weights' ? 2 : 3 }] });
  const document = JSON.parse(split({ animations: [{ name: 'grow', ...channels('weights', 0) }, { name: 'stay', ...channels('translation', 1) }] }));
  document.meshes[0].primitives[0].targets = [{ POSITION: 0 }]; // as far again
  document.nodes.push({ name: 'other' });
  document.scenes[0].nodes.push(1);
  document.accessors.push({ componentType: 5126, count: 2, type: 'VEC3' }); // zeros
  await drop(visit, { 'grow.gltf': JSON.stringify(document) });
  await shows(visit, 'grow.gltf');
  await visit.level(2);
  const width = async () => {
    const pixels = await visit.pixels();
    const { width: across } = await visit.page.locator('#stage').boundingBox();
    const xs = [];
    for (let i = 0; i < pixels.length; i += 4) if (pixels[i + 1] < 180) xs.push((i / 4) % across);
    return xs.reduce((most, x) => Math.max(most, x), 0) - xs.reduce((least, x) => Math.min(least, x), Infinity);
  };
  await visit.wait(() => !document.getElementById('timeline').hidden && document.querySelectorAll('.ticks line').length > 0);
  await visit.drawn();
  const small = await width();
  await visit.seek(0.4);
  const grown = await width();
  assert.ok(grown > 1.3 * small, `${small} pixels wide, then ${grown}`);
  await visit.page.getByLabel('Clip', { exact: true }).selectOption('stay');
  await visit.wait(() => location.hash.includes('clip=stay'));
  await visit.seek(0.1);
  assert.ok(Math.abs((await width()) - small) < 4);
});
