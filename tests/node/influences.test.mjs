// Points that follow more than four joints: answers hold all sets of joints that the file has, and every vertex is
// where the file's own weights put it, by the matrices of three.js; with influences=4 a warning tells what is cut.
import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';

import { NodeIO } from '@gltf-transform/core';
import { ALL_EXTENSIONS } from '@gltf-transform/extensions';
import { MeshoptDecoder } from 'meshoptimizer';
import { Matrix4, Vector3 } from 'three';

import { Daemon } from './daemon.mjs';
import { objections } from './objections.mjs';
import { load, playerOf } from './player.mjs';

// ---- the file -----------------------------------------------------------------------------------------

const JOINTS = 12;
const [COLUMNS, ROWS] = [7, 5];

let seed = 1;
const random = () => (seed = (seed * 48271) % 2147483647) / 2147483647;

const points = [...Array(COLUMNS * ROWS).keys()].map((i) => [i % COLUMNS, Math.floor(i / COLUMNS), random() / 2]);
/** Point i follows 1 + i % 12 joints. */
const pulls = points.map((_, i) => {
  const count = 1 + (i % JOINTS);
  const shares = Array.from({ length: count }, () => 0.2 + random());
  const sum = shares.reduce((a, b) => a + b);
  return shares.map((share, k) => ({ joint: (i + 5 * k) % JOINTS, weight: share / sum }));
});

function makeFile(sets) {
  const chunks = [];
  const document = { asset: { version: '2.0' }, scene: 0, accessors: [], bufferViews: [] };
  let size = 0;
  const add = (array, type, more) => {
    const bytes = Buffer.from(array.buffer);
    const componentType = { Float32Array: 5126, Uint16Array: 5123 }[array.constructor.name];
    document.bufferViews.push({ buffer: 0, byteOffset: size, byteLength: bytes.length });
    size += (bytes.length + 3) & ~3;
    chunks.push(bytes, Buffer.alloc(-bytes.length & 3));
    const count = array.length / { SCALAR: 1, VEC3: 3, VEC4: 4, MAT4: 16 }[type];
    return document.accessors.push({ bufferView: document.bufferViews.length - 1, componentType, count, type, ...more }) - 1;
  };
  const attributes = { POSITION: add(new Float32Array(points.flat()), 'VEC3', { min: [0, 0, 0], max: [COLUMNS, ROWS, 1] }) };
  for (let set = 0; set < sets; set++) {
    const of = (pull) => [0, 1, 2, 3].map((k) => pull[4 * set + k] ?? { joint: 0, weight: 0 });
    attributes[`JOINTS_${set}`] = add(new Uint16Array(pulls.flatMap((pull) => of(pull).map(({ joint }) => joint))), 'VEC4');
    attributes[`WEIGHTS_${set}`] = add(new Float32Array(pulls.flatMap((pull) => of(pull).map(({ weight }) => weight))), 'VEC4');
  }
  const corners = points.flatMap((_, i) =>
    i % COLUMNS < COLUMNS - 1 && i < COLUMNS * (ROWS - 1) ? [i, i + 1, i + COLUMNS + 1, i, i + COLUMNS + 1, i + COLUMNS] : [],
  );
  document.meshes = [{ primitives: [{ attributes, indices: add(new Uint16Array(corners), 'SCALAR') }] }];
  const bones = [...Array(JOINTS).keys()];
  const binds = bones.flatMap((bone) => new Matrix4().makeTranslation(-bone / 2, 0, 0).toArray());
  document.skins = [{ joints: bones.map((bone) => bone + 1), inverseBindMatrices: add(new Float32Array(binds), 'MAT4') }];
  document.nodes = [
    { mesh: 0, skin: 0 },
    ...bones.map((bone) => ({ name: `bone ${bone}`, translation: [bone / 2, 0, 0] })),
    { name: 'root', children: bones.map((bone) => bone + 1) },
  ];
  document.scenes = [{ nodes: [0, JOINTS + 1] }];
  const times = add(new Float32Array([0, 1]), 'SCALAR', { min: [0], max: [1] });
  const samplers = bones.map((bone) => ({ input: times, output: add(new Float32Array([bone / 2, 0, 0, bone, bone * bone, -bone]), 'VEC3') }));
  const turns = bones.map((bone) => ({ input: times, output: add(new Float32Array([0, 0, 0, 1, Math.sin(bone), 0, 0, Math.cos(bone)]), 'VEC4') }));
  const channel = (path, first) => (_, i) => ({ sampler: first + i, target: { node: i + 1, path } });
  document.animations = [
    {
      name: 'wave',
      samplers: [...samplers, ...turns],
      channels: [...samplers.map(channel('translation', 0)), ...turns.map(channel('rotation', JOINTS))],
    },
  ];
  document.buffers = [{ byteLength: size, uri: `data:application/octet-stream;base64,${Buffer.concat(chunks).toString('base64')}` }];
  return JSON.stringify(document);
}

