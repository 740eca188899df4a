// Faces of VRM characters: expressions and gaze of a VRMA, against @pixiv/three-vrm and three-vrm-animation, and against the
// rules of VRMC_vrm 1.0 where these differ from it:
// - up and down: its eyes turn up by the range of down, and the other way round. Here it gets the ranges exchanged.
// - keys: it plays STEP and CUBICSPLINE keys of expressions as LINEAR ones, and weights outside of 0 to 1 as they are.
// - an expression that overrides its own kind holds itself back there.
import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';

import { VRMAnimationLoaderPlugin, createVRMAnimationClip } from '@pixiv/three-vrm-animation';
import { VRMLoaderPlugin } from '@pixiv/three-vrm';
import { AnimationMixer, Euler, LoopOnce, Quaternion } from 'three';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';

import { BONES, NAMES, biped } from './biped.mjs';
import { Daemon } from './daemon.mjs';
import { load, nodesOf, playerOf } from './player.mjs';

const TIMES = [0, 0.1, 0.25, 0.4, 0.5, 0.61, 0.75, 0.9, 1, 1.2, 1.45, 1.5, 1.7, 2, 2.5];
const NEAR = 2e-4; // the tolerance of what is not linear between keys, of weights; of eyes' quaternions 0.05 degrees are more

const daemon = new Daemon();
before(() => daemon.start());
after(() => daemon.remove());

const idOf = (address) => address.split('/').pop();

/** A range map; down and up differ. */
const RANGES = { inner: [60, 12], outer: [80, 20], down: [45, 9], up: [70, 15] };
const GAZES = {
  VRMC_vrm: (type, ranges, scale) => ({
    lookAt: {
      type,
      offsetFromHeadBone: [0, 0.06, 0],
      ...Object.fromEntries(
        Object.entries({ HorizontalInner: 'inner', HorizontalOuter: 'outer', VerticalDown: 'down', VerticalUp: 'up' }).map(([name, range]) => [
          `rangeMap${name}`,
          { inputMaxValue: ranges[range][0], outputScale: ranges[range][1] * scale },
        ]),
      ),
    },
  }),
  VRM: (type, ranges, scale) => ({
    firstPerson: {
      lookAtTypeName: type === 'bone' ? 'Bone' : 'BlendShape',
      ...Object.fromEntries(
        Object.entries({ HorizontalInner: 'inner', HorizontalOuter: 'outer', VerticalDown: 'down', VerticalUp: 'up' }).map(([name, range]) => [
          `lookAt${name}`,
          { curve: [0, 0, 0, 1, 1, 1, 1, 0], xRange: ranges[range][0], yRange: ranges[range][1] * scale },
        ]),
      ),
    },
  }),
};

/** Expressions by VRM 1.0's names: binds as [node, target, weight]. */
const EXPRESSIONS = {
  happy: { binds: [['face', 0, 0.8], ['face', 1, 0.3], ['brows', 2, 1]], overrideBlink: 'blend', overrideMouth: 'block' },
  sad: { binds: [['face', 2, 0.7]], isBinary: true, overrideLookAt: 'blend' },
  blink: { binds: [['face', 1, 1]] },
  blinkLeft: { binds: [['face', 3, 0.9]], isBinary: true },
  aa: { binds: [['face', 4, 0.6]] },
  lookUp: { binds: [['brows', 0, 1]] },
  lookDown: { binds: [['brows', 1, 1]] },
  lookLeft: { binds: [['brows', 3, 0.5]] },
  lookRight: { binds: [['brows', 3, 1], ['brows', 4, 1]] },
  smirk: { binds: [['brows', 2, 0.4]] },
};
const OLDER = { happy: 'joy', sad: 'sorrow', blinkLeft: 'blink_l', aa: 'a', lookUp: 'lookup', lookDown: 'lookdown', lookLeft: 'lookleft', lookRight: 'lookright' };

