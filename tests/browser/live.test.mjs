// An EventSource in Chromium reads /live: in time, to the end, and on after a break.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { after, before, test } from 'node:test';

import { Daemon, root } from '../node/daemon.mjs';
import { launch } from './chromium.mjs';

const daemon = new Daemon();
let browser, page, tank;

before(async () => {
  await daemon.start();
  tank = await daemon.upload(readFileSync(join(root, 'server/samples/tank.json')));
  browser = await launch([]);
  page = await browser.newPage(); // about:blank: another origin than the daemon's
});

after(async () => {
  await browser?.close();
  await daemon.remove();
});

/** Opens a stream in the page; what it receives is kept in window.seen. */
const listen = (query) =>
  page.evaluate((url) => {
    window.source?.close();
    window.seen = { frames: [], ended: false, opened: 0 };
    window.source = new EventSource(url);
    source.onopen = () => seen.opened++;
    source.addEventListener('end', () => (seen.ended = true));
    source.onmessage = (event) =>
      seen.frames.push({ id: Number(event.lastEventId), at: performance.now(), pose: JSON.parse(event.data) });
  }, `${tank}/live?${query}`);

const wait = (condition) => page.waitForFunction(condition, undefined, { timeout: 20000 });
const seen = () => page.evaluate(() => seen);

function assertRising(frames) {
  frames.slice(1).forEach((frame, i) => assert.ok(frame.id > frames[i].id, `${frame.id} after ${frames[i].id}`));
}

test('frames come sixty times a second and say where the nodes are', async () => {
  await listen('fps=60&loop=repeat&nodes=hull,turret');
  await wait(() => seen.frames.length > 0 && seen.frames.at(-1).id >= 180);
  const { frames } = await seen();
  assertRising(frames);
  const [first, last] = [frames[0], frames.at(-1)];
  const seconds = (last.at - first.at) / 1000;
  assert.ok(Math.abs(seconds - (last.id - first.id) / 60) < 0.25, `${last.id - first.id} frames in ${seconds} s`);
  assert.ok(frames.length > 90, `${frames.length} frames came`);
  for (const { id, pose } of frames) {
    assert.ok(Math.abs(pose.t - (id / 60) % 4) < 1e-5 || Math.abs(pose.t - (id / 60) % 4) > 3.999);
    assert.equal(pose.rotation.length, 2);
    for (const q of pose.rotation) assert.ok(Math.abs(Math.hypot(...q) - 1) < 1e-6);
  }
});

test('a clip that ends says so, and is not played again', async () => {
  await listen('fps=20&speed=8');
  await wait(() => seen.ended);
  const played = (await seen()).frames.map(({ id }) => id);
  assert.equal(played.at(-1), 10);
  // It comes again by itself, with Last-Event-ID, and is told that there is no more.
  await wait(() => source.readyState === EventSource.CLOSED);
  assert.deepEqual((await seen()).frames.map(({ id }) => id), played);
});

test('a stream goes on where it was when the daemon comes again', async () => {
  await listen('fps=20&loop=repeat&nodes=hull');
  await wait(() => seen.frames.length >= 10);
  await daemon.stop();
  const reached = (await seen()).frames.at(-1).id;
  await daemon.start();
  await wait(() => seen.opened === 2 && seen.frames.at(-1).id > 40);
  const { frames } = await seen();
  assertRising(frames);
  const next = frames.find(({ id }) => id > reached);
  assert.equal(next.id, reached + 1);
});
