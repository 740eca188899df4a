// Feet that stay where they touched: a walk whose feet stand exactly, carried over to figures of other proportions, with
// which it slides, and held there.
import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';

import { Matrix4, Quaternion, Vector3 } from 'three';

import { HEIGHT, NAMES, biped } from './biped.mjs';
import { Daemon } from './daemon.mjs';
import { load, playerOf } from './player.mjs';

const daemon = new Daemon();
before(() => daemon.start());
after(() => daemon.remove());

// ---- the walk ------------------------------------------------------------------------------------

const SECONDS = 5;
const FRAMES = 60 * SECONDS;
const CYCLE = 1.1;
const STANDS = 0.62; // of a cycle
const SPEED = 1.2;
const [HIPS, THIGH, SHIN] = [0.93, 0.44, 0.45];

const about = (angle) => [Math.sin(angle / 2), 0, 0, Math.cos(angle / 2)].map(Math.fround);

/** Where a foot is: it stands for a part of each cycle, drifting so fast, then swings ahead. Height, and place along z. */
function footAt(seconds, shift, drift) {
  const phase = seconds / CYCLE + shift;
  const [round, part] = [Math.floor(phase), phase - Math.floor(phase)];
  const stride = SPEED * CYCLE;
  const stand = (round - shift + STANDS / 2) * stride;
  if (part < STANDS) return [0.09, stand + drift * part * CYCLE];
  const swing = (part - STANDS) / (1 - STANDS);
  const drifted = drift * STANDS * CYCLE;
  return [0.09 + 0.12 * Math.sin(Math.PI * swing) ** 2, stand + drifted + (stride - drifted) * swing * swing * (3 - 2 * swing)];
}

/** Turns about x of thigh and shin that bring the ankle from the hip to y, z. */
function legTo(y, z) {
  const far = Math.min(Math.hypot(y, z), THIGH + SHIN - 1e-4);
  const knee = Math.acos((far * far - THIGH * THIGH - SHIN * SHIN) / (2 * THIGH * SHIN));
  const hip = Math.atan2(-z, -y) - Math.atan2(SHIN * Math.sin(knee), THIGH + SHIN * Math.cos(knee));
  return [hip, knee];
}

/** Somebody with CMU's names walks along z, with hips so far below where they rest; legs bend in their planes. */
function walker(below = 0.05, drift = 0) {
  const leg = (side, x) => [
    { name: `${side}UpLeg`, parent: 'Hips', translation: [x, 0, 0] },
    { name: `${side}Leg`, parent: `${side}UpLeg`, translation: [0, -THIGH, 0] },
    { name: `${side}Foot`, parent: `${side}Leg`, translation: [0, -SHIN, 0] },
    { name: `${side}ToeBase`, parent: `${side}Foot`, translation: [0, -0.06, 0.12] },
  ];
  const times = Array.from({ length: FRAMES + 1 }, (_, frame) => Math.fround(frame / 60));
  const hips = times.map((t) => [0, HIPS - below + 0.015 * Math.sin((4 * Math.PI * t) / CYCLE), SPEED * t].map(Math.fround));
  const tracks = [{ node: 'Hips', path: 'translation', times, values: hips }];
  for (const [side, shift] of [['Left', 0], ['Right', 0.5]]) {
    const turns = times.map((t, i) => {
      const [y, z] = footAt(t, shift, drift);
      return legTo(y - hips[i][1], z - hips[i][2]);
    });
    tracks.push(
      { node: `${side}UpLeg`, path: 'rotation', times, quaternions: turns.map(([hip]) => about(hip)) },
      { node: `${side}Leg`, path: 'rotation', times, quaternions: turns.map(([, knee]) => about(knee)) },
      { node: `${side}Foot`, path: 'rotation', times, quaternions: turns.map(([hip, knee]) => about(-hip - knee)) },
    );
  }
  return {
    nodes: [
      { name: 'Hips', translation: [0, HIPS, 0] },
      ...leg('Left', 0.09),
      ...leg('Right', -0.09),
      { name: 'Spine', parent: 'Hips', translation: [0, 0.15, 0] },
      { name: 'Head', parent: 'Spine', translation: [0, 0.55, 0] },
    ],
    clips: [{ name: 'walk', tracks }],
  };
}

