// The client module moves what three.js made of an answer: every node is where the daemon says.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { after, before, test } from 'node:test';

import { Tweend } from '../../api/client/tweend.js';
import { biped } from './biped.mjs';
import { Daemon, root } from './daemon.mjs';
import { figure } from './figure.mjs';
import { load, nodesOf } from './player.mjs';

const daemon = new Daemon();
let tweend;

before(async () => {
  await daemon.start();
  tweend = new Tweend(daemon.url);
});
after(() => daemon.remove());

/** Plays the first clip on the model as three.js has it, and compares matrices of the world. */
async function assertFollows(model, options) {
  const gltf = await load(Buffer.from(await (await tweend.surface(model, { level: 1, ...options })).arrayBuffer()));
  const nodes = await nodesOf(gltf);
  const player = await tweend.play(model, gltf.scene, { loop: 'clamp' });
  assert.deepEqual(player.missing, []);
  const times = [0, 0.123, 1, 1.999, player.duration];
  const { poses } = await tweend.pose(model, { at: times, space: 'world', as: 'matrix' });
  times.forEach((time, i) => {
    player.time = time;
    player.update();
    gltf.scene.updateMatrixWorld(true);
    poses[i].matrix.forEach((wanted, node) => {
      const found = nodes[node].matrixWorld.elements;
      wanted.forEach((value, k) => assert.ok(Math.abs(found[k] - value) < 2e-3, `node ${node} at ${time} s: ${found} is not ${wanted}`));
    });
  });
}

test('the tank follows, in every encoding', async () => {
  const tank = await tweend.upload(readFileSync(join(root, 'server/samples/tank.json')));
  for (const encoding of ['float', 'quantized', 'meshopt']) await assertFollows(tank, { encoding });
});

test('nodes are found whose names three.js changes', async () => {
  const names = ['a.b', 'with space', 'x[0]:y/z', 'Ünï', 'mesh', 'a_b'];
  const square = { name: 'mesh', positions: [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], faces: [[0, 1, 2, 3]] };
  const nodes = names.map((name, i) => ({ name, mesh: 'mesh', translation: [i, 0, 0], ...(i && { parent: names[i - 1] }) }));
  const tracks = names.map((name, i) => ({ node: name, path: 'rotation', times: [0, 2], axis_angles: [[0, 0, 1, 0], [1, i, 0, 0.3 + i / 2]] }));
  await assertFollows(await tweend.upload(JSON.stringify({ meshes: [square], nodes, clips: [{ name: 'turn', tracks }] })));
});

test('morph targets follow, in every encoding, from poses and from the live stream', async () => {
  const arm = await tweend.upload(figure());
  for (const encoding of ['float', 'quantized']) {
    const gltf = await load(Buffer.from(await (await tweend.surface(arm, { level: 1, encoding })).arrayBuffer()));
    const meshes = [];
    gltf.scene.traverse((object) => object.morphTargetInfluences && meshes.push(object));
    assert.ok(meshes.length > 0);
    const player = await tweend.play(arm, gltf.scene, { fps: 100, playing: false });
    for (const [time, weight] of [[0, 0], [0.375, 0.375], [1, 1], [1.5, 0.625]]) {
      player.time = time;
      player.update();
      assert.ok(Math.abs(player.weights.arm[0] - weight) < 1e-6, `${player.weights.arm[0]} at ${time} s is not ${weight}`);
      for (const mesh of meshes) assert.deepEqual(mesh.morphTargetInfluences, player.weights.arm);
    }
    const live = await tweend.live(arm, gltf.scene, { from: 1.5, speed: 1e-3 });
    live.update();
    assert.ok(Math.abs(live.weights.arm[0] - 0.625) < 1e-2, `${live.weights.arm}`);
    for (const mesh of meshes) assert.deepEqual(mesh.morphTargetInfluences, live.weights.arm);
    live.close();
  }
});

