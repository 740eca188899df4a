// Answers without a hierarchy (OBJ, STL, PLY, 3MF) of scenes with all that glTF has: they show what three draws of the GLB of the
// same request. Meshes at several nodes, below others that mirror, several materials, colours, morph targets with their
// weights, skins at rest and posed. surface.bin has the points of a mesh by itself.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { existsSync, mkdtempSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, test } from 'node:test';

import { Matrix4, Quaternion, Vector3 } from 'three';

import { Daemon, root } from './daemon.mjs';
import { load, playerOf } from './player.mjs';
import { areaOf, assertSame, boundsOf, drawn, read, volumeOf } from './seen.mjs';

const daemon = new Daemon();
const folder = mkdtempSync(join(tmpdir(), 'scenes-'));
before(() => daemon.start());
after(() => daemon.remove());
after(() => rmSync(folder, { recursive: true }));

let seed = 37;
const random = () => (seed = (seed * 48271) % 2147483647) / 2147483647;
const spread = (by) => (random() * 2 - 1) * by;
const vector = (by) => [spread(by), spread(by), spread(by)];
const unit = (q) => q.map((x) => x / Math.hypot(...q));
const turn = () => unit([spread(1), spread(1), spread(1), spread(1)]);

async function ask(model, query) {
  const response = await fetch(`${model}/surface.${query}`);
  const bytes = Buffer.from(await response.arrayBuffer());
  assert.equal(response.status, 200, `${query}: ${bytes}`);
  return bytes;
}

// ---- files ----------------------------------------------------------------------------------------------

const CUBE = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];

/** Fills the meshes and nodes of a document. Cubes without two equal edges, in two primitives. */
class File {
  root = { asset: { version: '2.0' }, scene: 0, scenes: [{ nodes: [] }], meshes: [], nodes: [], accessors: [], bufferViews: [], materials: [{ name: 'red', pbrMetallicRoughness: { baseColorFactor: [1, 0, 0, 1] } }, { name: 'blue' }] };
  chunks = [];
  size = 0;

  add(array, type, more) {
    const bytes = Buffer.from(array.buffer);
    this.root.bufferViews.push({ buffer: 0, byteOffset: this.size, byteLength: bytes.length });
    this.chunks.push(bytes, Buffer.alloc(-bytes.length & 3));
    this.size += (bytes.length + 3) & ~3;
    const componentType = { Uint8Array: 5121, Uint16Array: 5123, Float32Array: 5126 }[array.constructor.name];
    const count = array.length / { SCALAR: 1, VEC3: 3, VEC4: 4, MAT4: 16 }[type];
    return this.root.accessors.push({ bufferView: this.root.bufferViews.length - 1, componentType, count, type, ...more }) - 1;
  }

  positions(points) {
    const axis = (c) => points.map((p) => Math.fround(p[c]));
    return this.add(new Float32Array(points.flat()), 'VEC3', { min: [0, 1, 2].map((c) => Math.min(...axis(c))), max: [0, 1, 2].map((c) => Math.max(...axis(c))) });
  }

  mesh({ colors, targets = 0, weights, joints = 0 } = {}) {
    const points = Array.from({ length: 8 }, (_, i) => [i & 1, (i >> 1) & 1, i >> 2].map((x) => x * 2 + spread(0.3)));
    const attributes = { POSITION: this.positions(points) };
    if (colors) attributes.COLOR_0 = this.add(new Float32Array(Array.from({ length: 32 }, (_, i) => (i % 4 === 3 ? 1 : random()))), 'VEC4');
    if (joints) {
      attributes.JOINTS_0 = this.add(new Uint8Array(points.flatMap(() => [0, 1, 0, 0])), 'VEC4');
      attributes.WEIGHTS_0 = this.add(new Float32Array(points.flatMap(([, y]) => { const share = Math.min(1, Math.max(0, y / 2)); return [1 - share, share, 0, 0]; }).map((x) => Math.fround(x))), 'VEC4');
    }
    const moves = Array.from({ length: targets }, () => ({ POSITION: this.positions(points.map(() => vector(0.5))) }));
    const primitives = [0, 1].map((material) => {
      const faces = CUBE.filter((_, i) => i % 2 === material);
      const indices = this.add(new Uint16Array(faces.flatMap(([a, b, c, d]) => [a, b, c, a, c, d])), 'SCALAR');
      return { attributes, indices, material, ...(targets && { targets: moves }) };
    });
    return this.root.meshes.push({ name: `mesh${this.root.meshes.length}`, primitives, ...(weights && { weights }) }) - 1;
  }

  node(node, parent) {
    const number = this.root.nodes.push({ name: `node${this.root.nodes.length}`, ...node }) - 1;
    if (parent === undefined) this.root.scenes[0].nodes.push(number);
    else (this.root.nodes[parent].children ??= []).push(number);
    return number;
  }

