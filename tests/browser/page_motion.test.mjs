// The page at /: clips that play, keys on the timeline, rotations as curves.
import assert from 'node:assert/strict';

import { biped } from '../node/biped.mjs';
import { mocap } from '../node/mocap.mjs';
import { covered, difference, drop, open, UNDRAWN, Visit } from './page_driver.mjs';

const site = open();
const { daemon, visits } = site;

visits('the keys of all tracks stand on the timeline, those of the chosen node before them', { ...UNDRAWN, first: 'cube.obj' }, async (visit) => {
  await visit.level(2);
  const track = (node, path, times, values) => ({ node, path, times, values });
  const clips = [{ name: 'keys', tracks: [
    track('a', 'translation', [0, 0.25, 2], [[0, 0, 0], [1, 0, 0], [0, 0, 0]]), track('b', 'scale', [0, 0.5, 1], [[1, 1, 1], [2, 2, 2], [1, 1, 1]]),
    { node: 'b', path: 'rotation', times: [0, 1.5], quaternions: [[0, 0, 0, 1], [0, 1, 0, 0]] },
  ] }];
  await drop(visit, { 'keys.json': JSON.stringify({ nodes: [{ name: 'a' }, { name: 'b' }], clips }) });
  await visit.wait(() => document.getElementById('subject').textContent === 'keys.json');
  const places = (own) => visit.page.evaluate((wanted) =>
    [...document.querySelectorAll('.ticks line')].filter((line) => line.classList.contains('own') === wanted).map((line) => Number(line.getAttribute('x1'))).sort((a, b) => a - b), own);
  await visit.wait(() => document.querySelectorAll('.ticks line').length === 6);
  assert.deepEqual(await places(false), [0, 125, 250, 500, 750, 1000]);
  await visit.page.evaluate(() => (location.hash += '&node=a'));
  await visit.wait(() => document.querySelectorAll('.ticks line.own').length === 3);
  assert.deepEqual(await places(true), [0, 125, 1000]);
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
  await visit.page.getByLabel('Clip', { exact: true }).selectOption('aim');
  await visit.wait(() => location.hash.includes('clip=aim'));
});

visits('what is done with a clip before its poses are there is not lost', { ...UNDRAWN, hash: '#show=surface' }, async (visit) => {
  const { page } = visit;
  await visit.level(2);
  /** Chooses a clip, whose poses do not come before a function that this resolves with is called. */
  const choose = async (clip) => {
    const release = await visit.hold(/pose\.bin\?.*\bto=/); // a stream asks for one pose first
    await page.getByLabel('Clip', { exact: true }).selectOption(clip);
    await visit.wait((name) => location.hash.includes(`clip=${name}`), clip);
    return release;
  };
  const goesOn = (from) => visit.wait((time) => Math.abs(parseFloat(document.querySelector('.clock').textContent) - time) > 0.3, from);

  let release = await choose('aim');
  await page.getByRole('slider', { name: 'Time' }).evaluate((range) => {
    range.value = 1;
    range.dispatchEvent(new Event('input'));
  });
  assert.equal(await visit.time(), 1);
  release();
  await visit.drawn();
  assert.equal(await visit.time(), 1);

  release = await choose('drive');
  await page.getByRole('button', { name: 'Play' }).click();
  release();
  await page.getByRole('button', { name: 'Pause' }).waitFor();
  await goesOn(await visit.time());
  await page.getByRole('button', { name: 'Pause' }).click();

  release = await choose('aim');
  await page.getByRole('button', { name: 'Live' }).click();
  await goesOn(await visit.time());
  release();
  await visit.wait(() => !('opening' in document.querySelector('canvas').dataset));
  await goesOn(await visit.time()); // the stream
  await page.getByRole('button', { name: 'Live' }).click();
  await visit.wait(() => document.querySelector('.clock').textContent.startsWith('0.00 /'));
  await visit.seek(1); // in its poses
  assert.equal(await visit.time(), 1);
});

