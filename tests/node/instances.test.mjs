// EXT_mesh_gpu_instancing in answers without a hierarchy: OBJ, STL, PLY and 3MF show each instance of a node where
// three's GLTFLoader draws it in the file itself. Random places: turned by floats and small integers, scaled,
// mirrored, below other nodes, and far from the origin.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { existsSync, mkdtempSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, test } from 'node:test';

import { Vector3 } from 'three';

import { Daemon, root } from './daemon.mjs';
import { load } from './player.mjs';
import { assertSame, drawn, read, volumeOf } from './seen.mjs';

const daemon = new Daemon();
before(() => daemon.start());
after(() => daemon.remove());

let seed = 23;
const random = () => (seed = (seed * 48271) % 2147483647) / 2147483647;
const spread = (by) => (random() * 2 - 1) * by;

async function ask(model, query) {
  const response = await fetch(`${model}/surface.${query}`);
  const bytes = Buffer.from(await response.arrayBuffer());
  assert.equal(response.status, 200, `${query}: ${bytes}`);
  return { bytes, warning: decodeURIComponent(response.headers.get('X-Tweend-Warning') ?? '') };
}

// ---- the file -----------------------------------------------------------------------------------------

const POINTS = [[0, 0, 0], [1, 0, 0], [0, 2, 0], [0, 0, 3]];
const FACES = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];

const unit = (q) => q.map((x) => x / Math.hypot(...q));

/** A tetrahedron at a node below another one. each(i): translation, rotation and scale of an instance; turns: how
 * rotations are stored; isPlain: as unit floats, though they are rounded so. */
function file(count, each, { turns = Float32Array, above = {}, own = {}, lacks = [], isPlain = false } = {}) {
  const document = { asset: { version: '2.0' }, extensionsUsed: ['EXT_mesh_gpu_instancing'], accessors: [], bufferViews: [] };
  const chunks = [];
  let size = 0;
  const add = (array, type, more) => {
    const bytes = Buffer.from(array.buffer);
    document.bufferViews.push({ buffer: 0, byteOffset: size, byteLength: bytes.length });
    chunks.push(bytes, Buffer.alloc(-bytes.length & 3));
    size += (bytes.length + 3) & ~3;
    const componentType = { Int8Array: 5120, Uint8Array: 5121, Int16Array: 5122, Float32Array: 5126 }[array.constructor.name];
    const count = array.length / { SCALAR: 1, VEC3: 3, VEC4: 4 }[type];
    return document.accessors.push({ bufferView: document.bufferViews.length - 1, componentType, count, type, ...more }) - 1;
  };
  const places = Array.from({ length: count }, (_, i) => each(i));
  const largest = { Int8Array: 127, Int16Array: 32767 }[turns.name];
  const stored = (q) => (largest && !isPlain ? q.map((x) => Math.round(x * largest)) : largest ? unit(q.map((x) => Math.round(x * largest))) : q);
  const attributes = {
    TRANSLATION: add(new Float32Array(places.flatMap(([t]) => t)), 'VEC3'),
    ROTATION: add(new (isPlain ? Float32Array : turns)(places.flatMap(([, q]) => stored(q))), 'VEC4', !isPlain && largest && { normalized: true }),
    SCALE: add(new Float32Array(places.flatMap(([, , s]) => s)), 'VEC3'),
    _ID: add(new Float32Array(count), 'SCALAR'),
  };
  for (const name of lacks) delete attributes[name];
  const POSITION = add(new Float32Array(POINTS.flat()), 'VEC3', { min: [0, 0, 0], max: [1, 2, 3] });
  const indices = add(new Uint8Array(FACES.flat()), 'SCALAR');
  const bound = own.skin === undefined ? {} : { JOINTS_0: add(new Uint8Array(16), 'VEC4'), WEIGHTS_0: add(new Float32Array([1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0]), 'VEC4') };
  document.skins = [{ joints: [0] }];
  document.meshes = [{ name: 'leaf', primitives: [{ attributes: { POSITION, ...bound }, indices }] }];
  document.nodes = [{ children: [1], ...above }, { name: 'tree', mesh: 0, extensions: { EXT_mesh_gpu_instancing: { attributes } }, ...own }];
  document.scenes = [{ nodes: [0] }];
  document.buffers = [{ byteLength: size, uri: `data:application/octet-stream;base64,${Buffer.concat(chunks).toString('base64')}` }];
  return JSON.stringify(document);
}

