// BVH files against plain matrices and three.js: what a file's angles say is what poses, answers in glTF and three's own
// loader show, in every notation that such files are met in.
import assert from 'node:assert/strict';
import { existsSync, readdirSync, readFileSync } from 'node:fs';
import { join } from 'node:path';
import { after, before, test } from 'node:test';

import { Matrix4, Quaternion, Vector3 } from 'three';
import { BVHLoader } from 'three/addons/loaders/BVHLoader.js';

import { Daemon, root } from './daemon.mjs';
import { figure } from './figure.mjs';
import { HEIGHT, localsAt, mocap, worldAt } from './mocap.mjs';
import { load, nodesOf, playerOf } from './player.mjs';

const DEBIAN = '/usr/share/assimp/models/BVH';
const PLACE = 1e-4; // of the figure's height

const daemon = new Daemon();
before(() => daemon.start());
after(() => daemon.remove());

const STYLES = {
  'as CMU has them': {},
  'lines of Windows, tabs, blank lines, trailing blanks': { lineEnd: '\r\n', indent: '\t', blankLines: true, trailing: true },
  'lines of old Macs, braces behind names': { lineEnd: '\r', brace: 'same', frameTime: '8.3333e-3' },
  'odd names and named end sites': { odd: true, endNames: true, indent: '  ' },
  'channels in any order and number': { mixed: true, seed: 7 },
  'channels in another order, a frame fewer than it says': { mixed: true, seed: 8, claimed: 13 },
  'angles that wrap': { wraps: true, frameTime: '0.00833333' },
};
const FRAMES = 12;

async function json(url) {
  const answer = await fetch(url);
  const body = await answer.json();
  assert.equal(answer.status, 200, body.detail);
  return body;
}

async function glb(url) {
  const answer = await fetch(url);
  assert.equal(answer.status, 200);
  return load(new Uint8Array(await answer.arrayBuffer()));
}

/** World matrices by node, in each frame. */
async function posesOf(model, frames, seconds) {
  const at = Array.from({ length: frames }, (_, frame) => Math.fround(frame * seconds)).join();
  return json(`${model}/pose.json?space=world&as=matrix&at=${at}`);
}

const isEnd = (name) => name.endsWith('_end');

function assertNear(found, wanted, tolerance, what) {
  const error = Math.hypot(...wanted.map((value, i) => value - found[i]));
  assert.ok(error <= tolerance, `${what}: ${found} instead of ${wanted}`);
}

/** The angle between two rotations as a distance of quaternions, either sign. */
const apart = (a, b) => Math.min(...[1, -1].map((sign) => Math.hypot(...a.map((value, i) => value - sign * b[i]))));

const quaternionOf = (rotation) =>
  new Quaternion().setFromRotationMatrix(new Matrix4().set(...rotation.flatMap((row) => [...row, 0]), 0, 0, 0, 1)).toArray();

for (const [style, options] of Object.entries(STYLES)) {
  test(`poses of a file are the products of its angles: ${style}`, async () => {
    const file = mocap(FRAMES, options);
    const model = await daemon.upload(file.text);
    const { nodes, clips, format, warnings } = await json(model);
    assert.equal(format, 'bvh');
    assert.deepEqual(nodes.map(({ name }) => name).filter((name) => !isEnd(name)), file.joints.map(({ name }) => name));
    assert.equal(nodes.filter(({ name }) => isEnd(name)).length, file.joints.filter(({ end }) => end).length);
    assert.equal(clips.length, 1);
    assert.equal(warnings.filter((text) => text.startsWith('Frames:')).length, Number('claimed' in options));
    const { poses, nodes: names } = await posesOf(model, FRAMES, file.seconds);
    const places = names.flatMap((name, index) => (isEnd(name) ? [] : [index]));
    poses.forEach(({ matrix }, frame) => {
      worldAt(file, frame).forEach(({ rotation, translation }, joint) => {
        const m = matrix[places[joint]];
        assertNear(m.slice(12, 15), translation, PLACE * HEIGHT, `${file.joints[joint].name} in frame ${frame}`);
        assertNear([0, 1, 2].flatMap((c) => m.slice(4 * c, 4 * c + 3)), [0, 1, 2].flatMap((c) => rotation.map((row) => row[c])), 1e-5, 'rotation');
      });
    });
  });
}

test('end sites hang on their joints', async () => {
  const file = mocap(1, { odd: true });
  const { nodes } = await json(await daemon.upload(file.text));
  for (const { name, end } of file.joints.filter((joint) => joint.end)) {
    const node = nodes.find((other) => other.name === `${name}_end`);
    assert.equal(node.parent, name);
    assertNear(node.rest.translation, end, 1e-6, name);
  }
});

