// Prints the processor time of all of a browser's processes until the page has shown its first picture, beside that of a page
// which only clears a canvas: in a new tab of a browser that runs, with an empty cache, and of a browser that is started for it.
// Of the tab, also by process: the page's own (scripts, layout, raster of what is no WebGL), the GPU process (WebGL by SwiftShader,
// which stands in for a graphics card, and the composition of the window), and all others (network, the browser itself).
// Then the longest tasks of the page while a hand turns a scan of 300,000 triangles, which is drawn without a graphics card.
// usage: node tests/bench/page.mjs BUILD-FOLDER
import { readdirSync, readFileSync } from 'node:fs';
import { join } from 'node:path';
import { setTimeout as pause } from 'node:timers/promises';
import { IN_SOFTWARE, launch } from '../browser/chromium.mjs';
import { ALL_PIXELS, DESKTOP, drop, Visit } from '../browser/page_driver.mjs';
import { Daemon } from '../node/daemon.mjs';
import { BareBrowser } from './bare_browser.mjs';

const [build = 'build-bench'] = process.argv.slice(2);
const TRIES = 7;
const START_MS = 300; // that a tab gets to start before it is given an address
const TICK = 10; // ms
const TURN_MS = 5000;
process.env.TESTED_BINARY = join(build, 'tweend');

const KINDS = { renderer: "the page's own process", 'gpu-process': 'the GPU process', other: 'all others' };

/** Milliseconds of processor time that a process and those that it started have used: {all, and of each of KINDS}. */
function processorTime(first) {
  const started = new Map();
  for (const pid of readdirSync('/proc').filter((name) => /^\d+$/.test(name))) {
    try {
      const stat = readFileSync(`/proc/${pid}/stat`, 'utf8');
      const fields = stat.slice(stat.lastIndexOf(')') + 2).split(' ').map(Number);
      const [, type] = /--type=([\w-]+)/.exec(readFileSync(`/proc/${pid}/cmdline`, 'utf8')) ?? [];
      started.set(Number(pid), { parent: fields[1], ticks: fields[11] + fields[12] + fields[13] + fields[14], kind: type in KINDS ? type : 'other' });
    } catch {
      // it has ended
    }
  }
  const isOwn = (pid) => pid === first || (started.has(pid) && isOwn(started.get(pid).parent));
  const took = { all: 0, ...Object.fromEntries(Object.keys(KINDS).map((kind) => [kind, 0])) };
  for (const [pid, { ticks, kind }] of started) {
    if (!isOwn(pid)) continue;
    took.all += TICK * ticks;
    took[kind] += TICK * ticks;
  }
  return took;
}

/** A ball with dents and noise as OBJ, of 4 n² triangles. */
function scan(n) {
  let seed = 7;
  const random = () => (seed = (seed * 16807) % 2147483647) / 2147483647;
  const lines = [];
  for (let i = 0; i <= n; i++)
    for (let k = 0; k < 2 * n; k++) {
      const [a, b] = [(Math.PI * (i + 0.5)) / (n + 1), (Math.PI * k) / n];
      const radius = 1 + 0.1 * Math.sin(5 * a) * Math.cos(4 * b) + 0.01 * random();
      lines.push(`v ${[Math.sin(a) * Math.cos(b), Math.cos(a), Math.sin(a) * Math.sin(b)].map((x) => (radius * x).toFixed(5)).join(' ')}`);
    }
  const at = (i, k) => i * 2 * n + (k % (2 * n)) + 1;
  for (let i = 0; i < n; i++)
    for (let k = 0; k < 2 * n; k++) lines.push(`f ${at(i, k)} ${at(i, k + 1)} ${at(i + 1, k + 1)}`, `f ${at(i, k)} ${at(i + 1, k + 1)} ${at(i + 1, k)}`);
  return lines.join('\n');
}

/** What is shown, the tab, and what else is done before the scan is turned. */
const TURNED = [['the surface', 'surface,floor', 'Models'], ['its wires', 'surface,wireframe', 'Models'],
  ['its cage, selected', 'surface,cage', 'Edit', async (visit) => {
    await visit.page.getByRole('button', { name: 'Draw it' }).click();
    await visit.wait(() => 'pickable' in document.querySelector('canvas').dataset);
    await visit.page.getByLabel('Selection').fill('"all"');
    await visit.page.keyboard.press('Tab');
  }],
  ['under a brush', 'surface,floor', 'Sculpt', async (visit) => {
    await visit.wait(() => 'sculpts' in document.querySelector('canvas').dataset);
    await visit.page.getByRole('button', { name: 'Draw', exact: true }).click();
  }]];

