// Figures of any family of rigs, as glTF: a person of 1.75 m in a T-pose that faces +z, with the names, rest rotations and
// humanoid map of the family, a skin over all joints, and clips of turns that are seeded.
import { Quaternion, Vector3 } from 'three';

/** Joint by VRM's name: parent and place. */
const JOINTS = {
  hips: [null, [0, 0.95, 0]],
  spine: ['hips', [0, 1.05, -0.01]],
  chest: ['spine', [0, 1.17, -0.02]],
  upperChest: ['chest', [0, 1.29, -0.02]],
  neck: ['upperChest', [0, 1.46, -0.03]],
  head: ['neck', [0, 1.55, 0]],
  ...Object.assign({}, ...['left', 'right'].map((side, k) => {
    const x = (value) => (k ? -value : value);
    return {
      [`${side}UpperLeg`]: ['hips', [x(0.09), 0.9, 0]],
      [`${side}LowerLeg`]: [`${side}UpperLeg`, [x(0.1), 0.5, 0.01]],
      [`${side}Foot`]: [`${side}LowerLeg`, [x(0.1), 0.09, -0.02]],
      [`${side}Toes`]: [`${side}Foot`, [x(0.11), 0.01, 0.11]],
      [`${side}Shoulder`]: ['upperChest', [x(0.03), 1.42, -0.02]],
      [`${side}UpperArm`]: [`${side}Shoulder`, [x(0.16), 1.43, -0.03]],
      [`${side}LowerArm`]: [`${side}UpperArm`, [x(0.43), 1.43, -0.03]],
      [`${side}Hand`]: [`${side}LowerArm`, [x(0.68), 1.43, -0.02]],
      [`${side}ThumbMetacarpal`]: [`${side}Hand`, [x(0.7), 1.42, 0.02]],
      [`${side}ThumbProximal`]: [`${side}ThumbMetacarpal`, [x(0.73), 1.42, 0.04]],
      [`${side}ThumbDistal`]: [`${side}ThumbProximal`, [x(0.76), 1.42, 0.05]],
      [`${side}IndexProximal`]: [`${side}Hand`, [x(0.77), 1.43, 0]],
      [`${side}IndexIntermediate`]: [`${side}IndexProximal`, [x(0.8), 1.43, 0.005]],
      [`${side}IndexDistal`]: [`${side}IndexIntermediate`, [x(0.83), 1.43, 0.01]],
    };
  })),
};
export const BONES = Object.keys(JOINTS);
export const HEIGHT = 1.75;

const sides = (name, left, right) => [[`left${name}`, left], [`right${name}`, right]];
/** The names of a family: central bones in order, then limbs as [VRM's, left, right]. */
const family = (central, limbs) =>
  Object.fromEntries([...['hips', 'spine', 'chest', 'upperChest', 'neck', 'head'].map((bone, i) => [bone, central[i]]), ...limbs.flatMap((limb) => sides(...limb))]);
const LIMBS = ['UpperLeg', 'LowerLeg', 'Foot', 'Toes', 'Shoulder', 'UpperArm', 'LowerArm', 'Hand', 'ThumbMetacarpal', 'ThumbProximal', 'ThumbDistal', 'IndexProximal', 'IndexIntermediate', 'IndexDistal'];
const limbs = (names, name) => LIMBS.map((limb, i) => [limb, name('Left', names[i]), name('Right', names[i])]);

export const NAMES = {
  vrm: Object.fromEntries(BONES.map((bone) => [bone, bone])),
  vroid: family(
    ['Hips', 'Spine', 'Chest', 'UpperChest', 'Neck', 'Head'].map((name) => `J_Bip_C_${name}`),
    limbs(['UpperLeg', 'LowerLeg', 'Foot', 'ToeBase', 'Shoulder', 'UpperArm', 'LowerArm', 'Hand', 'Thumb1', 'Thumb2', 'Thumb3', 'Index1', 'Index2', 'Index3'], (side, name) => `J_Bip_${side[0]}_${name}`),
  ),
  mixamo: family(
    ['Hips', 'Spine', 'Spine1', 'Spine2', 'Neck', 'Head'].map((name) => `mixamorig:${name}`),
    limbs(['UpLeg', 'Leg', 'Foot', 'ToeBase', 'Shoulder', 'Arm', 'ForeArm', 'Hand', 'HandThumb1', 'HandThumb2', 'HandThumb3', 'HandIndex1', 'HandIndex2', 'HandIndex3'], (side, name) => `mixamorig:${side}${name}`),
  ),
  makehuman: family(
    ['root', 'spine05', 'spine03', 'spine01', 'neck01', 'head'],
    limbs(['upperleg01', 'lowerleg01', 'foot', 'toe', 'clavicle', 'upperarm01', 'lowerarm01', 'wrist', 'finger1-1', 'finger1-2', 'finger1-3', 'finger2-1', 'finger2-2', 'finger2-3'], (side, name) => `${name}.${side[0]}`),
  ),
  unreal: family(
    ['pelvis', 'spine_01', 'spine_02', 'spine_03', 'neck_01', 'head'],
    limbs(['thigh', 'calf', 'foot', 'ball', 'clavicle', 'upperarm', 'lowerarm', 'hand', 'thumb_01', 'thumb_02', 'thumb_03', 'index_01', 'index_02', 'index_03'], (side, name) => `${name}_${side[0].toLowerCase()}`),
  ),
};

