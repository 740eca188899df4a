// The client module in node, against the daemon with keys.
import assert from 'node:assert/strict';
import { File } from 'node:buffer'; // a global from Node 20 on
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { createServer } from 'node:http';
import { tmpdir } from 'node:os';
import { dirname, join } from 'node:path';
import { Readable } from 'node:stream';
import { after, before, test } from 'node:test';
import { setTimeout as pause } from 'node:timers/promises';
import { runInNewContext } from 'node:vm';

import { biped } from '../node/biped.mjs';
import { Daemon, root } from '../node/daemon.mjs';
import { Player, PoseTable, Tweend, TweendError } from '../../api/client/tweend.js';

const daemon = new Daemon(['--api-keys', 'sesame', '--url-keys', 'seal']);
const tankFile = readFileSync(join(root, 'server/samples/tank.json'));
let tweend, tank;

before(async () => {
  await daemon.start();
  tweend = new Tweend(daemon.url, { key: 'sesame' });
  tank = await tweend.upload(tankFile, { name: 'tank' });
});
after(() => daemon.remove());

const object = () => ({ position: { x: 0, y: 0, z: 0 }, quaternion: { x: 0, y: 0, z: 0, w: 1 }, scale: { x: 1, y: 1, z: 1 } });
const turn = ({ quaternion: { x, y, z, w } }) => [x, y, z, w];

function assertNear(actual, expected, tolerance, message) {
  assert.equal(actual.length, expected.length);
  expected.forEach((value, i) => assert.ok(Math.abs(actual[i] - value) <= tolerance, `${message ?? ''} ${actual} is not ${expected}`));
}

/** A table of one node's rotations at whole seconds. */
function tableOf(rotations) {
  const times = rotations.map((_, i) => i);
  const rows = Float32Array.from(rotations.flatMap((q, i) => [...q, i, 2 * i, 3 * i, 1, 1, 1 + i]));
  const header = { as: 'trs', duration: rotations.length - 1, nodes: ['a'], times, poses: rotations.length, stride: 10, node_stride: 10 };
  return new PoseTable(header, rows);
}

/** The answer that is a pose of such nodes in binary. */
function poseAnswer(nodes) {
  const header = { as: 'trs', duration: 0, nodes, times: [0], poses: 1, stride: 10 * nodes.length, node_stride: 10 };
  const json = JSON.stringify(header);
  const bytes = Buffer.concat([Buffer.from('TWPB\x01\0\0\0\0\0\0\0', 'latin1'), Buffer.from(json), Buffer.alloc(40 * nodes.length)]);
  bytes.writeUInt32LE(json.length, 8);
  return new Response(bytes);
}

// ---- requests ----

test('a problem document is thrown as an error with its places', async () => {
  const bad = JSON.stringify({ meshes: [{ positions: [[0, 0, 0]], faces: [[0, 1, 7]] }] });
  await assert.rejects(tweend.upload(bad), (error) => {
    assert.ok(error instanceof TweendError && error instanceof Error);
    assert.equal(error.status, 422);
    assert.match(error.errors[0].pointer, /^\/meshes\/0\/faces\/0/);
    assert.ok(error.message.includes(error.errors[0].pointer) && error.detail === error.message);
    assert.equal(error.requestId, error.problem.instance);
    assert.ok(error.title);
    return true;
  });
  await assert.rejects(tweend.upload('v 0 0 0\nv 1 x 0\n'), { name: 'TweendError', status: 400, line: 2 });
  await assert.rejects(tweend.describe('0'.repeat(32)), { status: 404 });
  await assert.rejects(tweend.surfaceCounts(tank, { level: 11 }), { status: 422, line: undefined, errors: [] });
});

test('a page learns why a daemon on a loopback address refuses it', async () => {
  const plain = new Daemon();
  await plain.start();
  try {
    const from = (more) => new Tweend(plain.url, {
      fetch: (url, { headers, ...rest }) => fetch(url, { ...rest, headers: { ...Object.fromEntries(new Headers(headers)), ...more } }),
    });
    await assert.rejects(from({ Origin: 'https://far.example' }).upload(tankFile), {
      name: 'TweendError', status: 403, message: /--cors-origins/,
    });
    assert.ok((await from({ Origin: 'http://localhost:5173' }).upload(tankFile)).id);
  } finally {
    await plain.remove();
  }
});

test('what a proxy answers is an error too', async () => {
  const headers = { 'Retry-After': '7', 'X-Request-Id': 'abc' };
  const fetch = async () => new Response('<h1>no</h1>', { status: 502, statusText: 'Bad Gateway', headers });
  await assert.rejects(new Tweend('http://a.example', { fetch, retries: 0 }).describe('x'), {
    message: '502 Bad Gateway',
    status: 502,
    retryAfter: 7,
    requestId: 'abc',
    errors: [],
  });
});