/** Times and quaternions of each node's rotation track, by the node's name. */
function rotationsOf({ animations: [clip] }) {
  return new Map(clip.tracks.filter(({ name }) => name.endsWith('.quaternion')).map((track) => [track.name.slice(0, -'.quaternion'.length), track]));
}

test('every frame is a key of glTF, equal to the product of its angles', async () => {
  for (const options of [{}, { mixed: true, seed: 3 }, { wraps: true }]) {
    const file = mocap(40, options);
    const tracks = rotationsOf(await glb(`${await daemon.upload(file.text)}/surface.glb`));
    for (let frame = 0; frame < 40; frame++) {
      localsAt(file, frame).forEach(({ rotation }, joint) => {
        const { times, values } = tracks.get(file.joints[joint].name);
        const key = times.indexOf(Math.fround(frame * file.seconds));
        assert.ok(key >= 0, `frame ${frame} is no key`);
        assert.ok(apart([...values.slice(4 * key, 4 * key + 4)], quaternionOf(rotation)) <= 1e-6, file.joints[joint].name);
      });
    }
  }
});

test('between frames a player turns as the angles do, over 180 degrees too', async () => {
  const file = mocap(40, { wraps: true });
  const gltf = await glb(`${await daemon.upload(file.text)}/surface.glb`);
  const names = (await nodesOf(gltf)).map(({ name }) => name);
  const tracks = rotationsOf(gltf);
  assert.ok([...tracks.values()].some(({ times }) => times.length > 40), 'some steps are split');
  assert.ok([...tracks.values()].some(({ times }) => times.length === 40), 'some are not');
  const show = playerOf(gltf);
  const nodes = await nodesOf(gltf);
  for (let frame = 0; frame < 39; frame++) {
    for (const part of [0.2, 0.5, 0.9]) {
      show((frame + part) * file.seconds);
      const between = { ...file, values: [file.values[frame].map((from, i) => from + part * (file.values[frame + 1][i] - from))] };
      localsAt(between, 0).forEach(({ rotation }, joint) => {
        const { quaternion } = nodes[names.indexOf(file.joints[joint].name)];
        const error = (2 * apart(quaternion.toArray(), quaternionOf(rotation)) * 180) / Math.PI;
        assert.ok(error <= 0.11, `${file.joints[joint].name} is ${error} degrees off in frame ${frame + part}`);
      });
    }
  }
});

/** Places of the joints in each frame as three's loader has them: [frame][bone] vectors, end sites included. */
function threesPlaces(text, frames) {
  const { skeleton, clip } = new BVHLoader().parse(text);
  const moved = skeleton.bones.filter(({ name }) => name !== 'ENDSITE');
  return frames.map((frame) => {
    moved.forEach((bone, index) => {
      bone.position.fromArray(clip.tracks[2 * index].values, 3 * frame);
      bone.quaternion.fromArray(clip.tracks[2 * index + 1].values, 4 * frame);
    });
    skeleton.bones[0].updateMatrixWorld(true);
    return skeleton.bones.map((bone) => new Vector3().setFromMatrixPosition(bone.matrixWorld).toArray());
  });
}

/** Compares the places of all nodes with those of three's bones. */
async function assertThreesPlaces(text, { frames, seconds, height }) {
  const model = await daemon.upload(text);
  const chosen = frames.map((frame) => Math.fround(frame * seconds));
  const { poses } = await json(`${model}/pose.json?space=world&as=matrix&at=${chosen.join()}`);
  threesPlaces(text, frames).forEach((places, i) => {
    assert.equal(poses[i].matrix.length, places.length);
    places.forEach((place, bone) => assertNear(poses[i].matrix[bone].slice(12, 15), place, PLACE * height, `bone ${bone} in frame ${frames[i]}`));
  });
}

test('joints are where BVHLoader has them', async () => {
  for (const options of [{}, { lineEnd: '\r\n', trailing: true, blankLines: true }, { wraps: true, endNames: true }, { odd: true }]) {
    const { text, seconds } = mocap(FRAMES, options);
    await assertThreesPlaces(text, { frames: [...Array(FRAMES).keys()], seconds, height: HEIGHT });
  }
});

