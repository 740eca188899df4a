// Meshes far from the origin keep their shape in every answer: coordinates are read in double, points are relative to
// an offset that the node carries, and OBJ is printed with it in double. What is right is the file's own numbers in
// double, the same mesh near the origin, and what three.js makes of the answer.
import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';

import { Matrix4, Quaternion, Vector3 } from 'three';

import { Daemon } from './daemon.mjs';
import { objections } from './objections.mjs';
import { load, nodesOf } from './player.mjs';

const daemon = new Daemon();
before(() => daemon.start());
after(() => daemon.remove());

let seed = 7;
const random = () => (seed = (seed * 48271) % 2147483647) / 2147483647;

// ---- meshes -------------------------------------------------------------------------------------------

const FACES = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]];

/** A cuboid with a notch of a hundredth of its size, whose points have few decimals. */
function shapeOf(size) {
  const points = [0, 1, 2, 3, 4, 5, 6, 7].map((i) => [i >> 2, (i >> 1) & 1, i & 1].map((x) => x * size));
  points[7][0] -= size / 100;
  return points;
}

const shifted = (points, by) => points.map((point) => point.map((x, c) => x + by[c]));

// ---- files --------------------------------------------------------------------------------------------

const TRIANGLES = FACES.flatMap(([a, b, c, d]) => [[a, b, c], [a, c, d]]);

function doublesPly(points) {
  const header = `ply\nformat binary_little_endian 1.0\nelement vertex 8\nproperty double x\nproperty uchar tag\nproperty double y\nproperty double z\nelement face 6\nproperty list uchar int vertex_indices\nend_header\n`;
  const rows = Buffer.alloc(8 * 25 + 6 * 17);
  points.forEach(([x, y, z], i) => {
    rows.writeDoubleLE(x, 25 * i);
    rows.writeDoubleLE(y, 25 * i + 9);
    rows.writeDoubleLE(z, 25 * i + 17);
  });
  FACES.forEach((face, f) => {
    rows.writeUInt8(4, 200 + 17 * f);
    face.forEach((point, c) => rows.writeInt32LE(point, 200 + 17 * f + 1 + 4 * c));
  });
  return Buffer.concat([Buffer.from(header), rows]);
}

function binaryStl(points) {
  const bytes = Buffer.alloc(84 + 50 * TRIANGLES.length);
  bytes.writeUInt32LE(TRIANGLES.length, 80);
  TRIANGLES.forEach((corners, f) => corners.flatMap((point) => points[point]).forEach((x, i) => bytes.writeFloatLE(x, 84 + 50 * f + 12 + 4 * i)));
  return bytes;
}

const writers = {
  obj: (points) => points.map((p) => `v ${p.join(' ')}\n`).join('') + FACES.map((f) => `f ${f.map((i) => i + 1).join(' ')}\n`).join(''),
  ply: (points) =>
    `ply\nformat ascii 1.0\nelement vertex 8\nproperty double x\nproperty double y\nproperty double z\nelement face 6\nproperty list uchar int vertex_indices\nend_header\n` +
    points.map((p) => `${p.join(' ')}\n`).join('') + FACES.map((f) => `4 ${f.join(' ')}\n`).join(''),
  'ply of doubles': doublesPly,
  stl: (points) =>
    `solid vertex 1 2 3\n${TRIANGLES.map((f) => `facet normal 0 0 0\nouter loop\n${f.map((i) => `vertex ${points[i].join(' ')}\n`).join('')}endloop\nendfacet\n`).join('')}endsolid vertex 1 2 3\n`,
  json: (positions) => JSON.stringify({ meshes: [{ name: 'hull', positions, faces: FACES }] }),
};

async function upload(bytes) {
  const model = await daemon.upload(bytes);
  return { model, description: await (await fetch(model)).json() };
}

async function ask(model, query) {
  const answer = await fetch(`${model}/surface.${query}`);
  assert.equal(answer.status, 200, query);
  return Buffer.from(await answer.arrayBuffer());
}

const numbers = (obj, keyword) =>
  obj.toString().split('\n').filter((line) => line.startsWith(`${keyword} `)).map((line) => line.split(' ').slice(1).map(Number));
const pointsOf = async (model, query) => numbers(await ask(model, query), 'v');

/** The answer's points by the matrices of three.js, which computes in double; as float attributes hold them. */
async function worldOf(glb) {
  const gltf = await load(glb);
  gltf.scene.updateMatrixWorld(true);
  const out = [];
  gltf.scene.traverse((object) => {
    if (!object.isMesh) return;
    const { position } = object.geometry.attributes;
    for (let i = 0; i < position.count; i++) out.push(new Vector3().fromBufferAttribute(position, i).applyMatrix4(object.matrixWorld).toArray());
  });
  return out;
}

