// Mixed clips against three's AnimationMixer, where both mean the same, and against what three's own sources say of
// where they do not: cross-fades and their warped phases, additive layers, weights.
import assert from 'node:assert/strict';
import { mkdirSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { after, before, test } from 'node:test';

import {
  AdditiveAnimationBlendMode,
  AnimationClip,
  AnimationMixer,
  AnimationUtils,
  Group,
  LoopOnce,
  LoopRepeat,
  Object3D,
  Quaternion,
  QuaternionKeyframeTrack,
  Vector3,
  VectorKeyframeTrack,
} from 'three';

import { Daemon, root } from './daemon.mjs';

const daemon = new Daemon();
before(() => daemon.start());
after(() => daemon.remove());

/** A chain of bones of 0.3 m, 1.5 m in all: errors are told in parts of it. */
const BONES = 6;
const STEP = 0.3;
const HEIGHT = BONES * STEP;
const NEAR = 1e-4 * HEIGHT;

function random(seed) {
  let state = seed;
  return () => {
    state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
    return state / 2 ** 32;
  };
}

/** Keys of every bone's rotation and of the first one's place. swing: how far from rest, radians. */
function motion(name, { seed, seconds, keys = 9, swing = 0.6 }) {
  const next = random(seed);
  const signed = () => 2 * next() - 1;
  const times = [...Array(keys).keys()].map((key) => Math.fround((key / (keys - 1)) * seconds));
  const turn = () => new Quaternion().setFromAxisAngle(new Vector3(signed(), signed(), signed()).normalize(), swing * signed()).toArray().map(Math.fround);
  return {
    name,
    times,
    rotations: [...Array(BONES).keys()].map(() => times.map(turn)),
    places: times.map(() => [signed(), 1 + 0.1 * signed(), signed()].map(Math.fround)),
  };
}

const nodes = [...Array(BONES).keys()].map((i) => ({ name: `b${i}`, ...(i > 0 && { parent: `b${i - 1}` }), translation: [0, i > 0 ? Math.fround(STEP) : 1, 0] }));

const clipOf = ({ name, times, rotations, places }) => ({
  name,
  tracks: [
    ...rotations.map((quaternions, i) => ({ node: `b${i}`, path: 'rotation', times, quaternions })),
    { node: 'b0', path: 'translation', times, values: places },
  ],
});

const upload = (motions, layers) =>
  daemon.upload(JSON.stringify({ nodes, clips: [...motions.map(clipOf), ...Object.entries(layers).map(([name, list]) => ({ name, layers: list }))] }));

/** Places of all bones in the world at each time. */
async function placesOf(model, clip, times) {
  const answer = await fetch(`${model}/pose.json?clip=${clip}&space=world&at=${times}`);
  const { poses, detail } = await answer.json();
  assert.equal(answer.status, 200, detail);
  return poses.map(({ translation }) => translation.map((place) => new Vector3(...place)));
}

/** The same bones in three, with the clips. */
function stage(motions) {
  const bones = nodes.map(({ name, translation }) => {
    const bone = Object.assign(new Object3D(), { name });
    bone.position.set(...translation);
    return bone;
  });
  const figure = new Group();
  figure.add(bones[0]);
  bones.slice(1).forEach((bone, i) => bones[i].add(bone));
  const clips = motions.map(
    ({ name, times, rotations, places }) =>
      new AnimationClip(name, -1, [
        ...rotations.map((quaternions, i) => new QuaternionKeyframeTrack(`b${i}.quaternion`, times, quaternions.flat())),
        new VectorKeyframeTrack('b0.position', times, places.flat()),
      ]),
  );
  const mixer = new AnimationMixer(figure);
  const places = () => {
    figure.updateMatrixWorld(true);
    return bones.map((bone) => bone.getWorldPosition(new Vector3()));
  };
  return { mixer, clips, places };
}

const apart = (a, b) => Math.max(...a.map((place, i) => place.distanceTo(b[i])));
const worst = (all, others) => Math.max(...all.map((places, i) => apart(places, others[i])));

/** Poses of three at each time, with weights that a function of the time gives. */
function played(motions, times, prepare) {
  const { mixer, clips, places } = stage(motions);
  const at = prepare(mixer, clips);
  return times.map((time) => {
    at(time);
    mixer.update(0);
    return places();
  });
}

/** Actions that are shown at times of their own, with weights of their own. */
const setter = (mixer, clips, options = []) => {
  const actions = clips.map((clip, i) => {
    const action = mixer.clipAction(clip, undefined, options[i]?.mode).setLoop(options[i]?.loop ?? LoopOnce);
    action.clampWhenFinished = true;
    return action.play();
  });
  return (moments) =>
    actions.forEach((action, i) => {
      action.enabled = true;
      action.paused = false;
      action.time = moments[i].time;
      action.setEffectiveWeight(moments[i].weight);
    });
};

test('a cross-fade of equal weights is that of three, and others are within the gap of nlerp and slerp', async () => {
  const motions = [motion('a', { seed: 1, seconds: 2 }), motion('b', { seed: 2, seconds: 2 })];
  const model = await upload(motions, {
    half: [{ clip: 'a', weight: 0.5 }, { clip: 'b', weight: 0.5 }],
    fade: [{ clip: 'a', weight: { times: [0, 2], values: [1, 0] } }, { clip: 'b', weight: { times: [0, 2], values: [0, 1] } }],
  });
  const times = [0, 0.1, 0.4, 0.77, 1, 1.3, 1.9];
  const three = (weights) =>
    played(motions, times, (mixer, clips) => {
      const set = setter(mixer, clips);
      return (time) => set(weights(time).map((weight) => ({ time, weight })));
    });
  assert.ok(worst(await placesOf(model, 'half', times), three(() => [0.5, 0.5])) < NEAR);
  // Between rotations 70 degrees apart the normalised sum is less than 0.6 degrees off slerp, and equal at the middle.
  const found = await placesOf(model, 'fade', times);
  const faded = three((time) => [1 - time / 2, time / 2]);
  assert.ok(apart(found[0], faded[0]) < NEAR && apart(found[4], faded[4]) < NEAR);
  assert.ok(worst(found, faded) < 0.02 * HEIGHT);
});

test('synchronised layers of a cross-fade keep the phase that three warps to', async () => {
  const motions = [motion('walk', { seed: 3, seconds: 1.2, swing: 0.1 }), motion('run', { seed: 4, seconds: 0.8, swing: 0.1 })];
  const model = await upload(motions, {
    faster: [
      { clip: 'walk', weight: { times: [0, 1], values: [1, 0] }, sync: true },
      { clip: 'run', weight: { times: [0, 1], values: [0, 1] }, sync: true },
    ],
  });
  const { mixer, clips, places } = stage(motions);
  const [walk, run] = clips.map((clip) => mixer.clipAction(clip).setLoop(LoopRepeat));
  walk.play();
  run.play().crossFadeFrom(walk, 1, true);
  // three adds the pace at the end of each step, so steps are small.
  const STEPS = 4000;
  const times = [0.2, 0.5, 0.7, 1, 1.15];
  const found = await placesOf(model, 'faster', times);
  let step = 0;
  times.forEach((time, i) => {
    for (; step < time * STEPS; step++) mixer.update(1 / STEPS);
    assert.ok(apart(found[i], places()) < 2e-3 * HEIGHT, `at ${time}`);
  });
});

test('additive layers are those of three, several too', async () => {
  const motions = [motion('base', { seed: 5, seconds: 1 }), motion('nod', { seed: 6, seconds: 1, swing: 2 }), motion('lean', { seed: 7, seconds: 1, swing: 2 })];
  const model = await upload(motions, {
    all: [
      { clip: 'base' },
      { clip: 'nod', mode: 'additive', weight: 0.35 },
      { clip: 'lean', mode: 'additive', weight: 1, reference: 0.5 },
    ],
  });
  const times = [0, 0.11, 0.37, 0.5, 0.8, 1];
  const three = played(motions, times, (mixer, clips) => {
    AnimationUtils.makeClipAdditive(clips[1]);
    AnimationUtils.makeClipAdditive(clips[2], 500, clips[2], 1000);
    const additive = { mode: AdditiveAnimationBlendMode };
    const set = setter(mixer, clips, [{}, additive, additive]);
    return (time) => set([1, 0.35, 1].map((weight) => ({ time, weight })));
  });
  assert.ok(worst(await placesOf(model, 'all', times), three) < NEAR);
});

test('three layers blend alike in any order, as in three they do not', async () => {
  const motions = [motion('a', { seed: 8, seconds: 1, swing: 1.2 }), motion('b', { seed: 9, seconds: 1, swing: 1.2 }), motion('c', { seed: 10, seconds: 1, swing: 1.2 })];
  const orders = { abc: [0, 1, 2], bca: [1, 2, 0], cba: [2, 1, 0] };
  const weights = [0.5, 0.3, 0.2];
  const layers = Object.fromEntries(Object.entries(orders).map(([name, order]) => [name, order.map((i) => ({ clip: 'abc'[i], weight: weights[i] }))]));
  const model = await upload(motions, layers);
  const times = [0, 0.2, 0.45, 0.9];
  const found = await Promise.all(Object.keys(orders).map((name) => placesOf(model, name, times)));
  for (const other of found.slice(1)) assert.ok(worst(found[0], other) < 1e-5);
  // three slerps one layer after the other into what is there (PropertyMixer.accumulate), which does not commute.
  const three = Object.values(orders).map((order) =>
    played(order.map((i) => motions[i]), times, (mixer, clips) => {
      const set = setter(mixer, clips);
      return (time) => set(order.map((i) => ({ time, weight: weights[i] })));
    }),
  );
  assert.ok(worst(three[0], three[2]) > 1e-3 * HEIGHT);
  assert.ok(worst(found[0], three[0]) < 0.05 * HEIGHT);
  draw('three_layers', times.map((_, i) => [found[0][i], three[0][i], three[2][i]]));
});

test('weights count by their sum, where three fills up with the pose at rest', async () => {
  const motions = [motion('a', { seed: 11, seconds: 1 })];
  const model = await upload(motions, { some: [{ clip: 'a', weight: 0.25 }], none: [{ clip: 'a', weight: 0 }] });
  const times = [0.3, 0.6];
  const [alone, some, none] = await Promise.all(['a', 'some', 'none'].map((name) => placesOf(model, name, times)));
  assert.equal(worst(alone, some), 0);
  const three = (weight) =>
    played(motions, times, (mixer, clips) => {
      const set = setter(mixer, clips);
      return (time) => set([{ time, weight }]);
    });
  assert.ok(worst(some, three(0.25)) > 0.05 * HEIGHT); // a quarter of the way from rest
  assert.ok(worst(none, three(0)) < NEAR);
  assert.ok(worst(alone, three(1)) < NEAR);
});

/** Bones as lines seen from the front, three in a picture: tweend's in black, three's in colours. */
function draw(name, poses) {
  const folder = join(root, 'build/pictures');
  mkdirSync(folder, { recursive: true });
  const line = (places, colour, x) =>
    `<polyline fill="none" stroke="${colour}" stroke-width="2" points="${places.map((place) => `${(x + 100 * place.x).toFixed(1)},${(300 - 100 * place.y).toFixed(1)}`).join(' ')}"/>`;
  const figures = poses.flatMap((pose, i) => pose.map((places, k) => line(places, ['#000', '#d55', '#55d'][k], 150 + 220 * i)));
  writeFileSync(join(folder, `${name}.svg`), `<svg xmlns="http://www.w3.org/2000/svg" width="${220 * poses.length + 80}" height="340">${figures.join('')}</svg>\n`);
}
