// BVH files as motion capture has them: a biped of 31 joints at 120 frames a second that walks, in every notation that
// such files are met in; and where its joints are, computed from the angles by plain matrices.

/** Name, parent and offset of the joints of the files of Carnegie Mellon's laboratory; lengths in inches by their unit. */
const LIMB = (side, x) => [
  [`${side}HipJoint`, 'Hips', [0, 0, 0]],
  [`${side}UpLeg`, `${side}HipJoint`, [1.36 * x, -1.79, 0.84]],
  [`${side}Leg`, `${side}UpLeg`, [2.45 * x, -6.73, 0]],
  [`${side}Foot`, `${side}Leg`, [2.56 * x, -7.04, 0]],
  [`${side}ToeBase`, `${side}Foot`, [0.16 * x, -0.43, 2.27]],
];
const ARM = (side, x) => [
  [`${side}Shoulder`, 'Spine1', [0, 0, 0]],
  [`${side}Arm`, `${side}Shoulder`, [3.36 * x, 1.2, -0.31]],
  [`${side}ForeArm`, `${side}Arm`, [4.98 * x, -0.01, -0.01]],
  [`${side}Hand`, `${side}ForeArm`, [3.48 * x, 0, 0]],
  [`${side}FingerBase`, `${side}Hand`, [0, 0, 0]],
  [`${side}HandIndex1`, `${side}FingerBase`, [0.72 * x, 0, 0]],
  [`${side}Thumb`, `${side}Hand`, [0, 0, 0]],
];
const SKELETON = [
  ['Hips', null, [0, 0, 0]],
  ...LIMB('Left', 1),
  ...LIMB('Right', -1),
  ['LowerBack', 'Hips', [0, 0, 0]],
  ['Spine', 'LowerBack', [0.02, 2.04, -0.03]],
  ['Spine1', 'Spine', [0.03, 2.05, -0.2]],
  ['Neck', 'Spine1', [0, 0, 0]],
  ['Neck1', 'Neck', [0.02, 1.67, 0.12]],
  ['Head', 'Neck1', [0.05, 1.7, -0.38]],
  ...ARM('Left', 1),
  ...ARM('Right', -1),
];
/** Of the figure, from the toes to the end of the head. */
export const HEIGHT = 24;

/** Numbers in [0, 1) that a seed decides. */
function numbersOf(seed) {
  let state = seed >>> 0;
  return () => {
    state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
    return state / 2 ** 32;
  };
}

const ROTATIONS = ['Zrotation', 'Yrotation', 'Xrotation'];
const POSITIONS = ['Xposition', 'Yposition', 'Zposition'];

/** Channels of a joint. mixed: any order and number, or 'orders' for three of a kind; positions on any joint, as the random numbers
 *  have it. */
function channelsOf(index, mixed, random) {
  if (!mixed) return index === 0 ? [...POSITIONS, ...ROTATIONS] : [...ROTATIONS];
  const shuffled = (list) => list.map((word) => [random(), word]).sort(([a], [b]) => a - b).map(([, word]) => word);
  const rotations = shuffled(ROTATIONS).slice(0, mixed !== 'orders' && random() < 0.2 ? 1 + Math.floor(random() * 2) : 3);
  const positions = index === 0 || random() < 0.2 ? shuffled(POSITIONS).slice(0, mixed !== 'orders' && random() < 0.3 ? 1 : 3) : [];
  return random() < 0.5 ? [...positions, ...rotations] : [...rotations, ...positions];
}

/** Joints with their channels and, per leaf, an end site: {name, parent, offset, channels, end}. */
function jointsOf({ mixed = false, odd = false, seed = 1 }) {
  const random = numbersOf(seed);
  const indices = new Map(SKELETON.map(([name], index) => [name, index]));
  const rename = { LeftHand: 'Left Hand', RightHandIndex1: 'RightHandEnd', Head: 'End Site of the neck', Neck1: 'End', RightThumb: 'JOINT' };
  return SKELETON.map(([name, parent, offset], index) => ({
    name: odd ? (rename[name] ?? name) : name,
    parent: parent === null ? -1 : indices.get(parent),
    offset,
    channels: channelsOf(index, mixed, random),
    end: SKELETON.some(([, other]) => other === name) ? null : [0.3 * (offset[0] || 1), 0.5, 0.25],
  }));
}

