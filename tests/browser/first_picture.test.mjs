// How long the page takes to its first picture, in a browser that has drawn nothing yet.
import assert from 'node:assert/strict';
import { readdirSync, readFileSync } from 'node:fs';
import { availableParallelism } from 'node:os';
import { after, before, test } from 'node:test';

import { Daemon } from '../node/daemon.mjs';
import { launch } from './chromium.mjs';
import { covered, DESKTOP, Visit } from './page_driver.mjs';

const MOST = 2000; // ms
const TRIES = 3;
const daemon = new Daemon(['--sample']);

before(() => daemon.start());
after(() => daemon.remove());

/** Milliseconds of all processors that this process and those that it started have used, or nobody has. What other
 *  processes use is no time of the page. */
function ownTime() {
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
  const [, , , , idle, waiting] = readFileSync('/proc/stat', 'utf8').split('\n')[0].split(/ +/).map(Number);
  return 10 * [...started].reduce((sum, [pid, { ticks }]) => sum + (isOwn(pid) ? ticks : 0), idle + waiting);
}

/** Milliseconds from the request to the frame that shows the model; less on a machine that is busy otherwise. */
async function firstPicture() {
  const browser = await launch();
  try {
    const before = ownTime();
    const visit = await Visit.begin(browser, `${daemon.url}/`, DESKTOP);
    await visit.wait(() => document.querySelector('canvas').dataset.level === '2');
    const took = await visit.page.evaluate(() => new Promise((resolve) => requestAnimationFrame(() => requestAnimationFrame(resolve))).then(() => performance.now()));
    const alone = (ownTime() - before) / availableParallelism();
    assert.ok(covered(await visit.pixels()) > 0.1, 'the model is there');
    await visit.end();
    return Math.round(Math.min(took, alone));
  } finally {
    await browser.close();
  }
}

test(`the first picture is there within ${MOST / 1000} s`, async () => {
  const times = [];
  do times.push(await firstPicture());
  while (times.at(-1) > MOST && times.length < TRIES);
  console.log(`# the first picture is there after ${times.join(', ')} ms`);
  assert.ok(times.at(-1) <= MOST, `${times} ms`);
});
