// The page at / in Firefox, by WebDriver BiDi: what people do with it that needs no picture. WebGL is off, which headless
// Firefox lacks on most machines anyway, so that this is also the page without a picture.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { mkdirSync, readdirSync, readFileSync, rmSync, statSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import puppeteer from 'puppeteer-core';

import { PATIENCE_MS } from '../browser/chromium.mjs';
import { slowWayTo, writeLarge } from '../browser/large_file.mjs';
import { seenAt, VIEW } from '../browser/modeller.mjs';
import { CUBE, drop, PYRAMID } from '../browser/page_driver.mjs';
import { scan } from '../browser/scan.mjs';
import { BY_KEYBOARD, buildShip } from '../browser/ship.mjs';
import { biped } from '../node/biped.mjs';
import { Daemon } from '../node/daemon.mjs';
import { mocap } from '../node/mocap.mjs';

const daemon = new Daemon(['--sample']);
const saved = join(daemon.folder, 'saved'); // what is downloaded
let browser;

before(async () => {
  await daemon.start();
  mkdirSync(saved);
  browser = await puppeteer.launch({
    browser: 'firefox',
    executablePath: process.env.FIREFOX ?? '/usr/bin/firefox-esr',
    headless: true,
    timeout: PATIENCE_MS,
    protocolTimeout: 2 * PATIENCE_MS,
    env: { ...process.env, HOME: daemon.folder }, // beside its profile, Firefox leaves folders at home
    extraPrefsFirefox: { 'webgl.disabled': true, 'browser.download.folderList': 2, 'browser.download.dir': saved },
  });
});
after(async () => {
  await browser?.close();
  await daemon.remove();
});

/** A page, with what it logs as errors, but that there is no WebGL. */
async function open(hash, { url = daemon.url, expected = /WebGL/ } = {}) {
  const context = await browser.createBrowserContext();
  const page = await context.newPage();
  page.setDefaultTimeout(PATIENCE_MS);
  await page.setViewport({ width: 1120, height: 640 });
  const faults = [];
  page.on('pageerror', (error) => faults.push(String(error)));
  page.on('console', (message) => message.type() === 'error' && !expected.test(message.text()) && faults.push(message.text()));
  await page.goto(`${url}/${hash}`);
  return { page, faults, wait: (condition, argument) => page.waitForFunction(condition, { polling: 50 }, argument) };
}

/** What has a role and a name to people with screen readers. */
const by = ({ page }, role, name) => page.locator(`::-p-aria([role="${role}"][name="${name}"])`);

const shows = ({ wait }, name) => wait((wanted) => document.getElementById('subject').textContent === wanted, name);
const says = ({ wait }, facts) => wait((wanted) => document.getElementById('facts').textContent.includes(wanted), facts);

/** Presses keys one after the other, each with those that are held meanwhile, as in "Control+Shift+z". */
async function press({ page }, ...all) {
  for (const keys of all) {
    const [key, ...held] = keys.split('+').reverse();
    for (const name of held) await page.keyboard.down(name);
    await page.keyboard.press(key);
    for (const name of held) await page.keyboard.up(name);
  }
}

/** What the address says of a name. */
const stateOf = ({ page }, name) => new URLSearchParams(new URL(page.url()).hash.slice(1)).get(name);
const idOf = (visit) => stateOf(visit, 'model');
const ask = (path) => fetch(`${daemon.url}/v1/${path}`);
const described = async (id) => (await ask(`models/${id}`)).json();

/** Does something, and waits for the model that it opens, and until it takes clicks. */
async function opens(visit, action) {
  const before = idOf(visit);
  await action();
  await visit.wait((id) => {
    const { dataset } = document.getElementById('view');
    return !location.hash.includes(`model=${id}`) && document.getElementById('facts').textContent.startsWith('Level') && ('pickable' in dataset || 'sculpts' in dataset);
  }, before);
}

/** A page that shows a dropped OBJ. */
async function openPyramid(hash) {
  const visit = await open(hash);
  await shows(visit, 'tank.json');
  await drop(visit, { 'pyramid.obj': PYRAMID });
  await shows(visit, 'pyramid.obj');
  return visit;
}