visits('a clip moves morph targets as well as nodes', { first: 'cube.obj', hash: '#show=surface' }, async (visit) => {
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
  const assertMoves = async (file, clips) => {
    await drop(visit, { [file]: JSON.stringify(document) });
    await visit.wait((wanted) => document.getElementById('subject').textContent === wanted, file);
    await visit.wait(() => document.getElementById('facts').textContent.startsWith('Level 2'));
    await visit.drawn();
    for (const clip of clips) {
      await visit.page.getByLabel('Clip', { exact: true }).selectOption(clip);
      await visit.wait(() => document.querySelector('.clock').textContent === '0.00 / 1.00 s');
      await visit.drawn();
      const still = await visit.pixels();
      await visit.seek(1);
      assert.ok(difference(still, await visit.pixels()) > 0.02, `${file}: ${clip}`);
    }
  };
  await assertMoves('sheet.gltf', ['lift', 'turn']);
  // The second of two nodes with one name, by which no request can ask for it alone.
  document.nodes.unshift({ name: 'sheet' });
  document.scenes[0].nodes = [0, 1];
  document.animations = [document.animations[0]];
  document.animations[0].channels[0].target.node = 1;
  await assertMoves('twins.gltf', ['lift']);
});

/** A figure that rests in its clip, as glTF, with a square beside it whose one target draws it out. weights: the clip moves
 *  the target's from 0 to 1. A second clip slides the square. */
function faced({ seconds, weights }) {
  const document = JSON.parse(biped({ names: 'mixamo', clip: { seed: 3, keys: 2, seconds, most: 0 } }));
  const floats = [0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, /* target */ 0, 0, 0, 1, 0, 0, 1, 0, 0, 0, 0, 0, /* times */ 0, seconds, /* weights */ 0, 1,
    /* ways */ 0.5, 0, 0, 1.5, 0, 0];
  const bytes = Buffer.concat([Buffer.from(new Float32Array(floats).buffer), Buffer.from(new Uint16Array([0, 1, 2, 0, 2, 3]).buffer)]);
  const buffer = document.buffers.push({ byteLength: bytes.length, uri: `data:application/octet-stream;base64,${bytes.toString('base64')}` }) - 1;
  const add = (byteOffset, byteLength, facts) => {
    const bufferView = document.bufferViews.push({ buffer, byteOffset, byteLength }) - 1;
    return document.accessors.push({ bufferView, componentType: 5126, ...facts }) - 1;
  };
  const corners = (byteOffset, max) => add(byteOffset, 48, { count: 4, type: 'VEC3', min: [0, 0, 0], max });
  const primitive = { attributes: { POSITION: corners(0, [1, 1, 0]) }, targets: [{ POSITION: corners(48, [1, 0, 0]) }],
    indices: add(136, 12, { componentType: 5123, count: 6, type: 'SCALAR' }) };
  const mesh = document.meshes.push({ name: 'face', primitives: [primitive] }) - 1;
  const node = document.nodes.push({ name: 'face', mesh, translation: [0.5, 0, 0] }) - 1;
  document.scenes[0].nodes.push(node);
  const input = add(96, 8, { count: 2, type: 'SCALAR', min: [0], max: [seconds] });
  document.animations.push({ name: 'slides', samplers: [{ input, output: add(112, 24, { count: 2, type: 'VEC3' }) }], channels: [{ sampler: 0, target: { node, path: 'translation' } }] });
  const [clip] = document.animations;
  clip.channels = clip.channels.filter(({ target }) => target.path === 'rotation'); // all at rest
  if (!weights) return JSON.stringify(document);
  clip.samplers.push({ input, output: add(104, 8, { count: 2, type: 'SCALAR' }) });
  clip.channels.push({ sampler: clip.samplers.length - 1, target: { node, path: 'weights' } });
  return JSON.stringify(document);
}

