// The page at / in Chromium, driven as a person would; a visit that logs an error or asks another host fails.
import assert from 'node:assert/strict';
import { mkdirSync } from 'node:fs';
import { dirname, join } from 'node:path';
import { after, before, test } from 'node:test';

import { Daemon, root } from '../node/daemon.mjs';
import { launch, PATIENCE_MS } from './chromium.mjs';

const pictures = join(dirname(process.env.TESTED_BINARY ?? join(root, 'build/tweend')), 'screenshots');
mkdirSync(pictures, { recursive: true });

// Software draws each pixel: a quarter of them is enough, but for tests that compare what is a pixel wide.
const USUAL = { viewport: { width: 1120, height: 640 }, deviceScaleFactor: 0.5, reducedMotion: 'reduce' };
export const ALL_PIXELS = { deviceScaleFactor: 1 };
export const DESKTOP = { viewport: { width: 1280, height: 800 } };
export const TABLET = { viewport: { width: 900, height: 700 }, colorScheme: 'dark' };
export const PHONE = { viewport: { width: 390, height: 844 }, deviceScaleFactor: 2, hasTouch: true, isMobile: true };

/** Within the page: answers what asks for the level to open a model with. */
function answerLevel2() {
  const { fetch } = window;
  window.fetch = (url, init) => (/[?&]level=auto/.test(url) ? Promise.resolve(Response.json({ level: 2 })) : fetch(url, init));
}

export class Visit {
  /** refused: statuses that the visit provokes, which Chromium logs as errors. choosesLevel: whether models open with
   *  the level that the daemon chooses. Else they do so with level 2, whose counts and pictures are easy to tell, and
   *  which is drawn sooner. */
  static async begin(browser, url, { hash = '', refused = [], choosesLevel = false, ...options } = {}) {
    const context = await browser.newContext({ ...USUAL, ...options });
    context.setDefaultTimeout(PATIENCE_MS);
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
    if (!choosesLevel) await visit.page.addInitScript(answerLevel2);
    await visit.page.goto(url + hash);
    return visit;
  }

  /** Ends it; it must have gone without faults. */
  async end() {
    await this.page.context().close();
    assert.deepEqual(this.faults, []);
  }

  wait(condition, argument) {
    return this.page.waitForFunction(condition, argument);
  }

  /** Until the surface of a level is drawn. */
  async level(level) {
    await this.wait((wanted) => document.querySelector('canvas').dataset.level === String(wanted), level);
    await this.drawn();
  }

  /** Until nothing new is drawn for some frames. */
  async drawn() {
    await this.page.evaluate(async () => {
      const { dataset } = document.querySelector('canvas');
      for (let still = 0, frames; still < 4; still++) {
        await new Promise((resolve) => requestAnimationFrame(resolve));
        if (dataset.frames !== frames) still = 0;
        frames = dataset.frames;
      }
    });
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

/** The daemon and the browser of a file of tests. */
export function open() {
  const site = { daemon: new Daemon(['--sample']) };
  before(async () => {
    await site.daemon.start();
    site.browser = await launch();
  });
  after(async () => {
    await site.browser?.close();
    await site.daemon.remove();
  });

  /** The id of a sample. */
  site.model = async (wanted) => {
    const { models } = await (await fetch(`${site.daemon.url}/v1/models`)).json();
    return models.find(({ name }) => name === wanted).id;
  };

  /** A test that visits the page; options as for Visit.begin. */
  site.visits = (name, options, use) =>
    test(name, async () => {
      const visit = await Visit.begin(site.browser, `${site.daemon.url}/`, options);
      try {
        await use(visit);
      } catch (error) {
        await visit.picture(`failed ${name}`).catch(() => {});
        throw error;
      }
      await visit.end();
    });
  return site;
}

export const PYRAMID = 'v -1 0 -1\nv 1 0 -1\nv 1 0 1\nv -1 0 1\nv 0 1.5 0\nf 1 2 3 4\nf 2 1 5\nf 3 2 5\nf 4 3 5\nf 1 4 5\n';

/** Drops files on the page, as a hand would: {name: text or bytes}. */
export const drop = (visit, files) =>
  visit.page.evaluate((given) => {
    const dataTransfer = new DataTransfer();
    for (const [name, content] of Object.entries(given)) dataTransfer.items.add(new File([typeof content === 'string' ? content : new Uint8Array(content)], name));
    for (const type of ['dragenter', 'dragover', 'drop'])
      document.body.dispatchEvent(new DragEvent(type, { dataTransfer, bubbles: true, cancelable: true }));
  }, files);

/** The part of the pixels whose colours differ, by more than `least` of 765. */
export function difference(a, b, least = 24) {
  assert.equal(a.length, b.length);
  let differing = 0;
  for (let i = 0; i < a.length; i += 4) {
    const apart = Math.abs(a[i] - b[i]) + Math.abs(a[i + 1] - b[i + 1]) + Math.abs(a[i + 2] - b[i + 2]);
    if (apart > least) differing++;
  }
  return differing / (a.length / 4);
}

/** The part of the pixels that are not the background, which the first pixel has. */
export function covered(pixels) {
  const empty = Buffer.alloc(pixels.length);
  for (let i = 0; i < pixels.length; i += 4) pixels.copy(empty, i, 0, 4);
  return difference(pixels, empty);
}