const turn = () => unit([0, 1, 2, 3].map(() => spread(1)));
const anywhere = () => [[spread(9), spread(9), spread(9)], turn(), [0.5 + random(), 0.5 + random(), (0.5 + random()) * (random() < 0.5 ? -1 : 1)]];

// ---- tests --------------------------------------------------------------------------------------------------

const kinds = {
  'turned by floats': [40, {}],
  'turned by bytes': [17, { turns: Int8Array }],
  'turned by shorts, below a mirrored node': [23, { turns: Int16Array, above: { scale: [-1, 1.5, 1], rotation: [0, 0.6, 0, 0.8] }, own: { translation: [1, 2, 3] } }],
  'moved alone': [5, { lacks: ['ROTATION', 'SCALE'] }],
  'turned and scaled alone': [4, { lacks: ['TRANSLATION'] }],
  one: [1, {}],
};

for (const [name, [count, how]] of Object.entries(kinds))
  test(`instances ${name}: every form shows them where three draws them`, async () => {
    const places = Array.from({ length: count }, anywhere);
    const source = file(count, (i) => places[i], how);
    // three takes rounded rotations as they are, which scales
    const wanted = drawn((await load(file(count, (i) => places[i], { ...how, isPlain: true }))).scene);
    assert.equal(wanted.length, count * FACES.length);
    const model = await daemon.upload(source);
    for (const form of Object.keys(read)) {
      const { bytes, warning } = await ask(model, `${form}?level=0&normals=none${form === 'stl' ? '&unit=m' : ''}`);
      assertSame(read[form](bytes), wanted, 2e-5, form);
      assert.doesNotMatch(warning, /instances/);
    }
    const { forms, solid } = JSON.parse((await ask(model, 'json?level=0&shells=true')).bytes);
    assert.deepEqual([solid.shells, solid.closed, solid.triangles], [count, count, wanted.length]);
    const volume = volumeOf(wanted);
    assert.ok(Math.abs(solid.volume - volume) < 1e-5 * volume, `${solid.volume}, ${volume}`);
    for (const form of ['stl', 'ply']) assert.equal(forms[form], (await ask(model, `${form}?level=0`)).bytes.length);
  });

test('instances at a level are those of the surface of one', async () => {
  const model = await daemon.upload(file(3, anywhere));
  const wanted = drawn((await load((await ask(model, 'glb?level=2&creases=none')).bytes)).scene);
  assertSame(read.stl((await ask(model, 'stl?level=2&creases=none&unit=m')).bytes), wanted, 2e-5, 'level 2');
});

test('instances of a mesh that joints put elsewhere are told', async () => {
  const model = await daemon.upload(file(7, anywhere, { own: { skin: 0 } }));
  const { bytes, warning } = await ask(model, 'obj?level=0');
  assert.equal(read.obj(bytes).length, FACES.length);
  assert.match(warning, /surface\.obj is without the 7 instances of EXT_mesh_gpu_instancing/);
  assert.match((await ask(model, 'ply?level=0')).warning, /^1; surface\.ply is without: instances of EXT_mesh_gpu_instancing/);
});

