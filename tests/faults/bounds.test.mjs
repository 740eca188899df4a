// What requests hold and compute at most, whatever they send: resident memory stays under --max-memory and what the
// daemon itself takes.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { request } from 'node:http';
import { after, test } from 'node:test';
import { Daemon } from '../node/daemon.mjs';

const MIB = 1 << 20;
const BESIDE = 64 * MIB; // beside --max-memory: code, stacks, sockets, what the allocator keeps
const LIMIT = 128 * MIB;
const daemons = [];
after(() => Promise.all(daemons.map((daemon) => daemon.remove())));

async function startDaemon(...flags) {
  const daemon = new Daemon(flags);
  await daemon.start();
  daemons.push(daemon);
  return daemon;
}

/** The most memory that it has had resident, in bytes. */
const peak = (daemon) => 1024 * Number(readFileSync(`/proc/${daemon.process.pid}/status`, 'utf8').match(/VmHWM:\s+(\d+)/)[1]);

/** A figure of /metrics, read on a connection of its own. */
async function figure(daemon, name) {
  const text = await (await fetch(`${daemon.url}/metrics`, { headers: { Connection: 'close' } })).text();
  return Number(text.split('\n').find((line) => line.startsWith(`${name} `)).slice(name.length));
}

/** Opens a stream and reads it; resolves with its status, its Retry-After, and a function that ends it. */
const listen = (address) =>
  new Promise((resolve, reject) => {
    const asked = request(address, { agent: false }, (answer) => {
      answer.on('error', () => {}).resume();
      resolve({ status: answer.statusCode, retry: answer.headers['retry-after'], end: () => asked.destroy() });
    });
    asked.on('error', reject).end();
  });

test('live streams of many poses hold no more than their part of --max-memory', async () => {
  const daemon = await startDaemon('--max-memory', '128MiB');
  const nodes = Array.from({ length: 5000 }, (_, i) => ({ name: `n${i}` }));
  const model = await daemon.upload(JSON.stringify({ nodes }));
  const live = (i) => `${model}/live?loop=repeat&space=world&fps=${1 + i / 1000}`;
  const streams = await Promise.all(Array.from({ length: 250 }, (_, i) => listen(live(i))));
  const taken = streams.filter(({ status }) => status === 200);
  const refused = streams.filter(({ status }) => status === 503);
  assert.equal(taken.length + refused.length, streams.length);
  assert.ok(taken.length > 10 && refused.length > 10, `${taken.length} streams`);
  assert.ok(refused.every(({ retry }) => Number(retry) > 0));
  while ((await figure(daemon, 'tweend_live_frames_printed_total')) < 3 * taken.length) continue;
  const held = await figure(daemon, 'tweend_memory_bytes{kind="live"}');
  assert.ok(held > LIMIT / 4 && held <= LIMIT / 2, `${held} bytes`);
  assert.ok(peak(daemon) < LIMIT + BESIDE, `${peak(daemon)} bytes`);

  // One that shares the frames of another needs no memory; what is left finds room again.
  const joined = await listen(live(streams.indexOf(taken[0])));
  assert.equal(joined.status, 200);
  for (const { end } of [...streams, joined]) end();
  while ((await figure(daemon, 'tweend_memory_bytes{kind="live"}')) > 0) continue;
  const again = await listen(live(0));
  assert.equal(again.status, 200);
  again.end();
});
