// Clients that leave, at every stage of a request, by closing and by a reset.
import assert from 'node:assert/strict';
import { readdirSync } from 'node:fs';
import { connect } from 'node:net';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { setTimeout as pause } from 'node:timers/promises';
import { Daemon } from '../node/daemon.mjs';

const CLIENTS = 10;
const daemon = new Daemon(['--queue', '100']); // clients that left may still be computed for
let model;

before(async () => {
  await daemon.start();
  const clip = { node: 'a', path: 'rotation', times: [0, 1], quaternions: [[0, 0, 0, 1], [0, 0, 1, 0]] };
  model = new URL(
    await daemon.upload(
      JSON.stringify({
        meshes: [{ name: 'm', positions: [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], faces: [[0, 1, 2, 3]] }],
        nodes: [{ name: 'a', mesh: 'm' }],
        clips: [{ name: 'c', tracks: [clip] }],
      }),
    ),
  ).pathname;
});
after(() => daemon.remove());

const get = (path) => `GET ${path} HTTP/1.1\r\nHost: localhost\r\n\r\n`;
const post = (length, more = '') => `POST /v1/models HTTP/1.1\r\nHost: localhost\r\nContent-Length: ${length}\r\n${more}\r\n`;
const lines = '# a line\n'.repeat(300000); // more than what is kept in memory

// What is sent, and how much of the answer is awaited.
const stages = {
  'before a byte': [() => ''],
  'in the request line': [() => 'GET /v1/mo'],
  'in the fields': [() => 'GET /healthz HTTP/1.1\r\nHost: localhost\r\nX-'],
  'before the body': [() => post(100)],
  'waiting to be told to continue': [() => post(100, 'Expect: 100-continue\r\n'), 'HTTP/1.1 100'],
  'in a short body': [() => `${post(1000)}v 0 0 0\n`],
  'in a long body': [() => `${post(lines.length * 2)}${lines}`],
  'in a chunk': [() => 'POST /v1/models HTTP/1.1\r\nHost: localhost\r\nTransfer-Encoding: chunked\r\n\r\nff\r\nv 0'],
  'before a short answer': [() => get('/healthz')],
  'before a surface': [() => get(`${model}/surface.glb?level=8&at=${Math.random()}`)],
  'in a surface': [() => get(`${model}/surface.glb?level=10`), 'glTF'],
  'in poses': [() => get(`${model}/pose.json?from=0&to=1&fps=900000`), '"times"'],
  'in live poses': [() => get(`${model}/live?fps=60`), 'data:'],
  'behind a hundred requests': [() => get(`${model}/surface.json`).repeat(100)],
};

/** One client: speaks, waits until it has read `awaited`, and leaves. */
function leave(text, awaited, isReset) {
  return new Promise((resolve, reject) => {
    const socket = connect(new URL(daemon.url).port, '127.0.0.1');
    let heard = '';
    const go = () => {
      if (isReset) socket.resetAndDestroy();
      else socket.destroy();
      resolve();
    };
    // Says nothing to who has left: the promise is kept by then.
    socket.on('close', () => reject(new Error(`the daemon ended before ${awaited}: ${heard.slice(0, 300)}`)));
    socket.on('error', (error) => (error.code === 'ECONNRESET' || error.code === 'EPIPE' ? resolve() : reject(error)));
    socket.on('data', (bytes) => {
      if (awaited) heard += bytes.toString('latin1');
      if (awaited && heard.includes(awaited)) go();
      if (heard.startsWith('HTTP/1.1 503')) reject(new Error(`refused before ${awaited}: ${heard.slice(0, 300)}`));
    });
    socket.on('connect', () => socket.write(text, () => awaited ?? go()));
    if (text === '') socket.on('connect', go);
  });
}

async function figures() {
  const text = await (await fetch(`${daemon.url}/metrics`, { headers: { Connection: 'close' } })).text();
  const value = (name) => Number(text.match(new RegExp(`^${name} (.*)$`, 'm'))[1]);
  return {
    connections: value('tweend_http_connections'),
    inFlight: value('tweend_http_requests_in_flight'),
    descriptors: readdirSync(`/proc/${daemon.process.pid}/fd`).length,
  };
}

for (const [stage, [text, awaited]] of Object.entries(stages)) {
  for (const isReset of [false, true]) {
    test(`${CLIENTS} clients leave ${stage}${isReset ? ' by a reset' : ''}`, async () => {
      const was = await figures();
      await Promise.all(Array.from({ length: CLIENTS }, () => leave(text(), awaited, isReset)));
      let is;
      for (let waited = 0; waited < 300; waited++) {
        is = await figures();
        if (is.connections <= was.connections && is.inFlight <= 1 && is.descriptors <= was.descriptors) break;
        await pause(100);
      }
      assert.ok(is.connections <= was.connections, `${is.connections} connections, ${was.connections} before`);
      assert.equal(is.inFlight, 1); // that which asks
      assert.ok(is.descriptors <= was.descriptors, `${is.descriptors} descriptors, ${was.descriptors} before`);
      assert.deepEqual(readdirSync(join(daemon.folder, 'data/tmp')), []);
      const { models } = await (await fetch(`${daemon.url}/v1/models`)).json();
      assert.equal(models.length, 1); // nothing half-made is there
    });
  }
}
