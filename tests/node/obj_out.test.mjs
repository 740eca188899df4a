// What surface.obj says of a model, as three's OBJLoader reads it: the colours of the GLB of the same model (sRGB in
// OBJ, linear in glTF), a mesh as closed as the GLB's points are, losses in a warning, skinned meshes at their joints,
// default weights of morph targets, and names that occur once.
import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';

import { OBJLoader } from 'three/addons/loaders/OBJLoader.js';

import { Daemon } from './daemon.mjs';
import { load } from './player.mjs';

const daemon = new Daemon();
before(() => daemon.start());
after(() => daemon.remove());

let seed = 11;
const random = () => (seed = (seed * 48271) % 2147483647) / 2147483647;

async function ask(model, query) {
  const response = await fetch(`${model}/surface.${query}`);
  assert.equal(response.status, 200, query);
  return { bytes: Buffer.from(await response.arrayBuffer()), warning: decodeURIComponent(response.headers.get('X-Tweend-Warning') ?? '') };
}

// ---- files --------------------------------------------------------------------------------------------

/** glTF whose buffer is embedded. add(array, type, more) makes an accessor of the document. */
function document(fill) {
  const root = { asset: { version: '2.0' }, scene: 0, scenes: [{ nodes: [0] }], accessors: [], bufferViews: [] };
  const chunks = [];
  let size = 0;
  const add = (array, type, more) => {
    const bytes = Buffer.from(array.buffer);
    root.bufferViews.push({ buffer: 0, byteOffset: size, byteLength: bytes.length });
    chunks.push(bytes, Buffer.alloc(-bytes.length & 3));
    size += (bytes.length + 3) & ~3;
    const componentType = { Uint8Array: 5121, Uint16Array: 5123, Float32Array: 5126 }[array.constructor.name];
    const width = { SCALAR: 1, VEC2: 2, VEC3: 3, VEC4: 4, MAT4: 16 }[type];
    return root.accessors.push({ bufferView: root.bufferViews.length - 1, componentType, count: array.length / width, type, ...more }) - 1;
  };
  fill(root, add);
  root.buffers = [{ byteLength: size, uri: `data:application/octet-stream;base64,${Buffer.concat(chunks).toString('base64')}` }];
  return JSON.stringify(root);
}

const TRIANGLE = [[0, 0, 0], [1, 0, 0], [0, 1, 0]];
const positions = (add, points) => add(new Float32Array(points.flat()), 'VEC3', { min: [0, 1, 2].map((c) => Math.min(...points.map((p) => p[c]))), max: [0, 1, 2].map((c) => Math.max(...points.map((p) => p[c]))) });

const CUBE = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
const corner = (i) => [i & 1, (i >> 1) & 1, i >> 2];

/** A cube; colorOf(face, point) in linear light. */
const cube = (colorOf) => document((root, add) => {
  const points = CUBE.flatMap((face) => face.map(corner));
  const colors = CUBE.flatMap((face, f) => face.flatMap((point) => [...colorOf(f, point), 1]));
  const indices = CUBE.flatMap((_, f) => [0, 1, 2, 0, 2, 3].map((k) => 4 * f + k));
  const attributes = { POSITION: positions(add, points), COLOR_0: add(new Float32Array(colors), 'VEC4') };
  root.meshes = [{ primitives: [{ attributes, indices: add(new Uint16Array(indices), 'SCALAR') }] }];
  root.nodes = [{ mesh: 0, name: 'cube' }];
});

// ---- what answers say -----------------------------------------------------------------------------------

const key = (x, y, z) => [x, y, z].map((c) => c.toFixed(5)).join(' ').replace(/-(0\.0+)(?= |$)/g, '$1');

/** By place: the colours there, linear. */
function colorsOf(object) {
  const found = new Map();
  object.updateMatrixWorld(true);
  object.traverse((mesh) => {
    if (!mesh.isMesh) return;
    const { position, color } = mesh.geometry.attributes;
    assert.ok(color, 'there are colours');
    for (let i = 0; i < position.count; i++) {
      const at = key(position.getX(i), position.getY(i), position.getZ(i));
      if (!found.has(at)) found.set(at, []);
      found.get(at).push([color.getX(i), color.getY(i), color.getZ(i)]);
    }
  });
  return found;
}