test('who guesses the daemon where there is none is told', async () => {
  assert.throws(() => new Tweend(), { name: 'TypeError', message: /give the daemon's URL/ }); // loaded from a file
  let status;
  const server = createServer((_, response) => response.writeHead(status, { 'Content-Type': 'text/html; charset=utf-8' }).end('<title>a page'));
  await new Promise((resolve) => server.listen(0, '127.0.0.1', resolve));
  const wrong = new Tweend(`http://127.0.0.1:${server.address().port}`);
  for (status of [200, 404, 405]) {
    for (const ask of [() => wrong.describe('x'), () => wrong.surface('x'), () => wrong.upload(tankFile), () => wrong.list().next()])
      await assert.rejects(ask(), { name: 'TypeError', message: `${wrong.base} is no tweend daemon: it answers with a web page. Give the daemon's URL, as in new Tweend('http://127.0.0.1:8080')` });
  }
  server.close();
  assert.ok((await tweend.request('docs')).ok, 'pages of the daemon are no mistake');
});

// ---- retries ----

/** A client of a daemon that gives these answers, each a status with a Retry-After, and then 200; `asked` holds the requests. */
function putOff(answers, options) {
  const asked = [];
  const fetch = async (url, { method = 'GET', body }) => {
    const [status, after] = answers[asked.length] ?? [200];
    asked.push([method, body instanceof ReadableStream ? await new Response(body).text() : body]);
    const headers = after === undefined ? {} : { 'Retry-After': after };
    return status === 200 ? Response.json({ id: 'x' }) : new Response('{"detail":"full"}', { status, headers });
  };
  return { asked, client: new Tweend('http://a.example', { fetch, ...options }) };
}

test('a request that is put off is sent again, whatever it does', async () => {
  const past = new Date(Date.now() - 5000).toUTCString();
  const { asked, client } = putOff([[503, '0'], [429, past], [503, '0']]);
  const [told, waits] = [[], []];
  assert.equal((await client.upload('v 0 0 0', { onProgress: (sent) => told.push(sent), onWait: (seconds, { status, detail }) => waits.push([seconds, status, detail]) })).id, 'x');
  assert.deepEqual(asked, Array(4).fill(['POST', 'v 0 0 0']));
  assert.deepEqual([told, waits], [[7, 7, 7, 7], [[0, 503, 'full'], [0, 429, 'full'], [0, 503, 'full']]]);

  const soon = putOff([[503, new Date(Date.now() + 2500).toUTCString()]]);
  const began = performance.now();
  await soon.client.remove('x');
  assert.ok(performance.now() - began > 1000);
  assert.equal(soon.asked.length, 2);

  const unsaid = putOff([[502], [504]]); // by a proxy that starts
  assert.ok(await unsaid.client.describe('x'));
  assert.equal(unsaid.asked.length, 3);
});

test('what may have been done is not sent again, nor what cannot be; and patience has an end', async () => {
  const count = async (answers, ask, options) => {
    const { asked, client } = putOff(answers, options);
    await assert.rejects(ask(client), { name: 'TweendError', status: answers[0][0] });
    return asked.length;
  };
  const always = (...answer) => Array(20).fill(answer);
  assert.equal(await count(always(502, '0'), (client) => client.remove('x')), 1);
  assert.equal(await count(always(504, '0'), (client) => client.upload('v 0 0 0')), 1);
  assert.equal(await count(always(500, '0'), (client) => client.describe('x')), 1);
  assert.equal(await count(always(503, '0'), (client) => client.describe('x')), 4);
  assert.equal(await count(always(503, '0'), (client) => client.describe('x', { retries: 1 })), 2);
  assert.equal(await count(always(503, '0'), (client) => client.upload('v', { retries: 0 })), 1);
  assert.equal(await count(always(503, '0'), (client) => client.describe('x'), { retries: 0 }), 1);
  assert.equal(await count(always(503, '31'), (client) => client.describe('x')), 1);
  assert.equal(await count(always(503, '0'), (client) => client.request('https://b.example/v1/models')), 1);
  const body = () => new Blob(['v']).stream();
  assert.equal(await count(always(503, '0'), (client) => client.request('v1/models', { method: 'POST', body: body(), duplex: 'half' })), 1);
});

test('who waits for a retry may leave', async () => {
  const { asked, client } = putOff([[503, '20']]);
  const controller = new AbortController();
  const began = performance.now();
  setTimeout(() => controller.abort(new Error('enough')), 100);
  await assert.rejects(client.describe('x', { signal: controller.signal }), { message: 'enough' });
  assert.ok(performance.now() - began < 5000);
  assert.equal(asked.length, 1);
});

test('a client over its rate waits for the daemon', async () => {
  const keys = join(mkdtempSync(join(tmpdir(), 'tweend-keys-')), 'keys');
  writeFileSync(keys, 'snail read,write 2/s\n');
  const slow = new Daemon(['--api-keys', `@${keys}`]);
  await slow.start();
  try {
    const client = new Tweend(slow.url, { key: 'snail' });
    const { id } = await client.upload(tankFile);
    const all = await Promise.all(Array.from({ length: 5 }, () => client.describe(id)));
    assert.ok(all.every((model) => model.id === id));
    await assert.rejects(Promise.all(Array.from({ length: 9 }, () => client.describe(id, { retries: 0 }))), { status: 429 });
  } finally {
    await slow.remove();
    rmSync(dirname(keys), { recursive: true });
  }
});

// ---- models ----

test('an upload tells its progress, and is refused or called off on its way', async () => {
  const text = `${' '.repeat(3 << 20)}\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n`;
  const sources = [text, new TextEncoder().encode(text), new Blob([text]), [new File([text], 'a.obj')]];
  const ids = new Set();
  for (const source of sources) {
    const told = [];
    ids.add((await tweend.upload(source, { onProgress: (...of) => told.push(of) })).id);
    assert.ok(told.length > 10);
    told.slice(1).forEach(([sent], i) => assert.ok(sent > told[i][0]));
    assert.equal(...told.at(-1));
    assert.ok(told.at(-1)[1] >= text.length);
  }
  assert.equal(ids.size, 1);
  await tweend.remove([...ids][0]);
  const controller = new AbortController();
  const signal = controller.signal;
  await assert.rejects(tweend.upload(text, { signal, onProgress: () => controller.abort(new Error('enough')) }), { message: 'enough' });
  const small = new Daemon(['--max-upload', '1MiB']);
  await small.start();
  try {
    await assert.rejects(new Tweend(small.url).upload(text, { onProgress() {} }), { name: 'TweendError', status: 413 });
  } finally {
    await small.remove();
  }
});

test('the key goes to the daemon alone, and below a prefix all goes there', async () => {
  const seen = [];
  const fetch = async (url, { headers }) => {
    seen.push([url, headers.Authorization]);
    return Response.json({ url: '/v1/models/x/live?fps=3&exp=1&sig=2' });
  };
  const behind = new Tweend('https://a.example/apps/tweend?x#y', { key: 'k', fetch });
  assert.equal(behind.base, 'https://a.example/apps/tweend/');
  await behind.describe('x');
  await behind.request('https://b.example/v1/models');
  assert.deepEqual(seen, [
    ['https://a.example/apps/tweend/v1/models/x', 'Bearer k'],
    ['https://b.example/v1/models', undefined],
  ]);
  assert.equal(await behind.sign(behind.liveUrl('x', { fps: 3 })), 'https://a.example/apps/tweend/v1/models/x/live?fps=3&exp=1&sig=2');
  const open = new Tweend('https://a.example', { fetch });
  assert.equal(await open.sign(open.sourceUrl('x')), 'https://a.example/v1/models/x/source');
  assert.equal(seen.length, 3);
});

test('a model goes up, is listed, and goes away', async () => {
  const told = [];
  const cube = await tweend.upload(readFileSync(join(root, 'server/samples/cube.obj'), 'utf8'), { name: 'a cube, ½', onProgress: (...of) => told.push(of) });
  assert.equal(cube.name, 'a cube, ½');
  assert.deepEqual(told.at(-1), [cube.bytes, cube.bytes]);
  assert.deepEqual(await tweend.describe(cube), await tweend.describe(cube.id));
  const ids = [];
  for await (const { id } of tweend.list({ limit: 1 })) ids.push(id);
  assert.deepEqual(ids, [cube.id, tank.id].sort());
  assert.equal(await (await tweend.request(tweend.sourceUrl(tank))).text(), String(tankFile));
  await tweend.remove(cube);
  await assert.rejects(tweend.remove(cube), { status: 404 });
});

test('a file brings its name, a glTF its other files', async () => {
  const positions = Float32Array.from([0, 0, 0, 1, 0, 0, 0, 1, 0]);
  const gltf = {
    asset: { version: '2.0' },
    buffers: [{ uri: 'points.bin', byteLength: 36 }],
    bufferViews: [{ buffer: 0, byteLength: 36 }],
    accessors: [{ bufferView: 0, componentType: 5126, count: 3, type: 'VEC3', min: [0, 0, 0], max: [1, 1, 0] }],
    meshes: [{ primitives: [{ attributes: { POSITION: 0 } }] }],
    nodes: [{ mesh: 0 }],
  };
  const file = new File([JSON.stringify(gltf)], 'corner.gltf');
  const model = await tweend.upload([file, new File([positions], 'points.bin')]);
  assert.deepEqual([model.name, model.format, model.meshes[0].faces], ['corner.gltf', 'glb', 1]);
  const obj = await tweend.upload(new File(['v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n'], 'one.obj', { type: 'application/x-tgif' }));
  assert.deepEqual([obj.name, obj.format], ['one.obj', 'obj']);
  await assert.rejects(tweend.upload('{}', { type: 'image/png' }), { status: 415 });
  await tweend.remove(model);
  await tweend.remove(obj);
});

test('a request that is called off ends with the reason', async () => {
  const signal = AbortSignal.abort(new Error('never mind'));
  for (const asked of [tweend.upload('{}', { signal }), tweend.describe(tank, { signal }), tweend.poseTable(tank, {}, { signal })])
    await assert.rejects(asked, { message: 'never mind' });
});

// ---- surfaces ----

test('options make the query', async () => {
  const url = tweend.surfaceUrl(tank, { level: 2, limit: true, at: [0, 0.5], clip: 'a&b é', fps: undefined }, 'obj');
  assert.equal(url, `${daemon.url}/v1/models/${tank.id}/surface.obj?level=2&limit=true&at=0,0.5&clip=a%26b%20%C3%A9`);
  assert.equal(tweend.surfaceUrl('x'), `${daemon.url}/v1/models/x/surface.glb`);
  assert.equal(tweend.poseUrl('x', { at: Float32Array.of(0.5, 1) }, 'csv'), `${daemon.url}/v1/models/x/pose.csv?at=0.5,1`);
  const counts = await tweend.surfaceCounts(tank, { level: 2 });
  const answer = await tweend.surface(tank, { level: 2 });
  assert.equal(answer.headers.get('Content-Type'), 'model/gltf-binary');
  assert.equal((await answer.arrayBuffer()).byteLength, counts.bytes);
});

test('a signed URL needs no key', async () => {
  const url = tweend.surfaceUrl(tank, { level: 0 }, 'json');
  assert.equal((await fetch(url)).status, 401);
  const signed = await tweend.sign(url, 60);
  assert.deepEqual(await (await fetch(signed)).json(), await tweend.surfaceCounts(tank, { level: 0 }));
});

// ---- poses ----

test('binary poses are those of JSON', async () => {
  const options = { clip: 'drive', from: 0, fps: 30 };
  const json = await tweend.pose(tank, options);
  const table = await tweend.poseTable(tank, options);
  assert.deepEqual(table.header.nodes, json.nodes);
  assert.deepEqual(table.header.times, json.times);
  assert.equal(table.rows.length, json.times.length * table.header.stride);
  json.poses.forEach((pose, i) => {
    assert.equal(table.row(i).buffer, table.rows.buffer); // a view
    for (const part of ['rotation', 'translation', 'scale'])
      pose[part].forEach((value, node) => assertNear(table.part(i, node, part), value.map(Math.fround), 0));
  });
  assert.deepEqual(table.part(3, 'turret', 'rotation'), table.part(3, json.nodes.indexOf('turret'), 'rotation'));
});

test('rows come as they arrive', async () => {
  const options = { from: 0, to: 4, fps: 5000, nodes: ['hull', 'turret'] };
  const whole = await tweend.poseTable(tank, options);
  const stream = await tweend.poseStream(tank, options);
  let row = 0;
  for await (const values of stream) assert.deepEqual(values, whole.row(row++));
  assert.equal(row, 20001);
});

test('rows do not wait for those after them, and breaking off cancels', async () => {
  const header = new TextEncoder().encode('{"poses":3,"stride":2}  ');
  const bytes = new Uint8Array(12 + header.length + 24);
  bytes.set(new TextEncoder().encode('TWPB\x01\0\0\0'));
  new DataView(bytes.buffer).setUint32(8, header.length, true);
  bytes.set(header, 12);
  bytes.set(new Uint8Array(Float32Array.of(1, 2, 3, 4, 5, 6).buffer), 12 + header.length);
  let cancelled = false;
  const answer = (upTo) => {
    let sent = 0; // three bytes at a time, and then nothing more
    return new ReadableStream({
      pull: (out) => {
        if (sent < upTo) out.enqueue(bytes.slice(sent, (sent += 3)));
        else return upTo < bytes.length ? out.close() : new Promise(() => {});
      },
      cancel: () => (cancelled = true),
    });
  };
  const ask = (upTo) => new Tweend('http://a.example', { fetch: async () => new Response(answer(upTo)) }).poseStream('x');
  const rows = [];
  for await (const row of await ask(bytes.length)) {
    rows.push([...row]);
    if (rows.length === 3) break;
  }
  assert.deepEqual(rows, [[1, 2], [3, 4], [5, 6]]);
  assert.ok(cancelled);
  const cut = await ask(bytes.length - 9);
  await assert.rejects(cut.table(), TypeError);
  await assert.rejects(ask(9), TypeError);
  bytes[0]++;
  await assert.rejects(ask(bytes.length), /pose.bin/);
});

test('a level that is sculpted has its points, and comes back as a cage', async () => {
  const box = await tweend.upload('{"meshes": [{"name": "a", "shape": {"kind": "box"}}]}');
  const points = await tweend.points(box, { level: 2 });
  assert.equal(points.length, 3 * 98);
  points[4] += 0.25;
  const made = await tweend.sculpt(box, points, { level: 2, mesh: 'a' });
  assert.deepEqual(made.meshes[0].details, [2]);
  assert.notDeepEqual(await tweend.points(made, { level: 3 }), await tweend.points(box, { level: 3 }));
  assert.deepEqual(await tweend.points(made, { level: 2, details: false }), await tweend.points(box, { level: 2 }));
  const now = await tweend.points(made, { level: 2 });
  assert.ok(now.every((x, i) => Math.abs(x - points[i]) < 1e-6));
  const refined = await tweend.upload(new Blob([await (await tweend.surface(made, { level: 2 }, 'obj')).text()]));
  const cage = await tweend.coarsen(refined, { levels: 'max' });
  assert.deepEqual([cage.levels, cage.meshes[0].faces, cage.meshes[0].details], [2, 6, [2]]);
  await assert.rejects(tweend.sculpt(box, points.subarray(3), { level: 2 }), { status: 422, message: /97 points/ });
  await assert.rejects(tweend.coarsen(box), { status: 422, message: /no refinement/ });
  for (const model of [box, made, refined, cage]) await tweend.remove(model);
});

test('points that moved are sent alone, in the space of a mesh that a node moves; all levels are counted at once', async () => {
  const pair = await tweend.upload(JSON.stringify({
    meshes: [{ name: 'a', shape: { kind: 'box' } }, { name: 'b', shape: { kind: 'box' } }],
    nodes: [{ mesh: 'a', translation: [9, 0, 0] }, { mesh: 'b' }],
  }));
  const points = await tweend.points(pair, { level: 1, mesh: 'a' });
  points[7] += 0.5;
  const made = await tweend.sculpt(pair, { indices: [2], positions: points.subarray(6, 9) }, { level: 1, mesh: 'a' });
  assert.equal((await tweend.sculpt(pair, points, { level: 1, mesh: 'a' })).id, made.id);
  const now = await tweend.points(made, { level: 1, mesh: 'a' });
  assert.ok(now.every((x, i) => Math.abs(x - points[i]) < 1e-6));
  const rows = await tweend.points(pair, { level: 1, mesh: 'a', with: 'normals' });
  assert.equal(rows.length, 2 * points.length);
  await assert.rejects(tweend.points(pair, { level: 1 }), { status: 422, message: /name one of them/ });
  const levels = await tweend.levels(pair);
  const { level, vertices, edges, faces, bytes } = await tweend.surfaceCounts(pair, { level: 3 });
  const { error, ...counts } = levels[3];
  assert.deepEqual(counts, { level, vertices, edges, faces, bytes });
  assert.ok(error > 0 && error < levels[2].error);
  for (const model of [pair, made]) await tweend.remove(model);
});

test('edits make a model, of one mesh by its name', async () => {
  const box = await tweend.upload('{"meshes": [{"name": "a", "shape": {"kind": "box"}}, {"name": "b", "shape": {"kind": "grid"}}]}');
  const made = await tweend.edit(box, [{ edit: 'extrude', faces: [0], distance: 1, name: 'top' }], { mesh: 'a', name: 'tower', quads: 'auto' });
  assert.equal(made.name, 'tower');
  assert.notEqual(made.id, box.id);
  assert.deepEqual(made.meshes.map(({ faces }) => faces), [10, 1]);
  assert.deepEqual(made.made.top.faces, [0]);
  await assert.rejects(tweend.edit(box, []), { status: 422, message: /2 meshes/ });
  await assert.rejects(tweend.edit(made, [], { mesh: 'a', signal: AbortSignal.abort() }), { name: 'AbortError' });
  await tweend.remove(made);
  await tweend.remove(box);
});

test('more times than a URL holds go in a body', async () => {
  const at = Array.from({ length: 3000 }, (_, i) => Math.fround(i / 777));
  const table = await tweend.poseTable(tank, { clip: 'drive', nodes: 'turret', at });
  assert.deepEqual(table.header.times, (await tweend.pose(tank, { clip: 'drive', nodes: 'turret', at })).times);
  assert.equal(table.header.times.length, 3000);
  assert.deepEqual(table.header.times.map(Math.fround), at);
});

test('a file that is not stored has a surface', async () => {
  const stored = await (await tweend.surface(tank, { level: 1 })).arrayBuffer();
  assert.deepEqual(await (await tweend.surfaceOf(tankFile, { level: 1 })).arrayBuffer(), stored);
  assert.equal((await (await tweend.surfaceOf(new Blob([tankFile]), {}, 'json')).json()).level, 1);
  await assert.rejects(tweend.surfaceOf('v 0 0 0\nv 1 x 0\n'), { status: 400, line: 2 });
  await assert.rejects(tweend.surfaceOf({}), TypeError);
});

test('clips are mixed for a model, of its own and of others', async () => {
  const hero = await tweend.upload(biped({ names: 'mixamo', clip: { seed: 2 } }));
  const lender = await tweend.upload(biped({ names: 'unreal', clip: { seed: 4 } }));
  const poseOf = async (clip, options) => (await tweend.pose(hero, { clip, at: [0, 0.7, 1.5], ...options })).poses;
  const own = await tweend.mix(hero, [{ clip: 'moves' }]);
  assert.match(own, /^[0-9a-f]{32}\/mix$/);
  assert.deepEqual(await poseOf(own), await poseOf('moves'));
  const other = `${lender.id}/moves`;
  const carried = await tweend.mix(hero, [{ clip: other, retarget: 'auto' }], { name: 'as another' });
  const expected = await poseOf(other, { retarget: 'auto' });
  (await poseOf(carried)).forEach(({ rotation }, i) => rotation.forEach((value, node) => assertNear(value, expected[i].rotation[node], 1e-5)));
  const both = await tweend.mix(hero, [{ clip: 'moves', weight: 0.5 }, { clip: other, retarget: 'auto', weight: { times: [0, 1.5], values: [0, 1] } }]);
  assert.deepEqual((await poseOf(both))[0], (await poseOf('moves'))[0]);
  assert.notDeepEqual((await poseOf(both))[2], (await poseOf('moves'))[2]);
  const player = await tweend.play(hero, [], { clip: both });
  assert.equal(player.duration, 2);
  await assert.rejects(tweend.mix(hero, [{ clip: `${lender.id}/dances` }]).then((clip) => tweend.pose(hero, { clip, at: 0 })), { status: 404 });
});

test('clips are mixed for a model whose nodes share names, parents among them', async () => {
  const bytes = Buffer.from(new Float32Array([0, 1, 0, 0, 0, 1, 0, 1, 0, 0]).buffer);
  const model = await tweend.upload(JSON.stringify({
    asset: { version: '2.0' },
    scenes: [{ nodes: [1] }],
    nodes: [{ name: 'limb', children: [2] }, { name: 'limb', children: [0] }, { name: 'tip' }],
    animations: [{ name: 'turn', samplers: [{ input: 0, output: 1 }], channels: [{ sampler: 0, target: { node: 0, path: 'rotation' } }] }],
    accessors: [{ bufferView: 0, componentType: 5126, count: 2, type: 'SCALAR', min: [0], max: [1] }, { bufferView: 1, componentType: 5126, count: 2, type: 'VEC4' }],
    bufferViews: [{ buffer: 0, byteLength: 8 }, { buffer: 0, byteOffset: 8, byteLength: 32 }],
    buffers: [{ byteLength: 40, uri: `data:application/octet-stream;base64,${bytes.toString('base64')}` }],
  }));
  const clip = await tweend.mix(model, [{ clip: 'turn' }]);
  const { poses: [{ rotation }] } = await tweend.pose(model, { clip, at: 0.5 });
  [[0, Math.SQRT1_2, 0, Math.SQRT1_2], [0, 0, 0, 1], [0, 0, 0, 1]].forEach((value, node) => assertNear(rotation[node], value, 1e-6));
});

test('the way of a whole figure is taken out of what moves', async () => {
  const hero = await tweend.upload(biped({ names: 'mixamo', clip: { seed: 2 } }));
  const lender = await tweend.upload(biped({ names: 'unreal', clip: { seed: 4 } }));
  const options = { clip: `${lender.id}/moves`, retarget: 'auto', root_motion: 'auto' };
  const player = await tweend.play(hero, [], options);
  player.time = 1.5;
  player.update();
  const [{ root: moved }] = (await tweend.pose(hero, { ...options, at: 1.5 })).poses;
  assert.notDeepEqual(moved.translation, [0, 0, 0]);
  for (const part of ['rotation', 'translation']) assertNear(player.root[part], moved[part], 1e-3);
  assert.equal((await tweend.play(hero, [], { clip: 'moves' })).root, undefined);

  const live = await tweend.live(hero, [], { ...options, fps: 50, delay: 0, loop: 'clamp' });
  await until(live, () => live.ended);
  const [{ root: end }] = (await tweend.pose(hero, { ...options, at: live.time })).poses;
  for (const part of ['rotation', 'translation']) assertNear(live.root[part], end[part], 2e-2);
});

test('tracks and rotations are there', async () => {
  const { tracks } = await tweend.tracks(tank, { clip: 'drive' });
  assert.ok(tracks.some(({ best_order }) => best_order));
  const { rotations } = await tweend.rotations({ rotations: [{ axis_angle: [0, 0, 1, 90] }], unit: 'degrees', as: 'euler', order: 'XYZ' });
  assertNear(rotations[0].euler, [0, 0, 90], 1e-4);
});

// ---- players ----

test('between poses rotations take the short way at constant speed', () => {
  const half = (degrees) => [0, 0, Math.sin((degrees * Math.PI) / 360), Math.cos((degrees * Math.PI) / 360)];
  const to = (degrees) => half(degrees).map((value) => -value); // the same rotation, the other sign
  const a = object();
  const player = new Player({ a }, tableOf([half(0), to(170), half(170)]), { loop: 'clamp' });
  for (const [time, degrees] of [[0, 0], [0.1, 17], [0.5, 85], [0.9, 153], [1, 170], [1.5, 170], [2, 170], [9, 170]]) {
    player.time = time;
    assert.equal(player.update(), Math.min(time, 2));
    const sign = Math.sign(turn(a)[3]) * Math.sign(half(degrees)[3]);
    assertNear(turn(a), half(degrees).map((value) => sign * value), 1e-6, `at ${time}:`);
    const passed = Math.min(time, 2);
    assertNear(Object.values(a.position), [passed, 2 * passed, 3 * passed], 1e-6);
    assertNear(Object.values(a.scale), [1, 1, 1 + passed], 1e-6);
  }
});

test('time passes, stops, turns and folds', () => {
  const identity = [0, 0, 0, 1];
  const a = object();
  const player = new Player({ a }, tableOf([identity, identity, identity]));
  assert.equal(player.update(1000), 0);
  assert.equal(player.update(2500), 1.5);
  player.playing = false;
  assert.equal(player.update(3000), 1.5);
  player.playing = true;
  assert.equal(player.update(3000), 1.5); // what passed in between does not count
  player.speed = -2;
  assert.equal(player.update(4000), 1.5); // 0.5 before the start, and 2 s repeat
  player.loop = 'pingpong';
  player.time = 3.5;
  assert.equal(player.update(4000), 0.5);
  player.loop = 'clamp';
  assert.equal(player.update(4000), 2);
  player.time = -1;
  assert.equal(player.update(4000), 0);
  assert.deepEqual(Object.values(a.position), [0, 0, 0]);
});

test('objects are found in trees, scenes, lists and by functions', () => {
  const table = tableOf([[0, 0, 0, 1], [0, 0, 0, 1]]);
  const named = (name, userData) => ({ ...object(), name, userData });
  const moved = (objects, a) => {
    new Player(objects, table, { time: 0.5 }).update();
    return a.position.x === 0.5;
  };
  const list = [named('b'), named('a'), named('a')];
  assert.ok(moved(list, list[1]));
  const renamed = [named('a', {}), named('a_1', { name: 'a' })]; // as three.js does
  const tree = { traverse: (visit) => renamed.forEach(visit) };
  assert.ok(moved(tree, renamed[1]));
  assert.ok(moved({ getNodes: () => list }, list[1]));
  assert.ok(moved((name, index) => name === 'a' && index === 0 && list[0], list[0]));
  const root = Object.assign(named('a'), { getDescendants: () => list });
  assert.ok(moved(root, root));
  assert.deepEqual(new Player([], table).missing, ['a']);
});

test('objects may be like those of three.js, of Babylon.js, or bare', () => {
  const s = Math.SQRT1_2;
  const table = tableOf([[0, 0, 0, 1], [s, 0, 0, s]]);
  class Vector {
    set(...values) {
      this.values = values;
    }
  }
  const three = { position: new Vector(), quaternion: new Vector(), scale: new Vector() };
  const babylon = { position: new Vector(), rotationQuaternion: null, rotation: { toQuaternion: () => new Vector() }, scaling: new Vector() };
  const lists = { position: [], quaternion: new Float32Array(4), scale: [] };
  for (const a of [three, babylon, lists]) new Player({ a }, table, { time: 1, loop: 'clamp' }).update();
  for (const rotation of [three.quaternion.values, babylon.rotationQuaternion.values, [...lists.quaternion]]) assertNear(rotation, [s, 0, 0, s], 1e-6);
  for (const position of [three.position.values, babylon.position.values, lists.position]) assert.deepEqual(position, [1, 2, 3]);
  for (const scale of [three.scale.values, babylon.scaling.values, lists.scale]) assert.deepEqual(scale, [1, 1, 2]);
});

test('a player shows what the daemon computes', async () => {
  const turret = object();
  const player = await tweend.play(tank, { turret }, { clip: 'aim', fps: 30, loop: 'clamp' });
  assert.equal(player.duration, 4);
  assert.ok(player.missing.includes('hull') && !player.missing.includes('turret'));
  const times = [0, 0.31, 1.234, 2.9, 3.999, 4];
  const { poses } = await tweend.pose(tank, { clip: 'aim', nodes: 'turret', at: times });
  times.forEach((time, i) => {
    player.time = time;
    player.update();
    const [expected] = poses[i].rotation;
    const sign = Math.sign(turn(turret).reduce((sum, value, k) => sum + value * expected[k], 0));
    assertNear(turn(turret).map((value) => sign * value), expected, 1e-3, `at ${time}:`);
  });
});

// ---- live ----

/** Waits until a condition holds, while the player goes on. */
async function until(player, condition) {
  for (const end = performance.now() + 20000; performance.now() < end; await pause(5)) {
    player.update();
    if (condition()) return;
  }
  assert.fail('it did not come about');
}

test('a live player is in phase with the start that it was given', async () => {
  const turret = object();
  const start = Date.now() - 10000;
  const player = await tweend.live(tank, { turret }, { clip: 'aim', fps: 50, loop: 'repeat', start, delay: 200 });
  await pause(500);
  const steps = [];
  await until(player, () => {
    const due = (((Date.now() - 200 - start) / 1000) % 4 + 4) % 4;
    steps.push(Math.abs(player.time - due));
    return steps.length >= 100;
  });
  const late = steps.sort((a, b) => a - b);
  assert.ok(late[50] < 0.02, `${late[50]} s off`);
  assert.ok(Math.abs(player.serverTime - Date.now()) < 50, 'the server’s clock is this one');
  const { poses } = await tweend.pose(tank, { clip: 'aim', nodes: 'turret', at: player.time });
  const [expected] = poses[0].rotation;
  assertNear([Math.abs(turn(turret).reduce((sum, value, k) => sum + value * expected[k], 0))], [1], 1e-3);
  player.close();
  await player.done;
});

test('a player that is closed ends, though fetch does not end its stream', async () => {
  let isCancelled = false;
  const frame = `id: 0\ndata: ${JSON.stringify({ now: 0, t: 0, rotation: [], translation: [], scale: [] })}\n\n`;
  const stream = () => new ReadableStream({ start: (control) => control.enqueue(new TextEncoder().encode(frame)), cancel: () => (isCancelled = true) });
  const fetch = async (url) => (url.includes('/live') ? new Response(stream()) : poseAnswer([]));
  const player = await new Tweend('http://a.example', { fetch }).live('x', {});
  player.close();
  await player.done;
  assert.ok(isCancelled);
});

test('a stream that breaks goes on behind what was seen, and ends with its clip', async () => {
  const asked = [];
  const watching = new Tweend(daemon.url, {
    key: 'sesame',
    fetch: (url, init) => {
      if (url.includes('/live')) asked.push(init.headers['Last-Event-ID']);
      return fetch(url, init);
    },
  });
  const hull = object();
  const player = await watching.live(tank, { hull }, { clip: 'drive', fps: 20, speed: 0.8 });
  await until(player, () => player.time > 0.3);
  await daemon.stop();
  const reached = player.time;
  await daemon.start();
  await until(player, () => player.ended && player.time === 4);
  await player.done;
  assert.equal(asked[0], undefined);
  assert.ok(asked.length >= 2 && Number(asked.at(-1)) >= Math.floor((reached / 0.8) * 20), `${asked}`);
  const { poses } = await tweend.pose(tank, { clip: 'drive', nodes: 'hull', at: 4 });
  assertNear(Object.values(hull.position), poses[0].translation[0], 1e-5);
});

test('a stream whose events cannot be read is let go before another is asked for', async () => {
  let [open, most] = [0, 0];
  const stream = () => {
    most = Math.max(most, ++open);
    return new ReadableStream({
      start: (out) => out.enqueue(new TextEncoder().encode('retry: 1\n\ndata: {"rotation\n\n')),
      cancel: () => void open--,
    });
  };
  let asked = 0;
  const fetch = async (url) => (url.includes('/live') ? (asked++, new Response(stream())) : poseAnswer([]));
  const end = new AbortController();
  const live = new Tweend('http://a.example', { fetch }).live('x', {}, { signal: end.signal });
  for (const until = performance.now() + 20000; asked < 5 && performance.now() < until; ) await pause(5);
  end.abort(new Error('enough'));
  await assert.rejects(live, { message: 'enough' });
  assert.ok(asked >= 5, `asked ${asked} times`);
  assert.equal(most, 1);
});

test('a page is warned once, at the fourth stream that is open at once from one origin over HTTP/1', async (t) => {
  globalThis.document = {}; // only browsers have few connections
  t.after(() => delete globalThis.document);
  const { Tweend } = await import('../../api/client/tweend.js?warnings');
  const { mock } = t.mock.method(console, 'warn', () => {});
  const warnings = () => mock.calls.map(({ arguments: [text] }) => text);
  const frame = new TextEncoder().encode('id: 0\ndata: {"now":0,"t":0,"rotation":[],"translation":[],"scale":[]}\n\n');
  const fetchWith = (statusText) => async (url, { signal }) => {
    if (!url.includes('/live')) return poseAnswer([]);
    const start = (out) => (out.enqueue(frame), signal.addEventListener('abort', () => out.error(signal.reason)));
    return new Response(new ReadableStream({ start }), { statusText });
  };
  const play = (origin, statusText = 'OK') => new Tweend(origin, { fetch: fetchWith(statusText) }).live('x', {});
  const close = (player) => (player.close(), player.done);

  const open = [await play('http://a.example'), await play('http://a.example/below'), await play('http://a.example')];
  for (let i = 0; i < 3; i++) open.push(await play('http://b.example'));
  for (let i = 0; i < 5; i++) open.push(await play('https://c.example', '')); // as over HTTP/2
  await close(open.shift());
  open.push(await play('http://a.example'));
  assert.deepEqual(warnings(), [], 'three are not many');
  open.push(await play('http://a.example'));
  assert.equal(warnings().length, 1);
  assert.match(warnings()[0], /^tweend: 4 live streams from http:\/\/a\.example are open.*player\.close\(\)/);
  open.push(await play('http://a.example'), await play('http://b.example'));
  await Promise.all(open.map(close));
  assert.equal(warnings().length, 1, 'once is enough');
});

test('what cannot go on fails', async () => {
  await assert.rejects(tweend.live(tank, {}, { clip: 'dance' }), { status: 404 });
  await assert.rejects(tweend.live(tank, {}, { fps: 1000 }), { status: 400 });
  await assert.rejects(tweend.live(tank, {}, { as: 'matrix' }), TypeError);
  await assert.rejects(tweend.live(tank, {}, { signal: AbortSignal.abort(new Error('no more')) }), { message: 'no more' });
  const locked = new Tweend(daemon.url);
  await assert.rejects(locked.live(tank, {}), { status: 401 });
});

test('a busy daemon is asked again when it says, and one who leaves meanwhile does not wait', async () => {
  const headers = { 'Retry-After': '30' };
  let asked = 0;
  const fetch = async (url) => (url.includes('/live') ? (asked++, new Response('', { status: 503, headers })) : poseAnswer([]));
  const began = performance.now();
  const signal = AbortSignal.timeout(1500);
  await assert.rejects(new Tweend('http://a.example', { fetch }).live('x', {}, { signal }), { name: 'TimeoutError' });
  assert.equal(asked, 1);
  assert.ok(performance.now() - began < 10000);
});

test('the server’s clock is told by the events with least delay, whatever it says', async () => {
  const ahead = 3.6e6; // an hour
  const delays = [60, 5, 5, 5, 5, 90, 5, 5, 5, 5, 5]; // who waits behind another is late too
  const began = performance.now();
  const late = []; // how much each was, on a busy machine by more than its delay
  const events = async function* () {
    for (let n = 0; n < 40; n++) {
      const delay = delays[n % delays.length];
      const due = began + n * 20;
      await pause(due + delay - performance.now());
      late.push(performance.now() - due);
      const pose = { t: n / 50, rotation: [[0, 0, 0, 1]], translation: [[n, 0, 0]], scale: [[1, 1, 1]], now: Math.round(due + ahead) };
      yield new TextEncoder().encode(`id: ${n}\ndata: ${JSON.stringify(pose)}\n\n`);
    }
    yield new TextEncoder().encode('event: end\ndata: {}\n\n');
  };
  const fetch = async (url) => (url.includes('/live') ? new Response(Readable.toWeb(Readable.from(events()))) : poseAnswer(['a']));
  const a = object();
  const player = await new Tweend('http://a.example', { fetch }).live('x', { a }, { fps: 50, delay: 100, signal: AbortSignal.timeout(20000) });
  const off = [];
  await until(player, () => {
    const now = performance.now();
    player.update(now);
    const expected = (now - began - 100) / 20;
    if (expected > 15 && expected < 38) off.push(Math.abs(a.position.x - expected) * 20);
    return player.ended;
  });
  const clock = player.serverTime - performance.now() - ahead;
  late.sort((x, y) => x - y);
  const usual = late[late.length >> 1];
  assert.ok(Math.abs(clock) < 7 + usual, `the clock is ${clock} ms off, events come ${late.map(Math.round)} ms late`);
  off.sort((x, y) => x - y);
  assert.ok(off.length > 20 && off[off.length >> 1] < 10 + usual, `${off.map(Math.round)} ms off, events come ${late.map(Math.round)} ms late`);
});

test('what is no model and no body is told before it is sent', async () => {
  for (const source of [undefined, null, 3, { meshes: [] }, runInNewContext('({ meshes: [] })')]) await assert.rejects(tweend.upload(source), { name: 'TypeError', message: /JSON\.stringify/ });
  assert.throws(() => tweend.describe(undefined), { name: 'TypeError', message: /a model is expected/ });
  assert.throws(() => tweend.surfaceUrl({}, { level: 1 }), { name: 'TypeError', message: /a model is expected/ });
  const bytes = Buffer.from('{"meshes": [{"shape": {"kind": "box"}}]}');
  const box = await tweend.upload(bytes);
  const elsewhere = runInNewContext('Uint8Array.from(bytes)', { bytes: [...bytes] }); // as of a frame
  assert.equal((await tweend.upload(elsewhere)).id, box.id);
  await assert.rejects(tweend.sculpt(box, [0, 0, 0]), { status: 400, message: /level is missing/ });
  await tweend.remove(box);
});
