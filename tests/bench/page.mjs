// Prints how long the page takes to its first picture, in browsers that have drawn nothing yet, and the processor time
// of the daemon, the browser and this program together; then the longest tasks of the page while a hand turns a scan of 300,000
// triangles, which is drawn without a graphics card.
// usage: node tests/bench/page.mjs BUILD-FOLDER
import { readdirSync, readFileSync } from 'node:fs';
import { join } from 'node:path';
import { IN_SOFTWARE, launch } from '../browser/chromium.mjs';
import { ALL_PIXELS, DESKTOP, drop, Visit } from '../browser/page_driver.mjs';
import { Daemon } from '../node/daemon.mjs';

const [build = 'build-bench'] = process.argv.slice(2);
const TRIES = 5;
const TICK = 10; // ms
const TURN_MS = 5000;
process.env.TESTED_BINARY = join(build, 'tweend');

/** Milliseconds of processor time that this process and those that it started have used. */
function processorTime() {
  const started = new Map();
  for (const pid of readdirSync('/proc').filter((name) => /^\d+$/.test(name))) {
    try {
      const stat = readFileSync(`/proc/${pid}/stat`, 'utf8');
      const fields = stat.slice(stat.lastIndexOf(')') + 2).split(' ').map(Number);
      started.set(Number(pid), { parent: fields[1], ticks: fields[11] + fields[12] + fields[13] + fields[14] });
    } catch {
      // it has ended
    }
  }
  const isOwn = (pid) => pid === process.pid || (started.has(pid) && isOwn(started.get(pid).parent));
  return TICK * [...started].reduce((sum, [pid, { ticks }]) => sum + (isOwn(pid) ? ticks : 0), 0);
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

const daemon = new Daemon(['--sample']);
await daemon.start();
try {
  for (let i = 0; i < TRIES; i++) {
    const browser = await launch(IN_SOFTWARE);
    try {
      const before = processorTime();
      const visit = await Visit.begin(browser, `${daemon.url}/`, { ...DESKTOP, ...ALL_PIXELS, choosesLevel: true });
      await visit.wait(() => document.querySelector('canvas').dataset.level !== undefined);
      const took = await visit.page.evaluate(() => new Promise((resolve) => requestAnimationFrame(() => requestAnimationFrame(resolve))).then(() => performance.now()));
      console.log(`first picture after ${Math.round(took)} ms, ${processorTime() - before} ms of processor time`);
      await visit.end();
    } finally {
      await browser.close();
    }
  }
  await turnScan(daemon);
} finally {
  await daemon.remove();
}
