// Draws walk.svg from a running daemon's answers: node picture_walk.mjs http://127.0.0.1:8080 > walk.svg
//
// Above: the joints of a BVH file. Below: its clip on two figures of other builds, with other names of bones and other rest poses.

import { draw, facesOf, minus, Styles } from './picture_paths.mjs';

const daemon = process.argv[2];

async function ask(path, body) {
  const answer = await fetch(daemon + path, body === undefined ? {} : { method: 'POST', body });
  if (!answer.ok) throw new Error(`${path}: ${await answer.text()}`);
  return answer.text();
}
const store = async (text) => JSON.parse(await ask('/v1/models', Buffer.from(text))).id;

// ---- the walk: legs are bent until the feet are where they stand, or swing to where they will ------------------------------

const CYCLE = 1.1;
const SPEED = 1.25;
const STANDS = 0.6; // of a cycle
const [HIP, THIGH, SHIN] = [0.92, 0.44, 0.45];
const FPS = 30;
const FRAMES = 181;

/** Height and place along z of a foot, and how far its heel is up. */
function footAt(time, shift) {
  const phase = time / CYCLE + shift;
  const part = phase - Math.floor(phase);
  const stride = SPEED * CYCLE;
  const stand = (Math.floor(phase) - shift + STANDS / 2) * stride;
  const swing = Math.max(0, (part - STANDS) / (1 - STANDS));
  const heel = 0.5 * Math.exp(-(((part - STANDS - 0.03) / 0.09) ** 2)) - 0.3 * Math.exp(-(((part - 0.97) / 0.05) ** 2));
  return { y: 0.09 + 0.12 * Math.sin(Math.PI * swing) ** 2 + 0.1 * Math.max(heel, 0), z: stand + stride * swing * swing * (3 - 2 * swing), heel };
}

/** Degrees about x of the hip and the knee that bring the ankle to y, z from the hip. */
function legTo(y, z) {
  const far = Math.min(Math.hypot(y, z), THIGH + SHIN - 1e-3);
  const knee = Math.acos((far * far - THIGH * THIGH - SHIN * SHIN) / (2 * THIGH * SHIN));
  const hip = Math.atan2(-z, -y) - Math.atan2(SHIN * Math.sin(knee), THIGH + SHIN * Math.cos(knee));
  return [hip, knee];
}

/** [name, offset, turns about x, z and y by time in radians, joints below]. */
function skeleton() {
  const wave = (time, shift = 0) => Math.cos(2 * Math.PI * (time / CYCLE + shift));
  const hips = (time) => [0, HIP - 0.06 + 0.02 * Math.cos((4 * Math.PI * time) / CYCLE + 2.4), SPEED * time];
  const leg = (side, x, shift) => {
    const turns = (time) => {
      const [, y, z] = hips(time);
      const foot = footAt(time, shift);
      return [...legTo(foot.y - y, foot.z - z), foot.heel];
    };
    return [`${side}UpLeg`, [x, 0, 0], (time) => [turns(time)[0], 0, 0], [
      [`${side}Leg`, [0, -THIGH, 0], (time) => [turns(time)[1], 0, 0], [
        [`${side}Foot`, [0, -SHIN, 0], (time) => { const [hip, knee, heel] = turns(time); return [heel - hip - knee, 0, 0]; }, [
          [`${side}ToeBase`, [0, -0.06, 0.13], () => [0, 0, 0], []]]]]]]];
  }; // prettier-ignore
  const arm = (side, x, shift) => [`${side}Arm`, [0.17 * x, 0.2, 0], (time) => [-0.1 - 0.5 * wave(time, shift), -1.3 * x, 0], [
    [`${side}ForeArm`, [0.27 * x, 0, 0], (time) => [0, 0, (-0.5 + 0.3 * wave(time, shift)) * x], [
      [`${side}Hand`, [0.25 * x, 0, 0], () => [0, 0, 0], []]]]]]; // prettier-ignore
  const spine = ['Spine', [0, 0.12, 0], (time) => [0.05, 0, 0.12 * wave(time, 0.45)], [
    ['Chest', [0, 0.16, 0], (time) => [0.03, 0, 0.12 * wave(time, 0.45)], [
      ['Neck', [0, 0.26, 0], () => [0, 0, 0], [['Head', [0, 0.1, 0.01], (time) => [-0.08, 0, -0.2 * wave(time, 0.45)], []]]],
      arm('Left', 1, 0), arm('Right', -1, 0.5)]]]]; // prettier-ignore
  return ['Hips', hips, (time) => [0, 0.04 * wave(time, 0.2), -0.1 * wave(time, 0.45)], [spine, leg('Left', 0.09, 0), leg('Right', -0.09, 0.5)]];
}

