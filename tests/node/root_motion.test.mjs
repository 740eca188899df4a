// Root motion put back by three: poses and files with it are where they were without, and what is left in place stays there.
import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';

import { Euler, Matrix4, Quaternion, Vector3 } from 'three';

import validator from 'gltf-validator';

import { PoseStream } from '../../api/client/tweend.js';
import { biped } from './biped.mjs';
import { Daemon } from './daemon.mjs';
import { load, nodesOf, playerOf } from './player.mjs';

const daemon = new Daemon();
before(() => daemon.start());
after(() => daemon.remove());

const SECONDS = 4;
const TIMES = [0, 0.3, 0.5, 1.25, 1.9, 2.75, 3.6, 4];
const HEIGHT = 1.8;
const NEAR = 1e-6 * 3 * HEIGHT; // of what the figure walks over
const times = [...Array(17).keys()].map((i) => (i * SECONDS) / 16);
const turn = (...angles) => new Quaternion().setFromEuler(new Euler(...angles, 'YXZ')).toArray().map(Math.fround);

/** Somebody walks a curve, bobs, leans and turns; below an armature or not, which may be turned and scaled. */
function walker(armature) {
  const top = armature ? { parent: 'armature' } : {};
  return {
    nodes: [
      ...(armature ? [{ name: 'armature', ...armature }] : []),
      { name: 'hips', ...top, translation: [0, 1, 0] },
      { name: 'spine', parent: 'hips', translation: [0, 0.3, 0.05] },
      { name: 'head', parent: 'spine', translation: [0.02, 0.5, 0] },
      { name: 'lamp', translation: [5, 5, 5] },
    ],
    clips: [
      {
        name: 'walk',
        tracks: [
          { node: 'hips', path: 'translation', times, values: times.map((t) => [Math.sin(t) + 0.5, 1 + 0.05 * Math.sin(9 * t), 0.8 * t].map(Math.fround)) },
          { node: 'hips', path: 'rotation', times, quaternions: times.map((t) => turn(0.2 * Math.sin(3 * t), 0.4 + 0.9 * t, 0.1 * Math.cos(2 * t))) },
          { node: 'spine', path: 'rotation', times, quaternions: times.map((t) => turn(0.3 * Math.sin(2 * t), 0.2 * t, 0)) },
          { node: 'lamp', path: 'translation', times: [0, 4], values: [[5, 5, 5], [6, 5, 5]] },
        ],
      },
    ],
  };
}
const armatures = {
  'no armature': null,
  'an armature that is turned and scaled': { rotation: turn(-Math.PI / 2, 0.5, 0), scale: [0.9, 0.9, 0.9], translation: [1, 0, 2] },
  'a mirrored armature': { scale: [-1, 1, 1] },
};

const json = async (url) => {
  const answer = await fetch(url);
  const body = await answer.json();
  assert.equal(answer.status, 200, body.detail);
  return body;
};
const matrixOf = ({ translation, rotation }) => new Matrix4().compose(new Vector3(...translation), new Quaternion(...rotation), new Vector3(1, 1, 1));
const far = (a, b) => Math.max(...a.map((value, i) => Math.abs(value - b[i])));

