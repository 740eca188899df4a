// Random meshes as exporters write them, welded and split: sheets of quads, each with vertices of its own or shared
// with its neighbours, cut into parts whose joints, weights and morph displacements differ, with colours, texture
// coordinates and numbers that have seams elsewhere, in several primitives. What is right is plain: bilinear levels
// hold in each quad what its four corners say, in double, and an edge is one edge where both ends are one point.
import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';

import { NodeIO } from '@gltf-transform/core';

import { Daemon } from './daemon.mjs';

const daemon = new Daemon();
before(() => daemon.start());
after(() => daemon.remove());

let seed = 101;
const random = () => (seed = (seed * 48271) % 2147483647) / 2147483647;
const below = (n) => Math.floor(random() * n);

// ---- the meshes ---------------------------------------------------------------------------------------

const JOINTS = 6;

/** What differs between parts of the sheet: by quad, one of a few. */
const choose = (columns, rows, kinds) => {
  const across = Array.from({ length: columns }, () => below(kinds));
  const down = Array.from({ length: rows }, () => below(kinds));
  return (x, y) => (across[x] + down[y]) % kinds;
};

/** A sheet: for each quad its corners, each with all that a vertex may say. */
function makeSheet() {
  const columns = 1 + below(5), rows = 1 + below(5);
  const part = choose(columns, rows, 1 + below(3)), shape = choose(columns, rows, 1 + below(3)), paint = choose(columns, rows, 1 + below(4)), map = choose(columns, rows, 1 + below(3)), label = choose(columns, rows, 1 + below(3));
  const primitive = choose(columns, rows, 1 + below(3));
  const bend = random();
  const quads = [];
  for (let y = 0; y < rows; y++)
    for (let x = 0; x < columns; x++) {
      const p = part(x, y), s = shape(x, y), c = paint(x, y), m = map(x, y);
      const corners = [[x, y], [x + 1, y], [x + 1, y + 1], [x, y + 1]].map(([u, v]) => ({
        position: [u, v, 0],
        color: [c % 2, ((u * 7 + v * 3 + c) % 5) / 4, (c >> 1) % 2, 1 - c / 8],
        uv: [[u / 8 + m, v / 8], [v / 4, u / 4 - m]],
        label: label(x, y),
        weights: Array.from({ length: JOINTS }, (_, j) => (j === p ? 0.5 : j === (p + 1) % JOINTS ? 0.25 : ((u + 2 * v + j) % 4 === 0 ? 0.25 : 0) )),
        morphs: [[0, 0, s + u * bend], [s * 2, 0, 1]],
      }));
      for (const corner of corners) {
        const sum = corner.weights.reduce((a, b) => a + b);
        corner.weights = corner.weights.map((w) => Math.fround(w / sum));
      }
      quads.push({ x, y, primitive: primitive(x, y), corners });
    }
  return { columns, rows, quads };
}