async function end({ page, faults }) {
  await page.browserContext().close();
  assert.deepEqual(faults, []);
}

test('a dropped OBJ opens, and its levels are told', async () => {
  const visit = await openPyramid('#tab=surface');
  await by(visit, 'tab', 'Surface').click();
  await by(visit, 'button', 'Show level 2').click();
  await says(visit, 'Level 2 · 66 points · 64 faces');
  await end(visit);
});

test('which order of a rotation avoids gimbal lock', async () => {
  const visit = await open('#tab=animation');
  await by(visit, 'combobox', 'Node, nearest to lock first').fill('antenna_euler');
  await visit.wait(() => document.querySelectorAll('.band [data-locked=true]').length > 3);
  await visit.page.locator('::-p-xpath(//button[starts-with(., "Use XZY")])').click();
  await visit.wait(() => document.querySelector('.verdict')?.textContent.startsWith('XZY stays clear'));
  assert.equal((await visit.page.$$('.band [data-locked=true]')).length, 0);
  await end(visit);
});

test('a list of edits is applied by keyboard, undone, and its address shows the same to others', async () => {
  const visit = await openPyramid('#tab=edit');
  await by(visit, 'tab', 'Edit').click();
  await by(visit, 'textbox', 'Edits').fill('[{"edit": "extrude", "faces": [1], "distance": 0.5}]', { typingThreshold: 0 }); // at once
  await (await by(visit, 'button', 'Apply').waitHandle()).focus();
  await visit.page.keyboard.press('Enter');
  await shows(visit, 'pyramid.obj, 1 edit');
  const other = await open(new URL(visit.page.url()).hash);
  await other.wait(() => document.querySelector('[aria-label=Edits]')?.value.includes('extrude'));
  await end(other);
  await by(visit, 'button', 'Undo').click();
  await shows(visit, 'pyramid.obj');
  await end(visit);
});

test('a broken file is explained at its line; another takes its place', async () => {
  const visit = await open('');
  await shows(visit, 'tank.json');
  await drop(visit, { 'bad.obj': 'v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 9\n' });
  await visit.wait(() => /bad\.obj was refused[^]*index 9 is out of range/.test(document.querySelector('.problem')?.innerText));
  await visit.wait(() => document.querySelector('.problem .here')?.textContent.includes('f 1 2 9'));
  await drop(visit, { 'pyramid.obj': PYRAMID });
  await shows(visit, 'pyramid.obj');
  assert.equal(await visit.page.$('.problem'), null);
  await end(visit);
});

test('a noisy scan is made clean by one click, which Ctrl+Z takes back', async () => {
  const visit = await open('');
  await shows(visit, 'tank.json');
  await drop(visit, { 'scan.obj': scan() });
  await shows(visit, 'scan.obj');
  await by(visit, 'tab', 'Edit').click();
  await by(visit, 'button', 'Clean up').click();
  await visit.wait(() => /Pieces\s+2\s+1\s/.test(document.querySelector('#panel-edit table')?.innerText));
  await press(visit, 'Control+z');
  await shows(visit, 'scan.obj');
  await end(visit);
});

