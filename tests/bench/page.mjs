// Prints how long the page takes to its first picture, in browsers that have drawn nothing yet, and the processor time
// of the daemon, the browser and this program together.
// usage: node tests/bench/page.mjs BUILD-FOLDER
import { readdirSync, readFileSync } from 'node:fs';
import { join } from 'node:path';
import { IN_SOFTWARE, launch } from '../browser/chromium.mjs';
import { ALL_PIXELS, DESKTOP, Visit } from '../browser/page_driver.mjs';
import { Daemon } from '../node/daemon.mjs';

const [build = 'build-bench'] = process.argv.slice(2);
const TRIES = 5;
const TICK = 10; // ms
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
} finally {
  await daemon.remove();
}
