// Poses of generated clips against three.js, and the binary form by the reader that openapi.json shows.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { after, before, test } from 'node:test';

import { Euler, Matrix4, Quaternion } from 'three';

import { Daemon, root } from './daemon.mjs';
import { load, nodesOf, playerOf } from './player.mjs';

const daemon = new Daemon();
before(() => daemon.start());
after(() => daemon.remove());

/** Numbers from 0 to 1 that are the same in every run (Marsaglia's xorshift). */
function randomOf(seed) {
  let state = seed;
  return () => {
    state ^= state << 13;
    state ^= state >>> 17;
    state ^= state << 5;
    return (state >>> 0) / 4294967296;
  };
}

// ---- generated files ------------------------------------------------------------------------------

const FLOAT = 5126;
const COMPONENTS = { 5120: [Int8Array, 127], 5122: [Int16Array, 32767], 5126: [Float32Array, 1] };

/** A glTF file in the making: accessors into one buffer. */
class File {
  document = { asset: { version: '2.0' }, accessors: [], bufferViews: [], buffers: [], animations: [], nodes: [] };
  pieces = [];
  size = 0;

  accessor(type, numbers, componentType = FLOAT) {
    const [Kind, scale] = COMPONENTS[componentType];
    const width = { SCALAR: 1, VEC4: 4, MAT4: 16 }[type];
    const values = Kind.from(numbers, (number) => (scale === 1 ? number : Math.round(number * scale)));
    const bytes = Buffer.alloc(Math.ceil(values.byteLength / 4) * 4);
    bytes.set(new Uint8Array(values.buffer));
    const view = { buffer: 0, byteOffset: this.size, byteLength: values.byteLength };
    const accessor = { bufferView: this.document.bufferViews.push(view) - 1, componentType, count: values.length / width, type };
    if (scale !== 1) accessor.normalized = true;
    if (type === 'SCALAR') Object.assign(accessor, { min: [values[0]], max: [values.at(-1)] });
    this.pieces.push(bytes);
    this.size += bytes.length;
    return this.document.accessors.push(accessor) - 1;
  }

  toString() {
    const uri = `data:application/octet-stream;base64,${Buffer.concat(this.pieces).toString('base64')}`;
    this.document.buffers = [{ byteLength: this.size, uri }];
    return JSON.stringify(this.document);
  }
}

function irregularTimes(random, count) {
  let time = random() * 0.1;
  return Array.from({ length: count }, () => (time += 0.02 + random() * random()));
}

/** Every third key is at the time of the one before, every ninth one at that of the two before. */
const repeatedTimes = (random, count) =>
  irregularTimes(random, count).map((_, i, times) => times[i - (i % 9 === 2 ? 2 : i % 3 === 1 ? 1 : 0)]);

/** Unit quaternions any way round. */
const quaternions = (random, count) =>
  Array.from({ length: count }, () => new Quaternion(...Array.from({ length: 4 }, () => random() * 2 - 1)).normalize().toArray());

/** Affine matrices, column by column. */
const inverseBinds = (random, count) =>
  Array.from({ length: count }, () => Array.from({ length: 16 }, (_, i) => (i % 4 < 3 ? random() * 2 - 1 : i === 15 ? 1 : 0)));

const JOINTS = [5, 0, 3];

/** A chain of nodes, each scaled unevenly and turned by a track of its own, some of them joints of a skin. */
function generate(kind, componentType, seed, timesOf = irregularTimes) {
  const random = randomOf(seed);
  const file = new File();
  const [channels, samplers] = [[], []];
  for (let node = 0; node < 6; node++) {
    const times = timesOf(random, 2 + Math.floor(random() * 40));
    const keys = quaternions(random, times.length);
    const tangent = () => Array.from({ length: 4 }, () => (random() * 2 - 1) * 0.8);
    const values = kind === 'CUBICSPLINE' ? keys.flatMap((key) => [...tangent(), ...key, ...tangent()]) : keys.flat();
    const output = file.accessor('VEC4', values, componentType);
    samplers.push({ input: file.accessor('SCALAR', times), output, interpolation: kind });
    channels.push({ sampler: node, target: { node, path: 'rotation' } });
    file.document.nodes.push({ name: `n${node}`, translation: [random(), 1, random()], scale: [1, 0.8 + random() / 2, 1.1] });
    if (node < 5) file.document.nodes[node].children = [node + 1];
  }
  const binds = inverseBinds(random, JOINTS.length);
  file.document.skins = [{ joints: JOINTS, inverseBindMatrices: file.accessor('MAT4', binds.flat()) }];
  Object.assign(file.document, { animations: [{ name: 'clip', channels, samplers }], scenes: [{ nodes: [0] }], scene: 0 });
  return { text: file.toString(), binds };
}