const distance = (a, b) => Math.max(...a.map((x, c) => Math.abs(x - b[c])));

/** Each point of one list is in the other; doubles at such places are `apart` from each other. */
function assertSamePlaces(found, wanted, tolerance, why) {
  for (const [list, other] of [[found, wanted], [wanted, found]])
    for (const point of list) assert.ok(list.length > 0 && other.some((at) => distance(at, point) <= tolerance), `${why}: ${point}`);
}

const ulp = (x) => 2 ** (Math.floor(Math.log2(Math.abs(x) || 1)) - 52);
/** A millionth of the size, and what doubles at the place cannot tell. */
const toleranceAt = (offset, size) => 1e-6 * size + 2 * Math.max(...offset.map(ulp));
/** Where floats lose less than that, points are rounded in the file, in the answer and near the origin. */
const nearFactor = 3;

// ---- tests --------------------------------------------------------------------------------------------

for (const [format, write] of Object.entries(writers))
  test(`${format}: random shapes at random places keep their shape at every level`, async () => {
    for (let run = 0; run < 12; run++) {
      const size = [1, 0.01, 37.5][run % 3];
      const offset = [0, 1, 2].map(() => Math.round((random() - 0.5) * 10 ** (2 + run * 0.6) * 1e4) / 1e4);
      const points = shifted(shapeOf(size), offset);
      const { model, description } = await upload(write(points));
      const near = await upload(write(shapeOf(size)));
      const tolerance = toleranceAt(offset, size);
      const why = `run ${run}, ${size} m at ${offset}`;
      assertSamePlaces(await pointsOf(model, 'obj?level=0'), points, tolerance, why);
      assertSamePlaces(await worldOf(await ask(model, 'glb?level=0')), points, tolerance, why);
      const isFar = Math.max(...offset.map(Math.abs)) > 64 * size;
      for (const level of [1, 2]) {
        const within = isFar ? tolerance : nearFactor * tolerance;
        const wanted = shifted(await pointsOf(near.model, `obj?level=${level}`), offset);
        assertSamePlaces(await pointsOf(model, `obj?level=${level}`), wanted, within, `${why}, level ${level}`);
        assertSamePlaces(await worldOf(await ask(model, `glb?level=${level}`)), wanted, within, `${why}, level ${level}`);
      }
      if (isFar) {
        const { translation } = description.nodes[0].rest;
        assert.match(description.warnings.join(), /so far from the origin that floats would lose its shape: its points are relative to/);
        assert.ok(distance(translation, offset) <= 2 * size + 1e-6 * Math.max(...offset.map(Math.abs)), why);
        assert.ok(description.meshes[0].bounds.max.every((x) => Math.abs(x) <= 4 * size), why);
      }
    }
  });

test('binary STL keeps at every level what its floats say', async () => {
  const points = shifted(shapeOf(8), [465000, 5428000, 120]).map((point) => point.map(Math.fround));
  const { model } = await upload(binaryStl(points));
  assertSamePlaces(await pointsOf(model, 'obj?level=0'), points, 1e-6, 'level 0');
  const near = await upload(binaryStl(shifted(points, [-465000, -5428000, -120])));
  const wanted = shifted(await pointsOf(near.model, 'obj?level=2'), [465000, 5428000, 120]);
  assertSamePlaces(await pointsOf(model, 'obj?level=2'), wanted, 8e-6, 'level 2');
});

test('a cube of one metre in UTM coordinates reads back as it is, in OBJ and by way of GLB', async () => {
  const offset = [465000.25, 5428000.5, 120];
  const source = shifted(shapeOf(1), offset).map((point) => point.map((x) => Number(x.toFixed(6))));
  const { model, description } = await upload(writers.obj(source));
  assert.deepEqual(description.nodes[0].rest.translation, [465001, 5428001, 121]);
  assert.deepEqual(await pointsOf(model, 'obj?level=0'), source);
  const glb = await ask(model, 'glb?level=0&polygons=ngon');
  assert.deepEqual(await objections(glb), []);
  const again = await upload(glb);
  assert.deepEqual(await pointsOf(again.model, 'obj?level=0'), source);
  for (const encoding of ['quantized', 'meshopt'])
    assertSamePlaces(await worldOf(await ask(model, `glb?level=0&encoding=${encoding}`)), source, 1e-4, encoding);
});