const differ = (a, b) => Math.max(...a.map((x, c) => Math.abs(x - b[c])));

/** By index of an OBJ's points: how many faces lie at each edge. */
function edgesOf(text) {
  const edges = new Map();
  for (const [, line] of text.matchAll(/^f (.*)$/gm)) {
    const face = line.split(' ').map((word) => parseInt(word, 10));
    face.forEach((point, i) => {
      const edge = [point, face[(i + 1) % face.length]].sort((a, b) => a - b).join();
      edges.set(edge, (edges.get(edge) ?? 0) + 1);
    });
  }
  return edges;
}

// ---- colours --------------------------------------------------------------------------------------------

const ofPoints = [...Array(8)].map(() => [random(), random() / 50, random()]);
const ofFaces = [...Array(6)].map(() => [random(), random(), random() / 50]);

for (const level of [0, 1, 2, 3])
  for (const more of ['', '&limit=true', '&normals=none', '&scheme=bilinear'])
    test(`colours of points, level ${level}${more}: those of the GLB`, async () => {
      const model = await daemon.upload(cube((_, point) => ofPoints[point]));
      const { bytes, warning } = await ask(model, `obj?level=${level}${more}`);
      assert.doesNotMatch(warning, /without/);
      const shown = colorsOf(new OBJLoader().parse(bytes.toString()));
      const wanted = colorsOf((await load((await ask(model, `glb?level=${level}${more}`)).bytes)).scene);
      assert.equal(shown.size, wanted.size);
      for (const [at, [color]] of wanted) for (const other of shown.get(at)) assert.ok(differ(color, other) < 4e-6, `${at}: ${other} is not ${color}`);
    });

for (const level of [0, 1, 2, 3])
  for (const more of ['', '&normals=none', '&boundary=edge-only&limit=true'])
    test(`colours of faces, level ${level}${more}: each point has that of one of its faces, and the mesh stays closed`, async () => {
      const model = await daemon.upload(cube((face) => ofFaces[face]));
      const { bytes, warning } = await ask(model, `obj?level=${level}${more}`);
      assert.match(warning, /^\d; surface\.obj is without the further colours of 8 control points where faces differ/);
      assert.equal([...bytes.toString().matchAll(/^v /gm)].length, 6 * 4 ** level + 2);
      assert.ok([...edgesOf(bytes.toString()).values()].every((faces) => faces === 2));
      const shown = colorsOf(new OBJLoader().parse(bytes.toString()));
      const wanted = colorsOf((await load((await ask(model, `glb?level=${level}${more}`)).bytes)).scene);
      assert.equal(shown.size, wanted.size);
      for (const [at, colors] of wanted) for (const other of shown.get(at)) assert.ok(colors.some((color) => differ(color, other) < 4e-6), `${at}: ${other} is none of ${colors}`);
    });

test('an OBJ with colours comes back with the same numbers, near and far from the origin', async () => {
  for (const far of [0, 4e6]) {
    const points = [...Array(8).keys()].map((i) => `v ${corner(i).map((x) => x + far).join(' ')} ${[random(), random() / 1000, 0].map((x) => Number(x.toFixed(6))).join(' ')}`);
    const faces = CUBE.map((face) => `f ${face.map((i) => i + 1).join(' ')}`);
    const model = await daemon.upload(`o cube\n${points.join('\n')}\n${faces.join('\n')}\n`);
    const { bytes } = await ask(model, 'obj?level=0&normals=none');
    assert.deepEqual([...bytes.toString().matchAll(/^v .*$/gm)].map(([line]) => line), points);
    assert.equal((await ask(await daemon.upload(bytes), 'obj?level=0&normals=none')).bytes.toString(), bytes.toString());
  }
});

test('every 8-bit colour of an OBJ comes back', async () => {
  const shades = [...Array(256).keys()].map((i) => Number((i / 255).toFixed(6)));
  const points = shades.map((s, i) => `v ${i} 0 0 ${s} ${s} ${s}\nv ${i} 1 0 ${s} ${s} ${s}`);
  const faces = shades.slice(1).map((_, i) => `f ${2 * i + 1} ${2 * i + 3} ${2 * i + 4} ${2 * i + 2}`);
  const { bytes } = await ask(await daemon.upload(`${points.join('\n')}\n${faces.join('\n')}\n`), 'obj?level=0&normals=none');
  assert.deepEqual([...bytes.toString().matchAll(/^v .*$/gm)].map(([line]) => line), points.flatMap((two) => two.split('\n')));
});