// ---- three.js -------------------------------------------------------------------------------------

function normalise(values) {
  const q = new Quaternion();
  for (let i = 0; i < values.length; i += 4) q.fromArray(values, i).normalize().toArray(values, i);
}

async function play(text, quantised) {
  const gltf = await load(text);
  const nodes = await nodesOf(gltf);
  // Keys in whole numbers are off unit length by their rounding; three.js leaves them so.
  if (quantised) gltf.animations[0].tracks.forEach(({ values }) => normalise(values));
  return { duration: gltf.animations[0].duration, nodes, moveTo: playerOf(gltf) };
}

/** The lesser way round: q and -q turn alike. */
const distance = (a, b) => Math.min(...[1, -1].map((sign) => Math.max(...a.map((x, i) => Math.abs(x - sign * b[i])))));

function assertMatrix(found, { elements }, what) {
  const size = Math.max(...elements.map(Math.abs));
  const off = Math.max(...elements.map((x, e) => Math.abs(x - found[e])));
  assert.ok(off < 1e-5 * size, `${what} is ${off} off`);
}

async function pose(model, query, times) {
  const answer = await fetch(`${model}/pose.json?${query}`, {
    method: 'POST',
    headers: { 'Content-Type': 'application/json' },
    body: JSON.stringify({ times }),
  });
  assert.equal(answer.status, 200);
  return (await answer.json()).poses;
}

for (const [kind, componentType] of [
  ['LINEAR', FLOAT], ['LINEAR', 5122], ['LINEAR', 5120],
  ['STEP', FLOAT], ['STEP', 5122], ['CUBICSPLINE', FLOAT],
]) {
  const stored = { 5120: 'bytes', 5122: 'shorts', 5126: 'floats' }[componentType];
  test(`rotations of ${kind} keys in ${stored} are those of three.js`, async () => {
    for (let seed = 1; seed <= 5; seed++) {
      const { text, binds } = generate(kind, componentType, seed * 7919);
      const three = await play(text, componentType !== FLOAT);
      const model = await daemon.upload(text);
      const random = randomOf(seed);
      const times = Array.from({ length: 200 }, () => Math.fround(random() * three.duration));
      const locals = await pose(model, '', times);
      const worlds = await pose(model, 'space=world&as=matrix', times);
      const skinned = await pose(model, 'skinning=true&as=matrix', times);
      times.forEach((time, i) => {
        three.moveTo(time);
        three.nodes.forEach((node, n) => {
          const off = distance(node.quaternion.toArray(), locals[i].rotation[n]);
          assert.ok(off < 1e-5, `seed ${seed}, node ${n} at ${time} is ${off} off`);
          assertMatrix(worlds[i].matrix[n], node.matrixWorld, `seed ${seed}, matrix ${n} at ${time}`);
        });
        JOINTS.forEach((joint, j) => {
          const wanted = three.nodes[joint].matrixWorld.clone().multiply(new Matrix4().fromArray(binds[j]));
          assertMatrix(skinned[i].matrix[j], wanted, `seed ${seed}, joint ${j} at ${time}`);
        });
      });
    }
  });
}

