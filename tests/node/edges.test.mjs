// Hard edges by their angle are those that three.js draws as edges; normals of a file come back at level 0.
import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';

import { BoxGeometry, CylinderGeometry, EdgesGeometry, IcosahedronGeometry, TorusKnotGeometry } from 'three';

import { Daemon } from './daemon.mjs';
import { load } from './player.mjs';

const daemon = new Daemon();
before(() => daemon.start());
after(() => daemon.remove());

/** Moves points away from the middle by a hash of where they are. */
function crumple(geometry, amount) {
  const position = geometry.attributes.position;
  for (let i = 0; i < position.count; i++) {
    const p = [position.getX(i), position.getY(i), position.getZ(i)].map((x) => Math.round(x * 1e4) / 1e4 + 0);
    const noise = Math.sin(p[0] * 12.9898 + p[1] * 78.233 + p[2] * 37.719) * 43758.5453;
    const scale = 1 + amount * (noise - Math.floor(noise));
    position.setXYZ(i, ...p.map((x) => x * scale));
  }
  return geometry;
}

/** One point a place. */
function objOf(geometry) {
  const { position } = geometry.attributes;
  const points = new Map();
  const lines = [];
  const number = (i) => {
    const text = [position.getX(i), position.getY(i), position.getZ(i)].join(' ');
    const key = text.split(' ').map((x) => Math.round(x * 1e4)).join();
    if (!points.has(key)) {
      points.set(key, points.size + 1);
      lines.push(`v ${text}`);
    }
    return points.get(key);
  };
  const count = geometry.index ? geometry.index.count : position.count;
  const corner = (i) => number(geometry.index ? geometry.index.getX(i) : i);
  for (let i = 0; i < count; i += 3) {
    const face = [corner(i), corner(i + 1), corner(i + 2)];
    if (new Set(face).size === 3) lines.push(`f ${face.join(' ')}`);
  }
  return lines.join('\n');
}

const geometries = {
  box: new BoxGeometry(3, 2, 4, 3, 2, 4),
  drum: new CylinderGeometry(1, 1, 2, 9, 3),
  crumpled: crumple(new IcosahedronGeometry(1, 8), 0.1),
  knot: new TorusKnotGeometry(1, 0.4, 24, 6),
};

for (const [name, geometry] of Object.entries(geometries)) {
  test(`hard edges of a ${name} by 30 degrees are those of EdgesGeometry`, async () => {
    const model = await (await fetch(await daemon.upload(objOf(geometry)))).json();
    const [{ hard_edges: edges, boundary_edges: borders }] = model.meshes;
    assert.equal(borders, 0);
    assert.equal(edges.angle_30, new EdgesGeometry(geometry, 30).attributes.position.count / 2);
    assert.ok(edges.angle_30 > 0);
  });
}

/** A GLB of one primitive with all attributes of a geometry. */
function glbOf(geometry) {
  const semantics = { position: 'POSITION', normal: 'NORMAL', uv: 'TEXCOORD_0', tangent: 'TANGENT' };
  const arrays = [];
  const [accessors, bufferViews] = [[], []];
  const add = (array, type, count) => {
    const byteOffset = arrays.reduce((sum, { byteLength }) => sum + byteLength, 0);
    arrays.push(Buffer.from(array.buffer, array.byteOffset, array.byteLength));
    bufferViews.push({ buffer: 0, byteOffset, byteLength: array.byteLength });
    const componentType = array instanceof Float32Array ? 5126 : 5125;
    return accessors.push({ bufferView: accessors.length, componentType, count, type }) - 1;
  };
  const attributes = {};
  for (const [name, { array, itemSize, count }] of Object.entries(geometry.attributes)) {
    attributes[semantics[name]] = add(array, `VEC${itemSize}`, count);
  }
  const indices = add(Uint32Array.from(geometry.index.array), 'SCALAR', geometry.index.count);
  const bin = Buffer.concat(arrays);
  const document = {
    asset: { version: '2.0' },
    buffers: [{ byteLength: bin.length }],
    bufferViews,
    accessors,
    meshes: [{ primitives: [{ attributes, indices }] }],
    nodes: [{ mesh: 0 }],
    scenes: [{ nodes: [0] }],
    scene: 0,
  };
  const json = Buffer.from(JSON.stringify(document).padEnd(Math.ceil(JSON.stringify(document).length / 4) * 4));
  const head = (...words) => Buffer.from(Uint32Array.from(words).buffer);
  return Buffer.concat([
    head(0x46546c67, 2, 28 + json.length + bin.length, json.length, 0x4e4f534a), json, head(bin.length, 0x004e4942), bin,
  ]);
}

/** What each corner of each triangle has of an attribute. */
function cornersOf({ index, attributes }, name) {
  const attribute = attributes[name];
  return Array.from(index.array, (i) => Array.from({ length: attribute.itemSize }, (_, k) => attribute.getComponent(i, k)));
}

for (const [name, geometry] of Object.entries(geometries)) {
  if (!geometry.index) continue;
  test(`level 0 of a ${name} has the normals of the file`, async () => {
    geometry.computeTangents();
    const model = await daemon.upload(glbOf(geometry));
    const answer = await fetch(`${model}/surface.glb?level=0&quads=ngon`);
    const gltf = await load(Buffer.from(await answer.arrayBuffer()));
    const found = (await gltf.parser.getDependency('mesh', 0)).geometry;
    for (const [attribute, tolerance] of [['position', 1e-9], ['normal', 2e-6], ['uv', 1e-6], ['tangent', 2e-6]]) {
      const wanted = cornersOf(geometry, attribute);
      assert.equal(found.index.count, wanted.length);
      cornersOf(found, attribute).forEach((row, i) =>
        row.forEach((x, k) => assert.ok(Math.abs(x - wanted[i][k]) < tolerance, `${attribute} of corner ${i}`)));
    }
  });
}
