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
