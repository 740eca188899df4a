// The page at / in Firefox, by WebDriver BiDi: what people do with it that needs no picture. WebGL is off, which headless
// Firefox lacks on most machines anyway, so that this is also the page without a picture.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { readdirSync, readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import puppeteer from 'puppeteer-core';

import { PATIENCE_MS } from '../browser/chromium.mjs';
import { drop, PYRAMID } from '../browser/page_driver.mjs';
import { scan } from '../browser/scan.mjs';
import { Daemon } from '../node/daemon.mjs';

const daemon = new Daemon(['--sample']);
let browser;

before(async () => {
  await daemon.start();
  browser = await puppeteer.launch({
    browser: 'firefox',
    executablePath: process.env.FIREFOX ?? '/usr/bin/firefox-esr',
    headless: true,
    timeout: PATIENCE_MS,
    protocolTimeout: 2 * PATIENCE_MS,
    env: { ...process.env, HOME: daemon.folder }, // beside its profile, Firefox leaves folders at home
    extraPrefsFirefox: { 'webgl.disabled': true },
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
  await visit.page.keyboard.down('Control');
  await visit.page.keyboard.press('z');
  await visit.page.keyboard.up('Control');
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
