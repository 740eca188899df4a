// Hard edges by their angle are those that three.js draws as edges.
import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';

import { BoxGeometry, CylinderGeometry, EdgesGeometry, IcosahedronGeometry, TorusKnotGeometry } from 'three';

import { Daemon } from './daemon.mjs';

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