const WRITE = {
  VRMC_vrm(document, indexOf, expressions) {
    const written = (name) => {
      const { binds, ...more } = expressions[name];
      return [name, { ...more, morphTargetBinds: binds.map(([node, index, weight]) => ({ node: indexOf(node), index, weight })) }];
    };
    const custom = (name) => !/^(happy|sad|blink|blinkLeft|aa|look.*)$/.test(name);
    const pick = (fits) => Object.fromEntries(Object.keys(expressions).filter(fits).map(written));
    document.extensions.VRMC_vrm.expressions = { preset: pick((name) => !custom(name)), custom: pick(custom) };
  },
  VRM(document, indexOf, expressions) {
    const groups = Object.entries(expressions).map(([name, { binds, isBinary = false }]) => ({
      name: name === 'smirk' ? name : name.toUpperCase(),
      presetName: name === 'smirk' ? 'unknown' : (OLDER[name] ?? name),
      isBinary,
      binds: binds.map(([node, index, weight]) => ({ mesh: document.nodes[indexOf(node)].mesh, index, weight: 100 * weight })),
      materialValues: [],
    }));
    document.extensions.VRM.blendShapeMaster = { blendShapeGroups: groups };
  },
};

/** A figure with eyes, and two nodes whose meshes have five morph targets. */
function figureOf(extension, type, { ranges = RANGES, expressions = EXPRESSIONS, turned = extension === 'VRM' ? Math.PI : 0 } = {}) {
  const document = JSON.parse(biped({ names: 'vroid', extension, seed: 5, turned }));
  const head = BONES.indexOf('head');
  const eyes = ['left', 'right'].map((side, k) => {
    const turn = new Quaternion().setFromEuler(new Euler(0.3 - k, 0.2 + k, -0.4));
    return document.nodes.push({ name: `${side}Eye`, translation: [k ? -0.03 : 0.03, 0.06, 0.05], rotation: turn.toArray() }) - 1;
  });
  document.nodes[head].children = [...(document.nodes[head].children ?? []), ...eyes];
  const bones = document.extensions[extension].humanoid.humanBones;
  eyes.forEach((node, k) => {
    const bone = k ? 'rightEye' : 'leftEye';
    if (Array.isArray(bones)) bones.push({ bone, node, useDefaultValues: true });
    else bones[bone] = { node };
  });
  const { POSITION } = document.meshes[0].primitives[0].attributes;
  ['face', 'brows'].forEach((name) => {
    const weights = [0.25, 0, 0, 0, 0.5]; // of which expressions take all but the brows' last where the eyes turn as bones
    const mesh = document.meshes.push({ name, weights, primitives: [{ attributes: { POSITION }, targets: weights.map(() => ({ POSITION })) }] }) - 1;
    document.scenes[0].nodes.push(document.nodes.push({ name, mesh }) - 1);
  });
  const indexOf = (name) => document.nodes.findIndex((node) => node.name === name);
  WRITE[extension](document, indexOf, expressions);
  Object.assign(document.extensions[extension], GAZES[extension](type, ranges, type === 'bone' ? 1 : 0.1));
  return document;
}

const turnOf = (yaw, pitch) => new Quaternion().setFromEuler(new Euler((pitch * Math.PI) / 180, (yaw * Math.PI) / 180, 0, 'YXZ')).toArray();
const MOVES = {
  happy: [[0, 0], [0.5, 0.2], [1, 1], [1.5, 0], [2, 0]],
  sad: [[0, 1], [0.4, 0], [2, 1]],
  blink: [[0, 1], [0.25, 1], [1, 0.5], [2, 1]],
  blinkLeft: [[0, 0], [0.5, 1], [1.25, 0.1], [2, 0.9]],
  aa: [[0, 1], [2, 0.5]],
  smirk: [[0.5, 0], [1.5, 1]],
};
const GAZE = [[0, turnOf(0, 0)], [0.5, turnOf(40, 20)], [1, turnOf(-30, -25)], [1.5, turnOf(-89, 60)], [2, turnOf(10, -75)]];