// ---- what is held -----------------------------------------------------------------------------

const FIGURES = {
  'with Mixamo names': { names: 'mixamo', seed: 3, knees: 0.1, scale: 1.3 },
  'of VRM, with long thighs': { names: 'vroid', extension: 'VRMC_vrm', seed: 5, knees: -0.08 },
  'with MakeHuman names': { names: 'makehuman', seed: 7, knees: 0.07, scale: 0.6 },
};

const json = async (url) => {
  const answer = await fetch(url);
  const body = await answer.json();
  assert.equal(answer.status, 200, body.detail);
  return body;
};
const slideOf = (tracks) => Math.max(...tracks.report.contacts.map(({ slide }) => slide));

for (const [what, options] of Object.entries(FIGURES))
  test(`feet stand on a figure ${what}`, async (t) => {
    const [lender, model] = [await daemon.upload(JSON.stringify(walker())), await daemon.upload(biped(options))];
    const clip = `clip=${lender.split('/').pop()}/walk&retarget=auto`;
    const own = await json(`${lender}/tracks`);
    const [free, held] = [await json(`${model}/tracks?${clip}`), await json(`${model}/tracks?${clip}&feet=hold`)];
    const height = HEIGHT * (options.scale ?? 1);
    t.diagnostic(`slides: own ${slideOf(own)} m, carried over ${slideOf(free)}, held ${slideOf(held)}; of ${height} m`);
    assert.ok(own.report.contacts.length >= 8 && held.report.contacts.length >= 8);
    assert.ok(slideOf(held) < 0.01 * height, `${slideOf(held)} m`);
    assert.ok(slideOf(held) < slideOf(free) / 2, `${slideOf(free)} m before`);
  });

for (const [what, options] of Object.entries(FIGURES))
  test(`legs keep their lengths, feet their height, and the rest of the body goes down softly with the hips: ${what}`, async (t) => {
    const FPS = 60;
    const [lender, model] = [await daemon.upload(JSON.stringify(walker())), await daemon.upload(biped(options))];
    const query = `clip=${lender.split('/').pop()}/walk&retarget=auto&space=world&from=0&to=${SECONDS}&fps=${FPS}`;
    const [free, held] = [await json(`${model}/pose.json?${query}`), await json(`${model}/pose.json?${query}&feet=hold`)];
    const names = NAMES[options.names];
    const height = HEIGHT * (options.scale ?? 1);
    const place = (pose, bone) => new Vector3(...pose.translation[free.nodes.indexOf(names[bone])]).divideScalar(height);
    const most = { foot: 0, turn: 0, aside: 0 };
    const lowered = free.poses.map((pose, i) => {
      const [down, ...others] = ['hips', 'head', 'leftHand'].map((bone) => place(pose, bone).sub(place(held.poses[i], bone)));
      for (const other of others) most.aside = Math.max(most.aside, other.distanceTo(down));
      most.aside = Math.max(most.aside, Math.hypot(down.x, down.z));
      for (const side of ['left', 'right']) {
        const joints = [`${side}UpperLeg`, `${side}LowerLeg`, `${side}Foot`];
        const [a, b] = [pose, held.poses[i]].map((one) => joints.map((joint) => place(one, joint)));
        for (const k of [1, 2]) assert.ok(Math.abs(a[k].distanceTo(a[k - 1]) - b[k].distanceTo(b[k - 1])) < 1e-5);
        most.foot = Math.max(most.foot, Math.abs(a[2].y - b[2].y));
        const foot = free.nodes.indexOf(names[`${side}Foot`]);
        most.turn = Math.max(most.turn, new Quaternion(...pose.rotation[foot]).angleTo(new Quaternion(...held.poses[i].rotation[foot])));
      }
      return down.y;
    });
    const steps = lowered.slice(2).map((y, i) => FPS * FPS * Math.abs(y - 2 * lowered[i + 1] + lowered[i]));
    const told = { ...most, lowered: Math.max(...lowered), raised: -Math.min(...lowered), acceleration: Math.max(...steps) };
    t.diagnostic(`in heights, radians, heights a second squared: ${JSON.stringify(told)}`);
    assert.ok(most.foot < 5e-4 && most.turn < 3e-3 && most.aside < 5e-4, JSON.stringify(most));
    assert.ok(told.raised < 2e-4 && told.lowered < 0.05 && told.acceleration < 2, JSON.stringify(told));
  });