// ---- what is where ------------------------------------------------------------------------------------

/** Each joint's matrix at a time of the first clip, as three.js has it. */
async function matricesAt(file, time) {
  const gltf = await load(file);
  playerOf(gltf)(time);
  let skeleton;
  gltf.scene.traverse((object) => (skeleton ??= object.skeleton));
  return skeleton.bones.map((bone, i) => bone.matrixWorld.clone().multiply(skeleton.boneInverses[i]));
}

function moved(point, pull, matrices) {
  const out = new Vector3();
  for (const { joint, weight } of pull) out.addScaledVector(new Vector3(...point).applyMatrix4(matrices[joint]), weight);
  return out;
}

const io = async () => {
  await MeshoptDecoder.ready;
  return new NodeIO().registerExtensions(ALL_EXTENSIONS).registerDependencies({ 'meshopt.decoder': MeshoptDecoder });
};

/** The vertices of an answer with all that moves them. */
async function verticesOf(bytes) {
  const document = await (await io()).readBinary(new Uint8Array(bytes));
  return document.getRoot().listMeshes().flatMap((mesh) => mesh.listPrimitives()).flatMap((part) => {
    const at = (name, i) => part.getAttribute(name)?.getElement(i, []);
    const sets = part.listSemantics().filter((name) => name.startsWith('JOINTS_')).length;
    return [...Array(part.getAttribute('POSITION').getCount()).keys()].map((i) => ({
      point: at('POSITION', i),
      sets,
      pull: [...Array(sets).keys()].flatMap((set) =>
        at(`JOINTS_${set}`, i).map((joint, k) => ({ joint, weight: at(`WEIGHTS_${set}`, i)[k] })),
      ),
    }));
  });
}

function assertSamePlaces(found, wanted, tolerance) {
  const near = (list, point) => Math.min(...list.map((other) => other.distanceTo(point)));
  for (const point of wanted) assert.ok(near(found, point) <= tolerance, `no vertex near ${point.toArray()}`);
  for (const point of found) assert.ok(near(wanted, point) <= tolerance, `a vertex at ${point.toArray()}`);
}

// ---- tests --------------------------------------------------------------------------------------------

const daemon = new Daemon();
let model;
before(async () => {
  await daemon.start();
  model = await daemon.upload(makeFile(3));
});
after(() => daemon.remove());

async function ask(query, at = model) {
  const response = await fetch(`${at}/surface.${query}`);
  assert.equal(response.status, 200, query);
  return { bytes: Buffer.from(await response.arrayBuffer()), warning: decodeURIComponent(response.headers.get('X-Tweend-Warning') ?? '') };
}

for (const [encoding, tolerance] of [['float', 1e-4], ['quantized', 0.7], ['meshopt', 0.7]])
  test(`encoding=${encoding}: three sets of joints put every vertex where the file does`, async () => {
    const { bytes, warning } = await ask(`glb?level=0&quads=ngon&encoding=${encoding}`);
    assert.equal(warning, '');
    const vertices = await verticesOf(bytes);
    for (const time of [0, 0.3, 1]) {
      const wanted = await matricesAt(makeFile(3), time);
      const own = await matricesAt(bytes, time);
      assertSamePlaces(
        vertices.map(({ point, pull }) => moved(point, pull, own)),
        points.map((point, i) => moved(point, pulls[i], wanted)),
        tolerance, // weights in bytes, of joints that lie up to 150 m apart
      );
    }
  });

test('baking uses all sets, whatever is asked of those that are kept', async () => {
  const wanted = await matricesAt(makeFile(3), 1);
  for (const query of ['', '&influences=4']) {
    const { bytes } = await ask(`obj?level=0&at=1&skin=bake${query}`);
    const found = bytes.toString().split('\n').filter((line) => line.startsWith('v '));
    assertSamePlaces(
      found.map((line) => new Vector3(...line.split(' ').slice(1, 4).map(Number))),
      points.map((point, i) => moved(point, pulls[i], wanted)),
      1e-4,
    );
  }
});

