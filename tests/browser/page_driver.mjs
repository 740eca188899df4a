// The page at / in Chromium, driven as a person would; a visit that logs an error or asks another host fails.
import assert from 'node:assert/strict';
import { createHash } from 'node:crypto';
import { mkdirSync } from 'node:fs';
import { dirname, join } from 'node:path';
import { after, before, test } from 'node:test';
import { inflateSync } from 'node:zlib';

import { Daemon, root } from '../node/daemon.mjs';
import { launch, PATIENCE_MS } from './chromium.mjs';

const pictures = join(dirname(process.env.TESTED_BINARY ?? join(root, 'build/tweend')), 'screenshots');
mkdirSync(pictures, { recursive: true });

// Software draws each pixel: a quarter of them is enough, but for tests that compare what is a pixel wide.
const USUAL = { viewport: { width: 1120, height: 640 }, deviceScaleFactor: 0.5, reducedMotion: 'reduce' };
export const ALL_PIXELS = { deviceScaleFactor: 1 };
// For tests that look at no pixels of the model: all of the page runs, but for shaders, which take software half of a visit.
export const UNDRAWN = { isDrawn: false };
export const DESKTOP = { viewport: { width: 1280, height: 800 } };
export const TABLET = { viewport: { width: 900, height: 700 }, colorScheme: 'dark' };
export const PHONE = { viewport: { width: 390, height: 844 }, deviceScaleFactor: 1, hasTouch: true, isMobile: true };

// By hand, to find what relies on answers that come at once: every answer of the daemon comes after up to so many milliseconds.
const DELAY_MS = Number(process.env.TESTED_DELAY ?? 0);
const SEED = process.env.TESTED_SEED ?? String(Date.now() % 100000); // of the delays
if (DELAY_MS > 0) console.log(`# answers are delayed: TESTED_DELAY=${DELAY_MS} TESTED_SEED=${SEED}`);

/** Delays the answers to a page, or all pages of a context, by up to so many milliseconds. The same request, asked as often before,
 *  has the same delay. */
export async function delayAnswers(context, most = DELAY_MS, seed = SEED) {
  const asked = new Map();
  await context.route('**/v1/**', async (route) => {
    const { pathname, search } = new URL(route.request().url());
    const what = `${route.request().method()} ${pathname}${search}`;
    asked.set(what, (asked.get(what) ?? 0) + 1);
    const part = createHash('sha256').update(`${seed} ${what} ${asked.get(what)}`).digest().readUInt32LE() / 2 ** 32;
    await new Promise((resolve) => setTimeout(resolve, part * most));
    await route.continue().catch(() => {}); // it may have been called off
  });
}

/** Within the page: what asks for the level to open a model with is told of level 2. */
function answerLevel2() {
  const { fetch } = window;
  window.fetch = (url, init) => {
    const asked = new URL(url, document.baseURI);
    if (asked.searchParams.get('level') !== 'auto') return fetch(url, init);
    asked.searchParams.set('level', 2);
    for (const name of ['error', 'faces']) asked.searchParams.delete(name);
    return fetch(asked, init);
  };
}