test('each of several nodes with one name gets its own morph weights, and meshes below a node its', async () => {
  const file = JSON.parse(figure());
  const [mesh] = file.meshes;
  file.nodes = [{ name: 'other' }, { name: 'face', mesh: 0 }, { name: 'face' }, { name: 'face', mesh: 0 }];
  file.skins = undefined;
  file.scenes = [{ nodes: [0, 1, 2, 3] }];
  for (const name of ['JOINTS_0', 'WEIGHTS_0']) delete mesh.primitives[0].attributes[name];
  const [{ samplers: [, swelling] }] = file.animations;
  const { count } = file.accessors[swelling.output];
  const half = file.accessors.push({ ...file.accessors[swelling.output], count: count - 1 }) - 1;
  const start = file.accessors.push({ ...file.accessors[swelling.input], count: count - 1, max: [1] }) - 1;
  file.animations = [{
    samplers: [swelling, { input: start, output: half }],
    channels: [0, 1].map((sampler) => ({ sampler, target: { node: 1 + 2 * sampler, path: 'weights' } })),
  }];
  const model = await tweend.upload(JSON.stringify(file));
  for (const nodes of [undefined, 'face']) {
    const part = () => ({ morphTargetInfluences: [7] });
    const node = (name, ...children) => ({ name, position: [0, 0, 0], quaternion: [0, 0, 0, 1], scale: [1, 1, 1], children });
    const [first, second] = [part(), part()];
    const objects = [node('other', part()), node('face', first, node('face')), node('face', part()), node('face', { children: [second] })];
    const player = await tweend.play(model, objects, { nodes, playing: false, time: 1.5 });
    player.update();
    assert.deepEqual(player.weights, { face: [0.625], node_3: [1] });
    assert.deepEqual([first, second].map(({ morphTargetInfluences: [weight] }) => weight), [0.625, 1]);
    assert.deepEqual(objects.flatMap(({ children }) => children.map(({ morphTargetInfluences }) => morphTargetInfluences?.[0])), [7, 0.625, undefined, 7, undefined]);
    const live = await tweend.live(model, objects, { nodes, from: 1.5, speed: 1e-9 });
    live.update();
    assert.ok(Math.abs(second.morphTargetInfluences[0] - 1) < 1e-6 && Math.abs(live.weights.face[0] - 0.625) < 1e-6);
    live.close();
  }
});

test('a clip of another figure plays on this one, with a map of any length', async () => {
  const figure = await tweend.upload(biped({ names: 'mixamo' }));
  const lender = await tweend.upload(biped({ names: 'unreal', clip: { seed: 4 } }));
  const borrowed = { clip: `${lender.id}/moves`, retarget: 'auto' };
  const gltf = await load(Buffer.from(await (await tweend.surface(figure, { level: 0 })).arrayBuffer()));
  const player = await tweend.play(figure, gltf.scene, { ...borrowed, loop: 'clamp' });
  player.time = 1;
  player.update();
  gltf.scene.updateMatrixWorld(true);
  const { nodes, poses } = await tweend.pose(figure, { ...borrowed, at: 1, space: 'world' });
  const hand = (await nodesOf(gltf))[nodes.indexOf('mixamorig:LeftHand')].matrixWorld.elements.slice(12, 15);
  poses[0].translation[nodes.indexOf('mixamorig:LeftHand')].forEach((value, k) => assert.ok(Math.abs(value - hand[k]) < 2e-3));

  const map = Object.fromEntries(nodes.slice(0, 30).map((name, i) => [lender.nodes[i].name, name]));
  const { retarget } = await tweend.tracks(figure, { ...borrowed, map });
  assert.equal(retarget.bones.filter(({ by }) => by === 'map').length, 30);
  const short = await tweend.pose(figure, { ...borrowed, map, at: [0, 1] });
  const long = await tweend.pose(figure, { ...borrowed, map, at: [0, 1, ...Array(2000).fill(2)] });
  assert.deepEqual(long.poses.slice(0, 2), short.poses);
});