test('every level and encoding has three sets, whose weights sum to 1 and which the validator takes', async () => {
  for (const level of [0, 1, 2, 4])
    for (const encoding of ['float', 'quantized']) {
      const { bytes } = await ask(`glb?level=${level}&encoding=${encoding}`);
      for (const { sets, pull } of await verticesOf(bytes)) {
        assert.equal(sets, 3);
        assert.ok(Math.abs(pull.reduce((sum, { weight }) => sum + weight, 0) - 1) < 1e-6);
        const used = pull.filter(({ weight }) => weight > 0).map(({ joint }) => joint);
        assert.equal(new Set(used).size, used.length);
      }
      assert.deepEqual(await objections(bytes), []);
    }
});

test('influences=4 keeps the four heaviest joints, and tells how many points follow more', async () => {
  const { bytes, warning } = await ask('glb?level=0&quads=ngon&influences=4');
  const more = pulls.filter((pull) => pull.length > 4).length;
  assert.match(warning, new RegExp(`influences=4 keeps the four heaviest joints of a point: ${more} points of the file follow more`));
  const vertices = await verticesOf(bytes);
  assert.equal(vertices.length, points.length);
  for (const { point, sets, pull } of vertices) {
    assert.equal(sets, 1);
    const i = points.findIndex((p) => p.every((x, c) => Math.fround(x) === point[c]));
    const heaviest = [...pulls[i]].sort((a, b) => b.weight - a.weight).slice(0, 4);
    const sum = heaviest.reduce((total, { weight }) => total + weight, 0);
    heaviest.forEach(({ joint, weight }, k) => {
      assert.equal(pull[k].joint, joint);
      assert.ok(Math.abs(pull[k].weight - weight / sum) < 1e-6);
    });
  }
});

test('a cage with three sets comes back as it was', async () => {
  const { bytes } = await ask('glb?level=0&polygons=ngon');
  const again = await daemon.upload(bytes);
  const sorted = (vertices) => vertices.map((vertex) => JSON.stringify(vertex)).sort();
  const [first, second] = await Promise.all([model, again].map(async (at) => verticesOf((await ask('glb?level=1', at)).bytes)));
  assert.deepEqual(sorted(second), sorted(first));
});

test('a coarsened surface keeps all sets', async () => {
  const refined = await daemon.upload((await ask('glb?level=1&normals=none')).bytes);
  const answer = await fetch(`${refined}/coarsen?quads=auto`, { method: 'POST' });
  const { id, detail } = await answer.json();
  assert.ok(id, detail);
  const vertices = await verticesOf((await ask('glb?level=0', `${daemon.url}/v1/models/${id}`)).bytes);
  assert.equal(vertices.length, points.length);
  assert.ok(vertices.every(({ sets }) => sets === 3));
  assert.ok(vertices.some(({ pull }) => pull.filter(({ weight }) => weight > 0).length > 8));
});

test('edits and details keep all sets', async () => {
  const post = async (path, body) => {
    const answer = await fetch(`${model}/${path}`, { method: 'POST', headers: { 'Content-Type': 'application/json' }, body: JSON.stringify(body) });
    const { id, detail } = await answer.json();
    assert.ok(id, detail);
    return `${daemon.url}/v1/models/${id}`;
  };
  const cut = await post('edits', { edits: [{ edit: 'subdivide', faces: 'all', cuts: 1 }] });
  const obj = (await ask('obj?level=1')).bytes.toString();
  const lifted = obj.split('\n').filter((line) => line.startsWith('v ')).map((line) => line.split(' ').slice(1, 4).map(Number));
  lifted[0][2] += 1;
  const sculpted = await post('detail?level=1', { positions: lifted });
  const wanted = await matricesAt(makeFile(3), 1);
  const vertices = await verticesOf((await ask('glb?level=0', cut)).bytes);
  assert.ok(vertices.every(({ sets }) => sets === 3));
  const found = vertices.map(({ point, pull }) => moved(point, pull, wanted));
  for (const [i, point] of points.entries()) {
    const place = moved(point, pulls[i], wanted);
    assert.ok(Math.min(...found.map((other) => other.distanceTo(place))) < 1e-4);
  }
  // A point in the middle of an edge follows the joints of both ends.
  const middle = vertices.find(({ point }) => point[0] === 0.5 && point[1] === 0);
  for (let joint = 0; joint < JOINTS; joint++) {
    const weightOf = (pull) => pull.reduce((sum, one) => sum + (one.joint === joint ? one.weight : 0), 0);
    assert.ok(Math.abs(weightOf(middle.pull) - (weightOf(pulls[0]) + weightOf(pulls[1])) / 2) < 1e-6);
  }
  assert.ok((await verticesOf((await ask('glb?level=2', sculpted)).bytes)).every(({ sets }) => sets === 3));
});