/** glTF of the sheet. Vertices that say the same are shared, at times. */
function file({ quads }, shares, smallWeights) {
  const document = { asset: { version: '2.0' }, accessors: [], bufferViews: [] };
  const chunks = [];
  let size = 0;
  const add = (array, type, more) => {
    const width = { SCALAR: 1, VEC2: 2, VEC3: 3, VEC4: 4 }[type];
    const count = array.length / width, row = array.BYTES_PER_ELEMENT * width, stride = (row + 3) & ~3;
    const padded = Buffer.alloc(count * stride), bytes = Buffer.from(array.buffer);
    for (let i = 0; i < count; i++) bytes.copy(padded, i * stride, i * row, (i + 1) * row);
    const isIndex = more?.isIndex;
    document.bufferViews.push({ buffer: 0, byteOffset: size, byteLength: isIndex ? bytes.length : padded.length, ...(isIndex ? {} : { byteStride: stride }) });
    const chunk = isIndex ? bytes : padded;
    chunks.push(chunk, Buffer.alloc(-chunk.length & 3));
    size += (chunk.length + 3) & ~3;
    const componentType = { Uint8Array: 5121, Uint16Array: 5123, Uint32Array: 5125, Float32Array: 5126 }[array.constructor.name];
    const { isIndex: _, ...members } = more ?? {};
    return document.accessors.push({ bufferView: document.bufferViews.length - 1, componentType, count, type, ...members }) - 1;
  };
  const primitives = [];
  for (const number of new Set(quads.map((quad) => quad.primitive))) {
    const vertices = [], names = new Map(), indices = [];
    for (const quad of quads.filter(({ primitive }) => primitive === number)) {
      const at = quad.corners.map((corner) => {
        const name = JSON.stringify(corner);
        if (names.has(name) && shares && random() < 0.7) return names.get(name);
        names.set(name, vertices.length);
        return vertices.push(corner) - 1;
      });
      indices.push(at[0], at[1], at[2], at[0], at[2], at[3]);
    }
    const flat = (of) => vertices.flatMap(of);
    // Heavy joints may stand in any set, and a set may be in bytes.
    const sets = [0, 1].map((set) => flat(({ weights }) => Array.from({ length: 4 }, (_, k) => [k * 2 + set, weights[k * 2 + set] ?? 0])).map(([joint, weight]) => [joint < JOINTS ? joint : 0, joint < JOINTS ? weight : 0]));
    const attributes = {
      POSITION: add(new Float32Array(flat(({ position }) => position)), 'VEC3', { min: [0, 0, 0], max: [8, 8, 0] }),
      COLOR_0: add(new Float32Array(flat(({ color }) => color)), 'VEC4'),
      TEXCOORD_0: add(new Float32Array(flat(({ uv }) => uv[0])), 'VEC2'),
      TEXCOORD_1: add(new Float32Array(flat(({ uv }) => uv[1])), 'VEC2'),
      _LABEL: add(new Uint16Array(flat(({ label }) => [label])), 'SCALAR'),
    };
    const { min, max } = [0, 1, 2].reduce((b, c) => { const all = vertices.map(({ position }) => position[c]); b.min.push(Math.min(...all)); b.max.push(Math.max(...all)); return b; }, { min: [], max: [] });
    Object.assign(document.accessors[attributes.POSITION], { min, max });
    sets.forEach((set, i) => {
      attributes[`JOINTS_${i}`] = add(new (i ? Uint16Array : Uint8Array)(set.map(([joint]) => joint)), 'VEC4');
      attributes[`WEIGHTS_${i}`] = smallWeights
        ? add(new Uint8Array(set.map(([, weight]) => Math.round(weight * 255))), 'VEC4', { normalized: true })
        : add(new Float32Array(set.map(([, weight]) => weight)), 'VEC4');
    });
    const targets = [0, 1].map((t) => ({ POSITION: add(new Float32Array(flat(({ morphs }) => morphs[t])), 'VEC3') }));
    primitives.push({ attributes, targets, material: number, indices: add(new Uint32Array(indices), 'SCALAR', { isIndex: true }) });
  }
  document.materials = [0, 1, 2].map((i) => ({ name: `m${i}` }));
  document.meshes = [{ primitives, weights: [0, 0] }];
  document.nodes = [{ mesh: 0, skin: 0 }, ...Array.from({ length: JOINTS }, (_, j) => ({ name: `j${j}` }))];
  document.skins = [{ joints: Array.from({ length: JOINTS }, (_, j) => j + 1) }];
  document.scenes = [{ nodes: document.nodes.map((_, i) => i) }];
  document.scene = 0;
  document.buffers = [{ byteLength: size, uri: `data:application/octet-stream;base64,${Buffer.concat(chunks).toString('base64')}` }];
  return JSON.stringify(document);
}

// ---- what is right ----------------------------------------------------------------------------------------

/** The value of a quad's corners at a place of it, in double. */
const blend = (values, u, v) => values[0].map((_, c) => (1 - u) * (1 - v) * values[0][c] + u * (1 - v) * values[1][c] + u * v * values[2][c] + (1 - u) * v * values[3][c]);