test('objects of instances have names of their own', async () => {
  const model = await daemon.upload(file(3, anywhere));
  const names = async (source) => [...(await ask(source, 'obj?level=0')).bytes.toString().matchAll(/^o (.*)$/gm)].map(([, name]) => name);
  assert.deepEqual(await names(model), ['tree', 'tree_2', 'tree_3']);
  const unnamed = JSON.parse(file(3, anywhere));
  delete unnamed.nodes[1].name;
  delete unnamed.meshes[0].name;
  assert.deepEqual(await names(await daemon.upload(JSON.stringify(unnamed))), ['node_1', 'node_1_2', 'node_1_3']);
});

test('instances far from the origin keep their shape and their distances', async () => {
  const far = [500123.123, 5412345.457, 321.76];
  const source = file(6, () => [[spread(2), spread(2), spread(2)], turn(), [1, 1, 1]], { above: { translation: far } });
  const wanted = drawn((await load(source)).scene); // three computes in double
  const model = await daemon.upload(source);
  const points = [...(await ask(model, 'obj?level=0&normals=none')).bytes.toString().matchAll(/^v (.*)$/gm)].map(([, line]) => new Vector3(...line.split(' ').map(Number)));
  for (const corner of wanted.flat()) assert.ok(points.some((point) => point.distanceTo(corner) < 3e-6), `${corner.toArray()}`);
  const { bytes, warning } = await ask(model, 'stl?level=0&unit=m');
  const moved = warning.match(/all is moved by (\S+), (\S+), (\S+) of/).slice(1).map(Number);
  assertSame(read.stl(bytes), wanted.map((t) => t.map((p) => p.clone().add(new Vector3(...moved)))), 3e-6, 'moved');
});

test('points of the first instance of an OBJ are taken as details', async () => {
  const model = await daemon.upload(file(3, anywhere, { above: { scale: [2, 1, 1] } }));
  const { bytes } = await ask(model, 'obj?level=1&normals=none');
  const post = (body) => fetch(`${model}/detail?level=1`, { method: 'POST', headers: { 'Content-Type': 'model/obj' }, body });
  assert.equal((await (await post(bytes)).json()).id, model.split('/').at(-1), 'nothing has moved');
  const lines = bytes.toString().split('\n');
  const at = lines.findIndex((line) => line.startsWith('v '));
  const moved = lines[at].split(' ').slice(1).map((x) => Number(x) + 0.25);
  lines[at] = `v ${moved.join(' ')}`;
  const answer = await post(lines.join('\n'));
  assert.ok(answer.ok, await answer.clone().text());
  const again = (await ask(`${daemon.url}/v1/models/${(await answer.json()).id}`, 'obj?level=1&normals=none')).bytes.toString();
  const first = again.match(/^v (.*)$/m)[1].split(' ').map(Number);
  first.forEach((x, i) => assert.ok(Math.abs(x - moved[i]) < 1e-5, `${first}, ${moved}`));
});

const judge = join(root, 'build/tests/threemf_facts');
test('a 3MF has an item for each instance', { skip: !existsSync(judge) && 'lib3mf 1 is not there' }, async () => {
  const folder = mkdtempSync(join(tmpdir(), 'instances-'));
  const source = file(9, anywhere);
  const model = await daemon.upload(source);
  writeFileSync(join(folder, 'a.3mf'), (await ask(model, '3mf?level=0')).bytes);
  const { items, warnings } = JSON.parse(execFileSync(judge, [join(folder, 'a.3mf')], { encoding: 'utf8' }));
  rmSync(folder, { recursive: true });
  assert.deepEqual([items.length, warnings], [9, 0]);
  const wanted = drawn((await load(source)).scene);
  for (let i = 0; i < 9; i++) {
    const own = wanted.slice(i * FACES.length, (i + 1) * FACES.length).flat().map((p) => p.toArray());
    items[i].bounds.forEach((bound, k) => {
      const right = 1000 * (k < 3 ? Math.min : Math.max)(...own.map((p) => p[k % 3]));
      assert.ok(Math.abs(bound - right) < 0.05, `${bound}, ${right}`);
    });
  }
});