test('an object without colours beside one that has some gets none', async () => {
  const triangle = (z, color) => TRIANGLE.map(([x, y]) => `v ${x} ${y} ${z}${color}\n`).join('');
  const model = await daemon.upload(`o red\n${triangle(0, ' 1 0 0')}f 1 2 3\no plain\n${triangle(1, '')}f 4 5 6\n`);
  const { bytes } = await ask(model, 'obj?level=1');
  const [red, plain] = new OBJLoader().parse(bytes.toString()).children;
  assert.ok(red.geometry.attributes.color);
  assert.equal(plain.geometry.attributes.color, undefined);
  const { scene } = await load((await ask(model, 'glb?level=1')).bytes);
  assert.deepEqual(scene.children.map((mesh) => !!mesh.geometry.attributes.color), [true, false]);
});

test('points of a surface.obj with colours are taken as details', async () => {
  const model = await daemon.upload(cube((_, point) => ofPoints[point]));
  const { bytes } = await ask(model, 'obj?level=2');
  const moved = bytes.toString().replace(/^v (\S+)/gm, (_, x) => `v ${Number(x) + (x > 0.5 ? 0.01 : 0)}`);
  const response = await fetch(`${model}/detail?mesh=mesh_0&level=2`, { method: 'POST', headers: { 'Content-Type': 'model/obj' }, body: moved });
  assert.equal(response.status, 201, await response.clone().text());
  const { id } = await response.json();
  const again = new OBJLoader().parse((await ask(`${daemon.url}/v1/models/${id}`, 'obj?level=2')).bytes.toString());
  const wanted = new OBJLoader().parse(moved);
  const of = (object) => [...object.children[0].geometry.attributes.position.array];
  assert.ok(Math.max(...of(again).map((x, i) => Math.abs(x - of(wanted)[i]))) < 1e-5);
});

// ---- what else an OBJ shows -----------------------------------------------------------------------------

test('alpha, further texture coordinates, attributes and materials are told', async () => {
  const model = await daemon.upload(document((root, add) => {
    const attributes = {
      POSITION: positions(add, TRIANGLE),
      COLOR_0: add(new Float32Array(TRIANGLE.flatMap(() => [1, 0, 0, 0.5])), 'VEC4'),
      TEXCOORD_0: add(new Float32Array(6), 'VEC2'),
      TEXCOORD_1: add(new Float32Array([0, 0, 1, 0, 0, 1]), 'VEC2'),
      _HEAT: add(new Float32Array(3), 'SCALAR'),
    };
    root.materials = [{ name: 'paint', pbrMetallicRoughness: { baseColorFactor: [1, 0, 0, 1] } }];
    root.meshes = [{ primitives: [{ attributes, material: 0 }] }];
    root.nodes = [{ mesh: 0 }];
  }));
  const { warning } = await ask(model, 'obj?level=1');
  assert.match(warning, /^1; surface\.obj is without alpha, attributes of the application, texture coordinates behind the first set, all of 1 material but its name$/);
  assert.doesNotMatch((await ask(model, 'glb?level=1')).warning, /without/);
});

// Texture coordinates that gltfpack wrote, say, go from 0 to 4095, and the material scales them down.
for (const [transform, isMoved] of [
  [{ scale: [1 / 4095, 1 / 4095] }, true], [{ offset: [0, 0.5] }, true], [{ rotation: -1e-3 }, true],
  [{}, false], [{ offset: [0, -0], rotation: 0.0, scale: [1, 1.0], texCoord: 0 }, false],
])
  test(`texture coordinates are without ${JSON.stringify(transform)} in OBJ and PLY, which is told where it moves them`, async () => {
    const model = await daemon.upload(document((root, add) => {
      const attributes = { POSITION: positions(add, [...TRIANGLE, [0, 0, 1]]), TEXCOORD_0: add(new Float32Array([0, 0, 4095, 0, 0, 4095, 7, 7]), 'VEC2') };
      const indices = add(new Uint16Array([0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3]), 'SCALAR');
      const baseColorTexture = { index: 0, extensions: { KHR_texture_transform: transform } };
      root.images = [{ uri: 'data:image/png;base64,iVBORw0KGgo=' }];
      root.textures = [{ source: 0 }];
      root.extensionsUsed = ['KHR_texture_transform'];
      root.materials = [{ pbrMetallicRoughness: { baseColorTexture } }];
      root.meshes = [{ primitives: [{ attributes, indices, material: 0 }] }];
      root.nodes = [{ mesh: 0 }];
    }));
    const told = /without.* the transforms of texture coordinates \(KHR_texture_transform\)/;
    const expect = isMoved ? assert.match : assert.doesNotMatch;
    for (const form of ['obj', 'ply']) expect((await ask(model, `${form}?level=1`)).warning, told);
    assert.doesNotMatch((await ask(model, 'glb?level=1')).warning, told);
  });

