// What the page finds in a cage, and shows of an edit before the daemon has made it, against what the daemon makes.
import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';

import { CageMesh } from '../../server/page/cage_mesh.js';
import { previewOf } from '../../server/page/edit_preview.js';
import { Daemon } from '../node/daemon.mjs';

const daemon = new Daemon();
before(() => daemon.start());
after(() => daemon.remove());

const post = async (path, body) => {
  const answer = await fetch(`${daemon.url}/v1/${path}`, { method: 'POST', headers: { 'Content-Type': 'application/json' }, body: JSON.stringify(body) });
  const made = await answer.json();
  assert.ok(answer.ok, made.detail);
  return made;
};

async function cageOf(id) {
  const lines = (await (await fetch(`${daemon.url}/v1/models/${id}/surface.obj?level=0`)).text()).split('\n').map((line) => line.split(' '));
  const values = (word, read) => lines.filter(([name]) => name === word).map(([, ...rest]) => rest.map(read));
  return new CageMesh({ points: values('v', Number), faces: values('f', (corner) => parseInt(corner, 10) - 1) });
}

const place = (point) => point.map((value) => (Math.round(value * 1e4) / 1e4 + 0).toFixed(4)).join(' ');
/** A mesh as a set of faces, each a cycle of places. */
const shapeOf = ({ points, faces }) => faces.map((corners) => {
  const cycle = corners.map((point) => place(points[point]));
  const first = cycle.indexOf([...cycle].sort()[0]);
  return [...cycle.slice(first), ...cycle.slice(0, first)].join(', ');
}).sort();

const BOX = { kind: 'box', size: [2, 1, 3], segments: [2, 1, 3] };
const SPHERE = { kind: 'quad_sphere', radius: 1, segments: 3 };

for (const [name, shape, kind, list, edit] of [
  ['one face', BOX, 'faces', [0], { edit: 'extrude', distance: 0.3 }],
  ['faces round a corner', BOX, 'faces', { inside: { min: [-1, -0.5, -1.6], max: [1, 0.5, -0.4] } }, { edit: 'extrude', distance: 0.3 }],
  ['a part of a ball', SPHERE, 'faces', { facing: [0, 1, 0], within: 50 }, { edit: 'extrude', distance: 0.2 }],
  ['each face by itself', SPHERE, 'faces', { facing: [0, 1, 0], within: 50 }, { edit: 'extrude', distance: 0.2, individual: true }],
  ['all faces', SPHERE, 'faces', 'all', { edit: 'extrude', distance: 0.1 }],
  ['all faces', { kind: 'cylinder', radius: 1, height: 2, segments: 8, caps: 'ngon' }, 'faces', 'all', { edit: 'extrude', distance: 0.1 }],
  ['along a vector', SPHERE, 'faces', { facing: [1, 0, 0], within: 40 }, { edit: 'extrude', by: [0.5, 0.2, 0] }],
  ['one face', BOX, 'faces', [3], { edit: 'inset', amount: 0.1 }],
  ['neighbours', BOX, 'faces', { facing: [0, 1, 0], within: 10 }, { edit: 'inset', amount: 0.2 }],
  ['each face by itself', BOX, 'faces', { facing: [0, 1, 0], within: 10 }, { edit: 'inset', amount: 0.1, individual: true }],
  ['points', BOX, 'vertices', [0, 1, 5], { edit: 'move', by: [0.1, 0.2, -0.3] }],
  ['edges', BOX, 'edges', { ring: [0, 1] }, { edit: 'scale', by: [0.5, 2, 1] }],
  ['faces', BOX, 'faces', { facing: [1, 0, 0], within: 10 }, { edit: 'scale', by: 0.5 }],
  ['faces', BOX, 'faces', { facing: [0, 1, 0], within: 10 }, { edit: 'rotate', axis: 'y', degrees: 30 }],
  ['faces', BOX, 'faces', { facing: [0, 1, 0], within: 10 }, { edit: 'rotate', axis: [1, 1, 0], degrees: -50 }],
])
  test(`the preview of ${edit.edit}: ${name}`, async () => {
    const { id } = await post('models', { meshes: [{ shape }] });
    const mesh = await cageOf(id);
    const chosen = mesh.select(kind, list);
    assert.ok(chosen.length > 0);
    const made = await post(`models/${id}/edits`, { edits: [{ [kind]: list, ...edit }] });
    assert.deepEqual(shapeOf(previewOf(mesh, kind, chosen, edit)), shapeOf(await cageOf(made.id)));
  });

