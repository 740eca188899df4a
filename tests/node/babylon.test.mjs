// Clips on other skeletons, against Babylon.js' AnimatorAvatar: the same figures, and where its rule is another one.
import assert from 'node:assert/strict';
import { mkdirSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { after, before, test } from 'node:test';

import '@babylonjs/core/Animations/animatable.js';
import { Animation } from '@babylonjs/core/Animations/animation.js';
import { AnimationGroup } from '@babylonjs/core/Animations/animationGroup.js';
import { AnimatorAvatar } from '@babylonjs/core/Animations/animatorAvatar.js';
import { Bone } from '@babylonjs/core/Bones/bone.js';
import { Skeleton } from '@babylonjs/core/Bones/skeleton.js';
import { NullEngine } from '@babylonjs/core/Engines/nullEngine.js';
import { Matrix, Quaternion, Vector3 } from '@babylonjs/core/Maths/math.vector.js';
import { Mesh } from '@babylonjs/core/Meshes/mesh.js';
import { TransformNode } from '@babylonjs/core/Meshes/transformNode.js';
import { MorphTarget } from '@babylonjs/core/Morph/morphTarget.js';
import { MorphTargetManager } from '@babylonjs/core/Morph/morphTargetManager.js';
import { Scene } from '@babylonjs/core/scene.js';

import { Tweend } from '../../api/client/tweend.js';
import { BONES, HEIGHT, NAMES, biped } from './biped.mjs';
import { Daemon, root } from './daemon.mjs';
import { figure } from './figure.mjs';

const NEAR = 1e-4; // of the height

const daemon = new Daemon();
const engine = new NullEngine();
before(() => daemon.start());
after(async () => {
  engine.dispose();
  await daemon.remove();
});

/** Numbers of an accessor of a glTF whose buffer is in it. */
function numbersOf({ accessors, bufferViews, buffers }, index) {
  const { bufferView, byteOffset = 0, count, type } = accessors[index];
  const bytes = Buffer.from(buffers[0].uri.split(',')[1], 'base64');
  const width = { SCALAR: 1, VEC3: 3, VEC4: 4 }[type];
  const start = (bufferViews[bufferView].byteOffset ?? 0) + byteOffset;
  return Array.from({ length: count }, (_, i) => Array.from({ length: width }, (_, k) => bytes.readFloatLE(start + 4 * (i * width + k))));
}

/** The nodes of a figure in Babylon, by name; its bones follow them. */
function stage(text) {
  const scene = new Scene(engine);
  scene.useRightHandedSystem = true; // as glTF is
  const file = JSON.parse(text);
  const nodes = file.nodes.map(({ name, translation = [0, 0, 0], rotation = [0, 0, 0, 1], scale = [1, 1, 1] }) => {
    const node = new TransformNode(name, scene);
    node.position = Vector3.FromArray(translation);
    node.rotationQuaternion = Quaternion.FromArray(rotation);
    node.scaling = Vector3.FromArray(scale);
    return node;
  });
  file.nodes.forEach(({ children = [] }, i) => children.forEach((child) => (nodes[child].parent = nodes[i])));
  return { scene, file, nodes };
}

const update = (nodes) => nodes.filter(({ parent }) => !parent).forEach((top) => [top, ...top.getDescendants()].forEach((node) => node.computeWorldMatrix(true)));

const FPS = 60;
const PROPERTIES = { translation: 'position', rotation: 'rotationQuaternion' };

function clipOf({ scene, file, nodes }) {
  const group = new AnimationGroup('moves', scene);
  const [{ channels, samplers }] = file.animations;
  for (const { sampler, target } of channels) {
    const isTurn = target.path === 'rotation';
    const type = isTurn ? Animation.ANIMATIONTYPE_QUATERNION : Animation.ANIMATIONTYPE_VECTOR3;
    const animation = new Animation(`${target.node} ${target.path}`, PROPERTIES[target.path], FPS, type);
    const values = numbersOf(file, samplers[sampler].output);
    const make = isTurn ? Quaternion : Vector3;
    animation.setKeys(numbersOf(file, samplers[sampler].input).map(([time], key) => ({ frame: time * FPS, value: make.FromArray(values[key]) })));
    group.addTargetedAnimation(animation, nodes[target.node]);
  }
  return group;
}

/** Bones that rest as the nodes do. */
function avatarOf({ scene, file, nodes }) {
  const skeleton = new Skeleton('bones', 'bones', scene);
  const bones = [];
  const make = (index, parent) => {
    const node = nodes[index];
    const rest = Matrix.Compose(node.scaling, node.rotationQuaternion, node.position);
    bones[index] = new Bone(node.name, skeleton, parent, rest.clone(), rest);
    bones[index].linkTransformNode(node);
    file.nodes[index].children?.forEach((child) => make(child, bones[index]));
  };
  nodes.forEach((node, index) => !node.parent && make(index, null));
  const avatar = new AnimatorAvatar('avatar', null);
  avatar.skeletons.add(skeleton);
  avatar.showWarnings = false;
  return avatar;
}

/** Places of all bones by VRM's names at each time, as Babylon has them: {source, target}. */
function played(from, to, names, times) {
  const [source, target] = [stage(from), stage(to)];
  [source, target].forEach(({ nodes }) => update(nodes));
  const clip = clipOf(source);
  const [sources, targets] = names.map((family) => NAMES[family]);
  const carried = avatarOf(target).retargetAnimationGroup(clip, {
    mapNodeNames: new Map(BONES.map((bone) => [sources[bone], targets[bone]])),
    rootNodeName: sources.hips,
    groundReferenceNodeName: sources.leftFoot,
    groundReferenceVerticalAxis: 'Y',
  });
  assert.equal(carried.targetedAnimations.length, BONES.length + 1, 'Babylon carries a turn of each bone over, and the way of the hips');
  const show = (group, { nodes }, family, time) => {
    group.play(false);
    group.goToFrame(time * FPS);
    group.pause();
    update(nodes);
    const byName = new Map(nodes.map((node) => [node.name, node.getAbsolutePosition().clone()]));
    return Object.fromEntries(BONES.map((bone) => [bone, byName.get(family[bone])]));
  };
  return times.map((time) => ({ source: show(clip, source, sources, time), target: show(carried, target, targets, time) }));
}

/** The same of the daemon. */
async function placesOf(from, to, family, times) {
  const [lender, model] = [await daemon.upload(from), await daemon.upload(to)];
  const answer = await fetch(`${model}/pose.json?clip=${lender.split('/').pop()}/moves&retarget=auto&space=world&at=${times}`);
  const { nodes, poses, detail } = await answer.json();
  assert.equal(answer.status, 200, detail);
  return poses.map(({ translation }) => Object.fromEntries(BONES.map((bone) => [bone, Vector3.FromArray(translation[nodes.indexOf(NAMES[family][bone])])])));
}

const KEYS = 21;
const TIMES = Array.from({ length: KEYS }, (_, key) => Math.fround((key / (KEYS - 1)) * 2));

for (const [what, options] of Object.entries({
  'other names and rest rotations': { names: 'mixamo', seed: 5 },
  'half as large, with names of MakeHuman': { names: 'makehuman', seed: 9, scale: 0.5 },
  'ten times as large, with names of VRoid': { names: 'vroid', seed: 2, scale: 10 },
}))
  test(`a figure that is shaped alike moves as AnimatorAvatar has it: ${what}`, async (t) => {
    const from = biped({ names: 'unreal', seed: 3, clip: { seed: 4, keys: KEYS, seconds: 2 } });
    const to = biped(options);
    const [found, babylon] = [await placesOf(from, to, options.names, TIMES), played(from, to, ['unreal', options.names], TIMES)];
    let [worst, compared] = [0, 0];
    babylon.forEach(({ target }, i) =>
      BONES.forEach((bone) => {
        worst = Math.max(worst, Vector3.Distance(target[bone], found[i][bone]) / (HEIGHT * (options.scale ?? 1)));
        compared++;
      }),
    );
    t.diagnostic(`${compared} places, at most ${worst} of the height apart`);
    assert.equal(compared, KEYS * BONES.length);
    assert.ok(worst < NEAR, `${worst} of the height`);
  });

const ARMS = ['left', 'right'].flatMap((side) => [[`${side}UpperArm`, `${side}LowerArm`], [`${side}LowerArm`, `${side}Hand`]]);

// AnimatorAvatar turns each bone of the target by what the source's is turned from rest, whatever the rest pose: arms that
// rest lower stay lower by as much. Limbs are aligned here, so that the hand points where the source's hand points.
test('on a figure whose arms rest lower, arms point where the source has them, and by AnimatorAvatar lower', async () => {
  const DOWN = 0.9;
  const from = biped({ names: 'unreal', clip: { seed: 4, keys: KEYS, seconds: 2, most: 0.5 } });
  const to = biped({ names: 'mixamo', down: DOWN });
  const [found, babylon] = [await placesOf(from, to, 'mixamo', TIMES), played(from, to, ['unreal', 'mixamo'], TIMES)];
  const angles = { tweend: 0, babylon: 0 };
  const direction = (places, [a, b]) => places[b].subtract(places[a]).normalize();
  const angle = (a, b) => Math.acos(Math.min(Vector3.Dot(a, b), 1));
  babylon.forEach(({ source, target }, i) =>
    ARMS.forEach((arm) => {
      angles.tweend = Math.max(angles.tweend, angle(direction(source, arm), direction(found[i], arm)));
      const off = angle(direction(source, arm), direction(target, arm));
      angles.babylon = Math.max(angles.babylon, off);
    }),
  );
  assert.ok(angles.tweend < 0.01, `${angles.tweend}`);
  assert.ok(Math.abs(angles.babylon - DOWN) < 0.1, `${angles.babylon}`);
  draw('babylon_arms_down', [0, 5, 10, 15].map((i) => [babylon[i].source, found[i], babylon[i].target]));
});

test('players of the module move nodes of Babylon, and the morph targets of their meshes', async () => {
  const { scene, nodes } = stage(figure());
  const tweend = new Tweend(daemon.url);
  const arm = nodes.find(({ name }) => name === 'arm');
  const mesh = new Mesh('arm_primitive0', scene, arm);
  const target = new MorphTarget('swollen', 0, scene);
  mesh.morphTargetManager = new MorphTargetManager(scene);
  mesh.morphTargetManager.addTarget(target);
  const model = await tweend.upload(figure());
  const player = await tweend.play(model, scene, { fps: 100, playing: false });
  for (const [time, weight] of [[0.375, 0.375], [1.5, 0.625]]) {
    player.time = time;
    player.update();
    assert.ok(Math.abs(target.influence - weight) < 1e-6, `${target.influence} at ${time} s is not ${weight}`);
    update(nodes);
    const { nodes: names, poses: [{ matrix }] } = await tweend.pose(model, { at: time, space: 'world', as: 'matrix' });
    names.forEach((name, i) => {
      const found = nodes.find((node) => node.name === name).getWorldMatrix().asArray();
      matrix[i].forEach((value, k) => assert.ok(Math.abs(found[k] - value) < 1e-4, `${name} at ${time} s: ${found} is not ${matrix[i]}`));
    });
  }
});

const LIMBS = [
  ['hips', 'spine', 'chest', 'upperChest', 'neck', 'head'],
  ...['left', 'right'].flatMap((side) => [
    ['hips', ...['UpperLeg', 'LowerLeg', 'Foot', 'Toes'].map((bone) => side + bone)],
    ['upperChest', ...['Shoulder', 'UpperArm', 'LowerArm', 'Hand', 'IndexDistal'].map((bone) => side + bone)],
  ]),
];

/** Figures from the front: the source in grey, then tweend's in black beside Babylon's in red. */
function draw(name, poses) {
  const folder = join(root, 'build/pictures');
  mkdirSync(folder, { recursive: true });
  const line = (places, colour, x) =>
    LIMBS.map((limb) => `<polyline points="${limb.map((bone) => `${(x + 100 * (places[bone].x - places.hips.x)).toFixed(1)},${(210 - 100 * places[bone].y).toFixed(1)}`).join(' ')}" stroke="${colour}"/>`).join('');
  const figures = poses.flatMap((three, i) => three.map((places, k) => line(places, ['#999', '#000', '#d33'][k], 90 + 500 * i + 165 * k)));
  const svg = `<svg xmlns="http://www.w3.org/2000/svg" width="${500 * poses.length}" height="230" fill="none" stroke-width="3"><rect width="100%" height="100%" fill="#fff"/>${figures.join('')}</svg>\n`;
  writeFileSync(join(folder, `${name}.svg`), svg);
}
