// What requests hold and compute at most, whatever they send: resident memory stays under --max-memory and what the
// daemon itself takes.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { request } from 'node:http';
import { connect } from 'node:net';
import { after, test } from 'node:test';
import { setTimeout as pause } from 'node:timers/promises';
import { gzipSync } from 'node:zlib';
import { Daemon, eventually } from '../node/daemon.mjs';

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
  await eventually('frames are printed', 60, async () => (await figure(daemon, 'tweend_live_frames_printed_total')) >= 3 * taken.length);
  const held = await figure(daemon, 'tweend_memory_bytes{kind="live"}');
  assert.ok(held > LIMIT / 4 && held <= LIMIT / 2, `${held} bytes`);
  assert.ok(peak(daemon) < LIMIT + BESIDE, `${peak(daemon)} bytes`);

  // One that shares the frames of another needs no memory; what is left finds room again.
  const joined = await listen(live(streams.indexOf(taken[0])));
  assert.equal(joined.status, 200);
  for (const { end } of [...streams, joined]) end();
  await eventually('the streams end', 60, async () => (await figure(daemon, 'tweend_memory_bytes{kind="live"}')) === 0);
  const again = await listen(live(0));
  assert.equal(again.status, 200);
  again.end();
});

// What short requests asked for once: gigabytes, and minutes of processor time.
const grid = (cells) => JSON.stringify({ meshes: [{ name: 'm', shape: { kind: 'grid', segments: [cells, cells] } }] });
const hole = { edit: 'delete', faces: { inside: { min: [-0.45, -1, -0.45], max: [0.45, 1, 0.45] } } };
const repeat = (count, make) => Array.from({ length: count }, (_, i) => make(i)).flat();
const edits = (...list) => ['/edits', JSON.stringify({ edits: list })];
const spinning = JSON.stringify({
  nodes: [{ name: 'n' }],
  clips: repeat(10, (i) => {
    const track = { node: 'n', path: 'rotation', unit: 'degrees', times: [0, 1], axis_angles: [[0, 0, 1, 0], [0, 0, 1, 1e7]] };
    return [{ name: `c${i}`, tracks: [track] }];
  }),
  meshes: [{ name: 'm', shape: { kind: 'box' } }],
});
const SECONDS = 8; // of processor time for each; those over it took up to 300
const short = {
  'an open border at level 2': [grid(700), '/surface.json?level=2&boundary=open'],
  'an open border at level 7': [grid(24), '/surface.glb?level=7&boundary=open'],
  'coarsening': [grid(700), '/coarsen', ''],
  'an edit of half a million faces': [grid(700), ...edits({ edit: 'extrude', faces: 'all', distance: 1 })],
  'creases edited many times': [grid(200), ...edits({ edit: 'crease', edges: 'all', sharpness: 2 }, ...repeat(100, () => ({ edit: 'crease', edges: [[0, 1]], sharpness: 3 })))],
  'points moved many times': [grid(300), ...edits(...repeat(100, () => ({ edit: 'move', vertices: [0], by: [0, 0, 0.1] })))],
  'a fair patch': [grid(700), ...edits(hole, { edit: 'fill', method: 'fair' })],
  'fills and deletes by turns': [grid(60), ...edits(hole, ...repeat(300, () => [{ edit: 'fill', method: 'triangles', name: 'f' }, { edit: 'delete', faces: { made: 'f' } }]))],
  'turns of ten million degrees': [spinning, '/surface.glb'],
};

test('a deep surface with an open border streams from little memory', async () => {
  const daemon = await startDaemon();
  const model = await daemon.upload(grid(24));
  const { faces, bytes } = await (await fetch(`${model}/surface.json?level=7&boundary=open`)).json();
  // A row of faces is lost at each side, half a row of what is left then, and so on.
  assert.equal(faces, (22 * 128 + 2) ** 2);
  assert.equal(await length(`${model}/surface.glb?level=7&boundary=open`), bytes);
  assert.ok(peak(daemon) < BESIDE, `${peak(daemon)} bytes`);
});