test('a skinned mesh lies where its joints put it, whatever its own node does', async () => {
  const model = await daemon.upload(document((root, add) => {
    const attributes = { POSITION: positions(add, TRIANGLE), JOINTS_0: add(new Uint8Array(12), 'VEC4'), WEIGHTS_0: add(new Float32Array([1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0]), 'VEC4') };
    root.meshes = [{ primitives: [{ attributes }] }];
    const inverseBindMatrices = add(new Float32Array([2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1]), 'MAT4');
    root.skins = [{ joints: [2], inverseBindMatrices }];
    root.nodes = [{ scale: [0.01, 0.01, 0.01], children: [1, 2] }, { mesh: 0, skin: 0, translation: [5, 5, 5] }, { translation: [100, 0, 0] }];
  }));
  const points = [...(await ask(model, 'obj?level=0&normals=none')).bytes.toString().matchAll(/^v (.*)$/gm)].map(([, line]) => line.split(' ').map(Number));
  // Joint in the world: scale 0.01 and 100 / 100 along x; times the inverse bind matrix of scale 2.
  TRIANGLE.forEach((p, i) => assert.ok(differ(p.map((x, c) => 0.02 * x + (c === 0 ? 1 : 0)), points[i]) < 1e-6, `${points[i]}`));
});

test('morph targets move points by the weights of the mesh, or of the node that has its own', async () => {
  const model = await daemon.upload(document((root, add) => {
    const attributes = { POSITION: positions(add, TRIANGLE) };
    const targets = [1, 10].map((z) => ({ POSITION: positions(add, TRIANGLE.map(() => [0, 0, z])) }));
    root.meshes = [{ primitives: [{ attributes, targets }], weights: [0.5, 0] }];
    root.nodes = [{ mesh: 0 }, { mesh: 0, weights: [0, 0.25] }];
    root.scenes = [{ nodes: [0, 1] }];
  }));
  const heights = [...(await ask(model, 'obj?level=0&normals=none')).bytes.toString().matchAll(/^v \S+ \S+ (\S+)$/gm)].map(([, z]) => Number(z));
  assert.deepEqual(heights, [0.5, 0.5, 0.5, 2.5, 2.5, 2.5]);
});

test('objects have the names of nodes, each once', async () => {
  const model = await daemon.upload(document((root, add) => {
    root.meshes = [{ name: 'wheel', primitives: [{ attributes: { POSITION: positions(add, TRIANGLE) } }] }];
    root.nodes = ['left', 'left', undefined, 'left_2', undefined].map((name) => ({ name, mesh: 0 }));
    root.scenes = [{ nodes: [0, 1, 2, 3, 4] }];
  }));
  const names = [...(await ask(model, 'obj?level=0')).bytes.toString().matchAll(/^o (.*)$/gm)].map(([, name]) => name);
  assert.equal(new Set(names).size, 5);
  assert.deepEqual([names[0], names[2], names[3]], ['left', 'wheel', 'left_2']);
});