visits('borrowed and blended clips move morph targets, which rest in other clips', { first: 'cube.obj', hash: '#show=surface' }, async (visit) => {
  await visit.level(2);
  await drop(visit, { 'figure.gltf': faced({ seconds: 2 }) });
  await visit.wait(() => document.getElementById('subject').textContent === 'figure.gltf');
  const { id } = await (await fetch(`${daemon.url}/v1/models`, { method: 'POST', body: faced({ seconds: 3, weights: true }), headers: { 'Content-Type': 'model/gltf+json' } })).json();
  const lent = encodeURIComponent(`${id}/moves`);
  /** How far the picture changes over what a part of the hash asks for. */
  const changes = async (asked, seconds) => {
    await visit.page.evaluate((text) => (location.hash = `${location.hash.replace(/&(clip|blend|weight|borrowed|t)=[^&]*/g, '')}&${text}`), asked);
    await visit.wait((text) => document.querySelector('.clock').textContent.endsWith(text), ` / ${seconds} s`);
    await visit.seek(0);
    const first = await visit.pixels();
    await visit.seek(parseFloat(seconds) - 0.05);
    return difference(first, await visit.pixels());
  };
  assert.ok((await changes(`borrowed=${id}&clip=${lent}`, '3.00')) > 0.02, 'borrowed');
  assert.ok((await changes('clip=moves', '2.00')) < 0.001, 'its own clip has no weights');
  assert.ok((await changes(`borrowed=${id}&clip=moves&blend=${lent}&weight=0.5`, '2.40')) > 0.02, 'blended');
  assert.ok((await changes(`borrowed=${id}&clip=moves&blend=${lent}&weight=0`, '2.00')) < 0.001, 'without a part');
  // Of the two clips one alone moves the square, as far whatever its part.
  assert.ok((await changes('clip=moves&blend=slides&weight=0.9', '2.00')) > 0.02, 'it slides');
  const wide = await visit.pixels();
  assert.ok((await changes('clip=moves&blend=slides&weight=0.2', '2.00')) > 0.02, 'it slides, too');
  assert.ok(difference(wide, await visit.pixels()) < 0.001, 'as far');
});

visits('a clip that stops at its end stays there', { ...UNDRAWN, hash: '#loop=clamp&speed=3&t=3.5' }, async (visit) => {
  await visit.level(2);
  assert.equal(await visit.page.getByLabel('Speed').evaluate((select) => select.selectedOptions[0].text), '3 ×');
  await visit.page.getByRole('button', { name: 'Play' }).click();
  await visit.wait(() => document.querySelector('.clock').textContent.startsWith('4.00'));
  await visit.page.getByRole('button', { name: 'Play' }).waitFor();
});

visits('the time of a clip that plays is not carried to another model', UNDRAWN, async (visit) => {
  await visit.level(2);
  const { page } = visit;
  const shows = (name) => visit.wait((wanted) => document.getElementById('subject').textContent === wanted, name);
  const time = async () => new URLSearchParams(new URL(await visit.address()).hash.slice(1)).get('t');
  await page.getByRole('button', { name: 'Play', exact: true }).click();
  await visit.wait(() => parseFloat(document.querySelector('.clock').textContent) > 0.2);
  await page.locator('.model', { hasText: 'cube.obj' }).click();
  await shows('cube.obj');
  assert.equal(await time(), null);
  await page.goBack();
  await shows('tank.json');
  assert.equal(await time(), null);
  await visit.drawn();
});

visits('gimbal lock appears, and the best order takes it away', { hash: '#tab=animation', colorScheme: 'dark' }, async (visit) => {
  await visit.level(2);
  const locked = () => visit.page.locator('.band [data-locked=true]').count();
  const release = await visit.hold('**/pose.bin?**'); // that the facts below are of the former node is seen, and told to screen readers
  await visit.page.getByLabel('Node, nearest').selectOption('antenna_euler');
  await visit.wait(() => document.querySelector('[aria-busy=true] .band') && Number(getComputedStyle(document.querySelector('[aria-busy=true]')).opacity) < 0.5);
  release();
  await visit.wait(() => !document.querySelector('#panel [aria-busy=true]') && document.querySelectorAll('.band [data-locked=true]').length > 3);
  assert.match(await visit.text('.verdict'), /XYZ locks: 0\.0° from lock at 0\.9/);
  await visit.page.getByText(/up to 179° apart, at [12]\.\d+ s/).waitFor(); // its angles go the long way, as the file has them
  await visit.seek(0.9412);
  assert.ok(parseFloat(await visit.text('h3 .value')) < 3);
  await visit.picture('rotation dark');
  await visit.page.getByRole('button', { name: /^Use XZY/ }).click();
  await visit.wait(() => document.querySelector('.verdict')?.textContent.startsWith('XZY stays clear'));
  assert.equal(await locked(), 0);
  await visit.page.getByText('Both go the same way').waitFor(); // other angles of the same keys
  await visit.seek(2.5);
  const asked = 'pose.json?clip=drive&at=2.5&nodes=antenna_euler&as=euler&order=XZY&unit=degrees';
  const { poses } = await (await fetch(`${daemon.url}/v1/models/${await site.model('tank.json')}/${asked}`)).json();
  const said = await visit.page.locator('.chart + .keys').first().locator('output').allInnerTexts();
  poses[0].euler[0].forEach((angle, k) => assert.ok(Math.abs(angle - parseFloat(said[k])) < 1, `${said} for ${poses[0].euler}`));
  await visit.page.getByLabel('Euler order').selectOption('XYZ');
  await visit.wait(() => document.querySelectorAll('.band [data-locked=true]').length > 3);
  const without = await visit.pixels();
  await visit.page.getByRole('combobox', { name: 'Ghosts' }).selectOption('both');
  await visit.drawn();
  assert.ok(difference(without, await visit.pixels()) > 0.0005, 'ghosts are seen');
});

