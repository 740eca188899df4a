// Colours and labels of faces: each face of the file has vertices of its own, with a colour and numbers that differ from
// its neighbours'. At every level each triangle has those of its face, in every encoding, after edits and on the way back.
import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';

import { Document, NodeIO } from '@gltf-transform/core';
import { ALL_EXTENSIONS } from '@gltf-transform/extensions';
import { MeshoptDecoder } from 'meshoptimizer';

import { Daemon } from './daemon.mjs';
import { objections } from './objections.mjs';

// ---- the file -----------------------------------------------------------------------------------------

const [COLUMNS, ROWS] = [4, 3];
const FACES = COLUMNS * ROWS;
/** Of each face; the last one is in a primitive without colours. */
const colors = [...Array(FACES).keys()].map((f) => (f === FACES - 1 ? [1, 1, 1, 1] : [f % 2, (f >> 1) % 2, (f >> 2) % 2, f % 3 ? 1 : 51 / 255]));
const labelsOf = (f) => ({ _FEATURE_ID_0: [f], _BATCH: [60000 - f], _SIGNED: [-1 - f, f], _REAL: [f / 4] });

function makeFile() {
  const chunks = [];
  const document = { asset: { version: '2.0' }, scene: 0, accessors: [], bufferViews: [], meshes: [{ primitives: [] }] };
  let size = 0;
  const add = (array, width, more) => {
    const bytes = Buffer.from(array.buffer);
    const row = (bytes.length / array.length) * width;
    const count = array.length / width;
    const padded = more?.isIndex ? bytes : Buffer.concat([...Array(count).keys()].flatMap((i) => [bytes.subarray(i * row, (i + 1) * row), Buffer.alloc(-row & 3)]));
    const componentType = { Int8Array: 5120, Uint8Array: 5121, Uint16Array: 5123, Float32Array: 5126 }[array.constructor.name];
    const byteStride = more?.isIndex ? {} : { byteStride: (row + 3) & ~3 };
    document.bufferViews.push({ buffer: 0, byteOffset: size, byteLength: padded.length, ...byteStride });
    size += (padded.length + 3) & ~3;
    chunks.push(padded, Buffer.alloc(-padded.length & 3));
    const { isIndex, ...members } = more ?? {};
    const accessor = { bufferView: document.bufferViews.length - 1, componentType, count, type: ['SCALAR', 'VEC2', 'VEC3', 'VEC4'][width - 1] };
    return document.accessors.push({ ...accessor, ...members }) - 1;
  };
  for (const faces of [[...Array(FACES - 1).keys()], [FACES - 1]]) {
    const each = (values) => faces.flatMap((f) => Array(4).fill(values(f)).flat());
    const corners = faces.flatMap((f) => [[0, 0], [1, 0], [1, 1], [0, 1]].flatMap(([x, y]) => [(f % COLUMNS) + x, Math.floor(f / COLUMNS) + y, 0]));
    const attributes = {
      POSITION: add(new Float32Array(corners), 3, { min: [0, 0, 0], max: [COLUMNS, ROWS, 0] }),
      _FEATURE_ID_0: add(new Float32Array(each((f) => labelsOf(f)._FEATURE_ID_0)), 1),
      _BATCH: add(new Uint16Array(each((f) => labelsOf(f)._BATCH)), 1),
      _SIGNED: add(new Int8Array(each((f) => labelsOf(f)._SIGNED)), 2),
      _REAL: add(new Float32Array(each((f) => labelsOf(f)._REAL)), 1),
    };
    if (faces.length > 1) attributes.COLOR_0 = add(new Uint8Array(each((f) => colors[f].map((c) => c * 255))), 4, { normalized: true });
    const indices = add(new Uint16Array(faces.flatMap((_, i) => [0, 1, 2, 0, 2, 3].map((c) => 4 * i + c))), 1, { isIndex: true });
    document.meshes[0].primitives.push({ attributes, indices });
  }
  document.nodes = [{ mesh: 0 }];
  document.scenes = [{ nodes: [0] }];
  document.buffers = [{ byteLength: size, uri: `data:application/octet-stream;base64,${Buffer.concat(chunks).toString('base64')}` }];
  return JSON.stringify(document);
}

// ---- what an answer says ----------------------------------------------------------------------------------

/** The vertices of each triangle with all that they have. */
async function trianglesOf(bytes) {
  await MeshoptDecoder.ready;
  const io = new NodeIO().registerExtensions(ALL_EXTENSIONS).registerDependencies({ 'meshopt.decoder': MeshoptDecoder });
  const document = await io.readBinary(new Uint8Array(bytes));
  return document.getRoot().listMeshes().flatMap((mesh) => mesh.listPrimitives()).flatMap((part) => {
    const indices = [...part.getIndices().getArray()];
    const corner = (i) => Object.fromEntries(part.listSemantics().map((name) => [name, part.getAttribute(name).getElement(i, [])]));
    return [...Array(indices.length / 3).keys()].map((t) => [0, 1, 2].map((k) => corner(indices[3 * t + k])));
  });
}

/** Whether each triangle has the values of one face. perFace: triangles of each face that the answer has. */
function assertFaces(triangles, perFace, faces = FACES) {
  const counts = Array(FACES).fill(0);
  for (const corners of triangles) {
    const [face] = corners[0]._FEATURE_ID_0;
    counts[face]++;
    for (const corner of corners) {
      for (const name of ['_FEATURE_ID_0', '_BATCH', '_SIGNED']) assert.deepEqual(corner[name], labelsOf(face)[name], name);
      assert.ok(Math.abs(corner._REAL[0] - labelsOf(face)._REAL[0]) < 1e-5);
      corner.COLOR_0.forEach((c, k) => assert.ok(Math.abs(c - colors[face][k]) < 1e-4, `${corner.COLOR_0} is not ${colors[face]}`));
    }
  }
  assert.deepEqual(counts, Array(FACES).fill(perFace).fill(0, faces));
}