test('a cage with a border and without normals comes back the same, with normals that were computed', async () => {
  // A strip that turns by 90 degrees: its border would have corners where normals told that it is smooth.
  const points = [0, 1, 2, 3].flatMap((x) => [0, 1, 2, 3].map((y) => `v ${x} ${y} ${x * y * 0.1}`));
  const faces = [0, 1, 2].flatMap((x) => [0, 1, 2].filter((y) => x === 0 || y === 0).map((y) => [4 * x + y + 1, 4 * x + y + 5, 4 * x + y + 6, 4 * x + y + 2]));
  const cage = `${points.join('\n')}\n${faces.map((face) => `f ${face.join(' ')}`).join('\n')}\n`;
  const model = await daemon.upload(cage);
  const surface = async (of, query) => (await fetch(`${of}/surface.${query}`)).arrayBuffer();
  const wanted = Buffer.from(await surface(model, 'obj?level=2')).toString();
  for (const form of ['obj?level=0', 'glb?level=0&polygons=ngon']) {
    const again = await daemon.upload(Buffer.from(await surface(model, form)));
    const found = Buffer.from(await surface(again, 'obj?level=2')).toString();
    const placesOf = (text) => text.split('\n').filter((line) => line.startsWith('v '));
    assert.deepEqual(placesOf(found), placesOf(wanted), form);
  }
});

test('the cage of a surface with creases, corners of borders and texture coordinates is found again', async () => {
  // A strip bent by a right angle, hard there, whose border turns.
  const points = [0, 1, 2, 3].flatMap((x) => [0, 1, 2, 3].map((y) => `v ${x} ${Math.min(y, 1)} ${Math.max(y - 1, 0)}`));
  const coordinates = [0, 1, 2, 3].flatMap((x) => [0, 1, 2, 3].map((y) => `vt ${((x * x + y) / 12).toFixed(3)} ${((y * y - x) / 12).toFixed(3)}`));
  const cells = [0, 1, 2].flatMap((x) => [0, 1, 2].filter((y) => x < 2 || y === 0).map((y) => [x, y]));
  const faceOf = ([x, y]) => `s ${y > 0 ? 2 : 1}\nf ${[4 * x + y + 1, 4 * x + y + 5, 4 * x + y + 6, 4 * x + y + 2].map((i) => `${i}/${i}`).join(' ')}`;
  const model = await daemon.upload(`${points.join('\n')}\n${coordinates.join('\n')}\n${cells.map(faceOf).join('\n')}\n`);
  const surface = async (of, query) => Buffer.from(await (await fetch(`${of}/surface.${query}`)).arrayBuffer());
  const refined = await daemon.upload(await surface(model, 'glb?level=2&polygons=ngon'));
  const answer = await fetch(`${refined}/coarsen?levels=2`, { method: 'POST' });
  const { id, levels, meshes } = await answer.json();
  assert.equal(levels, 2);
  assert.deepEqual(meshes[0].details, []);
  assert.equal(answer.headers.get('X-Tweend-Warning'), null);
  const cornersOf = (text) => {
    const rows = (word) => text.split('\n').filter((line) => line.startsWith(`${word} `)).map((line) => line.split(' ').slice(1));
    const [v, vt] = [rows('v'), rows('vt')].map((list) => list.map((row) => row.map(Number)));
    return rows('f').flat().map((corner) => corner.split('/').map((i) => Number(i) - 1)).map(([p, t]) => [...v[p], ...vt[t]]);
  };
  const wanted = cornersOf((await surface(model, 'obj?level=2')).toString()), found = cornersOf((await surface(`${daemon.url}/v1/models/${id}`, 'obj?level=2')).toString());
  assert.equal(found.length, wanted.length);
  const near = (a, b) => a.every((x, i) => Math.abs(x - b[i]) < 1e-4);
  assert.ok(wanted.every((corner) => found.some((other) => near(corner, other))));
});

test('coarsening tells of values that the cage does not have exactly', async () => {
  const points = [0, 1, 2].flatMap((x) => [0, 1, 2].map((y) => `v ${x} ${y} 0\nvt ${x / 2} ${y / 2}`));
  const faces = [0, 1].flatMap((x) => [0, 1].map((y) => `f ${[3 * x + y + 1, 3 * x + y + 4, 3 * x + y + 5, 3 * x + y + 2].map((i) => `${i}/${i}`).join(' ')}`));
  const cage = await daemon.upload(`${points.join('\n')}\n${faces.join('\n')}\n`);
  const text = await (await fetch(`${cage}/surface.obj?level=1&normals=none`)).text();
  const answer = await fetch(`${await daemon.upload(text.replace(/^vt .*$/m, 'vt 0.4 0.3'))}/coarsen?levels=1`, { method: 'POST' });
  assert.match(decodeURIComponent(answer.headers.get('X-Tweend-Warning')), /texture coordinates, attributes or morph targets of the cage's surfaces differ from the mesh's by up to \d+ % of their range/);
});