/** A torus of triangles, 16 x 8 squares cut in two, as OBJ. */
function torus() {
  const [columns, rows] = [16, 8];
  const number = (i, j) => 1 + (i % columns) * rows + (j % rows);
  const point = (_, k) => {
    const [a, b] = [(2 * Math.PI * Math.floor(k / rows)) / columns, (2 * Math.PI * (k % rows)) / rows];
    const far = 2 + 0.7 * Math.cos(b);
    return `v ${far * Math.cos(a)} ${far * Math.sin(a)} ${0.7 * Math.sin(b)}\n`;
  };
  const square = (_, k) => {
    const [i, j] = [Math.floor(k / rows), k % rows];
    const [a, b, c, d] = [number(i, j), number(i + 1, j), number(i + 1, j + 1), number(i, j + 1)];
    return `f ${a} ${b} ${c}\nf ${a} ${c} ${d}\n`;
  };
  const list = (make) => Array.from({ length: columns * rows }, make).join('');
  return list(point) + list(square);
}

/** The length of an answer that is read and forgotten. */
async function length(address) {
  const answer = await fetch(address);
  assert.equal(answer.status, 200);
  let bytes = 0;
  for await (const piece of answer.body) bytes += piece.length;
  return bytes;
}

test('a Loop torus and a grid with its border at level 8 stream from little memory', async (t) => {
  const daemon = await startDaemon('--max-memory', '64MiB');
  const deep = { [await daemon.upload(torus())]: 'scheme=loop&level=8', [await daemon.upload(grid(16))]: 'level=8' };
  for (const [model, query] of Object.entries(deep)) {
    const before = peak(daemon);
    assert.ok((await length(`${model}/surface.glb?${query}`)) > 3e8);
    t.diagnostic(`${query}: ${peak(daemon)} bytes, ${before} before`);
    assert.ok(peak(daemon) < BESIDE, `${peak(daemon)} bytes`);
  }
});

/** A field of 120 x 120 squares cut in two, as OBJ: rows are smooth, and hard where they meet. */
function furrows() {
  const cells = 120;
  const points = repeat((cells + 1) ** 2, (k) => [`v ${k % (cells + 1)} ${Math.floor(k / (cells + 1))} ${Math.sin(k)}\n`]);
  const square = (a, b, c, d) => [`f ${a} ${b} ${c}\nf ${a} ${c} ${d}\n`];
  const row = (j) => [`s ${1 + (j % 2)}\n`, ...repeat(cells, (i) => square(...[[0, 0], [1, 0], [1, 1], [0, 1]].map(([x, y]) => 1 + (j + y) * (cells + 1) + i + x)))];
  return [...points, ...repeat(cells, row)].join('');
}

test('a surface with hard edges all over takes less memory than its bytes', async (t) => {
  const daemon = await startDaemon();
  const model = await daemon.upload(furrows());
  const bytes = await length(`${model}/surface.glb?level=4&quads=off`);
  t.diagnostic(`${peak(daemon)} bytes for ${bytes}`);
  assert.ok(bytes > 2e8);
  assert.ok(peak(daemon) < bytes / 2, `${peak(daemon)} bytes`);
});