test('BVHLoader adds the OFFSET to position channels, which stand in its place', async () => {
  const text = 'HIERARCHY\nROOT a\n{\nOFFSET 1 2 3\nCHANNELS 3 Xposition Yposition Zposition\n}\nMOTION\nFrames: 1\nFrame Time: 1\n10 20 30\n';
  assert.deepEqual(threesPlaces(text, [0])[0], [[11, 22, 33]]);
  const { poses } = await json(`${await daemon.upload(text)}/pose.json?at=0`);
  assert.deepEqual(poses[0].translation, [[10, 20, 30]]);
});

test('morph weights that BVH leaves out are told once, where they are of nodes that were asked for', async () => {
  const model = await daemon.upload(figure());
  const told = async (query) => (await fetch(`${model}/pose.bvh${query}`)).headers.get('X-Tweend-Warning');
  const sentence = `1; ${encodeURIComponent('1 track of morph weights is left out: BVH has none')}`;
  for (const query of ['', '?nodes=all', '?nodes=arm,bone_0']) assert.equal(await told(query), sentence, query);
  assert.equal(await told('?nodes=bone_0'), null);
});

/** Frames, seconds and the numbers of a file of others, read without the daemon. */
function factsOf(text) {
  const [, head] = text.split('MOTION');
  const [, claimed, seconds] = /Frames:\s*(\d+)\s*Frame Time:\s*([.\d]+)/.exec(head);
  const rows = head.split(/\r?\n/).filter((line) => /^\s*-?[.\d][-+.\deE\s]*$/.test(line)).map((line) => line.trim().split(/\s+/).map(Number));
  const joints = [...text.matchAll(/(?:ROOT|JOINT)\s+(\S+)[^]*?CHANNELS\s+(\d+)((?:\s+[XYZ]\w+)+)/g)].map(([, name, , channels]) => ({
    name,
    channels: channels.trim().split(/\s+/),
  }));
  return { claimed: Number(claimed), seconds: Number(seconds), rows, joints };
}

/** The least |cos| of the middle angle over all frames of a joint. */
function cosinesOf({ rows, joints }) {
  let at = 0;
  return joints.map(({ channels }) => {
    const turns = channels.flatMap((channel, i) => (channel.endsWith('rotation') ? [at + i] : []));
    at += channels.length;
    return Math.min(...rows.map((row) => Math.abs(Math.cos((row[turns[1]] * Math.PI) / 180))));
  });
}

for (const name of existsSync(DEBIAN) ? readdirSync(DEBIAN).filter((file) => file.endsWith('.bvh')) : []) {
  test(`${name} has its frames, joints and distances from lock, and stands where BVHLoader has it`, async () => {
    const text = readFileSync(join(DEBIAN, name), 'latin1');
    const facts = factsOf(text);
    const model = await daemon.upload(text);
    const { nodes, clips, warnings } = await json(model);
    assert.equal(warnings.some((warning) => warning.startsWith(`Frames: says ${facts.claimed}, and there ${facts.rows.length === 1 ? 'is' : 'are'} ${facts.rows.length}`)), facts.claimed !== facts.rows.length);
    assert.deepEqual(nodes.map((node) => node.name).filter((other) => !isEnd(other)), facts.joints.map((joint) => joint.name));
    assert.ok(Math.abs(clips[0].duration - (facts.rows.length - 1) * facts.seconds) < 1e-4);
    const { tracks } = await json(`${model}/tracks`);
    const cosines = cosinesOf(facts);
    facts.joints.forEach(({ name: joint, channels }, i) => {
      const track = tracks.find(({ node }) => node === joint);
      assert.equal(track.kind, 'euler');
      assert.equal(track.keys, facts.rows.length);
      assert.equal(track.gimbal.order, channels.filter((channel) => channel.endsWith('rotation')).map(([axis]) => axis).join(''));
      // Between frames the path may come nearer to lock than in any of them.
      assert.ok(track.gimbal.cos_middle <= cosines[i] + 1e-6 && track.gimbal.cos_middle >= cosines[i] - 0.05, `${joint}: ${track.gimbal.cos_middle}, ${cosines[i]}`);
    });
    const frames = [0, 1, Math.floor(facts.claimed / 2), facts.claimed - 1]; // three reads no more than the file claims
    await assertThreesPlaces(text, { frames, seconds: facts.seconds, height: name.startsWith('01') ? HEIGHT : 180 });
  });
}

// ---- pose.bvh ----------------------------------------------------------------------------------------------------

async function bvhOf(url) {
  const answer = await fetch(url);
  const text = await answer.text();
  assert.equal(answer.status, 200, text);
  assert.equal(answer.headers.get('Content-Type'), 'model/x-bvh');
  return { text, warning: decodeURIComponent(answer.headers.get('X-Tweend-Warning') ?? '') };
}