/** A VRMA. moves: keys of expressions as [time, weight], or {keys, interpolation}; gaze: as [time, quaternion]. */
function motionOf({ moves = MOVES, gaze = GAZE, body = true, eye = false, names = Object.keys(moves) } = {}) {
  const document = JSON.parse(biped({ extension: 'VRMC_vrm_animation', seed: 9, ...(body && { clip: { seed: 3, most: 0.3 } }) }));
  const chunks = body ? [Buffer.from(document.buffers[0].uri.split(',')[1], 'base64')] : [];
  const { bufferViews = [], accessors = [], animations = [{ name: 'moves', samplers: [], channels: [] }] } = document;
  const add = (values, type, more) => {
    const bytes = Buffer.from(Float32Array.from(values).buffer);
    const byteOffset = chunks.reduce((sum, chunk) => sum + chunk.length, 0);
    chunks.push(bytes);
    const bufferView = bufferViews.push({ buffer: 0, byteOffset, byteLength: bytes.length }) - 1;
    return accessors.push({ bufferView, componentType: 5126, count: values.length / { SCALAR: 1, VEC3: 3, VEC4: 4 }[type], type, ...more }) - 1;
  };
  const [{ samplers, channels }] = animations;
  const track = (node, path, keys, values, type, interpolation = 'LINEAR') => {
    const input = add(keys, 'SCALAR', { min: [keys[0]], max: [keys.at(-1)] });
    channels.push({ sampler: samplers.push({ input, output: add(values, type), interpolation }) - 1, target: { node, path } });
  };
  const extension = document.extensions.VRMC_vrm_animation;
  extension.expressions = { preset: {}, custom: {} };
  for (const name of names) {
    const { keys = moves[name], interpolation } = Array.isArray(moves[name]) ? {} : moves[name];
    const node = document.nodes.push({ name: `expression ${name}` }) - 1;
    document.scenes[0].nodes.push(node);
    extension.expressions[/smirk|wink/.test(name) ? 'custom' : 'preset'][name] = { node };
    track(node, 'translation', keys.map(([time]) => time), keys.flatMap(([, ...weights]) => weights.flatMap((weight) => [weight, 7, -3])), 'VEC3', interpolation);
  }
  if (eye) {
    const node = document.nodes.push({ name: 'leftEye' }) - 1;
    document.scenes[0].nodes.push(node);
    track(node, 'rotation', [0, 2], [...turnOf(5, 70), ...turnOf(-60, 5)], 'VEC4');
  }
  if (gaze) {
    const node = document.nodes.push({ name: 'gaze' }) - 1;
    document.scenes[0].nodes.push(node);
    extension.lookAt = { node, offsetFromHeadBone: [0, 0.06, 0] };
    track(node, 'rotation', gaze.map(([time]) => time), gaze.flatMap(([, turn]) => turn), 'VEC4');
  }
  const bytes = Buffer.concat(chunks);
  return JSON.stringify({ ...document, bufferViews, accessors, animations, buffers: [{ byteLength: bytes.length, uri: `data:application/octet-stream;base64,${bytes.toString('base64')}` }] });
}

async function ask(url) {
  const answer = await fetch(url);
  const body = await answer.json();
  assert.equal(answer.status, 200, body.detail);
  return { ...body, warning: decodeURIComponent(answer.headers.get('x-tweend-warning') ?? '') };
}

/** Weights and eyes at TIMES as three-vrm has them: [{face, brows, leftEye, rightEye}]. */
async function threeOf(figure, motion) {
  const loader = new GLTFLoader().register((parser) => new VRMLoaderPlugin(parser)).register((parser) => new VRMAnimationLoaderPlugin(parser));
  const gltf = await loader.parseAsync(JSON.stringify(figure), '');
  const { vrm } = gltf.userData;
  const [animation] = (await loader.parseAsync(motion, '')).userData.vrmAnimations;
  const mixer = new AnimationMixer(vrm.scene);
  const action = mixer.clipAction(createVRMAnimationClip(animation, vrm)).setLoop(LoopOnce);
  action.clampWhenFinished = true;
  action.play();
  const nodes = await gltf.parser.getDependencies('node');
  const named = (name) => nodes[figure.nodes.findIndex((node) => node.name === name)];
  return TIMES.map((time) => {
    action.paused = false;
    mixer.setTime(time);
    vrm.update(0);
    const weights = Object.fromEntries(['face', 'brows'].map((name) => [name, [...named(name).morphTargetInfluences]]));
    const eyes = Object.fromEntries(['leftEye', 'rightEye'].map((name) => [name, named(name).quaternion.toArray()]));
    return { ...weights, ...eyes };
  });
}

function assertWeights(found, wanted, what) {
  const error = Math.max(...wanted.map((weight, i) => Math.abs(weight - found[i])));
  assert.ok(found.length === wanted.length && error <= NEAR, `${what}: ${found} for ${wanted}`);
}

function assertTurn(found, wanted, what) {
  const error = new Quaternion(...found).angleTo(new Quaternion(...wanted));
  assert.ok(error <= 1e-3, `${what}: ${(error * 180) / Math.PI} degrees away`);
}

