// Clips on other skeletons, against what others make of the same files: @pixiv/three-vrm and three-vrm-animation, three's
// SkeletonUtils; and motion capture on figures of four families of rigs, against plain vectors.
import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';

import { VRMAnimationLoaderPlugin, createVRMAnimationClip } from '@pixiv/three-vrm-animation';
import { VRMLoaderPlugin } from '@pixiv/three-vrm';
import { AnimationMixer, LoopOnce, Vector3 } from 'three';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import { retargetClip } from 'three/addons/utils/SkeletonUtils.js';

import { BONES, HEIGHT, NAMES, biped } from './biped.mjs';
import { Daemon } from './daemon.mjs';
import { HEIGHT as MOCAP_HEIGHT, mocap, worldAt } from './mocap.mjs';
import { load, nodesOf, playerOf } from './player.mjs';

const NEAR = 1e-4; // of the height
const TIMES = [0, 0.1, 0.25, 0.6, 1, 1.3, 1.75, 2];

const daemon = new Daemon();
before(() => daemon.start());
after(() => daemon.remove());

const idOf = (address) => address.split('/').pop();

async function json(url, init) {
  const answer = await fetch(url, init);
  const body = await answer.json();
  assert.equal(answer.status, 200, body.detail);
  return body;
}

/** Places of nodes by name at each time. */
async function placesOf(model, clip, times, more = '') {
  const { nodes, poses } = await json(`${model}/pose.json?clip=${encodeURIComponent(clip)}&retarget=auto&space=world&as=matrix&at=${times}${more}`);
  return poses.map(({ matrix }) => Object.fromEntries(nodes.map((name, i) => [name, new Vector3(...matrix[i].slice(12, 15))])));
}

function assertNear(found, wanted, tolerance, what) {
  const error = found.distanceTo(wanted);
  assert.ok(error <= tolerance, `${what}: ${error} away`);
}

const parse = (loader, text) => loader.parseAsync(text, '');

for (const [extension, turned] of [['VRMC_vrm', 0], ['VRM', Math.PI]])
  test(`a VRMA plays on a figure of ${extension} as three-vrm-animation plays it`, async () => {
    const figure = biped({ names: 'vroid', extension, seed: 5, turned, scale: 0.8 });
    const motion = biped({ extension: 'VRMC_vrm_animation', seed: 9, clip: { seed: 3 } });
    const model = await daemon.upload(figure);
    const lender = await daemon.upload(motion);
    const { humanoid } = await json(model);
    assert.equal(humanoid.leftThumbMetacarpal, 'J_Bip_L_Thumb1');
    const found = await placesOf(model, `${idOf(lender)}/moves`, TIMES);

    const loader = new GLTFLoader().register((parser) => new VRMLoaderPlugin(parser)).register((parser) => new VRMAnimationLoaderPlugin(parser));
    const { vrm } = (await parse(loader, figure)).userData;
    const [animation] = (await parse(loader, motion)).userData.vrmAnimations;
    const mixer = new AnimationMixer(vrm.scene);
    const action = mixer.clipAction(createVRMAnimationClip(animation, vrm)).setLoop(LoopOnce);
    action.clampWhenFinished = true;
    action.play();
    TIMES.forEach((time, index) => {
      action.paused = false;
      mixer.setTime(time);
      vrm.humanoid.update();
      vrm.scene.updateMatrixWorld(true);
      for (const bone of BONES) {
        const wanted = vrm.humanoid.getRawBoneNode(bone).getWorldPosition(new Vector3());
        assertNear(found[index][NAMES.vroid[bone]], wanted, NEAR * HEIGHT, `${bone} at ${time}`);
      }
    });
    const { retarget } = await json(`${model}/tracks?clip=${idOf(lender)}/moves&retarget=auto`);
    assert.ok(retarget.bones.every(({ by, aligned }) => by === 'humanoid' && aligned === 0));
    assert.equal(retarget.bones.length, BONES.length);
    assert.deepEqual([retarget.without_target, retarget.without_source], [[], []]);
    assert.ok(Math.abs(retarget.scale - 0.8) < 1e-6);
  });

// SkeletonUtils gives bones the source's rotations in the world, so it takes figures that rest alike, whatever their names.
test('on a copy with other names a clip plays as SkeletonUtils plays it', async () => {
  const from = biped({ names: 'mixamo', seed: 4, clip: { seed: 6, keys: 31, seconds: 1 } });
  const to = biped({ names: 'unreal', seed: 4 });
  const model = await daemon.upload(to);
  const found = await placesOf(model, `${idOf(await daemon.upload(from))}/moves`, [...Array(31).keys()].map((key) => Math.fround(key / 30)));
  const source = await load(from);
  const target = await load(to);
  const skinOf = (gltf) => gltf.scene.getObjectByProperty('isSkinnedMesh', true);
  const plain = (name) => name.replace(/[:.]/g, ''); // as three's loader names nodes
  const names = Object.fromEntries(BONES.map((bone) => [plain(NAMES.unreal[bone]), plain(NAMES.mixamo[bone])]));
  const clip = retargetClip(skinOf(target), skinOf(source), source.animations[0], { names, hip: 'mixamorigHips', fps: 31, preserveBoneMatrix: false, useTargetMatrix: true });
  const mixer = new AnimationMixer(skinOf(target));
  const action = mixer.clipAction(clip).setLoop(LoopOnce);
  action.clampWhenFinished = true;
  action.play();
  const nodes = await nodesOf(target);
  for (let key = 0; key < 31; key++) {
    action.paused = false;
    mixer.setTime(clip.tracks[0].times[key]);
    target.scene.updateMatrixWorld(true);
    BONES.forEach((bone, index) => {
      assertNear(found[key][NAMES.unreal[bone]], nodes[index].getWorldPosition(new Vector3()), NEAR * HEIGHT, `${bone} in frame ${key}`);
    });
  }
});