/** Numbers in [-1, 1) that a seed decides. */
export function numbersOf(seed) {
  let state = seed >>> 0;
  return () => {
    state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
    return state / 2 ** 31 - 1;
  };
}

function turnOf(random, most) {
  const axis = new Vector3(random(), random(), random()).normalize();
  return new Quaternion().setFromAxisAngle(axis, most * random());
}

const IDENTITY = new Quaternion();

/** Where the joints rest: arms `down` radians below the T-pose, knees so much higher, the whole turned about y, in `scale`. */
function placesOf({ down = 0, knees = 0, turned = 0, scale = 1 }) {
  return Object.fromEntries(
    Object.entries(JOINTS).map(([bone, [, place]]) => {
      const at = new Vector3(...place);
      if (bone.endsWith('LowerLeg')) at.y += knees;
      const side = ['left', 'right'].find((word) => bone.startsWith(word));
      const shoulder = side && new Vector3(...JOINTS[`${side}UpperArm`][1]);
      if (side && !/Leg|Foot|Toes|Shoulder/.test(bone))
        at.sub(shoulder).applyAxisAngle(new Vector3(0, 0, 1), side === 'left' ? -down : down).add(shoulder);
      return [bone, at.applyAxisAngle(new Vector3(0, 1, 0), turned).multiplyScalar(scale)];
    }),
  );
}

const HUMANOIDS = {
  VRMC_vrm: (bones) => ({
    specVersion: '1.0',
    meta: { name: 'figure', authors: ['tests'], licenseUrl: 'https://vrm.dev/licenses/1.0/' },
    humanoid: { humanBones: Object.fromEntries(bones.map(([bone, node]) => [bone, { node }])) },
  }),
  VRM: (bones) => ({
    exporterVersion: 'tests',
    specVersion: '0.0',
    meta: { title: 'figure', author: 'tests', version: '1', licenseName: 'CC0' },
    humanoid: {
      humanBones: bones.map(([bone, node]) => ({ bone: bone.replace('ThumbProximal', 'ThumbIntermediate').replace('ThumbMetacarpal', 'ThumbProximal'), node, useDefaultValues: true })),
    },
  }),
  VRMC_vrm_animation: (bones) => ({ specVersion: '1.0', humanoid: { humanBones: Object.fromEntries(bones.map(([bone, node]) => [bone, { node }])) } }),
};

/**
 * A figure as the text of a glTF. names: of NAMES; extension: a humanoid map's; seed: of rest rotations; without: bones that it
 * lacks; down, knees, turned, scale: as in placesOf; clip: {seed, keys, seconds, most}, turns of all joints and a walk of the hips.
 */