for (const extension of ['VRMC_vrm', 'VRM'])
  for (const type of ['bone', 'expression'])
    for (const retarget of ['auto', 'none'])
      test(`expressions and gaze by ${type} of a VRMA move a ${extension} as in three-vrm, retarget=${retarget}`, async () => {
        const exchanged = type === 'bone' ? { ...RANGES, down: RANGES.up, up: RANGES.down } : RANGES;
        const motion = motionOf();
        const wanted = await threeOf(figureOf(extension, type, { ranges: exchanged }), motion);
        const model = await daemon.upload(JSON.stringify(figureOf(extension, type)));
        const query = `clip=${idOf(await daemon.upload(motion))}/moves&retarget=${retarget}`;
        const { nodes, poses, warning } = await ask(`${model}/pose.json?${query}&at=${TIMES}`);
        assert.ok(retarget === 'none' || warning === '', warning);
        assert.doesNotMatch(warning, /expression|gaze/);
        poses.forEach(({ weights, rotation }, i) => {
          for (const name of ['face', 'brows']) assertWeights(weights[name], wanted[i][name], `${name} at ${TIMES[i]}`);
          for (const name of ['leftEye', 'rightEye']) assertTurn(rotation[nodes.indexOf(name)], wanted[i][name], `${name} at ${TIMES[i]}`);
        });

        const glb = Buffer.from(await (await fetch(`${model}/surface.glb?level=0&${query}`)).arrayBuffer());
        const gltf = await load(glb);
        const seek = playerOf(gltf);
        const played = await nodesOf(gltf);
        TIMES.forEach((time, i) => {
          seek(time);
          for (const name of ['face', 'brows'])
            assertWeights(played.find((node) => node.name === name).morphTargetInfluences, wanted[i][name], `${name} in the GLB at ${time}`);
          for (const name of ['leftEye', 'rightEye'])
            assertTurn(played.find((node) => node.name === name).quaternion.toArray(), wanted[i][name], `${name} in the GLB at ${time}`);
        });

        const posed = await (await fetch(`${model}/surface.gltf?level=0&${query}&at=0.61`)).json();
        for (const name of ['face', 'brows']) assertWeights(posed.nodes.find((node) => node.name === name).weights, wanted[5][name], `${name}, posed`);
      });

// ---- where the specification says more than three-vrm does

const weightsOf = async (expressions, moves, times, more = {}) => {
  const model = await daemon.upload(JSON.stringify(figureOf('VRMC_vrm', 'expression', { expressions })));
  const lender = await daemon.upload(motionOf({ moves, gaze: null, body: false, ...more }));
  const { poses, warning } = await ask(`${model}/pose.json?clip=${idOf(lender)}/moves&retarget=auto&at=${times}`);
  return { rows: poses.map(({ weights }) => weights?.face), warning };
};

test('weights of expressions are clamped, and so are sums that hold others back', async () => {
  const expressions = {
    happy: { binds: [['face', 0, 1]], overrideMouth: 'blend' },
    sad: { binds: [['face', 1, 0.5]], overrideMouth: 'blend' },
    aa: { binds: [['face', 2, 1]] },
  };
  const { rows } = await weightsOf(expressions, { happy: [[0, -1], [1, 2]], sad: [[0, 0.25], [1, 0.25]], aa: [[0, 1], [1, 1]] }, [0, 0.3, 0.5, 0.55, 0.9, 1]);
  const wanted = [0, 0.3, 0.5, 0.55, 0.9, 1].map((t) => {
    const happy = Math.min(Math.max(3 * t - 1, 0), 1);
    return [happy, 0.125, 1 - Math.min(happy + 0.25, 1), 0, 0.5];
  });
  rows.forEach((row, i) => assertWeights(row, wanted[i], `row ${i}`));
});

test('an expression does not hold back its own kind, and binary ones jump where their weight passes 0.5', async () => {
  const expressions = { blink: { binds: [['face', 0, 1]], overrideBlink: 'block' }, sad: { binds: [['face', 1, 1]], isBinary: true } };
  const times = [0, 0.499, 0.501, 1, 2];
  const { rows } = await weightsOf(expressions, { blink: [[0, 0.5], [2, 1]], sad: [[0, 0], [1, 1], [2, 0.6]] }, times);
  rows.forEach((row, i) => assertWeights(row, [0.5 + times[i] / 4, times[i] > 0.5 ? 1 : 0, 0, 0, 0.5], `at ${times[i]}`));
});