const DIRECTIONS = [
  ['UpperArm', 'LowerArm', 'Arm', 'ForeArm'],
  ['LowerArm', 'Hand', 'ForeArm', 'Hand'],
  ['UpperLeg', 'LowerLeg', 'UpLeg', 'Leg'],
  ['LowerLeg', 'Foot', 'Leg', 'Foot'],
];
const FIGURES = {
  mixamo: { names: 'mixamo', down: 0.8, seed: 2 },
  'VRM 1.0': { names: 'vroid', extension: 'VRMC_vrm', seed: 3 },
  makehuman: { names: 'makehuman', down: 0.6, seed: 11, scale: 10 },
  unreal: { names: 'unreal', down: 1, turned: Math.PI / 2 },
};
const FRAMES = 60;
const walk = mocap(FRAMES);

for (const [figure, options] of Object.entries(FIGURES))
  test(`limbs of a ${figure} figure point where those of motion capture point`, async () => {
    const model = await daemon.upload(biped(options));
    const lender = await daemon.upload(walk.text);
    const frames = [0, 7, 20, 41, 59];
    const found = await placesOf(model, `${idOf(lender)}/motion`, frames.map((frame) => Math.fround(frame * walk.seconds)));
    const joints = new Map(walk.joints.map(({ name }, index) => [name, index]));
    const names = NAMES[options.names];
    const turned = (vector) => vector.applyAxisAngle(new Vector3(0, 1, 0), options.turned ?? 0);
    frames.forEach((frame, index) => {
      const world = worldAt(walk, frame);
      const at = (name) => new Vector3(...world[joints.get(name)].translation);
      for (const side of ['left', 'right'])
        for (const [from, to, ...parts] of DIRECTIONS) {
          const [a, b] = parts.map((part) => at(`${side[0].toUpperCase()}${side.slice(1)}${part}`));
          const wanted = turned(b.sub(a)).normalize();
          const way = found[index][names[side + to]].clone().sub(found[index][names[side + from]]).normalize();
          // The file's legs and arms rest other than straight down and out, which the figure's rest pose takes over.
          assertNear(way, wanted, 2e-3, `${side}${from} in frame ${frame}`);
        }
    });
    // The hips go as far as legs are long, and stay above the ground.
    const { retarget, report } = await json(`${model}/tracks?clip=${idOf(lender)}/motion&retarget=auto`);
    const [first, last] = [found[0], found[frames.length - 1]].map((places) => places[names.hips]);
    const [start, end] = [worldAt(walk, 0)[0], worldAt(walk, 59)[0]].map(({ translation }) => new Vector3(...translation));
    assertNear(last.clone().sub(first), turned(end.sub(start)).multiplyScalar(retarget.scale), NEAR * HEIGHT * (options.scale ?? 1), 'the way of the hips');
    assert.ok(report.root.node);
    assert.ok(retarget.bones.length >= 20, `${retarget.bones.length} bones`);
    assert.deepEqual(retarget.without_target.filter((name) => !/Finger|Thumb|Index|HipJoint|Neck1/.test(name)), []);
    assert.ok(retarget.scale * MOCAP_HEIGHT < 3 * HEIGHT * (options.scale ?? 1));
  });

test('surface.glb holds the keys of the clip that was carried over', async () => {
  const model = await daemon.upload(biped(FIGURES.mixamo));
  const lender = await daemon.upload(biped({ names: 'unreal', seed: 8, clip: { seed: 2 } }));
  const clip = `${idOf(lender)}/moves`;
  const answer = await fetch(`${model}/surface.glb?level=0&clip=${clip}&retarget=auto`);
  assert.equal(answer.status, 200);
  const gltf = await load(new Uint8Array(await answer.arrayBuffer()));
  const nodes = await nodesOf(gltf);
  const play = playerOf(gltf);
  const found = await placesOf(model, clip, TIMES);
  TIMES.forEach((time, index) => {
    play(time);
    BONES.forEach((bone, node) => assertNear(nodes[node].getWorldPosition(new Vector3()), found[index][NAMES.mixamo[bone]], NEAR * HEIGHT, `${bone} at ${time}`));
  });
  const fewer = await fetch(`${model}/surface.glb?level=0&clip=${clip}&retarget=auto&tolerance=1`);
  assert.match(fewer.headers.get('X-Tweend-Error'), /degrees=/);
});