/** Corners are one point where they are at one place and move alike. */
const moves = ({ position, weights, morphs }) => JSON.stringify([position, weights, morphs]);

/** Edges of one face, where an edge is of two if both its ends are one point on either side. */
function openEdges({ quads }) {
  const sides = new Map();
  for (const { corners } of quads)
    corners.forEach((corner, i) => {
      const name = [moves(corner), moves(corners[(i + 1) % 4])].sort().join();
      sides.set(name, (sides.get(name) ?? 0) + 1);
    });
  return [...sides.values()].filter((count) => count === 1).length;
}

// ---- what the answer says -----------------------------------------------------------------------------------

/** Compares each vertex of each triangle with the quad that the triangle lies in. Returns how many numbers. */
async function compare(bytes, { quads, columns }, weightRoom) {
  const document = await new NodeIO().readBinary(new Uint8Array(bytes));
  let numbers = 0;
  const near = (found, wanted, room, what) => found.forEach((x, c) => {
    numbers++;
    assert.ok(Math.abs(x - wanted[c]) <= room, `${what}: ${found}, ${wanted}`);
  });
  for (const primitive of document.getRoot().listMeshes()[0].listPrimitives()) {
    const rowOf = (name, i, from = primitive) => from.getAttribute(name).getElement(i, []);
    const indices = primitive.getIndices().getArray();
    for (let t = 0; t < indices.length; t += 3) {
      const corners = [...indices.slice(t, t + 3)];
      const middle = [0, 1].map((c) => corners.reduce((sum, i) => sum + rowOf('POSITION', i)[c] / 3, 0));
      const quad = quads[Math.floor(middle[1]) * columns + Math.floor(middle[0])];
      assert.equal(primitive.getMaterial().getName(), `m${quad.primitive}`);
      for (const i of corners) {
        const [x, y] = rowOf('POSITION', i), of = (what) => blend(quad.corners.map(what), x - quad.x, y - quad.y);
        near(rowOf('POSITION', i), of(({ position }) => position), 1e-6, 'position');
        near(rowOf('COLOR_0', i), of(({ color }) => color), 1e-6, 'colour');
        for (const set of [0, 1]) near(rowOf(`TEXCOORD_${set}`, i), of(({ uv }) => uv[set]), 1e-6, `TEXCOORD_${set}`);
        near(rowOf('_LABEL', i), [quad.corners[0].label], 0, '_LABEL');
        const weights = Array(JOINTS).fill(0);
        for (let set = 0; primitive.getAttribute(`JOINTS_${set}`); set++)
          rowOf(`JOINTS_${set}`, i).forEach((joint, k) => (weights[joint] += rowOf(`WEIGHTS_${set}`, i)[k]));
        near(weights, of((corner) => corner.weights), weightRoom, 'weights');
        primitive.listTargets().forEach((target, m) => near(rowOf('POSITION', i, target), of(({ morphs }) => morphs[m]), 2e-6, `target ${m}`));
      }
    }
  }
  return numbers;
}

// ---- tests ------------------------------------------------------------------------------------------------------

for (const level of [0, 1, 2])
  test(`level ${level} of random sheets has in each quad what its corners say`, async () => {
    let numbers = 0, seams = 0;
    for (let run = 0; run < 40; run++) {
      const sheet = makeSheet(), small = run % 4 === 3;
      const model = await daemon.upload(file(sheet, run % 2, small));
      const [mesh] = (await (await fetch(model)).json()).meshes;
      assert.equal(mesh.faces, sheet.quads.length);
      assert.equal(mesh.boundary_edges, openEdges(sheet), 'edges that are open');
      seams += mesh.boundary_edges - 2 * (sheet.columns + sheet.rows);
      const answer = await fetch(`${model}/surface.glb?level=${level}&scheme=bilinear&creases=none`);
      assert.equal(answer.status, 200);
      numbers += await compare(Buffer.from(await answer.arrayBuffer()), sheet, small ? 0.01 : 2e-6);
    }
    assert.ok(numbers > 50_000 && seams > 200, `${numbers} numbers compared, ${seams} edges apart`);
  });