/** Names and orders of the joints, the frames' numbers and their seconds, by a reader of this test's own. */
function parseBvh(text) {
  const facts = factsOf(text);
  const orders = facts.joints.map(({ channels }) => channels.filter((channel) => channel.endsWith('rotation')).map(([axis]) => axis).join(''));
  return { ...facts, names: facts.joints.map(({ name }) => name), orders };
}

/** Compares where three.js puts the joints of pose.bvh with poses at the same times. */
async function assertWritten(model, query, { height, names: wanted }) {
  const { text } = await bvhOf(`${model}/pose.bvh?${query}`);
  const { rows, seconds, claimed, names } = parseBvh(text);
  assert.equal(rows.length, claimed);
  if (wanted) assert.deepEqual(names, wanted);
  const from = Number(new URLSearchParams(query).get('from') ?? 0);
  const at = rows.map((_, frame) => from + frame * seconds).join();
  const clip = new URLSearchParams(query).get('clip');
  const { poses, nodes } = await json(`${model}/pose.json?space=world&as=matrix&at=${at}${clip ? `&clip=${clip}` : ''}`);
  const { skeleton } = new BVHLoader().parse(text);
  const bones = skeleton.bones.map(({ name }) => name);
  threesPlaces(text, [...rows.keys()]).forEach((places, frame) => {
    places.forEach((place, bone) => {
      const node = nodes.indexOf(bones[bone]);
      if (node < 0) return assert.ok(['ENDSITE', 'root'].includes(bones[bone]), bones[bone]);
      assertNear(poses[frame].matrix[node].slice(12, 15), place, PLACE * height, `${bones[bone]} in frame ${frame}`);
    });
  });
  return { text, names };
}

test('pose.bvh stands where the file stood, and comes back as it was', async () => {
  for (const options of [{}, { mixed: true, seed: 5 }, { wraps: true }]) {
    const file = mocap(40, { ...options, frameTime: '0.00833333' });
    const model = await daemon.upload(file.text);
    const names = file.joints.map(({ name }) => name);
    const { text } = await assertWritten(model, 'fps=120&nodes=all', { height: HEIGHT, names });
    const again = await daemon.upload(text);
    const before = await json(`${model}/pose.json?space=world&as=matrix&from=0&fps=30`);
    const after = await json(`${again}/pose.json?space=world&as=matrix&from=0&fps=30`);
    assert.deepEqual(after.nodes, before.nodes); // end sites too
    before.poses.forEach(({ matrix }, i) =>
      matrix.forEach((wanted, node) => isEnd(before.nodes[node]) || assertNear(after.poses[i].matrix[node].slice(12, 15), wanted.slice(12, 15), PLACE * HEIGHT, before.nodes[node])),
    );
  }
});

test('each joint is written in its best order, or all in one', async () => {
  const file = mocap(60, { mixed: true, seed: 9, frameTime: '0.00833333' });
  const model = await daemon.upload(file.text);
  const { tracks } = await json(`${model}/tracks`);
  const { names, orders } = parseBvh((await bvhOf(`${model}/pose.bvh?fps=120`)).text);
  for (const { node, best_order: best, orders: cosines } of tracks) {
    const chosen = orders[names.indexOf(node)];
    assert.ok(cosines[chosen] >= cosines[best] - 0.01, `${node}: ${chosen} instead of ${best}`);
  }
  for (const order of ['XYZ', 'XZY', 'YXZ', 'YZX', 'ZXY', 'ZYX']) {
    const { text } = await assertWritten(model, `order=${order}&fps=60`, { height: HEIGHT });
    assert.ok(parseBvh(text).orders.every((found) => found === order));
  }
});

test('angles of pose.bvh do not jump', async () => {
  const model = await daemon.upload(JSON.stringify({
    nodes: [{ name: 'wheel' }],
    clips: [{ tracks: [{ node: 'wheel', path: 'rotation', unit: 'degrees', times: [0, 4], axis_angles: [[1, 0, 0, 0], [1, 0, 0, 1440]] }] }],
  })); // prettier-ignore
  const { rows, seconds } = parseBvh((await bvhOf(`${model}/pose.bvh`)).text);
  assert.equal(rows.length, 121);
  assert.equal(seconds, 1 / 30);
  rows.forEach(([, , , x, y, z], frame) => assertNear([x, y, z], [12 * frame, 0, 0], 1e-3, `frame ${frame}`));
});

