// Quantized and compressed answers: the validator objects to nothing, three.js and glTF-Transform read what they read
// of float answers, and every vertex is where it was at any time of a clip, whatever joints and morph targets do.
import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';

import { NodeIO } from '@gltf-transform/core';
import { ALL_EXTENSIONS } from '@gltf-transform/extensions';
import { MeshoptDecoder } from 'meshoptimizer';
import { Box3, Vector3 } from 'three';

import { Daemon } from './daemon.mjs';
import { figure } from './figure.mjs';
import { objections } from './objections.mjs';
import { load, playerOf } from './player.mjs';
import { writeSamples } from './samples.mjs';

const daemon = new Daemon();
const samples = [...writeSamples(), { name: 'figure', glb: figure() }].filter(
  ({ name, glb }) => name !== 'empty' && glb.length < 300000,
);
const models = new Map();

before(async () => {
  await daemon.start();
  for (const { name, glb } of samples) models.set(name, await daemon.upload(glb));
});
after(() => daemon.remove());

async function answer(model, query) {
  const response = await fetch(`${model}/surface.glb?${query}`);
  assert.equal(response.status, 200, query);
  return Buffer.from(await response.arrayBuffer());
}

/** World positions of all corners of all triangles, in the file's order. */
function corners(gltf) {
  const out = [];
  const point = new Vector3();
  gltf.scene.updateMatrixWorld(true);
  gltf.scene.traverse((object) => {
    if (!object.isMesh || !object.geometry.index) return;
    const { index } = object.geometry;
    for (let i = 0; i < index.count; i++) {
      object.getVertexPosition(index.getX(i), point);
      out.push(object.localToWorld(point.clone()));
    }
  });
  return out;
}

const boxOf = (points) => new Box3().setFromPoints(points);
const sizeOf = (box) => box.getSize(new Vector3()).length();

/** Compares corner by corner: polygons=ngon keeps the order of triangles in every encoding. */
function assertSame(exact, coded, why) {
  const a = corners(exact);
  const b = corners(coded);
  assert.equal(a.length, b.length, why);
  if (a.length === 0) return;
  const tolerance = 2e-3 * sizeOf(boxOf(a)) + 1e-6; // weights have 8 bits
  a.forEach((point, i) => {
    const distance = point.distanceTo(b[i]);
    assert.ok(distance <= tolerance, `${why}: corner ${i} lies ${distance} away of ${tolerance}`);
  });
}

for (const { name } of samples) {
  for (const encoding of ['quantized', 'meshopt']) {
    test(`${name}: every corner of encoding=${encoding} is where it was`, async () => {
      for (const level of [0, 2]) {
        const query = `level=${level}&polygons=ngon`;
        const exact = await load(await answer(models.get(name), query));
        const coded = await load(await answer(models.get(name), `${query}&encoding=${encoding}`));
        assertSame(exact, coded, `level ${level}`);
        if (exact.animations.length === 0) continue;
        const [play, playCoded] = [playerOf(exact), playerOf(coded)];
        const { duration } = exact.animations[0];
        for (let step = 0; step < 20; step++) {
          const time = (duration * step) / 19;
          play(time);
          playCoded(time);
          assertSame(exact, coded, `level ${level} at ${time} s`);
        }
      }
    });
  }

  test(`${name}: the validator takes encoding=quantized`, async () => {
    for (const level of [0, 1]) {
      const bytes = await answer(models.get(name), `level=${level}&encoding=quantized`);
      assert.deepEqual(await objections(bytes), []);
    }
  });

  test(`${name}: glTF-Transform reads encoding=meshopt`, async () => {
    await MeshoptDecoder.ready;
    const io = new NodeIO().registerExtensions(ALL_EXTENSIONS).registerDependencies({ 'meshopt.decoder': MeshoptDecoder });
    const read = async (encoding) => io.readBinary(new Uint8Array(await answer(models.get(name), `level=2&encoding=${encoding}`)));
    const [exact, coded] = [(await read('float')).getRoot(), (await read('meshopt')).getRoot()];
    const triangles = (root) =>
      root.listMeshes().map((mesh) => mesh.listPrimitives().reduce((sum, part) => sum + (part.getIndices()?.getCount() ?? 0), 0));
    assert.deepEqual(triangles(coded), triangles(exact));
    for (const part of coded.listMeshes().flatMap((mesh) => mesh.listPrimitives()))
      assert.ok(part.getAttribute('POSITION').getCount() <= 65534);
    const names = (root) => root.listNodes().map((node) => node.getName()).filter(Boolean);
    assert.deepEqual(names(coded), names(exact));
  });
}