function bvh() {
  const columns = [];
  const write = ([name, offset, turns, below], depth) => {
    const pad = '  '.repeat(depth);
    const moves = typeof offset === 'function';
    columns.push((time) => [...(moves ? offset(time) : []), ...turns(time).map((angle) => (angle * 180) / Math.PI)]);
    const channels = `${moves ? '6 Xposition Yposition Zposition' : '3'} Xrotation Zrotation Yrotation`;
    const joints = below.length ? below.map((joint) => write(joint, depth + 1)).join('') : `${pad}  End Site\n${pad}  {\n${pad}    OFFSET 0 0.05 0.05\n${pad}  }\n`;
    return `${pad}${depth ? 'JOINT' : 'ROOT'} ${name}\n${pad}{\n${pad}  OFFSET ${(moves ? [0, HIP, 0] : offset).join(' ')}\n${pad}  CHANNELS ${channels}\n${joints}${pad}}\n`;
  };
  const hierarchy = write(skeleton(), 0);
  const rows = Array.from({ length: FRAMES }, (_, frame) => columns.flatMap((column) => column(frame / FPS)).map((value) => value.toFixed(4)).join(' '));
  return `HIERARCHY\n${hierarchy}MOTION\nFrames: ${FRAMES}\nFrame Time: ${1 / FPS}\n${rows.join('\n')}\n`;
}

// ---- the figures: a rounded box a bone ----------------------------------------------------------------------------------------

/** Tweend JSON. bones: {name: [parent, place, size of the box, its middle, rest rotation]}. */
function figure(bones) {
  const nodes = [];
  const meshes = [];
  for (const [name, [parent, place, [width, height, depth], middle, rotation]] of Object.entries(bones)) {
    meshes.push({ name: `${name} skin`, shape: { kind: 'box', size: [width, height, depth] } });
    nodes.push({ name, ...(parent && { parent }), translation: place, ...(rotation && { rotation }) });
    nodes.push({ name: `${name} skin`, parent: name, mesh: `${name} skin`, translation: middle });
  }
  return JSON.stringify({ meshes, nodes });
}

const R = 1.35; // boxes shrink as they are subdivided
const across = (length, x, thick) => [[R * length, R * thick, R * thick], [(x * length) / 2, 0, 0]];
const down = (length, thick, deep = thick) => [[R * thick, R * length, R * deep], [0, -length / 2, 0]];
const up = (length, wide, deep) => [[R * wide, R * length, R * deep], [0, length / 2, 0]];

/** A tall one with Mixamo's names, in a T-pose. */
function tall() {
  const m = (name) => `mixamorig:${name}`;
  const bones = {
    [m('Hips')]: [null, [0, 1.05, 0], [R * 0.28, R * 0.2, R * 0.2], [0, 0.02, 0]],
    [m('Spine')]: [m('Hips'), [0, 0.1, 0], ...up(0.18, 0.24, 0.17)],
    [m('Spine1')]: [m('Spine'), [0, 0.17, 0], ...up(0.26, 0.32, 0.2)],
    [m('Neck')]: [m('Spine1'), [0, 0.27, 0], ...up(0.1, 0.1, 0.1)],
    [m('Head')]: [m('Neck'), [0, 0.09, 0.01], ...up(0.25, 0.18, 0.21)],
  };
  for (const [side, x] of [['Left', 1], ['Right', -1]])
    Object.assign(bones, {
      [m(`${side}Arm`)]: [m('Spine1'), [0.2 * x, 0.2, 0], ...across(0.3, x, 0.11)],
      [m(`${side}ForeArm`)]: [m(`${side}Arm`), [0.3 * x, 0, 0], ...across(0.28, x, 0.09)],
      [m(`${side}Hand`)]: [m(`${side}ForeArm`), [0.27 * x, 0, 0], ...across(0.17, x, 0.08)],
      [m(`${side}UpLeg`)]: [m('Hips'), [0.1 * x, -0.02, 0], ...down(0.5, 0.17)],
      [m(`${side}Leg`)]: [m(`${side}UpLeg`), [0, -0.48, 0], ...down(0.48, 0.13)],
      [m(`${side}Foot`)]: [m(`${side}Leg`), [0, -0.46, 0], [R * 0.1, R * 0.1, R * 0.24], [0, -0.04, 0.06]],
    });
  return figure(bones);
}