for (const [shape, edge, cuts] of [[BOX, [0, 1], 1], [BOX, [1, 2], 3], [{ kind: 'cylinder', radius: 1, height: 2, segments: 8, rings: 2, caps: 'ngon' }, [0, 8], 2]])
  test(`the preview of a loop cut: ${shape.kind}, ${edge}, ${cuts}`, async () => {
    const { id } = await post('models', { meshes: [{ shape }] });
    const mesh = await cageOf(id);
    const ends = mesh.sidesOf(edge).length > 0 ? edge : mesh.edges[0];
    const edit = { edit: 'loop_cut', edge: ends, cuts };
    const made = await post(`models/${id}/edits`, { edits: [edit] });
    assert.deepEqual(shapeOf(previewOf(mesh, 'edges', [ends], edit)), shapeOf(await cageOf(made.id)));
  });

const GRID = { kind: 'grid', size: [4, 4], segments: [4, 4] };

for (const [shape, kind, rule] of [
  [BOX, 'edges', 'all'], [BOX, 'faces', 'all'], [GRID, 'edges', 'border'], [BOX, 'edges', { sharper_than: 60 }],
  [GRID, 'edges', { loop: [6, 7] }], [GRID, 'edges', { loop: [0, 1] }], [GRID, 'edges', { ring: [6, 7] }], [BOX, 'edges', { loop: [0, 1] }], [BOX, 'edges', { ring: [0, 1] }],
  [SPHERE, 'edges', { loop: [0, 1] }], [SPHERE, 'faces', { facing: [0, 0, 1], within: 30 }], [SPHERE, 'faces', { facing: [1, 1, 0] }], [BOX, 'vertices', { inside: { min: [-2, 0, -2], max: [2, 2, 0] } }],
])
  test(`the daemon selects the same: ${shape.kind}, ${kind} ${JSON.stringify(rule)}`, async () => {
    const { id } = await post('models', { meshes: [{ shape }] });
    const mesh = await cageOf(id);
    const list = mesh.select(kind, rule);
    assert.ok(list?.length > 0);
    const moved = async (selection) => shapeOf(await cageOf((await post(`models/${id}/edits`, { edits: [{ edit: 'move', by: [0, 0, 7], [kind]: selection }] })).id));
    assert.deepEqual(await moved(list), await moved(rule));
  });

test('a selection grows, shrinks, and takes what hangs together', async () => {
  const gridOf = async (shape) => cageOf((await post('models', { meshes: [{ shape }] })).id);
  const wide = await gridOf({ kind: 'grid', size: [6, 6], segments: [6, 6] });
  const middle = wide.select('faces', { inside: { min: [-1, -1, -1], max: [0, 1, 0] } });
  assert.equal(middle.length, 1);
  assert.equal(wide.grow('faces', middle).length, 9);
  assert.deepEqual(wide.shrink('faces', wide.grow('faces', middle)), middle);
  assert.equal(wide.grow('vertices', [24]).length, 9);
  assert.deepEqual(wide.shrink('vertices', wide.grow('vertices', [24])), [24]);
  const grid = await gridOf(GRID);
  assert.equal(grid.linked('edges', [[0, 1]]).length, grid.edges.length);
  const two = new CageMesh({ points: [...grid.points, [9, 0, 0], [10, 0, 0], [9, 0, 1]], faces: [...grid.faces, [25, 26, 27]] });
  assert.equal(two.linked('faces', [3]).length, 16);
  assert.deepEqual(two.linked('vertices', [26]), [25, 26, 27]);
  assert.deepEqual(two.select('faces', { group: 'a' }), null, 'only the daemon knows groups');
});