/** Within the page, as text: whatever shaders it gives to WebGL, they draw nothing, and take no time. */
const DRAW_NOTHING = `(${() => {
  const { shaderSource } = WebGL2RenderingContext.prototype;
  WebGL2RenderingContext.prototype.shaderSource = function (shader) {
    const isOfPoints = this.getShaderParameter(shader, this.SHADER_TYPE) === this.VERTEX_SHADER;
    shaderSource.call(this, shader, `#version 300 es\nvoid main() { ${isOfPoints ? 'gl_Position = vec4(0);' : ''} }`);
  };
}})()`;

/** Lets a page draw nothing from its next document on, until the session that is returned is detached. */
async function drawNothing(page) {
  const session = await page.context().newCDPSession(page);
  await session.send('Page.enable');
  await session.send('Page.addScriptToEvaluateOnNewDocument', { source: DRAW_NOTHING });
  return session;
}

/** A page in a context of its own. */
async function openPage(browser, { choosesLevel = false, ...options }) {
  const context = await browser.newContext({ ...USUAL, ...options });
  context.setDefaultTimeout(PATIENCE_MS);
  if (DELAY_MS > 0) await delayAnswers(context);
  const page = await context.newPage();
  page.on('filechooser', () => {}); // from here on Chromium tells of dialogs: when one is awaited it may be too late
  if (!choosesLevel) await page.addInitScript(answerLevel2);
  return page;
}

/** Makes a page as it was when it was opened, but for scripts that it was told to begin with, and what a session of
 *  DevTools changed. */
async function clear(page, url, { viewport = USUAL.viewport }) {
  await page.unrouteAll({ behavior: 'ignoreErrors' });
  for (const event of ['pageerror', 'console', 'request']) page.removeAllListeners(event);
  for (const other of page.context().pages()) if (other !== page) await other.close();
  await page.goto('about:blank');
  await page.context().clearPermissions();
  await page.setViewportSize(viewport);
  const session = await page.context().newCDPSession(page);
  await session.send('Storage.clearDataForOrigin', { origin: new URL(url).origin, storageTypes: 'all' });
  await session.detach();
}

export class Visit {
  /** refused: statuses that the visit provokes, which Chromium logs as errors. choosesLevel: whether models open with
   *  the level that the daemon chooses. Else they do so with level 2, whose counts and pictures are easy to tell, and
   *  which is drawn sooner. isDrawn: whether there are pixels of the model; see UNDRAWN. page: one that openPage made with
   *  the same options. */
  static async begin(browser, url, { hash = '', refused = [], isDrawn = true, page, ...options } = {}) {
    const visit = new Visit();
    visit.page = page ?? (await openPage(browser, options));
    if (!isDrawn) visit.undrawn = await drawNothing(visit.page);
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
    await visit.page.goto(url + hash);
    return visit;
  }

  /** Ends it; it must have gone without faults. */
  async end() {
    await this.page.context().close();
    assert.deepEqual(this.faults, []);
  }

  /** Until a condition holds within the page; asked now and then, since each frame costs in software. */
  wait(condition, argument) {
    return this.page.waitForFunction(condition, argument, { polling: 50 });
  }

  /** Until the surface of a level is drawn, and what lies over it. */
  async level(level) {
    await this.wait((wanted) => {
      const { dataset } = document.querySelector('canvas');
      return dataset.level === String(wanted) && !('opening' in dataset);
    }, level);
    await this.drawn();
  }

  /** Until all that the address names is there, and drawn. */
  drawn() {
    return this.still(true);
  }

  /** Until nothing new is drawn for some frames, nor in the background. isOpened: and nothing is being opened. */
  async still(isOpened = false) {
    await this.page.evaluate(async (mustBe) => {
      const { dataset } = document.querySelector('canvas');
      for (let still = 0, frames; still < 4; still++) {
        await new Promise((resolve) => requestAnimationFrame(resolve));
        if (dataset.frames !== frames || 'unfinished' in dataset || (mustBe && 'opening' in dataset)) still = 0;
        frames = dataset.frames;
      }
    }, isOpened);
  }

  /** Holds what is asked of a URL, now or later, until the function that it resolves with is called, which throws where nothing
   *  was. then(route): what comes of it; its answer, if not given. */
  async hold(url, then = (route) => route.fallback()) {
    let release, count = 0;
    const held = new Promise((resolve) => (release = resolve));
    await this.page.route(url, (route) => {
      count++;
      return held.then(() => then(route)).catch(() => {}); // some are called off
    });
    return () => {
      assert.ok(count > 0, `nothing was asked of ${url}`);
      release();
    };
  }

  /** The address as the page has it: page.url() is told of a change a moment later. */
  address() {
    return this.page.evaluate(() => location.href);
  }

  /** The id of the model that is shown. */
  async model() {
    return new URLSearchParams(new URL(await this.address()).hash.slice(1)).get('model');
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

  /** Of the clip that the address names. */
  async seek(time) {
    await this.drawn();
    await this.wait((least) => Number(document.querySelector('#timeline [aria-label=Time]').max) >= least, time);
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

  /** What the element with the focus is called. */
  focused() {
    return this.page.evaluate(() => document.activeElement.getAttribute('aria-label') ?? document.activeElement.textContent);
  }

  /** Presses a key until the focus is on what is called so, or begins so. */
  async reach(wanted, key = 'Tab') {
    for (let i = 0; i < 60 && !(await this.focused()).startsWith(wanted); i++) await this.page.keyboard.press(key);
    assert.ok((await this.focused()).startsWith(wanted), `${key} reaches ${wanted}`);
  }

  /** Gives files to the dialog that an action opens: [[name, text or bytes]]. */
  async choose(files, action) {
    const [dialog] = await Promise.all([this.page.waitForEvent('filechooser'), action()]);
    await dialog.setFiles(files.map(([name, content]) => ({ name, mimeType: '', buffer: Buffer.from(content) })));
  }

  /** A picture of the whole page, into the build folder. */
  picture(name) {
    return this.page.screenshot({ path: join(pictures, `${name}.png`) });
  }

  /** The colours of the viewport: [r, g, b, a, …]. What lies over it is hidden meanwhile. */
  async pixels() {
    assert.ok(!this.undrawn, 'a visit that is UNDRAWN has no pixels to look at');
    await this.page.evaluate(() => {
      for (const over of document.querySelectorAll('#stage > :not(canvas)')) over.style.visibility = 'hidden';
    });
    const png = await this.page.locator('#stage').screenshot();
    await this.page.evaluate(() => {
      for (const over of document.querySelectorAll('#stage > :not(canvas)')) over.style.visibility = '';
    });
    return coloursOf(png);
  }
}

/** Which of three neighbours of a byte is nearest to the plane through them: the fourth filter of PNG. */
function paeth(left, above, corner) {
  const [a, b, c] = [Math.abs(above - corner), Math.abs(left - corner), Math.abs(left + above - 2 * corner)];
  return a <= b && a <= c ? left : b <= c ? above : corner;
}

/** The colours of a PNG as Chromium writes it, of 8 bits a channel and not interlaced: [r, g, b, a, …]. */
export function coloursOf(png) {
  const parts = [];
  for (let at = 8; at < png.length; at += 12 + png.readUInt32BE(at))
    if (png.toString('latin1', at + 4, at + 8) === 'IDAT') parts.push(png.subarray(at + 8, at + 8 + png.readUInt32BE(at)));
  const bytes = inflateSync(Buffer.concat(parts));
  const [width, height, size] = [png.readUInt32BE(16), png.readUInt32BE(20), png[25] === 6 ? 4 : 3];
  const colours = Buffer.alloc(4 * width * height, 255);
  let above = Buffer.alloc(size * width);
  for (let y = 0; y < height; y++) {
    const from = y * (size * width + 1);
    const row = bytes.subarray(from + 1, from + 1 + size * width);
    const filter = bytes[from];
    for (let i = 0; filter > 0 && i < row.length; i++) {
      const left = i < size ? 0 : row[i - size];
      const corner = i < size ? 0 : above[i - size];
      row[i] += filter === 1 ? left : filter === 2 ? above[i] : filter === 3 ? (left + above[i]) >> 1 : paeth(left, above[i], corner);
    }
    for (let x = 0, to = 4 * width * y; x < row.length; to += 4)
      for (let k = 0; k < size; k++) colours[to + k] = row[x++];
    above = row;
  }
  return colours;
}

/** The daemon and the browser of a file of tests. first: the model that its visits begin with, "" for the one that the page
 *  chooses, an animated tank. files: what there is besides the samples, by names. */
export function open({ first = '', files = {} } = {}) {
  const site = { daemon: new Daemon(['--sample']) };
  const pages = new Map(); // by the options of their visits: to start a renderer takes longer than most visits
  before(async () => {
    await site.daemon.start();
    for (const [name, body] of Object.entries(files))
      await fetch(`${site.daemon.url}/v1/models?name=${name}`, { method: 'POST', headers: { 'Content-Type': 'application/octet-stream' }, body });
    site.browser = await launch();
  });
  after(async () => {
    await site.browser?.close();
    await site.daemon.remove();
  });

  /** The id of a model. */
  site.model = async (wanted) => {
    const { models } = await (await fetch(`${site.daemon.url}/v1/models`)).json();
    return models.find(({ name }) => name === wanted).id;
  };

  /** A test that visits the page; options as for Visit.begin, and `first` where it differs from the file's. isAlone: the
   *  visit changes what cannot be made as it was, so no other one gets its page. */
  site.visits = (name, { first: own = first, hash = '', refused, isDrawn, isAlone = false, ...options }, use) =>
    test(name, async () => {
      const url = `${site.daemon.url}/`;
      const kind = JSON.stringify(options);
      const wanted = own ? `${hash || '#'}&model=${await site.model(own)}` : hash;
      const page = isAlone ? undefined : pages.get(kind);
      pages.delete(kind);
      const visit = await Visit.begin(site.browser, url, { ...options, refused, isDrawn, page, hash: wanted });
      try {
        await use(visit);
      } catch (error) {
        await visit.picture(`failed ${name}`).catch(() => {});
        throw error;
      }
      if (isAlone) return visit.end();
      await visit.undrawn?.detach();
      await clear(visit.page, url, options);
      assert.deepEqual(visit.faults, []);
      pages.set(kind, visit.page);
    });
  return site;
}

export const PYRAMID = 'v -1 0 -1\nv 1 0 -1\nv 1 0 1\nv -1 0 1\nv 0 1.5 0\nf 1 2 3 4\nf 2 1 5\nf 3 2 5\nf 4 3 5\nf 1 4 5\n';
export const CUBE = 'v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\n' +
  'f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n'; // from -1 to 1

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