test('scale, matrices and several roots leave joints where they are', async () => {
  const turned = [0.5, 0.5, 0.5, 0.5];
  const quarter = [0, 0, Math.SQRT1_2, Math.SQRT1_2];
  const chain = [
    { name: 'rig', scale: [0.01, 0.01, 0.01], rotation: quarter, translation: [1, 0, 0] },
    { name: 'hips', parent: 'rig', translation: [0, 100, 0] },
    { name: 'leg', parent: 'hips', translation: [10, -40, 0], scale: [1, 2, 0.5] },
    { name: 'foot', parent: 'leg', translation: [0, -40, 5], rotation: turned },
    { name: 'toe', parent: 'foot', translation: [0, 0, 10] },
    { name: 'toe_end', parent: 'toe', translation: [0, 0, 4] },
    { name: 'prop', translation: [3, 3, 3] },
  ];
  const rotation = (node) => ({ node, path: 'rotation', times: [0, 1], quaternions: [[0, 0, 0, 1], turned] });
  const tracks = [rotation('hips'), rotation('leg'), rotation('foot'), rotation('toe'), { node: 'hips', path: 'translation', times: [0, 1], values: [[0, 100, 0], [50, 90, 0]] }]; // prettier-ignore
  const growing = { node: 'hips', path: 'scale', times: [0, 1], values: [[1, 1, 1], [2, 2, 2]] }; // prettier-ignore
  const moved = { node: 'prop', path: 'translation', times: [0, 1], values: [[3, 3, 3], [0, 1, 0]] }; // prettier-ignore
  for (const [extra, names] of [
    [[], ['rig', 'hips', 'leg', 'foot', 'toe']],
    [[growing], ['rig', 'hips', 'leg', 'foot', 'toe']],
    [[moved], ['root', 'rig', 'hips', 'leg', 'foot', 'toe', 'prop']],
  ]) {
    const model = await daemon.upload(JSON.stringify({ nodes: chain, clips: [{ tracks: [...tracks, ...extra] }] }));
    await assertWritten(model, 'fps=10', { height: 2, names });
    await assertWritten(model, 'fps=10&nodes=all', { height: 2 });
    const { warning } = await bvhOf(`${model}/pose.bvh`);
    assert.match(warning, /scaled unevenly/);
  }
});

test('names without blanks, each once', async () => {
  const nodes = [{ name: 'left arm' }, { name: 'hand', parent: 'left arm' }];
  const track = { node: 'hand', path: 'translation', times: [0], values: [[1, 2, 3]] };
  const { text, warning } = await bvhOf(`${await daemon.upload(JSON.stringify({ nodes, clips: [{ tracks: [track] }] }))}/pose.bvh`);
  assert.deepEqual(parseBvh(text).names, ['left_arm', 'hand']);
  assert.match(warning, /1 name is changed/);
});

test('a figure of glTF is written as it moves', async () => {
  const model = await daemon.upload(readFileSync(join(root, 'server/samples/tank.json')));
  await assertWritten(model, 'clip=drive&fps=15', { height: 3 });
  await assertWritten(model, 'clip=aim&fps=15&from=0.5&to=2', { height: 3 });
});

test('what BVH cannot say is refused, and what is not there', async () => {
  const model = await daemon.upload(mocap(4).text);
  const still = await daemon.upload(JSON.stringify({ nodes: [{ name: 'a', translation: [1, 2, 3] }] }));
  for (const [url, status, detail] of [
    [`${model}/pose.bvh?at=0,1`, 400, 'unknown parameter'],
    [`${model}/pose.bvh?space=world`, 400, 'unknown parameter'],
    [`${model}/pose.bvh?as=matrix`, 400, 'unknown parameter'],
    [`${model}/pose.bvh?unit=radians`, 400, 'unknown parameter'],
    [`${model}/pose.bvh?fps=0`, 400, 'fps must be more than 0'],
    [`${model}/pose.bvh?nodes=nobody`, 404, 'nobody'],
    [`${model}/pose.bvh?clip=nothing`, 404, 'nothing'],
  ]) {
    const answer = await fetch(url);
    const body = await answer.json();
    assert.equal(answer.status, status, url);
    assert.ok(body.detail.includes(detail), body.detail);
  }
  for (const query of ['', '?nodes=all']) assert.deepEqual(parseBvh((await bvhOf(`${still}/pose.bvh${query}`)).text).rows, [[1, 2, 3, 0, 0, 0]]);
  assert.deepEqual(parseBvh((await bvhOf(`${model}/pose.bvh?nodes=LeftLeg`)).text).names, ['Hips', 'LeftHipJoint', 'LeftUpLeg', 'LeftLeg']);
});