test('meshes near the origin stay where they are', async () => {
  const source = shifted(shapeOf(1), [7.5, -3, 2]);
  const { model, description } = await upload(writers.obj(source));
  assert.deepEqual(description.warnings, []);
  assert.deepEqual(description.nodes[0].rest.translation, [0, 0, 0]);
  assert.deepEqual(description.meshes[0].bounds, { min: [7.5, -3, 2], max: [8.5, -2, 3] });
  assert.deepEqual((await pointsOf(model, 'obj?level=0')).length, 8);
});

test('objects of one OBJ have a frame each, and one that is near has none', async () => {
  const parts = [[465000.125, 5428000.375, 120], [0, 0, 0], [465002.5, 5428000.375, 121.3]];
  const all = parts.map((offset) => shifted(shapeOf(1), offset));
  const text = all.map((points, k) => `o part${k}\n` + writers.obj(points).replace(/^f .*$/gm, (line) => line.replace(/\d+/g, (i) => Number(i) + 8 * k))).join('');
  const { model, description } = await upload(text);
  assert.equal(description.nodes.length, 3);
  assert.deepEqual(description.nodes[1].rest.translation, [0, 0, 0]);
  assert.match(description.warnings.join(), /mesh 0 lies so far .* and 1 more mesh likewise/);
  assertSamePlaces(await pointsOf(model, 'obj?level=0'), all.flat(), 1e-6, 'level 0');
});

test('a point that no face uses does not keep a mesh from its frame', async () => {
  const source = shifted(shapeOf(1), [465000.25, 5428000.5, 120]);
  const { model } = await upload(writers.obj(source).replace('f ', 'v 0 0 0\nf '));
  assertSamePlaces(await pointsOf(model, 'obj?level=0'), source, 1e-6, 'level 0');
});

test('nodes of tweend JSON that turn, scale, move or have children get a child that carries the mesh', async () => {
  const offset = [-81234.5, 654321.75, 1e6];
  const positions = shifted(shapeOf(1), offset);
  const rotation = new Quaternion().setFromAxisAngle(new Vector3(0.6, 0, 0.8), 1).toArray();
  const kinds = {
    turned: { rotation },
    scaled: { scale: [2, 3, 0.5] },
    plain: { translation: [10, 20, 30] },
    parent: {},
  };
  for (const [name, own] of Object.entries(kinds)) {
    const nodes = [{ name, mesh: 'hull', ...own }, ...(name === 'parent' ? [{ name: 'child', parent: name, translation: [1, 2, 3] }] : [])];
    const { model, description } = await upload(JSON.stringify({ meshes: [{ name: 'hull', positions, faces: FACES }], nodes }));
    const matrix = new Matrix4().compose(
      new Vector3(...(own.translation ?? [0, 0, 0])), new Quaternion(...(own.rotation ?? [0, 0, 0, 1])), new Vector3(...(own.scale ?? [1, 1, 1])),
    );
    const wanted = positions.map((point) => new Vector3(...point).applyMatrix4(matrix).toArray());
    const glb = await ask(model, 'glb?level=0');
    const world = await worldOf(glb);
    // Places are as near as the rotation's floats let them be; the shape is exact.
    const shift = world[0].map((x, c) => x - wanted.reduce((best, at) => (distance(at, world[0]) < distance(best, world[0]) ? at : best))[c]);
    assert.ok(distance(shift, [0, 0, 0]) < (name === 'turned' ? 0.3 : 1e-6), `${name} lies ${shift} away`);
    assertSamePlaces(shifted(world, shift.map((x) => -x)), wanted, 4e-6, name);
    assert.equal(description.nodes.length, nodes.length + (name === 'plain' ? 0 : 1));
    const named = nodesOf(await load(glb));
    assert.equal((await named)[0].name, name);
  }
  const moved = { name: 'slide', tracks: [{ node: 'hull', path: 'translation', times: [0, 1], values: [[0, 0, 0], [5, 0, 0]] }] };
  const { model } = await upload(JSON.stringify({ meshes: [{ name: 'hull', positions, faces: FACES }], nodes: [{ name: 'hull', mesh: 'hull' }], clips: [moved] }));
  assertSamePlaces(await pointsOf(model, 'obj?level=0&at=1'), shifted(positions, [5, 0, 0]), 1e-6, 'posed');
});

