// A thousand clients play one clip: the daemon evaluates it once a frame.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import http from 'node:http';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { setTimeout as pause } from 'node:timers/promises';

import { Daemon, eventually, root } from './daemon.mjs';

const daemon = new Daemon();
before(() => daemon.start());
after(() => daemon.remove());

/** Of /metrics. */
async function gauge(name) {
  const text = await (await fetch(`${daemon.url}/metrics`)).text();
  return Number(text.match(new RegExp(`^tweend_live_${name} (\\d+)$`, 'm'))[1]);
}

/** Opens a stream and counts its frames. */
function listen(url) {
  const listener = { first: undefined, frames: 0, ended: false };
  listener.request = http.get(url, { agent: false }, (answer) => {
    listener.status = answer.statusCode;
    answer.on('close', () => (listener.ended = true));
    let rest = '';
    answer.setEncoding('utf8').on('data', (text) => {
      const events = (rest + text).split('\n\n');
      rest = events.pop();
      const ids = events.filter((event) => event.startsWith('id: ')).map((event) => Number(event.slice(4, event.indexOf('\n'))));
      listener.first ??= ids[0];
      listener.frames += ids.length;
    });
    answer.on('error', () => {}); // it is cut off below
  });
  return listener;
}

test('a thousand listeners that start apart cost one evaluation a frame', async () => {
  const tank = await daemon.upload(readFileSync(join(root, 'server/samples/tank.json')));
  await (await fetch(`${tank}/pose`)).text(); // what is known by now needs no place in the queue
  const listeners = [];
  const started = performance.now();
  for (let i = 0; i < 1000; i++) {
    listeners.push(listen(`${tank}/live?fps=10&speed=0.01`)); // the clip once, from its beginning, for 400 s
    if (i % 50 === 49) await pause(25);
  }
  await eventually('all have frames', 120, () => listeners.every(({ frames, ended }) => frames >= 5 || ended));
  assert.deepEqual(new Set(listeners.map(({ status }) => status)), new Set([200]));
  assert.equal(await gauge('listeners'), 1000);
  assert.equal(await gauge('channels'), 1);
  const seconds = (performance.now() - started) / 1000;
  const printed = await gauge('frames_printed_total');
  assert.ok(printed <= seconds * 10 + 1, `${printed} frames printed in ${seconds} s`);
  for (const { first, request } of listeners) {
    assert.ok(first <= 2, `began with frame ${first}`); // its own beginning, though a busy client may skip
    request.destroy();
  }
});