test('surface.json tells the size of a compressed answer, which HEAD knows from then on', async () => {
  const model = models.get(samples[0].name);
  const query = 'level=3&encoding=meshopt';
  const length = async () => (await fetch(`${model}/surface.glb?${query}`, { method: 'HEAD' })).headers.get('Content-Length');
  assert.equal(await length(), null);
  const { bytes } = await (await fetch(`${model}/surface.json?${query}`)).json();
  assert.equal(await length(), String(bytes));
  assert.equal((await answer(model, query)).length, bytes);
});

test('what a cage loses with triangles or an encoding is told, and nothing else', async () => {
  const square = 'v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 2 0\nv 1 2 0\n';
  const texture = 'vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvt 1 2\nvt 0 2\n';
  const rule = 't interpolateboundary 1/0/0 1\n';
  // [what is lost, the faces]
  const kinds = [
    ['', 'f 1 2 3 4\nf 4 3 6 5\n'],
    ['creases', 'f 1 2 3 4\nf 4 3 6 5\nt crease 2/1/0 2 3 2.5\n'],
    ['corners', 'f 1 2 3 4\nf 4 3 6 5\nt corner 1/1/0 3 2\n'],
    ['holes', 'f 1 2 3 4\nf 4 3 6 5\nt hole 1/0/0 1\n'],
    ['groups', 'g roof\nf 1 2 3 4\ng wall\nf 4 3 6 5\n'],
    ['rules', 'f 1 2 3 4\nf 4 3 6 5\nt interpolateboundary 1/0/0 2\n'],
    ['seams between equal values, rules', `${texture}vt 0 1\nvt 1 1\nf 1/1 2/2 3/3 4/4\nf 4/7 3/8 6/5 5/6\n${rule}`],
    // Where the values are equal at one end of the edge alone, readers keep the seam.
    ['rules', `${texture}vt .5 1\nvt 1 1\nf 1/1 2/2 3/3 4/4\nf 4/7 3/8 6/5 5/6\n${rule}`],
    ['rules', `${texture}f 1/1 2/2 3/3 4/4\nf 4/4 3/3 6/5 5/6\n${rule}`],
    ['points apart at one place, rules', `v 0 1 0\nv 1 1 0\nf 1 2 3 4\nf 7 8 6 5\n${rule}`],
    // Faces that only touch: one vertex is one point, two are two.
    ['rules', `${texture}f 1/1 2/2 3/3 4/4\nf 3/3 6/5 5/6\n${rule}`],
    ['points that no edge joins, rules', `${texture}f 1/1 2/2 3/3 4/4\nf 3/2 6/5 5/6\n${rule}`],
    ['rules', `v 0 1 0\nv 1 1 0.5\nf 1 2 3 4\nf 7 8 6 5\n${rule}`], // apart at one end
  ];
  const facts = async (model) => {
    const { meshes: [{ creases, corners, holes, groups, vertices }] } = await (await fetch(model)).json();
    const lines = (await (await fetch(`${model}/surface.obj?level=1&boundary=edge-only`)).text()).split('\n');
    const texture = lines.filter((line) => line.startsWith('vt ')).length;
    return { creases, corners, holes, vertices, groups: groups.map(({ name }) => name), texture };
  };
  for (const [lost, faces] of kinds) {
    const model = await daemon.upload(square + faces);
    const cage = await facts(model);
    for (const polygons of ['ngon', 'triangles'])
      for (const encoding of ['float', 'quantized', 'meshopt']) {
        const query = `${model}/surface.glb?level=0&polygons=${polygons}&normals=none&encoding=${encoding}`;
        const response = await fetch(query);
        const warning = decodeURIComponent(response.headers.get('X-Tweend-Warning') ?? '');
        const again = await facts(await daemon.upload(Buffer.from(await response.arrayBuffer())));
        const keepers = [...(polygons === 'ngon' ? [] : ['polygons=ngon']), ...(encoding === 'float' ? [] : ['encoding=float'])];
        const besides = polygons === 'ngon' ? 'polygons' : 'triangles';
        const told = `1; ${keepers.join(' with ')} alone keeps what the cage has besides ${besides}: ${lost}`;
        assert.equal(warning, lost && keepers.length > 0 ? told : '', `${lost} ${polygons} ${encoding}`);
        // Facts have no rules; anything else that is told is lost, or there would be nothing to tell.
        if (warning === '' || lost === 'rules') assert.deepEqual(again, cage, `${lost} ${polygons} ${encoding}`);
        else assert.notDeepEqual(again, cage, `${lost} ${polygons} ${encoding}`);
        for (const other of [query.replace('level=0', 'level=1'), `${query}&limit=true`, query.replace('surface.glb', 'surface.json')])
          assert.equal((await fetch(other)).headers.get('X-Tweend-Warning'), null, other);
      }
  }
});