visits('a BVH that is dropped beside a character plays on it, is judged, blended and kept', { first: 'cube.obj', hash: '#show=surface,skeleton,follow' }, async (visit) => {
  const { page } = visit;
  await visit.level(2);
  await drop(visit, { 'figure.gltf': biped({ names: 'mixamo', clip: { seed: 3, keys: 8, seconds: 2, most: 0.4 } }) });
  await visit.wait(() => document.getElementById('subject').textContent === 'figure.gltf');
  await visit.wait(() => document.querySelectorAll('.ticks line').length > 0);
  await visit.drawn();
  const still = await visit.pixels();
  const character = await visit.model();
  await drop(visit, { 'walk.bvh': mocap(90, { frameTime: '.0333333' }).text });
  await visit.wait(() => /clip=[0-9a-f]{32}/.test(location.hash));
  assert.ok((await visit.address()).includes(character), 'the character stays');
  await page.locator('.sentences li').first().waitFor();
  await visit.seek(1.2);
  assert.ok(difference(still, await visit.pixels()) > 0.005, 'it moves');
  assert.match(await page.getByLabel('Clip', { exact: true }).first().evaluate((select) => select.selectedOptions[0].text), /^motion \(walk\.bvh\)$/);
  assert.match(await page.locator('.sentences').innerText(), /loop|seam/i);
  await page.getByText('Carried over to this skeleton').click();
  await page.getByText(/\d+ bones follow/).waitFor();
  await visit.picture('borrowed clip');

  await page.getByLabel('Blend with').selectOption({ index: 1 });
  const slider = page.getByRole('slider', { name: 'Blend' });
  await slider.waitFor();
  await visit.wait(() => document.querySelector('.clock').textContent.startsWith('1.'));
  const pictures = [];
  for (const weight of ['0', '0.5', '1']) {
    await slider.evaluate((range, value) => {
      range.value = value;
      range.dispatchEvent(new Event('input'));
    }, weight);
    await visit.seek(0.8);
    pictures.push(await visit.pixels());
  }
  assert.ok(difference(pictures[0], pictures[2]) > 0.003, 'the two clips differ');
  assert.ok(difference(pictures[0], pictures[1]) > 0.001 && difference(pictures[1], pictures[2]) > 0.001, 'the middle is neither');
  const saved = page.waitForEvent('download');
  await page.getByRole('button', { name: 'Save GLB' }).click();
  assert.match((await saved).suggestedFilename(), /^figure, blend\.glb$/);
  await page.getByRole('button', { name: 'Keep as a model' }).click();
  await visit.wait((id) => !location.hash.includes(`model=${id}`) && document.getElementById('facts').textContent.startsWith('Level'), character);
  const kept = await visit.model();
  const { clips, meshes } = await (await fetch(`${daemon.url}/v1/models/${kept}`)).json();
  assert.deepEqual([clips.length, clips[0].name, meshes.length], [1, 'blend', 1]);
});

/** The bytes of a GLB of the text of a glTF, as a list. */
function glbOf(text) {
  const json = Buffer.from(text.padEnd(Math.ceil(text.length / 4) * 4));
  const head = Buffer.alloc(20);
  [0x46546c67, 2, 20 + json.length, json.length, 0x4e4f534a].forEach((word, i) => head.writeUInt32LE(word, 4 * i));
  return [...head, ...json];
}

