// level=auto on the samples: the answer's triangles are within `error` of the limit surface, and it of them, both as three reads
// them; the level below is not, or the one below that. The limit surface is that of points pushed to it two levels deeper.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { after, before, test } from 'node:test';

import { Triangle, Vector3 } from 'three';
import { STLLoader } from 'three/addons/loaders/STLLoader.js';

import { Daemon, root } from './daemon.mjs';

const POINTS = 120; // that are measured each way

const daemon = new Daemon();
before(() => daemon.start());
after(() => daemon.remove());

async function triangles(model, query) {
  const response = await fetch(`${model}/surface.stl?unit=m&${query}`);
  assert.equal(response.status, 200, query);
  const bytes = await response.arrayBuffer(), { position } = new STLLoader().parse(bytes).attributes;
  const at = (i) => new Vector3().fromBufferAttribute(position, i);
  const list = Array.from({ length: position.count / 3 }, (_, i) => new Triangle(at(3 * i), at(3 * i + 1), at(3 * i + 2)));
  return { list: list.map((triangle) => ({ triangle, centre: triangle.getMidpoint(new Vector3()) })), headers: response.headers };
}

const radius = ({ triangle: { a, b, c }, centre }) => Math.max(a.distanceTo(centre), b.distanceTo(centre), c.distanceTo(centre));

/** Corners and middles of triangles all over a surface. */
function pointsOf(list) {
  const step = Math.max(1, Math.floor((2 * list.length) / POINTS));
  return list.filter((_, i) => i % step === 0).flatMap(({ triangle, centre }) => [triangle.a, triangle.a.clone().lerp(triangle.b, 0.5), centre]);
}

/** The greatest distance of points from triangles. */
function distance(points, list) {
  const reach = Math.max(...list.slice(0, 5000).map(radius), 0) * 4, foot = new Vector3();
  return Math.max(...points.map((point) => {
    let best = Infinity;
    for (const { triangle, centre } of list)
      if (point.distanceTo(centre) - reach < best) best = Math.min(best, triangle.closestPointToPoint(point, foot).distanceTo(point));
    return best;
  }));
}

const between = (a, b) => Math.max(distance(pointsOf(a), b), distance(pointsOf(b), a));

for (const [name, file, errors] of [['cube', 'cube.obj', [0.5, 0.2, 0.1, 0.05, 0.02]], ['octopus', 'octopus.obj', [0.5, 0.2]]])
  for (const error of errors)
    test(`${name}: the answer is within ${error}`, async () => {
      const model = await daemon.upload(readFileSync(join(root, 'server/samples', file)));
      const { list, headers } = await triangles(model, `level=auto&error=${error}`), level = Number(headers.get('x-tweend-level'));
      const told = Number(headers.get('x-tweend-error').match(/surface=([^,]+)/)[1]), limit = (await triangles(model, `level=${level + 2}&limit=true`)).list;
      const found = between(list, limit);
      assert.ok(told <= error && found <= told * 1.1, `found ${found}, told ${told}`); // the limit's triangles are off by some 6 %
      if (level < 2) return;
      const before = between((await triangles(model, `level=${level - 2}`)).list, limit);
      assert.ok(before > error, `level ${level - 2} is within ${before}`);
    });

/** A box of a hundred and fifty triangles whose morph target, shown at rest, makes it ten times as large. */
function growing() {
  const side = 5, points = [], indices = [];
  for (const [u, v, w] of [[0, 1, 2], [1, 2, 0], [2, 0, 1]])
    for (const sign of [-1, 1]) {
      const first = points.length / 3;
      for (let i = 0; i <= side; i++)
        for (let k = 0; k <= side; k++) {
          const point = [];
          [point[u], point[v], point[w]] = [(2 * i) / side - 1, (2 * k) / side - 1, sign];
          points.push(...point);
        }
      const at = (i, k) => first + i * (side + 1) + k;
      for (let i = 0; i < side; i++)
        for (let k = 0; k < side; k++) {
          const [a, b, c, d] = [at(i, k), at(i + 1, k), at(i + 1, k + 1), at(i, k + 1)];
          indices.push(...(sign > 0 ? [a, b, c, a, c, d] : [a, c, b, a, d, c]));
        }
    }
  const bytes = Buffer.concat([Float32Array.from(points), Float32Array.from(points, (x) => 9 * x), Uint32Array.from(indices)].map(({ buffer }) => Buffer.from(buffer)));
  const size = 4 * points.length, count = points.length / 3;
  const position = (bufferView, most) => ({ bufferView, componentType: 5126, count, type: 'VEC3', min: Array(3).fill(-most), max: Array(3).fill(most) });
  return JSON.stringify({
    asset: { version: '2.0' },
    scenes: [{ nodes: [0] }],
    nodes: [{ mesh: 0, translation: [400, 0, 0] }],
    meshes: [{ weights: [1], primitives: [{ attributes: { POSITION: 0 }, indices: 2, targets: [{ POSITION: 1 }] }] }],
    accessors: [position(0, 1), position(1, 9), { bufferView: 2, componentType: 5125, count: indices.length, type: 'SCALAR' }],
    bufferViews: [0, 1, 2].map((i) => ({ buffer: 0, byteOffset: i * size, byteLength: i < 2 ? size : 4 * indices.length })),
    buffers: [{ byteLength: bytes.length, uri: `data:application/octet-stream;base64,${bytes.toString('base64')}` }],
  });
}

test('the sizes that surface.json tells are those of the answers, of morphing models too', async () => {
  const model = await daemon.upload(growing());
  const bytes = async (form, query) => (await (await fetch(`${model}/surface.${form}?${query}`)).arrayBuffer()).byteLength;
  const levels = new Set();
  for (const [query, told] of [['level=auto&error=0.02', ''], ['level=auto&error=0.02&skin=bake&clip=none', 'stl,ply'], ['level=1', 'stl'], ['level=1&meshes=none', '']]) {
    const { forms, level } = await (await fetch(`${model}/surface.json?${query}`)).json();
    levels.add(level);
    assert.equal(['stl', 'ply'].filter((form) => form in forms).join(), told);
    for (const [form, size] of Object.entries(forms)) if (form !== 'bin') assert.equal(await bytes(form, query), size, `${form} ${query}`);
  }
  assert.equal(levels.size, 3);
});
