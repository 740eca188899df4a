// The clock of the machine jumps while the daemon runs: a year ahead, and two years back. By libfaketime, which
// leaves the monotonic clock alone, as a change of the real clock does.
import assert from 'node:assert/strict';
import { existsSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import { setTimeout as pause } from 'node:timers/promises';
import { Daemon } from '../node/daemon.mjs';

const LIBRARY = `/usr/lib/${{ x64: 'x86_64', arm64: 'aarch64' }[process.arch]}-linux-gnu/faketime/libfaketimeMT.so.1`;
const skip = existsSync(LIBRARY) && !process.env.TESTED_SANITIZED ? false : 'needs libfaketime, and no sanitizer';
const clip = { node: 'a', path: 'rotation', times: [0, 1], quaternions: [[0, 0, 0, 1], [0, 0, 1, 0]] };
const model = JSON.stringify({ nodes: [{ name: 'a' }], clips: [{ name: 'c', tracks: [clip] }] });

test('a clock that jumps neither ends nor hurries anything, and signed URLs go by it', { skip }, async (t) => {
  const daemon = new Daemon(['--api-keys', 'k', '--url-keys', 'signs', '--rate-limit', '1000/s']);
  const clock = join(daemon.folder, 'clock');
  const set = (days) => writeFileSync(clock, days === 0 ? '+0' : `${days > 0 ? '+' : ''}${days}d`);
  daemon.env = {
    LD_PRELOAD: LIBRARY,
    FAKETIME_TIMESTAMP_FILE: clock,
    FAKETIME_NO_CACHE: '1',
    FAKETIME_DONT_FAKE_MONOTONIC: '1',
    DONT_FAKE_MONOTONIC: '1',
  };
  set(0);
  t.after(() => daemon.remove());
  await daemon.start();
  const headers = { Authorization: 'Bearer k', 'Content-Type': 'application/json' };
  const ask = (path, options = {}) => fetch(new URL(path, daemon.url), { ...options, headers });
  const yearNow = async () => new Date((await ask('/healthz')).headers.get('date')).getUTCFullYear();
  const thisYear = await yearNow();

  const { id } = await (await ask('/v1/models', { method: 'POST', body: model })).json();
  const sign = async () => {
    const answer = await ask('/v1/sign', { method: 'POST', body: JSON.stringify({ url: `/v1/models/${id}`, seconds: 3600 }) });
    return (await answer.json()).url;
  };
  const signed = await sign();
  assert.equal((await fetch(new URL(signed, daemon.url))).status, 200);

  const live = await ask(`/v1/models/${id}/live?fps=20&loop=repeat`);
  const reader = live.body.getReader();
  const framesIn = async (ms) => {
    let frames = 0;
    for (const end = performance.now() + ms; performance.now() < end; )
      frames += Buffer.from((await reader.read()).value).toString().split('\ndata:').length - 1;
    return frames;
  };
  assert.ok((await framesIn(1000)) >= 5);

  for (const days of [370, -740]) {
    set(days);
    await pause(50);
    const year = await yearNow();
    assert.notEqual(year, thisYear, 'the daemon has the new time');
    const frames = await framesIn(2000);
    assert.ok(frames >= 10 && frames <= 60, `${frames} frames in two seconds at 20 a second`);
    assert.equal((await fetch(new URL(signed, daemon.url))).status, days > 0 ? 403 : 200);
    assert.equal((await fetch(new URL(await sign(), daemon.url))).status, 200);
    assert.equal((await ask(`/v1/models/${id}/pose.json?at=0.5`)).status, 200);
    const upload = await ask('/v1/models', { method: 'POST', body: `${model}${' '.repeat(Math.abs(days))}` });
    assert.equal(upload.status, 201);
  }
  await reader.cancel();
});