visits('a VRMA that is dropped beside a VRM plays on it', { first: 'cube.obj', hash: '#show=surface,skeleton,follow' }, async (visit) => {
  const { page } = visit;
  await visit.level(2);
  await drop(visit, { 'figure.vrm': glbOf(biped({ extension: 'VRMC_vrm' })) });
  await visit.wait(() => document.getElementById('subject').textContent === 'figure.vrm');
  await drop(visit, { 'nod.vrma': glbOf(biped({ names: 'vroid', extension: 'VRMC_vrm_animation', clip: { seed: 4, keys: 8, seconds: 2, most: 0.5 } })) });
  await visit.wait(() => /clip=[0-9a-f]{32}/.test(location.hash));
  assert.equal(await visit.text('#subject'), 'figure.vrm');
  await page.locator('.sentences li').first().waitFor();
  assert.equal(await page.getByLabel('Clip', { exact: true }).first().evaluate((select) => select.selectedOptions[0].text), 'moves (nod.vrma)');
  await visit.seek(0.2);
  const still = await visit.pixels();
  await visit.seek(1.2);
  assert.ok(difference(still, await visit.pixels()) > 0.005, 'it moves');
});

visits('feet on the ground and the seam stand on the timeline; of two clips with one name both play', { ...UNDRAWN, first: 'cube.obj' }, async (visit) => {
  const { page } = visit;
  await visit.level(2);
  // Each foot stands for half of a second, then swings; the hips go 1 m/s and end turned by 30 degrees.
  const times = Array.from({ length: 121 }, (_, i) => i / 60);
  const foot = (side) => times.map((time) => {
    const at = time + (side > 0 ? 0 : 0.5);
    const swing = Math.max(0, 2 * (at % 1) - 1);
    return [0.1 * side, 0.3 * Math.sin(Math.PI * swing) ** 2, Math.floor(at) + swing * swing * (3 - 2 * swing) - (side > 0 ? 0 : 0.5)];
  });
  const track = (node, path, values) => ({ node, path, times, ...values });
  const clips = [
    { name: 'step', tracks: [track('LeftFoot', 'translation', { values: foot(1) }), track('RightFoot', 'translation', { values: foot(-1) }),
      track('hips', 'translation', { values: times.map((time) => [0, 1, time]) }),
      track('hips', 'rotation', { unit: 'degrees', eulers: times.map((time) => [0, 15 * time, 0]) })] },
    { name: 'step', tracks: [{ node: 'hips', path: 'translation', times: [0, 1], values: [[0, 1, 0], [0, 2, 0]] }] },
  ];
  await drop(visit, { 'steps.json': JSON.stringify({ nodes: [{ name: 'hips', translation: [0, 1, 0] }, { name: 'LeftFoot' }, { name: 'RightFoot' }], clips }) });
  await visit.wait(() => document.querySelectorAll('.ticks .contact').length === 4);
  const numbers = (selector, name) => page.locator(selector).evaluateAll((all, of) => all.map((rect) => Math.round(rect.getAttribute(of))).sort((a, b) => a - b), name);
  assert.deepEqual(await numbers('.ticks .contact', 'x'), [0, 250, 500, 750]);
  assert.deepEqual(await numbers('.ticks .contact', 'width'), [250, 250, 250, 250]);
  assert.deepEqual(await numbers('.ticks .seam', 'x'), [0, 997]);
  const select = page.getByLabel('Clip', { exact: true }).first();
  assert.deepEqual(await select.locator('option').allInnerTexts(), ['step', 'step (2)']);
  await select.selectOption('step (2)');
  await visit.wait(() => document.querySelector('.clock').textContent === '0.00 / 1.00 s');
  await visit.wait(() => document.querySelectorAll('.ticks line').length === 2);
  assert.equal(await page.locator('.ticks .seam').count(), 0);
});

visits('curves have axes, seek at a click, and the picture chooses the node', { hash: '#tab=animation&show=surface,follow' }, async (visit) => {
  const { page } = visit;
  await visit.level(2);
  await visit.wait(() => document.querySelectorAll('.chart .u-over').length === 3);
  const nodes = await page.getByLabel('Node, nearest').locator('option').allInnerTexts();
  const distances = nodes.map((text) => parseFloat(text.match(/([\d.]+)° from lock/)[1]));
  assert.deepEqual(distances, [...distances].sort((a, b) => a - b), 'the nearest to lock come first');
  const chart = page.locator('.chart .u-over').first();
  await chart.scrollIntoViewIfNeeded();
  const { width: wide } = await chart.boundingBox();
  await chart.click({ position: { x: wide / 2, y: 20 } });
  await visit.wait(() => Math.abs(parseFloat(document.querySelector('.clock').textContent) - 2) < 0.05);
  const first = await page.getByLabel('Node, nearest').inputValue();
  const { x, y, width, height } = await page.locator('#view').boundingBox();
  const without = await visit.pixels();
  for (const [dx, dy] of [[0.5, 0.55], [0.45, 0.45], [0.55, 0.5], [0.4, 0.6]]) {
    await page.mouse.click(x + width * dx, y + height * dy);
    if (await visit.page.evaluate(() => location.hash.includes('node='))) break;
  }
  assert.match(await visit.address(), /node=/);
  assert.notEqual(new URLSearchParams(new URL(await visit.address()).hash.slice(1)).get('node'), first);
  await visit.shows('trail', true);
  await page.waitForTimeout(500);
  await visit.drawn();
  assert.ok(difference(without, await visit.pixels()) > 0.0002, 'its way is seen');
  await visit.picture('curves');
});