  /** Two joints below a node, of which the second bends the upper half. */
  skin(parent) {
    const lower = this.node({ rotation: turn(), translation: vector(1) }, parent), upper = this.node({ translation: [0, 1, 0], rotation: turn() }, lower);
    const binds = [[1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1], [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, -1, 0, 1]];
    const skins = (this.root.skins ??= []);
    return { skin: skins.push({ joints: [lower, upper], inverseBindMatrices: this.add(new Float32Array(binds.flat()), 'MAT4') }) - 1, lower, upper };
  }

  /** A clip that moves nodes: [node, path, three values]. */
  clip(...moves) {
    const input = this.add(new Float32Array([0, 1, 2]), 'SCALAR', { min: [0], max: [2] });
    const samplers = moves.map(([, path, values]) => ({ input, output: this.add(new Float32Array(values.flat()), path === 'weights' ? 'SCALAR' : path === 'rotation' ? 'VEC4' : 'VEC3') }));
    this.root.animations = [{ name: 'move', samplers, channels: moves.map(([node, path], sampler) => ({ sampler, target: { node, path } })) }];
  }

  toString() {
    const uri = `data:application/octet-stream;base64,${Buffer.concat(this.chunks).toString('base64')}`;
    return JSON.stringify({ ...this.root, buffers: [{ byteLength: this.size, uri }] });
  }
}

const place = (scale = [1, 1, 1]) => ({ translation: vector(4), rotation: turn(), scale: scale.map((s) => s * (0.5 + random())) });
const matrixOf = ({ translation, rotation, scale }) => new Matrix4().compose(new Vector3(...translation), new Quaternion(...rotation), new Vector3(...scale)).toArray();

const scenes = {
  'a mesh at nodes that mirror, below others': () => {
    const file = new File(), mesh = file.mesh();
    const above = file.node(place([-1, 1, 1])), below = file.node({ matrix: matrixOf(place([1, 1, -1])) }, above);
    file.node({ mesh, ...place() }, above);
    file.node({ mesh, ...place([1, -1, 1]) }, above);
    file.node({ mesh, ...place([-1, -1, -1]) }, below);
    file.node({ mesh, ...place() }, below);
    file.node({ mesh, ...place() });
    return file;
  },
  'colours and materials': () => {
    const file = new File();
    file.node({ mesh: file.mesh({ colors: true }), ...place() });
    file.node({ mesh: file.mesh(), ...place([-1, 1, 1]) });
    return file;
  },
  'weights of morph targets, of meshes and of nodes': () => {
    const file = new File(), mesh = file.mesh({ targets: 2, weights: [0.75, -0.5] });
    file.node({ mesh, ...place() });
    file.node({ mesh, ...place([1, 1, -1]), weights: [0.25, 1.5] });
    const plain = file.node({ mesh: file.mesh({ targets: 1 }), ...place() });
    file.clip([plain, 'weights', [0, 1, 0.25]]);
    return file;
  },
  'a skin': () => {
    const file = new File(), { skin, upper } = file.skin();
    file.node({ mesh: file.mesh({ joints: 2 }), skin, ...place() });
    file.clip([upper, 'rotation', [turn(), turn(), turn()]]);
    return file;
  },
  'a skin with targets below a node that mirrors, whose mesh others show too': () => {
    const file = new File(), above = file.node(place([-1, 1.5, 1])), { skin, lower, upper } = file.skin(above);
    const mesh = file.mesh({ joints: 2, targets: 1, weights: [0.5], colors: true });
    const own = file.node({ mesh, skin, ...place() }, above);
    file.node({ mesh, ...place([1, 1, -1]) }, above);
    file.clip([upper, 'rotation', [turn(), turn(), turn()]], [lower, 'translation', [vector(1), vector(1), vector(1)]], [own, 'weights', [0, 1, 0.5]]);
    return file;
  },
  'two skins of one mesh': () => {
    const file = new File(), mesh = file.mesh({ joints: 2 }), first = file.skin(), second = file.skin(file.node(place()));
    file.node({ mesh, skin: first.skin });
    file.node({ mesh, skin: second.skin });
    file.clip([first.upper, 'rotation', [turn(), turn(), turn()]]);
    return file;
  },
  'joints that mirror': () => {
    const file = new File(), above = file.node(place([-1, 1, 1])), { skin } = file.skin(above);
    file.node({ mesh: file.mesh({ joints: 2 }), skin });
    return file;
  },
};

// ---- what answers show ------------------------------------------------------------------------------------

const judge = join(root, 'build/tests/threemf_facts'), hasLib3mf = existsSync(judge);