test('a key is asked for; a script gives the bytes that are shown', async () => {
  const locked = new Daemon(['--sample', '--api-keys', 's3cret']);
  await locked.start();
  try {
    const visit = await open('#tab=scripts', { url: locked.url, expected: /WebGL|401/ });
    await visit.page.locator('dialog input').fill('s3cret');
    await visit.page.keyboard.press('Enter');
    await shows(visit, 'tank.json');
    await says(visit, 'Level');
    await by(visit, 'button', 'Python').click();
    const code = await visit.page.$eval('pre[aria-label="This surface"]', ({ textContent }) => textContent);
    writeFileSync(join(locked.folder, 'script.py'), code);
    execFileSync('python3', ['script.py'], { cwd: locked.folder, env: { ...process.env, KEY: 's3cret' } });
    const [file] = readdirSync(locked.folder).filter((name) => name.endsWith('.glb'));
    const answer = await fetch(JSON.parse(/"http[^"]*"/.exec(code)[0]), { headers: { Authorization: 'Bearer s3cret' } });
    assert.ok(readFileSync(join(locked.folder, file)).equals(Buffer.from(await answer.arrayBuffer())));
    await end(visit);
  } finally {
    await locked.remove();
  }
});

test('while the daemon is away, files and levels wait for a click', async () => {
  const other = new Daemon(['--sample']);
  await other.start();
  try {
    const visit = await open('#tab=surface', { url: other.url, expected: /WebGL|NetworkError|CORS/ });
    await shows(visit, 'tank.json');
    await says(visit, 'Level 3');
    await visit.wait(() => document.querySelectorAll('#panel-surface tbody tr').length > 5);
    await other.stop();
    await by(visit, 'button', 'Show level 2').click();
    await visit.wait(() => document.querySelector('.notice')?.innerText.includes('The daemon does not answer'));
    await drop(visit, { 'pyramid.obj': PYRAMID });
    await visit.wait(() => /pyramid\.obj could not be sent[^]*The daemon does not answer/.test(document.querySelector('.problem')?.innerText));
    await other.start();
    await visit.page.locator('.notice .again').click();
    await says(visit, 'Level 2');
    await by(visit, 'button', 'Send again').click();
    await shows(visit, 'pyramid.obj');
    await end(visit);
  } finally {
    await other.remove();
  }
});

test('a ship from a box by keyboard alone, with undo and redo, saved as GLB', async () => {
  const visit = await open('#tab=edit');
  const { page } = visit;
  const onPicture = async (...keys) => {
    await page.focus('#view');
    await press(visit, ...keys);
  };
  const enter = async (element) => {
    await element.focus();
    await press(visit, 'Enter');
  };
  await shows(visit, 'tank.json');
  await buildShip({
    opens: (action) => opens(visit, action),
    enter: async (name) => enter(await page.waitForSelector(`::-p-xpath(//button[.="${name}" or @aria-label="${name}"] | //summary[.="${name}"])`)),
    inMenu: async (key) => {
      await visit.wait(() => document.activeElement.role === 'menuitem');
      await press(visit, key);
    },
    onPicture,
    type: async (label, text) => {
      await page.focus(`[aria-label="${label}"]`);
      await press(visit, 'Control+a');
      await page.keyboard.type(text);
      await press(visit, 'Enter');
    },
  });
  const ship = idOf(visit);
  const { bounds, boundary_edges: openEdges, components, creases } = (await described(ship)).meshes[0];
  assert.deepEqual({ bounds, openEdges, components, creases },
    { bounds: { min: [-0.5, -0.5, -1.5], max: BY_KEYBOARD.max }, openEdges: 0, components: 1, creases: BY_KEYBOARD.creases });
  for (const keys of ['Control+z', 'Control+z', 'Control+Shift+z', 'Control+Shift+z']) await opens(visit, () => onPicture(keys));
  assert.equal(idOf(visit), ship);
  await enter(await page.$('#download'));
  const wanted = Buffer.from(await (await ask(`models/${ship}/surface.glb?level=${stateOf(visit, 'level')}`)).arrayBuffer());
  // Firefox writes an empty file of that name first, then one beside it, which takes its place.
  const isSaved = () => readdirSync(saved).length === 1 && readdirSync(saved).every((name) => name.endsWith('.glb') && statSync(join(saved, name)).size > 0);
  for (let waited = 0; waited < 300 && !isSaved(); waited++) await new Promise((resolve) => setTimeout(resolve, 100));
  assert.ok(readFileSync(join(saved, readdirSync(saved)[0])).equals(wanted));
  await end(visit);
});

test('a surface is sculpted by hand and by numbers, and is as before when that is undone', async () => {
  const { id } = await (await fetch(`${daemon.url}/v1/models?name=block.obj`, { method: 'POST', headers: { 'Content-Type': 'model/obj' }, body: CUBE })).json();
  const visit = await open(`#tab=sculpt&level=3&model=${id}&view=${encodeURIComponent(VIEW)}`);
  const { page } = visit;
  const points = async () => (await (await ask(`models/${idOf(visit)}/surface.obj?level=3`)).text()).match(/^v .*$/gm).map((line) => line.split(' ').slice(1).map(Number));
  const apart = (a, b) => Math.hypot(...a.map((value, i) => value - b[i]));
  await visit.wait(() => 'sculpts' in document.getElementById('view').dataset);
  const before = await points();
  const near = before.reduce((best, point) => (apart(point, [0.5, 0.3, 0.6]) < apart(best, [0.5, 0.3, 0.6]) ? point : best));
  const far = before.reduce((best, point) => (apart(point, near) > apart(best, near) ? point : best));
  const { x, y, ...box } = await (await page.$('#view')).boundingBox();
  const at = seenAt(box, near);
  await page.mouse.move(x + at.x, y + at.y);
  await page.mouse.down();
  await page.mouse.move(x + at.x + 60, y + at.y - 50, { steps: 3 });
  await opens(visit, () => page.mouse.up());
  const dragged = await points();
  assert.ok(apart(dragged[before.indexOf(near)], near) > 0.1, 'what was taken hold of has moved');
  assert.ok(apart(dragged[before.indexOf(far)], far) < 1e-6, 'what is far from it has not');
  await by(visit, 'textbox', 'Point').fill('7');
  await press(visit, 'Enter');
  await by(visit, 'textbox', 'Stroke: by').fill('0 0.25 -0.125');
  await opens(visit, () => by(visit, 'button', 'Move').click());
  assert.ok(apart((await points())[7], dragged[7].map((value, i) => value + [0, 0.25, -0.125][i])) < 1e-5);
  for (let i = 0; i < 2; i++) await opens(visit, () => by(visit, 'button', 'Undo').click());
  assert.equal(idOf(visit), id);
  assert.deepEqual(await points(), before);
  await end(visit);
});

test('a BVH that is dropped on a character plays on it', async () => {
  const visit = await open('');
  const { page } = visit;
  await shows(visit, 'tank.json');
  await drop(visit, { 'figure.gltf': biped({ names: 'mixamo' }) });
  await shows(visit, 'figure.gltf');
  await says(visit, 'Level');
  const character = idOf(visit);
  await drop(visit, { 'walk.bvh': mocap(30).text });
  await visit.wait(() => /clip=[0-9a-f]{32}/.test(location.hash));
  await visit.wait(() => document.querySelectorAll('.sentences li').length > 0);
  assert.equal(idOf(visit), character);
  assert.equal(await page.$eval('#timeline select', ({ selectedOptions: [chosen] }) => chosen.text), 'motion (walk.bvh)');
  await by(visit, 'button', 'Play').click();
  await visit.wait(() => parseFloat(document.querySelector('.clock').textContent) > 0.05);
  await end(visit);
});

test('a file of 200 MB tells how far it is, and leaves nothing when it is cancelled', async () => {
  const file = join(daemon.folder, 'large.obj');
  const way = await slowWayTo(daemon, 60e6);
  const listed = async () => (await (await ask('models')).json()).models;
  try {
    const visit = await open('', { url: way.url });
    const { page } = visit;
    await shows(visit, 'tank.json');
    const before = await listed();
    const size = writeLarge(file);
    await (await page.$('[aria-label="Files to upload"]')).uploadFile(file);
    for (const part of [0.05, 0.15, 0.25]) await visit.wait((least) => document.querySelector('.upload progress').value > least, part);
    const said = await page.$eval('.upload', ({ innerText }) => innerText);
    assert.match(said, new RegExp(`^large\\.obj\\s+[\\d.]+ MB of ${Math.round(size / 1e6)} MB`));
    await by(visit, 'button', 'Cancel').click();
    await visit.wait(() => !document.querySelector('.upload'));
    await shows(visit, 'tank.json');
    assert.equal(await page.$('.problem'), null);
    const left = () => readdirSync(join(daemon.folder, 'data/tmp')).length;
    for (let waited = 0; waited < 100 && left() > 0; waited++) await new Promise((resolve) => setTimeout(resolve, 100));
    assert.equal(left(), 0);
    assert.deepEqual(await listed(), before);
    await end(visit);
  } finally {
    way.close();
    rmSync(file);
  }
});