/** What a channel says in a frame: a walk of two steps a second; wide turns of some joints pass 180 degrees and wrap. */
function valueOf(joint, index, channel, seconds, wraps, random) {
  const phase = 2 * Math.PI * seconds + index;
  if (channel.endsWith('position')) {
    const axis = 'XYZ'.indexOf(channel[0]);
    const from = index === 0 ? [0, 17, 30 * seconds][axis] : joint.offset[axis];
    return from + 0.4 * Math.sin(2 * phase + axis);
  }
  const wide = wraps && index % 5 === 2 ? 200 : 35;
  const angle = wide * Math.sin(phase + channel.charCodeAt(0)) + (random() - 0.5) * 0.2;
  return wide === 200 && Math.abs(angle) > 180 ? angle - 360 * Math.sign(angle) : angle;
}

/**
 * A file and what it holds. frames: how many; style: lineEnd, indent, blankLines, trailing, endNames, brace ('line' or
 * 'same'), frameTime (as it is written), claimed (what Frames: says), odd (names), mixed (channels), wraps, seed, say (what
 * a channel of a joint says at a time).
 */
export function mocap(frames, style = {}) {
  const { lineEnd = '\n', indent = '\t', blankLines = false, trailing = false, endNames = false, brace = 'line' } = style;
  const { frameTime = '.0083333', claimed = frames, wraps = false, seed = 1, say } = style;
  const joints = jointsOf(style);
  const random = numbersOf(seed + 1);
  const lines = ['HIERARCHY'];
  const open = (line, pad) => lines.push(...(brace === 'line' ? [pad + line, `${pad}{`] : [`${pad}${line} {`]));
  const write = (index, depth) => {
    const { name, offset, channels, end } = joints[index];
    const pad = indent.repeat(depth);
    const inner = indent.repeat(depth + 1);
    open(`${depth ? 'JOINT' : 'ROOT'} ${name}`, pad);
    lines.push(`${inner}OFFSET ${offset.join(blankLines ? '\t ' : ' ')}`, `${inner}CHANNELS ${channels.length} ${channels.join(' ')}`);
    joints.forEach((joint, child) => joint.parent === index && write(child, depth + 1));
    if (end) {
      open(endNames ? `End Site ${name}Tip` : 'End Site', inner);
      lines.push(`${inner}${indent}OFFSET ${end.join(' ')}`, `${inner}}`);
    }
    lines.push(`${pad}}`);
  };
  write(0, 0);
  const values = Array.from({ length: frames }, (_, frame) =>
    joints.flatMap((joint, index) =>
      joint.channels.map((channel) => Number((say ? say(joint.name, channel, frame / 120) : valueOf(joint, index, channel, frame / 120, wraps, random)).toFixed(4))),
    ),
  );
  lines.push('MOTION', `Frames: ${claimed}`, `Frame Time: ${frameTime}`, ...values.map((row) => row.join(' ')));
  const text = lines.flatMap((line) => [line + (trailing ? ' \t ' : ''), ...(blankLines ? [''] : [])]).join(lineEnd) + lineEnd;
  return { text, joints, values, seconds: Number(frameTime) };
}

const multiply = (a, b) => a.map((row) => [0, 1, 2].map((column) => row.reduce((sum, value, k) => sum + value * b[k][column], 0)));
const apply = (m, v) => m.map((row) => row.reduce((sum, value, k) => sum + value * v[k], 0));
const IDENTITY = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]; // prettier-ignore

function turnAbout(axis, degrees) {
  const c = Math.cos((degrees * Math.PI) / 180);
  const s = Math.sin((degrees * Math.PI) / 180);
  const [x, y, z] = [axis === 0, axis === 1, axis === 2].map(Number);
  return [
    [x + c * (1 - x), -s * z, s * y],
    [s * z, y + c * (1 - y), -s * x],
    [-s * y, s * x, z + c * (1 - z)],
  ];
}

/** {rotation, translation} of each joint in one frame: the product of its rotations in their order. */
export function localsAt({ joints, values }, frame) {
  let at = 0;
  return joints.map(({ offset, channels }) => {
    const translation = [...offset];
    let rotation = IDENTITY;
    for (const channel of channels) {
      const axis = 'XYZ'.indexOf(channel[0]);
      const value = values[frame][at++];
      if (channel.endsWith('position')) translation[axis] = value;
      else rotation = multiply(rotation, turnAbout(axis, value));
    }
    return { rotation, translation };
  });
}

/** {rotation, translation} of each joint in the world. */
export function worldAt(file, frame) {
  const world = [];
  localsAt(file, frame).forEach(({ rotation, translation }, index) => {
    const parent = world[file.joints[index].parent] ?? { rotation: IDENTITY, translation: [0, 0, 0] };
    world.push({
      rotation: multiply(parent.rotation, rotation),
      translation: apply(parent.rotation, translation).map((value, k) => value + parent.translation[k]),
    });
  });
  return world;
}