test('STEP and CUBICSPLINE keys of expressions play as such', async () => {
  const expressions = { happy: { binds: [['face', 0, 1]] }, sad: { binds: [['face', 1, 1]] } };
  const moves = {
    happy: { keys: [[0, 0.1], [1, 0.9]], interpolation: 'STEP' },
    sad: { keys: [[0, 0, 0, 1], [1, 0, 1, 0]], interpolation: 'CUBICSPLINE' }, // in-tangent, value, out-tangent
  };
  const times = [0, 0.2, 0.5, 0.99, 1];
  const { rows } = await weightsOf(expressions, moves, times);
  const spline = (t) => t * (1 - t) ** 2 + (3 * t ** 2 - 2 * t ** 3);
  rows.forEach((row, i) => assertWeights(row, [times[i] < 1 ? 0.1 : 0.9, spline(times[i]), 0, 0, 0.5], `at ${times[i]}`));
});

test('what a character lacks is told by name, and a clip of a face alone needs no skeleton', async () => {
  const expressions = { happy: { binds: [['face', 0, 1]], materialColorBinds: [{ material: 0, type: 'color', targetValue: [1, 0, 0, 1] }] } };
  const { rows, warning } = await weightsOf(expressions, { happy: [[0, 1]], wink: [[0, 1]], sad: [[0, 1]] }, [0], { gaze: GAZE });
  assertWeights(rows[0], [1, 0, 0, 0, 0.5], 'the face');
  assert.match(warning, /^3; /);
  const model = await daemon.upload(JSON.stringify(figureOf('VRMC_vrm', 'expression', { expressions })));
  const lender = await daemon.upload(motionOf({ moves: { happy: [[0, 1]], wink: [[0, 1]], sad: [[0, 1]] }, body: false }));
  const { other_tracks: tracks, retarget } = await ask(`${model}/tracks?clip=${idOf(lender)}/moves&retarget=auto`);
  assert.deepEqual(tracks.map(({ node, path }) => `${node} ${path}`), ['face weights']);
  assert.deepEqual(retarget.bones, []);
});

test('eyes follow the gaze where a track of the clip moves one of them, too', async () => {
  const model = await daemon.upload(JSON.stringify(figureOf('VRMC_vrm', 'bone')));
  for (const retarget of ['none', 'auto']) {
    const eyes = async (options) => {
      const lender = idOf(await daemon.upload(motionOf(options)));
      return (await ask(`${model}/pose.json?clip=${lender}/moves&retarget=${retarget}&nodes=leftEye,rightEye&at=${TIMES}`)).poses.map(({ rotation }) => rotation);
    };
    assert.deepEqual(await eyes({ eye: true }), await eyes());
    assert.notDeepEqual(await eyes({ eye: true, gaze: null }), await eyes({ gaze: null }), 'else it moves the eye');
  }
});

test('layers of a mixed clip move a face, but not nodes that they leave alone', async () => {
  const figure = figureOf('VRMC_vrm', 'expression');
  const model = await daemon.upload(JSON.stringify(figure));
  const clip = `${idOf(await daemon.upload(motionOf()))}/moves`;
  const nodes = figure.nodes.map(({ name, translation, rotation }, i) => {
    const parent = figure.nodes.find(({ children }) => children?.includes(i));
    return { name, translation, rotation, ...(parent && { parent: parent.name }) };
  });
  const layers = {
    whole: [{ clip, retarget: 'auto' }],
    named: [{ clip }],
    half: [{ clip, retarget: 'auto', mode: 'additive', weight: 0.5 }],
    brows: [{ clip, retarget: 'auto', nodes: ['brows'] }],
  };
  const mixed = idOf(await daemon.upload(JSON.stringify({ nodes, clips: Object.entries(layers).map(([name, list]) => ({ name, layers: list })) })));
  const weights = async (name) => (await ask(`${model}/pose.json?clip=${name}&at=${TIMES}`)).poses.map((pose) => pose.weights);
  const plain = (await ask(`${model}/pose.json?clip=${clip}&retarget=auto&at=${TIMES}`)).poses.map((pose) => pose.weights);
  assert.deepEqual(await weights(`${mixed}/whole`), plain);
  assert.deepEqual(await weights(`${mixed}/named`), plain);
  const rest = { face: [0.25, 0, 0, 0, 0.5], brows: [0.25, 0, 0, 0, 0.5] };
  (await weights(`${mixed}/half`)).forEach((row, i) => {
    for (const name of ['face', 'brows']) assertWeights(row[name], rest[name].map((weight, k) => weight + (plain[i][name][k] - plain[0][name][k]) / 2), `${name}, added, in row ${i}`);
  });
  assert.deepEqual(await weights(`${mixed}/brows`), plain.map(({ brows }) => ({ brows })));
});