/** A glTF of a grid of cells x cells squares, two triangles each, with that many morph targets. */
function morphing(targets, cells) {
  const count = (cells + 1) ** 2;
  const points = Float32Array.from({ length: 3 * (count + targets) }, (_, i) => [Math.floor(i / 3) % (cells + 1), Math.floor(i / 3 / (cells + 1)), Math.sin(i)][i % 3]);
  const corner = (k, [x, y]) => (Math.floor(k / cells) + y) * (cells + 1) + (k % cells) + x;
  const indices = Uint32Array.from(repeat(cells * cells, (k) => [[0, 0], [1, 0], [1, 1], [0, 0], [1, 1], [0, 1]].map((step) => corner(k, step))));
  const uri = `data:application/octet-stream;base64,${Buffer.concat([points, indices].map(({ buffer }) => Buffer.from(buffer))).toString('base64')}`;
  const floats = (first, more) => ({ bufferView: 0, byteOffset: 12 * first, componentType: 5126, count, type: 'VEC3', ...more });
  return JSON.stringify({
    asset: { version: '2.0' }, scenes: [{ nodes: [0] }], nodes: [{ mesh: 0 }],
    meshes: [{ primitives: [{ attributes: { POSITION: 0 }, indices: 1, targets: repeat(targets, (i) => [{ POSITION: 2 + i }]) }] }],
    buffers: [{ uri, byteLength: points.byteLength + indices.byteLength }],
    bufferViews: [{ buffer: 0, byteLength: points.byteLength }, { buffer: 0, byteOffset: points.byteLength, byteLength: indices.byteLength }],
    accessors: [floats(0, { min: [0, 0, -1], max: [cells, cells, 1] }), { bufferView: 1, componentType: 5125, count: indices.length, type: 'SCALAR' },
      ...repeat(targets, (i) => [floats(1 + i)])],
  });
}

test('many morph targets take memory and processor time in proportion to their bytes', async (t) => {
  const daemon = await startDaemon();
  const model = await daemon.upload(morphing(82, 40));
  const bytes = await length(`${model}/surface.glb?level=2`);
  t.diagnostic(`${peak(daemon)} bytes and ${processor(daemon)} s for ${bytes}`);
  assert.ok(peak(daemon) < BESIDE + bytes, `${peak(daemon)} bytes`);
  assert.ok(processor(daemon) < (0.1 * bytes) / MIB, `${processor(daemon)} s`);
});

/** Processor time that it has used, in seconds. */
function processor(daemon) {
  const [, fields] = readFileSync(`/proc/${daemon.process.pid}/stat`, 'utf8').split(') ');
  return fields.split(' ').slice(11, 13).reduce((sum, ticks) => sum + Number(ticks), 0) / 100;
}

for (const [name, [document, tail, body]] of Object.entries(short))
  test(`${name}: memory and processor time are bounded`, async (t) => {
    const daemon = await startDaemon('--max-memory', '256MiB');
    const model = await daemon.upload(document).catch((error) => error);
    if (!(model instanceof Error)) {
      const post = { method: 'POST', headers: { 'Content-Type': 'application/json' }, body };
      const answer = await fetch(model + tail, body === undefined ? {} : post);
      await answer.arrayBuffer().catch(() => undefined);
      assert.ok([200, 201, 422, 503].includes(answer.status), `${answer.status}`);
      t.diagnostic(`${answer.status}, ${peak(daemon)} bytes, ${processor(daemon)} s`);
    }
    assert.ok(peak(daemon) < 2 * LIMIT + BESIDE, `${peak(daemon)} bytes`);
    assert.ok(processor(daemon) < SECONDS, `${processor(daemon)} s`);
  });

// Bodies of which nothing large is kept: what is read of them, unpacked and mapped is held to the limit as well.
const filler = (mib) => 'A'.repeat(mib * MIB);
const blanks = (mib) => Buffer.alloc(mib * MIB, ' ');
const padded = (mib) => Buffer.concat([Buffer.from('{'), blanks(mib), Buffer.from('}')]);
const form = (...files) =>
  Buffer.concat([
    ...files.flatMap(([name, bytes]) => [`--x\r\nContent-Disposition: form-data; name="f"; filename="${name}"\r\n\r\n`, bytes, '\r\n']).map((part) => Buffer.from(part)),
    Buffer.from('--x--\r\n'),
  ]);
