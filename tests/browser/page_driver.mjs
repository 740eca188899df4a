// The page at / in Chromium, driven as a person would; a visit that logs an error or asks another host fails.
import assert from 'node:assert/strict';
import { mkdirSync } from 'node:fs';
import { dirname, join } from 'node:path';

import { chromium } from 'playwright-core';

import { root } from '../node/daemon.mjs';

const pictures = join(dirname(process.env.TESTED_BINARY ?? join(root, 'build/tweend')), 'screenshots');
mkdirSync(pictures, { recursive: true });

export const launch = (drawing = ['--use-angle=swiftshader', '--enable-unsafe-swiftshader']) =>
  chromium.launch({ executablePath: process.env.CHROMIUM ?? '/usr/bin/chromium', args: ['--no-sandbox', ...drawing] });

export const DESKTOP = { viewport: { width: 1280, height: 800 } };
export const TABLET = { viewport: { width: 900, height: 700 }, colorScheme: 'dark' };
export const PHONE = { viewport: { width: 390, height: 844 }, deviceScaleFactor: 2, hasTouch: true, isMobile: true };

export class Visit {
  /** refused: statuses that the visit provokes, which Chromium logs as errors. */
  static async begin(browser, url, { hash = '', refused = [], ...options } = {}) {
    const context = await browser.newContext({ ...DESKTOP, ...options });
    const visit = new Visit();
    visit.page = await context.newPage();
    visit.faults = [];
    visit.origin = new URL(url).origin;
    visit.page.on('pageerror', (error) => visit.faults.push(String(error.stack)));
    visit.page.on('console', (message) => {
      const expected = refused.some((status) => message.text().includes(`status of ${status}`));
      if (message.type() === 'error' && !expected) visit.faults.push(message.text());
    });
    visit.page.on('request', (request) => {
      const own = request.url().startsWith(visit.origin) || /^(data|blob):/.test(request.url());
      if (!own) visit.faults.push(`asks ${request.url()}`);
    });
    visit.started = Date.now();
    await visit.page.goto(url + hash);
    return visit;
  }

  /** Ends it; it must have gone without faults. */
  async end() {
    await this.page.context().close();
    assert.deepEqual(this.faults, []);
  }

  wait(condition, argument) {
    return this.page.waitForFunction(condition, argument, { timeout: 30000 });
  }

  /** Until the surface of a level is drawn. */
  async level(level) {
    await this.wait((wanted) => document.querySelector('canvas').dataset.level === String(wanted), level);
    await this.drawn();
  }

  /** Until what is asked for is drawn, twice. */
  async drawn() {
    await this.page.evaluate(() => new Promise((resolve) => requestAnimationFrame(() => requestAnimationFrame(resolve))));
    await this.page.waitForTimeout(150);
  }

  tab(name) {
    return this.page.getByRole('tab', { name }).click();
  }

  text(selector) {
    return this.page.locator(selector).first().innerText();
  }

  /** The time that the player's clock says, seconds. */
  async time() {
    return parseFloat(await this.text('.clock'));
  }

  async seek(time) {
    await this.page.getByRole('slider', { name: 'Time' }).evaluate((range, value) => {
      range.value = value;
      range.dispatchEvent(new Event('input'));
    }, time);
    await this.drawn();
  }

  async shows(name, pressed) {
    const chip = this.page.locator(`#shown [data-name=${name}]`);
    if ((await chip.getAttribute('aria-pressed')) !== String(pressed)) await chip.click();
    await this.drawn();
  }

  /** A picture of the whole page, into the build folder. */
  picture(name) {
    return this.page.screenshot({ path: join(pictures, `${name}.png`) });
  }

  /** The colours of the viewport: [r, g, b, a, …]. What lies over it is hidden meanwhile. */
  async pixels() {
    await this.page.evaluate(() => {
      for (const over of document.querySelectorAll('#stage > :not(canvas)')) over.style.visibility = 'hidden';
    });
    const png = await this.page.locator('#stage').screenshot();
    await this.page.evaluate(() => {
      for (const over of document.querySelectorAll('#stage > :not(canvas)')) over.style.visibility = '';
    });
    const values = await this.page.evaluate(async (base64) => {
      const bitmap = await createImageBitmap(new Blob([Uint8Array.from(atob(base64), (c) => c.charCodeAt(0))], { type: 'image/png' }));
      const canvas = new OffscreenCanvas(bitmap.width, bitmap.height);
      canvas.getContext('2d').drawImage(bitmap, 0, 0);
      const { data } = canvas.getContext('2d').getImageData(0, 0, bitmap.width, bitmap.height);
      let text = '';
      for (let i = 0; i < data.length; i += 30000) text += String.fromCharCode(...data.subarray(i, i + 30000));
      return btoa(text);
    }, png.toString('base64'));
    return Buffer.from(values, 'base64');
  }
}

/** The part of the pixels whose colours differ. */
export function difference(a, b) {
  assert.equal(a.length, b.length);
  let differing = 0;
  for (let i = 0; i < a.length; i += 4) {
    const apart = Math.abs(a[i] - b[i]) + Math.abs(a[i + 1] - b[i + 1]) + Math.abs(a[i + 2] - b[i + 2]);
    if (apart > 24) differing++;
  }
  return differing / (a.length / 4);
}

/** The part of the pixels that are not the background, which the first pixel has. */
export function covered(pixels) {
  const empty = Buffer.alloc(pixels.length);
  for (let i = 0; i < pixels.length; i += 4) pixels.copy(empty, i, 0, 4);
  return difference(pixels, empty);
}