for (const kind of ['LINEAR', 'STEP', 'CUBICSPLINE'])
  test(`rotations of ${kind} keys at equal times jump as those of three.js, in answers too`, async () => {
    for (let seed = 1; seed <= 5; seed++) {
      const { text } = generate(kind, FLOAT, seed * 7919, repeatedTimes);
      const three = await play(text);
      const model = await daemon.upload(text);
      const written = await play(Buffer.from(await (await fetch(`${model}/surface.glb`)).arrayBuffer()));
      const keys = (await load(text)).animations[0].tracks.flatMap(({ times }) => [...times]);
      const random = randomOf(seed);
      const times = [...keys, ...Array.from({ length: 200 }, () => Math.fround(random() * three.duration))];
      const poses = await pose(model, '', times);
      times.forEach((time, i) => {
        three.moveTo(time);
        written.moveTo(time);
        three.nodes.forEach(({ quaternion }, n) => {
          const wanted = quaternion.toArray();
          const off = [poses[i].rotation[n], written.nodes[n].quaternion.toArray()].map((found) => distance(wanted, found));
          // A key that is moved by a float's step changes its segment by that much.
          assert.ok(Math.max(...off) < 1e-3, `seed ${seed}, node ${n} at ${time} is ${off} off`);
        });
      });
    }
  });

test('Euler angles of every order are those of three.js', async () => {
  const model = await daemon.upload(generate('LINEAR', FLOAT, 4711).text);
  const times = Array.from({ length: 300 }, (_, i) => i / 40);
  const quaternions = await pose(model, '', times);
  for (const order of ['XYZ', 'XZY', 'YXZ', 'YZX', 'ZXY', 'ZYX']) {
    const eulers = await pose(model, `as=euler&order=${order}`, times);
    eulers.forEach(({ t, euler }, i) =>
      euler.forEach((angles, n) => {
        const q = new Quaternion().setFromEuler(new Euler(...angles, order));
        const off = distance(q.toArray(), quaternions[i].rotation[n]);
        assert.ok(off < 1e-5, `${order} of node ${n} at ${t} is ${off} off`);
      }));
  }
});

// ---- the binary form ------------------------------------------------------------------------------

/** The reader that openapi.json shows, as a function of the buffer. */
function documentedReader() {
  const document = JSON.parse(readFileSync(join(root, 'api/openapi.json')));
  const [, code] = document.paths['/v1/models/{id}/pose'].get.description.match(/```js\n([^]*?)```/);
  assert.ok(code.trim().split('\n').length <= 10, 'ten lines');
  return new Function('buffer', `${code}; return { header, rows, part };`);
}

test('ten lines of JavaScript read pose.bin', async () => {
  const model = await daemon.upload(readFileSync(join(root, 'server/samples/tank.json')));
  const read = documentedReader();
  for (const query of ['from=0&to=4&fps=7', 'at=1.3,0&as=matrix&space=world', 'at=2&as=euler&nodes=turret,hull']) {
    const binary = await fetch(`${model}/pose.bin?${query}`);
    const { header, rows, part } = read(await binary.arrayBuffer());
    const wanted = await (await fetch(`${model}/pose.json?${query}`)).json();
    assert.deepEqual(header.nodes, wanted.nodes);
    assert.deepEqual(header.times, wanted.times);
    assert.equal(header.poses, wanted.poses.length);
    assert.equal(rows.length, header.poses * header.stride);
    wanted.poses.forEach((wantedPose, p) =>
      header.layout.forEach(({ name }) =>
        wantedPose[name].forEach((numbers, n) => {
          const found = part(p, n, name);
          assert.equal(found.length, numbers.length);
          found.forEach((x, i) => assert.ok(x === Math.fround(numbers[i]), `${name} of node ${n} in pose ${p}`));
        })));
  }
});

test('a warning tells how to ask for the second of two clips of one name, or that nothing does', async () => {
  const tracks = [{ node: 'a', path: 'translation', times: [0, 1], values: [[0, 0, 0], [1, 0, 0]] }];
  const warned = async (...names) => {
    const model = await daemon.upload(JSON.stringify({ nodes: [{ name: 'a' }], clips: names.map((name) => ({ name, tracks })) }));
    return (await (await fetch(model)).json()).warnings;
  };
  assert.deepEqual(await warned('walk', 'walk'), ['another clip is called walk, too: clip_1 asks for this one']);
  assert.deepEqual(await warned('walk', 'walk', 'clip_1'), ['another clip is called walk, too, and one is called clip_1: nothing asks for this one']);
});