const bulky = {
  'a long name in tweend JSON': [() => `{"meshes":[{"name":"${filler(100)}"}]}`, 422],
  'a long name in glTF': [() => `{"asset":{"version":"2.0"},"nodes":[{"name":"${filler(60)}"}]}`, 422, { 'Content-Type': 'model/gltf+json' }],
  'long extras in glTF': [() => `{"asset":{"version":"2.0"},"extras":"${filler(60)}"}`, 422, { 'Content-Type': 'model/gltf+json' }],
  'blanks in tweend JSON': [() => padded(136), 422],
  'blanks that fit': [() => padded(50), 201],
  'blanks in gzip': [() => gzipSync(padded(136)), 422, { 'Content-Encoding': 'gzip' }],
  'a glTF and a file of its own': [
    () => form(['a.gltf', `{"asset":{"version":"2.0"},"buffers":[{"uri":"b.bin","byteLength":${40 * MIB}}]}`], ['b.bin', blanks(40)]),
    422,
    { 'Content-Type': 'multipart/form-data; boundary=x' },
  ],
};
for (const [name, [body, status, headers]] of Object.entries(bulky))
  test(`${name}: resident memory stays under the limit`, async (t) => {
    const daemon = await startDaemon('--max-memory', '64MiB');
    const answer = await fetch(`${daemon.url}/v1/models`, { method: 'POST', headers: { 'Content-Type': 'application/json', ...headers }, body: body() });
    const { detail } = await answer.json();
    t.diagnostic(`${answer.status} ${detail}, ${peak(daemon)} bytes`);
    assert.equal(answer.status, status);
    assert.ok(peak(daemon) < 64 * MIB + BESIDE, `${peak(daemon)} bytes`);
  });

test('bodies that arrive slowly hold a part of the limit, and are answered when they are there', async (t) => {
  const daemon = await startDaemon('--max-memory', '64MiB', '--min-rate', '0', '--queue', '100');
  const { hostname, port } = new URL(daemon.url);
  const body = `{"rotations":[{"quaternion":[0,0,0,1]}]${' '.repeat(900000)}}`;
  const head = `POST /v1/rotations HTTP/1.1\r\nHost: ${hostname}\r\nContent-Type: application/json\r\nContent-Length: ${body.length}\r\n\r\n`;
  const sockets = repeat(80, () => connect(Number(port), hostname));
  const answers = sockets.map((socket) => new Promise((resolve) => socket.on('error', resolve).once('data', (data) => resolve(data.toString('latin1', 0, 12)))));
  for (const socket of sockets) await new Promise((resolve) => socket.write(head + body.slice(0, -1), resolve));
  for (let tries = 0; tries < 500 && (await figure(daemon, 'tweend_spool_bytes')) < 50e6; tries++) await pause(20);
  t.diagnostic(`${peak(daemon)} bytes`);
  assert.ok((await figure(daemon, 'tweend_memory_bytes{kind="body"}')) < 16 * MIB);
  for (const socket of sockets) socket.write('}');
  assert.deepEqual([...new Set(await Promise.all(answers))], ['HTTP/1.1 200']);
  for (const socket of sockets) socket.destroy();
  assert.ok(peak(daemon) < 64 * MIB + BESIDE, `${peak(daemon)} bytes`);
});

// Processor time that a request takes after its client has left: the loops of readers, welding and edits look.
const long = (() => {
  const points = repeat(600000, (i) => [`v ${(i * 7919) % 10007} ${(i * 104729) % 9973} ${i % 7}\n`]).join('');
  const faces = repeat(200000, (i) => [`f ${3 * i + 1} ${3 * i + 2} ${3 * i + 3}\n`]).join('');
  return { obj: points + faces, grid: grid(700) };
})();