export function biped({ names = 'vrm', extension, seed = 0, without = [], clip, ...shape } = {}) {
  const random = numbersOf(seed);
  const places = placesOf(shape);
  const bones = BONES.filter((bone) => !without.includes(bone));
  const parentOf = (bone) => {
    let [parent] = JOINTS[bone];
    while (parent && without.includes(parent)) [parent] = JOINTS[parent];
    return parent;
  };
  const turned = new Quaternion().setFromAxisAngle(new Vector3(0, 1, 0), shape.turned ?? 0);
  const world = Object.fromEntries(bones.map((bone) => [bone, seed ? turned.clone().multiply(turnOf(random, 3)) : turned.clone()]));
  const local = (bone) => {
    const parent = parentOf(bone);
    const back = (world[parent] ?? IDENTITY).clone().invert();
    const way = places[bone].clone().sub(places[parent] ?? new Vector3()).applyQuaternion(back);
    return { translation: way.toArray(), rotation: back.multiply(world[bone]).toArray() };
  };
  const document = {
    asset: { version: '2.0' },
    scene: 0,
    scenes: [{ nodes: [0] }],
    nodes: bones.map((bone) => {
      const children = bones.flatMap((other, index) => (parentOf(other) === bone ? [index] : []));
      return { name: NAMES[names][bone], ...local(bone), ...(children.length && { children }) };
    }),
    accessors: [],
    bufferViews: [],
  };
  const chunks = [];
  let size = 0;
  const add = (values, type, more) => {
    const bytes = Buffer.from(Float32Array.from(values).buffer);
    document.bufferViews.push({ buffer: 0, byteOffset: size, byteLength: bytes.length });
    size += bytes.length;
    chunks.push(bytes);
    const count = values.length / { SCALAR: 1, VEC3: 3, VEC4: 4, MAT4: 16 }[type];
    return document.accessors.push({ bufferView: document.bufferViews.length - 1, componentType: 5126, count, type, ...more }) - 1;
  };
  if (extension !== 'VRMC_vrm_animation') {
    // a triangle on the hips, which all joints hold
    const at = places.hips.toArray();
    const corners = [0, 1, 2].map((k) => at.map((value, axis) => value + (axis === k ? 0.1 : 0)));
    const binds = bones.flatMap((bone) => {
      const back = world[bone].clone().invert();
      const [x, y, z] = [[1, 0, 0], [0, 1, 0], [0, 0, 1]].map((axis) => new Vector3(...axis).applyQuaternion(back).toArray());
      return [...x, 0, ...y, 0, ...z, 0, ...places[bone].clone().negate().applyQuaternion(back).toArray(), 1];
    });
    document.skins = [{ joints: bones.map((_, index) => index), inverseBindMatrices: add(binds, 'MAT4') }];
    const axis = (k) => corners.map((corner) => Math.fround(corner[k]));
    const bounds = { min: [0, 1, 2].map((k) => Math.min(...axis(k))), max: [0, 1, 2].map((k) => Math.max(...axis(k))) };
    const attributes = {
      POSITION: add(corners.flat(), 'VEC3', bounds),
      JOINTS_0: add([0, 0, 0], 'SCALAR'), // replaced below
      WEIGHTS_0: add([1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0], 'VEC4'),
    };
    Object.assign(document.accessors[attributes.JOINTS_0], { componentType: 5121, type: 'VEC4' }); // zeros
    document.meshes = [{ name: 'skin', primitives: [{ attributes }] }];
    document.scenes[0].nodes.push(document.nodes.push({ name: 'skin', mesh: 0, skin: 0 }) - 1);
  }
  if (extension) {
    document.extensionsUsed = [extension];
    document.extensions = { [extension]: HUMANOIDS[extension](bones.map((bone, index) => [bone, index])) };
  }
  if (clip) {
    const { keys = 9, seconds = 2, most = 1 } = clip;
    const turns = numbersOf(clip.seed);
    const times = Array.from({ length: keys }, (_, key) => Math.fround((key * seconds) / (keys - 1)));
    const input = add(times, 'SCALAR', { min: [0], max: [times[keys - 1]] });
    const [x, y, z] = document.nodes[0].translation;
    const walk = times.flatMap((time) => [x + 0.05 * turns(), y + 0.05 * turns(), z + time * (shape.scale ?? 1)]);
    const samplers = [{ input, output: add(walk, 'VEC3') }];
    const channels = [{ sampler: 0, target: { node: 0, path: 'translation' } }];
    bones.forEach((bone, node) => {
      const rest = new Quaternion(...document.nodes[node].rotation);
      const values = times.flatMap(() => rest.clone().multiply(turnOf(turns, /spine|hest/.test(bone) ? most / 6 : most)).toArray());
      channels.push({ sampler: samplers.push({ input, output: add(values, 'VEC4') }) - 1, target: { node, path: 'rotation' } });
    });
    document.animations = [{ name: 'moves', samplers, channels }];
  }
  if (size) document.buffers = [{ byteLength: size, uri: `data:application/octet-stream;base64,${Buffer.concat(chunks).toString('base64')}` }];
  if (!document.accessors.length) {
    delete document.accessors;
    delete document.bufferViews;
  }
  return JSON.stringify(document);
}