for (const [what, options] of Object.entries(FIGURES))
  test(`knees turn hardly faster than the clip's own: ${what}`, async (t) => {
    const FPS = 240;
    const NEAR = FPS / 20; // the clip's own speed is looked for so many frames around
    const model = await daemon.upload(biped(options));
    for (const below of [0.05, 0.07, 0.1]) {
      const lender = await daemon.upload(JSON.stringify(walker(below)));
      const clip = `clip=${lender.split('/').pop()}/walk&retarget=auto`;
      const [free, held] = await Promise.all(['', '&feet=hold'].map((more) => json(`${model}/pose.json?${clip}${more}&from=0&to=${SECONDS}&fps=${FPS}`)));
      const speeds = ({ nodes, poses }, side) => {
        const node = nodes.indexOf(NAMES[options.names][`${side}LowerLeg`]);
        const turns = poses.map(({ rotation }) => new Quaternion(...rotation[node]));
        return turns.slice(1).map((turn, i) => FPS * turn.angleTo(turns[i]));
      };
      const excess = Math.max(
        ...['left', 'right'].flatMap((side) => {
          const own = speeds(free, side);
          return speeds(held, side).map((speed, i) => speed - Math.max(...own.slice(Math.max(0, i - NEAR), i + NEAR + 1)));
        }),
      );
      t.diagnostic(`hips ${below} m down: ${excess} radians a second faster`);
      assert.ok(excess < 5, `hips ${below} m down: ${excess} radians a second faster`);
      assert.ok(slideOf(await json(`${model}/tracks?${clip}&feet=hold`)) < 0.01 * HEIGHT * (options.scale ?? 1));
    }
  });

test('knees of feet that stand without being held stay as straight as they are', async () => {
  const own = walker();
  const model = await daemon.upload(JSON.stringify({ nodes: [...own.nodes, { name: 'Tail', parent: 'Hips', translation: [0, 0, -0.2] }] }));
  const lender = await daemon.upload(JSON.stringify(own));
  const query = `clip=${lender.split('/').pop()}/walk&retarget=auto&from=0&to=${SECONDS}&fps=30`;
  const [free, held] = await Promise.all(['', '&feet=hold'].map((more) => json(`${model}/pose.json?${query}${more}`)));
  for (const side of ['Left', 'Right']) {
    const knee = free.nodes.indexOf(`${side}Leg`);
    const turned = free.poses.map(({ rotation }, i) => new Quaternion(...rotation[knee]).angleTo(new Quaternion(...held.poses[i].rotation[knee])));
    assert.ok(Math.max(...turned) < 5e-3, `${Math.max(...turned)}`);
  }
});

/** The same motion in a world whose z is up, as some motion capture has it. */
function lying({ nodes, clips }) {
  const place = ([x, y, z]) => [z, x, y];
  const turn = ([x, y, z, w]) => [z, x, y, w];
  const track = ({ values, quaternions, ...others }) => ({ ...others, ...(values && { values: values.map(place) }), ...(quaternions && { quaternions: quaternions.map(turn) }) });
  return {
    nodes: nodes.map((node) => ({ ...node, translation: place(node.translation) })),
    clips: clips.map(({ name, tracks }) => ({ name, tracks: tracks.map(track) })),
  };
}

test('feet of a figure whose world has z up are held as those of one with y up', async () => {
  const walk = walker(0.1, 0.15);
  const model = await daemon.upload(biped(FIGURES['with Mixamo names']));
  const reports = [];
  for (const lent of [walk, lying(walk)]) {
    const clip = `clip=${(await daemon.upload(JSON.stringify(lent))).split('/').pop()}/walk&retarget=auto`;
    reports.push(...(await Promise.all(['&feet=hold', ''].map((more) => json(`${model}/tracks?${clip}${more}`)))).map(slideOf));
  }
  const [upright, slid, held] = reports;
  assert.ok(upright < slid / 10 && Math.abs(held - upright) < 0.1 * upright, `${reports}`);
});