/** A GLB of that many triangles, whose points are anywhere and shared. */
function soup(triangles, isSparse = false) {
  const points = Float32Array.from({ length: triangles * 3 }, (_, i) => ((i * 7919) % 1000003) / 1000);
  const indices = Uint32Array.from({ length: triangles * 3 }, (_, i) => (i * 104729) % triangles);
  const all = Uint32Array.from({ length: isSparse ? triangles : 1 }, (_, i) => i);
  const json = JSON.stringify({
    asset: { version: '2.0' }, scenes: [{ nodes: [0] }], nodes: [{ mesh: 0 }],
    meshes: [{ primitives: [{ attributes: { POSITION: 0, NORMAL: 0 }, indices: 1, targets: [{ POSITION: 0 }, { POSITION: 0 }] }] }],
    buffers: [{ byteLength: points.byteLength + indices.byteLength + all.byteLength }],
    bufferViews: [{ buffer: 0, byteLength: points.byteLength }, { buffer: 0, byteOffset: points.byteLength, byteLength: indices.byteLength },
      { buffer: 0, byteOffset: points.byteLength + indices.byteLength, byteLength: all.byteLength }],
    accessors: [{ bufferView: 0, componentType: 5126, count: triangles, type: 'VEC3', min: [0, 0, 0], max: [1001, 1001, 1001],
      sparse: isSparse ? { count: triangles, indices: { bufferView: 2, componentType: 5125 }, values: { bufferView: 0 } } : undefined },
      { bufferView: 1, componentType: 5125, count: 3 * triangles, type: 'SCALAR' }],
  }).padEnd(1024);
  const head = Buffer.alloc(20), bin = Buffer.alloc(8), data = Buffer.concat([points, indices, all].map(({ buffer }) => Buffer.from(buffer)));
  head.write('glTF');
  [2, 28 + json.length + data.length, json.length].forEach((value, i) => head.writeUInt32LE(value, 4 + 4 * i));
  head.write('JSON', 16);
  bin.writeUInt32LE(data.length, 0);
  bin.write('BIN\0', 4);
  return Buffer.concat([head, Buffer.from(json), bin, data]);
}
const left = {
  'welding points that are near each other': ['/v1/surface.glb?weld=0.001&level=0', () => long.obj],
  'reading a GLB of four million triangles': ['/v1/surface.glb?level=0&quads=ngon', () => soup(4e6)],
  'reading sparse accessors of two million elements': ['/v1/surface.glb?level=0&quads=ngon', () => soup(2e6, true)],
  'reading a glTF that is mostly blanks': ['/v1/surface.glb', () => `{"asset":${' '.repeat(1e8)}{"version":"2.0"}${'[ '.repeat(50)}${']'.repeat(50)}}`.replace('}[', '},"extras":[')],
  'reading a glTF of many extras': ['/v1/surface.glb', () => `{"asset":{"version":"2.0"},"extras":[${'{"a":[1,{}]},'.repeat(4e6)}0]}`],
  'smoothing': ['/edits', () => JSON.stringify({ edits: [{ edit: 'smooth', vertices: 'all', iterations: 100 }] })],
  'pairing triangles': ['/edits', () => JSON.stringify({ edits: [{ edit: 'triangulate', faces: 'all' }, { edit: 'quads', faces: 'all' }] })],
};
for (const [name, [path, body]] of Object.entries(left))
  test(`${name} ends when the client has left`, async (t) => {
    const daemon = await startDaemon('--compute-timeout', '300s');
    const address = path.startsWith('/v1') ? daemon.url + path : (await daemon.upload(long.grid)) + path;
    const begun = processor(daemon);
    let answered, failed;
    const asked = request(address, { method: 'POST', agent: false, headers: { 'Content-Type': 'application/octet-stream' } }, (answer) => {
      answered = answer.statusCode;
      answer.on('error', () => {}).resume();
    });
    asked.on('error', (error) => { failed ??= error; }).end(body());
    await eventually('the request takes processor time', 120, () => processor(daemon) >= begun + 0.3 || answered !== undefined || failed);
    assert.equal(failed, undefined, 'the client was still there');
    asked.destroy();
    const leaving = processor(daemon);
    // It has ended when no request is in flight but the one that asks.
    await eventually('the request ends', 120, async () => (await figure(daemon, 'tweend_http_requests_in_flight')) === 1);
    const behind = processor(daemon) - leaving;
    t.diagnostic(`${leaving - begun} s before, ${behind} s after`);
    assert.ok(behind < 1, `${behind} s of processor after the client had left`);
  });