/** Turns the picture by the mouse, from its corner, where no brush is; resolves with the tasks over 50 ms and the frames. */
async function turn(visit) {
  const { page } = visit;
  await page.evaluate(() => {
    const { dataset } = document.querySelector('canvas');
    window.seen = { tasks: [], frames: -Number(dataset.frames) };
    new PerformanceObserver((list) => window.seen.tasks.push(...list.getEntries().map(({ duration }) => Math.round(duration)))).observe({ type: 'longtask' });
  });
  const { x, y, width, height } = await page.locator('#view').boundingBox();
  const start = performance.now();
  await page.mouse.move(x + 4, y + height - 4);
  await page.mouse.down();
  for (let i = 0; performance.now() - start < TURN_MS; i++) {
    await page.mouse.move(x + 4 + ((7 * i) % (width - 8)), y + height - 4 - ((2 * i) % (height / 2)));
    await page.waitForTimeout(16);
  }
  await page.mouse.up();
  await visit.drawn();
  return page.evaluate(() => ({ ...window.seen, frames: window.seen.frames + Number(document.querySelector('canvas').dataset.frames) }));
}

async function turnScan(daemon) {
  const browser = await launch(IN_SOFTWARE);
  const text = scan(274);
  try {
    for (const [what, show, tab, prepare] of TURNED) {
      const visit = await Visit.begin(browser, `${daemon.url}/`, { ...DESKTOP, ...ALL_PIXELS, hash: `#show=${show}`, choosesLevel: true });
      await visit.level(3);
      await drop(visit, { 'scan.obj': text });
      await visit.wait(() => document.getElementById('subject').textContent === 'scan.obj');
      await visit.level(0);
      await visit.tab(tab);
      await prepare?.(visit);
      await visit.page.waitForTimeout(3000); // for its thumbnail
      await visit.drawn();
      const { tasks, frames } = await turn(visit);
      console.log(`turning ${what}: the longest tasks took ${tasks.sort((a, b) => b - a).slice(0, 3).join(', ') || 'less than 50'} ms, ${tasks.filter((ms) => ms > 200).length} over 200 ms, ${frames} pictures`);
      await visit.end();
    }
  } finally {
    await browser.close();
  }
}

const BLANK = `data:text/html,${encodeURIComponent(`<canvas width="900" height="640"></canvas><script>requestAnimationFrame(() => {
  const canvas = document.querySelector('canvas');
  canvas.getContext('webgl2').clear(WebGL2RenderingContext.COLOR_BUFFER_BIT);
  canvas.dataset.frames = 1;
})</script>`)}`;

/** Milliseconds of processor time until a page has shown its first picture: {tab: of its tab in a browser that has shown another, and
 *  of that by KINDS, browser: of a browser that shows nothing else}, and of the clock. */
async function firstPicture(url) {
  const took = {};
  for (const where of ['tab', 'browser']) {
    const browser = await BareBrowser.start(IN_SOFTWARE);
    try {
      if (where === 'tab') await (await browser.tab(DESKTOP.viewport)).open(BLANK);
      const tab = await browser.tab(DESKTOP.viewport);
      await pause(START_MS);
      const before = processorTime(browser.process.pid);
      took.clock = await tab.open(url);
      const after = processorTime(browser.process.pid);
      took[where] = after.all - (where === 'tab' ? before.all : 0);
      if (where === 'tab') for (const kind of Object.keys(KINDS)) took[kind] = after[kind] - before[kind];
    } finally {
      await browser.close();
    }
  }
  return took;
}

const middle = (values) => values.toSorted((a, b) => a - b)[Math.floor(values.length / 2)];

async function comparePictures(daemon) {
  const pages = { 'a cleared canvas': BLANK, 'the page': `${daemon.url}/` };
  const took = { 'a cleared canvas': [], 'the page': [] };
  for (let i = 0; i < TRIES; i++)
    for (const [name, url] of Object.entries(pages)) took[name].push(await firstPicture(url));
  for (const [name, all] of Object.entries(took)) {
    const told = (what) => `${middle(all.map((one) => one[what]))} ms, at least ${Math.min(...all.map((one) => one[what]))}`;
    console.log(`${name}: first picture after ${Math.round(middle(all.map(({ clock }) => clock)))} ms; processor time of the tab ${told('tab')}, of the whole browser ${told('browser')}`);
    console.log(`  of the tab: ${Object.entries(KINDS).map(([kind, text]) => `${text} ${told(kind)}`).join('; ')}`);
  }
}

const daemon = new Daemon(['--sample']);
await daemon.start();
try {
  await comparePictures(daemon);
  await turnScan(daemon);
} finally {
  await daemon.remove();
}