test('pose.bvh, live, ndjson and a posed surface show the same pose', async () => {
  const model = await daemon.upload(biped(FIGURES.mixamo));
  const lender = await daemon.upload(biped({ names: 'unreal', seed: 8, clip: { seed: 2 } }));
  const query = `clip=${idOf(lender)}/moves&retarget=auto`;
  const [{ matrix }] = (await json(`${model}/pose.json?${query}&as=matrix&space=world&at=1.3`)).poses;
  const lines = await (await fetch(`${model}/pose.ndjson?${query}&as=matrix&space=world&at=1.3`)).text();
  assert.deepEqual(JSON.parse(lines).matrix, matrix);
  const bvh = await (await fetch(`${model}/pose.bvh?${query}&from=1.3&to=1.3&fps=30`)).text();
  const { poses } = await json(`${await daemon.upload(bvh)}/pose.json?as=matrix&space=world&at=0`);
  matrix.slice(0, BONES.length).forEach((m, i) => assert.ok(poses[0].matrix.some((other) => Math.hypot(...[12, 13, 14].map((k) => other[k] - m[k])) < NEAR * HEIGHT), BONES[i]));
  const posed = await load(new Uint8Array(await (await fetch(`${model}/surface.glb?level=0&${query}&at=1.3`)).arrayBuffer()));
  posed.scene.updateMatrixWorld(true);
  const nodes = await nodesOf(posed);
  BONES.forEach((bone, i) => assertNear(nodes[i].getWorldPosition(new Vector3()), new Vector3(...matrix[i].slice(12, 15)), NEAR * HEIGHT, bone));
  const events = await fetch(`${model}/live?${query}&as=matrix&space=world&from=1.3&fps=10&loop=repeat`);
  const reader = events.body.getReader();
  let text = '';
  while (!/data: .*\n\n/.test(text)) text += Buffer.from((await reader.read()).value).toString();
  await reader.cancel();
  assert.deepEqual(JSON.parse(text.match(/data: (\{"t".*\})\n/)[1]).matrix, matrix);
});

test('a map in the query or the body decides, and a pair that nothing takes is told', async () => {
  const model = await daemon.upload(biped({ names: 'mixamo' }));
  const lender = await daemon.upload(biped({ names: 'unreal', clip: { seed: 2 } }));
  const clip = `${idOf(lender)}/moves`;
  const swap = { 'hand_l': 'mixamorig:RightHand', 'hand_r': 'mixamorig:LeftHand', head: null };
  const address = `${model}/tracks?clip=${clip}&retarget=auto&map=${encodeURIComponent(JSON.stringify(swap))}`;
  const { retarget } = await json(address);
  const by = Object.fromEntries(retarget.bones.map(({ source, target, by: way }) => [source, [target, way]]));
  assert.deepEqual(by.hand_l, ['mixamorig:RightHand', 'map']);
  assert.deepEqual(by.calf_l, ['mixamorig:LeftLeg', 'usual']);
  assert.equal(by.head, undefined);
  assert.deepEqual(retarget.without_target, ['head']);
  const query = `clip=${clip}&retarget=auto&as=matrix`;
  const mapped = await fetch(`${model}/pose.json?${query}&at=1&map=${encodeURIComponent(JSON.stringify(swap))}`);
  const posted = await fetch(`${model}/pose.json?${query}`, { method: 'POST', headers: { 'Content-Type': 'application/json' }, body: JSON.stringify({ times: [1], map: swap }) });
  const plain = await fetch(`${model}/pose.json?${query}&at=1`);
  assert.notEqual(mapped.headers.get('ETag'), plain.headers.get('ETag'));
  const bodies = await Promise.all([mapped, posted, plain].map((answer) => answer.json()));
  assert.deepEqual(bodies[0], bodies[1]);
  assert.notDeepEqual(bodies[0].poses, bodies[2].poses);
  assert.match(bodies[0].warnings[0], /no counterpart in the model: head$/);
});

test('a warning names the first bones without counterpart and counts the others', async () => {
  const model = await daemon.upload(biped({ names: 'mixamo' }));
  const lender = await daemon.upload(biped({ names: 'unreal', clip: { seed: 2 } }));
  const clip = `clip=${idOf(lender)}/moves&retarget=auto`;
  const sentence = 'the clip moves bones that have no counterpart in the model: ';
  for (const [left, told] of [[5, (names) => names.join(', ')], [9, (names) => `${names.slice(0, 4).join(', ')} and 5 more, which /tracks names (retarget.without_target)`]]) {
    const map = encodeURIComponent(JSON.stringify(Object.fromEntries(BONES.slice(10, 10 + left).map((bone) => [NAMES.unreal[bone], null]))));
    const { retarget } = await json(`${model}/tracks?${clip}&map=${map}`);
    assert.equal(retarget.without_target.length, left);
    const { warnings } = await json(`${model}/pose.json?${clip}&map=${map}&at=0`);
    assert.deepEqual(warnings, [sentence + told(retarget.without_target)]);
  }
});