/** A cuboid near its own origin, below two nodes of a glTF that carry it far. */
function chainOf(links) {
  const points = new Float32Array(TRIANGLES.flatMap((corners) => corners.flatMap((i) => shapeOf(1)[i])));
  const document = {
    asset: { version: '2.0' }, buffers: [{ byteLength: points.byteLength, uri: `data:application/octet-stream;base64,${Buffer.from(points.buffer).toString('base64')}` }],
    bufferViews: [{ buffer: 0, byteLength: points.byteLength }],
    accessors: [{ bufferView: 0, componentType: 5126, count: points.length / 3, type: 'VEC3', min: [0, 0, 0], max: [1, 1, 1] }],
    meshes: [{ primitives: [{ attributes: { POSITION: 0 } }] }], nodes: [], scenes: [{ nodes: [] }], scene: 0,
  };
  for (const [above, below] of links) {
    document.scenes[0].nodes.push(document.nodes.length);
    document.nodes.push({ ...above, children: [document.nodes.length + 1] }, { ...below, mesh: 0 });
  }
  return JSON.stringify(document);
}

test('nodes of glTF and tweend JSON that carry meshes far keep the distances between these', async () => {
  const turned = new Quaternion().setFromAxisAngle(new Vector3(1, 0, 0), -Math.PI / 2).toArray();
  const at = () => [500000 + random() * 100, 5412000 + random() * 100, random() * 100];
  const matrix = (t) => ({ matrix: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, ...t, 1] });
  const kinds = {
    'the upper node': () => [{ translation: at() }, { translation: [random(), random(), random()] }],
    'the lower node': () => [{ rotation: turned }, { translation: at() }],
    'a matrix': () => [matrix(at()), { rotation: turned }],
    'both, scaled': () => [{ translation: at(), scale: [2, 2, 2] }, matrix(at())],
  };
  const low = (points) => points.reduce((a, b) => a.map((x, c) => Math.min(x, b[c])));
  // Rotations that are floats turn the whole a little about the origin; its shape is exact.
  const assertSameShape = (found, wanted, room, why) => {
    const shift = low(wanted).map((x, c) => x - low(found)[c]);
    assert.ok(distance(shift, [0, 0, 0]) <= room, `${why} lies ${shift} away`);
    assertSamePlaces(shifted(found, shift), wanted, 2e-5, why);
  };
  for (const [kind, link] of Object.entries(kinds)) {
    const source = chainOf([link(), link(), link()]);
    const wanted = await worldOf(source); // of the file, by three in double
    const room = kind === 'the lower node' ? 0.5 : 1e-6;
    const { model } = await upload(source);
    const glb = await ask(model, 'glb?level=0');
    assertSameShape(await worldOf(glb), wanted, room, `${kind}, GLB`);
    assertSameShape(await pointsOf(model, 'obj?level=0'), wanted, room, `${kind}, OBJ`);
    const again = await upload(glb);
    assertSameShape(await pointsOf(again.model, 'obj?level=0'), wanted, room, `${kind}, OBJ of the GLB`);
    const stl = await ask(model, 'stl?level=0&unit=m');
    const corners = Array.from({ length: stl.readUInt32LE(80) * 3 }, (_, i) => [0, 1, 2].map((c) => stl.readFloatLE(84 + 50 * Math.floor(i / 3) + 12 + 12 * (i % 3) + 4 * c)));
    assertSameShape(corners, wanted, Infinity, `${kind}, STL`);
  }
  const places = [at(), at()];
  const nodes = places.map((translation) => ({ mesh: 'hull', translation }));
  const { model } = await upload(JSON.stringify({ meshes: [{ name: 'hull', positions: shapeOf(1), faces: FACES }], nodes }));
  assertSamePlaces(await pointsOf(model, 'obj?level=0'), places.flatMap((place) => shifted(shapeOf(1), place)), 2e-6, 'JSON');
});

