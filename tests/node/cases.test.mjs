// Small files for situations that public bug reports describe, in `cases`. What is right was computed by hand, in closed
// form or by three.js on the source.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { after, before, test } from 'node:test';

import { Vector3 } from 'three';

import { Daemon, root } from './daemon.mjs';
import { load } from './player.mjs';

const daemon = new Daemon();
before(() => daemon.start());
after(() => daemon.remove());

const bytesOf = (name) => readFileSync(join(root, 'tests/node/cases', name));
const warningOf = (response) => decodeURIComponent(response.headers.get('X-Tweend-Warning') ?? '');

async function ask(name, query) {
  const response = await fetch(`${await daemon.upload(bytesOf(name))}${query}`);
  assert.equal(response.status, 200, await response.clone().text());
  return response;
}
const describe = async (name) => (await ask(name, '')).json();
const pose = async (name, query) => (await (await ask(name, `/pose.json?${query}`)).json()).poses[0];
const points = async (name, query) => [...(await (await ask(name, `/surface.obj?level=0${query}`)).text()).matchAll(/^v (.*)$/gm)].map(([, line]) => line.split(' ').map(Number));

async function meshes(name, query) {
  const response = await ask(name, `/surface.glb?${query}`);
  const { scene } = await load(Buffer.from(await response.arrayBuffer()));
  const found = [];
  scene.traverse((object) => object.isMesh && found.push(object.geometry));
  return { found, warning: warningOf(response) };
}

/** The values of an attribute at the corners of each triangle. */
const triangles = (geometry, name) => {
  const { array } = geometry.index;
  const values = geometry.attributes[name];
  const at = (i) => [...Array(values.itemSize).keys()].map((c) => values.getComponent(i, c));
  return [...Array(array.length / 3).keys()].map((t) => [0, 1, 2].map((k) => at(array[3 * t + k])));
};

const near = (a, b, within = 1e-6) => assert.ok(Math.max(...a.flat().map((x, i) => Math.abs(x - b.flat()[i]))) <= within, `${a} is not ${b}`);

test('cubic splines turn the way their keys and tangents say', async () => {
  const { axis_angle } = await pose('cubic-200-degrees.glb', 'at=0.5&as=axis-angle&unit=degrees');
  near(axis_angle, [[0, 0, 1, 100]], 1e-4);
});

test('a cube with six coloured sides has six colours', async () => {
  const { found: [cube] } = await meshes('cube-six-colours.glb', 'level=0');
  const colors = triangles(cube, 'color').map((corners) => new Set(corners.map((color) => color.join())));
  assert.equal(colors.length, 12);
  assert.ok(colors.every((some) => some.size === 1));
  assert.equal(new Set(colors.flatMap((some) => [...some])).size, 6);
});

const SQUARES = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [6, 0, 0], [7, 0, 0], [7, 1, 0], [6, 1, 0]];
test('a morph target takes its square along, whole', async () => near(await points('morph-separates.glb', '&skin=bake'), SQUARES));
test('rigid parts that touch stay rigid', async () => near(await points('rigid-parts-touch.glb', '&skin=bake&at=1'), SQUARES));

test('a point follows five joints of equal weight', async () => {
  for (const [, , z] of await points('five-influences.glb', '&skin=bake&clip=none')) near([z], [20], 1e-5);
});

test('the node of a skinned mesh has no say in its scale', async () => {
  const all = await points('armature-scale.glb', '');
  near([0, 1].map((c) => Math.max(...all.map((p) => p[c])) - Math.min(...all.map((p) => p[c]))), [100, 100], 1e-4);
});

test('clips of one name are told apart by their numbers', async () => {
  const y = async (clip) => (await pose('two-clips-one-name.glb', `at=1&clip=${clip}`)).rotation[0][1];
  near([await y('clip_0'), await y('clip_1')], [Math.sin(Math.PI / 4), Math.sin(Math.PI / 9)]);
});

test('KHR_animation_pointer moves a node', async () => {
  const { axis_angle } = await pose('animation-pointer.glb', 'at=0.5&as=axis-angle&unit=degrees');
  near(axis_angle[1], [0, 1, 0, 45], 1e-4);
});