/** Triangles, bounds and volume of a 3MF's items, as lib3mf reads them. */
function assertPackage(bytes, wanted, tolerance) {
  const file = join(folder, 'a.3mf');
  writeFileSync(file, bytes);
  const { items, warnings } = JSON.parse(execFileSync(judge, [file], { encoding: 'utf8' }));
  const sum = (of) => items.reduce((total, item) => total + of(item), 0);
  assert.deepEqual([warnings, sum(({ triangles }) => triangles)], [0, wanted.length]);
  boundsOf(wanted).forEach((bound, i) => assert.ok(Math.abs(bound - (i < 3 ? Math.min : Math.max)(...items.map(({ bounds }) => bounds[i]))) < tolerance, `3mf: bound ${i}`));
  assert.ok(Math.abs(sum(({ volume }) => volume) - volumeOf(wanted)) < 20 * tolerance * wanted.length, `3mf: volume ${sum(({ volume }) => volume)}, ${volumeOf(wanted)}`);
}

/** isCut: of triangles alone, as readers of OBJ cut concave quads in a way of their own. */
async function assertForms(model, query, wanted, isCut) {
  const tolerance = 1e-5 * Math.max(...boundsOf(wanted).map(Math.abs));
  for (const form of ['stl', 'ply']) assertSame(read[form](await ask(model, `${form}?${query}${form === 'stl' ? '&unit=m' : ''}`)), wanted, tolerance, form);
  const obj = read.obj(await ask(model, `obj?${query}`));
  if (isCut) assertSame(obj, wanted, tolerance, 'obj');
  assert.equal(obj.length, wanted.length);
  assert.ok(Math.abs(volumeOf(obj) - volumeOf(wanted)) < 0.02 * areaOf(wanted) ** 1.5, 'obj: volume');
  if (hasLib3mf) assertPackage(await ask(model, `3mf?${query}&unit=m`), wanted, tolerance);
  const { solid } = JSON.parse(await ask(model, `json?${query}&shells=true`));
  assert.equal(solid.triangles, wanted.length);
  assert.ok(Math.abs(solid.volume - volumeOf(wanted)) < 20 * tolerance * wanted.length, `json: volume ${solid.volume}, ${volumeOf(wanted)}`);
}

const NO_NORMALS = 'normals=none&creases=none';

for (const [name, make] of Object.entries(scenes)) {
  const file = make(), source = file.toString(), isAnimated = file.root.animations !== undefined;

  test(`${name}: at rest, as the file itself is drawn`, async () => {
    const wanted = drawn((await load(source)).scene);
    const model = await daemon.upload(source), query = `level=0&clip=none&quads=off&${NO_NORMALS}`;
    assertSame(drawn((await load(await ask(model, `glb?${query}`))).scene), wanted, 2e-5, 'glb');
    await assertForms(model, query, wanted, true);
  });

  test(`${name}: posed, as the clip is played`, { skip: !isAnimated && 'nothing moves' }, async () => {
    const model = await daemon.upload(source);
    for (const at of [0.5, 1.75]) {
      const gltf = await load(source);
      playerOf(gltf)(at);
      await assertForms(model, `level=0&clip=move&at=${at}&quads=off&${NO_NORMALS}`, drawn(gltf.scene), true);
    }
  });

  // Joints move the cage, and the surface follows.
  test(`${name}: at level 2, as the GLB with a baked skin`, async () => {
    const model = await daemon.upload(source);
    for (const moment of isAnimated ? ['clip=none', 'clip=move&at=1.25'] : ['clip=none']) {
      const query = `level=2&${moment}&${NO_NORMALS}`;
      await assertForms(model, query, drawn((await load(await ask(model, `glb?${query}&skin=bake`))).scene));
    }
  });

  test(`${name}: points as bytes are those of a mesh by itself`, async () => {
    const model = await daemon.upload(source);
    for (const { name: mesh } of file.root.meshes) {
      const bytes = await ask(model, `bin?level=1&mesh=${mesh}&creases=none`), length = bytes.readUInt32LE(8);
      const { points, stride } = JSON.parse(bytes.toString('utf8', 12, 12 + length));
      const found = new Float32Array(new Uint8Array(bytes.subarray(12 + length)).buffer), places = new Set();
      assert.deepEqual([stride, found.length], [3, 3 * points]);
      const gltf = await load(await ask(model, `glb?level=1&clip=none&${NO_NORMALS}`));
      gltf.scene.traverse((object) => {
        if (!object.isMesh || gltf.parser.json.meshes[gltf.parser.associations.get(object).meshes].name !== mesh) return;
        for (const position = object.geometry.attributes.position, i = { at: 0 }; i.at < position.count; i.at++) places.add([0, 1, 2].map((c) => position.getComponent(i.at, c) + 0).join());
      });
      assert.deepEqual(new Set(Array.from({ length: points }, (_, i) => [...found.subarray(3 * i, 3 * i + 3)].map((x) => x + 0).join())), places);
    }
  });
}