test('details and edits of a far mesh are made in its frame', async () => {
  const offset = [465000.25, 5428000.5, 120];
  const { model } = await upload(writers.obj(shifted(shapeOf(1), offset)));
  const post = async (path, body, type) => {
    const answer = await fetch(`${model}/${path}`, { method: 'POST', headers: { 'Content-Type': type }, body });
    assert.ok(answer.ok, await answer.clone().text());
    return `${daemon.url}/v1/models/${(await answer.json()).id}`;
  };
  const obj = (await ask(model, 'obj?level=1')).toString();
  assert.equal(await post('detail?level=1', obj, 'model/obj'), model); // nothing has moved
  const points = numbers(obj, 'v');
  points[3][2] += 0.125;
  for (const body of [{ positions: points }, { positions: points.flat() }]) {
    const sculpted = await post('detail?level=1', JSON.stringify(body), 'application/json');
    const found = await pointsOf(sculpted, 'obj?level=1');
    found.forEach((point, i) => assert.ok(distance(point, points[i]) < 1e-6, `point ${i}`));
  }
  const edits = [{ edit: 'move', vertices: { inside: { min: [0, 0, 0], max: [1, 1, 1] } }, by: [0, 0, 0.5] }];
  const edited = await post('edits', JSON.stringify({ edits }), 'application/json');
  const wanted = shifted(shapeOf(1), offset);
  const lifted = wanted.map(([x, y, z]) => [x, y, x > 465001 && y > 5428001 && z > 120.5 ? z + 0.5 : z]);
  assertSamePlaces(await pointsOf(edited, 'obj?level=0'), lifted, 1e-6, 'edited');
});

test('edits in a document have its coordinates, however far its points are', async () => {
  const place = ([x, y, z], at) => [x + at[0], y + at[1], z + at[2]];
  const edits = (at) => [
    { edit: 'move', vertices: { inside: { min: place([0, 0, 1], at), max: place([1, 1, 1], at) } }, by: [0, 0, 0.5] },
    { edit: 'rotate', vertices: 'all', axis: 'z', degrees: 30, about: place([1, 2, 0], at) },
    { edit: 'scale', vertices: 'all', by: 2, about: place([0.1, 0, 0.3], at) },
    { edit: 'merge', vertices: [0, 1], to: place([-0.3, 0.1, 0.2], at) },
  ];
  const document = (at, list) => JSON.stringify({ meshes: [{ name: 'm', positions: shifted(shapeOf(1), at), faces: FACES, edits: list }], nodes: [{ mesh: 'm' }] });
  const offset = [465000.25, 5428000.5, 120];
  const near = await upload(document([0, 0, 0], edits([0, 0, 0]))), far = await upload(document(offset, edits(offset)));
  assertSamePlaces(await pointsOf(far.model, 'obj?level=0'), shifted(await pointsOf(near.model, 'obj?level=0'), offset), 1e-6, 'edited');
  const refused = await fetch(`${daemon.url}/v1/models`, { method: 'POST', headers: { 'Content-Type': 'application/json' }, body: document(offset, [...edits(offset), { edit: 'mirror', axis: 'x' }]) });
  assert.equal(refused.status, 422);
  assert.equal((await refused.json()).errors[0].pointer, '/meshes/0/edits/4');
});

test('STL and PLY tell of meshes so far apart that floats change their shape', async () => {
  const ask = async (nodes, form) => {
    const model = await daemon.upload(JSON.stringify({ meshes: [{ name: 'a', positions: shapeOf(1), faces: FACES }], nodes }));
    const answer = await fetch(`${model}/surface.${form}?level=1&unit=m&normals=none`);
    const warning = decodeURIComponent(answer.headers.get('X-Tweend-Warning') ?? '');
    return { warnings: parseInt(warning, 10), warning, bytes: Buffer.from(await answer.arrayBuffer()) };
  };
  const node = (name, ...translation) => ({ name, mesh: 'a', translation });
  // An edge of each triangle of the first mesh, against those of the mesh at the origin.
  const edges = (bytes) => Array.from({ length: 48 }, (_, i) => {
    const at = (corner, c) => bytes.readFloatLE(84 + 50 * i + 12 + 12 * corner + 4 * c);
    return Math.hypot(...[0, 1, 2].map((c) => at(1, c) - at(0, c)));
  });
  const right = edges((await ask([node('n', 0, 0, 0)], 'stl')).bytes);
  const loss = (bytes) => Math.max(...edges(bytes).map((x, i) => Math.abs(x - right[i])));
  const together = await ask([node('n', 5e6, 0, 0), node('m', 5e6 + 4, 0, 0)], 'stl');
  assert.ok(loss(together.bytes) < 3e-6);
  const apart = await ask([node('n', 0, 0, 0), node('m', 5e6, 0, 0)], 'stl');
  assert.ok(loss(apart.bytes) > 0.01);
  assert.equal(apart.warnings, together.warnings + 1, apart.warning);
  const ply = async (x) => (await ask([node('n', 0, 0, 0), node('m', x, 0, 0), node('o', -x, 0, 0)], 'ply')).warnings;
  assert.equal(await ply(5e6), 1 + 2, 'nodes, all is moved, and two meshes are far');
  assert.equal(await ply(4), 1);
});