test('a metre in UTM coordinates is a metre', async () => {
  const { found: [cube] } = await meshes('georeferenced.obj', 'level=0');
  cube.computeBoundingBox();
  near(cube.boundingBox.max.clone().sub(cube.boundingBox.min).toArray(), [1, 1, 1]);
});

test('attribute bytes behind facets of STL are passed over', async () => {
  const response = await ask('stl-payload.stl', '/surface.obj?level=0&quads=ngon&creases=tags');
  assert.match(warningOf(response), /2 facets have attributes that are left out/);
  assert.equal([...(await response.text()).matchAll(/^f /gm)].length, 2);
});

test('texture coordinates of the faces of a PLY', async () => {
  const text = await (await ask('wedge-texcoord.ply', '/surface.obj?level=0&normals=none')).text();
  assert.deepEqual([...text.matchAll(/^(?:vt|f) .*$/gm)].map(([line]) => line), ['vt 0.1 0.2', 'vt 0.3 0.4', 'vt 0.5 0.6', 'f 1/1 2/2 3/3']);
});

test('a GLB comes with the texture that it names', async () => {
  const form = new FormData();
  form.append('file', new Blob([bytesOf('outside-texture.glb')]), 'outside-texture.glb');
  form.append('file', new Blob([bytesOf('swatch.png')]), 'Textures/swatch.png');
  const stored = await fetch(`${daemon.url}/v1/models`, { method: 'POST', body: form });
  assert.equal(stored.status, 201);
  const { id } = await stored.json();
  const glb = Buffer.from(await (await fetch(`${daemon.url}/v1/models/${id}/surface.glb?level=0`)).arrayBuffer());
  assert.ok(glb.includes(bytesOf('swatch.png')));
});

for (const [name, told] of [['tetra_dup.stl', /listed twice/], ['sliver.stl', /fewer than three different points/]])
  test(`${name} is closed`, async () => {
    const { meshes: [mesh], warnings } = await describe(name);
    assert.deepEqual([mesh.vertices, mesh.edges, mesh.faces, mesh.boundary_edges, mesh.components], [4, 6, 4, 0, 1]);
    assert.equal(mesh.unused_points, 0);
    assert.match(warnings[0], told);
  });

// A square of two triangles, one of them twice, between triangles without an area; each with points of its own, whose
// place in the file is their colour.
const DOUBLED = [[[9, 9, 0], [9, 9, 0], [8, 9, 0]], [[0, 0, 0], [1, 0, 0], [1, 1, 0]], [[1, 0, 0], [1, 1, 0], [0, 0, 0]], [[0, 0, 0], [1, 1, 0], [0, 1, 0]], [[7, 7, 7], [7, 7, 7], [7, 7, 7]]].flat();
const doubledColor = (i) => [i / 20, 0, 1 - i / 20];
const doubledFiles = {
  OBJ: () => DOUBLED.map((p, i) => `v ${p.join(' ')} ${doubledColor(i).join(' ')}\n`).join('') + [1, 4, 7, 10, 13].map((i) => `f ${i} ${i + 1} ${i + 2}\n`).join(''),
  PLY: () =>
    `ply\nformat ascii 1.0\nelement vertex 15\nproperty float x\nproperty float y\nproperty float z\nproperty float red\nproperty float green\nproperty float blue\nelement face 5\nproperty list uchar int vertex_indices\nend_header\n` +
    DOUBLED.map((p, i) => `${[...p, ...doubledColor(i)].join(' ')}\n`).join('') + [0, 3, 6, 9, 12].map((i) => `3 ${i} ${i + 1} ${i + 2}\n`).join(''),
  glTF: () => {
    const bytes = Buffer.from(new Float32Array([...DOUBLED.flat(), ...DOUBLED.flatMap((_, i) => doubledColor(i)), ...DOUBLED.flatMap((_, i) => [0, 0, i])]).buffer);
    const accessor = (k) => ({ bufferView: k, componentType: 5126, count: 15, type: 'VEC3', min: [0, 0, 0], max: [9, 9, 14] });
    return JSON.stringify({
      asset: { version: '2.0' }, scene: 0, scenes: [{ nodes: [0] }], nodes: [{ mesh: 0 }],
      meshes: [{ primitives: [{ attributes: { POSITION: 0, COLOR_0: 1 } }] }],
      accessors: [0, 1].map(accessor), bufferViews: [0, 1].map((k) => ({ buffer: 0, byteOffset: 180 * k, byteLength: 180 })),
      buffers: [{ byteLength: bytes.length, uri: `data:application/octet-stream;base64,${bytes.toString('base64')}` }],
    });
  },
};

