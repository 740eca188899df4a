// The page at / in Firefox, by WebDriver BiDi: a handful of tasks. WebGL is off, which headless Firefox lacks on most machines anyway,
// so that this is also the page without a picture.
import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';
import puppeteer from 'puppeteer-core';

import { PATIENCE_MS } from '../browser/chromium.mjs';
import { drop, PYRAMID } from '../browser/page_driver.mjs';
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
async function open(hash) {
  const context = await browser.createBrowserContext();
  const page = await context.newPage();
  page.setDefaultTimeout(PATIENCE_MS);
  await page.setViewport({ width: 1120, height: 640 });
  const faults = [];
  page.on('pageerror', (error) => faults.push(String(error)));
  page.on('console', (message) => message.type() === 'error' && !/WebGL/.test(message.text()) && faults.push(message.text()));
  await page.goto(`${daemon.url}/${hash}`);
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