test('files, streams and BVH have held feet too, and three plays them', async () => {
  const [lender, model] = [await daemon.upload(JSON.stringify(walker())), await daemon.upload(biped(FIGURES['with Mixamo names']))];
  const clip = `clip=${lender.split('/').pop()}/walk&retarget=auto&feet=hold`;
  const { nodes, poses } = await json(`${model}/pose.json?${clip}&at=1.4&space=world&as=matrix`);
  const answer = await fetch(`${model}/surface.glb?level=0&${clip}`);
  assert.equal(answer.status, 200);
  const gltf = await load(Buffer.from(await answer.arrayBuffer()));
  playerOf(gltf)(1.4);
  for (const bone of ['leftFoot', 'rightFoot']) {
    const name = NAMES.mixamo[bone];
    const there = new Vector3().setFromMatrixPosition(new Matrix4().fromArray(poses[0].matrix[nodes.indexOf(name)]));
    const node = gltf.parser.json.nodes.findIndex((one) => one.name === name);
    const here = (await gltf.parser.getDependency('node', node)).getWorldPosition(new Vector3());
    assert.ok(there.distanceTo(here) < 1e-4, `${name}: ${there.distanceTo(here)}`);
  }
  const [held, free] = await Promise.all(['', '&feet=none'].map((more) => fetch(`${model}/pose.bvh?${clip}${more}`)));
  assert.deepEqual([held.status, free.status], [200, 400]);
});

test('what cannot be held is told or refused', async () => {
  const [lender, model] = [await daemon.upload(JSON.stringify(walker())), await daemon.upload(biped({ names: 'mixamo' }))];
  const clip = `clip=${lender.split('/').pop()}/walk`;
  for (const query of [`${clip}&feet=hold`, `${clip}&retarget=auto&feet=LeftFoot`]) assert.equal((await fetch(`${model}/pose.json?${query}`)).status, 400);
  const named = await json(`${model}/tracks?${clip}&retarget=auto&feet=${encodeURIComponent(NAMES.mixamo.leftFoot)}`);
  assert.deepEqual([...new Set(named.report.contacts.map(({ node }) => node))], [NAMES.mixamo.leftFoot]);
  const map = encodeURIComponent(JSON.stringify({ LeftFoot: null, RightFoot: null }));
  const { warnings } = await json(`${model}/pose.json?${clip}&retarget=auto&feet=hold&map=${map}`);
  assert.ok(warnings.some((warning) => warning.includes('feet=hold held none')), `${warnings}`);
});

test('a layer of a mixed clip takes a map and holds feet as a request does', async () => {
  const lender = await daemon.upload(JSON.stringify(walker()));
  const own = walker();
  const map = Object.fromEntries(own.nodes.map(({ name }, i) => [name, `bone ${i}`])); // names that match nothing
  const nodes = own.nodes.map(({ name, parent, translation: [x, y, z] }) => ({
    name: map[name],
    ...(parent && { parent: map[parent] }),
    translation: [x, /UpLeg|Foot/.test(name) ? 0.7 * y : 1.2 * y, z],
  }));
  const clip = `${lender.split('/').pop()}/walk`;
  const layers = [{ clip, retarget: 'auto', feet: 'hold', map }];
  const model = await daemon.upload(JSON.stringify({ nodes, clips: [{ name: 'carried', layers }, { name: 'matched', layers: [{ clip, retarget: 'auto' }] }] }));
  const at = 'space=world&from=0&to=3&fps=10';
  const carried = await json(`${model}/pose.json?clip=carried&${at}`);
  const query = `clip=${clip}&retarget=auto&map=${encodeURIComponent(JSON.stringify(map))}`;
  assert.deepEqual(carried.poses, (await json(`${model}/pose.json?${query}&feet=hold&${at}`)).poses);
  assert.notDeepEqual(carried.poses, (await json(`${model}/pose.json?${query}&${at}`)).poses);
  const refused = await fetch(`${model}/pose.json?clip=matched&at=0`);
  assert.equal(refused.status, 422);
  assert.match((await refused.json()).detail, /^clip "matched", layer 0: .*; a map names pairs/);
});