for (const [format, file] of Object.entries(doubledFiles))
  test(`faces left out leave no points behind: ${format}`, async () => {
    const model = await daemon.upload(file());
    const { meshes: [mesh], warnings } = await (await fetch(model)).json();
    assert.deepEqual([mesh.vertices, mesh.unused_points, mesh.faces, mesh.boundary_edges], [4, 0, 2, 4]);
    assert.match(warnings.join(), /1 face is left out: it is listed twice/);
    const glb = Buffer.from(await (await fetch(`${model}/surface.glb?level=0&quads=ngon`)).arrayBuffer());
    const { scene } = await load(glb);
    const geometry = scene.getObjectByProperty('isMesh', true).geometry;
    // The faces that stay are those with the vertices 3 to 5 and 9 to 11.
    const linear = (c) => (format === 'glTF' ? c : c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4);
    const wanted = [3, 4, 5, 9, 10, 11].map((i) => [...DOUBLED[i], ...doubledColor(i).map(linear)]);
    const found = triangles(geometry, 'position').flatMap((corners, t) => corners.map((p, k) => [...p, ...triangles(geometry, 'color')[t][k].slice(0, 3)]));
    const key = (row) => row.map((x) => x.toFixed(3)).join();
    assert.deepEqual(found.map(key).sort(), wanted.map(key).sort());
  });

test('a corner that welding makes double is told', async () => {
  const body = 'v 0 0 0\nv 1 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4 5\n';
  const { meshes: [mesh], warnings } = await (await fetch(await daemon.upload(body))).json();
  assert.deepEqual([mesh.vertices, mesh.unused_points, mesh.face_sizes], [4, 0, { 4: 1 }]);
  assert.deepEqual(warnings, ['1 face names a point twice in a row: it keeps it once']);
});

for (const level of [0, 1])
  test(`colours and labels keep to their side of a seam at level ${level}`, async () => {
    const { found: [geometry] } = await meshes('t1_color_seam.gltf', `level=${level}`);
    const [colors, labels] = ['color', '_id'].map((name) => triangles(geometry, name));
    const kinds = new Set(colors.flatMap((corners, t) => corners.map((color, k) => `${color.slice(0, 3)} ${labels[t][k]}`)));
    assert.deepEqual([...kinds].sort(), ['0,0,1 7', '1,0,0 3']);
    for (const corners of labels) assert.equal(new Set(corners.flat()).size, 1);
  });

test('halves of different joints keep them', async () => {
  const { found: [geometry] } = await meshes('t23_weld_joints.gltf', 'level=0');
  const [places, joints] = ['position', 'skinIndex'].map((name) => triangles(geometry, name));
  places.forEach((corners, t) => {
    const half = corners.some(([x]) => x > 1.5) ? 1 : 0;
    for (const [joint] of joints[t]) assert.equal(joint, half);
  });
});

test('a mesh of points alone keeps its targets and weights', async () => {
  const { meshes: [mesh] } = await (await ask('t5b_points_only.gltf', '/surface.gltf?level=0')).json();
  assert.equal(mesh.primitives[0].targets.length, 1);
  assert.deepEqual(mesh.weights, [0.5]);
});

test('EXT_mesh_polygon, whose data would be another file\'s, is left out and told', async () => {
  const { found, warning } = await meshes('t6_mesh_polygon.gltf', 'level=0');
  assert.equal(found.length, 1);
  assert.match(warning, /EXT_mesh_polygon .* is left out/);
});

