// A walk in files as Carnegie Mellon's laboratory has them, with all their oddities, on figures of three families of rigs:
// whether feet stay where they stand, and contact sheets to look at.
import assert from 'node:assert/strict';
import { mkdirSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { after, before, test } from 'node:test';

import { Euler, Quaternion, Vector3 } from 'three';

import { HEIGHT, NAMES, biped } from './biped.mjs';
import { Daemon, root } from './daemon.mjs';
import { HEIGHT as MOCAP_HEIGHT, mocap } from './mocap.mjs';

const daemon = new Daemon();
before(() => daemon.start());
after(() => daemon.remove());

// ---- the walk, in inches by the file's unit -----------------------------------------------------

const FRAMES = 480;
const CYCLE = 1.1;
const STANDS = 0.62; // of a cycle
const SPEED = 14;
const LEG = { hip: [1.36, -1.79, 0.84], knee: [2.45, -6.73, 0], ankle: [2.56, -7.04, 0] };

const hipsAt = (seconds) => new Vector3(0.3 * Math.sin((2 * Math.PI * seconds) / CYCLE), 15.3 + 0.2 * Math.sin((4 * Math.PI * seconds) / CYCLE), SPEED * seconds);

/** Where an ankle is: it stands for a part of each cycle, then swings ahead. */
function ankleAt(seconds, side) {
  const shift = side > 0 ? 0 : 0.5;
  const phase = seconds / CYCLE + shift;
  const [round, part] = [Math.floor(phase), phase - Math.floor(phase)];
  const stride = SPEED * CYCLE;
  const swing = Math.max(0, (part - STANDS) / (1 - STANDS));
  return new Vector3(2.4 * side, 0.6 + 1.6 * Math.sin(Math.PI * swing) ** 2, (round - shift + STANDS / 2) * stride + stride * swing * swing * (3 - 2 * swing));
}

const turn = (x, y, z) => new Quaternion().setFromEuler(new Euler(x, y, z, 'ZYX'));

/** Turns of the hip about x and z and of the knee about x that bring the ankle to its place, by Newton's method. */
function legAt(seconds, side) {
  const [hip, knee, ankle] = [LEG.hip, LEG.knee, LEG.ankle].map(([x, y, z]) => new Vector3(x * side, y, z));
  const goal = ankleAt(seconds, side).sub(hipsAt(seconds)).sub(hip);
  const place = ([a, b, c]) => ankle.clone().applyQuaternion(turn(c, 0, 0)).add(knee).applyQuaternion(turn(a, 0, b));
  const angles = [-0.3, -0.3 * side, 0.6];
  for (let step = 0; step < 30; step++) {
    const [from, small] = [place(angles), 1e-5];
    const columns = angles.map((_, i) => place(angles.map((angle, k) => angle + (i === k) * small)).sub(from).divideScalar(small));
    const miss = goal.clone().sub(from);
    const across = (i) => columns[(i + 1) % 3].clone().cross(columns[(i + 2) % 3]);
    const determinant = columns[0].dot(across(0));
    angles.forEach((_, i) => (angles[i] += Math.max(-0.3, Math.min(0.3, miss.dot(across(i)) / determinant))));
  }
  assert.ok(place(angles).distanceTo(goal) < 1e-6, `the ankle is ${place(angles).distanceTo(goal)} away at ${seconds}`);
  return angles;
}

/** What each joint is turned by, [x, y, z] in radians. */
function turnsAt(seconds) {
  const wave = (shift = 0) => Math.cos(2 * Math.PI * (seconds / CYCLE + shift));
  const turns = { Hips: [0, 0, 0], Spine: [0.04, 0.06 * wave(0.4), 0], Spine1: [0.03, 0.08 * wave(0.4), 0], Neck1: [0.05, -0.08 * wave(0.4), 0] };
  for (const [name, side] of [['Left', 1], ['Right', -1]]) {
    const [a, b, c] = legAt(seconds, side);
    const leg = turn(a, 0, b).multiply(turn(c, 0, 0)).invert();
    const { x, y, z } = new Euler().setFromQuaternion(leg, 'ZYX');
    Object.assign(turns, { [`${name}UpLeg`]: [a, 0, b], [`${name}Leg`]: [c, 0, 0], [`${name}Foot`]: [x, y, z] });
    turns[`${name}Arm`] = [0, 0.5 * side * wave(side > 0 ? 0.5 : 0), -1.2 * side];
    turns[`${name}ForeArm`] = [0, -0.4 * side, 0];
  }
  return turns;
}

let shown = { seconds: -1 };
function say(name, channel, seconds) {
  if (shown.seconds !== seconds) shown = { seconds, hips: hipsAt(seconds), turns: turnsAt(seconds) };
  const axis = 'XYZ'.indexOf(channel[0]);
  if (channel.endsWith('position')) return shown.hips.getComponent(axis);
  return ((shown.turns[name]?.[axis] ?? 0) * 180) / Math.PI;
}

const STYLES = {
  plain: {},
  windows: { lineEnd: '\r\n', blankLines: true, trailing: true, endNames: true, claimed: FRAMES + 1 },
  macs: { lineEnd: '\r', brace: 'same', frameTime: '8.3333e-3', indent: '  ' },
};
const FIGURES = {
  mixamo: { names: 'mixamo', down: 0.8, seed: 2, knees: 0.06 },
  vrm: { names: 'vroid', extension: 'VRMC_vrm', seed: 3, knees: -0.05 },
  makehuman: { names: 'makehuman', down: 0.6, seed: 11, scale: 10 },
};
const PARTS = { UpperLeg: 'UpLeg', LowerLeg: 'Leg', Foot: 'Foot', Toes: 'ToeBase', Shoulder: 'Shoulder', UpperArm: 'Arm', LowerArm: 'ForeArm', Hand: 'Hand' };
/** Joints of the file by VRM's names. */
const CMU = {
  ...{ hips: 'Hips', spine: 'LowerBack', chest: 'Spine', upperChest: 'Spine1', neck: 'Neck1', head: 'Head' },
  ...Object.fromEntries(['left', 'right'].flatMap((side) => Object.entries(PARTS).map(([bone, joint]) => [side + bone, side[0].toUpperCase() + side.slice(1) + joint]))),
};

const json = async (url) => {
  const answer = await fetch(url);
  const body = await answer.json();
  assert.equal(answer.status, 200, body.detail);
  return body;
};
const slideOf = ({ report }) => Math.max(...report.contacts.map(({ slide }) => slide));
const TIMES = Array.from({ length: 8 }, (_, i) => 0.4 + (i * CYCLE) / 4);

/** Places of bones by VRM's names, in heights, at TIMES. */
async function placesOf(model, query, names, height) {
  const { nodes, poses } = await json(`${model}/pose.json?space=world&at=${TIMES}${query}`);
  return poses.map(({ translation }) =>
    Object.fromEntries(Object.entries(names).flatMap(([bone, name]) => (nodes.includes(name) ? [[bone, new Vector3(...translation[nodes.indexOf(name)]).divideScalar(height)]] : []))),
  );
}

for (const [style, options] of Object.entries(STYLES))
  test(`feet stand in a walk of 31 joints at 120 frames a second, on figures of three families: ${style}`, async (t) => {
    const { text, joints } = mocap(FRAMES, { ...options, say });
    assert.equal(joints.length, 31);
    const lender = await daemon.upload(text);
    const clip = `clip=${lender.split('/').pop()}/motion&retarget=auto`;
    const sheet = [await placesOf(lender, '', CMU, MOCAP_HEIGHT)];
    const own = await json(`${lender}/tracks`);
    assert.ok(own.report.contacts.length >= 6 && slideOf(own) < 0.01 * MOCAP_HEIGHT, `${slideOf(own)}`);
    for (const [name, figure] of Object.entries(FIGURES)) {
      const model = await daemon.upload(biped(figure));
      const height = HEIGHT * (figure.scale ?? 1);
      const [free, held] = await Promise.all(['', '&feet=hold'].map((more) => json(`${model}/tracks?${clip}${more}`)));
      t.diagnostic(`${name}: of the height feet slide ${slideOf(free) / height}, held ${slideOf(held) / height}, in ${held.report.contacts.length} contacts`);
      assert.ok(held.report.contacts.length >= 6);
      assert.ok(slideOf(held) < 0.01 * height, `${name}: ${slideOf(held) / height}`);
      sheet.push(await placesOf(model, `&${clip}&feet=hold`, NAMES[figure.names], height));
    }
    draw(`walk_${style}`, sheet);
  });

const LIMBS = [
  ['hips', 'spine', 'chest', 'upperChest', 'neck', 'head'],
  ...['left', 'right'].flatMap((side) => [
    ['hips', ...['UpperLeg', 'LowerLeg', 'Foot', 'Toes'].map((bone) => side + bone)],
    ['upperChest', ...['Shoulder', 'UpperArm', 'LowerArm', 'Hand'].map((bone) => side + bone)],
  ]),
];

/** A row a figure from the side and a little from ahead, the left side in red; the first row is the file's own. */
function draw(name, rows) {
  const folder = join(root, 'build/pictures');
  mkdirSync(folder, { recursive: true });
  const at = ({ x, y, z }, row, place) => `${(75 + 148 * place + 170 * (0.9 * z + 0.35 * x)).toFixed(1)},${(190 + 210 * row - 170 * (y - 0.12 * x)).toFixed(1)}`;
  const line = (limb, pose, row, place) =>
    `<polyline points="${limb.filter((bone) => pose[bone]).map((bone) => at(pose[bone].clone().setZ(pose[bone].z - pose.hips.z), row, place)).join(' ')}" stroke="${limb[1].startsWith('left') ? '#c33' : '#335'}"/>`;
  const figures = rows.flatMap((poses, row) => [
    `<path d="M0 ${190 + 210 * row}h1200" stroke="#bbb" stroke-width="1"/>`,
    ...poses.flatMap((pose, place) => LIMBS.map((limb) => line(limb, pose, row, place))),
  ]);
  const svg = `<svg xmlns="http://www.w3.org/2000/svg" width="1200" height="${210 * rows.length}" fill="none" stroke-width="3"><rect width="100%" height="100%" fill="#fff"/>${figures.join('')}</svg>\n`;
  writeFileSync(join(folder, `${name}.svg`), svg);
}
