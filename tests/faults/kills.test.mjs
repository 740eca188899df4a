// The daemon is killed at random moments of a thousand uploads.
import assert from 'node:assert/strict';
import { createHash } from 'node:crypto';
import { test } from 'node:test';
import { setTimeout as pause } from 'node:timers/promises';
import { Daemon } from '../node/daemon.mjs';

const UPLOADS = 1000;
const CLIENTS = 4;

const idOf = (bytes) => createHash('sha256').update(bytes).digest('hex').slice(0, 32);

/** A model of its own for each number: one in ten is longer than what is kept in memory. */
function model(number) {
  const text = `v 0 0 0\nv 1 0 0\nv 0 1 ${number}\nf 1 2 3\n`;
  return number % 10 === 0 ? text + '#'.repeat(79).concat('\n').repeat(20000) : text;
}

test('what was acknowledged outlives kill -9 at any moment, and what is there is whole', async (t) => {
  const daemon = new Daemon();
  t.after(() => daemon.remove());
  await daemon.start();
  const acknowledged = new Set();
  let sent = 0;
  let kills = 0;
  // Ends with the daemon: its port may be another program's then, which answers something else or nothing.
  let life = new AbortController();

  async function client() {
    while (sent < UPLOADS) {
      if (life.signal.aborted) {
        await pause(5);
        continue;
      }
      const body = model(sent++);
      const { signal } = life;
      try {
        const answer = await fetch(`${daemon.url}/v1/models`, { method: 'POST', body, signal, headers: { 'Content-Type': 'model/obj' } });
        if (answer.status === 201) acknowledged.add(idOf(body));
        await answer.arrayBuffer();
      } catch {
        await pause(5); // it was killed
      }
    }
  }

  const clients = Array.from({ length: CLIENTS }, client);
  while (sent < UPLOADS) {
    await pause(Math.random() * 150);
    daemon.process.kill('SIGKILL');
    await daemon.exit;
    life.abort();
    daemon.listen = '127.0.0.1:0';
    await daemon.start();
    life = new AbortController();
    kills++;
  }
  await Promise.all(clients);
  t.diagnostic(`${sent} uploads, ${acknowledged.size} acknowledged, ${kills} kills`);
  assert.ok(kills >= 10 && acknowledged.size > UPLOADS / 10);

  for (const id of acknowledged) {
    const answer = await fetch(`${daemon.url}/v1/models/${id}/source`);
    assert.equal(answer.status, 200, id);
    assert.equal(idOf(Buffer.from(await answer.arrayBuffer())), id);
  }
  const listed = new Set();
  for (let next = '/v1/models?limit=100'; next; ) {
    const page = await (await fetch(new URL(next, daemon.url))).json();
    for (const { id } of page.models) listed.add(id);
    next = page.next;
  }
  for (const id of acknowledged) assert.ok(listed.has(id), id);
  for (const id of listed) {
    const answer = await fetch(`${daemon.url}/v1/models/${id}/surface.json`);
    assert.equal(answer.status, 200, id);
    await answer.arrayBuffer();
  }
});