test('a concave polygon has its area', async () => {
  const body = 'v 0 0 0\nv 2 1 0\nv 0 2 0\nv 1 1 0\nf 1 2 3 4\n';
  const response = await fetch(`${daemon.url}/v1/surface.glb?level=0`, { method: 'POST', body });
  const { scene } = await load(Buffer.from(await response.arrayBuffer()));
  const areas = triangles(scene.children[0].geometry, 'position').map(([a, b, c]) => ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])) / 2);
  assert.ok(areas.every((area) => area > 0));
  near([areas.reduce((sum, area) => sum + area)], [1]);
});

// Letters have no corner from which a fan is right. Between them squares, and wings, which have one, of two
// materials: neighbours in FB_ngon_encoding may not begin with the same vertex.
const LETTER = [[0, 0], [3, 0], [3, 1], [1, 1], [1, 2], [3, 2], [3, 3], [1, 3], [1, 4], [3, 4], [3, 5], [0, 5]];
const WING = [[0, 0], [6, 0], [3, 1], [5, 4], [2, 2.2], [2, 6], [0.3, 2]];
const SQUARE = [[0, 0], [2, 0], [2, 2], [0, 2]];
const row = [LETTER, SQUARE, LETTER, LETTER, WING, WING, SQUARE, LETTER, SQUARE, WING];
const letters = row.map((shape, k) => shape.map(([x, y]) => `v ${x + 10 * k} ${y} ${k / 10}\n`).join('') + `usemtl m${k % 3 ? 1 : 0}\nf ${shape.map((_, i) => i - shape.length).join(' ')}\n`).join('');
const areaOf = (shape) => shape.reduce((sum, [x, y], i) => sum + x * shape.at(i - 1)[1] - shape.at(i - 1)[0] * y, 0) / -2;

for (const query of ['', '&encoding=quantized', '&encoding=meshopt', '&limit=true&scheme=bilinear'])
  test(`polygons without a fan keep their area as n-gons${query}`, async () => {
    const response = await fetch(`${await daemon.upload(letters)}/surface.glb?level=0&polygons=ngon${query}`);
    const warning = warningOf(response);
    const { scene } = await load(Buffer.from(await response.arrayBuffer()));
    const corners = [];
    scene.updateMatrixWorld(true);
    scene.traverse((object) => object.isMesh && corners.push(...triangles(object.geometry, 'position').map((three) => three.map((p) => new Vector3(...p).applyMatrix4(object.matrixWorld).toArray()))));
    assert.match(warning, /4 concave polygons are no fans from any corner: split into triangles/);
    const areas = corners.map(([a, b, c]) => ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])) / 2);
    assert.ok(areas.every((area) => area > -0.05));
    near([areas.reduce((sum, area) => sum + area)], [row.reduce((sum, shape) => sum + areaOf(shape), 0)], 0.05);
  });

test('polygons that were split are whole when they are read again', async () => {
  const model = await daemon.upload(letters);
  const text = async (at, query) => (await fetch(`${at}/surface.${query}`)).text();
  const bytes = Buffer.from(await (await fetch(`${model}/surface.glb?level=0&polygons=ngon`)).arrayBuffer());
  const again = await daemon.upload(bytes);
  for (const query of ['obj?level=0', 'obj?level=2', 'gltf?level=1', 'gltf?level=0&polygons=ngon']) assert.equal(await text(again, query), await text(model, query), query);
  // Tags that do not fit are left out.
  for (const [from, to] of [['"sizes":', '"SIZES":'], ['"corners":', '"CORNERS":']]) {
    const broken = Buffer.from(bytes);
    const at = broken.indexOf(from, broken.indexOf('"polygons":{"triangles"'));
    broken.write(to, at);
    const { warnings } = await (await fetch(await daemon.upload(broken))).json();
    assert.match(warnings.join(), /extras\.tweend of mesh 0 are left out/);
  }
});

test('points that no face has are a clear error', async () => {
  const response = await fetch(`${daemon.url}/v1/surface.json?level=0`, { method: 'POST', body: bytesOf('hostile-points.glb') });
  assert.equal(response.status, 422);
  assert.equal((await response.json()).errors[0].pointer, '/meshes/0/extras/tweend/points');
});