visits('while a blend plays, curves, scripts and seeking are of the first clip, at its own time', { ...UNDRAWN, first: 'cube.obj' }, async (visit) => {
  const { page } = visit;
  await visit.level(2);
  const turn = (name, seconds, y) => ({ name, tracks: [{ node: 'arm', path: 'rotation', interpolation: 'euler', unit: 'degrees', times: [0, seconds], eulers: [[0, 0, 0], [0, y, 0]] }] });
  await drop(visit, { 'paces.json': JSON.stringify({ meshes: [{ name: 'box', shape: { kind: 'box' } }], nodes: [{ name: 'arm', mesh: 'box' }], clips: [turn('slow', 4, 80), turn('fast', 1, 40)] }) });
  await visit.wait(() => document.getElementById('subject').textContent === 'paces.json');
  await visit.drawn();
  await page.evaluate(() => (location.hash += '&clip=slow&blend=fast&weight=0.5&t=0.8')); // of 1 / (0.5 / 4 + 0.5 / 1) s
  await visit.tab('Rotation');
  await visit.wait(() => document.querySelectorAll('.chart .u-over').length === 3 && document.querySelector('.clock').textContent === '0.80 / 1.60 s');
  await visit.drawn();
  const y = () => page.locator('.keys .c1 output').first().innerText().then(parseFloat);
  assert.ok(Math.abs((await y()) - 40) < 0.5, `${await y()}° in the middle of the slow clip`);
  const chart = page.locator('.chart .u-over').first();
  await chart.scrollIntoViewIfNeeded();
  const { width } = await chart.boundingBox();
  await chart.click({ position: { x: width / 4, y: 20 } });
  await visit.wait(() => Math.abs(parseFloat(document.querySelector('.clock').textContent) - 0.4) < 0.02);
  await visit.seek(0.8);
  await visit.tab('Scripts');
  await page.getByText('Of a blend its first clip is asked for').waitFor();
  const curl = await page.getByLabel('This pose', { exact: true }).innerText();
  assert.match(curl, /[?&]at=2(&|'|$)/);
});

visits('camera and floor follow the node that a clip moves a model by, below a root that stays', { first: 'cube.obj', hash: '#show=surface,floor,follow' }, async (visit) => {
  await visit.level(2);
  await drop(visit, { 'runner.json': JSON.stringify({
    meshes: [{ name: 'box', shape: { kind: 'box', size: [1, 1, 1] } }],
    nodes: [{ name: 'armature' }, { name: 'body', parent: 'armature', mesh: 'box' }],
    clips: [{ name: 'run', tracks: [{ node: 'body', path: 'translation', times: [0, 2], values: [[0, 0, 0], [30, 0, -20]] }] }] }) });
  await visit.wait(() => document.getElementById('subject').textContent === 'runner.json' && document.getElementById('facts').textContent);
  await visit.level(2);
  await visit.seek(0);
  const before = await visit.pixels();
  assert.ok(covered(before) > 0.05);
  await visit.seek(1.5);
  assert.ok(difference(before, await visit.pixels()) < 0.01, 'the runner stays in the middle, on its shadow');
  await visit.page.locator('#view').press('ArrowLeft');
  await visit.drawn();
  const turned = await visit.pixels();
  const other = await Visit.begin(site.browser, await visit.address());
  await other.level(2);
  await other.wait(() => document.querySelectorAll('.ticks line').length > 0); // so that it knows whom to follow
  await other.drawn();
  assert.ok(difference(turned, await other.pixels()) < 0.01);
  await other.end();
});