for (const [what, armature] of Object.entries(armatures)) {
  test(`root motion in front of poses gives the clip back: ${what}`, async () => {
    const model = await daemon.upload(JSON.stringify(walker(armature)));
    const whole = await json(`${model}/pose.json?as=matrix&space=world&at=${TIMES}`);
    for (const query of ['root_motion=auto', 'root_motion=hips&root_axes=x,y,z,yaw', 'root_motion=hips&root_axes=yaw', 'root_motion=spine&root_axes=z']) {
      const taken = await json(`${model}/pose.json?as=matrix&space=world&at=${TIMES}&${query}`);
      const top = query.includes('spine') ? 'spine' : 'hips';
      taken.poses.forEach((pose, i) => {
        const motion = matrixOf(pose.root);
        for (const name of [top, 'head']) {
          const node = whole.nodes.indexOf(name);
          const back = motion.clone().multiply(new Matrix4().fromArray(pose.matrix[node])).toArray();
          const error = far(back, whole.poses[i].matrix[node]);
          assert.ok(error < NEAR, `${query}, ${name} at ${TIMES[i]}: ${error}`);
        }
        const lamp = whole.nodes.indexOf('lamp');
        assert.deepEqual(pose.matrix[lamp], whole.poses[i].matrix[lamp]);
      });
      const { translation, rotation } = taken.poses.at(-1).root;
      const moved = far([...translation, ...rotation], [0, 0, 0, 0, 0, 0, 1]);
      assert.ok(moved > 0.1, `${query} moves by ${moved}`);
      assert.deepEqual(taken.poses[0].root, { translation: [0, 0, 0], rotation: [0, 0, 0, 1] });
    }
  });

  test(`what is taken stands still: ${what}`, async () => {
    const model = await daemon.upload(JSON.stringify(walker(armature)));
    const { nodes, poses } = await json(`${model}/pose.json?as=matrix&space=world&at=${TIMES}&in_place=true`);
    const hips = nodes.indexOf('hips');
    const rotationOf = (pose) => {
      const m = new Matrix4().extractRotation(new Matrix4().fromArray(pose.matrix[hips]));
      return m.determinant() < 0 ? m.multiply(new Matrix4().makeScale(-1, 1, 1)) : m;
    };
    const first = rotationOf(poses[0]).invert();
    for (const pose of poses) {
      assert.equal(pose.root, undefined);
      assert.ok(Math.abs(pose.matrix[hips][12] - poses[0].matrix[hips][12]) < NEAR && Math.abs(pose.matrix[hips][14] - poses[0].matrix[hips][14]) < NEAR);
      const since = new Quaternion().setFromRotationMatrix(rotationOf(pose).multiply(first));
      assert.ok(Math.abs(Math.atan(since.y / since.w)) < 1e-5, `it turns by ${2 * Math.atan(since.y / since.w)} about y`);
    }
    const heights = poses.map((pose) => pose.matrix[hips][13]);
    assert.ok(Math.max(...heights) - Math.min(...heights) > 0.02, 'bobbing remains');
  });

  test(`glTF carries the motion above the skeleton: ${what}`, async () => {
    const model = await daemon.upload(JSON.stringify(walker(armature)));
    const files = await Promise.all(['', '&root_motion=auto', '&in_place=true'].map(async (query) => {
      const answer = await fetch(`${model}/surface.glb?level=0&clip=walk&tolerance=0.001&tolerance_m=0.00001${query}`);
      assert.equal(answer.status, 200);
      return load(Buffer.from(await answer.arrayBuffer()));
    }));
    const [whole, carried, still] = files.map((file) => ({ scene: file.scene, play: playerOf(file), nodes: nodesOf(file) }));
    const names = (await Promise.all((await carried.nodes).map((node) => node))).map((node) => node.name);
    assert.equal(names.includes('root'), !armature);
    for (const time of TIMES) {
      for (const one of [whole, carried, still]) one.play(time);
      for (const name of ['hips', 'head']) {
        const [a, b] = [whole, carried].map((one) => one.scene.getObjectByName(name).getWorldPosition(new Vector3()));
        assert.ok(a.distanceTo(b) < 1e-3, `${name} at ${time}: ${a.distanceTo(b)}`);
      }
      const place = still.scene.getObjectByName('hips').getWorldPosition(new Vector3());
      still.play(0);
      const start = still.scene.getObjectByName('hips').getWorldPosition(new Vector3());
      assert.ok(Math.hypot(place.x - start.x, place.z - start.z) < 1e-3, `in place at ${time}`);
    }
  });
}

// A file's scenes list its roots: the node above one of them takes its place.
test('glTF files carry the motion above their roots too', async () => {
  const figure = biped({ names: 'unreal', seed: 7, scale: 0.8, clip: { seed: 6, keys: 31, seconds: 2, most: 0.4 } });
  const model = await daemon.upload(figure);
  for (const query of ['root_motion=auto', 'root_motion=auto&meshes=none', 'root_motion=auto&from=0&to=2&fps=30']) {
    const bytes = Buffer.from(await (await fetch(`${model}/surface.glb?level=0&${query}`)).arrayBuffer());
    const { issues } = await validator.validateBytes(new Uint8Array(bytes));
    assert.equal(issues.numErrors, 0, JSON.stringify(issues.messages.slice(0, 3)));
    const file = await load(bytes);
    const play = playerOf(file);
    const times = [0, 0.5, 1, 2];
    const { nodes, poses } = await json(`${model}/pose.json?space=world&as=matrix&at=${times}`);
    poses.forEach(({ matrix }, i) => {
      play(times[i]);
      for (const name of ['pelvis', 'head', 'hand_l']) {
        const place = file.scene.getObjectByName(name).getWorldPosition(new Vector3());
        assert.ok(far(place.toArray(), matrix[nodes.indexOf(name)].slice(12, 15)) < 2e-3, `${query}: ${name} at ${times[i]}`);
      }
    });
  }
});

test('rows of floats have the motion behind their nodes', async () => {
  const model = await daemon.upload(JSON.stringify(walker()));
  const query = `at=${TIMES}&root_motion=auto&nodes=head,hips`;
  const { nodes, poses } = await json(`${model}/pose.json?${query}`);
  const table = await (await PoseStream.open((await fetch(`${model}/pose.bin?${query}`)).body)).table();
  poses.forEach((pose, i) => {
    for (const part of ['rotation', 'translation']) {
      assert.ok(far([...table.root(i, part)], pose.root[part]) < 1e-7);
      assert.ok(far([...table.part(i, 'hips', part)], pose[part][nodes.indexOf('hips')]) < 1e-7);
    }
  });
});