/** A stout one with MakeHuman's names, whose arms rest down. */
function stout() {
  const bones = {
    root: [null, [0, 0.62, 0], [R * 0.42, R * 0.26, R * 0.34], [0, 0.04, 0]],
    spine05: ['root', [0, 0.12, 0], ...up(0.26, 0.46, 0.38)],
    spine01: ['spine05', [0, 0.24, 0], ...up(0.3, 0.44, 0.3)],
    neck01: ['spine01', [0, 0.3, 0], ...up(0.08, 0.14, 0.14)],
    head: ['neck01', [0, 0.06, 0.01], ...up(0.36, 0.3, 0.32)],
  };
  const half = 1.2 / 2;
  for (const [side, x] of [['L', 1], ['R', -1]])
    Object.assign(bones, {
      [`upperarm01.${side}`]: ['spine01', [0.25 * x, 0.2, 0], ...across(0.27, x, 0.15), [0, 0, -x * Math.sin(half), Math.cos(half)]],
      [`lowerarm01.${side}`]: [`upperarm01.${side}`, [0.27 * x, 0, 0], ...across(0.25, x, 0.13)],
      [`wrist.${side}`]: [`lowerarm01.${side}`, [0.24 * x, 0, 0], ...across(0.16, x, 0.12)],
      [`upperleg01.${side}`]: ['root', [0.13 * x, -0.02, 0], ...down(0.28, 0.22)],
      [`lowerleg01.${side}`]: [`upperleg01.${side}`, [0, -0.26, 0], ...down(0.28, 0.18)],
      [`foot.${side}`]: [`lowerleg01.${side}`, [0, -0.26, 0], [R * 0.15, R * 0.12, R * 0.28], [0, -0.03, 0.06]],
    });
  return figure(bones);
}

// ---- the picture --------------------------------------------------------------------------------------------------------------

const TIMES = Array.from({ length: 5 }, (_, i) => 0.5 + (i * CYCLE * 6) / 5);
const view = { yaw: -1.15, pitch: 0.06 };
const ahead = [Math.sin(view.yaw), Math.sin(view.pitch), Math.cos(view.yaw)]; // to the eye

/** A bone as a rhomb that the eye sees from its broad side. */
function rhomb(from, to, colour) {
  const along = minus(to, from);
  const side = [along[1] * ahead[2] - along[2] * ahead[1], along[2] * ahead[0] - along[0] * ahead[2], along[0] * ahead[1] - along[1] * ahead[0]];
  const length = Math.hypot(...side) || 1;
  const bend = (sign) => from.map((x, i) => x + 0.3 * along[i] + (sign * 0.028 * side[i]) / length);
  return { points: [from, bend(1), to, bend(-1)], colour, inside: colour };
}

async function recorded(clip) {
  const { nodes } = JSON.parse(await ask(`/v1/models/${clip}`));
  const { poses } = JSON.parse(await ask(`/v1/models/${clip}/pose.json?space=world&at=${TIMES}`));
  const places = nodes.map(({ name, parent }) => [nodes.findIndex((node) => node.name === name), nodes.findIndex((node) => node.name === parent)]);
  return poses.flatMap(({ translation }) => places.filter(([, parent]) => parent >= 0).map(([node, parent]) => rhomb(translation[parent], translation[node], [150, 154, 166])));
}

async function walking(body, clip, colour) {
  const model = await store(body);
  const faces = [];
  for (const at of TIMES) faces.push(...facesOf(await ask(`/v1/models/${model}/surface.obj?level=1&creases=none&clip=${clip}/motion&retarget=auto&feet=hold&at=${at}`)));
  return faces.map((face) => ({ ...face, colour }));
}

const styles = new Styles();
const clip = await store(bvh());
const rows = [await recorded(clip), await walking(tall(), clip, [104, 150, 190]), await walking(stout(), clip, [216, 140, 88])];
const DOWN = [0, 2.25, 4.05];
const faces = rows.flatMap((row, i) => row.map(({ points, ...rest }) => ({ ...rest, points: points.map(([x, y, z]) => [x, y - DOWN[i], z]) })));
const drawing = draw(styles, faces, view, [20, 20, 1560, 900]);
console.log(`<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 1600 940" stroke-linejoin="round">
<title>The joints of a walk that was recorded as BVH, and two figures of other builds that walk it</title>
<style>${styles}</style>
${drawing}
</svg>`);
