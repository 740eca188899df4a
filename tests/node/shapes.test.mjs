// The shapes of tweend JSON have the points, faces and UVs that three.js gives its own.
import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';

import * as THREE from 'three';

import { Daemon } from './daemon.mjs';

const daemon = new Daemon();
before(() => daemon.start());
after(() => daemon.remove());

const TOLERANCE = 1e-5;

/** One corner of a face: its point and its UV. */
const same = (a, b) => a.every((value, i) => Math.abs(value - b[i]) <= TOLERANCE);

/** The corners of a shape's faces, from its OBJ. */
async function cornersOf(shape) {
  const url = `${daemon.url}/v1/surface.obj?level=0&normals=none`;
  const headers = { 'Content-Type': 'application/json' };
  const answer = await fetch(url, { method: 'POST', headers, body: JSON.stringify({ meshes: [{ shape }] }) });
  const text = await answer.text();
  assert.equal(answer.status, 200, text);
  const lines = text.split('\n').map((line) => line.split(' '));
  const rows = (word) => lines.filter(([first]) => first === word).map(([, ...rest]) => rest);
  const points = rows('v').map((row) => row.map(Number));
  const uvs = rows('vt').map((row) => row.map(Number));
  const corner = (text) => text.split('/').map((index) => Number(index) - 1);
  const faces = rows('f').map((row) => row.map(corner));
  return { points, corners: faces.flat().map(([p, t]) => [...points[p], ...uvs[t]]) };
}

/** The corners of the triangles of three's geometry; move: makes other positions of its own. */
function cornersOfThree(geometry, move = (p) => p) {
  const { position, uv } = geometry.attributes;
  const indices = geometry.index ? [...geometry.index.array] : [...Array(position.count).keys()];
  return indices.map((i) => [...move(new THREE.Vector3().fromBufferAttribute(position, i)).toArray(), uv.getX(i), uv.getY(i)]);
}

function unique(rows, width) {
  const cells = new Map();
  for (const row of rows) {
    const key = row.slice(0, width).map((value) => Math.round(value / TOLERANCE / 10) + 0).join();
    if (!cells.has(key)) cells.set(key, row.slice(0, width));
  }
  return [...cells.values()];
}

function assertSubset(some, all, what) {
  for (const row of some) assert.ok(all.some((other) => same(row, other)), `${what}: ${row}`);
}

/** The same points and, but for `uvs: false`, the same UVs at them. */
async function assertLikeThree(shape, geometry, { move, uvs = true } = {}) {
  const ours = await cornersOf(shape);
  const wanted = cornersOfThree(geometry, move);
  const width = uvs ? 5 : 3;
  assert.equal(unique(wanted, 3).length, ours.points.length);
  assertSubset(unique(ours.corners, width), unique(wanted, width), 'ours is not theirs');
  assertSubset(unique(wanted, width), unique(ours.corners, width), 'theirs is not ours');
}

test('a grid is a plane', () =>
  assertLikeThree({ kind: 'grid', size: [2, 3], segments: [4, 5] }, new THREE.PlaneGeometry(2, 3, 4, 5).rotateX(-Math.PI / 2)));

test('a box is a box', () =>
  assertLikeThree({ kind: 'box', size: [2, 1, 4], segments: [2, 3, 4] }, new THREE.BoxGeometry(2, 1, 4, 2, 3, 4)));

test('a quad sphere is a box with equal angles made round', () => {
  const round = (p) => p.set(...p.toArray().map((t) => Math.tan((t * Math.PI) / 4))).setLength(1.5);
  return assertLikeThree({ kind: 'quad_sphere', radius: 1.5, segments: 5 }, new THREE.BoxGeometry(2, 2, 2, 5, 5, 5), { move: round });
});

test('an ellipsoid is a quad sphere that is scaled', () => {
  const round = (p) => p.set(...p.toArray().map((t) => Math.tan((t * Math.PI) / 4))).setLength(1).multiply(new THREE.Vector3(1, 2, 3));
  return assertLikeThree({ kind: 'ellipsoid', radii: [1, 2, 3], segments: 4 }, new THREE.BoxGeometry(2, 2, 2, 4, 4, 4), { move: round });
});

test('a UV sphere is a sphere', () =>
  assertLikeThree({ kind: 'uv_sphere', radius: 2, segments: 7, rings: 5 }, new THREE.SphereGeometry(2, 7, 5)));

test('a cylinder is a cylinder, its caps fans', () =>
  assertLikeThree(
    { kind: 'cylinder', radius: 0.5, height: 3, segments: 9, rings: 2, caps: 'fan' },
    new THREE.CylinderGeometry(0.5, 0.5, 3, 9, 2),
  ));

test('a cylinder without caps is open', () =>
  assertLikeThree({ kind: 'cylinder', segments: 6, caps: 'none' }, new THREE.CylinderGeometry(1, 1, 1, 6, 1, true)));

// The UVs of the tip lie in the middle of each triangle, where three has them at one end.
test('a cone is a cone', () =>
  assertLikeThree({ kind: 'cone', radius: 2, height: 3, segments: 8, rings: 3, caps: 'fan' }, new THREE.ConeGeometry(2, 3, 8, 3), { uvs: false }));

test('a torus lies down', () =>
  assertLikeThree(
    { kind: 'torus', radius: 2, tube: 0.5, segments: 9, sides: 5 },
    new THREE.TorusGeometry(2, 0.5, 5, 9).rotateX(-Math.PI / 2),
  ));

for (const level of [0, 1, 2, 3]) {
  test(`an icosphere of level ${level} is an icosahedron in ${4 ** level} parts`, () =>
    assertLikeThree({ kind: 'icosphere', radius: 3, level }, new THREE.IcosahedronGeometry(3, 2 ** level - 1), { uvs: false }));
}