// ---- tests --------------------------------------------------------------------------------------------

const daemon = new Daemon();
let model;
before(async () => {
  await daemon.start();
  model = await daemon.upload(makeFile());
});
after(() => daemon.remove());

async function ask(query, at = model) {
  const response = await fetch(`${at}/surface.${query}`);
  assert.equal(response.status, 200, query);
  return { bytes: Buffer.from(await response.arrayBuffer()), warning: decodeURIComponent(response.headers.get('X-Tweend-Warning') ?? '') };
}

for (const level of [0, 1, 2, 3, 4])
  for (const encoding of ['float', 'quantized', 'meshopt'])
    for (const more of ['', '&uv=none&normals=limit', '&uv=all&limit=true', '&scheme=bilinear', '&creasing=chaikin&boundary=edge-only'])
      test(`level ${level}, ${encoding}${more}: each triangle has the values of its face`, async () => {
        const { bytes, warning } = await ask(`glb?level=${level}&encoding=${encoding}&quads=auto${more}`);
        assert.match(warning, /^3; the attribute COLOR_0 is white and opaque where a primitive lacks it/);
        assertFaces(await trianglesOf(bytes), 2 * 4 ** level);
        assert.deepEqual(await objections(bytes), []);
      });

test('integers keep their type, and numbers that are not integers are floats', async () => {
  const { bytes } = await ask('glb?level=2');
  const size = bytes.readUInt32LE(12);
  const { accessors, meshes } = JSON.parse(bytes.subarray(20, 20 + size));
  const { attributes } = meshes[0].primitives[0];
  const types = { _FEATURE_ID_0: 5126, _BATCH: 5123, _SIGNED: 5120, _REAL: 5126 };
  for (const [name, type] of Object.entries(types)) {
    assert.equal(accessors[attributes[name]].componentType, type, name);
    assert.ok(!accessors[attributes[name]].normalized);
  }
});

for (const query of ['level=0', 'level=0&polygons=ngon', 'level=0&encoding=meshopt&polygons=ngon'])
  test(`${query} read again has the same faces at the next level`, async () => {
    const { bytes } = await ask(`glb?quads=auto&${query}`);
    const again = await daemon.upload(bytes);
    for (const level of [0, 2]) assertFaces(await trianglesOf((await ask(`glb?level=${level}&quads=auto`, again)).bytes), 2 * 4 ** level);
  });

async function made(path, body) {
  const response = await fetch(`${model}/${path}`, { method: 'POST', headers: { 'Content-Type': 'application/json' }, body: JSON.stringify(body) });
  const answer = await response.json();
  assert.ok(answer.id, JSON.stringify(answer));
  return `${daemon.url}/v1/models/${answer.id}`;
}

test('edits keep the values of faces, and cut them as they are', async () => {
  const edits = [
    { edit: 'triangulate', faces: 'all' },
    { edit: 'subdivide', faces: 'all', cuts: 1 },
  ];
  const cut = await made('edits?quads=auto', { edits });
  assertFaces(await trianglesOf((await ask('glb?level=0', cut)).bytes), 8);
  const walls = await made('edits?quads=auto', { edits: [{ edit: 'extrude', faces: [0], distance: 1 }] });
  const triangles = await trianglesOf((await ask('glb?level=1', walls)).bytes);
  const counts = triangles.map(([corner]) => corner._FEATURE_ID_0[0]).filter((face) => face === 0).length;
  assert.equal(counts, 5 * 8); // the face and its four walls
});

test('OBJ has one colour a point, and says so', async () => {
  const { warning } = await ask('obj?level=1');
  // Of 20 points four have one face each, and one has the last face and another white one.
  assert.match(warning, /^4; surface\.obj is without the further colours of 15 control points where faces differ \(it has one a point\), alpha, attributes of the application$/);
});

// An element of four bytes is as long as a float.
for (const Type of [Int8Array, Uint8Array, Int16Array, Uint16Array])
  for (const [i, type] of ['SCALAR', 'VEC2', 'VEC3', 'VEC4'].entries())
    test(`${type} of ${Type.name} arrive as the only attribute`, async () => {
      const document = new Document();
      const buffer = document.createBuffer();
      const add = (kind, array) => document.createAccessor().setType(kind).setArray(array).setBuffer(buffer);
      const wanted = [...Array(i + 1).keys()].map((c) => 100 + c);
      const part = document.createPrimitive();
      part.setAttribute('POSITION', add('VEC3', new Float32Array([0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0])));
      part.setAttribute('_ID', add(type, Type.from(Array(4).fill(wanted).flat())));
      part.setIndices(add('SCALAR', new Uint16Array([0, 1, 2, 0, 2, 3])));
      const node = document.createNode().setMesh(document.createMesh().addPrimitive(part));
      document.createScene().addChild(node);
      const at = await daemon.upload(await new NodeIO().writeBinary(document));
      for (const query of ['glb?level=0', 'glb?level=1', 'glb?level=1&normals=none', 'glb?level=1&encoding=meshopt'])
        for (const corners of await trianglesOf((await ask(query, at)).bytes))
          for (const corner of corners) assert.deepEqual(corner._ID, wanted, query);
    });
